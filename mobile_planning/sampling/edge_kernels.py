"""Checks of many edges of a roadmap at once, straight ones and curves of a car, and points on them.

None of the functions holds the GIL.
"""
import numpy as np
from numba import b1, f8, njit, types, void

from mobile_planning.sampling.steering_kernels import CAR, cut, steer, total, way_end
from mobile_planning.sampling.surroundings_kernels import SURROUNDINGS, pose_is_free, room_about, way_is_free
from mobile_planning.world.motion_kernels import passes_cells, passes_circles, passes_polygons

POINTS = types.Array(f8, 2, 'C', readonly=True)
SHARES = types.Array(f8, 1, 'C', readonly=True)
# Pieces of a line whose rooms are looked up before the line is checked exactly.
PIECES = 8


@njit(b1(SURROUNDINGS, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def has_room(world, x0, y0, x1, y1):
    """Return whether a line is seen to be free from the rooms at a few of its points alone: each reaches that far."""
    half = 0.5 * np.hypot(x1 - x0, y1 - y0)
    pieces = 1
    while pieces <= PIECES:
        piece = 0
        while piece < pieces:
            share = (piece + 0.5) / pieces
            if room_about(world, x0 + share * (x1 - x0), y0 + share * (y1 - y0))[0] * pieces < half:
                break
            piece += 1
        if piece == pieces:
            return True
        pieces *= 2
    return False


@njit(b1(SURROUNDINGS, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def straight_is_free(world, x0, y0, x1, y1):
    """Return whether the line between two free points is free, of a robot without a heading.

    What `line_is_free` does in functions of functions: to hand a space on costs as much as to look at it.
    """
    if has_room(world, x0, y0, x1, y1):
        return True
    space = world.space
    box = min(x0, x1), min(y0, y1), max(x0, x1), max(y0, y1)
    room = space.reach[0] - space.reach[2]
    if (box[0] < space.box[0] + room or box[1] < space.box[1] + room
            or box[2] > space.box[2] - room or box[3] > space.box[3] - room):
        return False
    heading, length = np.arctan2(y1 - y0, x1 - x0), np.hypot(x1 - x0, y1 - y0)
    return ((len(space.circles) == 0 or passes_circles(space, x0, y0, heading, 0, length, 1.0, 0.0, 1.0, box))
            and (len(space.edges) == 0 or passes_polygons(space, x0, y0, heading, 0, length, 1.0, 0.0, 1.0, box))
            and (space.cells.size == 0 or passes_cells(space, x0, y0, heading, 0, length, 1.0)))


@njit(void(SURROUNDINGS, POINTS, b1[::1]), nogil=True, cache=True, _nrt=False)
def write_poses_free(world, poses, out):
    """Write whether the robot is free at each pose (n, 3)."""
    for k in range(len(out)):
        out[k] = pose_is_free(world, poses[k, 0], poses[k, 1], poses[k, 2], 0.0)


@njit(void(SURROUNDINGS, POINTS, POINTS, b1[::1]), nogil=True, cache=True, _nrt=False)
def write_lines_free(world, starts, ends, out):
    """Write whether the line between each pair of free points is free, of a robot without a heading."""
    for k in range(len(out)):
        out[k] = straight_is_free(world, starts[k, 0], starts[k, 1], ends[k, 0], ends[k, 1])


@njit(void(SURROUNDINGS, CAR, POINTS, POINTS, b1[::1]), nogil=True, cache=True, _nrt=False)
def write_curves_free(world, car, starts, ends, out):
    """Write whether the shortest way of a car between each pair of free poses is free."""
    for k in range(len(out)):
        _, word, parts = steer(
            car, starts[k, 0], starts[k, 1], starts[k, 2], ends[k, 0], ends[k, 1], ends[k, 2])
        out[k] = way_is_free(world, car, starts[k, 0], starts[k, 1], starts[k, 2], word, parts, 0.0, 1.0)


@njit(void(CAR, POINTS, POINTS, SHARES, f8[:, ::1]), nogil=True, cache=True, _nrt=False)
def write_curve_poses(car, starts, ends, shares, out):
    """Write the pose (n, 3) where a share of each shortest way of a car lies behind."""
    for k in range(len(shares)):
        _, word, parts = steer(
            car, starts[k, 0], starts[k, 1], starts[k, 2], ends[k, 0], ends[k, 1], ends[k, 2])
        parts = cut(parts, shares[k] * total(parts))
        out[k, 0], out[k, 1], out[k, 2] = way_end(car, starts[k, 0], starts[k, 1], starts[k, 2], word, parts)
