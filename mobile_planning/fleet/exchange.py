"""Exchange: who has heard whose intention and keeps clear of it, so that a robot drives only what the others allow.

A robot's *candidate* is the section that it would drive next; its plan in force is the one before, which ends at rest.
Whoever hears a candidate *grants* it if it is clear of both own plans, the one in force and the own candidate. From
then on he keeps clear of it, until he hears that it was dropped. A candidate is driven only if all peers have granted
it, so that all plans which two robots may drive are clear of each other at any time: whichever of two candidates is
granted or driven first, its counterpart was compared with it at the one robot that saw both. Loss, delay and disorder
of messages make robots wait, and never meet.

Of two candidates that are not clear of each other the senior's stays. Nobody waits for ever: a peer that is silent for
longer than the patience counts as dead; it is asked no more, and the plans it was granted, which end at rest, stand.
That is the one assumption: two robots that live hear each other once within their patience.
"""
from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.message import Death, Link, LinkMode, RobotMsg

#: The number of a plan that was never said: the rest of a robot that is not switched on yet, or dead.
_UNSAID = -1


@dataclass(frozen=True, eq=False)
class Proposal:
    """A plan with its number.

    Attributes
    ----------
    number : int
    plan : Plan
    """

    number: int
    plan: Plan


@dataclass(eq=False)
class Peer:
    """What is known of one other robot.

    Attributes
    ----------
    since : float [s]
        When it was last heard, or when the robot began to listen.
    message : RobotMsg or None
        The newest.
    plans : dict of int to Plan
        By number, all that it may drive.
    request : Proposal or None
        Its candidate, not granted yet.
    granted : int
        Number of its newest candidate that was granted.
    has_granted : int
        Number of the own candidate that it has granted.
    radius : float [m]
    is_dead : bool
        That is certain.
    """

    since: float
    message: RobotMsg | None = None
    plans: dict[int, Plan] = field(default_factory=dict)
    request: Proposal | None = None
    granted: int = _UNSAID
    has_granted: int = _UNSAID
    radius: float = 0.0
    is_dead: bool = False

    @property
    def epoch(self) -> int:
        """Of its newest message, 0 for none."""
        return 0 if self.message is None else self.message.boot_epoch


