"""Updates of the costs of cells, checked before any of them counts."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput, LimitExceeded

# Cells in one update.
MAX_UPDATES = 1_000_000


def checked_update(cells: ArrayLike, costs: ArrayLike, shape: tuple[int, int]) -> NDArray[np.float64]:
    """Return an update as rows (N, 3) of x, y and cost, of a cell named twice the last one.

    Parameters
    ----------
    cells : (N, 2) array_like of int
        Cells (x, y).
    costs : (N,) array_like
        Above 0; inf for blocked.
    shape : (h, w) of int
        Of the map.

    Raises
    ------
    InvalidInput
        If a cell is not of the map or a cost not above 0, or there are not as many of both.
    LimitExceeded
        If there are too many.

    Examples
    --------
    >>> checked_update([(2, 0), (1, 1), (2, 0)], [5, np.inf, 3], (2, 3))
    array([[ 2.,  0.,  3.],
           [ 1.,  1., inf]])
    """
    try:
        places, costs = np.asarray(cells, float), np.asarray(costs, float)
    except (TypeError, ValueError):
        raise InvalidInput('an update is not of numbers: cells (N, 2) and costs (N,)') from None
    places = places.reshape(0, 2) if places.size == 0 else places
    if costs.ndim != 1 or places.shape != (len(costs), 2):
        raise InvalidInput(f'an update of cells {places.shape} and costs {costs.shape} is not (N, 2) and (N,)')
    if len(costs) > MAX_UPDATES:
        raise LimitExceeded(f'an update of {len(costs)} cells: the limit is {MAX_UPDATES}')
    size = shape[::-1]
    wrong = ~((places >= 0) & (places < size) & (places == np.floor(places))).all(axis=1)
    if wrong.any():
        raise InvalidInput('cell ({:g}, {:g}) of an update is not a cell of the map of {} x {} cells'.format(
            *places[wrong.argmax()], *size))
    wrong = ~(costs > 0)
    if wrong.any():
        i = wrong.argmax()
        raise InvalidInput('cost {} of cell ({:g}, {:g}) is not above 0; a blocked cell costs inf'.format(
            costs[i], *places[i]))
    _, last = np.unique((places @ (1, size[0]))[::-1], return_index=True)
    return np.column_stack([places, costs])[::-1][last]
