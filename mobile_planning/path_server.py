"""The current map and its planners, by name: poses in metres in, paths in metres out.

A plan is kept while its goal and the map stand, so that a second query to the same goal only walks down the field.
"""
from __future__ import annotations

import threading
import time
from collections import OrderedDict
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import (
    GoalOccupied, GoalOutside, InvalidInput, InvalidPlanner, NoMap, NoPath, StartOccupied, StartOutside)
from mobile_planning.grid.distance_transform import DistanceTransformPlanner
from mobile_planning.stop_flag import StopFlag
from mobile_planning.world.cost_to_go import warm_up
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid

_PLANNERS = {'distance_transform': DistanceTransformPlanner}
_PLANS_KEPT = 4


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """The answer to a query.

    Attributes
    ----------
    poses : (N, 3) ndarray [m, m, rad]
        From exactly the start to exactly the goal, each between on a cell centre and headed to the next.
    cost : float [m]
        Length of the path from the start's cell centre to the goal's.
    planning_time : float [s]
    statistics : dict of str to str
        How the path came about.
    """

    poses: NDArray[np.float64]
    cost: float
    planning_time: float
    statistics: dict[str, str]


class PathServer:
    """Answers path queries on the newest map; safe to use from several threads.

    Parameters
    ----------
    default_planner : str
        Id of the planner that serves a query without one.
    inflation_radius : float [m]
        By which obstacles grow: the radius of the robot.
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell at its side.
    unknown_is_free : bool
        Whether unknown cells may be entered.

    Raises
    ------
    InvalidPlanner
        If there is no planner of that id.
    InvalidInput
        If the radius is negative or not finite.

    Examples
    --------
    >>> import numpy as np
    >>> from mobile_planning import OccupancyGrid, PathServer
    >>> server = PathServer()
    >>> server.set_map(OccupancyGrid(np.zeros((40, 60), np.int8), resolution=0.05))
    >>> path = server.plan_path('distance_transform', start=(0.22, 0.31, 0.0), goal=(1.22, 0.31, 1.57))
    >>> path.poses[[0, -1]]
    array([[0.22, 0.31, 0.  ],
           [1.22, 0.31, 1.57]])
    >>> round(path.cost, 3)
    1.0
    """

    def __init__(
        self,
        default_planner: str = 'distance_transform',
        *,
        inflation_radius: float = 0.0,
        corner_cutting: bool = False,
        unknown_is_free: bool = False,
    ):
        _check_planner(default_planner)
        self._default_planner = default_planner
        self._inflation_radius = _number(inflation_radius, 'inflation radius', 'm')
        self._corner_cutting = bool(corner_cutting)
        self._unknown_is_free = bool(unknown_is_free)
        self._site = None

    @property
    def planners(self) -> tuple[str, ...]:
        """Ids of the planners."""
        return tuple(_PLANNERS)

    def set_map(self, grid: OccupancyGrid) -> None:
        """Plan on another map from the next query on; queries under way finish on the one they began with.

        Parameters
        ----------
        grid : OccupancyGrid
        """
        # The kernels are loaded now, and not while a request waits.
        warm_up()
        self._site = _Site(grid, self._inflation_radius, self._corner_cutting, self._unknown_is_free)

    def plan_path(
        self,
        planner: str,
        start: ArrayLike,
        goal: ArrayLike,
        *,
        deadline: float | None = None,
        seed: int = 0,
        tolerance: float = 0.0,
        stop: NDArray[np.uint8] | None = None,
    ) -> PlannedPath:
        """Return the path between two poses.

        Parameters
        ----------
        planner : str
            Id of the planner, empty for the default.
        start, goal : (3,) array_like [m, m, rad]
            In the map frame.
        deadline : float, optional [s]
            Time allowed; no limit if not given.
        seed : int
            Of planners that draw at random.
        tolerance : float [m]
            An occupied goal is replaced by the nearest free cell that can be reached, if its centre is at most this
            far from it.
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread to withdraw the query.

        Returns
        -------
        PlannedPath

        Raises
        ------
        InvalidPlanner
            If there is no planner of that id.
        StartOutside, GoalOutside, StartOccupied, GoalOccupied
            If an end is not in a free cell of the map.
        NoPath
            If no path joins them.
        PlanningTimeout, Cancelled
            If the deadline passed or ``stop`` was set.
        NoMap
            If no map was set.
        InvalidInput
            If a number is not finite or out of its range.
        """
        began = time.perf_counter()
        planner = planner or self._default_planner
        _check_planner(planner)
        start, goal = _pose(start, 'start'), _pose(goal, 'goal')
        tolerance = _number(tolerance, 'tolerance', 'm')
        if deadline is not None and not deadline > 0:
            raise InvalidInput(f'deadline {deadline} s is not above 0')
        # One reference for the whole query: set_map may replace it meanwhile.
        site = self._site
        if site is None:
            raise NoMap('no map has arrived yet')

        flag = StopFlag(deadline, stop)
        start_cell = site.cell(start, 'start', StartOutside)
        goal_cell = site.cell(goal, 'goal', GoalOutside)
        if site.occupied[start_cell[1], start_cell[0]]:
            raise StartOccupied(site.why_occupied(start, start_cell, 'start'))
        end, moved = goal, 0.0
        if site.occupied[goal_cell[1], goal_cell[0]]:
            if tolerance == 0.0:
                raise GoalOccupied(site.why_occupied(goal, goal_cell, 'goal'))
            goal_cell, moved = site.nearest_reachable(planner, start_cell, goal, goal_cell, tolerance, flag)
            end = np.append(site.grid.cell_to_world(goal_cell), goal[2])

        plan, reused = site.plan(planner, goal_cell, flag)
        try:
            cells = plan.query(start_cell)
        except NoPath:
            raise NoPath(f'no path leads from start {_place(start)} to goal {_place(end)}') from None
        flag.check()
        statistics = {'planner': planner, 'plan': 'reused' if reused else 'computed', 'path_cells': str(len(cells))}
        if moved:
            statistics['goal_moved'] = f'{moved:.3f} m'
        length = np.hypot(*np.diff(cells, axis=0).T).sum() * site.grid.resolution
        return PlannedPath(_poses(site.grid.cell_to_world(cells), start, end), float(length),
                           time.perf_counter() - began, statistics)


