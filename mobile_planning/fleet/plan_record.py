"""PlanRecord: all plans that one process of a robot has committed."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution


class PlanRecord:
    """What a robot has driven so far, and is going to.

    Parameters
    ----------
    first : Plan
        With which it was switched on.

    Attributes
    ----------
    section_times : list of float [s]
        To plan each section.
    late : int
        Sections that were planned and came too late.
    """

    def __init__(self, first: Plan):
        self._plans, self._commits = [first], [np.nan]
        self.section_times: list[float] = []
        self.late = 0

    def __len__(self) -> int:
        return len(self._plans)

    @property
    def newest(self) -> Plan:
        """The plan that was committed last."""
        return self._plans[-1]

    @property
    def last_two(self) -> list[Plan]:
        """The newest plan and the one before, which may still be driven; the newest alone if it is the first."""
        return self._plans[-2:]

    def add(self, plan: Plan, now: float) -> None:
        """Note that ``plan`` was committed at ``now`` [s]."""
        self._plans.append(plan)
        self._commits.append(float(now))

    def at(self, knot: float) -> Plan:
        """Return which of the plans drives at ``knot``: the last that has started, or the first."""
        return next((plan for plan in reversed(self._plans) if plan.first_knot <= knot), self._plans[0])

    def state(self, time: float) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (5,) at ``time`` [s]."""
        return self.at(time / self._plans[0].step).state(time)

    def heading(self, knot: int) -> float:
        """Return the heading [rad] at ``knot``."""
        return float(self.at(knot).state(knot * self._plans[0].step)[2])

    def solution(self, robot_id: int, is_done: bool) -> Solution:
        """Return it as what the robot ``robot_id`` answers for."""
        return Solution(robot_id, tuple(self._plans), is_done, tuple(self.section_times),
                        commits=tuple(self._commits))
