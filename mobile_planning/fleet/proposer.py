"""Proposer: when a robot asks for a joint plan, and for whom. No clock and no I/O."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet.follower import Follower
from mobile_planning.fleet.joint_ground import GroundStore, JointGround
from mobile_planning.fleet.joint_knowledge import JointKnowledge
from mobile_planning.fleet.joint_message import MAX_MEMBERS, MAX_MOVES, JointPlan
from mobile_planning.fleet.joint_plan import Member
from mobile_planning.fleet.joint_request import Candidate, GroundRequest, JointRequest, gather, standing_beside
from mobile_planning.fleet.message import Mode
from mobile_planning.world.environment import Environment

#: A plan that ends this near to the goal [m] leads home.
HOME = 0.02
#: A robot proposes after so long [s] without progress: on its own, where it may go on by its plan, where it waits.
STALLED, _STUCK, _WAITED = 1.5, 3.5, 12.0
#: Lanes are looked at so often [s].
_LOOK_EVERY = 1.0
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


class Proposer:
    """Knows when a joint plan is due, and says for whom it is to be made.

    Parameters
    ----------
    robot_id, boot_epoch : int
    environment : Environment
        Its roadmap is made by `prepare`, or asked for when it is needed.
    radius : float [m]
    v_max : float [m/s]
    knowledge : JointKnowledge
    """

    def __init__(self, robot_id: int, boot_epoch: int, environment: Environment, radius: float, v_max: float,
                 knowledge: JointKnowledge):
        self._id, self._boot, self._radius, self._v_max = robot_id, boot_epoch, radius, v_max
        self._knowledge = knowledge
        self.enter(environment)
        self._level, self._asked, self._void = 0, 0, 0
        self._proposed_at = self._void_at = self._requested_at = -np.inf
        self._since: float | None = None

    def enter(self, environment: Environment) -> None:
        """Plan in another static world from now on."""
        self._grounds, self._look_at = GroundStore(environment), -np.inf
        self._is_contested = self._lacks_ground = False

    def prepare(self) -> None:
        """Make the roadmap now, from some ten milliseconds on, the larger the world the longer; and load kernels."""
        from mobile_planning.fleet import pebble_kernels  # noqa: F401

        self._grounds.make(self._radii)

    @property
    def is_about(self) -> bool:
        """Whether a plan is due and not made yet."""
        return self._since is not None

    def rest(self, plan: JointPlan, now: float) -> None:
        """Note that ``plan`` is in force from ``now`` [s] on, whoever proposed it."""
        self._since = None
        if not any(plan.moves(member) for member in plan.members):
            self._void_at = now

    def forget(self) -> None:
        """Take back every request: what comes of it is not wanted any more."""
        self._since, self._requested_at, self._void = None, -np.inf, self._asked

    def takes(self, plan: JointPlan | None) -> bool:
        """Note that a request was answered; return whether ``plan`` is still wanted."""
        self._requested_at = -np.inf
        return plan is not None and plan.epoch > self._void

    def request(self, now: float, position: NDArray[np.float64], plan_end: NDArray[np.float64],
                goal: NDArray[np.float64], is_done: bool, stalled: float,
                standing: Sequence[tuple[ArrayLike, float]], own: Follower | None
                ) -> JointRequest | GroundRequest | None:
        """Return the request for a plan for all around if one is due at ``now`` [s]; each has an epoch of its own.

        Where it takes a roadmap first to plan, or to see whether a plan is due, the request is for that.

        Parameters
        ----------
        now, position, plan_end, goal, is_done, stalled, standing
            See `Coordination.update`.
        own : Follower or None
            The robot's part in the plan in force.
        """
        if now - self._requested_at <= _PATIENCE:
            return None
        is_due = self._is_due(now, plan_end, goal, is_done, stalled, own)
        if not self._grounds.knows(self._radii) and (is_due or self._lacks_ground):
            self._requested_at = now
            return GroundRequest(self._grounds, self._radii)
        ground = self._ground
        if not is_due or ground is None:
            return None
        self._level = self._level + 1 if now - self._proposed_at < _AGAIN else 0
        self._proposed_at = self._requested_at = now
        candidates = self._candidates(now, plan_end, ground.lanes)
        uses = ground.lanes.uses(plan_end, goal, self._radius, self._v_max)
        candidates[self._id] = Candidate(plan_end, goal, self._radius, stalled, frozenset(uses),
                                         frozenset() if own is None else frozenset(own.plan.members),
                                         float(np.linalg.norm(plan_end - position)))
        group, has_lane = gather(candidates, self._id, _GROUP * 2.0**self._level)
        ids = tuple(group[:MAX_MEMBERS])
        members = [candidates[each] for each in ids]
        staying = [(message.plan.end, message.radius)
                   for _, message in self._knowledge.standing(now, plan_end, without=ids)]
        self._asked = 1 + max(self._knowledge.epoch, self._asked)
        return JointRequest(
            ground.roadmap, self._id, self._boot, self._asked, ids,
            tuple(Member(each.end, each.goal, each.radius, each.stalled, each.lead) for each in members),
            standing_beside(standing, staying, members),
            MAX_MOVES if has_lane or self._level >= len(_HORIZONS) else _HORIZONS[self._level])

    def _candidates(self, now, plan_end, lanes):
        """Return all within reach that can move, by id."""
        found = {}
        for other, message in self._knowledge.around(now, plan_end).items():
            uses = lanes.uses(message.plan.end, message.goal, message.radius, message.v_max)
            found[other] = Candidate(message.plan.end, message.goal, message.radius, message.joint.stalled,
                                     frozenset(uses), self._knowledge.partners(message.joint),
                                     float(np.linalg.norm(message.plan.end - message.lz)))
        return found

    # When

    def _is_due(self, now, plan_end, goal, is_done, stalled, own):
        """Whether to propose a plan now; who is about to says so, and waits for one with a lower id."""
        if not self._is_in_need(now, plan_end, goal, is_done, stalled, own):
            self._since = None
            return False
        if self._since is None:
            self._since = now
            return False
        return not self._knowledge.has_rival(now, _DEFER) or now - self._since >= _DEFER

    def _is_in_need(self, now, plan_end, goal, is_done, stalled, own):
        if own is not None:
            if own.has_finished:
                return False
            if own.stuck > _STUCK or own.waiting > _WAITED:
                return True
            return any(self._knowledge.is_silent(other, now) for other in own.waits_for(own.released))
        if is_done or np.linalg.norm(plan_end - goal) <= HOME:
            return False
        # What leads nowhere is tried again, but ever more rarely.
        if now - max(self._proposed_at, self._void_at) < min(_PAUSE * 2.0**(self._level - _TRIED), _LONGEST_PAUSE):
            return False
        if stalled >= STALLED:
            return True
        world = self._grounds.environment
        if now >= self._look_at and (world.obstacles or world.grid is not None):
            ground = self._ground
            self._lacks_ground = ground is None
            if ground is None:
                return False
            self._look_at = now + _LOOK_EVERY
            self._is_contested = self._meets_somebody(now, plan_end, goal, ground.lanes)
        return self._is_contested

    def _meets_somebody(self, now, plan_end, goal, lanes):
        """Whether somebody comes against this robot in a lane."""
        own = lanes.uses(plan_end, goal, self._radius, self._v_max)
        if not own:
            return False
        for message in self._knowledge.around(now, plan_end).values():
            if message.mode is Mode.DONE or not any(
                    use.may_meet(lanes.soonest(lane, message.plan.end, message.v_max)) for lane, use in own.items()):
                continue
            theirs = lanes.uses(message.plan.end, message.goal, message.radius, message.v_max)
            if any(lane in theirs and use.meets(theirs[lane]) for lane, use in own.items()):
                return True
        return False

    # Where

    @property
    def _radii(self) -> tuple[float, float]:
        """Radii [m] of the smallest and the largest that are about."""
        radii = [self._radius, *self._knowledge.radii]
        return min(radii), max(radii)

    @property
    def _ground(self) -> JointGround | None:
        """The ground for all that are about; None where it is not made yet, or the world has no extent."""
        return self._grounds.get(self._radii)
