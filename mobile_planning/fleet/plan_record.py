"""PlanRecord: all plans that one process of a robot has committed."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution

#: So many states are kept for who asks again.
_STATES_KEPT = 8


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
        self._plans, self._commits, self._forgotten = [first], [np.nan], 0
        self.section_times: list[float] = []
        self._states: dict[tuple[Plan, float], NDArray[np.float64]] = {}
        self.late = 0

    def __len__(self) -> int:
        """Return how many plans there were, those included that were forgotten."""
        return self._forgotten + len(self._plans)

    def forget(self, most: int) -> None:
        """Leave out the oldest quarter and more, once there are more than ``most`` plans; of sections likewise."""
        before = len(self._plans)
        for kept in self._plans, self._commits, self.section_times:
            leave_out(kept, most)
        self._forgotten += before - len(self._plans)

    @property
    def newest(self) -> Plan:
        """The plan that was committed last."""
        return self._plans[-1]

    def since(self, knot: int) -> list[Plan]:
        """Return the plan that drives at ``knot``, or the first, and all that come after it."""
        begun = sum(1 for plan in self._plans if plan.first_knot <= knot)
        return self._plans[max(begun - 1, 0):]

    def add(self, plan: Plan, now: float) -> None:
        """Note that ``plan`` was committed at ``now`` [s]."""
        self._plans.append(plan)
        self._commits.append(float(now))

    def at(self, knot: float) -> Plan:
        """Return which of the plans drives at ``knot``: the last that has started, or the first."""
        return next((plan for plan in reversed(self._plans) if plan.first_knot <= knot), self._plans[0])

    def state(self, time: float) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (5,) at ``time`` [s]."""
        return self._state_by(self.at(time / self._plans[0].step), time)

    def heading(self, knot: int) -> float:
        """Return the heading [rad] at ``knot``."""
        return float(self._state_by(self.at(knot), knot * self._plans[0].step)[2])

    def _state_by(self, plan, time):
        """Return the state at ``time`` by one of the plans; each is asked for several times in a cycle."""
        if (plan, time) not in self._states:
            if len(self._states) >= _STATES_KEPT:
                self._states.clear()
            self._states[plan, time] = plan.state(time)
        return self._states[plan, time].copy()

    def solution(self, robot_id: int, is_done: bool) -> Solution:
        """Return it as what the robot ``robot_id`` answers for."""
        return Solution(robot_id, tuple(self._plans), is_done, tuple(self.section_times),
                        commits=tuple(self._commits))


def leave_out(kept: list, most: int) -> None:
    """Leave the oldest quarter and more out of a list, once it is longer than ``most``.

    Examples
    --------
    >>> times = [0.1, 0.2, 0.3, 0.4, 0.5]
    >>> leave_out(times, 5)
    >>> leave_out(times, 4)
    >>> times
    [0.3, 0.4, 0.5]
    """
    if len(kept) > most:
        del kept[:len(kept) - 3 * most // 4]
