"""Whether poses and ways are free: by the rooms of cells where they tell, by the exact shapes where they do not.

The room changes by no more than one walks. So a point is free if the middle of its cell has more room than the point
is away from it, and blocked if that lies deeper in something than the point is away.
"""
import numpy as np
from numba import b1, f8, i8, njit, types

from mobile_planning.sampling.steering_kernels import CAR, LENGTHS, PARTS, turn_of
from mobile_planning.world.collision_kernels import disc_room, is_free
from mobile_planning.world.curve_kernels import advanced
from mobile_planning.world.distance_kernels import SPACE
from mobile_planning.world.motion_kernels import segment_is_free
from mobile_planning.world.surroundings import Surroundings

SURROUNDINGS = types.NamedTuple((SPACE, f8[:, ::1], f8[::1]), Surroundings)
# From where a check goes on with the exact shapes [m].
_NARROW = 1e-3


@njit(types.UniTuple(f8, 2)(SURROUNDINGS, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def room_about(world, x, y):
    """Return between what [m] the room at a point lies, as its cell tells; beyond the cells, anything."""
    column, row = (x - world.frame[0]) * world.frame[2], (y - world.frame[1]) * world.frame[3]
    rows, columns = world.rooms.shape
    if not (0.0 <= column <= columns and 0.0 <= row <= rows):
        return -np.inf, np.inf
    i, j = min(int(column), columns - 1), min(int(row), rows - 1)
    middle_x, middle_y = world.frame[0] + (i + 0.5) / world.frame[2], world.frame[1] + (j + 0.5) / world.frame[3]
    room = world.rooms[j, i]
    if room != room:
        room = disc_room(world.space, middle_x, middle_y, 0.0)
        world.rooms[j, i] = room
    away = np.sqrt((x - middle_x) ** 2 + (y - middle_y) ** 2)
    return room - away, room + away


@njit(b1(SURROUNDINGS, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def pose_is_free(world, x, y, heading, t):
    """Return whether the robot at a pose and time [s] runs into nothing."""
    if world.rooms.size:
        least, most = room_about(world, x, y)
        if least > 0.0 or most < -world.space.reach[2]:
            return least > 0.0
    return is_free(world.space, x, y, heading, t)


@njit(f8(SURROUNDINGS, CAR, f8, f8, f8, i8, LENGTHS), nogil=True, cache=True, _nrt=False, forceinline=True)
def seen_free(world, car, x, y, heading, word, parts):
    """Return up to which length [m] along a way the cells show it to be free: all of it infinite, blocked -1."""
    behind, blocked, seen = 0.0, -world.space.reach[2], np.inf
    step = 0.5 / max(world.frame[2], world.frame[3])
    for k in range(PARTS):
        if parts[k] == 0.0:
            continue
        turn, place, length = turn_of(word, k), 0.0, abs(parts[k])
        at_x, at_y = x, y
        while True:
            least, most = room_about(world, at_x, at_y)
            if most < blocked:
                return -1.0
            if least < _NARROW:
                seen = min(seen, behind + place)
            # Beyond a narrow place it is only asked whether the way is blocked further on: then the shapes need not be.
            place += least if seen == np.inf else max(least, step)
            if place >= length:
                break
            at_x, at_y, _ = advanced(x, y, heading, turn, np.copysign(place, parts[k]), car.radius)
        x, y, heading = advanced(x, y, heading, turn, parts[k], car.radius)
        behind += length
    return seen


@njit(b1(SURROUNDINGS, CAR, f8, f8, f8, i8, LENGTHS, f8, f8), nogil=True, cache=True, _nrt=False)
def way_is_free(world, car, x, y, heading, word, parts, t, speed):
    """Return whether the robot, free at the start of a way at time t [s], is free all along it."""
    seen = 0.0
    if world.rooms.size:
        seen = seen_free(world, car, x, y, heading, word, parts)
        if seen < 0.0 or seen == np.inf:
            return seen > 0.0
    for k in range(PARTS):
        length = abs(parts[k])
        if length > seen:
            turn, skipped = turn_of(word, k), np.copysign(seen, parts[k])
            x, y, heading = advanced(x, y, heading, turn, skipped, car.radius)
            if not segment_is_free(world.space, x, y, heading, turn, parts[k] - skipped, car.radius, t + seen / speed,
                                   speed):
                return False
            x, y, heading = advanced(x, y, heading, turn, parts[k] - skipped, car.radius)
            seen = 0.0
        elif length > 0.0:
            x, y, heading = advanced(x, y, heading, turn_of(word, k), parts[k], car.radius)
            seen -= length
        t += length / speed
    return True
