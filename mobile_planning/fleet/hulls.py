"""Hulls: a curve lies in the hull of its Bezier points, and what that proves of all of it. Plain geometry."""
from __future__ import annotations

from collections.abc import Callable
from math import comb

import numpy as np
from numpy.linalg import norm
from numpy.typing import NDArray

#: A curve is halved at most so often.
_HALVINGS = 40
_PRODUCT = np.array([[[comb(2, i) * comb(2, j) / comb(4, k) * (i + j == k) for j in range(3)] for i in range(3)]
                     for k in range(5)])


def unproved(curves: NDArray, bounds: Callable[[NDArray], tuple[NDArray, NDArray]]) -> NDArray[np.intp]:
    """Return for which of the curves it can't be proved that a value stays at or above 0 all along.

    Parameters
    ----------
    curves : (N, n, m) ndarray
        Bezier points.
    bounds : callable
        Returns of parts of curves (M, n, m) what the value is never below (M,), and what it is somewhere (M,); where
        the first is negative and the second not, it is asked again for each half.

    Returns
    -------
    (K,) ndarray of int
        Increasing.

    Examples
    --------
    >>> heights = np.array([[1.0, -0.9, 1.0], [1.0, -1.1, 1.0]])[..., None]  # parabolas, of least height 0.05 and -0.05
    >>> unproved(heights, lambda pieces: (pieces.min(axis=(1, 2)), pieces[:, 0, 0])).tolist()
    [1]
    """
    broken, curve = np.zeros(len(curves), bool), np.arange(len(curves))
    for _ in range(_HALVINGS):
        low, high = bounds(curves)
        # What is no number is no proof.
        broken[curve[~(high >= 0)]] = True
        is_open = ~(low >= 0) & ~broken[curve]
        points, left, right, curve = curves[is_open], [], [], np.tile(curve[is_open], 2)
        if not len(points):
            break
        while points.shape[1]:
            left, right = [*left, points[:, 0]], [points[:, -1], *right]
            points = (points[:, 1:] + points[:, :-1]) / 2
        curves = np.concatenate([np.stack(left, axis=1), np.stack(right, axis=1)])
    broken[curve] = True
    return np.flatnonzero(broken)


def reach(points: NDArray) -> NDArray[np.float64]:
    """Return how far (N,) all of the points (N, n, 2) are along their mean: so far at least their hull keeps from 0.

    Examples
    --------
    >>> reach(np.array([[[3.0, 4.0], [3.0, 4.0]], [[1.0, -1.0], [1.0, 1.0]], [[1.0, 0.0], [-3.0, 0.0]]])).tolist()
    [5.0, 1.0, -1.0]
    """
    mean = points.mean(axis=1)
    return np.einsum('nkd,nd->nk', points, mean).min(axis=1) / np.maximum(norm(mean, axis=1), 1e-300)


def product(a: NDArray, b: NDArray) -> NDArray[np.float64]:
    """Return the Bernstein coefficients (N, 5) of the products of quadratics with the coefficients (N, 3) each.

    Examples
    --------
    >>> product(np.array([[0.0, 0.5, 1.0]]), np.array([[1.0, 1.0, 1.0]])).tolist()
    [[0.0, 0.25, 0.5, 0.75, 1.0]]
    """
    return np.einsum('kij,ni,nj->nk', _PRODUCT, a, b)
