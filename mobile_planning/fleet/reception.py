"""Reception: what is said to a robot, whether it is heard, and what waits while the robot is busy."""
from __future__ import annotations

from collections import deque
from contextlib import suppress

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.message import Contracts, Death, RobotMsg
from mobile_planning.fleet.robot import Robot

#: Messages that wait for a busy robot; of more the oldest are lost.
_MOST = 4096
#: Another process of the same robot that was heard so lately [s] keeps this one from moving.
_TWIN = 2.0

#: What a robot is told.
Message = RobotMsg | Contracts | JointPlan | Death


class Reception:
    """Refuses what comes from a twin or by another method, and keeps what comes while the robot plans.

    Parameters
    ----------
    robot_id : int
    """

    def __init__(self, robot_id: int):
        self._id, self._twin_until = robot_id, -np.inf
        self._waiting: deque[tuple[Message, float]] = deque(maxlen=_MOST)

    def __len__(self) -> int:
        """Return how many messages wait."""
        return len(self._waiting)

    def admits(self, message: Message, robot: Robot | None, epoch: int, now: float) -> bool:
        """Return whether the robot, if there is one, is to take in a message that comes at ``now`` [s].

        Raises
        ------
        InvalidInput
            It comes from another process of this robot, whose own is ``epoch``, or from a robot that plans by another
            method.
        """
        if isinstance(message, Death):
            return robot is not None
        if message.robot_id == self._id:
            self._notice_twin(message, epoch, now)
            return False
        if robot is not None:
            _require_one_method(message, robot)
        return robot is not None

    def keep(self, message: Message, now: float) -> None:
        """Keep a message of ``now`` [s] for a robot that is busy; may be called in any thread."""
        self._waiting.append((message, now))

    def hand_on(self, robot: Robot) -> None:
        """Let the robot take in all that waits."""
        while self._waiting:
            # What the robot refuses it counts among the ignored; a section must not be lost by it.
            with suppress(InvalidInput):
                robot.receive(*self._waiting.popleft())

    def has_elder_twin(self, now: float) -> bool:
        """Return whether an older process of this robot was heard a little before ``now`` [s]."""
        return now < self._twin_until

    def _notice_twin(self, message, epoch, now):
        if message.boot_epoch == epoch:
            return
        if message.boot_epoch < epoch:
            self._twin_until = now + _TWIN
        raise InvalidInput(f'robot {self._id} was started a second time: '
                           + ('the older process speaks, so this one does not move'
                              if message.boot_epoch < epoch else 'the younger process is not to move'))


def _require_one_method(message, robot):
    method = message.method if isinstance(message, RobotMsg) else 'contracts'
    if method != robot.method:
        raise InvalidInput(f'robot {message.robot_id} plans by {method}, this one by {robot.method}: all robots of a '
                           'mission plan by one method')
