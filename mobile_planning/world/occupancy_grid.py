"""The occupancy grid: cells, their values, and where they lie in the world.

This file is the only one that turns cells into metres and back. A cell is named
(x, y) = (column, row), its value stands in ``data[y, x]``, and row 0 has the
lowest y of the grid's own frame. The origin is the pose of the lower-left CORNER
of cell (0, 0), as in ``nav_msgs/OccupancyGrid``; cell centres lie half a cell
further in.
"""
from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput, LimitExceeded
from mobile_planning.geometry import finite_points, wrap_angle
from mobile_planning.world.inflation import grown

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
OCCUPIED_FROM = 65
MAX_SIDE = 32767
MAX_CELLS = 100_000_000
MIN_RESOLUTION = 1e-6
# A float64 of 1e9 m still tells 0.1 um apart; further out the cells of a map would melt into each other.
MAX_COORDINATE = 1e9

# Beyond these a point has no cell index in an int64; it is outside any grid anyway.
_FAR_METRES, _FAR_CELLS = 1e100, 2.0 ** 62


def check_size(width: int, height: int) -> None:
    """Refuse a grid that is empty or larger than we handle.

    Parameters
    ----------
    width, height : int [cells]

    Raises
    ------
    InvalidInput
        If a side is not positive.
    LimitExceeded
        If a side is above 32767 or the grid has more than 1e8 cells.
    """
    if width < 1 or height < 1:
        raise InvalidInput(f'a grid of {width} x {height} cells is empty: each side must have at least 1')
    if max(width, height) > MAX_SIDE:
        raise LimitExceeded(f'a grid of {width} x {height} cells has a side above the limit of {MAX_SIDE}')
    if width * height > MAX_CELLS:
        raise LimitExceeded(f'a grid of {width} x {height} = {width * height} cells is above the limit of {MAX_CELLS}')


