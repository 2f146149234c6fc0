"""The nearest cell of those that are wanted: in a straight line, or by the way that leads there."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.stop_flag import StopFlag
from mobile_planning.world.cost_to_go import cost_to_go, descend


def nearest(wanted: NDArray[np.bool_], point: NDArray[np.float64]) -> tuple[NDArray[np.int64], float] | None:
    """Return the wanted cell (2,) whose centre is nearest to a point of the grid frame, and its distance [cells].

    The window around the point grows until no cell outside it can be nearer. None if no cell is wanted.
    """
    x, y = np.floor(point).astype(int)
    reach = 8
    while True:
        left, bottom = max(0, x - reach), max(0, y - reach)
        window = wanted[bottom:y + reach + 1, left:x + reach + 1]
        cells = np.argwhere(window)[:, ::-1] + (left, bottom)
        distances = np.hypot(*(cells + 0.5 - point).T)
        # Anything outside the window lies more than `reach` away in x or in y.
        if len(cells) and (distances.min() <= reach or window.size == wanted.size):
            return cells[distances.argmin()], float(distances.min())
        if window.size == wanted.size:
            return None
        reach *= 2


def shortest_way(obstacles: NDArray[np.bool_], cell: NDArray[np.int64], wanted: NDArray[np.bool_],
                 corner_cutting: bool, flag: StopFlag) -> NDArray[np.int64] | None:
    """Return the shortest path (N, 2) around obstacles from a cell to a wanted one, None if there is none.

    The window around the cell grows until no path that leaves it can be shorter.

    Parameters
    ----------
    obstacles : (h, w) ndarray of bool
    cell : (2,) ndarray of int
        Without an obstacle.
    wanted : (h, w) ndarray of bool
    corner_cutting : bool
    flag : StopFlag
    """
    reach = 16
    while True:
        left, bottom = np.maximum(cell - reach, 0)
        window = np.s_[bottom:cell[1] + reach + 1, left:cell[0] + reach + 1]
        here = cell - (left, bottom)
        field = cost_to_go(obstacles[window], here, corner_cutting=corner_cutting, stop=flag.array)
        lengths = np.where(wanted[window] & np.isfinite(field), field, np.inf)
        y, x = np.unravel_index(lengths.argmin(), lengths.shape)
        # A path that leaves the window is longer than `reach`.
        if lengths[y, x] <= reach or (field.size == wanted.size and lengths[y, x] < np.inf):
            # The field leads from the cell found back to where it began.
            return descend(field, (x, y), here, corner_cutting=corner_cutting)[::-1] + (left, bottom)
        if field.size == wanted.size:
            return None
        reach *= 2
