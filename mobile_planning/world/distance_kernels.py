"""Exact distances from points and segments to the polygons, the occupied squares and the boundary of a space.

Kernels that take a space allocate nothing and count no references (``_nrt``): to count those of its twelve arrays costs
0.3 us a call, as much as the whole check of a pose.
"""
import numpy as np
from numba import b1, f8, i4, i8, njit, types, u1

from mobile_planning.world.collision_space import CollisionSpace

ROWS = f8[:, ::1]
SPACE = types.NamedTuple(
    (f8[::1], ROWS, ROWS, i8[::1], i8[::1], ROWS, ROWS, u1[:, ::1], i4[::1], f8[::1], ROWS, f8[::1]), CollisionSpace)
POINT = types.UniTuple(f8, 2)


@njit(f8(f8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def squared_to_segment(x, y, ax, ay, bx, by):
    """Return the squared distance from a point to the segment from a to b."""
    ex, ey, px, py = bx - ax, by - ay, x - ax, y - ay
    length2 = ex * ex + ey * ey
    share = 0.0
    if length2 > 0.0:
        share = min(max((px * ex + py * ey) / length2, 0.0), 1.0)
    dx, dy = px - share * ex, py - share * ey
    return dx * dx + dy * dy


@njit(b1(f8, f8, f8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def cross(ax, ay, bx, by, cx, cy, dx, dy):
    """Return whether the segments ab and cd cross, each within the other."""
    c_side = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    d_side = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    if (c_side > 0.0) == (d_side > 0.0):
        return False
    a_side = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    b_side = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return (a_side > 0.0) != (b_side > 0.0)


@njit(f8(f8, f8, f8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def squared_between(ax, ay, bx, by, cx, cy, dx, dy):
    """Return the squared distance between the segments ab and cd."""
    if cross(ax, ay, bx, by, cx, cy, dx, dy):
        return 0.0
    return min(squared_to_segment(ax, ay, cx, cy, dx, dy), squared_to_segment(bx, by, cx, cy, dx, dy),
               squared_to_segment(cx, cy, ax, ay, bx, by), squared_to_segment(dx, dy, ax, ay, bx, by))


@njit(f8(ROWS, i8, f8, f8), nogil=True, cache=True, _nrt=False)
def squared_to_box(boxes, k, x, y):
    """Return the squared distance from a point to a block's bounding box."""
    dx = max(boxes[k, 0] - x, x - boxes[k, 2], 0.0)
    dy = max(boxes[k, 1] - y, y - boxes[k, 3], 0.0)
    return dx * dx + dy * dy


@njit(f8(SPACE, i8, f8, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def squared_to_block(space, block, x, y, least):
    """Return the squared distance from a point to the nearest edge of a block, or ``least`` if that is less."""
    for k in range(space.first[block], space.first[block + 1]):
        least = min(least, squared_to_segment(
            x, y, space.edges[k, 0], space.edges[k, 1], space.edges[k, 2], space.edges[k, 3]))
    return least


@njit(b1(SPACE, i8, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def is_inside(space, group, x, y):
    """Return whether a point lies inside the polygons of a group: the ray to +x crosses an odd number of edges.

    The ends are compared as they are, so that both edges at a vertex agree on its side to the last bit.
    """
    inside = False
    for block in range(space.groups[group], space.groups[group + 1]):
        if y < space.blocks[block, 1] or y > space.blocks[block, 3] or x > space.blocks[block, 2]:
            continue
        for k in range(space.first[block], space.first[block + 1]):
            ax, ay, bx, by = space.edges[k, 0], space.edges[k, 1], space.edges[k, 2], space.edges[k, 3]
            if (ay > y) != (by > y) and (((bx - ax) * (y - ay) > (by - ay) * (x - ax)) == (by > y)):
                inside = not inside
    return inside


@njit(f8(SPACE, i8, f8, f8), nogil=True, cache=True, _nrt=False, forceinline=True)
def to_group(space, group, x, y):
    """Return the signed distance [m] from a point to the polygons of a group, in the group's frame."""
    least = np.inf
    for block in range(space.groups[group], space.groups[group + 1]):
        if squared_to_box(space.blocks, block, x, y) < least:
            least = squared_to_block(space, block, x, y, least)
    distance = np.sqrt(least)
    return -distance if is_inside(space, group, x, y) else distance


@njit(f8(f8[::1], f8, f8), nogil=True, cache=True, _nrt=False)
def depth_in(box, x, y):
    """Return the distance from a point to the border of a box, negative outside."""
    dx, dy = min(x - box[0], box[2] - x), min(y - box[1], box[3] - y)
    if dx >= 0.0 and dy >= 0.0:
        return min(dx, dy)
    return -np.hypot(min(dx, 0.0), min(dy, 0.0))


@njit(POINT(SPACE, f8, f8), nogil=True, cache=True, _nrt=False)
def in_cells(space, x, y):
    """Return the place of a point in the grid, in cells."""
    dx, dy = x - space.frame[0], y - space.frame[1]
    cos, sin, resolution = space.frame[2], space.frame[3], space.frame[4]
    return (cos * dx + sin * dy) / resolution, (cos * dy - sin * dx) / resolution


@njit(f8(SPACE, f8, f8), nogil=True, cache=True, _nrt=False)
def field_bound(space, px, py):
    """Return a lower bound [cells] of the distance from a place inside the grid to the nearest occupied square.

    `Environment._grid_clearance` tells why it is one.
    """
    if len(space.field) == 0:
        return np.inf
    height, width = space.cells.shape
    i, j = min(int(px), width - 1), min(int(py), height - 1)
    tx, ty = px - i, py - j
    k = j * (width + 1) + i
    low = (1 - tx) * space.field[k] + tx * space.field[k + 1]
    k += width + 1
    high = (1 - tx) * space.field[k] + tx * space.field[k + 1]
    return np.sqrt(max((1 - ty) * low + ty * high - tx * (1 - tx) - ty * (1 - ty), 0.0))


@njit(f8(SPACE, f8, f8, i8, u1), nogil=True, cache=True, _nrt=False)
def to_squares(space, px, py, window, kind):
    """Return the distance [cells] to the nearest cell of a kind, occupied 1 or free 0, within ``window`` cells.

    If there is none in the window, the distance to its border.
    """
    height, width = space.cells.shape
    i, j = min(int(px), width - 1), min(int(py), height - 1)
    least = np.inf
    for row in range(max(j - window, 0), min(j + window + 1, height)):
        for column in range(max(i - window, 0), min(i + window + 1, width)):
            if space.cells[row, column] == kind:
                dx = max(column - px, px - column - 1, 0.0)
                dy = max(row - py, py - row - 1, 0.0)
                least = min(least, dx * dx + dy * dy)
    border = min(px - i, i + 1 - px, py - j, j + 1 - py) + window
    return min(np.sqrt(least), border)


@njit(f8(SPACE, f8, f8), nogil=True, cache=True, _nrt=False)
def to_grid(space, x, y):
    """Return how far [m] a point is from occupied squares and the grid's edge; minus its depth within them.

    Further away than the robot's radius and two cells it is a lower bound, nearer it is exact; a depth is at most
    that of the middle cell of three by three.
    """
    height, width = space.cells.shape
    px, py = in_cells(space, x, y)
    edge = min(px, width - px, py, height - py)
    if edge < 0.0:
        return edge * space.frame[4]
    i, j = min(int(px), width - 1), min(int(py), height - 1)
    if space.cells[j, i]:
        return -to_squares(space, px, py, 1, 0) * space.frame[4]
    bound = field_bound(space, px, py)
    window = int(np.ceil(space.reach[0] / space.frame[4])) + 1
    if bound < window:
        bound = max(bound, to_squares(space, px, py, window, 1))
    return min(edge, bound) * space.frame[4]
