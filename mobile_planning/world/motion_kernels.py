"""Whether a robot runs into something on its way along arcs and straights, at the times when it is there.

A disc that drives straight is checked in closed form, against obstacles in their own frame: there it drives straight
too. Otherwise the check goes along the way in steps as long as the room allows (conservative advancement): nothing
between two places that are checked can be nearer than the room at the first. Where the robot all but touches something
the steps are no shorter than `LEAST_STEP`, so that what is missed is no deeper than half of that.

A way is given by its start, which must be free, and for each segment its turn (1 left, 0 straight, -1 right) and its
length, negative if driven backwards.
"""
import numpy as np
from numba import b1, f8, i8, njit, types

from mobile_planning.world.collision_kernels import room_at
from mobile_planning.world.curve_kernels import LENGTHS, TURNS, advanced
from mobile_planning.world.distance_kernels import (
    SPACE, is_inside, squared_between, squared_to_block, squared_to_segment, to_grid)

LEAST_STEP = 1e-4
BOX = types.UniTuple(f8, 4)


@njit(BOX(f8, f8, f8, i8, f8, f8), nogil=True, cache=True, _nrt=False)
def extent_of(x, y, heading, turn, length, radius):
    """Return the bounding box (x_min, y_min, x_max, y_max) of a segment."""
    end_x, end_y, _ = advanced(x, y, heading, turn, length, radius)
    x_min, x_max, y_min, y_max = min(x, end_x), max(x, end_x), min(y, end_y), max(y, end_y)
    if turn == 0:
        return x_min, y_min, x_max, y_max
    # The arc as seen from its centre, counter-clockwise from angle `begin`; it passes quarter turns.
    centre_x, centre_y = x - turn * radius * np.sin(heading), y + turn * radius * np.cos(heading)
    swept = turn * length / radius
    begin = heading - 0.5 * turn * np.pi + min(swept, 0.0)
    end = begin + abs(swept)
    quarter = np.ceil(begin / (0.5 * np.pi))
    while quarter * 0.5 * np.pi <= end and quarter * 0.5 * np.pi < begin + 2.0 * np.pi:
        side = int(quarter) % 4
        if side == 0:
            x_max = centre_x + radius
        elif side == 1:
            y_max = centre_y + radius
        elif side == 2:
            x_min = centre_x - radius
        else:
            y_min = centre_y - radius
        quarter += 1.0
    return x_min, y_min, x_max, y_max


