"""Inner loops of the way down a field of costs, of which the part that no change concerns is kept.

Arrays and indices are those of `dstar_kernels`. None of the functions holds the GIL.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, u1, u8

from mobile_planning.grid.dstar_kernels import COSTS, edge, steps_of
from mobile_planning.world.cost_to_go_kernels import SQRT2


@njit(u8(COSTS, f8[::1], u8, u8[::1], f8, b1), nogil=True, cache=True)
def next_cell(costs, g, cell, steps, least, corner_cutting):
    """Return the next cell of a best path, or the cell itself where no neighbour's value is lower.

    Of ways that are equal but for rounding the first in the list of moves is taken.
    """
    best, lowest = cell, np.inf
    for move in range(np.uint64(8)):
        neighbour = cell + steps[move]
        if not g[neighbour] < g[cell]:
            continue
        value = g[neighbour] + edge(costs, cell, move, steps, corner_cutting)
        if value <= g[cell] + 1e-7 * least:
            return neighbour
        if value < lowest:
            best, lowest = neighbour, value
    return best


@njit(f8(COSTS, u8, u8, i8), nogil=True, cache=True)
def step_cost(costs, cell, other, width):
    """Return the cost of the step between two neighbouring cells."""
    apart = abs(np.int64(cell) - np.int64(other))
    length = 1.0 if apart == 1 or apart == width else SQRT2
    return 0.5 * length * (costs[cell] + costs[other])


@njit(u8(i8[:, ::1], i8, i8), nogil=True, cache=True)
def index_at(path, i, width):
    """Return the index of the cell (x, y) in a row of a path."""
    return np.uint64((path[i, 1] + 1) * width + path[i, 0] + 1)


@njit(types.Tuple((i8[:, ::1], f8[::1], i8))(
    i8[:, ::1], f8[::1], i8, f8, COSTS, f8[::1], i8, i8, f8, b1, u1[::1]), nogil=True, cache=True)
def descend(path, sums, first, changed_from, costs, g, width, start, least, corner_cutting, stop):
    """Make the last best path one from another start and at other values, and return it.

    A path lies at the end of its array, from row ``first`` to the goal in the last row, and ``sums`` has the cost from
    each of its cells. Values that changed since it was made were and are at least ``changed_from``, and so were those
    of cells beside a changed cost. A cell with a lower value goes on as before, because only a neighbour with a still
    lower one can be next: once the new path meets such a cell of the old one, the rest is the same.

    If stopped, or if no neighbour is lower, the path begins at another cell than ``start``.
    """
    steps, last = steps_of(width), len(path) - 1
    # Values sink along a path: search for the first one that is low enough.
    kept, high = first, last
    while kept < high:
        middle = (kept + high) // 2
        if g[index_at(path, middle, width)] < changed_from:
            high = middle
        else:
            kept = middle + 1
    ahead, count, cell = np.empty(1024, np.uint64), 0, np.uint64(start)
    while True:
        while g[index_at(path, kept, width)] > g[cell]:
            kept += 1
        if index_at(path, kept, width) == cell:
            break
        if count == ahead.size:
            longer = np.empty(2 * count, np.uint64)
            longer[:count] = ahead
            ahead = longer
        ahead[count] = cell
        count += 1
        following = next_cell(costs, g, cell, steps, least, corner_cutting)
        if following == cell or (count & 1023 == 0 and stop[0]):
            return path, sums, kept
        cell = following
    if count > kept:
        tail = len(path) - kept
        longer, longer_sums = np.empty((2 * (count + tail), 2), np.int64), np.empty(2 * (count + tail))
        longer[-tail:], longer_sums[-tail:] = path[kept:], sums[kept:]
        path, sums, kept = longer, longer_sums, len(longer) - tail
    for i in range(count - 1, -1, -1):
        if i & 1023 == 0 and stop[0]:
            break
        kept -= 1
        sums[kept] = sums[kept + 1] + step_cost(costs, ahead[i], cell, width)
        cell = ahead[i]
        path[kept, 0], path[kept, 1] = np.int64(cell) % width - 1, np.int64(cell) // width - 1
    return path, sums, kept
