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

from mobile_planning.errors import PlanningError
from mobile_planning.fleet.follower import Follower
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.joint_message import MAX_MEMBERS, MAX_MOVES, JointPlan, JointStatus
from mobile_planning.fleet.joint_plan import Member
from mobile_planning.fleet.joint_request import Candidate, JointRequest, gather, standing_beside
from mobile_planning.fleet.lanes import LaneFinder
from mobile_planning.fleet.message import Mode, RobotMsg
from mobile_planning.fleet.roadmap import Roadmap
from mobile_planning.world.environment import Environment

#: A robot proposes after so long [s] without progress: on its own, where it may go on by its plan, where it waits.
_STALLED, _STUCK, _WAITED = 1.5, 3.5, 12.0
#: Lanes are looked at so often [s].
_LOOK_EVERY = 1.0
#: Whoever has not been heard for so long [s] counts as standing for ever.
_SILENT = 3.0
#: A plan for robots within this [m], and twice as far each time one is due again so soon [s].
_GROUP, _AGAIN = 2.5, 12.0
#: Steps of a plan, by how often one was due; then it is whole.
_HORIZONS = (10, 25)
#: Whoever is about to propose waits so long [s] for one with a lower id that is, too.
_DEFER = 0.75
#: After so many plans in a row the next one comes only after a pause [s], that doubles each time up to the longest.
_TRIED, _PAUSE, _LONGEST_PAUSE = 3, 2.0, 8.0
#: An answer to a request is waited for so long [s].
_PATIENCE = 5.0
#: A plan that a member lacks is said again so often [s].
_REPEAT = 0.5
#: A member that has left for a plan that is unknown here for so long [s] does not come back.
_LEFT = 1.5
#: A plan that ends this near to the goal [m] leads home.
_HOME = 0.02
_MAX_PLANS = 32


