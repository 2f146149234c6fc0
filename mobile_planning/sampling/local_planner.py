"""What joins two poses in a tree."""
from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot

from numpy.typing import ArrayLike

from mobile_planning.sampling.curve import Curve, pose_of
from mobile_planning.sampling.dubins import dubins_options, dubins_shortest


@dataclass(frozen=True)
class LocalPlanner:
    """Dubins paths of one turning radius; straight lines if it is 0.

    Parameters
    ----------
    radius : float [m]

    Examples
    --------
    >>> LocalPlanner(4.0).shortest((0, 0, 0), (10, 0, 0)).length
    10.0
    """

    radius: float

    def options(self, start: ArrayLike, goal: ArrayLike) -> list[Curve]:
        """Return every kind of path from start to goal, the shortest first."""
        return dubins_options(start, goal, self.radius) if self.radius > 0 else [self.shortest(start, goal)]

    def shortest(self, start: ArrayLike, goal: ArrayLike) -> Curve:
        """Return the shortest path from start to goal, poses (x, y, heading)."""
        if self.radius > 0:
            return dubins_shortest(start, goal, self.radius)
        (x0, y0, _), (x1, y1, _) = pose_of(start, 'start'), pose_of(goal, 'goal')
        return Curve((x0, y0, atan2(y1 - y0, x1 - x0)), 'S', (hypot(x1 - x0, y1 - y0),), 1.0)
