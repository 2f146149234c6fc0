"""The D* planner: least-cost paths on a cost map, repaired rather than planned anew when costs change."""
from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import Cancelled, GoalOccupied, InvalidInput, NoPath, StartOccupied
from mobile_planning.grid.planner import PlannerBase
from mobile_planning.grid.repairable_field import RepairableField
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, OccupancyGrid
from mobile_planning.world.row_blocks import by_rows, row_blocks


@dataclass(frozen=True)
class _DstarStatus:
    """How a query went; the seed documents print this name.

    Attributes
    ----------
    cost : float
        Of the path that was returned, each step at the costs it was taken at.
    expansions : int
        Cells that were expanded for this query; 0 if no change concerned it.
    full_replan : bool
        Whether a repair would have taken longer than planning anew, and that was done.
    """

    cost: float
    expansions: int = field(default=0, repr=False)
    full_replan: bool = field(default=False, repr=False)


class DstarPlanner(PlannerBase):
    """Least-cost paths to one goal on a map whose costs change while the robot is under way.

    A step costs the mean of the costs of its two cells times its length, 1 or sqrt(2). `plan` computes the cost-to-go
    of every cell; after changes a query repairs only what concerns its start (D* Lite), and gives what a new plan
    would give: the same path and cost. Changes that concern too much of the map are planned anew.

    One thread at a time may use a planner.

    Parameters
    ----------
    costmap : (h, w) array_like or OccupancyGrid, optional
        Cost of each cell, any positive number, inf where a robot must not enter. Of an `OccupancyGrid`, or of an array
        of bool that is True where occupied, free cells cost 1 and the others inf. It is read once and never written.
    goal, start : (2,) array_like, optional
        Cells (x, y).
    corner_cutting : bool
        Whether a diagonal step may pass a blocked cell at its side; if not, both cells beside it must be free.
    inflate : float [cells]
        Obstacles are grown by a disc of this radius. Cells that are updated later count as they are told.
    max_expansions : int, optional
        After so many expansions in a repair, changed cells counted in, the field is planned anew. If not given, as many
        as take about a quarter of the time of a new plan.
    occupied_from, unknown_is_free, verbose, stop
        See `PlannerBase`.

    Examples
    --------
    >>> from mobile_planning import DstarPlanner
    >>> import numpy as np
    >>> costmap = np.ones((6, 6));
    >>> costmap[2:5, 3:5] = 10
    >>> ds = DstarPlanner(costmap, goal=(1, 1));
    >>> ds.plan()
    >>> path, status = ds.query(start=(5, 4))
    >>> print(path.T)
    [[5 5 5 4 3 2 1]
     [4 3 2 1 1 1 1]]
    >>> print(status)
    _DstarStatus(cost=np.float64(6.414213562373095))
    >>> ds.update([(4, 1, np.inf), (4, 2, 1.0)])
    >>> path, status = ds.query(start=(5, 4))
    >>> print(path.T)
    [[5 5 4 3 2 1]
     [4 3 2 1 1 1]]
    """

    def __init__(
        self,
        costmap: ArrayLike | OccupancyGrid | None = None,
        *,
        goal: ArrayLike | None = None,
        start: ArrayLike | None = None,
        corner_cutting: bool = True,
        inflate: float = 0,
        max_expansions: int | None = None,
        occupied_from: int = OCCUPIED_FROM,
        unknown_is_free: bool = False,
        verbose: bool = False,
        stop: NDArray[np.uint8] | None = None,
    ):
        if max_expansions is not None and max_expansions < 0:
            raise InvalidInput(f'max_expansions {max_expansions} is not at least 0')
        costs, occgrid = None, costmap
        if not (costmap is None or isinstance(costmap, OccupancyGrid) or getattr(costmap, 'dtype', None) == bool):
            costs = positive_costs(costmap, stop)
            occgrid = by_rows(np.isinf, bool, stop, costs)
            # What nobody can write is not copied.
            occgrid.flags.writeable = False
        super().__init__(occgrid, goal=goal, start=start, inflate=inflate, occupied_from=occupied_from,
                         unknown_is_free=unknown_is_free, verbose=verbose, stop=stop)
        self._field = None
        if self._occupied is not None:
            self._field = RepairableField(costs, self._occupied, bool(corner_cutting), max_expansions, stop)
            # Updates write them.
            self._obstacles = self._field.blocked if self._obstacles is self._occupied else self._obstacles.copy()
            self._occupied = self._field.blocked

    @property
    def nexpand(self) -> int:
        """Number of cells expanded so far, in plans and in repairs."""
        return 0 if self._field is None else self._field.expanded

    @property
    def occgrid(self) -> NDArray[np.bool_] | None:
        """The cells that are blocked now, (h, w), read-only; None without a cost map."""
        if self._field is None:
            return None
        view = self._field.blocked.view()
        view.flags.writeable = False
        return view

    @property
    def costmap(self) -> NDArray[np.float64] | None:
        """The costs that hold now, (h, w), read-only; None without a cost map."""
        return None if self._field is None else self._field.costs

    @property
    def distancemap(self) -> NDArray[np.float64] | None:
        """Cost-to-go of every cell at the costs that hold now, (h, w): NaN if blocked, inf if unreachable.

        None before the first plan. After changes this plans anew.
        """
        return self.cost_to_go() if self.has_plan() else None

    def cost_to_go(self, stop: NDArray[np.uint8] | None = None) -> NDArray[np.float64]:
        """Return the `distancemap`; raise Cancelled if ``stop[0]`` is set meanwhile, RuntimeError without a plan."""
        self._check_planned()
        goal = self._field.index(*self.goal.tolist())
        is_free = not self._field.is_blocked(goal)
        if is_free and not self._field.is_right_everywhere():
            self._field.plan(goal, stop)
        values, result = self._field.values(), np.empty(self._occupied.shape)
        for rows in row_blocks(result.shape, stop):
            result[rows] = np.where(self._occupied[rows], np.nan, values[rows] if is_free else np.inf)
        return result

    def _plan(self, stop: NDArray[np.uint8], done: NDArray[np.int64]) -> None:
        """Compute the cost-to-go of every cell; a plan that was stopped is finished by the next query."""
        self._require_grid()
        self._planned_goal = self.validate_endpoint(self._require_goal(), name='goal')
        self._field.plan(self._field.index(*self.goal.tolist()), stop, done)

    def update(self, cells: ArrayLike | Iterable[tuple[float, float, float]]) -> None:
        """Change the costs of cells; the next query repairs its paths.

        Parameters
        ----------
        cells : (N, 3) array_like
            Rows (x, y, new cost); of a cell named twice the last one counts.

        Raises
        ------
        NoMap
            If there is no cost map.
        InvalidInput
            If a row is no cell of the map with a positive cost. No cell is changed then.
        """
        self._require_grid()
        self._apply(cells, 'update')

    def query(
        self,
        start: ArrayLike | None = None,
        sensor: Callable[[tuple[int, int]], Iterable] | None = None,
        animate: bool = False,
        verbose: bool = False,
        *,
        movie: str | Path | tuple | None = None,
        stop: NDArray[np.uint8] | None = None,
    ) -> tuple[NDArray[np.int64], _DstarStatus]:
        """Return the path from start to goal and its cost.

        Parameters
        ----------
        start : (2,) array_like, optional
            Cell (x, y); the one set before if not given.
        sensor : callable, optional
            Called with each cell (x, y) that the robot comes to, the goal excepted. Returns a list of (x, y, new cost)
            that holds from then on, empty if nothing is new; the rest of the path is replanned.
        animate, verbose, movie
            As in `PlannerBase.query`.
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread to give up; the next query goes on from there.

        Returns
        -------
        path : (N, 2) ndarray of int64
            Cells from start to goal, both included: with a sensor the ones that the robot went through.
        status : object
            With ``cost``, ``expansions`` and ``full_replan``.

        Raises
        ------
        StartOutside, StartOccupied
            If the start is no free cell, or the robot's own cell became blocked.
        GoalOccupied
            If the goal was blocked since it was planned for.
        NoPath
            If the goal cannot be reached.
        RuntimeError
            If nothing was planned.
        InvalidInput
            If no start was given, or the sensor reports anything but cells with costs.
        Cancelled
            If ``stop`` was set.
        """
        begin = self._take_ends(start, None, movie)
        self._check_planned()
        before = self.nexpand
        path, cost, replanned = self._best_path(begin, stop)
        if sensor is not None:
            path, cost, replanned = self._walk(path, sensor, stop, replanned)
        status = _DstarStatus(np.float64(cost), self.nexpand - before, replanned)
        self._show_path(path, status, verbose, animate, movie)
        return path, status

    def _next(self, cell: NDArray[np.int64]) -> NDArray[np.int64] | None:
        start, _ = self._settle(cell, None)
        if cell.tolist() == self.goal.tolist():
            return None
        return np.array(self._field.cell(self._field.next_cell(start)))

    def _walk(self, ahead, sensor, stop, replanned):
        """Return the path that a robot with a sensor takes, its cost and whether a full plan was needed."""
        walked, cost, i = [ahead[0]], 0.0, 0
        while i < len(ahead) - 1:
            if stop is not None and stop[0]:
                raise Cancelled('the robot was stopped on its way')
            if self._apply(sensor(tuple(ahead[i].tolist())), 'sensor'):
                ahead, _, anew = self._best_path(ahead[i], stop)
                replanned, i = replanned or anew, 0
            cost += self._field.step_cost(*[self._field.index(*cell) for cell in ahead[i:i + 2].tolist()])
            i += 1
            walked.append(ahead[i])
        return np.array(walked), cost, replanned

    def _best_path(self, begin, stop):
        """Return the best path from a cell at the costs that hold now, its cost and whether that took a full plan."""
        start, replanned = self._settle(begin, stop)
        return *self._field.path(start, stop), replanned

    def _settle(self, begin, stop):
        """Make the field right for a cell; return the cell's index and whether that took a full plan."""
        start, goal = (self._field.index(*cell.tolist()) for cell in (begin, self.goal))
        for index, name, error in ((start, 'start', StartOccupied), (goal, 'goal', GoalOccupied)):
            if self._field.is_blocked(index):
                raise error('{} ({}, {}) is occupied'.format(name, *self._field.cell(index)))
        replanned = self._field.settle(start, stop)
        if not self._field.is_reached(start):
            raise NoPath('no path leads from start ({}, {}) to goal ({}, {})'.format(*begin, *self.goal))
        return start, replanned

    def _apply(self, cells, source):
        """Set the costs of cells; return whether one became another."""
        rows = _rows_of(cells, source)
        if len(rows) == 0:
            return False
        wrong, is_new = self._field.set_costs(rows)
        if wrong >= 0:
            height, width = self._occupied.shape
            raise InvalidInput('{}: ({:g}, {:g}, {:g}) is not a cell of the grid of {} x {} cells with a positive cost'
                               .format(source, *rows[wrong], width, height))
        if self._obstacles is not self._occupied:
            x, y = rows[:, :2].astype(np.int64).T
            self._obstacles[y, x] = self._occupied[y, x]
        return is_new

    def _facts(self) -> list[str]:
        planned = 'none' if self._planned_goal is None else (
            '{} cells reach the goal ({}, {})'.format(self._field.reached, *self._planned_goal))
        return [*super()._facts(), f'expansions: {self.nexpand}', f'plan: {planned}']


