"""Inner loops of the convex pieces: rectangles of cells, buckets of pieces, and lines between curves and pieces.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL.
"""
import numpy as np
from numba import b1, f8, i4, i8, njit, types, u1

# Arrays that are only read may be read-only.
CELLS = types.Array(u1, 2, 'C', readonly=True)
POINTS = types.Array(f8, 2, 'C', readonly=True)
CURVES = types.Array(f8, 3, 'C', readonly=True)
VALUES = types.Array(f8, 1, 'C', readonly=True)
INDICES = types.Array(i8, 1, 'C', readonly=True)
SHORT_INDICES = types.Array(i4, 1, 'C', readonly=True)


@njit(b1(u1[:, ::1], i8, i8, i8, i8), nogil=True, cache=True)
def is_full(cells, x, y, end_x, end_y):
    """Return whether every cell of x..end_x, y..end_y (without the ends) is set."""
    for row in range(y, end_y):
        for column in range(x, end_x):
            if not cells[row, column]:
                return False
    return True


@njit(types.UniTuple(i8, 2)(u1[:, ::1], i8, i8, b1), nogil=True, cache=True)
def grow(cells, x, y, along_x):
    """Return the upper ends (x, y) of a rectangle of set cells from cell (x, y) on, as long as can be one way first."""
    height, width = cells.shape
    end_x, end_y = x + 1, y + 1
    for in_x in (along_x, not along_x):
        if in_x:
            while end_x < width and is_full(cells, end_x, y, end_x + 1, end_y):
                end_x += 1
        else:
            while end_y < height and is_full(cells, x, end_y, end_x, end_y + 1):
                end_y += 1
    return end_x, end_y


@njit(i8[:, ::1](CELLS), nogil=True, cache=True)
def rectangles(occupied):
    """Return disjoint rectangles (R, 4) of cells, x, y and the ends of both, that cover just the occupied cells."""
    height, width = occupied.shape
    left = occupied.copy()
    found, count = np.empty((64, 4), np.int64), 0
    for y in range(height):
        for x in range(width):
            if not left[y, x]:
                continue
            end_x, end_y = grow(left, x, y, True)
            other_x, other_y = grow(left, x, y, False)
            if (other_x - x) * (other_y - y) > (end_x - x) * (end_y - y):
                end_x, end_y = other_x, other_y
            left[y:end_y, x:end_x] = 0
            if count == len(found):
                larger = np.empty((2 * count, 4), np.int64)
                larger[:count] = found
                found = larger
            found[count, 0], found[count, 1], found[count, 2], found[count, 3] = x, y, end_x, end_y
            count += 1
    return found[:count].copy()


@njit(i8(f8, i8), nogil=True, cache=True)
def clipped(place, count):
    """Return the bucket of a place on one axis, that at the border for what lies outside."""
    return np.int64(min(max(place, 0.0), count - 1.0))


@njit(types.UniTuple(i8, 4)(VALUES, f8, i8, i8, f8, f8, f8, f8), nogil=True, cache=True)
def bucket_range(origin, side, columns, rows, x_min, y_min, x_max, y_max):
    """Return the first and last column, the first and last row of the buckets that a box touches."""
    return (clipped((x_min - origin[0]) / side, columns), clipped((x_max - origin[0]) / side, columns),
            clipped((y_min - origin[1]) / side, rows), clipped((y_max - origin[1]) / side, rows))


@njit(types.Tuple((i8[::1], i4[::1]))(POINTS, VALUES, f8, i8, i8), nogil=True, cache=True)
def fill_buckets(boxes, origin, side, columns, rows):
    """Return which boxes (P, 4) touch each bucket: those of bucket b are ``members[starts[b]:starts[b + 1]]``."""
    starts = np.zeros(columns * rows + 1, np.int64)
    for box in boxes:
        first_x, last_x, first_y, last_y = bucket_range(origin, side, columns, rows, box[0], box[1], box[2], box[3])
        for y in range(first_y, last_y + 1):
            for x in range(first_x, last_x + 1):
                starts[y * columns + x + 1] += 1
    for bucket in range(columns * rows):
        starts[bucket + 1] += starts[bucket]
    members, free = np.empty(starts[-1], np.int32), starts[:-1].copy()
    for i in range(len(boxes)):
        box = boxes[i]
        first_x, last_x, first_y, last_y = bucket_range(origin, side, columns, rows, box[0], box[1], box[2], box[3])
        for y in range(first_y, last_y + 1):
            for x in range(first_x, last_x + 1):
                members[free[y * columns + x]] = i
                free[y * columns + x] += 1
    return starts, members


@njit(types.Tuple((i8[::1], i8[::1]))(POINTS, POINTS, POINTS, VALUES, f8, i8, i8, INDICES, SHORT_INDICES), nogil=True,
      cache=True)
