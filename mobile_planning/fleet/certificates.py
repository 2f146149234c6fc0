"""Proofs between samples that a plan keeps clear of the static world and of other plans.

Both are sufficient: what passes is clear at every instant, by the convex hulls
of Bezier points. The control points may have leading axes, one plan each.
"""
import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import bezier, split
from mobile_planning.world.environment import Environment


def keeps_clear(points: NDArray, radius: float, environment: Environment, pieces: int = 8) -> NDArray[np.bool_]:
    """Return whether a disc driven along each plan stays off the static world.

    Each of the ``pieces`` parts of a span lies in the ball about its own middle
    that holds its Bezier points; the clearance of the middle must exceed the
    ball's and the disc's radius.

    Parameters
    ----------
    points : (..., n, 2) ndarray [m]
        Control points.
    radius : float [m]
    environment : Environment
    """
    curves = split(bezier(points), pieces)
    middle = curves[..., 1:3, :].mean(axis=-2)
    ball = np.linalg.norm(curves - middle[..., None, :], axis=-1).max(axis=-1)
    return (environment.clearance(middle) >= radius + ball).all(axis=-1)


def keeps_apart(points: NDArray, others: NDArray, distance: float) -> NDArray[np.bool_]:
    """Return whether two plans on the same knots stay ``distance`` apart, for each pair.

    On each span the relative Bezier points must lie beyond one line at
    ``distance`` from the origin; lines across the relative position at five
    instants of the span are tried.

    Parameters
    ----------
    points, others : (..., n, 2) ndarray [m]
        Control points from the same knot on; leading axes broadcast.
    distance : float or ndarray [m]
        Broadcasts with the leading axes.
    """
    relative = bezier(points - others)
    along = np.concatenate([relative, relative.mean(axis=-2, keepdims=True)], axis=-2)
    length = np.linalg.norm(along, axis=-1, keepdims=True)
    normals = along / np.maximum(length, 1e-12)
    margins = np.einsum('...id,...jd->...ij', normals, relative).min(axis=-1).max(axis=-1)
    return (margins >= np.asarray(distance)[..., None]).all(axis=-1)
