"""Bug2: a robot that sees only the cells around it, a line to the goal in its head and one hand on the wall.

Lumelsky and Stepanov, Path-planning strategies for a point mobile automaton moving amidst unknown obstacles of
arbitrary shape, Algorithmica 2, 1987. There the plane is continuous; on cells completeness needs two decisions:

- The m-line is a row of cells that share sides. When such a row leaves an obstacle it is at once on a free cell that
  touches the obstacle, so that the wall cannot be followed past it. With diagonal steps it could.
- The wall is followed from side to side of occupied cells, not from cell to cell. "The robot in this cell with the wall
  at that side" has exactly one successor and one predecessor, so the tour of a wall closes, and the sides between one
  free and one occupied region form a single tour (Rosenfeld 1970).

A robot that leaves the wall only on a later cell of the m-line than the one where it hit makes progress with each
hit, and one that has gone round without meeting such a cell is shut off from the goal.
"""
from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import Cancelled, InvalidInput, NoPath
from mobile_planning.grid.planner import PlannerBase
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, OccupancyGrid

Cell = tuple[int, int]


class Bug2Step(NamedTuple):
    """What a robot knows after a step.

    Attributes
    ----------
    cell : tuple of int
        Where it is, (x, y).
    wall : tuple of int or None
        The occupied cell at its side that it follows; None on the m-line.
    hit : tuple of int or None
        The cell where it came upon that wall.
    """

    cell: Cell
    wall: Cell | None
    hit: Cell | None


