"""Building tracks, and shortening them: a stretch of the track gives way to a shorter one that is free.

The new stretch goes either straight to a later pose of the track, or by way of a pose that lies a random bit beside
the track. The second kind moves a path towards a local optimum, which cutting corners alone does not reach for a car:
every pose of the track already has its heading.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, u1, void

from mobile_planning.sampling.random_kernels import STATE, normal, uniform
from mobile_planning.sampling.steering_kernels import STRAIGHT, TURN_TABLE, first_heading, steer, way_is_free
from mobile_planning.sampling.track import Track
from mobile_planning.world.curve_kernels import POSE, advanced
from mobile_planning.world.distance_kernels import SPACE
from mobile_planning.world.motion_kernels import segment_is_free

TRACK = types.NamedTuple((f8[:, ::1], i8[::1], f8[::1], f8[::1], i8[::1]), Track)
#: A stretch gives way to one that is shorter by at least this [m].
LEAST_GAIN = 1e-7
# A trial replaces a stretch by at most two ways of three segments, and cuts two segments in two.
ROOM = 8


@njit(void(TRACK, f8, f8, f8, i8, f8, f8), nogil=True, cache=True, _nrt=False)
def append(track, x, y, heading, turn, length, radius):
    """Add a segment that starts at the track's end; it joins the last one if they are one arc or one line."""
    if length <= 0.0:
        return
    n = track.sizes[0]
    if n > 0 and track.turns[n - 1] == turn and (turn != 0 or abs(np.sin(heading - track.starts[n - 1, 2])) < 1e-13
                                                 and np.cos(heading - track.starts[n - 1, 2]) > 0.0):
        n -= 1
        x, y, heading = track.starts[n, 0], track.starts[n, 1], track.starts[n, 2]
        length += track.lengths[n]
    track.starts[n, 0], track.starts[n, 1], track.starts[n, 2] = x, y, heading
    track.turns[n], track.lengths[n] = turn, length
    track.places[n + 1] = track.places[n] + length
    x, y, heading = advanced(x, y, heading, turn, length, max(radius, 1e-300))
    track.starts[n + 1, 0], track.starts[n + 1, 1], track.starts[n + 1, 2] = x, y, heading
    track.sizes[0] = n + 1


@njit(void(TRACK, f8, f8, f8, i8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def append_way(track, x, y, heading, word, a, b, c, radius):
    """Add the three segments of a way."""
    radius = max(radius, 1e-300)
    append(track, x, y, heading, TURN_TABLE[word, 0], a, radius)
    x, y, heading = advanced(x, y, heading, TURN_TABLE[word, 0], a, radius)
    append(track, x, y, heading, TURN_TABLE[word, 1], b, radius)
    x, y, heading = advanced(x, y, heading, TURN_TABLE[word, 1], b, radius)
    append(track, x, y, heading, TURN_TABLE[word, 2], c, radius)


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


@njit(POSE(TRACK, f8, f8), nogil=True, cache=True, _nrt=False)
def pose_on(track, place, radius):
    """Return the pose at a length along the track."""
    k = segment_at(track, place)
    return advanced(track.starts[k, 0], track.starts[k, 1], track.starts[k, 2], track.turns[k],
                    min(place - track.places[k], track.lengths[k]), max(radius, 1e-300))


@njit(void(TRACK, TRACK, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def append_stretch(track, other, begin, end, radius):
    """Add the stretch of another track between two lengths along it."""
    for k in range(segment_at(other, begin), other.sizes[0]):
        if other.places[k] >= end:
            return
        first, last = max(begin, other.places[k]), min(end, other.places[k + 1])
        x, y, heading = other.starts[k, 0], other.starts[k, 1], other.starts[k, 2]
        if first > other.places[k]:
            x, y, heading = advanced(x, y, heading, other.turns[k], first - other.places[k], max(radius, 1e-300))
        append(track, x, y, heading, other.turns[k], last - first, radius)


@njit(b1(SPACE, TRACK, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def rest_is_free(space, track, begin, earlier, radius, t, speed):
    """Return whether the track from a length on is free if it is driven earlier by so many metres."""
    for k in range(segment_at(track, begin), track.sizes[0]):
        first = max(begin, track.places[k])
        length = track.places[k + 1] - first
        if length > 0.0:
            x, y, heading = advanced(track.starts[k, 0], track.starts[k, 1], track.starts[k, 2], track.turns[k],
                                     first - track.places[k], max(radius, 1e-300))
            if not segment_is_free(space, x, y, heading, track.turns[k], length, max(radius, 1e-300),
                                   t + (first - earlier) / speed, speed):
                return False
    return True


@njit(b1(SPACE, TRACK, TRACK, STATE, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def try_to_shorten(space, track, spare, random, radius, t, speed):
    """Replace one random stretch by a shorter one if that is free, and return whether it was."""
    total = track.places[track.sizes[0]]
    span = total * 10.0 ** (-2.0 * uniform(random))
    begin = uniform(random) * total - 0.5 * span
    end = min(begin + span, total)
    begin = max(begin, 0.0)
    x0, y0, heading0 = pose_on(track, begin, radius)
    x2, y2, heading2 = pose_on(track, end, radius)
    by_way = uniform(random) < 0.7
    if by_way:
        x1, y1, heading1 = pose_on(track, begin + (end - begin) * uniform(random), radius)
        spread = (end - begin) * 10.0 ** (-0.5 - 3.0 * uniform(random))
        x1, y1 = x1 + spread * normal(random), y1 + spread * normal(random)
        heading1 += 3.0 * spread / (end - begin) * normal(random)
        second, word2, d, e, f = steer(x1, y1, heading1, x2, y2, heading2, radius)
    else:
        x1, y1, heading1 = x2, y2, heading2
        second, word2, d, e, f = 0.0, STRAIGHT, 0.0, 0.0, 0.0
    first, word1, a, b, c = steer(x0, y0, heading0, x1, y1, heading1, radius)
    gain = end - begin - first - second
    if not gain >= LEAST_GAIN:
        return False
    heading0 = first_heading(word1, x0, y0, heading0, x1, y1)
    if not way_is_free(space, x0, y0, heading0, word1, a, b, c, radius, t + begin / speed, speed):
        return False
    if by_way:
        heading1 = first_heading(word2, x1, y1, heading1, x2, y2)
        if not way_is_free(space, x1, y1, heading1, word2, d, e, f, radius, t + (begin + first) / speed, speed):
            return False
    if space.reach[3] > 0.0 and not rest_is_free(space, track, end, gain, radius, t, speed):
        return False
    spare.sizes[0] = 0
    append_stretch(spare, track, 0.0, begin, radius)
    append_way(spare, x0, y0, heading0, word1, a, b, c, radius)
    if by_way:
        append_way(spare, x1, y1, heading1, word2, d, e, f, radius)
    append_stretch(spare, track, end, total, radius)
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


@njit(i8(SPACE, TRACK, TRACK, STATE, f8, f8, f8, i8, u1[::1]), nogil=True, cache=True, _nrt=False)
def shorten(space, track, spare, random, radius, t, speed, trials, stop):
    """Make so many trials to shorten a track that starts at time t [s]; return how many were made.

    ``spare`` is a track of the same size to work in. It ends early when stopped or when the tracks are nearly full.
    """
    for trial in range(trials):
        if stop[0] or track.sizes[0] + ROOM > len(track.turns):
            return trial
        if try_to_shorten(space, track, spare, random, radius, t, speed):
            if spare.places[spare.sizes[0]] < track.places[track.sizes[0]]:
                take_over(track, spare)
    return trials
