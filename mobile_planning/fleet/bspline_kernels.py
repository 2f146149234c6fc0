"""Inner loops of plans.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
"""
import numpy as np
from numba import b1, f8, i8, njit, types

POINTS = types.Array(f8, 2, 'C', readonly=True)


@njit(b1(POINTS, f8, f8, i8), nogil=True, cache=True)
def keeps_turn_rate(points, step, omega_max, pieces):
    """Return whether ``omega_max |z'|^2 -/+ z' x z''`` has no negative Bernstein coefficient on any piece of any span.

    On a span the velocity has the Bernstein points a, b, c, halfway between, at, and halfway between the steps of the
    control polygon; a piece of it has the points of the two cuts.
    """
    velocity = np.empty((3, 2))
    for span in range(len(points) - 3):
        largest = 0.0
        lowest = np.inf
        for piece in range(pieces):
            u, w = piece / pieces, (piece + 1) / pieces
            for axis in range(2):
                p = (points[span + 1, axis] - points[span, axis]) / step
                q = (points[span + 2, axis] - points[span + 1, axis]) / step
                r = (points[span + 3, axis] - points[span + 2, axis]) / step
                a, b, c = (p + q) / 2, q, (q + r) / 2
                # The polar form of the quadratic at (u, u), (u, w), (w, w).
                velocity[0, axis] = (1 - u) * ((1 - u) * a + u * b) + u * ((1 - u) * b + u * c)
                velocity[1, axis] = (1 - w) * ((1 - u) * a + u * b) + w * ((1 - u) * b + u * c)
                velocity[2, axis] = (1 - w) * ((1 - w) * a + w * b) + w * ((1 - w) * b + w * c)
            rate = 2 * pieces / step
            v0x, v0y, v1x, v1y = velocity[0, 0], velocity[0, 1], velocity[1, 0], velocity[1, 1]
            v2x, v2y = velocity[2, 0], velocity[2, 1]
            a0x, a0y, a1x, a1y = rate * (v1x - v0x), rate * (v1y - v0y), rate * (v2x - v1x), rate * (v2y - v1y)
            # Velocity (degree 2) times acceleration (degree 1), raised to degree 4.
            c0 = v0x * a0y - v0y * a0x
            c1 = (v0x * a1y - v0y * a1x + 2 * (v1x * a0y - v1y * a0x)) / 3
            c2 = (2 * (v1x * a1y - v1y * a1x) + v2x * a0y - v2y * a0x) / 3
            c3 = v2x * a1y - v2y * a1x
            cross = (c0, (c0 + 3 * c1) / 4, (c1 + c2) / 2, (3 * c2 + c3) / 4, c3)
            room = (omega_max * (v0x * v0x + v0y * v0y), omega_max * (v0x * v1x + v0y * v1y),
                    omega_max * (2 * (v1x * v1x + v1y * v1y) + v0x * v2x + v0y * v2y) / 3,
                    omega_max * (v1x * v2x + v1y * v2y), omega_max * (v2x * v2x + v2y * v2y))
            for k in range(5):
                lowest = min(lowest, room[k] - abs(cross[k]))
                largest = max(largest, abs(room[k]) + abs(cross[k]))
        # Rounding of the terms, of which the largest sets the scale.
        if not lowest >= -1e-13 * largest:
            return False
    return True


@njit(f8(f8), nogil=True, cache=True)
def wrapped(angle):
    """Return the angle in (-pi, pi] [rad]."""
    return np.pi - (np.pi - angle) % (2 * np.pi) % (2 * np.pi)


@njit(b1(POINTS, i8, i8), nogil=True, cache=True)
def is_same(points, one, other):
    """Return whether two control points are one place."""
    return points[one, 0] == points[other, 0] and points[one, 1] == points[other, 1]


@njit(f8(POINTS, i8, i8), nogil=True, cache=True)
def direction(points, start, end):
    """Return the direction [rad] from one control point to another."""
    return np.arctan2(points[end, 1] - points[start, 1], points[end, 0] - points[start, 0])


@njit(b1(f8, f8), nogil=True, cache=True)
def is_behind(towards, heading):
    """Return whether a robot with ``heading`` turns less if it sets out ``towards`` backwards; equals go forwards."""
    return abs(wrapped(towards - heading)) > np.pi / 2 + 1e-9


