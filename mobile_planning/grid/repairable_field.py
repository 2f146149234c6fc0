"""A cost-to-go field that is repaired, rather than computed anew, when costs change."""
from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import Cancelled, LimitExceeded
from mobile_planning.world.row_blocks import row_blocks

# A repair gives up after this part of the work of a full plan, counted in cells that it settled. Expanding a cell in a
# repair takes as long as settling up to 45 of equal costs, up to 2 of others: when it gives up it has taken about a
# quarter of the time of the plan that follows.
_SHARE_UNIFORM, _SHARE_WEIGHTED = 1 / 200, 1 / 7
# A cell beside an obstacle takes longer in a plan of equal costs, by this part: the processor guesses wrong there.
_EXTRA_BESIDE_OBSTACLES = 1.25
_FEWEST_EXPANSIONS = 100
# A queue with more entries than this, and than twice what remained of it the last time, is searched for dead ones.
_QUEUE_SIZE = 4096


class RepairableField:
    """The least cost from the cells of a map to one goal, kept right while the map changes.

    The kernels work on arrays with a border of blocked cells; cells are handed around as indices into them.

    Parameters
    ----------
    costs : (h, w) ndarray, optional
        Above 0, copied; 1 everywhere if not given.
    blocked : (h, w) ndarray of bool
        Where costs are inf, copied.
    corner_cutting : bool
        Whether a diagonal step may pass a blocked cell at its side.
    max_expansions : int, optional
        After so many expansions, changed cells counted in, a repair gives way to a new plan; if not given, after about
        a quarter of the time of one.
    stop : (1,) ndarray of uint8, optional
        Ends the copying with Cancelled.

    Attributes
    ----------
    blocked : (h, w) ndarray of bool
        Where costs are inf now.
    expanded : int
        Cells expanded so far.
    reached : int
        Cells that reach the goal, by the last full plan.
    """

    def __init__(self, costs: NDArray[np.float64] | None, blocked: NDArray[np.bool_], corner_cutting: bool,
                 max_expansions: int | None = None, stop: NDArray[np.uint8] | None = None):
        height, self._width = blocked.shape[0], blocked.shape[1] + 2
        self._costs = np.empty((height + 2) * self._width)
        self.blocked = np.empty_like(blocked)
        grid = self._costs.reshape(height + 2, self._width)
        grid[0] = grid[-1] = np.inf
        for rows in row_blocks(blocked.shape, stop):
            self.blocked[rows] = blocked[rows]
            grid[1:-1][rows] = np.inf
            grid[1:-1, 1:-1][rows] = np.where(blocked[rows], np.inf, 1.0 if costs is None else costs[rows])
        self._corner_cutting = corner_cutting
        self._max_expansions = max_expansions
        self.expanded = self.reached = 0
        self._goal = self._g = self._rhs = self._path = None
        # The least value that changed since that path was made.
        self._changed_from = np.inf
        # Whether only a full plan can make the field right.
        self._is_stale = True
        self._empty_queue()

    @property
    def costs(self) -> NDArray[np.float64]:
        """The costs that hold now, (h, w), read-only."""
        return self._inner(self._costs)

    def is_right_everywhere(self) -> bool:
        """Return whether no cell waits for repair."""
        return not (self._is_stale or self._changed or self._queue[2])

    def values(self) -> NDArray[np.float64]:
        """Return the field (h, w), read-only: inf where blocked or unreachable, exact if `is_right_everywhere`."""
        return self._inner(self._g)

    def index(self, x: int, y: int) -> int:
        """Return the index of a cell."""
        return (y + 1) * self._width + x + 1

    def cell(self, index: int) -> tuple[int, int]:
        """Return the cell (x, y) of an index."""
        y, x = divmod(int(index), self._width)
        return x - 1, y - 1

    def step_cost(self, cell: int, other: int) -> float:
        """Return the cost of the step between two neighbouring cells at the costs that hold now."""
        from mobile_planning.grid import descent_kernels as kernels

        return kernels.step_cost(self._costs, cell, other, self._width)

    def is_blocked(self, index: int) -> bool:
        """Return whether a cell is blocked now."""
        return self._costs[index] == np.inf

    def set_costs(self, rows: NDArray[np.float64]) -> tuple[int, bool]:
        """Change costs; the next path settles what follows.

        Parameters
        ----------
        rows : (N, 3) ndarray
            Cells and costs (x, y, cost), in order.

        Returns
        -------
        wrong : int
            The first row that is no cell with a positive cost, and then nothing is changed; or -1.
        is_new : bool
            Whether a cost became another.
        """
        from mobile_planning.grid import dstar_kernels as kernels

        wrong, is_new, changed = kernels.set_costs(rows, self._costs, self.blocked)
        if is_new and not self._is_stale:
            self._changed.append(changed)
            self._least = min(self._least, rows[:, 2].min())
            # What no repair could afford need not be remembered.
            self._is_stale = sum(map(len, self._changed)) > self._cap
        return wrong, is_new

    def plan(self, goal: int, stop: NDArray[np.uint8] | None, done: NDArray[np.int64] | None = None) -> None:
        """Compute the whole field to a goal at the costs that hold now; raise Cancelled if stopped.

        ``done`` (2,) counts the cells that the search has passed, and of how many that are free.
        """
        from mobile_planning.grid import dstar_kernels as kernels

        stop = np.zeros(1, np.uint8) if stop is None else stop
        done = np.zeros(2, np.int64) if done is None else done
        if self._g is None:
            self._g, self._rhs = np.empty_like(self._costs), np.empty_like(self._costs)
        self._goal, self._is_stale = goal, True
        self._empty_queue()
        self._least, most, free = kernels.cost_range(self._costs)
        done[:] = 0, free
        place = (self._g, self._rhs, self._costs, self._width, goal)
        if self._least == most:
            reached, beside = kernels.fill_uniform(*place, canonical_moves_of(self._corner_cutting), most, stop, done)
            affordable = _SHARE_UNIFORM * (reached + _EXTRA_BESIDE_OBSTACLES * beside)
        else:
            reached = kernels.fill_weighted(*place, self._corner_cutting, stop, done)
            affordable = _SHARE_WEIGHTED * reached
        if reached < 0:
            raise Cancelled('the plan to goal ({}, {}) was stopped before it was complete'.format(*self.cell(goal)))
        self._is_stale = False
        # Of the last path the goal remains.
        self._path, self._changed_from = (np.array([self.cell(goal)]), np.zeros(1), 0), np.inf
        self._keyed_for, self._keyed_least, self._offset = goal, self._least, 0.0
        self._cap = max(_FEWEST_EXPANSIONS, int(affordable)) if self._max_expansions is None else self._max_expansions
        self.reached = reached
        self.expanded += reached

    def settle(self, start: int, stop: NDArray[np.uint8] | None) -> bool:
        """Make the field right on every best path from a cell, and return whether that took a full plan.

        Cancelled is raised if stopped, and the next call goes on from there.
        """
        is_anew = self._is_stale or not self._repair(start, stop)
        if is_anew:
            self.plan(self._goal, stop)
        return is_anew

    def is_reached(self, start: int) -> bool:
        """Return whether the goal can be reached from a cell for which the field was settled."""
        return self._rhs[start] < np.inf

    def next_cell(self, start: int) -> int:
        """Return the next cell of the best path from a cell for which the field was settled; it reaches the goal."""
        from mobile_planning.grid import descent_kernels as kernels

        return kernels.next_cell(self._costs, self._g, start, kernels.steps_of(self._width), self._least,
                                 self._corner_cutting)

    def path(self, start: int, stop: NDArray[np.uint8] | None) -> tuple[NDArray[np.int64], float]:
        """Return the best path from a cell for which the field was settled, and its cost; it reaches the goal.

        What still stands of the last path is taken from there. The path is an array of cells (N, 2); Cancelled is
        raised if stopped.
        """
        from mobile_planning.grid import descent_kernels as kernels

        stop = np.zeros(1, np.uint8) if stop is None else stop
        self._path = kernels.descend(*self._path, self._changed_from, self._costs, self._g, self._width, start,
                                     self._least, self._corner_cutting, stop)
        self._changed_from = np.inf
        path, costs, first = self._path
        return checked_path(path[first:], self.cell(start), stop), costs[first]

    def _repair(self, start, stop):
        """Make the field right for a start; return False if it must be planned anew."""
        from mobile_planning.grid import dstar_kernels as kernels

        if self.is_right_everywhere():
            return True
        stop = np.zeros(1, np.uint8) if stop is None else stop
        fields = (self._g, self._rhs)
        if self._keyed_for != start:
            # Instead of every key in the queue the ones to come are moved.
            self._offset += kernels.least_cost(self._keyed_for, start, self._width, self._keyed_least)
            self._keyed_for = start
        if self._least < self._keyed_least or self._queue[2] > self._queue_limit:
            count = kernels.order_anew(*self._queue, *fields, self._width, start, self._least, stop)
            self._queue = (*self._queue[:2], count)
            self._check_whole(count)
            self._queue_limit = max(_QUEUE_SIZE, 2 * count)
            self._keyed_least, self._offset = self._least, 0.0
            # It also decides which ways count as equal.
            self._changed_from = 0.0
        place = (self._width, start, self._least, self._offset, self._corner_cutting)
        # Taking in a changed cell lasts about as long as expanding one.
        cap = self._cap - sum(map(len, self._changed))
        if self._changed:
            changed = self._changed[0] if len(self._changed) == 1 else np.concatenate(self._changed)
            *self._queue, lowest = kernels.enqueue_changes(
                *self._queue, *fields, self._costs, changed, self._goal, *place, stop)
            self._check_whole(self._queue[2])
            self._changed, self._changed_from = [], min(self._changed_from, lowest)
        *self._queue, lowest, outcome, expansions = kernels.repair(
            *self._queue, *fields, self._costs, *place, cap, stop)
        self._changed_from = min(self._changed_from, lowest)
        self.expanded += expansions
        if outcome == kernels.STOPPED:
            raise Cancelled('the repair of a plan was stopped before it was complete')
        return outcome == kernels.SETTLED

    def _check_whole(self, count):
        """Raise Cancelled if the work on the queue was stopped in its middle; only a new plan helps then."""
        if count < 0:
            self._is_stale = True
            raise Cancelled('the repair of a plan was stopped before it was complete')

    def _empty_queue(self):
        """Forget changes and cells that wait for repair."""
        self._changed = []
        self._queue = (np.empty(0), np.empty(0, np.uint32), 0)
        self._queue_limit = _QUEUE_SIZE

    def _inner(self, flat):
        """Return the part (h, w) of a bordered array that is the grid, read-only."""
        view = flat.reshape(-1, self._width)[1:-1, 1:-1]
        view.flags.writeable = False
        return view


