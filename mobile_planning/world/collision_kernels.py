"""How much room a robot has at one pose and time."""
import numpy as np
from numba import b1, f8, njit, types, void

from mobile_planning.world.distance_kernels import SPACE, depth_in, to_grid, to_group
from mobile_planning.world.outline_kernels import outline_room

POSES = types.Array(f8, 2, 'C', readonly=True)
TIMES = types.Array(f8, 1, 'C', readonly=True)


@njit(f8(SPACE, f8, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def disc_room(space, x, y, t):
    """Return the room [m] of a disc at a time [s], negative where it overlaps."""
    room = depth_in(space.box, x, y)
    for k in range(len(space.circles)):
        dx = x - space.circles[k, 0] - t * space.circles[k, 3]
        dy = y - space.circles[k, 1] - t * space.circles[k, 4]
        room = min(room, np.sqrt(dx * dx + dy * dy) - space.circles[k, 2])
    for group in range(len(space.velocities)):
        room = min(room, to_group(
            space, group, x - t * space.velocities[group, 0], y - t * space.velocities[group, 1]))
    if space.cells.size:
        room = min(room, to_grid(space, x, y))
    return room - space.reach[0]


@njit(f8(SPACE, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def room_at(space, x, y, heading, t):
    """Return the room [m] of the robot at a pose and time [s]; of an outline that overlaps it is minus infinity."""
    if len(space.body):
        return outline_room(space, x, y, heading, t)
    return disc_room(space, x, y, t)


@njit(b1(SPACE, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def is_free(space, x, y, heading, t):
    """Return whether the robot at a pose and time [s] runs into nothing."""
    return room_at(space, x, y, heading, t) >= -space.reach[2]


@njit(void(SPACE, POSES, TIMES, b1[::1]), nogil=True, cache=True, _nrt=False)
def write_free(space, poses, times, out):
    """Write whether the robot is free at each pose (n, 3) and time (n,)."""
    for k in range(len(out)):
        out[k] = is_free(space, poses[k, 0], poses[k, 1], poses[k, 2], times[k])


@njit(void(SPACE, POSES, TIMES, f8[::1]), nogil=True, cache=True, _nrt=False)
def write_rooms(space, poses, times, out):
    """Write the room [m] of the robot at each pose (n, 3) and time (n,), 0 where an outline overlaps."""
    for k in range(len(out)):
        room = room_at(space, poses[k, 0], poses[k, 1], poses[k, 2], times[k])
        out[k] = max(room, 0.0) if len(space.body) else room
