"""What joins two poses in a tree."""
from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot

from numpy.typing import ArrayLike

from mobile_planning.sampling.curve import Curve, pose_of
from mobile_planning.sampling.dubins import dubins_options, dubins_shortest
from mobile_planning.sampling.reeds_shepp import reeds_shepp_options, reeds_shepp_shortest
from mobile_planning.sampling.steering import Steering


@dataclass(frozen=True)
class LocalPlanner:
    """Dubins or Reeds-Shepp paths of one turning radius; straight lines if it is 0.

    Parameters
    ----------
    radius : float [m]
    steering : Steering

    Examples
    --------
    >>> LocalPlanner(4.0).shortest((0, 0, 0), (10, 0, 0)).length
    10.0
    >>> LocalPlanner(4.0, Steering.REEDS_SHEPP).shortest((0, 0, 0), (-10, 0, 0)).lengths
    (-10.0,)
    """

    radius: float
    steering: Steering = Steering.DUBINS

    def options(self, start: ArrayLike, goal: ArrayLike) -> list[Curve]:
        """Return every kind of path from start to goal, the shortest first."""
        if self.radius == 0:
            return [self.shortest(start, goal)]
        options = reeds_shepp_options if self.steering is Steering.REEDS_SHEPP else dubins_options
        return options(start, goal, self.radius)

    def shortest(self, start: ArrayLike, goal: ArrayLike) -> Curve:
        """Return the shortest path from start to goal, poses (x, y, heading)."""
        if self.radius > 0:
            shortest = reeds_shepp_shortest if self.steering is Steering.REEDS_SHEPP else dubins_shortest
            return shortest(start, goal, self.radius)
        (x0, y0, _), (x1, y1, _) = pose_of(start, 'start'), pose_of(goal, 'goal')
        return Curve((x0, y0, atan2(y1 - y0, x1 - x0)), 'S', (hypot(x1 - x0, y1 - y0),), 1.0)
