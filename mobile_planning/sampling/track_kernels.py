"""Building tracks, and shortening them: a stretch of the track gives way to a shorter one that is free.

The new stretch goes either straight to a later pose of the track, or by way of a pose that lies a random bit beside
the track. The second kind moves a path towards a local optimum, which cutting corners alone does not reach for a car:
every pose of the track already has its heading.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, u1, void

from mobile_planning.sampling.random_kernels import STATE, normal, uniform
from mobile_planning.sampling.steering_kernels import (
    CAR, LENGTHS, LINE, PARTS, first_heading, is_same_direction, steer, turn_of)
from mobile_planning.sampling.surroundings_kernels import SURROUNDINGS, way_is_free
from mobile_planning.sampling.track import Track
from mobile_planning.world.curve_kernels import POSE, advanced
from mobile_planning.world.motion_kernels import segment_is_free

TRACK = types.NamedTuple((f8[:, ::1], i8[::1], f8[::1], f8[::1], i8[::1]), Track)
#: A stretch gives way to one that is shorter by at least this [m].
LEAST_GAIN = 1e-7
# A trial replaces a stretch by at most two ways, and cuts two segments in two.
ROOM = 2 * PARTS + 2


@njit(b1(TRACK, f8, i8, f8), nogil=True, cache=True, _nrt=False)
def continues(track, heading, turn, length):
    """Return whether a segment at the track's end is one arc or one line with the last."""
    n = track.sizes[0] - 1
    if n < 0 or track.turns[n] != turn or not is_same_direction(track.lengths[n], length):
        return False
    off = heading - track.starts[n, 2]
    return turn != 0 or abs(np.sin(off)) < 1e-13 and np.cos(off) > 0.0


@njit(void(TRACK, f8, f8, f8, i8, f8, CAR), nogil=True, cache=True, _nrt=False)
def append(track, x, y, heading, turn, length, car):
    """Add a segment that starts at the track's end; it joins the last one if they are one arc or one line."""
    if length == 0.0:
        return
    n = track.sizes[0]
    if continues(track, heading, turn, length):
        n -= 1
        x, y, heading = track.starts[n, 0], track.starts[n, 1], track.starts[n, 2]
        length += track.lengths[n]
    track.starts[n, 0], track.starts[n, 1], track.starts[n, 2] = x, y, heading
    track.turns[n], track.lengths[n] = turn, length
    track.places[n + 1] = track.places[n] + abs(length)
    x, y, heading = advanced(x, y, heading, turn, length, car.radius)
    track.starts[n + 1, 0], track.starts[n + 1, 1], track.starts[n + 1, 2] = x, y, heading
    track.sizes[0] = n + 1


@njit(void(TRACK, f8, f8, f8, i8, LENGTHS, CAR), nogil=True, cache=True, _nrt=False)
def append_way(track, x, y, heading, word, parts, car):
    """Add the parts of a way."""
    for k in range(PARTS):
        if parts[k] != 0.0:
            append(track, x, y, heading, turn_of(word, k), parts[k], car)
            x, y, heading = advanced(x, y, heading, turn_of(word, k), parts[k], car.radius)


@njit(i8(TRACK, f8), nogil=True, cache=True, _nrt=False)
def segment_at(track, place):
    """Return the number of the segment at a length along the track."""
    low, high = 0, track.sizes[0] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if track.places[middle] <= place:
            low = middle
        else:
            high = middle - 1
    return low


@njit(POSE(TRACK, i8, f8, CAR), nogil=True, cache=True, _nrt=False)
def pose_in(track, k, driven, car):
    """Return the pose so many metres into a segment."""
    return advanced(track.starts[k, 0], track.starts[k, 1], track.starts[k, 2], track.turns[k],
                    np.copysign(min(driven, abs(track.lengths[k])), track.lengths[k]), car.radius)


@njit(POSE(TRACK, f8, CAR), nogil=True, cache=True, _nrt=False)
def pose_on(track, place, car):
    """Return the pose at a length along the track."""
    k = segment_at(track, place)
    return pose_in(track, k, place - track.places[k], car)


@njit(void(TRACK, TRACK, f8, f8, CAR), nogil=True, cache=True, _nrt=False)
def append_stretch(track, other, begin, end, car):
    """Add the stretch of another track between two lengths along it."""
    for k in range(segment_at(other, begin), other.sizes[0]):
        if other.places[k] >= end:
            return
        first, last = max(begin, other.places[k]), min(end, other.places[k + 1])
        x, y, heading = pose_in(other, k, first - other.places[k], car)
        append(track, x, y, heading, other.turns[k], np.copysign(last - first, other.lengths[k]), car)


