"""Company: advice for a robot whose neighbours cannot follow it any farther: it goes back to them for a while."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.message import Mode, RobotMsg

#: A tether is taut from this share of its range on, and slack below this one.
_TAUT, _SLACK = 0.8, 0.5
#: Who moves by less than this [m] in all its plan stands; who stands so long [s] behind a taut tether is stuck.
_STANDS, _STUCK = 0.3, 4.0
#: Going back takes no longer than this [s].
_BACK = 10.0


class Company:
    """Watches over the neighbours of one robot.

    Of two neighbours that stand with a taut tether between them the one nearer to its goal comes back.

    Parameters
    ----------
    eyed : int
    ranges : mapping of int to float [m]
        Neighbours, and how far away they may be.
    """

    def __init__(self, eyed: int, ranges: Mapping[int, float]):
        self._eyed, self._ranges = eyed, dict(ranges)
        self._since: dict[int, float] = {}
        self._back, self._until = None, -np.inf

    def seeks(self, plan: Plan, goal: NDArray, heard: Mapping[int, RobotMsg], now: float) -> NDArray | None:
        """Return the place (2,) [m] of the neighbour that the robot is to go back to at ``now`` [s]; None for none."""
        if not self._ranges:
            return None
        for other, reach in self._ranges.items():
            if self._is_stuck(plan, goal, heard.get(other), other, reach):
                since = self._since.setdefault(other, now)
                if now - since > _STUCK and self._back is None:
                    self._back, self._until = other, now + _BACK
            else:
                self._since.pop(other, None)
        if self._back is None:
            return None
        peer = heard[self._back]
        if now > self._until or np.linalg.norm(peer.lz - plan.end) < _SLACK * self._ranges[self._back]:
            self._back = None
            self._since.clear()
            return None
        return peer.lz

    def _is_stuck(self, plan, goal, peer, other, reach):
        """Return whether robot and neighbour stand far apart, and the neighbour has farther to go."""
        if peer is None or peer.mode is not Mode.DRIVING:
            return False
        left, others = (float(np.linalg.norm(end - aim)) for end, aim in ((plan.end, goal), (peer.plan.end, peer.goal)))
        return (max(np.ptp(each.points, axis=0).max() for each in (plan, peer.plan)) < _STANDS
                and np.linalg.norm(plan.end - peer.plan.end) > _TAUT * reach and (left, self._eyed) < (others, other))
