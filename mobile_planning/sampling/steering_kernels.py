"""The way from one pose to the next: the shortest Dubins word, or a straight line where the turning radius is 0.

A way is a word, by its code, and three lengths; `TURN_TABLE` has the turns of each word. A car starts in the heading of
its pose. What turns on the spot starts in the direction of the line; its own heading means nothing.
"""
import numpy as np
from numba import b1, f8, i8, njit, types

from mobile_planning.sampling.dubins_kernels import ALL_WORDS, SHORTEST, shortest_between
from mobile_planning.world.curve_kernels import POSE, advanced
from mobile_planning.world.distance_kernels import SPACE
from mobile_planning.world.motion_kernels import segment_is_free

#: The code of a straight line; those below are Dubins' words.
STRAIGHT = 6
TURN_TABLE = np.array([[1, 0, 1], [-1, 0, -1], [-1, 0, 1], [1, 0, -1], [-1, 1, -1], [1, -1, 1], [0, 0, 0]])
PARTS = types.UniTuple(f8, 3)


@njit(SHORTEST(f8, f8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def steer(x0, y0, heading0, x1, y1, heading1, radius):
    """Return length, word and the three lengths [m] of the shortest way between two poses."""
    if radius > 0.0:
        return shortest_between(x0, y0, heading0, x1, y1, heading1, radius, ALL_WORDS)
    length = np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
    return length, STRAIGHT, length, 0.0, 0.0


@njit(f8(i8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def first_heading(word, x0, y0, heading0, x1, y1):
    """Return the heading in which a way starts."""
    return np.arctan2(y1 - y0, x1 - x0) if word == STRAIGHT else heading0


@njit(PARTS(f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def cut(a, b, c, length):
    """Return the lengths of a way's three parts up to ``length``."""
    first = min(a, length)
    second = min(b, length - first)
    return first, second, min(c, max(length - first - second, 0.0))


@njit(POSE(f8, f8, f8, i8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def way_end(x, y, heading, word, a, b, c, radius):
    """Return the pose at the end of a way."""
    radius = max(radius, 1e-300)
    x, y, heading = advanced(x, y, heading, TURN_TABLE[word, 0], a, radius)
    x, y, heading = advanced(x, y, heading, TURN_TABLE[word, 1], b, radius)
    return advanced(x, y, heading, TURN_TABLE[word, 2], c, radius)


@njit(b1(SPACE, f8, f8, f8, i8, f8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def way_is_free(space, x, y, heading, word, a, b, c, radius, t, speed):
    """Return whether the robot, free at the start of a way at time t [s], is free all along it."""
    radius = max(radius, 1e-300)
    if a > 0.0:
        if not segment_is_free(space, x, y, heading, TURN_TABLE[word, 0], a, radius, t, speed):
            return False
        x, y, heading = advanced(x, y, heading, TURN_TABLE[word, 0], a, radius)
    if b > 0.0:
        if not segment_is_free(space, x, y, heading, TURN_TABLE[word, 1], b, radius, t + a / speed, speed):
            return False
        x, y, heading = advanced(x, y, heading, TURN_TABLE[word, 1], b, radius)
    return c == 0.0 or segment_is_free(
        space, x, y, heading, TURN_TABLE[word, 2], c, radius, t + (a + b) / speed, speed)
