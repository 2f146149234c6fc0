"""Inner loop of the order of moves: when each robot has made its moves, if all drive at full speed.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
"""
import numpy as np
from numba import b1, f8, i8, njit, types

from mobile_planning.fleet.distance_kernels import POINTS, squared_to_segment

TABLE = types.Array(i8, 2, 'C', readonly=True)
NUMBERS = types.Array(f8, 1, 'C', readonly=True)


@njit(b1(f8[::1], f8[::1], f8), nogil=True, cache=True)
def meet(p, q, need):
    """Return whether two segments (ax, ay, bx, by) come nearer than ``need``."""
    if (min(p[0], p[2]) - max(q[0], q[2]) >= need or min(q[0], q[2]) - max(p[0], p[2]) >= need
            or min(p[1], p[3]) - max(q[1], q[3]) >= need or min(q[1], q[3]) - max(p[1], p[3]) >= need):
        return False
    least = min(squared_to_segment(p[0], p[1], q[0], q[1], q[2], q[3]),
                squared_to_segment(p[2], p[3], q[0], q[1], q[2], q[3]),
                squared_to_segment(q[0], q[1], p[0], p[1], p[2], p[3]),
                squared_to_segment(q[2], q[3], p[0], p[1], p[2], p[3]))
    if least < need * need:
        return True
    px, py, qx, qy = p[2] - p[0], p[3] - p[1], q[2] - q[0], q[3] - q[1]
    side_a = px * (q[1] - p[1]) - py * (q[0] - p[0])
    side_b = px * (q[3] - p[1]) - py * (q[2] - p[0])
    side_c = qx * (p[1] - q[1]) - qy * (p[0] - q[0])
    side_d = qx * (p[3] - q[1]) - qy * (p[2] - q[0])
    return side_a * side_b < 0.0 and side_c * side_d < 0.0


@njit(f8(f8[:, :, ::1], f8[:, ::1], i8[::1], i8, f8, NUMBERS, f8), nogil=True, cache=True)
def free_from(pieces, over, known, i, time, radii, gap):
    """Return when robot ``i`` can begin its newest piece, from ``time`` on, for all that others have ``known``."""
    own = pieces[i, known[i]]
    for j in range(len(radii)):
        if j == i:
            continue
        need = radii[i] + radii[j] + gap
        # What is over by now need not be looked at.
        for q in range(known[j] - 1, -1, -1):
            if over[j, q] <= time:
                break
            if meet(own, pieces[j, q], need):
                time = over[j, q]
                break
    return time


@njit(f8[::1](POINTS, TABLE, TABLE, TABLE, NUMBERS, NUMBERS, f8, f8), nogil=True, cache=True)
def finish_times(points, places, edges, ranks, radii, leads, gap, piece):
    """Return when each robot (N,) has made its last move, in units of the time that 1 m takes.

    The moves of each step come in the order of their ``ranks`` (T, N). A robot begins a piece of its move when those
    pieces of earlier moves are over that it would meet, and its first when it has driven its own of ``leads`` (N,).
    """
    steps, count = edges.shape
    numbers, most = np.zeros((steps, count), np.int64), np.zeros(count, np.int64)
    for t in range(steps):
        for i in range(count):
            if edges[t, i] >= 0:
                a, b = points[places[t, i]], points[places[t + 1, i]]
                numbers[t, i] = max(1, int(np.ceil(np.hypot(b[0] - a[0], b[1] - a[1]) / piece - 1e-9)))
                most[i] += numbers[t, i]
    total = most.max()
    over, pieces, known = np.empty((count, total)), np.empty((count, total, 4)), np.zeros(count, np.int64)
    clock = leads.copy()
    for t in range(steps):
        for rank in range(ranks[t].max() + 1):
            for i in range(count):
                if ranks[t, i] != rank or edges[t, i] < 0:
                    continue
                a, b = points[places[t, i]], points[places[t + 1, i]]
                dx, dy = (b[0] - a[0]) / numbers[t, i], (b[1] - a[1]) / numbers[t, i]
                for part in range(numbers[t, i]):
                    own = pieces[i, known[i]]
                    own[0], own[1] = a[0] + part * dx, a[1] + part * dy
                    own[2], own[3] = own[0] + dx, own[1] + dy
                    clock[i] = free_from(pieces, over, known, i, clock[i], radii, gap) + np.hypot(dx, dy)
                    over[i, known[i]] = clock[i]
                    known[i] += 1
    return clock
