"""What surrounds a robot: a boundary, obstacles, and a map, and the room they leave."""
from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import depth_in_box, finite_points
from mobile_planning.world.boundary import Boundary
from mobile_planning.world.collision_space import TOUCH, CollisionSpace, collision_space
from mobile_planning.world.footprint import Footprint
from mobile_planning.world.moving_obstacle import MovingObstacle
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, OccupancyGrid
from mobile_planning.world.surroundings import Surroundings, surroundings


class Environment:
    """Everything that a robot must not run into.

    Parameters
    ----------
    boundary : Boundary, optional
    obstacles : iterable of Obstacle
    grid : OccupancyGrid, optional
        Its occupied cells are obstacles, and so is all that lies outside it.
    occupied_from : int
        The least cell value that counts as occupied.
    unknown_is_free : bool
        Whether a cell of value -1 is free.
    moving : iterable of MovingObstacle
        Only planners that know of time see them.
    footprint : Footprint or float [m]
        The robot's outline, or the radius of a disc; a point by default.

    Raises
    ------
    InvalidInput
        If the footprint is none.

    Examples
    --------
    >>> from mobile_planning.world.obstacles import RoundObstacle
    >>> world = Environment(Boundary((0, 10), (0, 10)), [RoundObstacle((5, 5), 1)])
    >>> world.clearance([(5, 2), (5, 5), (1, 5)])
    array([ 2., -1.,  1.])
    >>> world.free_poses([(5, 2), (5, 5), (5, 4)])
    array([ True, False,  True])
    """

    def __init__(self, boundary: Boundary | None = None, obstacles: Iterable[Obstacle] = (),
                 grid: OccupancyGrid | None = None, *, occupied_from: int = OCCUPIED_FROM,
                 unknown_is_free: bool = False, moving: Iterable[MovingObstacle] = (),
                 footprint: Footprint | float = 0.0):
        self.boundary = boundary
        self.obstacles = tuple(obstacles)
        self.grid = grid
        self.occupied_from = occupied_from
        self.unknown_is_free = unknown_is_free
        self.moving = tuple(moving)
        self.footprint = footprint if isinstance(footprint, Footprint) else Footprint(footprint)
        self._spaces, self._surroundings = {}, {}

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """x_min, y_min, x_max, y_max [m] of an upright rectangle outside which nothing is free.

        Raises
        ------
        InvalidInput
            If there is neither a boundary nor a grid.
        """
        low, high = np.full(2, -np.inf), np.full(2, np.inf)
        if self.boundary is not None:
            low, high = ((self.boundary.x_min, self.boundary.y_min), (self.boundary.x_max, self.boundary.y_max))
        if self.grid is not None:
            corners = self.grid.grid_to_world([(0, 0), (self.grid.width, 0), (0, self.grid.height),
                                               (self.grid.width, self.grid.height)])
            low, high = np.maximum(low, corners.min(axis=0)), np.minimum(high, corners.max(axis=0))
        if not np.all(np.less(low, high)) or not np.isfinite([low, high]).all():
            raise InvalidInput('the world has no extent: it needs a boundary or a grid, and the two must overlap')
        return tuple(float(value) for value in (*low, *high))

    @cached_property
    def occupied(self) -> NDArray[np.bool_]:
        """Which cells (h, w) of the grid are obstacles."""
        return self.grid.occupied(self.occupied_from, self.unknown_is_free)

    def for_footprint(self, footprint: Footprint | float) -> Environment:
        """Return this environment for a robot of another footprint."""
        return self._changed(self.moving, footprint)

    def at_rest(self) -> Environment:
        """Return this environment without what moves; itself, if nothing does."""
        return self._changed((), self.footprint) if self.moving else self

    def with_obstacles(self, obstacles: Iterable[Obstacle], moving: Iterable[MovingObstacle] = ()) -> Environment:
        """Return this environment with other obstacles; what is known of the map is not worked out again."""
        other = Environment(self.boundary, obstacles, self.grid, occupied_from=self.occupied_from,
                            unknown_is_free=self.unknown_is_free, moving=moving, footprint=self.footprint)
        if self.grid is not None:
            other.__dict__.update(occupied=self.occupied, _corner_field=self._corner_field)
        return other

    def _changed(self, moving: Iterable[MovingObstacle], footprint: Footprint | float) -> Environment:
        return Environment(self.boundary, self.obstacles, self.grid, occupied_from=self.occupied_from,
                           unknown_is_free=self.unknown_is_free, moving=moving, footprint=footprint)

    def space(self, allowed: float = 0.0) -> CollisionSpace:
        """Return the arrays that kernels check motions with, of a robot that may lie ``allowed`` [m] deep in obstacles.

        Made once for each value, from the environment as it was then.
        """
        if allowed not in self._spaces:
            self._spaces[allowed] = collision_space(self, allowed)
        return self._spaces[allowed]

    def surroundings(self, allowed: float = 0.0) -> Surroundings:
        """Return the `space` within the bounds, with the room in its cells as far as any query has asked for it.

        Raises
        ------
        InvalidInput
            If there are no `bounds`.
        """
        if allowed not in self._surroundings:
            self._surroundings[allowed] = surroundings(self.space(allowed), self.bounds)
        return self._surroundings[allowed]

    def free_poses(self, poses: ArrayLike, t: ArrayLike | None = None) -> NDArray[np.bool_]:
        """Return whether a robot at each pose runs into nothing; it may touch, up to a millimetre deep.

        Parameters
        ----------
        poses : (..., 2) or (..., 3) array_like [m, m, rad]
            The heading counts where the footprint has an outline.
        t : (...) array_like [s], optional
            When the robot is there: moving obstacles have moved on since time 0. By default 0.

        Returns
        -------
        (...) ndarray of bool
            Exact: occupied cells are squares.

        Raises
        ------
        InvalidInput
            If a number is not finite, or a heading is missing.
        """
        from mobile_planning.world.collision_kernels import write_free

        poses, times = self._poses_and_times(poses, t)
        free = np.empty(poses.shape[:-1], bool)
        write_free(self.space(TOUCH), poses.reshape(-1, 3), times.ravel(), free.ravel())
        return free

    def clearance(self, points: ArrayLike, t: ArrayLike | None = None) -> NDArray[np.float64]:
        """Return how much room a robot has at each pose: never more than there is.

        To the boundary and the obstacles the distance is exact, signed. To the occupied
        cells, as squares, it is a lower bound, at most 0.9 of a cell below the truth, and
        0 inside them; outside the grid it is minus the distance to the grid. A disc has its
        radius less. An outline has the distance to what is nearest, and 0 where it overlaps.

        Parameters
        ----------
        points : (..., 2) or (..., 3) array_like [m, m, rad]
            In the map frame; only an outline needs the heading.
        t : (...) array_like [s], optional
            As for `free_poses`.

        Returns
        -------
        (...) ndarray [m]
            Infinite where nothing limits it.

        Raises
        ------
        InvalidInput
            If a coordinate is not finite.
        """
        if self.footprint.outline is not None:
            return self._outline_clearance(points, t)
        points = self._points(points)
        room = np.full(points.shape[:-1], np.inf)
        for obstacle in self.moving:
            room = np.minimum(room, obstacle.distance(points, 0.0 if t is None else finite_times(t)))
        if self.boundary is not None:
            room = np.minimum(room, self.boundary.distance(points))
        for obstacle in self.obstacles:
            room = np.minimum(room, obstacle.distance(points))
        if self.grid is not None:
            room = np.minimum(room, self._grid_clearance(points))
        return room - self.footprint.radius

    def _outline_clearance(self, poses: ArrayLike, t: ArrayLike | None) -> NDArray[np.float64]:
        """Return the distance (...) [m] of the robot's outline to what is nearest, 0 where it overlaps."""
        from mobile_planning.world.collision_kernels import write_rooms

        poses, times = self._poses_and_times(poses, t)
        rooms = np.empty(poses.shape[:-1])
        write_rooms(self.space(), poses.reshape(-1, 3), times.ravel(), rooms.ravel())
        return rooms

    def _points(self, poses: ArrayLike) -> NDArray[np.float64]:
        """Return the positions (..., 2) of points or of poses."""
        if np.ndim(poses) and np.shape(poses)[-1] == 3:
            poses = np.asarray(poses)[..., :2]
        return finite_points(poses)

    def _poses_and_times(self, poses: ArrayLike, t: ArrayLike | None) -> tuple[NDArray, NDArray]:
        """Return the poses (..., 3), where a disc needs no heading, and the time (...) of each."""
        poses = np.asarray(poses, float)
        if poses.ndim and poses.shape[-1] == 2 and self.footprint.outline is None:
            poses = np.concatenate([poses, np.zeros((*poses.shape[:-1], 1))], axis=-1)
        if not poses.ndim or poses.shape[-1] != 3:
            raise InvalidInput(f'poses of shape {poses.shape}: the last axis must be (x, y, heading)')
        if not np.isfinite(poses).all():
            raise InvalidInput('a pose has a number that is not finite')
        times = finite_times(0.0 if t is None else t)
        shape = np.broadcast_shapes(poses.shape[:-1], times.shape)
        return (np.array(np.broadcast_to(poses, (*shape, 3))), np.array(np.broadcast_to(times, shape)))

    def _grid_clearance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a lower bound of the distance to the grid's occupied squares and its edge [m].

        The distance d to any set makes d(p)^2 - |p|^2 a concave function of p: it is the
        least of the linear functions |o|^2 - 2 p.o over the set's points o. So between the
        corners v of a cell it lies above their bilinear mean with weights w, which gives
        d(p)^2 >= sum w d(v)^2 - tx (1 - tx) - ty (1 - ty), in cells, where (tx, ty) is the
        place within the cell.
        """
        size = np.array((self.grid.width, self.grid.height))
        place = self.grid.world_to_grid(points)
        edge = depth_in_box(place, (0.0, 0.0), size)
        if self._corner_field is None:
            return edge * self.grid.resolution
        place = np.clip(place, 0, size)
        cell = np.minimum(place.astype(np.intp), size - 1)
        tx, ty = np.moveaxis(place - cell, -1, 0)
        first = cell[..., 1] * (self.grid.width + 1) + cell[..., 0]
        low, high = ((1 - tx) * self._corner_field[row] + tx * self._corner_field[row + 1]
                     for row in (first, first + self.grid.width + 1))
        squared = (1 - ty) * low + ty * high - tx * (1 - tx) - ty * (1 - ty)
        return np.minimum(edge, np.sqrt(np.maximum(squared, 0.0))) * self.grid.resolution

    @cached_property
    def _corner_field(self) -> NDArray[np.int32] | None:
        """Squared distance [cells^2] from each cell corner to the nearest occupied square, flat; None if all is free.

        Exact: seen from a corner, the nearest point of a square is one of its corners.
        """
        from scipy.ndimage import distance_transform_edt

        if not self.occupied.any():
            return None
        padded = np.pad(self.occupied, 1)
        touched = padded[:-1, :-1] | padded[:-1, 1:] | padded[1:, :-1] | padded[1:, 1:]
        # The transform's own distances are rounded; squares of whole numbers of cells are not, and fit (2 x 32767^2).
        nearest = distance_transform_edt(~touched, return_distances=False, return_indices=True)
        for axis, length in enumerate(touched.shape):
            nearest[axis] -= np.arange(length, dtype=np.int32).reshape((-1, 1) if axis == 0 else (1, -1))
        return (nearest[0] ** 2 + nearest[1] ** 2).ravel()


def finite_times(t: ArrayLike) -> NDArray[np.float64]:
    """Return the times [s] as an array, if all are finite.

    Raises
    ------
    InvalidInput
    """
    t = np.asarray(t, float)
    if not np.isfinite(t).all():
        raise InvalidInput('a time is not a finite number')
    return t
