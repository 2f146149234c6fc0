"""Joint request: for whom a joint plan is made, and all it takes to make it."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.joint_ground import GroundStore
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.joint_plan import GAP, Member, plan_jointly
from mobile_planning.fleet.roadmap import TIGHT, Roadmap


#: Steps of a plan that can be told in any case, but for very many robots.
_TOLD = 60


@dataclass(frozen=True, eq=False)
class Candidate:
    """A robot that can be asked to join a plan.

    Attributes
    ----------
    end, goal : (2,) ndarray [m]
        Where its plan in force ends, and where it wants to go.
    radius : float [m]
    stalled : float [s]
        How long it has made no progress.
    lanes : frozenset of int
        That it will drive through.
    partners : frozenset of int
        The members of the joint plan that it follows.
    lead : float [m]
        What it has to drive until its plan ends.
    """

    end: NDArray[np.float64]
    goal: NDArray[np.float64]
    radius: float
    stalled: float = 0.0
    lanes: frozenset[int] = frozenset()
    partners: frozenset[int] = frozenset()
    lead: float = 0.0


def gather(candidates: Mapping[int, Candidate], robot_id: int, reach: float) -> tuple[list[int], bool]:
    """Return who is to join a plan of a robot, itself included, and whether a lane is part of it.

    Parameters
    ----------
    candidates : mapping of int to Candidate
        By id, the robot among them.
    robot_id : int
    reach : float [m]
        All whose plans end so near to that of the robot join; and with each of them all who follow a plan with it, and
        all who use a lane that it uses.
    """
    here = candidates[robot_id].end
    group = {other for other, each in candidates.items() if np.linalg.norm(each.end - here) < reach}
    while True:
        lanes = frozenset().union(*(candidates[other].lanes for other in group))
        partners = frozenset().union(*(candidates[other].partners for other in group))
        more = {other for other, each in candidates.items() if other in partners or each.lanes & lanes}
        if more <= group:
            return sorted(group), bool(lanes)
        group |= more


def standing_beside(discs: Iterable[tuple[ArrayLike, float]], staying: Iterable[tuple[ArrayLike, float]],
                    members: Iterable[Candidate]) -> tuple[tuple[NDArray[np.float64], float], ...]:
    """Return the places (2,) [m] and radii [m] of all that will not move, without those that are members.

    Parameters
    ----------
    discs : iterable of ((2,) array_like [m], float [m])
        Those that nobody has a contract with any more.
    staying : iterable of ((2,) array_like [m], float [m])
        Those whose contracts stand: their radii come back larger, for the lines between.
    members : iterable of Candidate
    """
    ends, found = [np.asarray(member.end, float) for member in members], []
    wider = ((place, radius, GAP - TIGHT) for place, radius in staying)
    for place, radius, more in (*((place, radius, 0.0) for place, radius in discs), *wider):
        place = np.asarray(place, float)
        # One and the same body may be known twice.
        taken = [*ends, *(other for other, _ in found)]
        if not taken or np.linalg.norm(np.array(taken) - place, axis=1).min() > 0.5 * radius:
            found.append((place, radius + more))
    return tuple(found)


@dataclass(frozen=True, eq=False)
class GroundRequest:
    """What has to be made before a joint plan can be thought of; it is asked for and answered like a plan.

    Attributes
    ----------
    grounds : GroundStore
    radii : (float, float) [m]
    ids : tuple of int
        Nobody is led anywhere.
    """

    grounds: GroundStore
    radii: tuple[float, float]
    ids: tuple[int, ...] = ()

    def plan(self) -> None:
        """Make the ground, in some ten milliseconds or more; no plan comes of it."""
        self.grounds.make(self.radii)


@dataclass(frozen=True, eq=False)
class JointRequest:
    """All it takes to make a joint plan, so that it can be made beside the cycle.

    Attributes
    ----------
    roadmap : Roadmap
    proposer, boot_epoch, epoch : int
    ids : tuple of int
    members : tuple of Member
    standing : tuple of ((2,) array_like [m], float [m])
        Places and radii of those who will not move, see `standing_beside`.
    horizon : int
        Steps.
    """

    roadmap: Roadmap
    proposer: int
    boot_epoch: int
    epoch: int
    ids: tuple[int, ...]
    members: tuple[Member, ...]
    standing: tuple[tuple[ArrayLike, float], ...]
    horizon: int

    def plan(self) -> JointPlan | None:
        """Return the plan, in some ten milliseconds or more; None if it is too long to be told."""
        for horizon in (self.horizon, min(self.horizon, _TOLD)):
            try:
                return self._plan_of(horizon)
            except InvalidInput:
                # Ways of a hundred metres: their beginnings are enough for now.
                continue
        return None

    def _plan_of(self, horizon):
        found = plan_jointly(self.roadmap, self.members, np.random.default_rng((self.proposer, self.epoch)),
                             self.standing, horizon)
        needs = tuple(tuple(tuple((self.ids[other], count) for other, count in need) for need in each)
                      for each in found.needs)
        return JointPlan(self.proposer, self.boot_epoch, 0, self.epoch, self.proposer, self.ids, tuple(found.ways),
                         needs)
