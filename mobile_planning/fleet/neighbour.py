"""Neighbour: another robot as heard, as far as guidance cares."""
from __future__ import annotations

from typing import NamedTuple

from numpy.typing import ArrayLike


class Neighbour(NamedTuple):
    """Another robot as heard.

    Parameters
    ----------
    position : (2,) array_like [m]
        At the first knot that a new section changes.
    end : (2,) array_like [m]
        Where its plan ends.
    goal : (2,) array_like [m]
    radius : float [m]
    is_parked : bool
        It stands at its goal, or for ever.
    velocity : (2,) array_like [m/s]
        There.
    v_max : float [m/s]
    """

    position: ArrayLike
    end: ArrayLike
    goal: ArrayLike
    radius: float
    is_parked: bool = False
    velocity: ArrayLike = (0.0, 0.0)
    v_max: float = 1.0