class Bug2(PlannerBase):
    """A robot with a bump sensor: straight to the goal, and around what is in the way.

    It plans nothing and knows no cell before it stands beside it, so its paths can be very long; it arrives whenever
    there is a path at all.

    Parameters
    ----------
    occgrid : (h, w) array_like or OccupancyGrid, optional
        Nonzero where the robot must not enter. Outside it all is occupied.
    goal, start : (2,) array_like, optional
        Cells (x, y).
    inflate, occupied_from, unknown_is_free, verbose
        See `PlannerBase`.
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell at its side; if not, both cells beside it must be free.
    wall_on : {'left', 'right'}
        The hand that it keeps on the wall.

    Attributes
    ----------
    hits : list of tuple of int
        Cells where the last run came upon a wall.

    Examples
    --------
    >>> import numpy as np
    >>> occupied = np.zeros((5, 7))
    >>> occupied[1:5, 3] = 1
    >>> Bug2(occupied).run(start=(0, 3), goal=(6, 3)).T
    array([[0, 1, 2, 2, 2, 3, 4, 4, 4, 5, 6],
           [3, 3, 3, 2, 1, 0, 1, 2, 3, 3, 3]])
    """

    def __init__(
        self,
        occgrid: ArrayLike | OccupancyGrid | None = None,
        *,
        goal: ArrayLike | None = None,
        start: ArrayLike | None = None,
        inflate: float = 0,
        corner_cutting: bool = True,
        wall_on: str = 'left',
        occupied_from: int = OCCUPIED_FROM,
        unknown_is_free: bool = False,
        verbose: bool = False,
    ):
        super().__init__(occgrid, goal=goal, start=start, inflate=inflate, occupied_from=occupied_from,
                         unknown_is_free=unknown_is_free, verbose=verbose)
        if wall_on not in ('right', 'left'):
            raise InvalidInput(f'wall_on {wall_on!r} is not right or left')
        self._corner_cutting = bool(corner_cutting)
        self._turn_right = _clockwise if wall_on == 'right' else _anticlockwise
        self._turn_left = _anticlockwise if wall_on == 'right' else _clockwise
        self._ends = None
        self.hits: list[Cell] = []

    @property
    def m_line(self) -> NDArray[np.float64] | None:
        """The line a x + b y + c = 0 of the last run, (3,), with a^2 + b^2 = 1; None if there is none."""
        if self._ends is None or self._ends[0] == self._ends[1]:
            return None
        (x, y), (to_x, to_y) = self._ends
        return np.array([y - to_y, to_x - x, x * to_y - to_x * y]) / np.hypot(to_x - x, to_y - y)

    def run(
        self,
        start: ArrayLike | None = None,
        goal: ArrayLike | None = None,
        animate: bool = False,
        movie: str | Path | tuple | None = None,
        *,
        on_step: Callable[[Bug2Step], None] | None = None,
        stop: NDArray[np.uint8] | None = None,
    ) -> NDArray[np.int64]:
        """Return the path that the robot takes.

        Parameters
        ----------
        start, goal : (2,) array_like, optional
            Cells (x, y); those set before if not given.
        animate, movie
            See `PlannerBase.query`.
        on_step : callable, optional
            Called with a `Bug2Step` wherever the robot is, from the start to the goal.
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread, or in ``on_step``, to give up.

        Returns
        -------
        (N, 2) ndarray of int64
            Cells from start to goal, both included, each a neighbour of the one before.

        Raises
        ------
        StartOutside, StartOccupied, GoalOutside, GoalOccupied
            If an end is no free cell.
        NoPath
            If obstacles part it from the goal.
        InvalidInput
            If an end is missing.
        Cancelled
            If ``stop`` was set.
        """
        begin = self._take_ends(start, goal, movie)
        path = self._drive(begin, on_step, stop)
        self._show_path(path, None, False, animate, movie)
        return path

    def has_plan(self) -> bool:
        """Return True: the robot needs none."""
        return True

    def steps(self, start: ArrayLike, goal: ArrayLike) -> Iterator[Bug2Step]:
        """Yield what the robot knows, step by step, from the start to the goal; see `run`."""
        start, goal = (self.validate_endpoint(end, name=name) for name, end in (('start', start), ('goal', goal)))
        return self._walk(tuple(start.tolist()), tuple(goal.tolist()))

    def _solve(self, start, stop):
        return self._drive(start, None, stop), None

    def _drive(self, start, on_step, stop):
        """Return the path (N, 2), telling each step."""
        if self.goal is None:
            raise InvalidInput('no goal was given')
        path = []
        for step in self._walk(tuple(start.tolist()), tuple(self.goal.tolist())):
            if on_step is not None:
                on_step(step)
            if stop is not None and stop[0]:
                raise Cancelled(f'the robot was stopped in cell {step.cell} after {len(path)} steps')
            if not path or path[-1] != step.cell:
                path.append(step.cell)
        return np.array(path, np.int64)

    def _walk(self, start, goal):
        """Yield the steps from start to goal, or raise NoPath on the way."""
        self._ends, self.hits = (start, goal), []
        line, is_main = _m_line(start, goal)
        order = {cell: i for i, cell in enumerate(line)}
        i = 0
        yield Bug2Step(start, None, None)
        while i < len(line) - 1:
            # The next main cell lies one or two sides away.
            ahead = i + 1 if is_main[i + 1] else i + 2
            if self._is_step(line[i], line[ahead]):
                i = ahead
            elif self._is_free(line[i + 1]):
                i += 1
            else:
                hit = line[i]
                self.hits.append(hit)
                for cell, wall in self._along_wall(hit, line[i + 1]):
                    yield Bug2Step(cell, wall, hit)
                    if order.get(cell, -1) > i:
                        i = order[cell]
                        break
                else:
                    raise NoPath(f'no path leads from start {start} to goal {goal}: the robot went around the wall '
                                 f'that it hit in {hit}')
            yield Bug2Step(line[i], None, None)

    def _along_wall(self, cell, wall):
        """Yield the robot's cells and the wall cell at its side, until it is back where it was."""
        begin = cell, wall
        while True:
            x, y = cell
            side = wall[0] - x, wall[1] - y
            along = self._turn_left(*side)
            ahead, beyond = (x + along[0], y + along[1]), (wall[0] + along[0], wall[1] + along[1])
            if self._corner_cutting and self._is_free(beyond):
                cell = beyond  # around the wall's corner, cutting it
            elif not self._is_free(ahead):
                wall = ahead  # into a corner: the wall goes on ahead
                if (cell, wall) == begin:
                    return
                continue
            elif not self._is_free(beyond):
                cell, wall = ahead, beyond
            else:
                yield ahead, None  # around the wall's corner by way of the cell ahead of it
                cell = beyond
            if (cell, wall) == begin:
                return
            yield cell, wall

    def _is_free(self, cell):
        x, y = cell
        return self._occupied is None or (self._contains(x, y) and not self._occupied[y, x])

    def _is_step(self, cell, to):
        """Return whether the robot can step to a neighbour."""
        return self._is_free(to) and (
            self._corner_cutting or (self._is_free((cell[0], to[1])) and self._is_free((to[0], cell[1]))))

    def _plot_background(self, ax, configspace, options):
        from mobile_planning.drawing import maps

        super()._plot_background(ax, configspace, options)
        if self._ends is not None and not configspace:
            dashed = {'color': '0.3', 'linewidth': 1.2, 'linestyle': '--'}
            maps.draw_path(ax, self._ends, line=(dashed,), label='m-line')


def _clockwise(x, y):
    return y, -x


def _anticlockwise(x, y):
    return -y, x


def _m_line(start, goal):
    """Return the cells of the m-line, each beside the one before, and which of them a diagonal step does not skip."""
    (x, y), (to_x, to_y) = start, goal
    across, up = abs(to_x - x), abs(to_y - y)
    step_x, step_y = (1 if to_x > x else -1), (1 if to_y > y else -1)
    steps = max(across, up)
    main = [(x + step_x * ((2 * k * across + steps) // (2 * steps)), y + step_y * ((2 * k * up + steps) // (2 * steps)))
            for k in range(1, steps + 1)]
    cells, is_main = [start], [True]
    for cell in main:
        last = cells[-1]
        if cell[0] != last[0] and cell[1] != last[1]:
            # Of the two cells between, the one nearer to the line.
            between = min(((cell[0], last[1]), (last[0], cell[1])),
                          key=lambda c: abs((c[0] - x) * (to_y - y) - (c[1] - y) * (to_x - x)))
            cells.append(between)
            is_main.append(False)
        cells.append(cell)
        is_main.append(True)
    return cells, is_main
