"""Links: what two robots have agreed on, as each of the two knows it, and how every event changes that.

Here is what both sides of a link have in common; `owner_side` and `peer_side` are the two.

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

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import NamedTuple

from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import Link, LinkMode

#: A robot slower than this [m/s] is at rest: it needs a lease to depart.
V_REST = 0.03
#: By how much [s] the owner waits longer than a lease lasts before it takes a silent peer to be at rest.
GRACE = 0.2

#: Whether the own plan in force stays clear of a place (2,) [m] with a radius [m].
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
    """One side of a link, an `OwnerSide` or a `PeerSide`.

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

    def _with(self, **changes):
        """Return this side but for ``changes``: `dataclasses.replace`, which every message would wait for."""
        side = object.__new__(type(self))
        vars(side).update(vars(self), **changes)
        return side

    def is_past(self, epoch: int) -> bool:
        """Return whether what comes from this life of the other says nothing any more."""
        return epoch < self.other_epoch or epoch <= self.dead_epoch

    def rests_at(self, place: tuple[float, float], radius: float) -> Side:
        """Return the side of a robot that will not move before this one lets it."""
        return self._with(mode=LinkMode.STATIC, place=place, radius=radius)

    def renewed(self, epoch: int, place: tuple[float, float] | None, radius: float, clear: Clear) -> Side:
        """The other's process runs anew, and its body rests at ``place``; None if it does not rest."""
        side = self._without_contracts()
        if self.mode in (LinkMode.CON, LinkMode.STATIC):
            if place is None or not clear(place, radius):
                return self
            side = side.rests_at(place, radius)
        # With NONE nothing changes: of two robots that each took the other to be at rest, both would move.
        return side._with(other_epoch=epoch)

    def buried(self, epoch: int, place: tuple[float, float], radius: float, issued: float, clear: Clear) -> Side:
        """Nobody lived as the other when that was ``issued`` [s], and its body rests at ``place``."""
        is_stale = self.other_epoch > epoch or self.dead_epoch >= epoch or issued <= self.born + GRACE
        if is_stale or not clear(place, radius):
            return self
        side = self._without_contracts().rests_at(place, radius)
        return side._with(other_epoch=epoch, dead_epoch=epoch)

    def told(self, entry: Link, terms: Terms) -> Side:
        """The other says that it does not take this robot to be at rest: out of its sight both may move."""
        if (self.mode is LinkMode.NONE and entry.epoch == self.epoch and terms.sensor_range < inf
                and entry.mode in (LinkMode.NONE, LinkMode.FAR)):
            return self._with(mode=LinkMode.FAR)
        return self

    def observed(self, distance: float, is_after_gap: bool, now: float, terms: Terms) -> Side:
        """The pair is seen ``distance`` [m] apart: what may have lapsed for the other is no ground to move any more."""
        far = terms.sensor_range + terms.margin
        side = self._with(distance=distance, doubt=now if is_after_gap or distance > far else self.doubt,
                          drop=now if distance > far + terms.margin else self.drop)
        if side.doubt == now and side.mode is LinkMode.STATIC and side.other_epoch > side.dead_epoch:
            side = side._with(mode=LinkMode.FAR)
        return side._lapsed()

    def may_move(self, now: float, at_rest: bool, terms: Terms) -> bool:
        """Return whether this side lets its robot change its plan, which is at rest or not when that takes effect."""
        if self.mode is LinkMode.CON:
            is_sure = (self.doubt == -inf or self.distance > terms.sensor_range
                       or not self._is_doubted(self._in_force().since))
            return is_sure and self._has_lease(now, at_rest, terms)
        return self.mode is LinkMode.STATIC or self.mode is LinkMode.FAR and self.distance > terms.sensor_range

    def _has_lease(self, now, at_rest, terms):
        return True

    def _is_doubted(self, since):
        return -inf < self.doubt and since <= self.doubt

    def _is_dropped(self, since):
        return -inf < self.drop and since <= self.drop
