"""The cost-to-go field of a grid: how far each free cell is from a goal, and the paths that it gives.

Cells are (x, y) = (column, row), arrays are indexed [y, x], lengths are in cells: a
straight step is 1 long, a diagonal one the square root of 2.

The first call compiles the kernels, or reads them from numba's cache; `warm_up` does both ahead of time.
"""
from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import (
    Cancelled, GoalOccupied, GoalOutside, InvalidInput, LimitExceeded, NoPath, StartOccupied, StartOutside)

METRICS = ('euclidean', 'manhattan')
# A path has fewer steps than the map has cells, and a cell's state holds its number of steps in 27 bits.
MAX_CELLS = 1 << 27


def cost_to_go(
    occupied: ArrayLike,
    goal: ArrayLike,
    *,
    metric: str = 'euclidean',
    corner_cutting: bool = True,
    stop: NDArray[np.uint8] | None = None,
    done: NDArray[np.int64] | None = None,
) -> NDArray[np.float64]:
    """Return the length of the shortest path from every cell to the goal.

    Parameters
    ----------
    occupied : (h, w) array_like of bool
        Nonzero where a robot must not enter.
    goal : (2,) array_like of int
        Cell (x, y).
    metric : {'euclidean', 'manhattan'}
        Steps to eight neighbours of length 1 and sqrt(2), or to four of length 1.
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell at its side; if not, both cells beside it must be free.
    stop : (1,) ndarray of uint8, optional
        Set ``stop[0]`` from another thread to end the search.
    done : (2,) ndarray of int64, optional
        Read it from another thread: the search has passed about ``done[0]`` of ``done[1]`` free cells.

    Returns
    -------
    (h, w) ndarray [cells]
        0 at the goal, NaN on occupied cells, inf where no path leads. Exact: each value is ``s + d * sqrt(2)`` for
        the numbers of steps of an optimal path, whatever its order.

    Raises
    ------
    GoalOutside, GoalOccupied
        If the goal is no free cell of the grid.
    InvalidInput
        If the grid is not two-dimensional, the goal not two integers, or the metric unknown.
    LimitExceeded
        If the grid has more than 2**27 cells.
    Cancelled
        If ``stop`` was set.

    Examples
    --------
    >>> cost_to_go([[0, 0, 0], [0, 1, 0]], (0, 0), corner_cutting=False)
    array([[ 0.,  1.,  2.],
           [ 1., nan,  3.]])
    """
    from mobile_planning.world import cost_to_go_kernels as kernels

    grid = as_mask(occupied)
    if metric not in METRICS:
        raise InvalidInput(f'metric {metric!r} is not one of {", ".join(METRICS)}')
    x, y = as_cell(goal, 'goal')
    _check_inside(grid.shape, x, y, 'goal', GoalOutside)
    if grid[y, x]:
        raise GoalOccupied(f'goal ({x}, {y}) is occupied')
    field = np.empty(grid.shape)
    moves = _moves(metric == 'euclidean', bool(corner_cutting))
    stop = np.zeros(1, np.uint8) if stop is None else stop
    done = np.zeros(2, np.int64) if done is None else done
    done[:] = 0, grid.size - np.count_nonzero(grid.view(bool))
    if not kernels.fill_cost_to_go(field, grid, x, y, moves, stop, done):
        raise Cancelled(f'the cost-to-go field to cell ({x}, {y}) was stopped before it was complete')
    return field


def descend(
    field: ArrayLike,
    start: ArrayLike,
    goal: ArrayLike,
    *,
    corner_cutting: bool = True,
    connectivity: int = 8,
    steps: int | None = None,
) -> NDArray[np.int64]:
    """Return the path that goes down a cost-to-go field from start to goal.

    Each step goes to the neighbour of least field value plus length of the step, so that the path of a field with the
    same moves is as long as the field says. Of equal ways the straight one is taken, then the first counted from +x
    by way of +y.

    Parameters
    ----------
    field : (h, w) array_like [cells]
        As `cost_to_go` returns it.
    start, goal : (2,) array_like of int
        Cells (x, y); the goal is the one the field was made for.
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell at its side.
    connectivity : {4, 8}
        How many neighbours a cell has.
    steps : int, optional
        Return only so many steps of the path.

    Returns
    -------
    (N, 2) ndarray of int64
        Cells (x, y) from start to goal, both included.

    Raises
    ------
    StartOutside, StartOccupied, GoalOutside
        If an end is no free cell of the grid.
    NoPath
        If the goal cannot be reached, or not with these moves.
    InvalidInput
        If the field is not 0 at the goal.

    Examples
    --------
    >>> field = cost_to_go([[0, 0, 0], [0, 1, 0]], (0, 0), corner_cutting=False)
    >>> descend(field, (2, 1), (0, 0), corner_cutting=False).tolist()
    [[2, 1], [2, 0], [1, 0], [0, 0]]
    """
    from mobile_planning.world import cost_to_go_kernels as kernels

    field = np.ascontiguousarray(field, dtype=np.float64)
    if connectivity not in (4, 8):
        raise InvalidInput(f'connectivity {connectivity!r} is not 4 or 8')
    if field.ndim != 2:
        raise InvalidInput(f'a field of shape {field.shape} is not two-dimensional')
    (x, y), (goal_x, goal_y) = as_cell(start, 'start'), as_cell(goal, 'goal')
    _check_inside(field.shape, x, y, 'start', StartOutside)
    _check_inside(field.shape, goal_x, goal_y, 'goal', GoalOutside)
    if np.isnan(field[y, x]):
        raise StartOccupied(f'start ({x}, {y}) is occupied')
    if field[goal_y, goal_x] != 0.0:
        raise InvalidInput(f'the field is {field[goal_y, goal_x]} at goal ({goal_x}, {goal_y}): it leads elsewhere')
    path = np.empty((0, 2), np.int64)
    if np.isfinite(field[y, x]):
        most_steps = MAX_CELLS if steps is None else steps
        path = kernels.descend_field(field, x, y, connectivity, bool(corner_cutting), most_steps)
    if len(path) == 0:
        raise NoPath(f'no path leads from start ({x}, {y}) to goal ({goal_x}, {goal_y})')
    return path