def positive_costs(costmap: ArrayLike, stop: NDArray[np.uint8] | None = None) -> NDArray[np.float64]:
    """Return the cost map as an array of floats, none of them NaN or not above 0; Cancelled if ``stop[0]`` is set."""
    try:
        costs = np.asarray(costmap)
        is_map = costs.ndim == 2 and costs.size > 0
        costs = by_rows(np.asarray, float, stop, costs) if is_map and costs.dtype != float else costs
    except (TypeError, ValueError):
        raise InvalidInput('a cost map must be an array (h, w) of numbers') from None
    if not is_map:
        raise InvalidInput(f'a cost map of shape {costs.shape} is not two-dimensional with at least one cell')
    for rows in row_blocks(costs.shape, stop):
        positive = costs[rows] > 0
        if not positive.all():
            y, x = np.argwhere(~positive)[0] + (rows.start, 0)
            raise InvalidInput(f'cost {costs[y, x]} of cell ({x}, {y}) is not positive; blocked cells cost inf')
    return costs


def _rows_of(cells, source):
    """Return what was reported as an array (N, 3) of floats."""
    try:
        rows = np.ascontiguousarray(cells if isinstance(cells, (list, tuple, np.ndarray)) else list(cells), dtype=float)
    except (TypeError, ValueError):
        rows = None
    if rows is not None and rows.size == 0:
        return np.empty((0, 3))
    if rows is None or rows.ndim != 2 or rows.shape[1] != 3:
        raise InvalidInput(f'{source}: {cells!r:.80} is not a list of (x, y, new cost)')
    return rows
