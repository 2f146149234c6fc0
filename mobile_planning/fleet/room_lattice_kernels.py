"""Inner loop of roadmaps: which of some places is the nearest to each node of a lattice, and the way from there.

The function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported. It
does not hold the GIL.
"""
import numpy as np
from numba import i4, i8, njit, types, u1, void

STEPS, NODES = types.Array(u1, 3, 'C', readonly=True), types.Array(i8, 1, 'C', readonly=True)
#: More than a step costs.
_BUCKETS = 64


@njit(void(STEPS, NODES, i4[:, ::1], i4[:, ::1], i8[:, ::1]), nogil=True, cache=True)
def spread(steps, sources, owners, costs, before):
    """Fill in for each node (h, w) the nearest of ``sources``, its cost from there and the node before it on the way.

    By buckets of equal cost (Dial, Algorithm 360, 1969). Nodes are numbered row by row.

    Parameters
    ----------
    steps : (8, h, w) ndarray of uint8
        What a step costs from each node to the right, down, down right, down left, and from where it would come by
        those; 0 where there is no way, else less than 64.
    sources : (n,) ndarray of int
    owners, costs, before : (h, w) ndarray of int
        Index of the nearest source, -1 where none is in reach.
    """
    height, width = owners.shape
    owners[:], before[:], costs[:] = -1, -1, 2**31 - 1
    # Each step is taken once, from the node that it leaves.
    most = 8 * owners.size + len(sources)
    entries, after = np.empty(most, np.int64), np.empty(most, np.int64)
    heads = np.full(_BUCKETS, -1, np.int64)
    count, pending, now = 0, 0, 0
    for index in range(len(sources)):
        row, column = sources[index] // width, sources[index] % width
        owners[row, column], costs[row, column] = index, 0
        entries[count], after[count], heads[0] = sources[index], heads[0], count
        count += 1
        pending += 1
    while pending:
        entry = heads[now % _BUCKETS]
        if entry < 0:
            now += 1
            continue
        heads[now % _BUCKETS] = after[entry]
        pending -= 1
        row, column = entries[entry] // width, entries[entry] % width
        if costs[row, column] != now:
            continue
        for move in range(8):
            cost = steps[move, row, column]
            if cost == 0:
                continue
            sign = 1 if move < 4 else -1
            other_row = row + sign * (move % 4 > 0)
            other = column + sign * (1 if move % 2 == 0 else 0 if move % 4 == 1 else -1)
            if now + cost < costs[other_row, other]:
                costs[other_row, other], owners[other_row, other] = now + cost, owners[row, column]
                before[other_row, other] = row * width + column
                bucket = (now + cost) % _BUCKETS
                entries[count], after[count], heads[bucket] = other_row * width + other, heads[bucket], count
                count += 1
                pending += 1
