"""What every grid planner has: a grid, a start, a goal, and the way from plan to query."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from mobile_planning.errors import (
    GoalOccupied, GoalOutside, InvalidInput, NoMap, StartOccupied, StartOutside)
from mobile_planning.world.cost_to_go import as_mask
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, OccupancyGrid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Cell centres lie on the integers.
_CORNER = (-0.5, -0.5, 0.0)
_ENDPOINT_ERRORS = {'start': (StartOutside, StartOccupied), 'goal': (GoalOutside, GoalOccupied)}


class PlannerBase:
    """A planner on a grid of cells, each (x, y) = (column, row), its centre on the integers.

    Points may be given as real numbers: they mean the cell whose centre is nearest.
    The caller's grid is read once and never written.

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
        Whether to print a line about each plan.

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
            self._occupied = _grown(self._obstacles, inflate) if inflate else self._obstacles
            self._obstacles.flags.writeable = self._occupied.flags.writeable = False
        self._inflate = inflate
        self._start = self._goal = None
        self.verbose = verbose
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
        name : {'start', 'goal'}
            Which end it is: it decides the kind of error.

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

    def plan(self, goal: ArrayLike | None = None) -> None:
        """Prepare the paths to a goal; each planner says how."""
        raise NotImplementedError(f'{type(self).__name__} does not plan')

    def next(self, position: ArrayLike) -> NDArray[np.int64] | None:
        """Return the cell after ``position`` on the way to the goal; each planner says how."""
        raise NotImplementedError(f'{type(self).__name__} has no next')

    def has_plan(self) -> bool:
        """Return whether there is a plan for the present goal."""
        return False

    def query(
        self, start: ArrayLike | None = None, goal: ArrayLike | None = None, dtype: DTypeLike = None,
    ) -> NDArray:
        """Return the path from start to goal.

        Parameters
        ----------
        start : (2,) array_like, optional
            Cell (x, y); the one set before if not given.
        goal : (2,) array_like, optional
            The present goal if not given; another one is planned for.
        dtype : data type, optional
            Of the result, int64 if not given.

        Returns
        -------
        (N, 2) ndarray
            Cells from start to goal, both included; one row if they are the same.

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
        """
        if start is not None:
            self.start = start
        # Kept apart from `self.start`: another thread may query the same plan.
        cell = self.start if start is None else self.validate_endpoint(start)
        if cell is None:
            raise InvalidInput('no start was given')
        if goal is not None:
            self.goal = goal
            if not self.has_plan():
                self.plan()
        path = self._path(cell)
        return path.astype(dtype) if dtype is not None else path

    def plot(
        self,
        path: ArrayLike | None = None,
        *,
        line: Sequence[Mapping] | None = None,
        background: bool = True,
        start_marker: Mapping | None = None,
        goal_marker: Mapping | None = None,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        ax: Axes | None = None,
        bgargs: Mapping | None = None,
    ) -> Axes:
        """Draw grid, path, start and goal.

        Parameters
        ----------
        path : (N, 2) array_like, optional
            Cells (x, y).
        line : sequence of dict, optional
            Matplotlib line properties, one line drawn on the other; striped yellow on black if not given.
        background : bool
            Whether to call `plot_bg`.
        start_marker, goal_marker : dict, optional
            Matplotlib properties; a circle and a star if not given.
        start, goal : (2,) array_like, optional
            The planner's own if not given.
        ax : Axes, optional
            A new figure's if not given.
        bgargs : dict, optional
            Further arguments of `plot_bg`.

        Returns
        -------
        Axes
            Write the picture with ``ax.figure.savefig``.
        """
        from mobile_planning.drawing import maps

        ax = self._axes(ax)
        if background:
            self.plot_bg(ax=ax, **(bgargs or {}))
        if path is not None and len(path):
            maps.draw_path(ax, path, line=line or maps.STRIPED_LINE, label='path')
        start, goal = self.start if start is None else start, self.goal if goal is None else goal
        if start is not None:
            maps.draw_pose(ax, start, start_marker or maps.START_MARKER, label='start')
        if goal is not None:
            maps.draw_pose(ax, goal, goal_marker or maps.GOAL_MARKER, label='goal')
        maps.draw_legend(ax)
        return ax

    def plot_bg(
        self,
        distance: ArrayLike | None = None,
        cmap: str = 'gray',
        ax: Axes | None = None,
        *,
        inflated: bool = True,
        colorbar: bool = True,
    ) -> Axes:
        """Draw what is planned on: a distance field if there is one, else the grid.

        Parameters
        ----------
        distance : (h, w) array_like, optional
            Drawn in place of the planner's own ``distancemap``.
        cmap : str
            Colour map of the field; small values are its first colours.
        ax : Axes, optional
            A new figure's if not given.
        inflated : bool
            Whether to show the cells that inflation occupied in pink, where there is no field.
        colorbar : bool

        Returns
        -------
        Axes
        """
        from mobile_planning.drawing import maps

        ax = self._axes(ax)
        distance = getattr(self, 'distancemap', None) if distance is None else distance
        if distance is not None:
            maps.draw_field(ax, distance, 1.0, _CORNER, cmap=cmap, label='distance to goal [cells]', colorbar=colorbar)
        elif self._occupied is not None:
            maps.draw_cells(ax, self._obstacles, self._occupied if inflated else self._obstacles, 1.0, _CORNER)
        return ax

    def __str__(self) -> str:
        return '\n  '.join([f'{type(self).__name__}:', *self._facts()])

    def _facts(self) -> list[str]:
        """Return the lines of ``str``; a planner adds its own."""
        if self._occupied is None:
            grid = 'none'
        else:
            height, width = self._occupied.shape
            grid = f'{width} x {height} cells, {self._occupied.mean():.1%} occupied'
        return [f'grid: {grid}', f'start: {_cell_text(self.start)}', f'goal: {_cell_text(self.goal)}']

    def _path(self, start: NDArray[np.int64]) -> NDArray[np.int64]:
        """Return the path (N, 2) from a free cell, step by step; a planner that knows a faster way overrides this."""
        path = [start]
        while (step := self.next(path[-1])) is not None:
            path.append(step)
        return np.array(path)

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
        return np.rint(np.clip(values, -2.0 ** 53, 2.0 ** 53)).astype(np.int64)

    def _contains(self, x, y):
        height, width = self._occupied.shape
        return 0 <= x < width and 0 <= y < height

    def _axes(self, ax):
        """Return the given axes, or those of a new figure around the grid."""
        from mobile_planning.drawing import maps

        if ax is None:
            height, width = (10, 10) if self._occupied is None else self._occupied.shape
            _, ax = maps.new_figure(width, height, type(self).__name__, unit='cells')
        return ax


def _grown(occupied, radius):
    """Return the cells whose centre is at most ``radius`` cells from the centre of an occupied one."""
    from scipy.ndimage import distance_transform_edt

    return distance_transform_edt(~occupied) <= radius * (1 + 1e-9) if occupied.any() else occupied.copy()


def _cell_text(cell):
    return 'none' if cell is None else '({}, {})'.format(*cell)