class _Site:
    """One map as the planners see it, with the plans made on it; nothing of it changes but the plans kept."""

    def __init__(self, grid, inflation_radius, corner_cutting, unknown_is_free):
        self.grid = grid
        self._inflation_radius = inflation_radius
        self._corner_cutting = corner_cutting
        grown = grid.inflate(inflation_radius) if inflation_radius > 0 else grid
        self.occupied = grown.occupied(unknown_is_free=unknown_is_free)
        self.occupied.flags.writeable = False
        self._plans = OrderedDict()
        self._lock = threading.Lock()

    def cell(self, pose, name, outside):
        """Return the cell (2,) of a pose, or raise ``outside``."""
        cell = self.grid.world_to_cell(pose[:2])
        if not self.grid.contains(cell):
            size = np.multiply((self.grid.width, self.grid.height), self.grid.resolution)
            raise outside('{} {}, cell ({}, {}), is outside the map of {} x {} cells ({:g} x {:g} m from {})'.format(
                name, _place(pose), *cell, self.grid.width, self.grid.height, *size, _place(self.grid.origin)))
        return cell

    def why_occupied(self, pose, cell, name):
        """Return the sentence for a pose in an occupied cell."""
        value = self.grid.data[cell[1], cell[0]]
        if value >= OCCUPIED_FROM:
            reason = 'occupied'
        elif value == UNKNOWN and self._inflation_radius == 0:
            reason = 'unknown'
        else:
            reason = f'unknown or within the inflation radius of {self._inflation_radius:g} m of an obstacle'
        nearest = _nearest(~self.occupied, self.grid.world_to_grid(pose[:2]))
        where = 'no cell is free' if nearest is None else (
            'the nearest free cell ({}, {}) is {:.2f} m away'.format(*nearest[0], nearest[1] * self.grid.resolution))
        return '{} {}, cell ({}, {}), is {}; {}'.format(name, _place(pose), *cell, reason, where)

    def nearest_reachable(self, planner, start_cell, goal, goal_cell, tolerance, flag):
        """Return the free cell nearest to the goal that the start reaches, and its distance [m]."""
        # Steps go both ways: what reaches the start is what the start reaches.
        field = self.plan(planner, start_cell, flag)[0].distancemap
        found = _nearest(np.isfinite(field), self.grid.world_to_grid(goal[:2]))
        distance = found[1] * self.grid.resolution
        if distance > tolerance * (1 + 1e-9):
            raise GoalOccupied(self.why_occupied(goal, goal_cell, 'goal') + '; the nearest one that can be reached is '
                               f'{distance:.2f} m away, beyond the tolerance of {tolerance:g} m')
        return found[0], distance

    def plan(self, name, goal_cell, flag):
        """Return a planner with a plan for the goal, and whether it was there already."""
        key = (name, *goal_cell.tolist())
        with self._lock:
            if key in self._plans:
                self._plans.move_to_end(key)
                return self._plans[key], True
        planner = _PLANNERS[name](self.occupied, corner_cutting=self._corner_cutting)
        with flag:
            planner.plan(goal_cell, stop=flag.array)
        with self._lock:
            self._plans[key] = planner
            while len(self._plans) > _PLANS_KEPT:
                self._plans.popitem(last=False)
        return planner, False


def _nearest(wanted, point):
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


def _poses(points, start, goal):
    """Return the path's points (N, 2) with start and goal for its ends, and a heading for each [m, m, rad]."""
    between = points[1:-1]
    poses = np.concatenate([start[None], np.column_stack([between, np.zeros(len(between))]), goal[None]])
    ahead = np.diff(poses[1:, :2], axis=0)
    poses[1:-1, 2] = np.arctan2(ahead[:, 1], ahead[:, 0])
    return poses


def _check_planner(name):
    """Raise InvalidPlanner unless it is the id of a planner."""
    if name not in _PLANNERS:
        raise InvalidPlanner(f'planner {name!r} is not one of {", ".join(_PLANNERS)}')


def _pose(values, name):
    """Return (x, y, theta) as an array of finite numbers."""
    try:
        pose = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{name} {values!r} is not a pose (x, y, theta)') from None
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise InvalidInput(f'{name} {pose.tolist()} is not three finite numbers (x, y, theta)')
    return pose


def _number(value, name, unit):
    """Return a finite number of at least 0."""
    if not (np.isfinite(value) and value >= 0):
        raise InvalidInput(f'{name} {value} {unit} is not a finite number of at least 0')
    return float(value)


def _place(pose):
    """Return the position of a pose as text."""
    return f'({pose[0]:g}, {pose[1]:g})'