class Coordination:
    """What one robot knows of joint plans, and does about them.

    Parameters
    ----------
    robot_id, boot_epoch : int
    environment : Environment
        The roadmap is made when a plan is first due, or by `prepare`.
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
        self._goal: NDArray[np.float64] | None = None
        self._request: JointRequest | None = None
        self._requested_at = -np.inf
        self._id, self._boot, self._radius, self._v_max, self._reach = robot_id, boot_epoch, radius, v_max, reach
        self._environment = environment
        self._roadmaps: dict[tuple, Roadmap] = {}
        self._lanes: LaneFinder | None = None
        self._heard: dict[int, tuple[RobotMsg, float]] = {}
        self._plans: dict[tuple[int, int], JointPlan] = {}
        self._follower: Follower | None = None
        self._last: Follower | None = None
        self._sequence, self._level = 0, 0
        self._proposed_at = self._look_at = self._said_at = -np.inf
        self._proposing_since: float | None = None
        self._left_at: dict[int, float] = {}
        self._is_contested = False

    def prepare(self) -> None:
        """Make the roadmap now: from some ten milliseconds on, the larger the world the longer."""
        self._lane_finder()

    def enter(self, environment: Environment) -> None:
        """Plan in another static world from now on; a plan in force led through the one before."""
        self._environment, self._lanes, self._is_contested = environment, None, False
        self._roadmaps.clear()
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
        """Take no further part in the plan in force, and make none: the others drop it when they hear of that."""
        self._follower = self._request = self._proposing_since = None
        self._requested_at = -np.inf
        self.status = self._status(0.0)

    # What comes in

    def hear(self, message: RobotMsg | JointPlan, now: float) -> bool:
        """Take in a ``message`` of a peer at ``now`` [s]; return whether it was news."""
        if isinstance(message, RobotMsg):
            self._heard[message.robot_id] = message, now
            return True
        if message.robot_id not in self._heard:
            return False
        if self._follower is not None and message.version == self._follower.plan.version:
            self._said_at = now
        if message.version in self._plans:
            return False
        self._remember(message)
        if self._id in message.members and self._is_newer(message):
            self._adopt(message, now)
        return True

    def _remember(self, plan):
        self._plans[plan.version] = plan
        if len(self._plans) > _MAX_PLANS:
            del self._plans[min(self._plans)]

    def _is_newer(self, plan):
        """Whether to follow ``plan``: a plan that was left is not taken up again, nor is another of its time."""
        if self._follower is not None:
            return plan.version > self._follower.plan.version
        return self._last is None or plan.epoch > self._last.plan.epoch

    def _adopt(self, plan, now):
        self._follower = self._last = Follower(plan, self._id, now)
        self._proposing_since, self._left_at = None, {}

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
            self._follower = None
        self._goal = goal
        self._follow(now, position, plan_end)
        self.held_up = self._waits(now, plan_end, is_done, stalled)
        if now - self._requested_at > _PATIENCE and self._is_due(now, plan_end, goal, is_done, stalled):
            self._request = self._made_request(now, plan_end, goal, stalled, standing)
            self._requested_at = -np.inf if self._request is None else now
        said = self._said_again(now)
        self.status = self._status(0.0 if is_done or self._follower is not None else stalled)
        return said

    def take_request(self) -> JointRequest | None:
        """Return the request for a plan that has fallen due, if any, once; its answer goes to `propose`."""
        request, self._request = self._request, None
        return request

    def propose(self, plan: JointPlan | None, now: float) -> list[JointPlan]:
        """Put in force what came of a request at ``now`` [s]; return what is to be sent.

        A plan that comes after a newer one is dropped.
        """
        self._requested_at = -np.inf
        if plan is None or not self._is_newer(plan):
            return []
        self._remember(plan)
        self._adopt(plan, now)
        self.status, self._said_at = self._status(0.0), now
        return [self._as_own(plan)]

    def _as_own(self, plan):
        self._sequence += 1
        return replace(plan, robot_id=self._id, boot_epoch=self._boot, sequence=self._sequence)

    def _status(self, stalled):
        last = self._last
        if last is None:
            return JointStatus(stalled=stalled, is_proposing=self._proposing_since is not None)
        return JointStatus(last.plan.epoch, last.plan.proposer, self._follower is not None, last.progress, stalled,
                           self._proposing_since is not None)

    def _is_silent(self, other, now):
        return other not in self._heard or now - self._heard[other][1] > _SILENT

    # The plan in force

    def _follow(self, now, position, plan_end):
        follower = self._follower
        if follower is None:
            return
        gone = set()
        for member in follower.plan.members:
            if member == self._id or member not in self._heard:
                continue
            status = self._heard[member][0].joint
            if status.version == follower.plan.version:
                follower.learn(status.progress)
            if self._has_left(member, status, now):
                self._follower = None
                return
            if self._is_silent(member, now):
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
        newer = self._plans.get(status.version)
        if newer is not None:
            return self._id not in newer.members
        return now - self._left_at.setdefault(member, now) > _LEFT

    def _said_again(self, now):
        """Return the plan if it is this robot's turn to say it again, for a member that seems not to have it."""
        if self._follower is None:
            return []
        plan = self._follower.plan
        turn = 0.1 * plan.members.index(self._id)
        lacking = (self._heard[member][0].joint.version < plan.version for member in plan.members
                   if member != self._id and not self._is_silent(member, now))
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
        if is_done or stalled < _STALLED:
            return None
        if not self._is_blocked():
            return HoldUp(now - stalled, Reason.STALLED)
        since = now - stalled
        if self.held_up is not None and self.held_up.reason is Reason.BLOCKED:
            since = min(since, self.held_up.since)
        return HoldUp(since, Reason.BLOCKED, tuple(other for other, _ in self._stand(now, (), plan_end)))

    def _is_blocked(self):
        """Whether the newest plan left this robot where it was, away from its goal."""
        if self._last is None:
            return False
        plan = self._last.plan
        way = plan.ways[plan.members.index(self._id)]
        return len(way) == 1 and bool(np.linalg.norm(way[-1] - self._goal) > _HOME)

    # Proposals

    def _is_due(self, now, plan_end, goal, is_done, stalled):
        """Whether to propose a plan now; who is about to says so, and waits for one with a lower id."""
        if not self._is_in_need(now, plan_end, goal, is_done, stalled):
            self._proposing_since = None
            return False
        if self._proposing_since is None:
            self._proposing_since = now
            return False
        lower = any(other < self._id and message.joint.is_proposing and now - at < _DEFER
                    for other, (message, at) in self._heard.items())
        return not lower or now - self._proposing_since >= _DEFER

    def _is_in_need(self, now, plan_end, goal, is_done, stalled):
        follower = self._follower
        if follower is not None:
            if follower.has_finished:
                return False
            if follower.stuck > _STUCK or follower.waiting > _WAITED:
                return True
            return any(self._is_silent(other, now) for other in follower.waits_for(follower.released))
        if is_done or np.linalg.norm(plan_end - goal) <= _HOME:
            return False
        if stalled >= _STALLED:
            # What leads nowhere is tried again, but ever more rarely.
            return now - self._proposed_at >= min(_PAUSE * 2.0**(self._level - _TRIED), _LONGEST_PAUSE)
        if now >= self._look_at and (self._environment.obstacles or self._environment.grid is not None):
            self._look_at = now + _LOOK_EVERY
            self._is_contested = self._meets_somebody(now, plan_end, goal)
        return self._is_contested

    def _meets_somebody(self, now, plan_end, goal):
        """Whether somebody comes against this robot in a lane."""
        lanes = self._lane_finder()
        own = lanes.uses(plan_end, goal, self._radius, self._v_max) if lanes is not None else {}
        if not own:
            return False
        for message in self._around(now, plan_end).values():
            if message.mode is Mode.DONE:
                continue
            theirs = lanes.uses(message.plan.end, message.goal, message.radius, message.v_max)
            if any(lane in theirs and use.meets(theirs[lane]) for lane, use in own.items()):
                return True
        return False

    def _around(self, now, plan_end):
        """Return the newest messages of those within reach that can move, by id."""
        return {other: message for other, (message, _) in self._heard.items()
                if not self._is_silent(other, now) and message.mode is not Mode.STOPPED
                and np.linalg.norm(message.plan.end - plan_end) < self._reach}

    def _made_request(self, now, plan_end, goal, stalled, standing):
        """Return the request for a plan for all around; None where none can be made."""
        roadmap, lanes = self._roadmap(), self._lane_finder()
        if roadmap is None:
            return None
        self._level = self._level + 1 if now - self._proposed_at < _AGAIN else 0
        self._proposed_at = now
        around, own = self._around(now, plan_end), self._follower
        candidates = {other: Candidate(
            message.plan.end, message.goal, message.radius, message.joint.stalled,
            frozenset(lanes.uses(message.plan.end, message.goal, message.radius, message.v_max)),
            self._partners(message.joint)) for other, message in around.items()}
        candidates[self._id] = Candidate(
            plan_end, goal, self._radius, stalled, frozenset(lanes.uses(plan_end, goal, self._radius, self._v_max)),
            frozenset() if own is None else frozenset(own.plan.members))
        group, has_lane = gather(candidates, self._id, _GROUP * 2.0**self._level)
        ids = tuple(group[:MAX_MEMBERS])
        members = [candidates[each] for each in ids]
        epochs = [version[0] for version in self._plans]
        epochs += [message.joint.epoch for message, _ in self._heard.values()]
        return JointRequest(
            roadmap, self._id, self._boot, 1 + max(epochs, default=0), ids,
            tuple(Member(each.end, each.goal, each.radius, each.stalled) for each in members),
            standing_beside([*standing, *self._staying(now, ids, plan_end)], members),
            MAX_MOVES if has_lane or self._level >= len(_HORIZONS) else _HORIZONS[self._level])

    def _partners(self, status):
        """Return the members of the plan that a robot of this ``status`` follows, as far as it is known here."""
        plan = self._plans.get(status.version) if status.is_followed else None
        return frozenset() if plan is None else frozenset(plan.members)

    def _staying(self, now, ids, plan_end):
        """Return places and radii of those within reach that will not move for a plan of ``ids``."""
        return [(message.plan.end, message.radius) for _, message in self._stand(now, ids, plan_end)]

    def _stand(self, now, ids, plan_end):
        """Return ids and messages of those within reach that stand, without ``ids``."""
        return [(other, message) for other, (message, _) in sorted(self._heard.items())
                if other not in ids and np.linalg.norm(message.plan.end - plan_end) < self._reach
                and (self._is_silent(other, now) or message.mode in (Mode.STOPPED, Mode.DONE))]

    def _roadmap(self):
        """Return the roadmap for all that are about; None where the world has no extent."""
        radii = [self._radius, *(message.radius for message, _ in self._heard.values())]
        key = min(radii), max(radii)
        if key not in self._roadmaps:
            try:
                self._roadmaps[key] = Roadmap(self._environment, *key)
            except PlanningError:
                return None
        return self._roadmaps[key]

    def _lane_finder(self):
        """Return what finds lanes for bodies like this one; None where the world has no extent."""
        roadmap = self._roadmap()
        if roadmap is not None and (self._lanes is None or self._lanes.roadmap is not roadmap):
            self._lanes = LaneFinder(roadmap)
        return self._lanes
