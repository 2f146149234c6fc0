"""The side of a link that takes the contracts; see `link` for what both sides keep."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import inf

from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.link import Held, Side, Terms
from mobile_planning.fleet.message import Link, LinkMode

#: Whether the own plan in force satisfies a contract.
Fits = Callable[[Contract], bool]


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
        contract = self.contract.contract.id if self.contract else 0
        return Link.of_side(self.other_epoch, self.mode, contract, self.promised)

    def offered(self, owner_epoch: int, peer_epoch: int, offer: Held, fits: Fits) -> PeerSide:
        """An offer has come from this or a newer life of the owner."""
        number = offer.contract.id
        if peer_epoch != self.epoch or self.is_past(owner_epoch):
            return self
        if owner_epoch > self.other_epoch:
            if self._is_doubted(offer.since) or not fits(offer.contract):
                return self
            side = self._without_contracts()._with(other_epoch=owner_epoch)
            return side._with(mode=LinkMode.CON, contract=offer, promised=number)
        if number <= self.promised:
            return self
        return self._with(pending=offer, promised=number - 1).reconsidering(fits)

    def reconsidering(self, fits: Fits) -> PeerSide:
        """Take the pending offer if the own plan satisfies it by now.

        Never one that the owner may have given up, nor one without a tether while one with it is in force.
        """
        if self.pending is None:
            return self
        number = self.pending.contract.id
        if self._is_doubted(self.pending.since):
            return self._with(pending=None, promised=number)
        if self._gives_up_range(self.pending.contract) or not fits(self.pending.contract):
            return self
        return self._with(mode=LinkMode.CON, contract=self.pending, pending=None, promised=number)

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
            return self._with(leased_at=sent_at)
        return self

    def _has_lease(self, now, at_rest, terms):
        return not at_rest or now - self.leased_at < terms.lease

    def _in_force(self):
        return self.contract

    def _without_contracts(self):
        return self._with(contract=None, pending=None, promised=0, leased_at=-inf)

    def _lapsed(self):
        if self.contract is None or not self._is_dropped(self.contract.since):
            return self
        return self._with(contract=None, mode=LinkMode.FAR)