def line_of_sight(occupied: ArrayLike, a: ArrayLike, b: ArrayLike) -> bool:
    """Return whether the segment between two cell centres touches no occupied cell.

    A corner counts as touched, and so does all that lies outside the grid.

    Parameters
    ----------
    occupied : (h, w) array_like of bool
    a, b : (2,) array_like of int
        Cells (x, y).

    Examples
    --------
    >>> line_of_sight([[0, 0], [0, 0]], (0, 0), (1, 1)), line_of_sight([[0, 0], [1, 0]], (0, 0), (1, 1))
    (True, False)
    """
    from mobile_planning.world import cost_to_go_kernels as kernels

    grid = as_mask(occupied)
    ends = as_cell(a, 'end') + as_cell(b, 'end')
    if not all(0 <= x < grid.shape[1] and 0 <= y < grid.shape[0] for x, y in (ends[:2], ends[2:])):
        return False
    return bool(kernels.is_visible(grid, *ends))


def shortcut(occupied: ArrayLike, path: ArrayLike) -> NDArray[np.int64]:
    """Return the way-points that remain of a path when a string is pulled along it.

    From each way-point the path is followed as long as it stays in sight; the last point seen is the next way-point.
    A segment between way-points touches no occupied cell, except for diagonal steps that cut a corner in ``path``.

    Parameters
    ----------
    occupied : (h, w) array_like of bool
    path : (N, 2) array_like of int
        Cells (x, y), each a neighbour of the one before.

    Returns
    -------
    (K, 2) ndarray of int64
        The first and the last cell of the path and some between, in order.

    Examples
    --------
    >>> shortcut([[0, 0, 0], [0, 1, 0]], [[2, 1], [2, 0], [1, 0], [0, 0]]).tolist()
    [[2, 1], [2, 0], [0, 0]]
    """
    from mobile_planning.world import cost_to_go_kernels as kernels

    cells = np.ascontiguousarray(path, dtype=np.int64).reshape(-1, 2)
    return kernels.pull_string(as_mask(occupied), cells)


def warm_up() -> None:
    """Compile every kernel, fill numba's cache and run each once."""
    for metric in METRICS:
        for corner_cutting in (True, False):
            occupied = np.zeros((4, 4), bool)
            field = cost_to_go(occupied, (3, 3), metric=metric, corner_cutting=corner_cutting)
            path = descend(field, (0, 0), (3, 3), corner_cutting=corner_cutting)
            shortcut(occupied, path)
    line_of_sight(occupied, (0, 0), (3, 3))


def as_mask(occupied: ArrayLike) -> NDArray[np.uint8]:
    """Return the occupied cells as a contiguous (h, w) array of 0 and 1, copied only if it must be."""
    cells = np.asarray(occupied)
    if cells.ndim != 2 or cells.size == 0:
        raise InvalidInput(f'a grid of shape {cells.shape} is not two-dimensional with at least one cell')
    if cells.size > MAX_CELLS:
        raise LimitExceeded(f'a grid of {cells.size} cells is above the limit of {MAX_CELLS}')
    if cells.dtype != bool:
        cells = cells != 0
    return np.ascontiguousarray(cells).view(np.uint8)


def as_cell(point: ArrayLike, name: str) -> tuple[int, int]:
    """Return the cell (x, y) as two Python integers, or raise InvalidInput with its name."""
    try:
        values = np.asarray(point, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{name} {point!r} is not a cell (x, y)') from None
    if values.shape != (2,) or not np.isfinite(values).all() or (values != np.rint(values)).any():
        raise InvalidInput(f'{name} {values.tolist()} is not a cell: two integers (x, y)')
    x, y = values.tolist()
    return int(x), int(y)


def _check_inside(shape, x, y, name, error):
    """Raise the error unless (x, y) is a cell of the grid."""
    height, width = shape
    if not (0 <= x < width and 0 <= y < height):
        raise error(f'{name} ({x}, {y}) is outside the grid of {width} x {height} cells')


@lru_cache(maxsize=None)
def _moves(diagonals, corner_cutting):
    """Return the table of canonical moves, made once for each rule."""
    from mobile_planning.world.cost_to_go_kernels import canonical_moves

    return canonical_moves(diagonals, corner_cutting)