class Exchange:
    """One robot's part in the exchange of intentions.

    Parameters
    ----------
    robot_id, epoch : int
    plan : Plan
        In force.
    are_clear : callable
        Whether two plans, the own and a peer's, are clear of each other: ``are_clear(own, peer_id, other)``.
    patience : float [s]
        Who is silent for longer counts as dead; infinite to wait for ever.
    rest_time : float [s]
        Every plan has ended this long after its first knot.
    """

    def __init__(self, robot_id: int, epoch: int, plan: Plan, are_clear: Callable[[Plan, int, Plan], bool],
                 patience: float, rest_time: float):
        self.robot_id, self.epoch, self.rest_time = robot_id, epoch, rest_time
        self.in_force, self.candidate = Proposal(0, plan), None
        self.peers: dict[int, Peer] = {}
        self.ignored = 0
        self._are_clear, self._patience = are_clear, patience
        self._numbers = self._sequence = 0

    def join(self, roster: Collection[int], resting: Mapping[int, tuple[ArrayLike, float]], now: float) -> None:
        """Listen to ``roster`` from ``now`` [s] on; of those in ``resting``, not switched on yet, place and radius."""
        step = self.in_force.plan.step
        for other in roster:
            if other == self.robot_id or other in self.peers:
                continue
            self.peers[other] = peer = Peer(now)
            if other in resting:
                place, peer.radius = resting[other]
                peer.plans[_UNSAID] = Plan.at_rest(self.in_force.plan.first_knot, step, (*place, 0.0))
                peer.is_dead = True

    # What comes in

    def hear(self, message: RobotMsg, now: float) -> bool:
        """Take in a peer's ``message``; return whether it was news."""
        peer = self.peers.get(message.robot_id)
        known = peer.message if peer is not None else None
        if peer is None or known is not None and ((message.boot_epoch, message.sequence)
                                                  <= (known.boot_epoch, known.sequence)):
            self.ignored += 1
            return False
        if message.boot_epoch > peer.epoch:
            # Its new process stands where the old one's plan ends, and knows of no grant.
            peer.plans, peer.granted = {}, _UNSAID
        peer.message, peer.since, peer.radius, peer.is_dead = message, now, message.radius, False
        driven, number = message.links[message.robot_id].granted, message.plan_seq
        peer.plans = {key: plan for key, plan in peer.plans.items() if key in (driven, number)}
        peer.request = None
        if driven == 0 and not peer.plans:
            # Number 0 is the rest that every robot starts with.
            peer.plans[0] = Plan.at_rest(message.plan.first_knot, message.plan.step, (*message.lz, 0.0))
        if number == driven:
            peer.plans[number] = message.plan
        elif number not in peer.plans and driven in peer.plans:
            peer.request = Proposal(number, message.plan)
        link = message.links.get(self.robot_id)
        peer.has_granted = link.granted if link is not None and link.epoch == self.epoch else _UNSAID
        return True

    def bury(self, death: Death) -> bool:
        """Take in a certificate of ``death``; return whether it was news."""
        peer = self.peers.get(death.robot_id)
        if peer is None or peer.is_dead or death.boot_epoch < peer.epoch:
            self.ignored += 1
            return False
        # The body rests there, whatever was heard of its plans.
        plan = self.in_force.plan
        peer.plans = {_UNSAID: Plan.at_rest(plan.first_knot, plan.step, (*death.place, 0.0))}
        peer.radius = peer.radius if death.radius is None else death.radius
        peer.is_dead, peer.request = True, None
        return True

    # What is decided

    def grant(self) -> bool:
        """Grant what is clear of the own plans, and give way to seniors; return whether anything was granted."""
        has_granted = False
        for other, peer in self.peers.items():
            if peer.request is None or not self._are_clear(self.in_force.plan, other, peer.request.plan):
                continue
            if self.candidate is not None and not self._are_clear(self.candidate.plan, other, peer.request.plan):
                if not self.is_senior(other):
                    continue
                self.candidate = None
            peer.plans[peer.request.number] = peer.request.plan
            peer.granted, peer.request, has_granted = peer.request.number, None, True
        return has_granted

    def is_senior(self, other: int) -> bool:
        """Return whether ``other`` goes before this robot: the lower id does."""
        return other < self.robot_id

    def propose(self, plan: Plan) -> None:
        """Make ``plan`` the candidate."""
        self._numbers += 1
        self.candidate = Proposal(self._numbers, plan)

    def drop(self) -> None:
        """Have no candidate any more."""
        self.candidate = None

    def take(self, now: float, is_far: Callable[[Peer], bool]) -> Plan | None:
        """Return the candidate and put it in force, if all that count have granted it; else None."""
        if self.candidate is None or not all(
                peer.has_granted == self.candidate.number or self.is_silent(other, now) or is_far(peer)
                for other, peer in self.peers.items()):
            return None
        if not self.is_clear(self.candidate.plan):
            return None
        self.in_force, self.candidate = self.candidate, None
        return self.in_force.plan

    def impose(self, plan: Plan) -> tuple[int, ...]:
        """Put ``plan`` in force, which nobody has granted; return the robots that it is not clear of.

        It is clear of all that a peer may drive, now and later, whose plans it is clear of now: a peer drives only what
        was granted to it, here too, and what is granted from now on is clear of this plan. All but that of a peer that
        imposes a plan of its own meanwhile.
        """
        self._numbers += 1
        self.in_force, self.candidate = Proposal(self._numbers, plan), None
        return tuple(sorted({other for other, theirs in self.allowed() if not self._are_clear(plan, other, theirs)}))

    def forbidding(self, now: float, at_rest: bool) -> list[int]:
        """Return the robots that have not granted the candidate and count at ``now`` [s], moving or ``at_rest``."""
        return [] if self.candidate is None else [
            other for other, peer in self.peers.items()
            if peer.has_granted != self.candidate.number and not self.is_silent(other, now)]

    def is_clear(self, plan: Plan) -> bool:
        """Return whether ``plan`` is clear of all that the others may drive."""
        return all(self._are_clear(plan, other, theirs) for other, theirs in self.allowed())

    def allowed(self) -> Iterator[tuple[int, Plan]]:
        """Yield each robot's plans that it may drive."""
        for other, peer in self.peers.items():
            for plan in peer.plans.values():
                yield other, plan

    def requests(self) -> Iterator[tuple[int, Plan]]:
        """Yield the candidates that were not granted yet."""
        for other, peer in self.peers.items():
            if peer.request is not None:
                yield other, peer.request.plan

    def is_silent(self, other: int, now: float) -> bool:
        """Return whether ``other`` counts as dead."""
        peer = self.peers[other]
        return peer.is_dead or now - peer.since > self._patience

    # What goes out

    def links(self, now: float) -> dict[int, Link]:
        """Return what was granted to each peer and, under the own id, the number of the plan in force.

        Who counts as dead at ``now`` [s] is passed like an obstacle, and nobody is bound to him.
        """
        links = {other: Link(peer.epoch, self._mode(other, now), granted=peer.granted)
                 for other, peer in self.peers.items()}
        return {**links, self.robot_id: Link(self.epoch, LinkMode.CON, granted=self.in_force.number)}

    def _mode(self, other, now):
        if self.is_silent(other, now):
            return LinkMode.STATIC
        return LinkMode.CON if self.peers[other].granted >= 0 else LinkMode.NONE

    def next_sequence(self) -> int:
        """Return the number of the next own message."""
        self._sequence += 1
        return self._sequence

    @property
    def heard(self) -> dict[int, RobotMsg]:
        """The newest message of each peer heard."""
        return {other: peer.message for other, peer in self.peers.items() if peer.message is not None}


def gap(place: NDArray, peer: Peer, now: float) -> float:
    """Return how far [m] at least a peer is from ``place`` (2,) [m], by its newest message; 0 without one."""
    if peer.message is None:
        return 0.0
    said = peer.message.plan.first_knot * peer.message.plan.step
    travelled = peer.message.v_max * max(0.0, now - said)
    return max(0.0, float(np.linalg.norm(peer.message.lz - place)) - travelled)
