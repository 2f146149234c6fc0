"""Roll call: which robots of a mission are there, as they were last heard, and what keeps them from starting."""
from __future__ import annotations

from collections.abc import Sequence

from mobile_planning.fleet.message import Mode, RobotMsg
from mobile_planning.fleet.postscript import Postscript

#: A robot is silent when its newest message is older than so many of its cycles, and than this [s].
_CYCLES, _SILENT = 4, 2.0


class RollCall:
    """What the robots of a mission said last, and when; times are of a clock that nobody sets.

    Parameters
    ----------
    robot_ids : sequence of int
        Of the mission.
    """

    def __init__(self, robot_ids: Sequence[int]):
        self._robot_ids = robot_ids
        self._heard: dict[int, tuple[RobotMsg, Postscript, float]] = {}

    @property
    def heard(self) -> dict[int, RobotMsg]:
        """The newest message of each robot."""
        return {robot_id: message for robot_id, (message, _, _) in self._heard.items()}

    def hear(self, message: RobotMsg, postscript: Postscript, now: float) -> bool:
        """Take in what a robot says at ``now`` [s], and tells beside it; return whether that is news of the mission."""
        robot_id = message.robot_id
        if robot_id not in self._robot_ids:
            return False
        if robot_id in self._heard:
            known = self._heard[robot_id][0]
            if (message.boot_epoch, message.sequence) <= (known.boot_epoch, known.sequence):
                return False
        self._heard[robot_id] = message, postscript, now
        return True

    def age(self, robot_id: int, now: float) -> float:
        """Return how long ago [s] a robot was heard."""
        return now - self._heard[robot_id][2]

    def present(self, now: float) -> list[tuple[RobotMsg, Postscript]]:
        """Return what each robot said last, and told beside it, of those that are heard still, by their ids."""
        return [(message, postscript) for robot_id, (message, postscript, _) in sorted(self._heard.items())
                if self._is_fresh(robot_id, now)]

    def silent(self, now: float) -> list[int]:
        """Return the robots that are not heard, or not any more."""
        return [robot_id for robot_id in self._robot_ids if not self._is_fresh(robot_id, now)]

    def lack(self, now: float) -> str:
        """Return what keeps the mission from starting, empty for nothing."""
        silent, heard = self.silent(now), self.heard
        if silent:
            return f'robots {silent} are not there'
        busy = [robot_id for robot_id in self._robot_ids if heard[robot_id].mode is not Mode.WAITING]
        if busy:
            return f'robots {busy} have had their mission: a robot that is started anew takes part in another'
        for robot_id in self._robot_ids:
            links = heard[robot_id].links
            deaf = [peer for peer in self._robot_ids if peer != robot_id
                    and (peer not in links or links[peer].epoch != heard[peer].boot_epoch)]
            if deaf:
                return f'robot {robot_id} does not hear robots {deaf}'
        return ''

    def _is_fresh(self, robot_id, now):
        if robot_id not in self._heard:
            return False
        message = self._heard[robot_id][0]
        return self.age(robot_id, now) <= max(_CYCLES * message.plan.step, _SILENT)
