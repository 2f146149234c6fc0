"""How much room a robot has whose footprint is an outline, turned with its heading.

The outline is a little smaller than the robot (see `Footprint.shrunk`), so that one that touches an obstacle still has
room, and one that overlaps has none: its room is minus infinity.
"""
import numpy as np
from numba import f8, i8, njit

from mobile_planning.world.distance_kernels import (
    SPACE, depth_in, field_bound, in_cells, is_inside, squared_between, squared_to_box, squared_to_segment)


@njit(f8(SPACE, f8, f8), nogil=True, cache=True, _nrt=False)
def to_body(space, x, y):
    """Return the signed distance [m] from a point to the robot's outline, in the robot's frame."""
    least, inside, last = np.inf, False, len(space.body) - 1
    for k in range(len(space.body)):
        ax, ay, bx, by = space.body[last, 0], space.body[last, 1], space.body[k, 0], space.body[k, 1]
        least = min(least, squared_to_segment(x, y, ax, ay, bx, by))
        if (ay > y) != (by > y) and (((bx - ax) * (y - ay) > (by - ay) * (x - ax)) == (by > y)):
            inside = not inside
        last = k
    return -np.sqrt(least) if inside else np.sqrt(least)


@njit(f8(SPACE, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def body_to_segment(space, ax, ay, bx, by):
    """Return the squared distance between the robot's outline and a segment, in the robot's frame; 0 if they meet."""
    least, last = np.inf, len(space.body) - 1
    for k in range(len(space.body)):
        least = min(least, squared_between(
            ax, ay, bx, by, space.body[last, 0], space.body[last, 1], space.body[k, 0], space.body[k, 1]))
        last = k
    return least


@njit(f8(SPACE, i8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def outline_to_group(space, group, x, y, cos, sin, room):
    """Return the lesser of ``room`` and the outline's distance to a group, in its frame; minus infinity if it overlaps.

    Without a crossing of edges the robot lies in a polygon, or a polygon in it, if one point of each outline does.
    """
    reach = space.reach[1]
    for block in range(space.groups[group], space.groups[group + 1]):
        if squared_to_box(space.blocks, block, x, y) >= (room + reach) ** 2:
            continue
        for k in range(space.first[block], space.first[block + 1]):
            ax, ay = space.edges[k, 0] - x, space.edges[k, 1] - y
            bx, by = space.edges[k, 2] - x, space.edges[k, 3] - y
            if squared_to_segment(0.0, 0.0, ax, ay, bx, by) >= (room + reach) ** 2:
                continue
            ax, ay, bx, by = cos * ax + sin * ay, cos * ay - sin * ax, cos * bx + sin * by, cos * by - sin * bx
            if to_body(space, ax, ay) <= 0.0:
                return -np.inf
            room = min(room, np.sqrt(body_to_segment(space, ax, ay, bx, by)))
            if room == 0.0:
                return -np.inf
    bx, by = space.body[0, 0], space.body[0, 1]
    if is_inside(space, group, x + cos * bx - sin * by, y + sin * bx + cos * by):
        return -np.inf
    return room


@njit(f8(SPACE, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def square_to_body(space, column, row, ux, uy):
    """Return the squared distance between the outline and a cell, whose middle is outside it; 0 if they overlap.

    ``column`` and ``row`` are the cell's corner relative to the robot, in cells; (ux, uy) is the columns' direction
    in the robot's frame.
    """
    least, resolution = np.inf, space.frame[4]
    for side in range(4):
        ax, ay = column + (side == 1 or side == 2), row + (side >= 2)
        bx, by = column + (side == 0 or side == 1), row + (side == 1 or side == 2)
        ax, ay, bx, by = ax * resolution, ay * resolution, bx * resolution, by * resolution
        ax, ay, bx, by = ux * ax - uy * ay, uy * ax + ux * ay, ux * bx - uy * by, uy * bx + ux * by
        least = min(least, body_to_segment(space, ax, ay, bx, by))
    x, y = ux * space.body[0, 0] + uy * space.body[0, 1], ux * space.body[0, 1] - uy * space.body[0, 0]
    x, y = x / resolution - column, y / resolution - row
    if 0.0 <= x <= 1.0 and 0.0 <= y <= 1.0:
        return 0.0
    return least


@njit(f8(SPACE, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def outline_to_grid(space, x, y, cos, sin, room):
    """Return the lesser of ``room`` and the outline's distance to the occupied squares; minus infinity if it overlaps.

    Squares are looked at as far as the outline reaches and a cell more.
    """
    height, width = space.cells.shape
    resolution, reach = space.frame[4], space.reach[1]
    px, py = in_cells(space, x, y)
    edge = np.inf
    for k in range(len(space.body)):
        bx, by = space.body[k, 0], space.body[k, 1]
        qx, qy = in_cells(space, x + cos * bx - sin * by, y + sin * bx + cos * by)
        edge = min(edge, qx, width - qx, qy, height - qy)
    if edge < 0.0:
        return -np.inf
    room = min(room, edge * resolution)
    inside_x, inside_y = min(max(px, 0.0), float(width)), min(max(py, 0.0), float(height))
    bound = field_bound(space, inside_x, inside_y) * resolution - np.hypot(px - inside_x, py - inside_y) * resolution
    if bound - reach > resolution:
        return min(room, bound - reach)
    room = min(room, resolution)
    # Cell axes seen from the robot.
    ux, uy = cos * space.frame[2] + sin * space.frame[3], cos * space.frame[3] - sin * space.frame[2]
    window = reach / resolution + 1.0
    for row in range(max(int(py - window), 0), min(int(py + window) + 1, height)):
        for column in range(max(int(px - window), 0), min(int(px + window) + 1, width)):
            if not space.cells[row, column]:
                continue
            ax, ay = (column + 0.5 - px) * resolution, (row + 0.5 - py) * resolution
            middle = to_body(space, ux * ax - uy * ay, uy * ax + ux * ay)
            if middle <= 0.0:
                return -np.inf
            if middle - 0.7072 * resolution >= room:
                continue
            room = min(room, np.sqrt(square_to_body(space, column - px, row - py, ux, uy)))
            if room == 0.0:
                return -np.inf
    return room


@njit(f8(SPACE, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def outline_room(space, x, y, heading, t):
    """Return the room [m] of the robot's outline at a pose and time [s], minus infinity where it overlaps."""
    cos, sin = np.cos(heading), np.sin(heading)
    room = np.inf
    for k in range(len(space.body)):
        bx, by = space.body[k, 0], space.body[k, 1]
        room = min(room, depth_in(space.box, x + cos * bx - sin * by, y + sin * bx + cos * by))
    for k in range(len(space.circles)):
        dx = space.circles[k, 0] + t * space.circles[k, 3] - x
        dy = space.circles[k, 1] + t * space.circles[k, 4] - y
        room = min(room, to_body(space, cos * dx + sin * dy, cos * dy - sin * dx) - space.circles[k, 2])
    if room <= 0.0:
        return -np.inf
    for group in range(len(space.velocities)):
        room = outline_to_group(space, group, x - t * space.velocities[group, 0],
                                y - t * space.velocities[group, 1], cos, sin, room)
        if room <= 0.0:
            return -np.inf
    if space.cells.size:
        room = outline_to_grid(space, x, y, cos, sin, room)
    return room