@njit(b1(SPACE, i8, i8, f8, f8, f8, i8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def passes_block(space, group, block, x, y, heading, turn, length, radius, vx, vy):
    """Return whether a disc passes a block of edges, which moves by (vx, vy) for each metre that the disc drives."""
    disc, allowed, total = space.reach[0], space.reach[2], abs(length)
    pace, place = 1.0 + np.hypot(vx, vy), 0.0
    while True:
        at_x, at_y, _ = advanced(x, y, heading, turn, place if length > 0.0 else -place, radius)
        at_x, at_y = at_x - place * vx, at_y - place * vy
        distance = np.sqrt(squared_to_block(space, block, at_x, at_y, np.inf))
        room = distance - disc
        if disc > allowed and room < -allowed:
            return False
        # A point may be beyond the edge, by what is allowed and one least step.
        if disc <= allowed and room < allowed + 2.0 * LEAST_STEP and is_inside(space, group, at_x, at_y):
            if distance > allowed - disc:
                return False
            room = 0.0
        if place >= total:
            return True
        place = min(total, place + max(room, LEAST_STEP) / pace)


@njit(b1(SPACE, i8, i8, f8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def passes_straight(space, group, block, x, y, heading, length, vx, vy):
    """Return whether a disc that drives straight passes a block of edges (see `passes_block`)."""
    total = abs(length)
    end_x, end_y = x + length * np.cos(heading) - total * vx, y + length * np.sin(heading) - total * vy
    needed = max(space.reach[0] - space.reach[2], 0.0)
    x_min, x_max, y_min, y_max = min(x, end_x), max(x, end_x), min(y, end_y), max(y, end_y)
    least = np.inf
    for k in range(space.first[block], space.first[block + 1]):
        if (max(space.edges[k, 0], space.edges[k, 2]) < x_min - needed
                or min(space.edges[k, 0], space.edges[k, 2]) > x_max + needed
                or max(space.edges[k, 1], space.edges[k, 3]) < y_min - needed
                or min(space.edges[k, 1], space.edges[k, 3]) > y_max + needed):
            continue
        least = min(least, squared_between(x, y, end_x, end_y, space.edges[k, 0], space.edges[k, 1],
                                           space.edges[k, 2], space.edges[k, 3]))
    if needed > 0.0 or least > 0.0:
        return np.sqrt(least) >= needed
    # A point that meets an edge touches it or enters: only its way beyond tells.
    return passes_block(space, group, block, x, y, heading, 0, length, 1.0, vx, vy)


@njit(b1(SPACE, f8, f8, f8, i8, f8, f8, f8, f8, BOX), nogil=True, cache=True, _nrt=False, forceinline=True)
def passes_polygons(space, x, y, heading, turn, length, radius, t, speed, extent):
    """Return whether a disc passes all polygons on one segment that begins at time t [s]."""
    disc, total = space.reach[0], abs(length)
    for group in range(len(space.velocities)):
        vx, vy = space.velocities[group, 0] / speed, space.velocities[group, 1] / speed
        shift_x, shift_y = t * space.velocities[group, 0], t * space.velocities[group, 1]
        x_min = extent[0] - shift_x - max(total * vx, 0.0) - disc
        x_max = extent[2] - shift_x - min(total * vx, 0.0) + disc
        y_min = extent[1] - shift_y - max(total * vy, 0.0) - disc
        y_max = extent[3] - shift_y - min(total * vy, 0.0) + disc
        for block in range(space.groups[group], space.groups[group + 1]):
            if (space.blocks[block, 0] > x_max or space.blocks[block, 2] < x_min
                    or space.blocks[block, 1] > y_max or space.blocks[block, 3] < y_min):
                continue
            if turn == 0:
                if not passes_straight(space, group, block, x - shift_x, y - shift_y, heading, length, vx, vy):
                    return False
            elif not passes_block(space, group, block, x - shift_x, y - shift_y, heading, turn, length, radius, vx, vy):
                return False
    return True


@njit(b1(SPACE, i8, f8, f8, f8, i8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def passes_circle(space, k, x, y, heading, turn, length, radius, vx, vy):
    """Return whether a disc passes one circle that moves by (vx, vy) for each metre that the disc drives.

    Relative to the circle's centre.
    """
    needed, total = space.reach[0] + space.circles[k, 2], abs(length)
    if turn == 0:
        end_x, end_y = x + length * np.cos(heading) - total * vx, y + length * np.sin(heading) - total * vy
        return np.sqrt(squared_to_segment(0.0, 0.0, x, y, end_x, end_y)) >= needed - space.reach[2]
    pace, place = 1.0 + np.hypot(vx, vy), 0.0
    while True:
        at_x, at_y, _ = advanced(x, y, heading, turn, place if length > 0.0 else -place, radius)
        at_x, at_y = at_x - place * vx, at_y - place * vy
        room = np.sqrt(at_x * at_x + at_y * at_y) - needed
        if room < -space.reach[2]:
            return False
        if place >= total:
            return True
        place = min(total, place + max(room, LEAST_STEP) / pace)


@njit(b1(SPACE, f8, f8, f8, i8, f8, f8, f8, f8, BOX), nogil=True, cache=True, _nrt=False, forceinline=True)
def passes_circles(space, x, y, heading, turn, length, radius, t, speed, extent):
    """Return whether a disc passes all circles on one segment that begins at time t [s]."""
    disc, total = space.reach[0], abs(length)
    for k in range(len(space.circles)):
        vx, vy = space.circles[k, 3] / speed, space.circles[k, 4] / speed
        at_x, at_y = space.circles[k, 0] + t * space.circles[k, 3], space.circles[k, 1] + t * space.circles[k, 4]
        room = disc + space.circles[k, 2]
        if (at_x + max(total * vx, 0.0) + room < extent[0] or at_x + min(total * vx, 0.0) - room > extent[2]
                or at_y + max(total * vy, 0.0) + room < extent[1] or at_y + min(total * vy, 0.0) - room > extent[3]):
            continue
        if not passes_circle(space, k, x - at_x, y - at_y, heading, turn, length, radius, vx, vy):
            return False
    return True


@njit(b1(SPACE, f8, f8, f8, i8, f8, f8), nogil=True, cache=True, _nrt=False)
def passes_cells(space, x, y, heading, turn, length, radius):
    """Return whether a disc runs into no occupied square on one segment and stays within the grid."""
    total, place = abs(length), 0.0
    # Along a wall of cells a hundredth of a cell is fine enough, half of it at most a millimetre.
    least = max(LEAST_STEP, min(0.01 * space.frame[4], 1e-3))
    while True:
        at_x, at_y, _ = advanced(x, y, heading, turn, place if length > 0.0 else -place, radius)
        room = to_grid(space, at_x, at_y) - space.reach[0]
        if room < -space.reach[2]:
            return False
        if place >= total:
            return True
        place = min(total, place + max(room, least))


@njit(b1(SPACE, f8, f8, f8, i8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def passes_outline(space, x, y, heading, turn, length, radius, t, speed):
    """Return whether an outline runs into nothing on one segment that begins at time t [s]."""
    total, place = abs(length), 0.0
    pace = 1.0 + space.reach[3] / speed + (space.reach[1] / radius if turn != 0 else 0.0)
    while True:
        at_x, at_y, at_heading = advanced(x, y, heading, turn, place if length > 0.0 else -place, radius)
        room = room_at(space, at_x, at_y, at_heading, t + place / speed)
        if room < 0.0:
            return False
        if place >= total:
            return True
        place = min(total, place + max(room, LEAST_STEP) / pace)


@njit(b1(SPACE, f8, f8, f8, i8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def segment_is_free(space, x, y, heading, turn, length, radius, t, speed):
    """Return whether the robot, free at the start of a segment at time t [s], is free all along it."""
    if len(space.body):
        return passes_outline(space, x, y, heading, turn, length, radius, t, speed)
    extent = extent_of(x, y, heading, turn, length, radius)
    room = space.reach[0] - space.reach[2]
    if (extent[0] < space.box[0] + room or extent[1] < space.box[1] + room
            or extent[2] > space.box[2] - room or extent[3] > space.box[3] - room):
        return False
    if not passes_circles(space, x, y, heading, turn, length, radius, t, speed, extent):
        return False
    if not passes_polygons(space, x, y, heading, turn, length, radius, t, speed, extent):
        return False
    return space.cells.size == 0 or passes_cells(space, x, y, heading, turn, length, radius)


@njit(b1(SPACE, f8, f8, f8, TURNS, LENGTHS, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def segments_are_free(space, x, y, heading, turns, lengths, radius, t, speed):
    """Return whether the robot, free at the start of a way at time t [s], is free all along it."""
    for k in range(len(turns)):
        if lengths[k] != 0.0:
            if not segment_is_free(space, x, y, heading, turns[k], lengths[k], radius, t, speed):
                return False
            x, y, heading = advanced(x, y, heading, turns[k], lengths[k], radius)
            t += abs(lengths[k]) / speed
    return True


@njit(b1(SPACE, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def line_is_free(space, x0, y0, x1, y1):
    """Return whether a robot, free at (x0, y0) and headed there, is free all along the line to (x1, y1), at time 0."""
    return segment_is_free(space, x0, y0, np.arctan2(y1 - y0, x1 - x0), 0, np.hypot(x1 - x0, y1 - y0), 1.0, 0.0, 1.0)
