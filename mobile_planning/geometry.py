"""Angles and distances in the plane."""
import numpy as np
from numpy.typing import ArrayLike, NDArray


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
    return np.pi - np.mod(np.pi - np.asarray(angle, dtype=float), 2 * np.pi)


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
