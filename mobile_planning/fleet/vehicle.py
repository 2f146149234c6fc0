"""Vehicle: a body and the process that drives it, as the simulator knows them and no robot does."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.losses import Losses
from mobile_planning.fleet.message import Contracts, Death, RobotMsg
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.solution import Solution


class Vehicle:
    """One robot of a simulation: its clock, its life, and all that its body has driven.

    Parameters
    ----------
    robot : Robot
        The process; another one after a restart.
    start_time : float [s]
        Of the mission, on the fleet's clock. All times below count from it.
    skew : float [s]
        What the robot's clock is ahead of the fleet's.

    Attributes
    ----------
    robot : Robot
    skew : float [s]
    is_alive : bool
        Whether the process runs; a body without one follows the plan in force.
    has_joined : bool
        Whether it has ever run.
    life : int
        Counts the processes; what one had in mind is nothing to the next.
    is_solving, has_answers_due : bool
        A section is being planned; answers will be collected in a moment.
    inbox : list
        Messages that wait for the end of a section.
    """

    def __init__(self, robot: Robot, start_time: float, skew: float):
        self.robot, self.skew, self._start_time = robot, skew, start_time
        self.is_alive = self.has_joined = self.is_solving = self.has_answers_due = False
        self.life, self.inbox, self._losses = 0, [], Losses()
        self._driven, self._commits, self._section_times = (), (), ()

    @property
    def eyed(self) -> int:
        """The robot's id."""
        return self.robot.eyed

    @property
    def is_dead(self) -> bool:
        """Whether a process ran, and none does now."""
        return self.has_joined and not self.is_alive

    def clock(self, now: float) -> float:
        """Return what the robot's clock shows [s] at ``now`` [s]."""
        return self._start_time + now + self.skew

    def hear(self, message: RobotMsg | Contracts | Death | JointPlan, now: float) -> bool:
        """Return whether a message that arrives at ``now`` [s] concerns the process, which has taken it in then.

        By the numbers of all that arrive it is noticed what does not.
        """
        is_said_to_some = isinstance(message, Contracts)
        if is_said_to_some or isinstance(message, RobotMsg):
            self._losses.note(message.robot_id, message.boot_epoch, message.sequence, now)
        if is_said_to_some and self.eyed not in message.addressees:
            return False
        self.robot.receive(message, self.clock(now))
        return True

    def expect_losses(self, now: float) -> None:
        """Tell the process at ``now`` [s] whether messages get lost, as a node does once a cycle."""
        self.robot.expect_losses(self._losses.are_any(now))

    def place(self, now: float) -> NDArray[np.float64]:
        """Return where the body is, (2,) [m]."""
        return self.robot.state(self.clock(now))[:2]

    def motion(self, now: float) -> tuple[NDArray[np.float64], float]:
        """Return where the body is, (2,) [m], and its speed [m/s]."""
        state = self.robot.state(self.clock(now))
        return state[:2], abs(float(state[3]))

    def rests_from(self) -> float:
        """Return when the body comes to rest if nothing else is committed [s]."""
        plan = self.robot.plan
        return plan.end_knot * plan.step - self._start_time - self.skew

    def kill(self) -> None:
        """End the process."""
        self.is_alive = self.is_solving = self.has_answers_due = False
        self.inbox = []
        self.life += 1

    def boot(self, now: float) -> None:
        """Start the process; after a death it is a new one, that knows nothing."""
        if self.has_joined:
            driven = self.solution
            self._driven, self._commits, self._section_times = driven.plans, driven.commits, driven.section_times
            self.robot = self.robot.restarted(self.robot.protocol.epoch + 1, self.clock(now))
            self._losses = Losses()
        self.is_alive = self.has_joined = True

    @property
    def solution(self) -> Solution:
        """What the body has driven under all its processes."""
        latest = self.robot.sol
        commits = tuple(time - self.skew for time in latest.commits)
        return Solution(self.eyed, self._driven + latest.plans, latest.done,
                        self._section_times + latest.section_times, commits=self._commits + commits,
                        sample=latest.sample, start_time=self._start_time)
