"""Surroundings: what a robot knows of the others, where it plans."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet import fences
from mobile_planning.fleet.bspline import bezier
from mobile_planning.fleet.fences import Fences
from mobile_planning.fleet.message import LinkMode, Mode
from mobile_planning.fleet.neighbour import Neighbour
from mobile_planning.fleet.protocol import Protocol


class Surroundings:
    """The other robots as one robot has heard them and is bound to them.

    Parameters
    ----------
    protocol : Protocol
        Of this robot.
    radius : float [m]
        Of its body, with its margin.
    """

    def __init__(self, protocol: Protocol, radius: float):
        self._protocol, self._radius = protocol, radius

    def neighbours(self, knot: int) -> list[Neighbour]:
        """Return what is known of the others at ``knot``.

        Whoever will not move stands where that is known, whatever its last message said: a robot that died on its way
        is to be driven around like one at its goal.
        """
        sides = self._protocol.sides
        heard = [message for other, message in self._protocol.heard.items()
                 if other not in sides or sides[other].mode is not LinkMode.STATIC]
        plans = [message.plan for message in heard]
        rows = [min(max(knot - plan.first_knot, 0), len(plan.points) - 3) for plan in plans]
        points = np.concatenate([np.empty((0, 2)), *(plan.points[row:row + 3] for plan, row in zip(plans, rows))])
        points = points.reshape(-1, 3, 2)
        positions = (points[:, 0] + 4 * points[:, 1] + points[:, 2]) / 6
        velocities = (points[:, 2] - points[:, 0]) / np.array([2 * plan.step for plan in plans])[:, None]
        return [
            Neighbour(position, message.plan.end, message.goal, message.radius,
                      message.mode in (Mode.DONE, Mode.STOPPED) and message.plan.end_knot <= knot, velocity,
                      message.v_max)
            for message, position, velocity in zip(heard, positions, velocities)] + self.standing()

    def standing(self) -> list[Neighbour]:
        """Return those that will not move: dead, or not switched on."""
        return [Neighbour(place, place, place, radius, True) for place, radius in self._protocol.discs()]

    def fences(self, knot: int, points: NDArray, spans: int) -> Fences:
        """Return the fences of all contracts and resting peers.

        Parameters
        ----------
        knot : int
        points : (n, 2) ndarray [m]
            Control points of the plan in force from ``knot`` on.
        spans : int
            The fences reach to the end of everybody's plan, so far at least, and one span of rest.
        """
        bound = self._protocol.bound()
        last = max((contract.last_span for contract, _ in bound), default=knot)
        count = max(spans, len(points) - 3, last - knot + 1) + 1
        curves = bezier(np.concatenate([points, np.repeat(points[-1:], count + 3 - len(points), axis=0)]))
        return (fences.of_contracts(bound, knot, count, self._radius)
                + fences.of_discs(self._protocol.discs(), curves, self._radius))
