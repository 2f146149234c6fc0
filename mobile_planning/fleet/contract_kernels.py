"""Inner loops of the moving-line contracts.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL. Span s of control points uses the points s to s + 3; where that is past the last point, the last one
is taken, for a plan rests at its end.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, void

# Arrays that are only read may be read-only.
POINTS = types.Array(f8, 2, 'C', readonly=True)
NUMBERS, INDICES = types.Array(f8, 1, 'C', readonly=True), types.Array(i8, 1, 'C', readonly=True)
ROWS = f8[:, ::1]


@njit(void(POINTS, i8, ROWS), nogil=True, cache=True)
def write_bezier(points, span, curve):
    """Write the Bezier points of one span into ``curve`` (4, 2)."""
    last = len(points) - 1
    a, b, c, d = min(span, last), min(span + 1, last), min(span + 2, last), min(span + 3, last)
    for axis in range(2):
        p, q, r, s = points[a, axis], points[b, axis], points[c, axis], points[d, axis]
        curve[0, axis] = (p + 4 * q + r) / 6
        curve[1, axis] = (2 * q + r) / 3
        curve[2, axis] = (q + 2 * r) / 3
        curve[3, axis] = (q + 4 * r + s) / 6


@njit(b1(ROWS, f8[::1]), nogil=True, cache=True)
def find_nearest(curve, normal):
    """Write the direction of the hull's nearest point to the origin, of the hull of ``curve`` (4, 2); False at 0.

    That point lies on a segment between two of the four points. If the origin lies inside the hull, the direction is
    one across which no line separates the two.
    """
    least = np.inf
    for i in range(4):
        for j in range(i + 1, 4):
            along_x, along_y = curve[j, 0] - curve[i, 0], curve[j, 1] - curve[i, 1]
            length2 = along_x**2 + along_y**2
            share = 0.0
            if length2 > 0:
                share = min(max(-(curve[i, 0] * along_x + curve[i, 1] * along_y) / length2, 0.0), 1.0)
            x, y = curve[i, 0] + share * along_x, curve[i, 1] + share * along_y
            if x * x + y * y < least:
                least = x * x + y * y
                normal[0], normal[1] = x, y
    length = np.sqrt(least)
    if not length > 1e-9:
        return False
    normal[0] /= length
    normal[1] /= length
    return True


@njit(b1(POINTS, i8, POINTS, i8, f8, f8, f8, ROWS, ROWS), nogil=True, cache=True)
def draw_lines(owner, owner_span, peer, peer_span, owner_radius, peer_radius, tolerance, normals, offsets):
    """Write a contract's lines between two plans, from the given span of each on; False where they are too close."""
    curve, relative = np.empty((4, 2)), np.empty((4, 2))
    radii = owner_radius + peer_radius
    for span in range(len(normals)):
        write_bezier(owner, owner_span + span, relative)
        write_bezier(peer, peer_span + span, curve)
        for k in range(4):
            relative[k, 0] -= curve[k, 0]
            relative[k, 1] -= curve[k, 1]
        normal = normals[span]
        if not find_nearest(relative, normal):
            return False
        for k in range(4):
            distance = normal[0] * relative[k, 0] + normal[1] * relative[k, 1]
            # Written so that a number that is not finite fails too.
            if not distance >= radii - tolerance:
                return False
            place = normal[0] * curve[k, 0] + normal[1] * curve[k, 1]
            offsets[span, k] = place + peer_radius + 0.5 * (distance - radii)
    return True


@njit(void(POINTS, POINTS, i8, ROWS, ROWS), nogil=True, cache=True)
def go_on(normals, offsets, line, later_normals, later_offsets):
    """Write the lines of the spans from ``line`` on; after the last span its line stands still where it ends."""
    last = len(normals) - 1
    for span in range(len(later_normals)):
        at = min(line + span, last)
        later_normals[span, 0], later_normals[span, 1] = normals[at, 0], normals[at, 1]
        for k in range(4):
            later_offsets[span, k] = offsets[at, k] if line + span <= last else offsets[last, 3]


@njit(void(POINTS, POINTS, INDICES, INDICES, NUMBERS, f8, ROWS, ROWS), nogil=True, cache=True)
def write_sides(normals, offsets, ends, lines, sides, radius, later_normals, bounds):
    """Write what many contracts leave a disc of ``radius``: as many spans of each, from its own of ``lines`` on.

    The lines of all are listed in turn; those of each end before its own of ``ends``. ``sides`` are 1 for the owner, -1
    for the peer.
    """
    count, begin = len(later_normals) // len(ends), 0
    for each in range(len(ends)):
        row, end = each * count, ends[each]
        go_on(normals[begin:end], offsets[begin:end], lines[each], later_normals[row:row + count],
              bounds[row:row + count])
        begin = end
        for at in range(row, row + count):
            later_normals[at, 0] *= sides[each]
            later_normals[at, 1] *= sides[each]
            for k in range(4):
                bounds[at, k] = sides[each] * bounds[at, k] + radius


@njit(f8(POINTS, i8, POINTS, POINTS, i8, i8, f8), nogil=True, cache=True)
def least_distance(points, span, normals, offsets, line, count, side):
    """Return the least signed distance [m] of ``count`` spans to their side of the lines, from ``line`` on."""
    curve, least, last = np.empty((4, 2)), np.inf, len(normals) - 1
    for step in range(count):
        write_bezier(points, span + step, curve)
        at = min(line + step, last)
        for k in range(4):
            offset = offsets[at, k] if line + step <= last else offsets[last, 3]
            distance = side * (normals[at, 0] * curve[k, 0] + normals[at, 1] * curve[k, 1] - offset)
            least = min(least, distance)
    return least


@njit(b1(POINTS, POINTS, f8, f8), nogil=True, cache=True)
def are_lines(normals, offsets, tolerance, farthest):
    """Return whether all normals have the length 1, and all offsets are within ``farthest`` [m]."""
    for span in range(len(normals)):
        if not abs(np.hypot(normals[span, 0], normals[span, 1]) - 1) < tolerance:
            return False
        for k in range(4):
            if not abs(offsets[span, k]) <= farthest:
                return False
    return True
