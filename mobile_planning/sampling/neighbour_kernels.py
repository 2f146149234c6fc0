"""Inner loops of the neighbour searches: pairs of points within a radius of each other.

A pair of the points i < j is the key ``j << 32 | i``, so that sorted keys are pairs in the order in which a roadmap
grows. None of the functions holds the GIL.
"""
import numpy as np
from numba import b1, f8, i8, njit, types

POINTS = types.Array(f8, 2, 'C', readonly=True)
INDICES = types.Array(i8, 1, 'C', readonly=True)
CELLS = types.Array(i8, 2, 'C', readonly=True)


@njit(b1(POINTS, i8, i8, f8), nogil=True, cache=True)
def is_near(points, i, j, squared_radius):
    """Return whether two points are within the radius of each other."""
    total = 0.0
    for axis in range(points.shape[1]):
        difference = points[i, axis] - points[j, axis]
        total += difference * difference
    return total <= squared_radius


@njit(i8[::1](i8[::1], i8), nogil=True, cache=True)
def with_room(keys, count):
    """Return the keys, grown if there is no room behind the first ``count``."""
    if count < keys.size:
        return keys
    grown = np.empty(2 * count, np.int64)
    grown[:count] = keys[:count]
    return grown


@njit(i8[::1](POINTS, f8, i8), nogil=True, cache=True)
def compared_pairs(points, radius, first):
    """Return the pairs of which the later point is ``first`` or comes after it, by comparing all with all."""
    keys, count, squared = np.empty(1024, np.int64), 0, radius * radius
    for j in range(first, len(points)):
        for i in range(j):
            if is_near(points, i, j, squared):
                keys = with_room(keys, count)
                keys[count] = j << 32 | i
                count += 1
    return keys[:count].copy()


@njit(i8[::1](POINTS, f8, i8, CELLS, CELLS, INDICES, INDICES, INDICES), nogil=True, cache=True)
def indexed_pairs(points, radius, first, cells, offsets, sizes, begins, members):
    """Return the same pairs as `compared_pairs`, by looking only into the cells around a point's own.

    Parameters
    ----------
    cells : (n, d) of int64
        Of each point.
    offsets : (k, d) of int64
        To the cells that are looked into.
    sizes : (d,) of int64
        Cells along each axis.
    begins, members : of int64
        ``members[begins[c]:begins[c + 1]]`` are the points in the cell of flat index c.
    """
    keys, count, squared = np.empty(1024, np.int64), 0, radius * radius
    for j in members:
        if j < first:
            continue
        for offset in range(len(offsets)):
            flat = np.int64(0)
            for axis in range(len(sizes)):
                place = cells[j, axis] + offsets[offset, axis]
                if place < 0 or place >= sizes[axis]:
                    flat = np.int64(-1)
                    break
                flat = flat * sizes[axis] + place
            if flat < 0:
                continue
            for slot in range(begins[flat], begins[flat + 1]):
                i = members[slot]
                if i < j and is_near(points, i, j, squared):
                    keys = with_room(keys, count)
                    keys[count] = j << 32 | i
                    count += 1
    return keys[:count].copy()
