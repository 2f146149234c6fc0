"""The rectangle that robots stay in."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import depth_in_box, finite_points


class Boundary:
    """A rectangle that robots stay in.

    Parameters
    ----------
    x, y : (2,) array_like [m]
        Least and greatest coordinate.

    Attributes
    ----------
    x_min, x_max, y_min, y_max : float [m]

    Raises
    ------
    InvalidInput
        If a bound is not finite or the least is not below the greatest.

    Examples
    --------
    >>> Boundary((0, 10), (0, 5)).distance([(1, 2), (-1, 2)])
    array([ 1., -1.])
    """

    def __init__(self, x: ArrayLike, y: ArrayLike):
        self.x_min, self.x_max = _bounds(x, 'x')
        self.y_min, self.y_max = _bounds(y, 'y')

    def __repr__(self) -> str:
        return f'Boundary(({self.x_min:g}, {self.x_max:g}), ({self.y_min:g}, {self.y_max:g}))'

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the distance from each point to the boundary, positive inside.

        Parameters
        ----------
        points : (..., 2) array_like [m]

        Returns
        -------
        (...) ndarray [m]
        """
        return depth_in_box(finite_points(points), (self.x_min, self.y_min), (self.x_max, self.y_max))


def _bounds(pair: ArrayLike, name: str) -> tuple[float, float]:
    """Return least and greatest coordinate of a boundary."""
    try:
        low, high = (float(value) for value in pair)
    except (TypeError, ValueError):
        raise InvalidInput(f'boundary {name} {pair!r} is not a pair of numbers') from None
    if not -np.inf < low < high < np.inf:
        raise InvalidInput(f'boundary {name} ({low}, {high}) is not a finite pair with the least first')
    return low, high
