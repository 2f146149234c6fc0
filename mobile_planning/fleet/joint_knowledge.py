"""Joint knowledge: what one robot has heard of the others, and of joint plans. No clock and no I/O."""
from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.joint_message import JointPlan, JointStatus
from mobile_planning.fleet.message import Mode, RobotMsg

#: Whoever has not been heard for so long [s] counts as standing for ever.
_SILENT = 3.0
_MAX_PLANS = 32


class JointKnowledge:
    """The newest message of each peer, and the newest joint plans.

    Parameters
    ----------
    robot_id : int
        Of the robot that knows.
    reach : float [m]
        Nobody farther away counts.
    """

    def __init__(self, robot_id: int, reach: float):
        self._id, self._reach = robot_id, reach
        self._heard: dict[int, tuple[RobotMsg, float]] = {}
        self._plans: dict[tuple[int, int], JointPlan] = {}

    def hear(self, message: RobotMsg, now: float) -> None:
        """Take in what a peer says at ``now`` [s]."""
        self._heard[message.robot_id] = message, now

    def remember(self, plan: JointPlan) -> None:
        """Keep a joint plan, and the newest others."""
        self._plans[plan.version] = plan
        if len(self._plans) > _MAX_PLANS:
            del self._plans[min(self._plans)]

    def plan(self, version: tuple[int, int]) -> JointPlan | None:
        """Return the joint plan of a version, None if it is not known."""
        return self._plans.get(version)

    def status(self, other: int) -> JointStatus | None:
        """Return how a robot stands to joint plans, None if it was never heard."""
        return self._heard[other][0].joint if other in self._heard else None

    def is_silent(self, other: int, now: float) -> bool:
        """Return whether a robot has not been heard for long."""
        return other not in self._heard or now - self._heard[other][1] > _SILENT

    def partners(self, status: JointStatus) -> frozenset[int]:
        """Return the members of the plan that a robot of this ``status`` follows, as far as it is known."""
        plan = self._plans.get(status.version) if status.is_followed else None
        return frozenset() if plan is None else frozenset(plan.members)

    def around(self, now: float, place: NDArray[np.float64]) -> dict[int, RobotMsg]:
        """Return the newest messages of those within reach of ``place`` (2,) [m] that can move, by id."""
        return {other: message for other, message in self._near(place)
                if not self.is_silent(other, now) and message.mode is not Mode.STOPPED}

    def standing(self, now: float, place: NDArray[np.float64],
                 without: Collection[int] = ()) -> list[tuple[int, RobotMsg]]:
        """Return ids and messages of those within reach of ``place`` (2,) [m] that stand."""
        return [(other, message) for other, message in self._near(place) if other not in without
                and (self.is_silent(other, now) or message.mode in (Mode.STOPPED, Mode.DONE))]

    def _near(self, place):
        return [(other, message) for other, (message, _) in sorted(self._heard.items())
                if np.linalg.norm(message.plan.end - place) < self._reach]

    def has_rival(self, now: float, within: float) -> bool:
        """Return whether one with a lower id has said ``within`` [s] that it is about to propose a plan."""
        return any(other < self._id and message.joint.is_proposing and now - at < within
                   for other, (message, at) in self._heard.items())

    @property
    def radii(self) -> list[float]:
        """Radii [m] of all that were heard."""
        return [message.radius for message, _ in self._heard.values()]

    @property
    def epoch(self) -> int:
        """The newest epoch of a joint plan that was heard of, 0 for none."""
        epochs = [version[0] for version in self._plans]
        return max([*epochs, *(message.joint.epoch for message, _ in self._heard.values())], default=0)