class OccupancyGrid:
    """A map of square cells, each free (0), occupied (100), between, or unknown (-1).

    Parameters
    ----------
    data : (h, w) array_like of int or bool
        Cell values -1..100, row 0 at the lowest y; ``True`` counts as 100. The
        array is copied, and the grid's own copy is read-only.
    resolution : float [m]
        Side of a cell.
    origin : (3,) array_like [m, m, rad]
        Pose (x, y, yaw) of the lower-left corner of cell (0, 0) in the map frame.

    Attributes
    ----------
    data : (h, w) ndarray of int8, read-only
    resolution : float [m]
    origin : tuple of three float [m, m, rad]
        The yaw is in (-pi, pi].

    Raises
    ------
    InvalidInput
        If a number is not finite or out of its range.
    LimitExceeded
        If a side has more than 32767 cells or the grid more than 1e8.

    Examples
    --------
    >>> grid = OccupancyGrid([[0, 0, 0], [0, 100, -1]], resolution=0.5, origin=(1.0, 2.0, 0.0))
    >>> grid.world_to_cell((1.7, 2.6)), grid.cell_to_world((1, 1))
    (array([1, 1]), array([1.75, 2.75]))
    >>> grid.occupied().astype(int)
    array([[0, 0, 0],
           [0, 1, 1]])
    """

    def __init__(self, data: ArrayLike, resolution: float = 1.0, origin: ArrayLike = (0.0, 0.0, 0.0)):
        self.data = _cell_values(data)
        self.data.flags.writeable = False
        self.resolution = checked_resolution(resolution)
        self.origin = checked_origin(origin)
        cos, sin = np.cos(self.origin[2]), np.sin(self.origin[2])
        # Row vectors: grid frame -> world is p @ _turn, world -> grid frame is p @ _turn.T.
        self._turn = np.array([[cos, sin], [-sin, cos]])

    @property
    def width(self) -> int:
        """Number of columns."""
        return self.data.shape[1]

    @property
    def height(self) -> int:
        """Number of rows."""
        return self.data.shape[0]

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns, (h, w)."""
        return self.data.shape

    def __repr__(self) -> str:
        x, y, yaw = self.origin
        return (f'OccupancyGrid({self.width} x {self.height} cells of {self.resolution:g} m, '
                f'origin ({x:g}, {y:g}, {yaw:g}))')

    def __eq__(self, other: object) -> bool:
        """Return whether both grids have the same cells in the same place."""
        if not isinstance(other, OccupancyGrid):
            return NotImplemented
        return (self.resolution == other.resolution and self.origin == other.origin
                and np.array_equal(self.data, other.data))

    __hash__ = None  # two equal grids may be large: compare them, do not key by them

    def world_to_grid(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return points of the map frame in the grid's own frame, counted in cells.

        Cell (x, y) covers [x, x + 1) x [y, y + 1); its centre is (x + 0.5, y + 0.5).

        Parameters
        ----------
        points : (..., 2) array_like [m]

        Returns
        -------
        (..., 2) ndarray [cells]
        """
        return (_pairs(points, float) - self.origin[:2]) @ self._turn.T / self.resolution

    def grid_to_world(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return points of the grid's own frame, counted in cells, in the map frame.

        The inverse of `world_to_grid`.

        Parameters
        ----------
        points : (..., 2) array_like [cells]

        Returns
        -------
        (..., 2) ndarray [m]
        """
        return _pairs(points, float) * self.resolution @ self._turn + self.origin[:2]

    def world_to_cell(self, points: ArrayLike) -> NDArray[np.int64]:
        """Return the cell that each point lies in, which may be outside the grid.

        Parameters
        ----------
        points : (..., 2) array_like [m]
            In the map frame.

        Returns
        -------
        (..., 2) ndarray of int64
            Cells (x, y).

        Raises
        ------
        InvalidInput
            If a coordinate is not finite.
        """
        inside = self.world_to_grid(np.clip(finite_points(points), -_FAR_METRES, _FAR_METRES))
        return np.floor(np.clip(inside, -_FAR_CELLS, _FAR_CELLS)).astype(np.int64)

    def cell_to_world(self, cells: ArrayLike) -> NDArray[np.float64]:
        """Return the centre of each cell in the map frame.

        Parameters
        ----------
        cells : (..., 2) array_like of int
            Cells (x, y), inside the grid or not.

        Returns
        -------
        (..., 2) ndarray [m]

        Examples
        --------
        >>> OccupancyGrid([[0]], resolution=2.0, origin=(0, 0, np.pi / 2)).cell_to_world((0, 0))
        array([-1.,  1.])
        """
        return self.grid_to_world(_pairs(cells, float) + 0.5)

    def contains(self, cells: ArrayLike) -> NDArray[np.bool_]:
        """Return whether each cell belongs to the grid.

        Parameters
        ----------
        cells : (..., 2) array_like of int
            Cells (x, y).

        Returns
        -------
        (...) ndarray of bool
        """
        cells = _pairs(cells)
        return ((cells >= 0) & (cells < (self.width, self.height))).all(axis=-1)

    def occupied(self, occupied_from: int = OCCUPIED_FROM, unknown_is_free: bool = False) -> NDArray[np.bool_]:
        """Return which cells a robot must not enter.

        Parameters
        ----------
        occupied_from : int
            The least value that counts as occupied, 1..100.
        unknown_is_free : bool
            Whether a cell of value -1 may be entered.

        Returns
        -------
        (h, w) ndarray of bool

        Raises
        ------
        InvalidInput
            If ``occupied_from`` is not within 1..100.
        """
        if not 1 <= occupied_from <= OCCUPIED:
            raise InvalidInput(f'occupied_from {occupied_from} is not within 1..{OCCUPIED}')
        occupied = self.data >= occupied_from
        return occupied if unknown_is_free else occupied | (self.data == UNKNOWN)

    def inflate(self, radius: float) -> OccupancyGrid:
        """Return a new grid whose obstacles are grown by a disc.

        Every cell whose centre is at most ``radius`` from the centre of an occupied
        cell (value 65 or more) becomes 100; the others keep their value. Distances
        are exact, so inflating by a then b never covers more than once by a + b.
        Unknown cells do not grow. This grid stays as it is.

        Parameters
        ----------
        radius : float [m]
            At least 0; 0 changes no cell but makes the occupied ones 100.

        Returns
        -------
        OccupancyGrid

        Raises
        ------
        InvalidInput
            If the radius is negative or not finite.

        Examples
        --------
        >>> OccupancyGrid([[0, 0, 0], [0, 0, 0], [0, 0, 100]], resolution=0.1).inflate(0.1).data
        array([[  0,   0,   0],
               [  0,   0, 100],
               [  0, 100, 100]], dtype=int8)
        """
        if not (isfinite(radius) and radius >= 0):
            raise InvalidInput(f'inflation radius {radius} m is not a finite number of at least 0')
        values = np.where(grown(self.data >= OCCUPIED_FROM, radius / self.resolution), OCCUPIED, self.data)
        return OccupancyGrid(values, self.resolution, self.origin)


def _cell_values(data: ArrayLike) -> NDArray[np.int8]:
    """Return a private int8 copy of the cell values, each within -1..100."""
    try:
        values = np.asarray(data)
    except ValueError:
        raise InvalidInput('grid data has rows of different lengths: it must be (height, width)') from None
    if values.ndim != 2:
        raise InvalidInput(f'grid data has shape {values.shape}: it must be (height, width)')
    check_size(values.shape[1], values.shape[0])
    if values.dtype == bool:
        return values.astype(np.int8) * np.int8(OCCUPIED)
    if values.dtype.kind not in 'iu':
        raise InvalidInput(f'grid data is of type {values.dtype}: cells must be integers or bool')
    low, high = values.min(), values.max()
    if low < UNKNOWN or high > OCCUPIED:
        raise InvalidInput(f'cell value {low if low < UNKNOWN else high} is outside {UNKNOWN}..{OCCUPIED}')
    return np.array(values, dtype=np.int8, order='C')


def checked_resolution(resolution: float) -> float:
    """Return the side of a cell [m] as a float, if it is one we can work with."""
    try:
        value = float(resolution)
    except (TypeError, ValueError):
        raise InvalidInput(f'resolution {resolution!r} is not a number') from None
    if not (isfinite(value) and value >= MIN_RESOLUTION):
        raise InvalidInput(f'resolution {value} m is not a finite number of at least {MIN_RESOLUTION}')
    return value


def checked_origin(origin: ArrayLike) -> tuple[float, float, float]:
    """Return the pose (x, y, yaw) [m, m, rad] with its yaw in (-pi, pi]."""
    try:
        pose = np.asarray(origin, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f'origin {origin!r} is not three numbers') from None
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise InvalidInput(f'origin {pose.tolist()} is not three finite numbers (x, y, yaw)')
    if np.abs(pose[:2]).max() > MAX_COORDINATE:
        raise InvalidInput(f'origin {pose.tolist()} is further out than the limit of {MAX_COORDINATE:g} m')
    x, y, yaw = pose.tolist()
    # A yaw already in range is kept to the last bit, so that a saved map loads as it was.
    return x, y, yaw if -np.pi < yaw <= np.pi else float(wrap_angle(yaw))


def _pairs(points: ArrayLike, dtype: type | None = None) -> NDArray:
    """Return the points as an array whose last axis is (x, y)."""
    pairs = np.asarray(points, dtype=dtype)
    if pairs.ndim == 0 or pairs.shape[-1] != 2:
        raise InvalidInput(f'points of shape {pairs.shape}: the last axis must be (x, y)')
    return pairs
