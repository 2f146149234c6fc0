"""Inner loop of roundabouts: where the most robots meet, if all drive straight on.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL.
"""
import numpy as np
from numba import f8, i8, njit, types

POINTS, NUMBERS = types.Array(f8, 2, 'C', readonly=True), types.Array(f8, 1, 'C', readonly=True)


@njit(i8(f8[:, ::1], i8, i8, f8, i8[::1]), nogil=True, cache=True)
def crowd_at(places, count, i, crowded, nearer):
    """Return the size of the largest crowd around place ``i``: of n robots all are within ``crowded`` times root n."""
    nearer[:count + 1] = 0
    for j in range(count):
        x, y = (places[j, 0] - places[i, 0]) / crowded, (places[j, 1] - places[i, 1]) / crowded
        least = x * x + y * y
        if least < count:
            nearer[int(least) + 1] += 1
    size, total = 0, 0
    for n in range(1, count + 1):
        total += nearer[n]
        if total >= n:
            size = n
    return size


@njit(i8(POINTS, POINTS, NUMBERS, f8, f8, i8, f8[::1]), nogil=True, cache=True)
def largest_crowd(positions, headings, lengths, stride, crowded, least, centre):
    """Return the size of the largest crowd, 0 for none of the ``least`` size, and write its middle to ``centre`` (2,).

    Robots drive ``lengths`` straight along ``headings``, all as fast; they are looked at each ``stride``.
    """
    total = len(positions)
    places, nearer = np.empty((total, 2)), np.empty(total + 1, np.int64)
    largest, moment, longest = 0, 0, lengths.max()
    while moment * stride < longest:
        driven, count = moment * stride, 0
        for j in range(total):
            if lengths[j] >= driven - 0.5 * stride:
                on = min(driven, lengths[j])
                places[count, 0] = positions[j, 0] + on * headings[j, 0]
                places[count, 1] = positions[j, 1] + on * headings[j, 1]
                count += 1
        if count < max(least, largest + 1):
            break
        for i in range(count):
            size = crowd_at(places, count, i, crowded, nearer)
            if size > largest:
                largest = size
                distance = np.empty(count)
                for j in range(count):
                    distance[j] = np.hypot(places[j, 0] - places[i, 0], places[j, 1] - places[i, 1])
                order = np.argsort(distance)
                centre[:] = 0.0
                for j in order[:size]:
                    centre[0] += places[j, 0] / size
                    centre[1] += places[j, 1] / size
        moment += 1
    return largest if largest >= least else 0
