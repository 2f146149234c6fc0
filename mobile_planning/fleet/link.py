"""Links: what two robots have agreed on, as each of the two knows it, and how every event changes that.

Each side is a frozen value with pure transitions; what is asked of plans comes in
as an answer or a function, time as a number. At every instant a pair is in one of
three states: (a) the peer's contract is one of the owner's, and both plans satisfy
it; (b) one side is locked at rest, and the other's whole plan is clear of its
place; (c) neither may move within sight of the other, and when either last did,
they were out of sight, with time for both to come to rest. Every transition keeps
that, whatever messages are lost, late, doubled or out of order.

Epochs, ids and sequences only grow. No side reads the other's clock.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import Link, LinkMode

#: Contracts an owner may be bound to on one link: one in force, a stale offer and a fresh one beside it.
MAX_OPEN = 3
#: A robot slower than this [m/s] is at rest: it needs a lease to depart.
V_REST = 0.03
#: By how much [s] the owner waits longer than a lease lasts before it takes a silent peer to be at rest.
GRACE = 0.2

#: Whether the own plan in force satisfies a contract; whether it stays clear of a place (2,) [m] with a radius [m].
Fits = Callable[[Contract], bool]
Clear = Callable[[tuple, float], bool]


@dataclass(frozen=True)
class Terms:
    """What both sides of all links go by.

    Attributes
    ----------
    lease : float [s]
        A peer at rest may depart on a grant of what it sent less than this ago.
    rest_time : float [s]
        Every plan has ended this long after its commit.
    sensor_range : float [m]
        Everybody nearer than this, and twice ``margin`` more, is seen; inf without such a sensor.
    margin : float [m]
        No pair comes so much nearer or farther between two observations ``gap`` apart.
    gap : float [s]
        Observations farther apart than this may have missed something.
    """

    lease: float = 3.0
    rest_time: float = 3.75
    sensor_range: float = inf
    margin: float = 1.0
    gap: float = 0.5


class Held(NamedTuple):
    """A contract that a side is, or may become, bound to.

    Attributes
    ----------
    contract : Contract
    since : float [s]
        Own clock: when the owner made it; when the peer sent the message that it was built on.
    base_sequence : int
        Of that message.
    """

    contract: Contract
    since: float
    base_sequence: int = 0


@dataclass(frozen=True)
class Side:
    """One side of a link.

    Attributes
    ----------
    epoch : int
        Of the own process.
    born : float [s]
        When that started.
    mode : LinkMode
    other_epoch, dead_epoch : int
        The newest of the other that was heard; the newest known to be dead.
    place, radius : (2,) tuple, float [m]
        Where the other rests, while the mode is STATIC.
    distance : float [m]
        Of the pair, as last seen.
    doubt, drop : float [s]
        When the pair was last seen so far apart that the other may have given up a contract; that both may.
    """

    epoch: int
    born: float = 0.0
    mode: LinkMode = LinkMode.NONE
    other_epoch: int = 0
    dead_epoch: int = 0
    place: tuple[float, float] = (0.0, 0.0)
    radius: float = 0.0
    distance: float = 0.0
    doubt: float = -inf
    drop: float = -inf

    def is_past(self, epoch: int) -> bool:
        """Return whether what comes from this life of the other says nothing any more."""
        return epoch < self.other_epoch or epoch <= self.dead_epoch

    def rests_at(self, place: tuple[float, float], radius: float) -> Side:
        """Return the side of a robot that will not move before this one lets it."""
        return replace(self, mode=LinkMode.STATIC, place=place, radius=radius)

    def renewed(self, epoch: int, place: tuple[float, float] | None, radius: float, clear: Clear) -> Side:
        """The other's process runs anew, and its body rests at ``place``; None if it does not rest."""
        side = self._without_contracts()
        if self.mode in (LinkMode.CON, LinkMode.STATIC):
            if place is None or not clear(place, radius):
                return self
            side = side.rests_at(place, radius)
        # With NONE nothing changes: of two robots that each took the other to be at rest, both would move.
        return replace(side, other_epoch=epoch)

    def buried(self, epoch: int, place: tuple[float, float], radius: float, issued: float, clear: Clear) -> Side:
        """Nobody lived as the other when that was ``issued`` [s], and its body rests at ``place``."""
        is_stale = self.other_epoch > epoch or self.dead_epoch >= epoch or issued <= self.born + GRACE
        if is_stale or not clear(place, radius):
            return self
        side = self._without_contracts().rests_at(place, radius)
        return replace(side, other_epoch=epoch, dead_epoch=epoch)

    def told(self, entry: Link, terms: Terms) -> Side:
        """The other says that it does not take this robot to be at rest: out of its sight both may move."""
        if (self.mode is LinkMode.NONE and entry.epoch == self.epoch and terms.sensor_range < inf
                and entry.mode in (LinkMode.NONE, LinkMode.FAR)):
            return replace(self, mode=LinkMode.FAR)
        return self

    def observed(self, distance: float, is_after_gap: bool, now: float, terms: Terms) -> Side:
        """The pair is seen ``distance`` [m] apart: what may have lapsed for the other is no ground to move any more."""
        far = terms.sensor_range + terms.margin
        side = replace(self, distance=distance, doubt=now if is_after_gap or distance > far else self.doubt,
                       drop=now if distance > far + terms.margin else self.drop)
        if side.doubt == now and side.mode is LinkMode.STATIC and side.other_epoch > side.dead_epoch:
            side = replace(side, mode=LinkMode.FAR)
        return side._lapsed()

    def may_move(self, now: float, at_rest: bool, terms: Terms) -> bool:
        """Return whether this side lets its robot change its plan, which is at rest or not when that takes effect."""
        is_out_of_sight = self.distance > terms.sensor_range
        if self.mode is LinkMode.CON:
            return (is_out_of_sight or not self._is_doubted(self._in_force().since)) and self._has_lease(
                now, at_rest, terms)
        return self.mode is LinkMode.STATIC or self.mode is LinkMode.FAR and is_out_of_sight

    def _has_lease(self, now, at_rest, terms):
        return True

    def _is_doubted(self, since):
        return -inf < self.doubt and since <= self.doubt

    def _is_dropped(self, since):
        return -inf < self.drop and since <= self.drop


