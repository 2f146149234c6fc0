"""Angles and distances in the plane."""
from math import pi, tau

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput


def wrap_angle(angle: ArrayLike) -> NDArray[np.float64]:
    """Return the angle in (-pi, pi].

    Parameters
    ----------
    angle : array_like [rad]

    Returns
    -------
    ndarray or float [rad], of the shape of ``angle``

    Examples
    --------
    >>> float(wrap_angle(3 * np.pi)) == np.pi
    True
    """
    # One remainder of a tiny negative number is 2 pi itself, by rounding; the second makes it 0.
    return np.pi - np.mod(np.mod(np.pi - np.asarray(angle, dtype=float), 2 * np.pi), 2 * np.pi)


def wrap_number(angle: float) -> float:
    """Return one angle in (-pi, pi] [rad], as `wrap_angle` does, in a fraction of the time.

    Examples
    --------
    >>> wrap_number(3 * np.pi) == np.pi
    True
    """
    return pi - (pi - angle) % tau % tau


def point_to_segment(points: ArrayLike, a: ArrayLike, b: ArrayLike) -> NDArray[np.float64]:
    """Return the distance from each point to the segment ``ab``.

    Parameters
    ----------
    points : (..., 2) array_like [m]
    a, b : (2,) array_like [m]
        Ends of the segment; they may coincide.

    Returns
    -------
    (...) ndarray [m]

    Examples
    --------
    >>> point_to_segment([[0, 1], [3, 0]], (0, 0), (2, 0))
    array([1., 1.])
    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    along, offset = b - a, np.asarray(points, float) - a
    length2 = along @ along
    share = np.clip(offset @ along / length2, 0.0, 1.0) if length2 > 0 else np.zeros(offset.shape[:-1])
    return np.linalg.norm(offset - share[..., None] * along, axis=-1)


def finite_points(points: ArrayLike) -> NDArray[np.float64]:
    """Return the points as an array, if each is a finite pair.

    Parameters
    ----------
    points : (..., 2) array_like

    Returns
    -------
    (..., 2) ndarray

    Raises
    ------
    InvalidInput
        If the last axis is not (x, y) or a coordinate is not finite.
    """
    try:
        points = np.asarray(points, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{points!r} is not an array of points (x, y)') from None
    if points.ndim == 0 or points.shape[-1] != 2:
        raise InvalidInput(f'points of shape {points.shape}: the last axis must be (x, y)')
    if not np.isfinite(points).all():
        bad = points[~np.isfinite(points).all(axis=-1)].reshape(-1, 2)[0]
        raise InvalidInput(f'point ({bad[0]}, {bad[1]}) has a coordinate that is not finite')
    return points


def depth_in_box(points: ArrayLike, low: ArrayLike, high: ArrayLike) -> NDArray[np.float64]:
    """Return how deep each point lies in an axis-aligned box.

    Parameters
    ----------
    points : (..., 2) array_like [m]
    low, high : (2,) array_like [m]
        Lower left and upper right corner.

    Returns
    -------
    (...) ndarray [m]
        Distance to the box's border, negative outside.

    Examples
    --------
    >>> depth_in_box([[1, 1], [-3, -4]], (0, 0), (10, 4))
    array([ 1., -5.])
    """
    points = np.asarray(points, float)
    margin = np.minimum(points - low, np.asarray(high) - points)
    inside = margin.min(axis=-1)
    outside = np.minimum(margin, 0.0)
    return np.where(inside >= 0, inside, -np.hypot(outside[..., 0], outside[..., 1]))
