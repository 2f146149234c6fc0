"""Inner loops of roundabouts: where the most robots meet, if all drive straight on, and the way round.

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


@njit(i8(f8[:, ::1], NUMBERS, NUMBERS, f8, f8), nogil=True, cache=True)
def go_round(points, goal, centre, radius, stride):
    """Fill in way-points (W, 2) from the first round a circle, at ``stride``; return how many, 0 if none is needed."""
    # A goal inside the circle is entered from outside a smaller one.
    radius = min(radius, 0.8 * np.hypot(goal[0] - centre[0], goal[1] - centre[1]))
    x, y = points[0]
    for k in range(1, len(points)):
        ahead_x, ahead_y, in_x, in_y = goal[0] - x, goal[1] - y, centre[0] - x, centre[1] - y
        left, distance = np.hypot(ahead_x, ahead_y), np.hypot(in_x, in_y)
        along = (in_x * ahead_x + in_y * ahead_y) / left**2 if left > 1e-9 else 0.0
        part = min(along, 1.0)
        if along <= 0.0 or np.hypot(part * ahead_x - in_x, part * ahead_y - in_y) >= radius - 1e-3:
            points[k] = goal
            return 0 if k == 1 else k + 1
        if distance > 1.001 * radius:
            turn = -np.arcsin(radius / distance)
        else:
            turn = -np.pi / 2 - min(0.6, 1.5 * (radius - distance) / radius)
        if distance > 1e-9:
            in_x, in_y = in_x / distance, in_y / distance
        else:
            in_x, in_y = ahead_x / left, ahead_y / left
        cos, sin, leg = np.cos(turn), np.sin(turn), min(stride, left)
        x, y = x + leg * (cos * in_x - sin * in_y), y + leg * (sin * in_x + cos * in_y)
        points[k, 0], points[k, 1] = x, y
    return len(points)
