"""Paths with points at equal distances."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput


def resample(path: ArrayLike, spacing: float) -> NDArray[np.float64]:
    """Return points along a path at equal distances, the first and the last point among them.

    Parameters
    ----------
    path : (N, 2) array_like
        At least one point (x, y), in any unit.
    spacing : float
        Above 0, in the unit of the path. The distance between points, measured along the path, is the greatest one
        that is no longer than this and divides the length evenly.

    Returns
    -------
    (K, 2) ndarray
        All on the path. A corner is kept only if a point falls on it, so keep ``spacing`` well below the room there is.

    Raises
    ------
    InvalidInput
        If the path has no point, a number is not finite, or the spacing not above 0.

    Examples
    --------
    >>> resample([(0, 0), (3, 0), (3, 2)], 1.5)
    array([[0.  , 0.  ],
           [1.25, 0.  ],
           [2.5 , 0.  ],
           [3.  , 0.75],
           [3.  , 2.  ]])
    """
    points = np.asarray(path, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or len(points) == 0 or not np.isfinite(points).all():
        raise InvalidInput(f'a path of shape {points.shape} is not one of at least one finite point (x, y)')
    if not (np.isfinite(spacing) and spacing > 0):
        raise InvalidInput(f'spacing {spacing} is not a finite number above 0')
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    if along[-1] == 0.0:
        return points[[0]] if len(points) == 1 else points[[0, -1]]
    places = np.linspace(0.0, along[-1], int(np.ceil(along[-1] / spacing * (1 - 1e-12))) + 1)
    resampled = np.column_stack([np.interp(places, along, points[:, i]) for i in (0, 1)])
    resampled[0], resampled[-1] = points[0], points[-1]
    return resampled
