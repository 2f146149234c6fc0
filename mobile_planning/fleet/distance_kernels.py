"""Inner loops over segments: how far points are from them.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported. They
do not hold the GIL.
"""
import numpy as np
from numba import f8, njit, types

POINTS = types.Array(f8, 2, 'C', readonly=True)


@njit(f8(f8, f8, f8, f8, f8, f8), nogil=True, cache=True)
def squared_to_segment(x, y, ax, ay, bx, by):
    """Return the squared distance of the point (x, y) to the segment from a to b."""
    dx, dy = bx - ax, by - ay
    squared = dx * dx + dy * dy
    share = 0.0
    if squared > 0.0:
        share = min(1.0, max(0.0, ((x - ax) * dx + (y - ay) * dy) / squared))
    ex, ey = x - ax - share * dx, y - ay - share * dy
    return ex * ex + ey * ey


@njit(f8[:, ::1](POINTS, POINTS, POINTS), nogil=True, cache=True)
def to_segments(a, b, points):
    """Return the distance of each segment from ``a`` to ``b`` (K, 2) to each of ``points`` (M, 2): (K, M)."""
    found = np.empty((len(a), len(points)))
    for k in range(len(a)):
        for m in range(len(points)):
            found[k, m] = np.sqrt(squared_to_segment(points[m, 0], points[m, 1], a[k, 0], a[k, 1], b[k, 0], b[k, 1]))
    return found
