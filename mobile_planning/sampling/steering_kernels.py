"""The way from one pose to the next: the shortest Dubins or Reeds-Shepp path, or a straight line.

A way is a word and the lengths of its five parts, in the order in which they are driven, negative ones backwards; parts
that it has not are 0. A word has two bits for each part: 0 right, 1 straight, 2 left. A car starts in the heading of
its pose. What turns on the spot starts in the direction of the line, its own heading means nothing; its word is `LINE`.
"""
import numpy as np
from numba import b1, f8, i8, njit, types

from mobile_planning.sampling.dubins_kernels import ALL_WORDS
from mobile_planning.sampling.dubins_kernels import shortest_between as dubins_between
from mobile_planning.sampling.reeds_shepp_kernels import BACKWARDS, MIRRORED, REVERSED, TURNS
from mobile_planning.sampling.reeds_shepp_kernels import shortest_between as reeds_shepp_between
from mobile_planning.sampling.steering import Car
from mobile_planning.world.curve_kernels import POSE, advanced

CAR = types.NamedTuple((b1, b1, f8), Car)
#: How many parts a way may have.
PARTS = 5
LENGTHS = types.UniTuple(f8, PARTS)
#: Length [m], word, lengths of the parts [m].
WAY = types.Tuple((f8, i8, LENGTHS))
_ALL_STRAIGHT = 0b0101010101
#: The word of a robot that turns on the spot.
LINE = _ALL_STRAIGHT + (1 << 10)
# LSL, RSR, RSL, LSR, RLR, LRL.
_DUBINS_WORDS = np.array([0b0101100110, 0b0101000100, 0b0101100100, 0b0101000110, 0b0101001000, 0b0101100010])
# Shortest part of a Reeds-Shepp path, in radii.
_LEAST = 1e-12


@njit(i8(i8, i8), nogil=True, cache=True, _nrt=False)
def turn_of(word, part):
    """Return the turn of a word's part: 1 to the left, 0 straight, -1 to the right."""
    return ((word >> (2 * part)) & 3) - 1


@njit(f8(LENGTHS), nogil=True, cache=True, _nrt=False)
def total(parts):
    """Return the length [m] of a way."""
    return abs(parts[0]) + abs(parts[1]) + abs(parts[2]) + abs(parts[3]) + abs(parts[4])


@njit(f8(f8, f8), nogil=True, cache=True, _nrt=False)
def unless_tiny(part, radius):
    """Return the part of a way, 0 if it is as short as rounding."""
    return part if abs(part) > _LEAST * radius else 0.0


@njit(WAY(f8, f8, f8, f8, f8, f8, f8), nogil=True, cache=True)
def steer_both_ways(x0, y0, heading0, x1, y1, heading1, radius):
    """Return the shortest Reeds-Shepp path as a way."""
    length, formula, a, b, c, d, e = reeds_shepp_between(x0, y0, heading0, x1, y1, heading1, radius)
    # A part as short as rounding is none: it would count as a reversal.
    a, b, c, d, e = unless_tiny(a, radius), unless_tiny(b, radius), unless_tiny(c, radius), unless_tiny(
        d, radius), unless_tiny(e, radius)
    mirror, sign = -1 if formula & MIRRORED else 1, -1.0 if formula & BACKWARDS else 1.0
    word = 0
    for k in range(PARTS):
        turn = TURNS[formula & 15, PARTS - 1 - k if formula & REVERSED else k]
        word |= ((mirror * turn if turn != 9 else 0) + 1) << (2 * k)
    if formula & REVERSED:
        return length, word, (sign * e, sign * d, sign * c, sign * b, sign * a)
    return length, word, (sign * a, sign * b, sign * c, sign * d, sign * e)


@njit(WAY(CAR, f8, f8, f8, f8, f8, f8), nogil=True, cache=True)
def steer(car, x0, y0, heading0, x1, y1, heading1):
    """Return the shortest way between two poses."""
    if car.turns_in_place:
        length = np.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
        return length, LINE, (length, 0.0, 0.0, 0.0, 0.0)
    if not car.reverses:
        length, code, a, b, c = dubins_between(x0, y0, heading0, x1, y1, heading1, car.radius, ALL_WORDS)
        return length, _DUBINS_WORDS[code], (a, b, c, 0.0, 0.0)
    return steer_both_ways(x0, y0, heading0, x1, y1, heading1, car.radius)


@njit(f8(i8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def first_heading(word, x0, y0, heading0, x1, y1):
    """Return the heading in which a way starts."""
    return np.arctan2(y1 - y0, x1 - x0) if word == LINE else heading0


@njit(f8(f8, f8), nogil=True, cache=True, _nrt=False)
def shortened(part, room):
    """Return a part cut to a length of at most ``room`` [m], of at least 0."""
    return np.copysign(min(abs(part), max(room, 0.0)), part)


@njit(LENGTHS(LENGTHS, f8), nogil=True, cache=True, _nrt=False)
def cut(parts, length):
    """Return the parts of a way up to ``length`` [m]."""
    a = shortened(parts[0], length)
    length -= abs(a)
    b = shortened(parts[1], length)
    length -= abs(b)
    c = shortened(parts[2], length)
    length -= abs(c)
    d = shortened(parts[3], length)
    return a, b, c, d, shortened(parts[4], length - abs(d))


@njit(types.Tuple((i8, LENGTHS))(i8, LENGTHS), nogil=True, cache=True, _nrt=False)
def driven_back(word, parts):
    """Return word and parts of a way that is driven back, the robot turned round: left and right change places."""
    if word == LINE:
        return word, parts
    last = 2 if parts[3] == 0.0 and parts[4] == 0.0 else 4
    back = _ALL_STRAIGHT >> (2 * (last + 1)) << (2 * (last + 1))
    for k in range(last + 1):
        back |= (1 - turn_of(word, last - k)) << (2 * k)
    if last == 2:
        return back, (parts[2], parts[1], parts[0], 0.0, 0.0)
    return back, (parts[4], parts[3], parts[2], parts[1], parts[0])


@njit(POSE(CAR, f8, f8, f8, i8, LENGTHS), nogil=True, cache=True, _nrt=False)
def way_end(car, x, y, heading, word, parts):
    """Return the pose at the end of a way."""
    for k in range(PARTS):
        if parts[k] != 0.0:
            x, y, heading = advanced(x, y, heading, turn_of(word, k), parts[k], car.radius)
    return x, y, heading


@njit(b1(f8, f8), nogil=True, cache=True, _nrt=False)
def is_same_direction(one, other):
    """Return whether two lengths are both driven forwards or both backwards."""
    return (one > 0.0) == (other > 0.0)