@dataclass(frozen=True)
class OwnerSide(Side):
    """The side of the lower id: it makes the contracts, and is bound to each from then on.

    Attributes
    ----------
    contracts : tuple of Held
        In the order of their ids; every commit satisfies all.
    acknowledged : int
        Id of the one that the peer has said to hold; 0 for none.
    promised : int
        Contracts up to this id but for that one are dead.
    next_id : int
    granted, granted_at : int, float [s]
        Newest message of the peer that named one of ``contracts``, and when it was heard.
    still_since : float [s] or None
        From when on the silent peer was seen at rest.
    is_heard : bool
        Whether the peer spoke since it was last taken to be at rest.
    """

    contracts: tuple[Held, ...] = ()
    acknowledged: int = 0
    promised: int = 0
    next_id: int = 1
    granted: int = -1
    granted_at: float = -inf
    still_since: float | None = None
    is_heard: bool = True

    @property
    def open(self) -> tuple[Held, ...]:
        """The contracts that the peer may take."""
        return tuple(held for held in self.contracts if held.contract.id > self.promised)

    @property
    def is_settled(self) -> bool:
        """Whether the peer holds the one contract there is, and neither may ever have given it up."""
        return self.mode is LinkMode.CON and len(self.contracts) == 1 and self.doubt == -inf

    def bound(self) -> tuple[Contract, ...]:
        """Return the contracts that every commit must satisfy."""
        return tuple(held.contract for held in self.contracts)

    @property
    def is_tethered(self) -> bool:
        """Whether the two are bound to stay in range of each other, as far as the owner knows."""
        return any(held.contract.tether is not None for held in self.contracts
                   if held.contract.id == self.acknowledged)

    def status(self) -> Link:
        """Return the grant."""
        return Link(self.other_epoch, self.mode, self.acknowledged, self.promised,
                    self.granted if self.mode is LinkMode.CON else -1)

    def may_offer(self, terms: Terms) -> bool:
        """Return whether one more contract may be offered."""
        return (self.other_epoch > self.dead_epoch and self.is_heard and len(self.contracts) < MAX_OPEN
                and self.distance <= terms.sensor_range + terms.margin)

    def offering(self, contract: Contract, base_sequence: int, now: float) -> OwnerSide:
        """Bind this side to ``contract``, which the own plan satisfies; after that it may be sent."""
        return replace(self, contracts=(*self.contracts, Held(contract, now, base_sequence)),
                       next_id=contract.id + 1)

    def acknowledging(self, entry: Link, sequence: int, now: float) -> OwnerSide:
        """The peer, in its present life, says which contract it holds and which it will never take.

        Both only grow, so an old or a second one changes nothing, and one that
        arrives stands for all before it.
        """
        held = {held.contract.id for held in self.contracts}
        if entry.epoch != self.epoch or entry.contract and entry.contract not in held:
            return self
        side = self
        if entry.promised > self.promised or entry.promised == self.promised and entry.contract != self.acknowledged:
            alive = tuple(held for held in self.contracts
                          if held.contract.id == entry.contract or held.contract.id > entry.promised)
            mode = LinkMode.CON if entry.contract else LinkMode.FAR if self.mode is LinkMode.CON else self.mode
            side = replace(self, mode=mode, contracts=alive, acknowledged=entry.contract, promised=entry.promised)
        if entry.contract and side.mode is LinkMode.CON and sequence > side.granted:
            side = replace(side, granted=sequence, granted_at=now, still_since=None)
        return side

    def watching(self, place: tuple[float, float], radius: float, speed: float, is_after_gap: bool, now: float,
                 terms: Terms, clear: Clear) -> OwnerSide:
        """The peer's body is seen. One without a lease that rests for a whole plan's time rests until it is let go."""
        is_still = (self.mode is LinkMode.CON and not self._is_doubted(self._in_force().since) and not is_after_gap
                    and now - self.granted_at > terms.lease + GRACE and speed < V_REST / 2)
        if not is_still:
            return self if self.still_since is None else replace(self, still_since=None)
        since = now if self.still_since is None else self.still_since
        if now - since >= terms.rest_time and clear(place, radius):
            return replace(self._without_contracts().rests_at(place, radius), is_heard=False)
        return replace(self, still_since=since)

    def hearing(self) -> OwnerSide:
        """The peer has spoken: offers to it make sense."""
        return self if self.is_heard else replace(self, is_heard=True)

    def reading(self, entry: Link, sequence: int, now: float, sent: Mapping[int, float], terms: Terms) -> OwnerSide:
        """The peer, in its present life, says ``entry`` in its message ``sequence``."""
        return self.acknowledging(entry, sequence, now).told(entry, terms)

    def _in_force(self):
        return next(held for held in self.contracts if held.contract.id == self.acknowledged)

    def _without_contracts(self):
        return replace(self, contracts=(), acknowledged=0, promised=self.next_id - 1, granted=-1, still_since=None)

    def _lapsed(self):
        alive = tuple(held for held in self.contracts if not self._is_dropped(held.since))
        if len(alive) == len(self.contracts):
            return self
        if self.acknowledged in [held.contract.id for held in alive]:
            return replace(self, contracts=alive)
        mode = LinkMode.FAR if self.mode is LinkMode.CON else self.mode
        return replace(self, mode=mode, contracts=alive, acknowledged=0, still_since=None)