def touching(low, high, boxes, origin, side, columns, rows, starts, members):
    """Return the boxes (P, 4) that touch each box from ``low`` to ``high``, as ``found[ends[b]:ends[b + 1]]``."""
    ends, found, count = np.zeros(len(low) + 1, np.int64), np.empty(256, np.int64), 0
    for b in range(len(low)):
        x_min, y_min, x_max, y_max = low[b, 0], low[b, 1], high[b, 0], high[b, 1]
        first_x, last_x, first_y, last_y = bucket_range(origin, side, columns, rows, x_min, y_min, x_max, y_max)
        for y in range(first_y, last_y + 1):
            for x in range(first_x, last_x + 1):
                for k in range(starts[y * columns + x], starts[y * columns + x + 1]):
                    box = boxes[members[k]]
                    if box[0] > x_max or box[2] < x_min or box[1] > y_max or box[3] < y_min:
                        continue
                    # In the lower left one of the buckets that both touch, and in no other.
                    if (x != max(first_x, clipped((box[0] - origin[0]) / side, columns))
                            or y != max(first_y, clipped((box[1] - origin[1]) / side, rows))):
                        continue
                    if count == len(found):
                        larger = np.empty(2 * count, np.int64)
                        larger[:count] = found
                        found = larger
                    found[count] = members[k]
                    count += 1
        ends[b + 1] = count
    return ends, found[:count].copy()


@njit(types.UniTuple(f8, 2)(POINTS, f8, f8), nogil=True, cache=True)
def extent(points, nx, ny):
    """Return the least and the greatest coordinate of points along (nx, ny)."""
    low = high = nx * points[0, 0] + ny * points[0, 1]
    for i in range(1, len(points)):
        value = nx * points[i, 0] + ny * points[i, 1]
        low, high = min(low, value), max(high, value)
    return low, high


@njit(types.UniTuple(f8, 2)(POINTS, POINTS), nogil=True, cache=True)
def separating_normal(curve, piece):
    """Return the unit normal (nx, ny), from the piece to the curve, along which their hulls are furthest apart.

    Along any direction the gap between two convex sets is at most their distance. It is equal along the normal of an
    edge of either, or along the line that joins their nearest vertices. Where they overlap, the gap is negative.
    """
    best, best_x, best_y = -np.inf, 1.0, 0.0
    # The edges of the piece, which runs counter-clockwise: it lies to their left.
    count = len(piece)
    for i in range(count):
        after = i + 1 if i + 1 < count else 0
        nx, ny = piece[after, 1] - piece[i, 1], piece[i, 0] - piece[after, 0]
        length = np.sqrt(nx * nx + ny * ny)
        if length == 0.0:
            continue
        nx, ny = nx / length, ny / length
        low, _ = extent(curve, nx, ny)
        gap = low - (nx * piece[i, 0] + ny * piece[i, 1])
        if gap > best:
            best, best_x, best_y = gap, nx, ny
    # The edges of the curve's hull are among the lines through two of its points.
    for i in range(len(curve)):
        for j in range(i):
            nx, ny = curve[j, 1] - curve[i, 1], curve[i, 0] - curve[j, 0]
            length = np.sqrt(nx * nx + ny * ny)
            if length == 0.0:
                continue
            nx, ny = nx / length, ny / length
            low, high = extent(curve, nx, ny)
            piece_low, piece_high = extent(piece, nx, ny)
            if low - piece_high > best:
                best, best_x, best_y = low - piece_high, nx, ny
            if piece_low - high > best:
                best, best_x, best_y = piece_low - high, -nx, -ny
    nearest, nx, ny = np.inf, 0.0, 0.0
    for i in range(len(curve)):
        for j in range(count):
            dx, dy = curve[i, 0] - piece[j, 0], curve[i, 1] - piece[j, 1]
            if dx * dx + dy * dy < nearest:
                nearest, nx, ny = dx * dx + dy * dy, dx, dy
    if nearest > 0.0:
        length = np.sqrt(nearest)
        nx, ny = nx / length, ny / length
        if extent(curve, nx, ny)[0] - extent(piece, nx, ny)[1] > best:
            return nx, ny
    return best_x, best_y


@njit(types.void(CURVES, INDICES, INDICES, POINTS, INDICES, VALUES, f8[:, ::1], f8[::1], f8[::1]), nogil=True,
      cache=True)
def support_lines(curves, spans, pieces, points, starts, radii, normals, offsets, distances):
    """Set for each pair of a curve and a piece the line that supports the piece, and how far the curve is beyond it."""
    for q in range(len(spans)):
        span, piece = spans[q], pieces[q]
        if not (0 <= span < len(curves) and 0 <= piece < len(radii)):
            raise IndexError('there is no such span or piece')
        curve, vertices = curves[span], points[starts[piece]:starts[piece + 1]]
        nx, ny = separating_normal(curve, vertices)
        normals[q, 0], normals[q, 1] = nx, ny
        # What counts is this normal, not the exact one: the line holds although it was rounded.
        offsets[q] = extent(vertices, nx, ny)[1] + radii[piece]
        distances[q] = extent(curve, nx, ny)[0] - offsets[q]
