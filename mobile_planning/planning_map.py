"""A map as the planners see it: where obstacles are, where a robot may be, and what each cell costs."""
from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput, LimitExceeded
from mobile_planning.map_masks import forbidden_cells, slowness
from mobile_planning.stop_flag import StopFlag
from mobile_planning.world.cost_to_go import cost_to_go, descend
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid

# Cells in one update.
MAX_UPDATES = 1_000_000
# Changes that a map remembers; a plan that is further behind compares all cells.
_CHANGES_KEPT = 64


class PlanningMap:
    """One state of a map, which never changes: `updated` and `replaced` return the next one.

    A query that holds one is answered on it as a whole, whatever comes meanwhile.

    Parameters
    ----------
    grid : OccupancyGrid
    inflation_radius : float [m]
        By which obstacles grow.
    unknown_is_free : bool
    keepout, speed : OccupancyGrid, optional
        Masks, see `map_masks`. Forbidden cells do not grow, and a robot that stands in one may leave.

    Attributes
    ----------
    grid : OccupancyGrid
        The map as it came.
    obstacles : (h, w) ndarray of bool
        Cells with an obstacle, read-only.
    occupied : (h, w) ndarray of bool
        Cells where a robot must not plan to be, obstacles, inflation and forbidden ones, read-only. The same object as
        long as no cell of it changes.
    weights : (h, w) ndarray or None
        Cost of each cell, inf where occupied, read-only; None as long as every other cell costs 1.
    version : int
        Grows with every change.
    """

    def __init__(self, grid: OccupancyGrid, inflation_radius: float = 0.0, unknown_is_free: bool = False, *,
                 keepout: OccupancyGrid | None = None, speed: OccupancyGrid | None = None):
        self.grid = grid
        self._inflation_radius = inflation_radius
        self.obstacles = _fixed(grid.occupied(unknown_is_free=unknown_is_free))
        self.occupied = self.obstacles if inflation_radius == 0 else _fixed(
            grid.inflate(inflation_radius).occupied(unknown_is_free=unknown_is_free))
        if keepout is not None:
            self.occupied = _fixed(self.occupied | forbidden_cells(keepout, grid))
        self.weights = None
        if speed is not None and ((times := slowness(speed, grid)) != 1).any():
            self.weights = _fixed(np.where(self.occupied, np.inf, times))
        self.version = 0
        # What each of the last versions changed, as rows (x, y, cost).
        self._changes = ()

    @property
    def costs(self) -> NDArray[np.float64]:
        """Cost of each cell (h, w), inf where occupied."""
        return np.where(self.occupied, np.inf, 1.0) if self.weights is None else self.weights

    def checked_update(self, cells: ArrayLike, costs: ArrayLike) -> NDArray[np.float64]:
        """Return an update as rows (N, 3) of x, y and cost, of a cell named twice the last one.

        Parameters
        ----------
        cells : (N, 2) array_like of int
            Cells (x, y).
        costs : (N,) array_like
            Above 0; inf for blocked.

        Raises
        ------
        InvalidInput
            If a cell is not of the map or a cost not above 0, or there are not as many of both.
        LimitExceeded
            If there are too many.
        """
        try:
            places, costs = np.asarray(cells, float), np.asarray(costs, float)
        except (TypeError, ValueError):
            raise InvalidInput('an update is not of numbers: cells (N, 2) and costs (N,)') from None
        places = places.reshape(0, 2) if places.size == 0 else places
        if costs.ndim != 1 or places.shape != (len(costs), 2):
            raise InvalidInput(f'an update of cells {places.shape} and costs {costs.shape} is not (N, 2) and (N,)')
        if len(costs) > MAX_UPDATES:
            raise LimitExceeded(f'an update of {len(costs)} cells: the limit is {MAX_UPDATES}')
        size = (self.grid.width, self.grid.height)
        wrong = ~((places >= 0) & (places < size) & (places == np.floor(places))).all(axis=1)
        if wrong.any():
            raise InvalidInput('cell ({:g}, {:g}) of an update is not a cell of the map of {} x {} cells'.format(
                *places[wrong.argmax()], *size))
        wrong = ~(costs > 0)
        if wrong.any():
            i = wrong.argmax()
            raise InvalidInput('cost {} of cell ({:g}, {:g}) is not above 0; a blocked cell costs inf'.format(
                costs[i], *places[i]))
        _, last = np.unique((places @ (1, size[0]))[::-1], return_index=True)
        return np.column_stack([places, costs])[::-1][last]

    def updated(self, rows: NDArray[np.float64]) -> PlanningMap:
        """Return the map with other costs: a blocked cell is an obstacle and does not grow, any other is free.

        Parameters
        ----------
        rows : (N, 3) ndarray
            From `checked_update`.
        """
        x, y = rows[:, :2].astype(np.int64).T
        costs = rows[:, 2]
        blocked = np.isinf(costs)
        result = copy(self)
        result.obstacles = _changed(self.obstacles, x, y, blocked)
        result.occupied = (result.obstacles if self.occupied is self.obstacles
                           else _changed(self.occupied, x, y, blocked))
        if self.weights is not None or (costs[~blocked] != 1).any():
            result.weights = _changed(self.costs, x, y, costs)
        result._changes = (*self._changes, rows)[-_CHANGES_KEPT:]
        result.version += 1
        return result

    def replaced(self, newer: PlanningMap) -> PlanningMap | None:
        """Return a newer map as a change of this one, or None if it has another size or lies elsewhere.

        Parameters
        ----------
        newer : PlanningMap
            As it was made, without updates.
        """
        ours, theirs = self.grid, newer.grid
        if (ours.shape, ours.resolution, ours.origin) != (theirs.shape, theirs.resolution, theirs.origin):
            return None
        result = copy(newer)
        result.version = self.version + 1
        y, x = np.nonzero(self.occupied != newer.occupied)
        if len(x) == 0:
            # Plans are kept for this object.
            result.occupied = self.occupied
        rows = (np.column_stack([x, y, np.where(newer.occupied[y, x], np.inf, 1.0)]) if self.weights is newer.weights
                else newer.changes_from(self.costs))
        result._changes = (*self._changes, rows)[-_CHANGES_KEPT:]
        return result

    def changes_since(self, version: int) -> NDArray[np.float64] | None:
        """Return rows (x, y, cost) that lead from an earlier version to this one; None if they are not known."""
        count = self.version - version
        if not 0 <= count <= len(self._changes):
            return None
        return np.concatenate([np.empty((0, 3)), *self._changes[len(self._changes) - count:]])

    def changes_from(self, costs: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return rows (x, y, cost) that lead from other costs (h, w) to those of this map."""
        ours = self.costs
        y, x = np.nonzero(ours != costs)
        return np.column_stack([x, y, ours[y, x]])

    def cell(self, pose: ArrayLike, name: str, outside: type[Exception]) -> NDArray[np.int64]:
        """Return the cell (2,) of a pose, or raise ``outside``."""
        cell = self.grid.world_to_cell(pose[:2])
        if not self.grid.contains(cell):
            size = np.multiply((self.grid.width, self.grid.height), self.grid.resolution)
            raise outside('{} {}, cell ({}, {}), is outside the map of {} x {} cells ({:g} x {:g} m from {})'.format(
                name, place(pose), *cell, self.grid.width, self.grid.height, *size, place(self.grid.origin)))
        return cell

    def why_occupied(self, pose: ArrayLike, cell: NDArray[np.int64], name: str) -> str:
        """Return the sentence for a pose in an occupied cell."""
        value = self.grid.data[cell[1], cell[0]]
        if value >= OCCUPIED_FROM:
            reason = 'occupied'
        elif not self.obstacles[cell[1], cell[0]]:
            reason = f'forbidden or within the inflation radius of {self._inflation_radius:g} m of an obstacle'
        else:
            reason = 'unknown' if value == UNKNOWN else 'occupied since an update of the costs'
        found = nearest(~self.occupied, self.grid.world_to_grid(pose[:2]))
        where = 'no cell is free' if found is None else (
            'the nearest free cell ({}, {}) is {:.2f} m away'.format(*found[0], found[1] * self.grid.resolution))
        return '{} {}, cell ({}, {}), is {}; {}'.format(name, place(pose), *cell, reason, where)

    def way_out(self, cell: NDArray[np.int64], wanted: NDArray[np.bool_], corner_cutting: bool,
                flag: StopFlag) -> NDArray[np.int64] | None:
        """Return the shortest path (N, 2) around obstacles from a cell to a wanted one, None if there is none.

        Parameters
        ----------
        cell : (2,) ndarray of int
            Without an obstacle.
        wanted : (h, w) ndarray of bool
        corner_cutting : bool
        flag : StopFlag
        """
        reach = 16
        while True:
            left, bottom = np.maximum(cell - reach, 0)
            window = np.s_[bottom:cell[1] + reach + 1, left:cell[0] + reach + 1]
            here = cell - (left, bottom)
            field = cost_to_go(self.obstacles[window], here, corner_cutting=corner_cutting, stop=flag.array)
            lengths = np.where(wanted[window] & np.isfinite(field), field, np.inf)
            y, x = np.unravel_index(lengths.argmin(), lengths.shape)
            # A path that leaves the window is longer than `reach`.
            if lengths[y, x] <= reach or (field.size == wanted.size and lengths[y, x] < np.inf):
                # The field leads from the cell found back to where it began.
                return descend(field, (x, y), here, corner_cutting=corner_cutting)[::-1] + (left, bottom)
            if field.size == wanted.size:
                return None
            reach *= 2


def nearest(wanted: NDArray[np.bool_], point: NDArray[np.float64]) -> tuple[NDArray[np.int64], float] | None:
    """Return the wanted cell (2,) whose centre is nearest to a point of the grid frame, and its distance [cells].

    The window around the point grows until no cell outside it can be nearer. None if no cell is wanted.
    """
    x, y = np.floor(point).astype(int)
    reach = 8
    while True:
        left, bottom = max(0, x - reach), max(0, y - reach)
        window = wanted[bottom:y + reach + 1, left:x + reach + 1]
        cells = np.argwhere(window)[:, ::-1] + (left, bottom)
        distances = np.hypot(*(cells + 0.5 - point).T)
        # Anything outside the window lies more than `reach` away in x or in y.
        if len(cells) and (distances.min() <= reach or window.size == wanted.size):
            return cells[distances.argmin()], float(distances.min())
        if window.size == wanted.size:
            return None
        reach *= 2


def place(pose: ArrayLike) -> str:
    """Return the position of a pose as text."""
    return f'({pose[0]:g}, {pose[1]:g})'


def _fixed(array):
    array.flags.writeable = False
    return array


def _changed(array, x, y, values):
    """Return a fixed copy with other values, or the array itself if it has them already."""
    if (array[y, x] == values).all():
        return array
    array = array.copy()
    array[y, x] = values
    return _fixed(array)