@dataclass(frozen=True)
class PeerSide(Side):
    """The side of the higher id: it takes a contract when its own plan satisfies it, in place of the one before.

    Attributes
    ----------
    contract : Held or None
        In force; every commit satisfies it.
    pending : Held or None
        The newest offer, which no plan has satisfied yet.
    promised : int
        No contract up to this id will be taken any more.
    leased_at : float [s]
        When the newest message was sent that the owner has granted.
    """

    contract: Held | None = None
    pending: Held | None = None
    promised: int = 0
    leased_at: float = -inf

    def bound(self) -> tuple[Contract, ...]:
        """Return the contract that every commit must satisfy."""
        return () if self.contract is None else (self.contract.contract,)

    def status(self) -> Link:
        """Return the acknowledgement."""
        return Link(self.other_epoch, self.mode, self.contract.contract.id if self.contract else 0, self.promised)

    def offered(self, owner_epoch: int, peer_epoch: int, offer: Held, fits: Fits) -> PeerSide:
        """An offer has come from this or a newer life of the owner."""
        number = offer.contract.id
        if peer_epoch != self.epoch or self.is_past(owner_epoch):
            return self
        if owner_epoch > self.other_epoch:
            if self._is_doubted(offer.since) or not fits(offer.contract):
                return self
            side = replace(self._without_contracts(), other_epoch=owner_epoch)
            return replace(side, mode=LinkMode.CON, contract=offer, promised=number)
        if number <= self.promised:
            return self
        return replace(self, pending=offer, promised=number - 1).reconsidering(fits)

    def reconsidering(self, fits: Fits) -> PeerSide:
        """Take the pending offer if the own plan satisfies it by now.

        Never one that the owner may have given up, nor one without a tether while one with it is in force.
        """
        if self.pending is None:
            return self
        number = self.pending.contract.id
        if self._is_doubted(self.pending.since):
            return replace(self, pending=None, promised=number)
        if self._gives_up_range(self.pending.contract) or not fits(self.pending.contract):
            return self
        return replace(self, mode=LinkMode.CON, contract=self.pending, pending=None, promised=number)

    def _gives_up_range(self, contract):
        return self.contract is not None and self.contract.contract.tether is not None and contract.tether is None

    def hearing(self) -> PeerSide:
        """The owner has spoken."""
        return self

    def reading(self, entry: Link, sequence: int, now: float, sent: Mapping[int, float], terms: Terms) -> PeerSide:
        """The owner, in its present life, says ``entry``; ``sent`` tells when [s] own messages went out."""
        return self.leasing(entry, sent.get(entry.granted, -inf)).told(entry, terms)

    def leasing(self, entry: Link, sent_at: float) -> PeerSide:
        """The owner, in its present life, grants a message that was ``sent_at`` [s] by the own clock."""
        if entry.epoch == self.epoch and self.mode is LinkMode.CON and sent_at > self.leased_at:
            return replace(self, leased_at=sent_at)
        return self

    def _has_lease(self, now, at_rest, terms):
        return not at_rest or now - self.leased_at < terms.lease

    def _in_force(self):
        return self.contract

    def _without_contracts(self):
        return replace(self, contract=None, pending=None, promised=0, leased_at=-inf)

    def _lapsed(self):
        if self.contract is None or not self._is_dropped(self.contract.since):
            return self
        return replace(self, contract=None, mode=LinkMode.FAR)
