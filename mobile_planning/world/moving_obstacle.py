"""Obstacles that move in a straight line at constant speed."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import finite_points
from mobile_planning.world.obstacles import Obstacle


@dataclass(frozen=True)
class MovingObstacle:
    """An obstacle on its way.

    Parameters
    ----------
    shape : Obstacle
        What it is and where at time 0.
    velocity : (2,) array_like [m/s]
        Constant.

    Raises
    ------
    InvalidInput
        If the velocity is not a finite pair.

    Examples
    --------
    >>> from mobile_planning.world.obstacles import RoundObstacle
    >>> MovingObstacle(RoundObstacle((0, 0), 1), velocity=(0.5, 0)).distance([(5, 0), (5, 0)], [0, 4])
    array([4., 2.])
    """

    shape: Obstacle
    velocity: tuple[float, float]

    def __post_init__(self):
        velocity = finite_points(self.velocity)
        if velocity.shape != (2,):
            raise InvalidInput(f'velocity has shape {velocity.shape}: it must be one pair (vx, vy)')
        object.__setattr__(self, 'velocity', tuple(velocity.tolist()))

    def distance(self, points: ArrayLike, t: ArrayLike = 0.0) -> NDArray[np.float64]:
        """Return the signed distance [m] (...) from each of ``points`` (..., 2) [m] at the times ``t`` (...) [s]."""
        moved = np.asarray(t, float)[..., None] * np.array(self.velocity)
        return self.shape.distance(finite_points(points) - moved)
