"""A roundabout: the circle that robots keep on their left where too many of them would meet at once.

Nobody builds it together: each robot predicts the crowd from what it has heard, and nearby robots predict nearly the
same. Nothing depends on it but time.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet.neighbour import Neighbour

#: Robots stand in a crowd closer than so many radii times the root of their number.
_CROWDED = 1.5
#: Least number of robots in a crowd that is worth a way round.
_LEAST = 4
#: Length of circumference for each robot, in radii of a robot.
_PLACE = 4.5
#: Least radius of a roundabout, in radii of a robot.
_LEAST_RADIUS = 2.5
#: Below so many radii of a robot a roundabout is not worth the way.
_GONE = 2.0
#: The centre follows a crowd for which this share of the radius would do, or more.
_WHOLE = 0.75
#: Squares of places further out [m] would overflow.
_FAR = 1e12
#: Robots keep their distance on a circle of so many places or more, and are on it within this share of its radius.
_MANY, _ON_CIRCLE = 12, 0.3
#: A robot is before another from this cosine on, and close within the gap that this share of a place leaves between two
#: of its size; who is behind falls back at this share of the full speed or more.
_BEFORE, _CLOSE, _SLOWEST = 0.7, 0.85, 0.3


@dataclass(frozen=True, eq=False)
class Roundabout:
    """A circle to drive round counter-clockwise.

    Parameters
    ----------
    centre : (2,) ndarray [m]
    radius : float [m]
    age : int
        Updates since a crowd was last seen there.
    """

    centre: NDArray[np.float64]
    radius: float
    age: int = 0

    def way(self, position: ArrayLike, goal: ArrayLike, stride: float = 0.3,
            legs: int = 14) -> NDArray[np.float64] | None:
        """Return way-points (W, 2) [m] from ``position`` round the circle towards ``goal``; None if it is not needed.

        Parameters
        ----------
        position, goal : (2,) array_like [m]
        stride : float [m]
            Between way-points.
        legs : int
            How many there are at most.
        """
        from mobile_planning.fleet import roundabout_kernels as kernels

        points = np.empty((legs + 1, 2))
        points[0] = position
        count = kernels.go_round(points, np.asarray(goal, float), self.centre, self.radius, stride)
        return points[:count] if count else None

    def pace(self, way: NDArray, neighbours: Sequence[Neighbour], radius: float) -> float:
        """Return the share of the full speed at which a robot on the circle falls back from one close before it there.

        Who comes up close stands beside that one where both leave, and neither can turn to its goal before the other.
        Behind one that is not on the circle nobody falls back, for it drives somewhere else or crawls; nor on a circle
        for few, which all have left before that tells.

        Parameters
        ----------
        way : (W, 2) ndarray [m]
            From where the robot is, as `way` returns it.
        neighbours : sequence of Neighbour
        radius : float [m]
            Of the robot.
        """
        leg, moving = way[1] - way[0], [other for other in neighbours if not other.is_parked]
        length = np.hypot(*leg)
        is_large = 2 * np.pi * self.radius >= _MANY * _PLACE * radius
        if not (moving and length > 1e-9 and is_large and self._is_on_circle(way[0])):
            return 1.0
        places, velocities = (np.array([getattr(other, name) for other in moving], float)
                              for name in ('position', 'velocity'))
        places = np.clip(places, -_FAR, _FAR)
        offsets, touch = places - way[0], radius + np.array([other.radius for other in moving], float)
        distances = np.hypot(*offsets.T)
        leads = (offsets @ leg > _BEFORE * length * distances) & (velocities @ leg > 0.0) & self._is_on_circle(places)
        room = (distances - touch) / (_CLOSE * _PLACE * radius - 2 * radius)
        return float(np.clip(np.where(leads, room, 1.0).min(), _SLOWEST, 1.0))

    def _is_on_circle(self, places):
        """Return whether each of ``places`` (..., 2) [m] is on the circle, or nearly."""
        return np.abs(np.linalg.norm(places - self.centre, axis=-1) - self.radius) < _ON_CIRCLE * self.radius


def predict_crowd(positions: ArrayLike, goals: ArrayLike, radius: float,
                  v_max: float) -> tuple[NDArray[np.float64], int] | None:
    """Return the centre (2,) [m] and the size of the largest crowd on the way, None if there is none.

    Parameters
    ----------
    positions, goals : (N, 2) array_like [m]
        Of the robots that are under way; all are taken to drive straight on.
    radius : float [m]
        Of a robot.
    v_max : float [m/s]
    """
    from mobile_planning.fleet import roundabout_kernels as kernels

    positions, goals = np.reshape(positions, (-1, 2)).astype(float), np.reshape(goals, (-1, 2)).astype(float)
    if len(positions) < _LEAST:
        return None
    lengths = np.linalg.norm(goals - positions, axis=1)
    headings = (goals - positions) / np.maximum(lengths, 1e-9)[:, None]
    # Distances, not times: half a second's drive at a time, twice that where there are many.
    stride = v_max * (1.0 if len(positions) > 16 else 0.5)
    stride = max(stride, float(lengths.max()) / 200)
    centre = np.empty(2)
    largest = kernels.largest_crowd(positions, headings, lengths, stride, _CROWDED * radius, _LEAST, centre)
    return (centre, largest) if largest >= _LEAST else None


def updated(roundabout: Roundabout | None, crowd: tuple[NDArray, int] | None, position: ArrayLike,
            radius: float) -> Roundabout | None:
    """Return the roundabout after another look, about three cycles after the last one.

    It stays where it is for whoever is on it, moves little for the others, and shrinks slowly: else its centre would
    follow the stragglers. A larger crowd than it was made for makes another one: who has heard of few so far would keep
    a centre that is not the others'.

    Parameters
    ----------
    roundabout : Roundabout or None
        Of the last look.
    crowd : (2,) ndarray [m] and int, or None
        As `predict_crowd` returns it.
    position : (2,) array_like [m]
        Of this robot.
    radius : float [m]
        Of a robot.
    """
    if crowd is None:
        if roundabout is None or roundabout.radius - 0.5 * radius < _GONE * radius:
            return None
        return Roundabout(roundabout.centre, roundabout.radius - 0.5 * radius, roundabout.age + 1)
    centre, size = crowd
    wanted = max(_LEAST_RADIUS, _PLACE * size / (2 * np.pi)) * radius
    if roundabout is None or wanted > roundabout.radius:
        return Roundabout(centre, wanted)
    if np.hypot(*(centre - roundabout.centre)) < max(1.5 * roundabout.radius, 5 * radius):
        is_near = np.hypot(*(np.asarray(position, float) - roundabout.centre)) < roundabout.radius + 10 * radius
        shrunk = roundabout.radius - (0.15 if is_near else 0.5) * radius
        # Of a crowd that has begun to turn only a part is still foreseen, and that part's middle is somewhere else.
        stays = is_near or wanted < _WHOLE * roundabout.radius
        moved = roundabout.centre if stays else 0.7 * roundabout.centre + 0.3 * centre
        return Roundabout(moved, max(wanted, shrunk))
    if roundabout.age > 2:
        return Roundabout(centre, wanted)
    return Roundabout(roundabout.centre, roundabout.radius, roundabout.age + 1)
