"""One section: candidate plans along the guidance path, rolled out within the limits.

A control polygon whose steps obey the limits on speed and acceleration gives a
spline that obeys them at every instant, so each candidate is a roll-out of a
point that is drawn along the path, beside it or slower, and brakes to rest.
"""
from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.guidance import Polyline
from mobile_planning.geometry import wrap_angle

#: To the left of the path [m]; the right comes first, so that equals pass on the right.
_OFFSETS = (0.0, -0.3, 0.3, -0.6, 0.6, -0.9, 0.9, -1.3, 1.3)
_SPEEDS = (0.97, 0.55)
_MOVES = (1.0, 0.6, 0.35)
_SHARE = 0.97


@dataclass(frozen=True)
class Limits:
    """What the body can do: speed [m/s], acceleration [m/s^2], turn rate [rad/s], radius with margin [m]."""

    v_max: float
    a_max: float
    omega_max: float
    radius: float


def candidates(start: NDArray, heading: float, path: Polyline, limits: Limits,
               step: float, spans: int) -> NDArray[np.float64]:
    """Return plans (K, spans + 3, 2) [m] that go on from ``start`` and end at rest.

    Parameters
    ----------
    start : (3, 2) ndarray [m]
        The first three control points, which are given.
    heading : float [rad]
        At the first knot; a robot at rest turns in place before it departs.
    path : Polyline
        Where to go.
    limits : Limits
    step : float [s]
        Between knots.
    spans : int
        Length of a plan.
    """
    offset, speed, moves = np.array(list(product(_OFFSETS, _SPEEDS, _MOVES))).T
    count = len(offset)
    speed_gain = _SHARE * limits.a_max * step
    at_rest = not np.ptp(start, axis=0).any()
    position = np.tile(start[2], (count, 1))
    velocity = np.tile((start[2] - start[1]) / step, (count, 1))
    wanted = _towards(position, velocity, offset, path)
    hold = np.zeros(count)
    if at_rest:
        turn = np.abs(wrap_angle(np.arctan2(wanted[:, 1], wanted[:, 0]) - heading))
        hold = np.ceil(turn / (limits.omega_max * step) - 1e-9)
    brake = int(np.ceil(np.linalg.norm(velocity[0]) / speed_gain - 1e-9))
    stop = np.maximum(np.minimum(hold + np.ceil(moves * (spans - 2)), spans - 2), brake)
    points = [*np.repeat(start[:, None], count, axis=1)]
    for index in range(spans):
        wanted = _towards(position, velocity, offset, path)
        fastest = np.minimum(speed * limits.v_max, _reaching(_remaining(position, path), speed_gain, step))
        fastest = np.where(index < hold, 0.0, np.minimum(fastest, speed_gain * np.maximum(stop - index, 0)))
        velocity = _limited(velocity, wanted * fastest[:, None], speed_gain, 0.8 * limits.omega_max * step)
        velocity = np.where((index >= stop)[:, None], 0.0, velocity)
        position = position + step * velocity
        points.append(position)
    return np.stack(points, axis=1)


def bearing(position: NDArray, path: Polyline) -> float:
    """Return the direction [rad] in which a robot at rest at ``position`` (2,) [m] sets out along ``path``."""
    ahead = _towards(position[None], np.zeros((1, 2)), np.zeros(1), path)[0]
    return float(np.arctan2(ahead[1], ahead[0]))


def remaining(points: NDArray, path: Polyline) -> NDArray[np.float64]:
    """Return how far (K, n) [m] control points (K, n, 2) are from the end of ``path`` by way of it."""
    arc, distance = path.project(points.reshape(-1, 2))
    return (path.length - arc + 0.5 * distance).reshape(points.shape[:-1])


def _remaining(position, path):
    arc, distance = path.project(position)
    return np.hypot(path.length - arc, distance)


def _towards(position, velocity, offset, path):
    """Return the unit vectors towards the points ahead on, or beside, the path."""
    arc, _ = path.project(position)
    ahead = np.minimum(arc + 0.35 + 0.35 * np.linalg.norm(velocity, axis=1), path.length)
    # Beside the path only in its middle: it starts here and ends at the goal.
    beside = offset * np.clip((path.length - ahead) / 0.8, 0.0, 1.0)
    vector = path.beside(ahead, beside) - position
    length = np.linalg.norm(vector, axis=1, keepdims=True)
    return np.divide(vector, length, out=np.zeros_like(vector), where=length > 1e-9)


def _reaching(distance, speed_gain, step):
    """Return the speed [m/s] from which even braking ends exactly ``distance`` [m] ahead."""
    steps = np.ceil((np.sqrt(1.0 + 8.0 * distance / (speed_gain * step)) - 1.0) / 2.0 - 1e-9)
    return 2.0 * distance / (step * (steps + 1.0))


def _limited(velocity, wanted, speed_gain, turn):
    """Return the velocity nearest to ``wanted`` that one step's acceleration and turn allow."""
    speed, aim = np.linalg.norm(velocity, axis=1), np.linalg.norm(wanted, axis=1)
    angle = np.arctan2(velocity[:, 1], velocity[:, 0])
    change = wrap_angle(np.arctan2(wanted[:, 1], wanted[:, 0]) - angle)
    moving = (speed > 1e-9) & (aim > 1e-9)
    # A turn sharper than a right angle is made slowly.
    aim = np.where(moving & (np.abs(change) > np.pi / 2), np.minimum(aim, speed - speed_gain).clip(0.0), aim)
    direction = np.where(moving, angle + np.clip(change, -turn, turn),
                         np.where(aim > 1e-9, np.arctan2(wanted[:, 1], wanted[:, 0]), angle))
    wanted = aim[:, None] * np.column_stack([np.cos(direction), np.sin(direction)])
    difference = wanted - velocity
    size = np.linalg.norm(difference, axis=1)
    limited = velocity + difference * np.minimum(1.0, speed_gain / np.maximum(size, 1e-12))[:, None]
    # Braking comes first: where turning would leave too much speed, brake straight.
    too_fast = np.linalg.norm(limited, axis=1) > np.maximum(aim, 0.0) + 1e-9
    straight = velocity * (np.maximum(speed - speed_gain, np.minimum(aim, speed)) / np.maximum(speed, 1e-12))[:, None]
    return np.where((too_fast & (aim < speed))[:, None], straight, limited)
