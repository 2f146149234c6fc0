"""What every grid planner has: a grid, a start, a goal, and the way from plan to query."""
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from mobile_planning.errors import (
    GoalOccupied, GoalOutside, InvalidInput, NoMap, StartOccupied, StartOutside)
from mobile_planning.grid.observer import film_of
from mobile_planning.grid.planner_films import PlannerFilms, end_text
from mobile_planning.world.cost_to_go import as_mask
from mobile_planning.world.inflation import grown
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, OccupancyGrid

_ENDPOINT_ERRORS = {
    'start': (StartOutside, StartOccupied), 'goal': (GoalOutside, GoalOccupied), 'root': (StartOutside, StartOccupied)}


class PlannerBase(PlannerFilms):
    """A planner on a grid of cells, each (x, y) = (column, row), its centre on the integers.

    Points may be given as real numbers: they mean the cell whose centre is nearest.
    The caller's grid is read once and never written.

    A planner of its own kind fills in `_plan`, and `_next`, `_path` or `_solve`. What shows its work, ``animate``,
    ``movie``, ``progress``, ``summary`` and ``verbose``, is served here.

    Parameters
    ----------
    occgrid : (h, w) array_like or OccupancyGrid, optional
        Nonzero where a robot must not enter; of an `OccupancyGrid` only the cells count, not where they lie.
    goal, start : (2,) array_like, optional
        Cells (x, y).
    inflate : float [cells]
        Obstacles are grown to every cell whose centre is at most this far from the centre of an occupied cell.
    occupied_from : int
        The least value of an `OccupancyGrid` that counts as occupied.
    unknown_is_free : bool
        Whether unknown cells of an `OccupancyGrid` may be entered.
    verbose : bool
        Whether to print a line about each plan and path.
    stop : (1,) ndarray of uint8, optional
        Set ``stop[0]`` from another thread to end the reading of a large map with Cancelled.

    Raises
    ------
    InvalidInput
        If a number is not finite or out of its range.
    StartOutside, StartOccupied, GoalOutside, GoalOccupied
        If an end is no free cell.
    """

    def __init__(
        self,
        occgrid: ArrayLike | OccupancyGrid | None = None,
        *,
        goal: ArrayLike | None = None,
        start: ArrayLike | None = None,
        inflate: float = 0,
        occupied_from: int = OCCUPIED_FROM,
        unknown_is_free: bool = False,
        verbose: bool = False,
        stop: NDArray[np.uint8] | None = None,
    ):
        if not (np.isfinite(inflate) and inflate >= 0):
            raise InvalidInput(f'inflate {inflate} cells is not a finite number of at least 0')
        self._obstacles = self._occupied = None
        if occgrid is not None:
            if isinstance(occgrid, OccupancyGrid):
                occgrid = occgrid.occupied(occupied_from, unknown_is_free)
            obstacles = as_mask(occgrid).view(bool)
            # What nobody can write is shared: a server makes many planners on one map.
            self._obstacles = obstacles.copy() if obstacles.flags.writeable else obstacles
            self._occupied = grown(self._obstacles, inflate, stop) if inflate else self._obstacles
            self._obstacles.flags.writeable = self._occupied.flags.writeable = False
        self._inflate = inflate
        self._start = self._goal = self._planned_goal = None
        self._verbose = bool(verbose)
        if start is not None:
            self.start = start
        if goal is not None:
            self.goal = goal

    @property
    def start(self) -> NDArray | None:
        """Start cell (2,), checked when it is set."""
        return self._start

    @start.setter
    def start(self, point: ArrayLike) -> None:
        self._start = self.validate_endpoint(point, name='start')

    @property
    def goal(self) -> NDArray | None:
        """Goal cell (2,), checked when it is set."""
        return self._goal

    @goal.setter
    def goal(self, point: ArrayLike) -> None:
        self._goal = self.validate_endpoint(point, name='goal')

    @property
    def occgrid(self) -> NDArray[np.bool_] | None:
        """The grid that is planned on, (h, w), True where occupied or inflated; read-only, None without a grid."""
        return self._occupied

    @property
    def verbose(self) -> bool:
        """Whether a line is printed about each plan and path."""
        return self._verbose

    @verbose.setter
    def verbose(self, verbose: bool) -> None:
        self._verbose = bool(verbose)

    def isoccupied(self, p: ArrayLike) -> bool:
        """Return whether the cell of a point is occupied: True outside the grid, False if there is no grid.

        Parameters
        ----------
        p : (2,) array_like
            Cell (x, y).
        """
        x, y = self._nearest_cell(p, 'point')
        if self._occupied is None:
            return False
        return not self._contains(x, y) or bool(self._occupied[y, x])

    def validate_endpoint(self, p: ArrayLike, dtype: DTypeLike = None, *, name: str = 'start') -> NDArray:
        """Return the point as a cell, if a robot can be there.

        Parameters
        ----------
        p : (2,) array_like
            Cell (x, y).
        dtype : data type, optional
            Of the result, int64 if not given.
        name : {'start', 'goal', 'root'}
            Which point it is: it decides the kind of error.

        Returns
        -------
        (2,) ndarray

        Raises
        ------
        StartOutside, StartOccupied, GoalOutside, GoalOccupied
            Each also a ValueError.
        """
        cell = self._nearest_cell(p, name)
        x, y = cell.tolist()
        outside, occupied = _ENDPOINT_ERRORS[name]
        if self._occupied is not None:
            if not self._contains(x, y):
                height, width = self._occupied.shape
                raise outside(f'{name} ({x}, {y}) is outside the grid of {width} x {height} cells')
            if self._obstacles[y, x]:
                raise occupied(f'{name} ({x}, {y}) is occupied')
            if self._occupied[y, x]:
                raise occupied(f'{name} ({x}, {y}) is within {self._inflate:g} cells of an obstacle')
        return cell.astype(dtype) if dtype is not None else cell

    def plan(
        self,
        goal: ArrayLike | None = None,
        animate: bool = False,
        *,
        progress: bool | Callable[[float], None] | NDArray[np.int64] = True,
        verbose: bool = False,
        summary: bool = False,
        movie: str | Path | tuple | None = None,
        stop: NDArray[np.uint8] | None = None,
    ) -> None:
        """Prepare the paths to a goal.

        Parameters
        ----------
        goal : (2,) array_like, optional
            Cell (x, y); the one set before if not given.
        animate : bool
            Whether to show in a window how the plan spread.
        progress : bool, callable or (2,) ndarray of int64
            Called with the share that is done, from 0 to 1, a few times a second and at the end. True is a bar, shown
            only on a terminal and only if planning lasts. An array is for another thread to look at: ``progress[0]``
            of ``progress[1]`` parts are done.
        verbose : bool
            Whether to print a line about the plan, as the planner's own `verbose` does for all.
        summary : bool
            Whether to print all that ``str`` tells about the planner once it has planned.
        movie : path, or tuple of path and float [s], optional
            A .gif or .mp4 to write of how the plan spread, and the time between its frames. An .mp4 needs ffmpeg.
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread to give up; the plan before stays.

        Raises
        ------
        NoMap
            If there is no grid.
        GoalOutside, GoalOccupied
            If the goal is no free cell.
        InvalidInput
            If no goal was given.
        Cancelled
            If ``stop`` was set.
        """
        if goal is not None:
            self.goal = goal
        self._watch_plan(self._plan, animate, progress, verbose, summary, movie, stop)

    def next(self, position: ArrayLike) -> NDArray[np.int64] | None:
        """Return the cell after ``position`` on the way to the goal.

        Parameters
        ----------
        position : (2,) array_like
            Cell (x, y).

        Returns
        -------
        (2,) ndarray of int64, or None at the goal

        Raises
        ------
        StartOutside, StartOccupied
            If the position is no free cell.
        GoalOccupied
            If the goal was blocked since it was planned for.
        NoPath
            If the goal cannot be reached from there.
        RuntimeError
            If nothing was planned for the present goal.
        """
        cell = self.validate_endpoint(position)
        self._check_planned()
        return self._next(cell)

    def has_plan(self) -> bool:
        """Return whether there is a plan for the present goal."""
        return self._planned_goal is not None and self._planned_goal.tolist() == self.goal.tolist()

    def query(
        self,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        dtype: DTypeLike = None,
        next: bool = True,
        animate: bool = False,
        movie: str | Path | tuple | None = None,
        verbose: bool = False,
        *,
        stop: NDArray[np.uint8] | None = None,
    ) -> NDArray | tuple[NDArray, NamedTuple]:
        """Return the path from start to goal.

        Parameters
        ----------
        start : (2,) or (3,) array_like, optional
            Cell (x, y), or configuration (x, y, theta) where the planner has headings; the one set before if not given.
        goal : (2,) or (3,) array_like, optional
            The present goal if not given; another one is planned for.
        dtype : data type, optional
            Of the path; if not given, int64 of cells and float64 of configurations.
        next : bool
            Whether to go to the goal; if not, both ends are checked and the path is the start alone.
        animate : bool
            Whether to show in a window how the robot drives.
        movie : path, or tuple of path and float [s], optional
            A .gif or .mp4 to write of it, and the time between its frames. An .mp4 needs ffmpeg.
        verbose : bool
            Whether to print a line about the path, as the planner's own `verbose` does for all.
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread to give up.

        Returns
        -------
        (N, 2) or (N, 3) ndarray
            From start to goal, both included; one row if they are the same. Planners that say so return a status too.

        Raises
        ------
        StartOutside, StartOccupied, GoalOutside, GoalOccupied
            If an end is no free cell.
        NoPath
            If no path joins them.
        RuntimeError
            If nothing was planned.
        InvalidInput
            If no start was given.
        Cancelled
            If ``stop`` was set.
        """
        begin = self._take_ends(start, goal, movie)
        if next and goal is not None and not self.has_plan():
            self.plan(stop=stop)
        if not next:
            return begin[None].astype(dtype) if dtype is not None else begin[None]
        self._check_planned()
        path, status = self._solve(begin, stop)
        self._show_path(path, status, verbose, animate, movie)
        path = path.astype(dtype) if dtype is not None else path
        return path if status is None else (path, status)

    def __str__(self) -> str:
        return '\n  '.join([f'{type(self).__name__}:', *self._facts()])

    def _facts(self) -> list[str]:
        """Return the lines of ``str``; a planner adds its own."""
        if self._occupied is None:
            grid = 'none'
        else:
            height, width = self._occupied.shape
            grid = f'{width} x {height} cells, {self._occupied.mean():.1%} occupied'
        return [f'grid: {grid}', f'start: {end_text(self.start)}', f'goal: {end_text(self.goal)}']

    def _plan(self, stop: NDArray[np.uint8], done: NDArray[np.int64]) -> None:
        """Plan until done or ``stop[0]`` is set; ``done`` counts what is done, and of how much."""
        raise NotImplementedError(f'{type(self).__name__} does not plan')

    def _take_ends(self, start, goal, movie):
        """Set the ends that are given, and return the start."""
        film_of(movie)
        # Kept apart from `self.start`: another thread may query the same plan.
        begin = self.start if start is None else self.validate_endpoint(start)
        if begin is None:
            raise InvalidInput('no start was given')
        self._start = begin
        if goal is not None:
            self.goal = goal
        return begin

    def _solve(self, start: NDArray, stop: NDArray[np.uint8] | None) -> tuple[NDArray, NamedTuple | None]:
        """Return the path from a valid start and its status, if the planner has one."""
        return self._path(start), None

    def _path(self, start: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the path (N, 2) from a free cell, step by step; a planner that knows a faster way overrides this."""
        path = [start]
        while (step := self._next(path[-1])) is not None:
            path.append(step)
        return np.array(path)

    def _next(self, cell: NDArray[np.int64]) -> NDArray[np.int64] | None:
        """Return the cell after a free one on the way to the goal, None at the goal."""
        raise NotImplementedError(f'{type(self).__name__} has no next')

    def _check_planned(self) -> None:
        if not self.has_plan():
            raise RuntimeError(f'no plan for goal {self.goal}: call plan() first')

    def _require_goal(self) -> NDArray[np.int64]:
        if self.goal is None:
            raise InvalidInput('no goal was given')
        return self.goal

    def _require_grid(self) -> NDArray[np.bool_]:
        if self._occupied is None:
            raise NoMap(f'{type(self).__name__} was given no occupancy grid')
        return self._occupied

    def _nearest_cell(self, point, name):
        """Return the cell (2,) int64 whose centre is nearest; halves go to the even number."""
        try:
            values = np.asarray(point, dtype=float)
        except (TypeError, ValueError):
            raise InvalidInput(f'{name} {point!r} is not a point (x, y)') from None
        if values.shape != (2,) or not np.isfinite(values).all():
            raise InvalidInput(f'{name} {values.tolist()} is not two finite numbers (x, y)')
        return np.array([round(min(max(value, -2.0 ** 53), 2.0 ** 53)) for value in values.tolist()])

    def _contains(self, x, y):
        height, width = self._occupied.shape
        return 0 <= x < width and 0 <= y < height