@njit(b1(SURROUNDINGS, TRACK, f8, f8, CAR, f8, f8), nogil=True, cache=True, _nrt=False)
def rest_is_free(world, track, begin, earlier, car, t, speed):
    """Return whether the track from a length on is free if it is driven earlier by so many metres."""
    for k in range(segment_at(track, begin), track.sizes[0]):
        first = max(begin, track.places[k])
        length = track.places[k + 1] - first
        if length > 0.0:
            x, y, heading = pose_in(track, k, first - track.places[k], car)
            if not segment_is_free(world.space, x, y, heading, track.turns[k], np.copysign(length, track.lengths[k]),
                                   car.radius, t + (first - earlier) / speed, speed):
                return False
    return True


@njit(b1(SURROUNDINGS, TRACK, TRACK, STATE, CAR, f8, f8), nogil=True, cache=True, _nrt=False)
def try_to_shorten(world, track, spare, random, car, t, speed):
    """Replace one random stretch by a shorter one if that is free, and return whether it was."""
    whole = track.places[track.sizes[0]]
    span = whole * 10.0 ** (-2.0 * uniform(random))
    begin = uniform(random) * whole - 0.5 * span
    end = min(begin + span, whole)
    begin = max(begin, 0.0)
    x0, y0, heading0 = pose_on(track, begin, car)
    x2, y2, heading2 = pose_on(track, end, car)
    by_way = uniform(random) < 0.7
    x1, y1, heading1, second, word2, parts2 = x2, y2, heading2, 0.0, LINE, (0.0, 0.0, 0.0, 0.0, 0.0)
    if by_way:
        x1, y1, heading1 = pose_on(track, begin + (end - begin) * uniform(random), car)
        spread = (end - begin) * 10.0 ** (-0.5 - 3.0 * uniform(random))
        x1, y1 = x1 + spread * normal(random), y1 + spread * normal(random)
        heading1 += 3.0 * spread / (end - begin) * normal(random)
        second, word2, parts2 = steer(car, x1, y1, heading1, x2, y2, heading2)
    first, word1, parts1 = steer(car, x0, y0, heading0, x1, y1, heading1)
    gain = end - begin - first - second
    if not gain >= LEAST_GAIN:
        return False
    heading0 = first_heading(word1, x0, y0, heading0, x1, y1)
    if not way_is_free(world, car, x0, y0, heading0, word1, parts1, t + begin / speed, speed):
        return False
    if by_way:
        heading1 = first_heading(word2, x1, y1, heading1, x2, y2)
        if not way_is_free(world, car, x1, y1, heading1, word2, parts2, t + (begin + first) / speed, speed):
            return False
    if world.space.reach[3] > 0.0 and not rest_is_free(world, track, end, gain, car, t, speed):
        return False
    spare.sizes[0] = 0
    append_stretch(spare, track, 0.0, begin, car)
    append_way(spare, x0, y0, heading0, word1, parts1, car)
    append_way(spare, x1, y1, heading1, word2, parts2, car)
    append_stretch(spare, track, end, whole, car)
    return True


@njit(void(TRACK, TRACK), nogil=True, cache=True, _nrt=False)
def take_over(track, other):
    """Make a track equal to another."""
    track.sizes[0] = other.sizes[0]
    for k in range(other.sizes[0] + 1):
        track.places[k] = other.places[k]
        for axis in range(3):
            track.starts[k, axis] = other.starts[k, axis]
    for k in range(other.sizes[0]):
        track.turns[k], track.lengths[k] = other.turns[k], other.lengths[k]


@njit(i8(SURROUNDINGS, TRACK, TRACK, STATE, CAR, f8, f8, i8, u1[::1]), nogil=True, cache=True, _nrt=False)
def shorten(world, track, spare, random, car, t, speed, trials, stop):
    """Make so many trials to shorten a track that starts at time t [s]; return how many were made.

    ``spare`` is a track of the same size to work in. It ends early when stopped or when the tracks are nearly full.
    """
    for trial in range(trials):
        if stop[0] or track.sizes[0] + ROOM > len(track.turns):
            return trial
        if try_to_shorten(world, track, spare, random, car, t, speed):
            if spare.places[spare.sizes[0]] < track.places[track.sizes[0]]:
                take_over(track, spare)
    return trials


@njit(void(TRACK, CAR, f8, f8[:, ::1]), nogil=True, cache=True, _nrt=False)
def write_path(track, car, spacing, path):
    """Write poses at most ``spacing`` [m] apart along a track, its end the last, headings in (-pi, pi]."""
    row = 0
    for k in range(track.sizes[0] + 1):
        pieces = 1 if k == track.sizes[0] else int(np.ceil(abs(track.lengths[k]) / spacing))
        for piece in range(pieces):
            x, y, heading = track.starts[k, 0], track.starts[k, 1], track.starts[k, 2]
            if piece > 0:
                x, y, heading = pose_in(track, k, abs(track.lengths[k]) * piece / pieces, car)
            turned = np.ceil((heading - np.pi) / (2.0 * np.pi))
            path[row, 0], path[row, 1], path[row, 2] = x, y, heading - 2.0 * np.pi * turned
            row += 1
