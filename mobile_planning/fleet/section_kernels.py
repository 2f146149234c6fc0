"""Inner loops of a section: the rows of its quadratic program, and the ratio test.

The variables of the program are the free control points, x and y of the first, then of the next. The first three points
are given; all points after the last free one equal it.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, void

# Arrays that are only read may be read-only.
MATRIX = types.Array(f8, 2, 'C', readonly=True)
VECTOR = types.Array(f8, 1, 'C', readonly=True)
CURVES = types.Array(f8, 3, 'C', readonly=True)
INDICES = types.Array(i8, 1, 'C', readonly=True)
ROWS, BOUNDS = f8[:, ::1], f8[::1]
#: Six times the weights of four control points at each Bezier point of their span.
TO_BEZIER = ((1, 4, 1, 0), (0, 4, 2, 0), (0, 2, 4, 0), (0, 1, 4, 1))


@njit(f8(MATRIX, i8, ROWS), nogil=True, cache=True)
def value(points, first, weights):
    """Return the sum of ``weights[i] . points[first + i]`` (4, 2)."""
    total = 0.0
    for i in range(min(4, len(points) - first)):
        total += weights[i, 0] * points[first + i, 0] + weights[i, 1] * points[first + i, 1]
    return total


@njit(void(MATRIX, i8, ROWS, f8, ROWS, BOUNDS, i8), nogil=True, cache=True)
def write_row(old, first, weights, least, rows, bounds, row):
    """Write the row that keeps the sum of ``weights[i]`` (4, 2) times the point ``first + i`` at or above ``least``."""
    last = rows.shape[1] // 2 - 1
    rows[row] = 0.0
    for i in range(4):
        point = first + i
        if point < 3:
            least -= weights[i, 0] * old[point, 0] + weights[i, 1] * old[point, 1]
            continue
        column = 2 * min(point - 3, last)
        rows[row, column] += weights[i, 0]
        rows[row, column + 1] += weights[i, 1]
    bounds[row] = least


@njit(i8(MATRIX, INDICES, MATRIX, MATRIX, f8, ROWS, BOUNDS, i8), nogil=True, cache=True)
def write_fences(old, spans, normals, fences, margin, rows, bounds, row):
    """Write the rows of fences from ``row`` on, and return the row after; ``old`` keeps what margin it has."""
    weights = np.empty((4, 2))
    for q in range(len(spans)):
        for k in range(4):
            if spans[q] == 0 and k < 3:
                continue  # of given points
            for i in range(4):
                weights[i, 0] = TO_BEZIER[k][i] / 6 * normals[q, 0]
                weights[i, 1] = TO_BEZIER[k][i] / 6 * normals[q, 1]
            room = value(old, spans[q], weights) - fences[q, k]
            write_row(old, spans[q], weights, fences[q, k] + min(max(room, 0.0), margin), rows, bounds, row)
            row += 1
    return row


@njit(i8(MATRIX, VECTOR, i8, i8, MATRIX, f8, ROWS, BOUNDS, i8), nogil=True, cache=True)
def write_limits(old, stencil, first, end, normals, most, rows, bounds, row):
    """Write the rows that keep a derivative within a polygon, from ``row`` on, and return the row after.

    The derivative at point j is the sum of ``stencil[i]`` (4,) times the point ``j + i``, for j from ``first`` on. It
    reaches no further than ``most`` along each of the normals, or where ``old`` is further, as far.
    """
    weights = np.empty((4, 2))
    for point in range(first, end):
        for side in range(len(normals)):
            for i in range(4):
                weights[i, 0], weights[i, 1] = -stencil[i] * normals[side, 0], -stencil[i] * normals[side, 1]
            write_row(old, point, weights, min(-most, value(old, point, weights)), rows, bounds, row)
            row += 1
    return row


@njit(i8(MATRIX, MATRIX, VECTOR, f8, f8, f8, ROWS, BOUNDS, i8), nogil=True, cache=True)
def write_turns(old, along, direction, step, omega, slow, rows, bounds, row):
    """Write the rows that bound the turn rate at the knots, from ``row`` on, and return the row after.

    They are linear about the directions of the plan ``along``, and where it is slower than ``slow`` about its last
    direction, at first ``direction`` (2,): to both sides, acceleration across is at most ``omega`` times velocity. No
    step goes back either: the end of a plan must not swing. Where ``old`` breaks them it is no further away.
    """
    weights, x, y, knots = np.zeros((4, 2)), direction[0], direction[1], len(old) - 4
    for knot in range(1, knots + 1):
        speed_x = (along[knot + 2, 0] - along[knot, 0]) / (2 * step)
        speed_y = (along[knot + 2, 1] - along[knot, 1]) / (2 * step)
        speed = np.sqrt(speed_x**2 + speed_y**2)
        if speed > slow:
            x, y = speed_x / speed, speed_y / speed
        for side in (1.0, -1.0):
            for i in range(3):
                forward, bend = omega * (i - 1) / (2 * step), side * (1.0, -2.0, 1.0)[i] / step**2
                weights[i, 0], weights[i, 1] = forward * x + bend * y, forward * y - bend * x
            write_row(old, knot, weights, min(value(old, knot, weights), 0.0), rows, bounds, row)
            row += 1
        if knot >= 2:
            weights[:] = 0.0
            weights[0, 0], weights[0, 1], weights[1, 0], weights[1, 1] = -x / step, -y / step, x / step, y / step
            write_row(old, knot, weights, min(value(old, knot, weights), 0.0), rows, bounds, row)
            row += 1
    return row


@njit(f8(MATRIX, MATRIX, i8, f8), nogil=True, cache=True)
def share_in_disc(old, change, order, radius):
    """Return the share, 0 to 1, of ``change`` with which differences of ``old`` of an order stay within ``radius``."""
    least = 1.0
    for i in range(len(old) - order):
        a, b, c, over = 0.0, 0.0, -radius**2, -radius**2
        for axis in range(2):
            given, more = old[i + 1, axis] - old[i, axis], change[i + 1, axis] - change[i, axis]
            if order == 2:
                given = old[i + 2, axis] - old[i + 1, axis] - given
                more = change[i + 2, axis] - change[i + 1, axis] - more
            a, b, c, over = a + more**2, b + given * more, c + given**2, over + (given + more)**2
        # Without a change it is rounding.
        if over > 0.0 and a > 0.0:
            least = min(least, (-b + np.sqrt(b**2 - a * min(c, 0.0))) / a)
    return least


@njit(f8(MATRIX, i8, i8, f8, f8), nogil=True, cache=True)
def along_at(points, span, k, x, y):
    """Return how far the Bezier point k of a span is along (x, y); a span after the end rests there."""
    total, last = 0.0, len(points) - 1
    for i in range(4):
        at = min(span + i, last)
        total += TO_BEZIER[k][i] * (x * points[at, 0] + y * points[at, 1])
    return total / 6


@njit(f8(MATRIX, MATRIX, INDICES, MATRIX, MATRIX, f8), nogil=True, cache=True)
def share_in_fences(old, change, spans, normals, bounds, rounding):
    """Return the share, 0 to 1, of ``change`` with which ``old`` keeps to fences that lie back by ``rounding``."""
    least = 1.0
    for q in range(len(spans)):
        x, y = normals[q, 0], normals[q, 1]
        for k in range(4):
            gain = along_at(change, spans[q], k, x, y)
            if gain < 0.0:
                room = along_at(old, spans[q], k, x, y) - bounds[q, k] + rounding
                if room + gain < 0.0:
                    least = min(least, max(room, 0.0) / -gain)
    return least


@njit(f8(MATRIX, INDICES, MATRIX, MATRIX), nogil=True, cache=True)
def least_room(points, spans, normals, bounds):
    """Return how far a plan is inside its fences at least, infinite without any; NaN if a number is."""
    least = np.inf
    for q in range(len(spans)):
        for k in range(4):
            room = along_at(points, spans[q], k, normals[q, 0], normals[q, 1]) - bounds[q, k]
            if not room >= least:
                least = room
    return least


@njit(b1[::1](MATRIX, INDICES, MATRIX, MATRIX, VECTOR), nogil=True, cache=True)
def are_within(points, spans, normals, bounds, reach):
    """Return of each fence whether the plan has less room to it than the ``reach`` of its span, or none at all."""
    found = np.zeros(len(spans), np.bool_)
    for q in range(len(spans)):
        for k in range(4):
            room = along_at(points, spans[q], k, normals[q, 0], normals[q, 1]) - bounds[q, k]
            if not room >= reach[min(spans[q], len(reach) - 1)]:
                found[q] = True
                break
    return found


@njit(f8(VECTOR, VECTOR), nogil=True, cache=True)
def distance(p, q):
    """Return how far two places are apart along the axis on which that is more."""
    return max(abs(p[0] - q[0]), abs(p[1] - q[1]))


@njit(ROWS(MATRIX, f8), nogil=True, cache=True)
def settled(points, within):
    """Return the plan with all points at its end that are no further from it than ``within`` along an axis.

    A plan whose end is that near to its third point stays there.
    """
    last = len(points) - 1
    end = 2 if distance(points[2], points[last]) <= within else last
    free = last
    while free >= 3 and distance(points[free], points[end]) <= within:
        free -= 1
    result = points.copy()
    for i in range(free + 1, last + 1):
        result[i] = points[end]
    return result
