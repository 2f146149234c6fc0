"""A binary heap of cells, the one of the least key first, in two arrays of which the first ``count`` entries are used.

None of the functions holds the GIL.
"""
import numpy as np
from numba import f8, i8, njit, types, u4, u8


@njit(i8(f8[::1], u4[::1], i8, f8, u8), nogil=True, cache=True)
def push(keys, cells, count, key, cell):
    """Put a cell into the heap and return the new count; there must be room."""
    place = count
    while place > 0:
        parent = np.uint64(place - 1) >> np.uint64(1)
        if keys[parent] <= key:
            break
        keys[np.uint64(place)], cells[np.uint64(place)] = keys[parent], cells[parent]
        place = np.int64(parent)
    keys[np.uint64(place)], cells[np.uint64(place)] = key, cell
    return count + 1


@njit(i8(f8[::1], u4[::1], i8), nogil=True, cache=True)
def drop_first(keys, cells, count):
    """Remove the first entry of the heap and return the new count."""
    last, one = np.uint64(count - 1), np.uint64(1)
    key, cell = keys[last], cells[last]
    place = np.uint64(0)
    while True:
        child = place + place + one
        if child >= last:
            break
        if child + one < last and keys[child + one] < keys[child]:
            child += one
        if keys[child] >= key:
            break
        keys[place], cells[place] = keys[child], cells[child]
        place = child
    keys[place], cells[place] = key, cell
    return count - 1


@njit(types.Tuple((f8[::1], u4[::1]))(f8[::1], u4[::1], i8, i8), nogil=True, cache=True)
def with_room(keys, cells, count, more):
    """Return the heap, grown if it has no room for ``more`` entries behind its ``count``."""
    if count + more <= keys.size:
        return keys, cells
    grown_keys, grown_cells = np.empty(2 * (count + more)), np.empty(2 * (count + more), np.uint32)
    grown_keys[:count], grown_cells[:count] = keys[:count], cells[:count]
    return grown_keys, grown_cells
