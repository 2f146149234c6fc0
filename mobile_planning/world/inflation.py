"""Growing obstacles by the radius of a robot, as a whole or only where something changed."""
from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from mobile_planning.world.row_blocks import row_blocks

# 0.3 m is three cells of 0.1 m although 0.3 / 0.1 < 3 in floating point.
_SLACK = 1 + 1e-9
# The least side of the squares that are grown anew [cells].
_TILE = 64


def grown(cells: NDArray[np.bool_], radius: float, stop: NDArray[np.uint8] | None = None) -> NDArray[np.bool_]:
    """Return which cells have their centre at most a radius from the centre of a given one.

    Distances are exact.

    Parameters
    ----------
    cells : (h, w) ndarray of bool
    radius : float [cells]
    stop : (1,) ndarray of uint8, optional
        Set ``stop[0]`` from another thread to end it with Cancelled.

    Returns
    -------
    (h, w) ndarray of bool

    Examples
    --------
    >>> grown(np.array([[False, False, False], [False, False, True]]), 1.0).astype(int)
    array([[0, 0, 1],
           [0, 1, 1]])
    """
    if radius == 0 or not cells.any():
        return cells.copy()
    # Rows farther away than that decide nothing, and a distance map of all rows would need 20 bytes a cell.
    reach, result = ceil(min(radius, len(cells)) * _SLACK), np.empty_like(cells)
    for rows in row_blocks(cells.shape, stop, least=4 * reach):
        low = max(0, rows.start - reach)
        near = _near(cells[low:rows.stop + reach], radius)
        result[rows] = near[rows.start - low:rows.stop - low]
    return result


def regrown(before: NDArray[np.bool_], cells: NDArray[np.bool_], radius: float,
            changed: NDArray[np.int64]) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Return what `grown` returns after some cells changed; nothing far from them is looked at.

    Parameters
    ----------
    before : (h, w) ndarray of bool
        What it returned before the change.
    cells : (h, w) ndarray of bool
        As they are now.
    radius : float [cells]
    changed : (N, 2) ndarray of int
        Cells (x, y) that changed.

    Returns
    -------
    after : (h, w) ndarray of bool
    differing : (M, 2) ndarray of int
        Cells (x, y) in which it differs from ``before``.
    """
    x, y = changed.T
    after = before.copy()
    if radius == 0:
        after[y, x] = cells[y, x]
        return after, changed
    reach = ceil(radius * _SLACK)
    # Large enough that the margins around the squares do not outweigh them.
    side = max(_TILE, 4 * reach)
    columns = -(-cells.shape[1] // side)
    differing = [np.empty((0, 2), np.int64)]
    for tile in np.unique(y // side * columns + x // side).tolist():
        row, column = divmod(tile, columns)
        # A change reaches one margin beyond its square, and what decides there lies within another.
        (bottom, top), (left, right) = ((max(0, i * side - reach), (i + 1) * side + reach) for i in (row, column))
        low, first = max(0, bottom - reach), max(0, left - reach)
        around = grown(cells[low:top + reach, first:right + reach], radius)
        here, now = after[bottom:top, left:right], around[bottom - low:top - low, left - first:right - first]
        differing.append(np.argwhere(here != now)[:, ::-1] + (left, bottom))
        here[:] = now
    return after, np.concatenate(differing)


def _near(cells, radius):
    """Return which cells are within a radius of a given one."""
    from scipy.ndimage import distance_transform_edt

    return distance_transform_edt(~cells) <= radius * _SLACK if cells.any() else cells
