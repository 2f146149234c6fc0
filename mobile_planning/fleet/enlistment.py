"""Enlistment: the part that one robot has in a mission, and what keeps the robot from driving."""
from __future__ import annotations

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.robot import Robot

#: Why a robot stands that was left out, and one whose mission is paused.
_LEFT_OUT, _PAUSED = 'left out', 'mission'


class Enlistment:
    """Follows the first mission that starts, and lets the robot stand as long as there is a reason to.

    Parameters
    ----------
    robot_id : int

    Attributes
    ----------
    is_stopped : bool
        Whether the mission was stopped.
    """

    def __init__(self, robot_id: int):
        self._id, self._mission, self.is_stopped = robot_id, None, False
        self._holds: dict[str, str] = {}

    @property
    def has_started(self) -> bool:
        """Whether a mission with this robot was started."""
        return (self._mission is not None and self._mission.state in (State.STARTED, State.PAUSED)
                and self._id in self._mission.robot_ids)

    @property
    def start(self) -> float:
        """When the mission began [s], if it has."""
        return self._mission.start if self.has_started else 0.0

    @property
    def roster(self) -> tuple[int, ...]:
        """Everybody who takes part in the mission, as far as one is known."""
        return () if self._mission is None else self._mission.robot_ids

    @property
    def reasons(self) -> list[str]:
        """Why the robot is to stand, a sentence each."""
        return list(self._holds.values())

    @property
    def is_left_out(self) -> bool:
        """Whether the mission goes on without the robot, for nobody knows where its body is."""
        return _LEFT_OUT in self._holds

    def follow(self, announcement: Announcement, robot: Robot | None, now: float) -> bool:
        """Do what is announced, if there is a ``robot``; return whether a mission has started by that.

        Raises
        ------
        InvalidInput
            It is of another mission than the one that has started.
        """
        if robot is None or not self.has_started:
            self._mission = announcement
            return robot is not None and self.enter(robot, now)
        if announcement.name != self._mission.name or announcement.state is State.WAITING:
            raise InvalidInput(f'mission {announcement.name[:80]} is not followed: '
                               f'mission {self._mission.name[:80]} has started, and a robot drives only one')
        if announcement.state is State.STOPPED:
            robot.stop()
            self.is_stopped = True
        else:
            self._heed(announcement, robot, now)
        return False

    def enter(self, robot: Robot, now: float) -> bool:
        """Tell a robot that knows of no mission of the one that is known; return whether that has started."""
        if self._holds:
            robot.pause(now)
        if self._mission is None or self._mission.state is State.STOPPED:
            return False
        robot.join(list(self.roster))
        if self.has_started:
            robot.start(list(self.roster), self._mission.start)
            self._heed(self._mission, robot, now)
        return self.has_started

    def hold(self, reason: str, sentence: str, robot: Robot | None, now: float) -> None:
        """Let the robot come to rest, and stay until `release` of every ``reason``."""
        self._holds[reason] = sentence
        if robot is not None and not robot.is_paused:
            robot.pause(now)

    def release(self, reason: str, robot: Robot | None, now: float) -> None:
        """Let the robot drive on, if nothing else holds it."""
        if self._holds.pop(reason, None) is not None and not self._holds and robot is not None:
            robot.resume(now)

    def _heed(self, announcement, robot, now):
        """Pause with the mission, and drive on with it; stay where it goes on without this robot."""
        if self._id in announcement.left_out:
            self.hold(_LEFT_OUT, 'the mission goes on without it: it was started anew elsewhere than its last plan has '
                                 'led it', robot, now)
        if announcement.state is State.PAUSED:
            self.hold(_PAUSED, 'the mission is paused', robot, now)
        else:
            self.release(_PAUSED, robot, now)
