"""The side of a link that makes the contracts; see `link` for what both sides keep."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import inf

from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.link import GRACE, V_REST, Clear, Held, Side, Terms
from mobile_planning.fleet.message import Link, LinkMode

#: Contracts an owner may be bound to on one link: one in force, a stale offer and a fresh one beside it.
MAX_OPEN = 3


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
        return Link.of_side(self.other_epoch, self.mode, self.acknowledged, self.promised,
                            self.granted if self.mode is LinkMode.CON else -1)

    def may_offer(self, terms: Terms) -> bool:
        """Return whether one more contract may be offered."""
        return (self.other_epoch > self.dead_epoch and self.is_heard and len(self.contracts) < MAX_OPEN
                and self.distance <= terms.sensor_range + terms.margin)

    def offering(self, contract: Contract, base_sequence: int, now: float) -> OwnerSide:
        """Bind this side to ``contract``, which the own plan satisfies; after that it may be sent."""
        return self._with(contracts=(*self.contracts, Held(contract, now, base_sequence)), next_id=contract.id + 1)

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
            side = self._with(mode=mode, contracts=alive, acknowledged=entry.contract, promised=entry.promised)
        if entry.contract and side.mode is LinkMode.CON and sequence > side.granted:
            side = side._with(granted=sequence, granted_at=now, still_since=None)
        return side

    def watching(self, place: tuple[float, float], radius: float, speed: float, is_after_gap: bool, now: float,
                 terms: Terms, clear: Clear) -> OwnerSide:
        """The peer's body is seen. One without a lease that rests for a whole plan's time rests until it is let go."""
        is_still = (self.mode is LinkMode.CON and not self._is_doubted(self._in_force().since) and not is_after_gap
                    and now - self.granted_at > terms.lease + GRACE and speed < V_REST / 2)
        if not is_still:
            return self if self.still_since is None else self._with(still_since=None)
        since = now if self.still_since is None else self.still_since
        if now - since >= terms.rest_time and clear(place, radius):
            return self._without_contracts().rests_at(place, radius)._with(is_heard=False)
        return self._with(still_since=since)

    def hearing(self) -> OwnerSide:
        """The peer has spoken: offers to it make sense."""
        return self if self.is_heard else self._with(is_heard=True)

    def reading(self, entry: Link, sequence: int, now: float, sent: Mapping[int, float], terms: Terms) -> OwnerSide:
        """The peer, in its present life, says ``entry`` in its message ``sequence``."""
        return self.acknowledging(entry, sequence, now).told(entry, terms)

    def _in_force(self):
        return next(held for held in self.contracts if held.contract.id == self.acknowledged)

    def _without_contracts(self):
        return self._with(contracts=(), acknowledged=0, promised=self.next_id - 1, granted=-1, still_since=None)

    def _lapsed(self):
        alive = tuple(held for held in self.contracts if not self._is_dropped(held.since))
        if len(alive) == len(self.contracts):
            return self
        if self.acknowledged in [held.contract.id for held in alive]:
            return self._with(contracts=alive)
        mode = LinkMode.FAR if self.mode is LinkMode.CON else self.mode
        return self._with(mode=mode, contracts=alive, acknowledged=0, still_since=None)