def bordered(cells: NDArray, value: float, stop: NDArray[np.uint8] | None = None) -> NDArray:
    """Return a copy (h + 2, w + 2) of an array with a border of one value; raise Cancelled if stopped."""
    height, width = cells.shape
    result = np.empty((height + 2, width + 2), cells.dtype)
    result[0] = result[-1] = value
    for rows in row_blocks(cells.shape, stop):
        part = result[1:-1][rows]
        part[:, 0] = part[:, -1] = value
        part[:, 1:-1] = cells[rows]
    return result


def checked_path(path: NDArray[np.int64], start: tuple[int, int], stop: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Return a copy of what `descent_kernels.descend` found, if it begins at the start; raise Cancelled if stopped."""
    if tuple(path[0].tolist()) != start:
        if stop[0]:
            raise Cancelled('the way down to the goal was stopped before it was complete')
        raise LimitExceeded('the way down to the goal is lost in rounding: costs differ by a factor of more than 1e15')
    copy = np.empty_like(path)
    for rows in row_blocks(path.shape, stop):
        copy[rows] = path[rows]
    return copy


@lru_cache(maxsize=None)
def canonical_moves_of(corner_cutting: bool) -> NDArray[np.uint8]:
    """Return the table of moves on eight neighbours, made once for each rule."""
    from mobile_planning.world.cost_to_go_kernels import canonical_moves

    return canonical_moves(True, corner_cutting)
