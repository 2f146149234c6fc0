"""What a robot covers of the floor: a disc, or an outline that turns with it."""
from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.world.obstacles import PolygonObstacle


@dataclass(frozen=True, eq=False)
class Footprint:
    """The floor that a robot covers.

    Parameters
    ----------
    radius : float [m]
        Of a disc about the robot's position; 0 is a point.
    outline : (N, 2) array_like [m], optional
        A simple polygon in the robot's frame (x forwards, y to the left), in place of the disc.

    Raises
    ------
    InvalidInput
        If the radius is negative or not finite, if both are given, or the outline is no simple polygon.

    Examples
    --------
    >>> Footprint.rectangle(length=2.0, width=1.0, ahead=1.5).outline.tolist()
    [[-0.5, -0.5], [1.5, -0.5], [1.5, 0.5], [-0.5, 0.5]]
    """

    radius: float = 0.0
    outline: NDArray[np.float64] | None = None

    def __post_init__(self):
        try:
            radius = float(self.radius)
        except (TypeError, ValueError):
            radius = float('nan')
        if not (isfinite(radius) and radius >= 0):
            raise InvalidInput(f'footprint radius {self.radius!r} m is not a finite number of at least 0')
        object.__setattr__(self, 'radius', radius)
        if self.outline is None:
            return
        if radius > 0:
            raise InvalidInput(f'a footprint has a radius ({radius} m) or an outline, not both')
        object.__setattr__(self, 'outline', PolygonObstacle(self.outline).vertices)

    @classmethod
    def rectangle(cls, length: float, width: float, ahead: float | None = None) -> Footprint:
        """Return a rectangle [m] that reaches ``ahead`` of the robot's position, by default half its length."""
        ahead = length / 2 if ahead is None else ahead
        return cls(outline=np.array([(ahead - length, -width / 2), (ahead, -width / 2),
                                     (ahead, width / 2), (ahead - length, width / 2)]))

    @property
    def reach(self) -> float:
        """The distance [m] from the robot's position to the furthest point that it covers."""
        return self.radius if self.outline is None else float(np.hypot(*self.outline.T).max())

    def shrunk(self, margin: float) -> NDArray[np.float64]:
        """Return the outline (N, 2) [m], its edges moved inwards by ``margin`` [m]; (0, 2) for a disc.

        Raises
        ------
        InvalidInput
            If less than an outline in one piece would be left.
        """
        import shapely

        if self.outline is None:
            return np.empty((0, 2))
        inner = shapely.Polygon(self.outline).buffer(-margin, join_style='mitre', mitre_limit=1e6)
        if not isinstance(inner, shapely.Polygon) or inner.is_empty:
            raise InvalidInput(f'footprint is in a place narrower than {2 * margin:g} m')
        return shapely.get_coordinates(inner.exterior)[:-1].copy()

    def at(self, pose: ArrayLike) -> NDArray[np.float64]:
        """Return the outline (N, 2) [m] in the map frame of a robot at the pose (x, y, heading)."""
        x, y, heading = pose
        cos, sin = np.cos(heading), np.sin(heading)
        return self.outline @ np.array([[cos, sin], [-sin, cos]]) + (x, y)
