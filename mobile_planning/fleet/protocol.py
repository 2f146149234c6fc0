"""Proposals and promises: how robots that share no cycle change their plans without ever colliding.

A robot drives the plan in force, which ends at rest, and may propose a
successor. It commits the successor only when every peer has promised to stay
clear of it, and only before its first knot. A peer promises when its own plan in
force, and its own open proposal, keep apart from the proposal; where two open
proposals clash the lower id's stands and the other is withdrawn for good.

So at any instant the plans in force of two robots are apart, for ever, under any
loss, delay, reordering and duplication. For take two successors, one of each
robot, that were both committed: each robot judged the other's. It can only judge
what it has heard, so they cannot both have judged before they opened their own.
The one that judged with its own already open, or in force, found the two apart
or withdrew its own, and a withdrawn proposal is never committed.

That a robot also proposes nothing that clashes with what it has promised is no
part of this argument: it spares everybody proposals that cannot be promised.
No clock and no I/O here.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.message import Link, RobotMsg

#: Whether two plans keep apart from now on: (own plan, peer's plan, peer's radius [m]).
Apart = Callable[[Plan, Plan, float], bool]


@dataclass
class Peer:
    """What is known of one peer: its newest message and what it was promised."""

    message: RobotMsg | None = None
    promised: int = 0

    def plans(self) -> list[Plan]:
        """Return the plans to keep apart from: the one in force, and a promised successor."""
        message = self.message
        if message is None:
            return []
        if self.promised and self.promised == message.proposal_seq:
            return [message.plan, message.proposal]
        return [message.plan]


@dataclass
class Protocol:
    """One robot's side of all its links.

    Attributes
    ----------
    robot_id, epoch : int
    plan, plan_seq : Plan, int
        In force.
    proposal, proposal_seq : Plan or None, int
        Open; the number of the last one made.
    peers : dict of int to Peer
        Everybody whose promise a commit needs.
    """

    robot_id: int
    epoch: int
    plan: Plan
    plan_seq: int = 0
    proposal: Plan | None = None
    proposal_seq: int = 0
    peers: dict[int, Peer] = field(default_factory=dict)
    promised_by: dict[int, int] = field(default_factory=dict)
    ignored: int = 0

    def join(self, roster: list[int]) -> None:
        """From now on a commit needs the promises of all in ``roster`` but this robot."""
        self.peers = {peer: self.peers.get(peer, Peer()) for peer in roster if peer != self.robot_id}

    def hear(self, message: RobotMsg, apart: Apart, epoch_is_bound: bool) -> bool:
        """Take in a peer's message; return whether it was news.

        Own, stale, foreign and incomplete messages are ignored and counted, and
        so is a restarted peer once the mission runs: nothing then tells where its
        body is.
        """
        peer = self.peers.get(message.robot_id)
        if peer is None or message.plan is None or message.plan.step != self.plan.step or self._is_stale(
                peer.message, message, epoch_is_bound):
            self.ignored += 1
            return False
        if peer.message is not None and peer.message.boot_epoch != message.boot_epoch:
            # Its numbers count anew: a promise to, or of, the robot before the restart says nothing now.
            peer.promised = 0
            self.promised_by.pop(message.robot_id, None)
        peer.message = message
        if message.proposal_seq != peer.promised:
            peer.promised = 0
        if message.proposal_seq and not peer.promised and self._can_promise(message, apart):
            peer.promised = message.proposal_seq
        mine = message.links.get(self.robot_id)
        if mine is not None and mine.epoch == self.epoch:
            self.promised_by[message.robot_id] = mine.promised
        return True

    @staticmethod
    def _is_stale(known, message, epoch_is_bound):
        if known is None:
            return False
        if message.boot_epoch != known.boot_epoch:
            return epoch_is_bound or message.boot_epoch < known.boot_epoch
        return message.sequence <= known.sequence

    def _can_promise(self, message, apart):
        """Whether own plans keep apart from the proposal; a clashing own proposal of a higher id gives way."""
        if not apart(self.plan, message.proposal, message.radius):
            return False
        if self.proposal is not None and not apart(self.proposal, message.proposal, message.radius):
            if self.robot_id < message.robot_id:
                return False
            self.withdraw()
        return True

    def propose(self, plan: Plan) -> None:
        """Open a proposal; the caller has checked that it keeps apart from all ``peers``' plans."""
        self.proposal_seq += 1
        self.proposal = plan

    def withdraw(self) -> None:
        """Drop the open proposal; it will never be committed."""
        self.proposal = None

    def is_promised(self) -> bool:
        """Whether every peer has promised to stay clear of the open proposal."""
        return self.proposal is not None and all(
            self.promised_by.get(peer) == self.proposal_seq for peer in self.peers)

    def commit(self, plan: Plan) -> None:
        """Put ``plan``, the old one continued by the proposal, in force."""
        self.plan, self.plan_seq, self.proposal = plan, self.proposal_seq, None

    def links(self) -> dict[int, Link]:
        """Return what to tell the peers: heard so far, promised so far."""
        return {peer_id: Link(peer.message.boot_epoch, peer.message.sequence, peer.promised)
                for peer_id, peer in self.peers.items() if peer.message is not None}
