"""The current map and its planners, by name: poses in metres in, paths in metres out.

A plan is kept while its goal stands and no change of the map concerns it, so that a second query to the same goal only
walks down the field.
"""
from __future__ import annotations

import threading
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.cost_updates import checked_update
from mobile_planning.errors import GoalOccupied, GoalOutside, InvalidInput, InvalidPlanner, NoMap
from mobile_planning.grid_routes import PLANS, KeptPlans, Rules
from mobile_planning.path_query import PathQuery, PlannedPath
from mobile_planning.planning_map import PlanningMap
from mobile_planning.stop_flag import StopFlag
from mobile_planning.warm_up import warm_up
from mobile_planning.world.occupancy_grid import OccupancyGrid
from mobile_planning.world.row_blocks import by_rows

FIELD_PLANNERS = ('distance_transform', 'dstar')


class PathServer:
    """Answers path queries on the newest map; safe to use from several threads.

    Parameters
    ----------
    default_planner : str
        Id of the planner that serves a query without one.
    inflation_radius : float [m]
        By which obstacles and forbidden cells grow: the radius of the robot.
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell at its side.
    unknown_is_free : bool
        Whether unknown cells may be entered.
    turning_radius : float [m]
        Least radius of the lattice's curves.
    reverse_cost : float, optional
        The lattice may drive backwards, for so many times the length; None: forwards only. The heading of each pose
        is the robot's own.

    Attributes
    ----------
    default_planner : str

    Raises
    ------
    InvalidPlanner
        If there is no planner of that id.
    InvalidInput
        If a number is negative or not finite, or the turning radius or the reverse cost 0.

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
        turning_radius: float = 0.5,
        reverse_cost: float | None = None,
    ):
        _check_planner(default_planner)
        self.default_planner = default_planner
        self._inflation_radius = _number(inflation_radius, 'inflation radius', 'm')
        self._corner_cutting = bool(corner_cutting)
        self._unknown_is_free = bool(unknown_is_free)
        self._turning_radius = _number(turning_radius, 'turning radius', 'm')
        if self._turning_radius == 0:
            raise InvalidInput('turning radius 0 m is not above 0')
        if reverse_cost is not None and not 0 < reverse_cost < np.inf:
            raise InvalidInput(f'reverse cost {reverse_cost} is not a finite number above 0')
        self._reverse_cost = reverse_cost
        self._site = None
        # What was updated since the map came: cost by cell.
        self._told = {}
        self._changing = threading.Lock()

    @property
    def planners(self) -> tuple[str, ...]:
        """Ids of the planners."""
        return tuple(PLANS)

    @property
    def updates(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Cells (N, 2) whose costs were updated since the map came, and these costs (N,)."""
        with self._changing:
            cells = np.array(list(self._told), np.int64).reshape(-1, 2)
            return cells, np.array(list(self._told.values()), float)

    def set_map(self, grid: OccupancyGrid, *, keepout: OccupancyGrid | None = None,
                speed: OccupancyGrid | None = None) -> None:
        """Plan on another map from the next query on; queries under way finish on the one they began with.

        Updates of the costs are forgotten. Plans are kept, and brought up to date when they are used, if the new map
        has the size and the place of the old one.

        Parameters
        ----------
        grid : OccupancyGrid
        keepout : OccupancyGrid, optional
            Mask whose occupied cells are forbidden and grow by the inflation radius, in the same frame; it may lie
            otherwise than the map.
        speed : OccupancyGrid, optional
            Mask of speeds in percent, 0 and unknown for no limit: a cell costs D* and A* so many times more as it
            takes longer.
        """
        # The kernels are loaded now, and not while a request waits.
        warm_up('world', 'grid')
        terrain = PlanningMap(grid, self._inflation_radius, self._unknown_is_free, keepout=keepout, speed=speed)
        with self._changing:
            self._told = {}
            same = None if self._site is None else self._site.terrain.replaced(terrain)
            if same is None:
                rules = Rules(self._corner_cutting, self._turning_radius / grid.resolution, self._reverse_cost)
                self._site = _Site(terrain, KeptPlans(rules))
            else:
                self._site = self._site._replace(terrain=same)

    def update_costs(self, cells: ArrayLike, costs: ArrayLike) -> None:
        """Change the costs of cells from the next query on, until another map comes.

        D* repairs its plans. Its costs and those of A* are weights; to the other planners a cell is blocked or free.

        Parameters
        ----------
        cells : (N, 2) array_like of int
            Cells (x, y) of the map; of a cell named twice the last one counts.
        costs : (N,) array_like
            1 for a free cell, any other number above 0 for a dearer or cheaper one, inf for a blocked one. A blocked
            cell grows by the inflation radius like those of the map; a free one that is forbidden, or within the
            inflation of another cell, stays closed.

        Raises
        ------
        NoMap
            If no map was set.
        InvalidInput
            If a cell is not of the map or a cost not above 0; then nothing is changed.
        LimitExceeded
            If they are more than a million.
        """
        with self._changing:
            site = self._require_site()
            rows = checked_update(cells, costs, site.terrain.grid.shape)
            if len(rows) == 0:
                return
            self._site = site._replace(terrain=site.terrain.updated(rows))
            self._told.update(zip(map(tuple, rows[:, :2].astype(int).tolist()), rows[:, 2].tolist()))

    def cost_to_go(
        self,
        goal: ArrayLike,
        planner: str = 'distance_transform',
        *,
        deadline: float | None = None,
        stop: NDArray[np.uint8] | None = None,
        done: NDArray[np.int64] | None = None,
    ) -> tuple[OccupancyGrid, NDArray[np.float64]]:
        """Return the map and the cost from each of its cells to a goal.

        Parameters
        ----------
        goal : (2,) or (3,) array_like [m, m, rad]
            In a free cell.
        planner : {'distance_transform', 'dstar'}
            The second heeds the costs of the cells.
        deadline, stop, done
            See `plan_path`.

        Returns
        -------
        grid : OccupancyGrid
        field : (h, w) ndarray [m]
            NaN if occupied, inf if the goal cannot be reached.

        Raises
        ------
        PlanningError
            As `plan_path`.
        """
        if planner not in FIELD_PLANNERS:
            raise InvalidPlanner(f'planner {planner!r} has no field of costs: {", ".join(FIELD_PLANNERS)} have one')
        goal = _pose(np.append(goal, 0.0)[:3], 'goal')
        terrain, plans = self._require_site()
        cell = terrain.cell(goal, 'goal', GoalOutside)
        if terrain.occupied[cell[1], cell[0]]:
            raise GoalOccupied(terrain.why_occupied(goal, cell, 'goal'))
        flag, done = StopFlag(deadline, stop), np.zeros(2, np.int64) if done is None else done
        with flag, plans.plan(planner, cell, flag) as plan:
            field = plan.field(terrain, flag.array, done)
            return terrain.grid, by_rows(lambda part: part * terrain.grid.resolution, float, flag.array, field)

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
        done: NDArray[np.int64] | None = None,
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
        done : (2,) ndarray of int64, optional
            For another thread to look at, zeros at first: ``done[0]`` of ``done[1]`` parts of the field are planned.
            Searches that cannot say how much is before them leave it alone.

        Returns
        -------
        PlannedPath

        Raises
        ------
        InvalidPlanner
            If there is no planner of that id.
        StartOutside, GoalOutside, StartOccupied, GoalOccupied
            If an end is not in a free cell of the map. A start that is only within the inflation radius of an
            obstacle is left by the shortest way.
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
        planner = planner or self.default_planner
        _check_planner(planner)
        start, goal = _pose(start, 'start'), _pose(goal, 'goal')
        tolerance = _number(tolerance, 'tolerance', 'm')
        if deadline is not None and not deadline > 0:
            raise InvalidInput(f'deadline {deadline} s is not above 0')
        # One reference for the whole query: another map or update may replace it meanwhile.
        terrain, plans = self._require_site()
        query = PathQuery(terrain, plans, planner, StopFlag(deadline, stop),
                          np.zeros(2, np.int64) if done is None else done)
        with query.flag:
            poses, cost, statistics = query.answer(start, goal, tolerance)
        query.flag.check()
        return PlannedPath(poses, cost, time.perf_counter() - began, statistics)

    def _require_site(self):
        site = self._site
        if site is None:
            raise NoMap('no map has arrived yet')
        return site


class _Site(NamedTuple):
    """A map and the plans made for it, always replaced together."""

    terrain: PlanningMap
    plans: KeptPlans


def _check_planner(name):
    """Raise InvalidPlanner unless it is the id of a planner."""
    if name not in PLANS:
        raise InvalidPlanner(f'planner {name!r} is not one of {", ".join(PLANS)}')


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
