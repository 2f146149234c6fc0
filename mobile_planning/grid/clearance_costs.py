"""Cell costs that keep a path away from walls."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.world.cost_to_go import as_mask


def clearance_costs(occupied: ArrayLike, radius: float, *, weight: float = 4.0) -> NDArray[np.float64]:
    """Return the cost of each cell: 1 in the open, more near obstacles, inf on them.

    A free cell whose centre is ``d`` from the centre of the nearest occupied cell costs
    ``1 + weight * (1 - d / radius) ** 2`` up to ``d = radius``, and 1 beyond. The costs suit `astar` and
    `DstarPlanner`.

    Parameters
    ----------
    occupied : (h, w) array_like of bool
        Nonzero where a robot must not enter.
    radius : float [cells]
        Above 0: as far as a wall is felt.
    weight : float
        At least 0: how much dearer a cell is that nearly touches a wall. A path takes a detour of at most that many
        steps around a step beside a wall.

    Returns
    -------
    (h, w) ndarray

    Raises
    ------
    InvalidInput
        If a number is not finite or out of its range.

    Examples
    --------
    >>> clearance_costs([[1, 0, 0, 0, 0]], radius=4, weight=16)
    array([[inf, 10.,  5.,  2.,  1.]])
    """
    from scipy.ndimage import distance_transform_edt

    if not (np.isfinite(radius) and radius > 0):
        raise InvalidInput(f'radius {radius} cells is not a finite number above 0')
    if not (np.isfinite(weight) and weight >= 0):
        raise InvalidInput(f'weight {weight} is not a finite number of at least 0')
    walls = as_mask(occupied).view(bool)
    if not walls.any():
        return np.ones(walls.shape)
    nearness = np.maximum(0.0, 1.0 - distance_transform_edt(~walls) / radius)
    return np.where(walls, np.inf, 1.0 + weight * nearness ** 2)
