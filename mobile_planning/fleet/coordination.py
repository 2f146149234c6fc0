"""Coordination: one robot's part in agreeing on joint plans and carrying them out.

There is no vote and no leader: whoever is stuck, or sees that it will meet somebody in a lane, proposes a plan for all
around it, and everybody follows the newest plan that it has heard of. As long as robots follow different ones they may
wait for each other, but they are safe: what a plan says is only where a robot would like to go. No clock and no I/O.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet.follower import Follower
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.joint_knowledge import JointKnowledge
from mobile_planning.fleet.joint_message import JointPlan, JointStatus
from mobile_planning.fleet.joint_request import GroundRequest, JointRequest
from mobile_planning.fleet.message import RobotMsg
from mobile_planning.fleet.proposer import HOME, STALLED, Proposer
from mobile_planning.world.environment import Environment

#: A plan that a member lacks is said again so often [s].
_REPEAT = 0.5
#: A member that has left for a plan that is unknown here for so long [s] does not come back.
_LEFT = 1.5


class Coordination:
    """What one robot knows of joint plans, and does about them.

    Parameters
    ----------
    robot_id, boot_epoch : int
    environment : Environment
        Its roadmap is made by `prepare`, or asked for when it is needed.
    radius : float [m]
    v_max : float [m/s]
    reach : float [m], optional
        Nobody farther away is asked to join a plan.

    Attributes
    ----------
    status : JointStatus
        To be told to all in the message of a cycle.
    held_up : HoldUp or None
        Why the robot does not go on and for whom, if it waits.
    """

    def __init__(self, robot_id: int, environment: Environment, radius: float, v_max: float, *, boot_epoch: int = 1,
                 reach: float = 15.0):
        self.status = JointStatus()
        self.held_up: HoldUp | None = None
        self._id, self._boot = robot_id, boot_epoch
        self._knowledge = JointKnowledge(robot_id, reach)
        self._proposer = Proposer(robot_id, boot_epoch, environment, radius, v_max, self._knowledge)
        self._request: JointRequest | GroundRequest | None = None
        self._goal: NDArray[np.float64] | None = None
        self._former: NDArray[np.float64] | None = None
        self._follower: Follower | None = None
        self._last: Follower | None = None
        self._sequence, self._said_at = 0, -np.inf
        self._left_at: dict[int, float] = {}

    def prepare(self) -> None:
        """Make the roadmap now: from some ten milliseconds on, the larger the world the longer."""
        self._proposer.prepare()

    def enter(self, environment: Environment) -> None:
        """Plan in another static world from now on; a plan in force led through the one before."""
        self._proposer.enter(environment)
        self.leave()

    @property
    def is_following(self) -> bool:
        """Whether a joint plan is in force."""
        return self._follower is not None

    @property
    def calls(self) -> bool:
        """Whether a joint plan in force has moves left for this robot, even if it is at its goal."""
        return self._follower is not None and not self._follower.has_finished

    def way(self, position: ArrayLike) -> NDArray[np.float64] | None:
        """Return way-points (W, 2) [m] from ``position`` to where the plan in force lets the robot go, if any is."""
        return None if self._follower is None else self._follower.way(np.asarray(position, float))

    def leave(self) -> None:
        """Take no further part in the plan in force, and make none: the others drop it when they hear of that.

        What comes of a request made before is dropped.
        """
        self._follower = self._request = None
        self._proposer.forget()
        self.status = self._status(0.0)

    # What comes in

    def hear(self, message: RobotMsg | JointPlan, now: float) -> bool:
        """Take in a ``message`` of a peer at ``now`` [s]; return whether it was news."""
        if isinstance(message, RobotMsg):
            self._knowledge.hear(message, now)
            return True
        if self._knowledge.status(message.robot_id) is None:
            return False
        if self._follower is not None and message.version == self._follower.plan.version:
            self._said_at = now
        if self._knowledge.plan(message.version) is not None:
            return False
        self._knowledge.remember(message)
        if self._id in message.members and self._is_newer(message):
            self._adopt(message, now)
            if self._leads_to_former(message):
                # Made before its proposer knew; the others hear that it is not followed.
                self._follower = None
        return True

    def _leads_to_former(self, plan):
        """Whether a plan brings this robot to the goal it had before."""
        if self._former is None:
            return False
        end = plan.ways[plan.members.index(self._id)][-1]
        return bool(np.linalg.norm(end - self._former) <= HOME < np.linalg.norm(end - self._goal))

    def _is_newer(self, plan):
        """Whether to follow ``plan``: a plan that was left is not taken up again, nor is another of its time."""
        if self._follower is not None:
            return plan.version > self._follower.plan.version
        return self._last is None or plan.epoch > self._last.plan.epoch

    def _adopt(self, plan, now):
        self._follower = self._last = Follower(plan, self._id, now)
        self._left_at = {}
        self._proposer.rest(plan, now)

    # Once a cycle

    def update(self, now: float, position: ArrayLike, plan_end: ArrayLike, goal: ArrayLike, is_done: bool,
               stalled: float, standing: Sequence[tuple[ArrayLike, float]] = ()) -> list[JointPlan]:
        """Bring way and status up to date at ``now`` [s]; return the plans to be said again.

        Where a new plan is due there is a request for it: see `take_request`.

        Parameters
        ----------
        now : float [s]
        position, plan_end, goal : (2,) array_like [m]
            Where the robot is, where its plan in force ends, where it wants to go.
        is_done : bool
            Whether it is at its goal.
        stalled : float [s]
            How long it has made no progress; without meaning while a joint plan is in force.
        standing : sequence of ((2,) array_like [m], float [m])
            Places and radii of robots that are known to stay where they are.
        """
        position, plan_end, goal = (np.asarray(each, float) for each in (position, plan_end, goal))
        if self._goal is not None and not np.array_equal(goal, self._goal):
            # The plan leads elsewhere; the others hear that it is followed no more.
            self._former = self._goal
            self.leave()
        self._goal = goal
        self._follow(now, position, plan_end)
        self.held_up = self._waits(now, plan_end, is_done, stalled)
        request = self._proposer.request(now, position, plan_end, goal, is_done, stalled, standing,
                                         self._follower)
        self._request = request or self._request
        said = self._said_again(now)
        self.status = self._status(0.0 if is_done or self._follower is not None else stalled)
        return said

    def take_request(self) -> JointRequest | GroundRequest | None:
        """Return the request for a plan that has fallen due, or for the ground that it takes, if any, once.

        Its answer goes to `propose`.
        """
        request, self._request = self._request, None
        return request

    def propose(self, plan: JointPlan | None, now: float) -> list[JointPlan]:
        """Put in force what came of a request at ``now`` [s]; return what is to be sent.

        A plan that comes after a newer one, or after `leave`, is dropped.
        """
        if not self._proposer.takes(plan) or not self._is_newer(plan):
            return []
        self._knowledge.remember(plan)
        self._adopt(plan, now)
        self.status, self._said_at = self._status(0.0), now
        return [self._as_own(plan)]

    def _as_own(self, plan):
        self._sequence += 1
        return replace(plan, robot_id=self._id, boot_epoch=self._boot, sequence=self._sequence)

    def _status(self, stalled):
        last = self._last
        if last is None:
            return JointStatus(stalled=stalled, is_proposing=self._proposer.is_about)
        return JointStatus(last.plan.epoch, last.plan.proposer, self._follower is not None, last.progress, stalled,
                           self._proposer.is_about)

    # The plan in force

    def _follow(self, now, position, plan_end):
        follower = self._follower
        if follower is None:
            return
        gone = set()
        for member in follower.plan.members:
            status = self._knowledge.status(member)
            if member == self._id or status is None:
                continue
            if status.version == follower.plan.version:
                follower.learn(status.progress)
            if self._has_left(member, status, now):
                self._follower = None
                return
            if self._knowledge.is_silent(member, now):
                gone.add(member)
        follower.advance(position, plan_end, now)
        if follower.is_over(gone):
            self._follower = None

    def _has_left(self, member, status, now):
        """Whether a member follows a plan without this robot, or has given up this one."""
        plan = self._follower.plan
        if status.version == plan.version:
            return not status.is_followed and status.progress.get(member, 0) < plan.moves(member)
        if status.version < plan.version:
            return False
        newer = self._knowledge.plan(status.version)
        if newer is not None:
            return self._id not in newer.members
        return now - self._left_at.setdefault(member, now) > _LEFT

    def _said_again(self, now):
        """Return the plan if it is this robot's turn to say it again, for a member that seems not to have it."""
        if self._follower is None:
            return []
        plan = self._follower.plan
        turn = 0.1 * plan.members.index(self._id)
        lacking = (self._knowledge.status(member).version < plan.version for member in plan.members
                   if member != self._id and not self._knowledge.is_silent(member, now))
        if now - self._said_at < _REPEAT + turn or not any(lacking):
            return []
        self._said_at = now
        return [self._as_own(plan)]

    def _waits(self, now, plan_end, is_done, stalled):
        """Return why the robot waits, None if it does not."""
        follower = self._follower
        if follower is not None:
            others = follower.waits_for(follower.released)
            if follower.has_finished or not others or follower.released > follower.done:
                return None
            return HoldUp(now - follower.waiting, Reason.TURN, tuple(others))
        if is_done or stalled < STALLED:
            return None
        if not self._is_blocked():
            return HoldUp(now - stalled, Reason.STALLED)
        since = now - stalled
        if self.held_up is not None and self.held_up.reason is Reason.BLOCKED:
            since = min(since, self.held_up.since)
        return HoldUp(since, Reason.BLOCKED, tuple(other for other, _ in self._knowledge.standing(now, plan_end)))

    def _is_blocked(self):
        """Whether the newest plan left this robot where it was, away from its goal."""
        if self._last is None:
            return False
        plan = self._last.plan
        way = plan.ways[plan.members.index(self._id)]
        return len(way) == 1 and bool(np.linalg.norm(way[-1] - self._goal) > HOME)