@njit(types.Tuple((f8[:, ::1], b1))(POINTS, f8, f8, b1), nogil=True, cache=True)
def rests(points, heading, final_heading, reverse):
    """Return the runs of spans at rest (R, 5), and whether a plan that starts on the move drives backwards.

    Of each run: its first span, that after its last, the heading at its begin, the turn during it [rad], and whether
    the robot departs from it backwards.
    """
    spans = len(points) - 3
    ahead = 2 if not is_same(points, 0, 2) else 3
    starts_backward = reverse and not is_same(points, 0, ahead) and is_behind(direction(points, 0, ahead), heading)
    runs, count, backward, span = np.empty((spans, 5)), 0, starts_backward, 0
    while span < spans:
        last = span
        while (last < spans and is_same(points, last, last + 1) and is_same(points, last + 1, last + 2)
                and is_same(points, last + 2, last + 3)):
            last += 1
        if last == span:
            span += 1
            continue
        arrival = heading
        if span:
            arrival = direction(points, span - 1, span + 2) + np.pi * backward
        wanted = arrival if np.isnan(final_heading) else final_heading
        if last < spans:
            wanted = direction(points, last, last + 3)
            backward = reverse and is_behind(wanted, arrival)
            wanted += np.pi * backward
        run = runs[count]
        run[0], run[1], run[2], run[3], run[4] = span, last, arrival, wrapped(wanted - arrival), backward
        count, span = count + 1, last
    return runs[:count], starts_backward


@njit(f8[:, ::1](POINTS, f8, i8, f8[::1], f8[:, ::1], b1), nogil=True, cache=True)
def states(points, step, first_knot, times, runs, starts_backward):
    """Return x, y, heading, v and omega (N, 5) at ``times`` [s] of a plan with the ``runs`` of spans at `rests`.

    Where the motion stands still, but not for a whole span, its direction is that from the start to the end of the
    span.
    """
    result, spans = np.empty((len(times), 5)), len(points) - 3
    velocity, acceleration, chord = np.empty(2), np.empty(2), np.empty(2)
    for row in range(len(times)):
        since = min(max(times[row] / step - first_knot, 0.0), float(spans))
        span = min(int(since), spans - 1)
        u = since - span
        w = 1.0 - u
        for axis in range(2):
            p, q, r, s = (points[span, axis], points[span + 1, axis], points[span + 2, axis], points[span + 3, axis])
            a, b, c, d = (p + 4 * q + r) / 6, (2 * q + r) / 3, (q + 2 * r) / 3, (q + 4 * r + s) / 6
            result[row, axis] = w * w * (w * a + 3 * u * b) + u * u * (3 * w * c + u * d)
            velocity[axis] = 3 * (w * w * (b - a) + 2 * u * w * (c - b) + u * u * (d - c)) / step
            acceleration[axis] = 6 * (w * (c - 2 * b + a) + u * (d - 2 * c + b)) / step**2
            chord[axis] = d - a
        speed2, omega = velocity[0]**2 + velocity[1]**2, 0.0
        if speed2 > 1e-16:
            omega = (velocity[0] * acceleration[1] - velocity[1] * acceleration[0]) / speed2
        towards = velocity if speed2 > 1e-16 else chord
        heading, speed, backward = np.arctan2(towards[1], towards[0]), np.sqrt(speed2), starts_backward
        for first, last, _, _, departs_backward in runs:
            if last <= span:
                backward = departs_backward > 0.0
        if backward:
            heading, speed = wrapped(heading + np.pi), -speed
        for first, last, start, turn, _ in runs:
            if first <= span < last:
                heading = wrapped(start + (since - first) / (last - first) * turn)
                omega = turn / ((last - first) * step)
        result[row, 2], result[row, 3] = heading, speed
        result[row, 4] = omega if times[row] < (first_knot + spans) * step else 0.0
    return result


@njit(b1(POINTS, f8), nogil=True, cache=True)
def goes_on(points, rest):
    """Return whether the motion is one move, and no step of it points back from the last one.

    Steps shorter than ``rest`` [m] are none; one without length between two others slows the robot down and does not
    stop it.
    """
    departures, previous, gap = 0, -1, 0
    for index in range(len(points) - 1):
        x, y = points[index + 1, 0] - points[index, 0], points[index + 1, 1] - points[index, 1]
        length2 = x * x + y * y
        # Not a number either.
        if not length2 < np.inf:
            return False
        if length2 <= rest * rest:
            gap += 1
            continue
        if previous < 0 or gap > 1:
            departures += 1
        elif ((points[previous + 1, 0] - points[previous, 0]) * x
                + (points[previous + 1, 1] - points[previous, 1]) * y) <= 0:
            return False
        previous, gap = index, 0
    return departures <= 1
