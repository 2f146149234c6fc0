"""One robot's part in the protocol of contracts: which messages change which link, and what is to be said.

A robot's plan changes only by its own commits, and each commit satisfies all
contracts that bind the robot at that instant. So two robots need not share a
cycle: each may commit when it likes. What they agree on, and why it is safe, is in
`link`; this keeps one link to every robot of the mission. No clock and no I/O.
"""
from __future__ import annotations

import typing
from collections.abc import Callable, Collection, Mapping
from math import hypot, inf
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.link import Held, Terms
from mobile_planning.fleet.message import Contracts, Death, Link, LinkMode, Offer, RobotMsg
from mobile_planning.fleet.owner_side import OwnerSide
from mobile_planning.fleet.peer_side import PeerSide
from mobile_planning.fleet.repetition import Repetition

#: So many own messages are remembered.
MAX_SENT = 512


class Geometry(typing.Protocol):
    """What the protocol asks of the own plan in force."""

    def accepts(self, contract: Contract, is_owner: bool) -> bool:
        """Return whether the plan satisfies ``contract`` from now on."""

    def clear_of(self, place: NDArray, radius: float) -> bool:
        """Return whether the whole plan stays the own radius and ``radius`` [m] from ``place`` (2,) [m]."""

    def is_ample(self, contract: Contract, heard: RobotMsg) -> bool:
        """Return whether both the plan and the one ``heard`` leave so much room that a fresher contract can wait."""

    def offer(self, contract_id: int, heard: RobotMsg, reach: float = inf) -> Contract | None:
        """Return a contract between the plan and the one ``heard``; None if there is none that the plan satisfies.

        It keeps the two within ``reach`` [m] of each other.
        """


class Protocol:
    """All links of one robot.

    Parameters
    ----------
    robot_id, epoch : int
        The epoch, from 1 on, grows with each start of the robot's process.
    geometry : Geometry
    lease : float [s]
        A peer at rest departs only if its owner heard it less than this ago.
    rest_time : float [s]
        Every plan has ended this long after its commit.
    sensor_range : float [m]
        Whoever is nearer than this, or up to twice ``margin`` farther, is seen; inf without such a sensor.
    margin, gap : float [m, s]
        No pair comes more than ``margin`` nearer or farther in ``gap``, in which the sensor is read at least once.
    born : float [s]
        When the process started, by its own clock: older certificates of death say nothing.
    ranges : mapping of int to float [m]
        Neighbours, and how far away they may be. Of a pair the owner's counts: what it offers has a tether where both
        plans are in range, and from the first one on that is taken, until the link has no contract any more.

    Attributes
    ----------
    heard : dict of int to RobotMsg
        The newest message of each peer.
    ignored : int
        Messages that were own, stale or of robots outside the mission.

    Raises
    ------
    InvalidInput
        The epoch is not positive, or a time or length is.
    """

    def __init__(self, robot_id: int, epoch: int, geometry: Geometry, *, lease: float = 3.0, rest_time: float = 3.75,
                 sensor_range: float = inf, margin: float = 1.0, gap: float = 0.5, born: float = 0.0,
                 ranges: Mapping[int, float] = MappingProxyType({})):
        if epoch < 1 or not (lease > 0 and rest_time >= 0 and sensor_range > 0 and margin > 0 and gap > 0):
            raise InvalidInput(f'epoch {epoch}, lease {lease} s, rest_time {rest_time} s, '
                               f'sensor_range {sensor_range} m, margin {margin} m or gap {gap} s is out of range')
        self.robot_id, self.epoch, self.terms = robot_id, epoch, Terms(lease, rest_time, sensor_range, margin, gap)
        self.heard: dict[int, RobotMsg] = {}
        self.ignored = 0
        self._geometry, self._born, self._ranges = geometry, born, dict(ranges)
        self._sides: dict[int, OwnerSide | PeerSide] = {}
        self._sequence = 0
        self._sent: dict[int, float] = {}
        self._observed_at, self._is_stranger_near = -inf, False
        # Owed answers, and links where something is newer than the last offer.
        self._owed: set[int] = set()
        self._stale: set[int] = set()
        self._repetition = Repetition()

    def join(self, roster: Collection[int], resting: Mapping[int, tuple[ArrayLike, float]] | None = None) -> None:
        """From now on nothing moves without an agreement with all of ``roster``.

        Parameters
        ----------
        roster : collection of int
        resting : mapping of int to ((2,) array_like [m], float [m])
            Place and radius of those who will be switched on later. Such a robot itself
            gives nobody here, and no robot does that was started again.
        """
        sides = {}
        for other in roster:
            if other != self.robot_id:
                side = self._sides.get(other) or self._new_side(other)
                if resting and other in resting and side.mode is LinkMode.NONE and not side.other_epoch:
                    place, radius = resting[other]
                    side = side.rests_at(_pair(place), float(radius))
                sides[other] = side
        self._sides = sides

    def _new_side(self, other):
        return (OwnerSide if self.robot_id < other else PeerSide)(self.epoch, self._born)

    @property
    def sides(self) -> Mapping[int, OwnerSide | PeerSide]:
        """The own side of each link, by the peer; none is ever altered, it is replaced by another one."""
        return self._sides

    @property
    def rest_time(self) -> float:
        """Every plan has ended this long [s] after its commit."""
        return self.terms.rest_time

    # What comes in

    def hear(self, message: RobotMsg | Contracts | Death, now: float) -> bool:
        """Take in a ``message`` at ``now`` [s] of the own clock; return whether it was news."""
        side = self._sides.get(message.robot_id)
        if side is not None and isinstance(message, Death):
            return self._bury(message, side)
        if side is None or side.is_past(message.boot_epoch):
            self.ignored += 1
            return False
        return (self._hear_plan if isinstance(message, RobotMsg) else self._hear_contracts)(message, side, now)

    def _bury(self, death, side):
        known = self.heard.get(death.robot_id)
        radius = side.radius if known is None else known.radius
        if death.radius is not None:
            radius = death.radius
        buried = side.buried(death.boot_epoch, _pair(death.place), radius, death.issued,
                             self._geometry.clear_of) if radius else side
        return self._keep(death.robot_id, buried)

    def _hear_plan(self, message, side, now):
        other, known = message.robot_id, self.heard.get(message.robot_id)
        if message.plan is None or (known is not None and known.boot_epoch == message.boot_epoch
                                    and message.sequence <= known.sequence):
            self.ignored += 1
            return False
        if message.boot_epoch > side.other_epoch:
            points = message.plan.points
            place = None if np.ptp(points, axis=0).any() else _pair(points[-1])
            side = side.renewed(message.boot_epoch, place, message.radius, self._geometry.clear_of)
            if side.other_epoch != message.boot_epoch:
                self.ignored += 1
                return False
        self.heard[other] = message
        if isinstance(side, OwnerSide):
            self._stale.add(other)
        if self.robot_id in message.links:
            side = self._reading(side, message.links[self.robot_id], message, now)
        self._sides[other] = side.hearing()
        return True

    def _reading(self, side, entry, message, now):
        """Return the ``side`` after the peer says ``entry`` in its ``message``."""
        side = side.reading(entry, message.sequence, now, self._sent, self.terms)
        if isinstance(side, OwnerSide) and not side.open:
            self._repetition.forget_offer(message.robot_id)
        return side

    def _hear_contracts(self, message, side, now):
        other, before = message.robot_id, side
        if self.robot_id not in message.addressees:
            return False
        if message.boot_epoch == side.other_epoch and self.robot_id in message.answers:
            side = self._reading(side, message.answers[self.robot_id], message, now)
        for offer in message.offers:
            if offer.peer_id == self.robot_id and isinstance(side, PeerSide):
                held = Held(offer.contract, self._sent.get(offer.base_sequence, -inf), offer.base_sequence)
                side = side.offered(message.boot_epoch, offer.peer_epoch, held, self._accepts)
                if side.other_epoch == message.boot_epoch and offer.peer_epoch == self.epoch:
                    self._owed.add(other)
        self._sides[other] = side
        return side != before

    def _accepts(self, contract):
        return self._geometry.accepts(contract, False)

    def _keep(self, other, side):
        """Keep the new ``side`` of a link; return whether it has changed, and count the message if not."""
        is_news = side != self._sides[other]
        self._sides[other] = side
        self.ignored += not is_news
        return is_news

    def observe(self, seen: Mapping[int, tuple[ArrayLike, float]], now: float, here: ArrayLike | None = None) -> None:
        """Take in what the presence sensor sees at ``now`` [s]: before each commit, and once a cycle at least.

        Parameters
        ----------
        seen : mapping of int to ((2,) array_like [m], float [m/s])
            Place and speed. Whoever is not seen is out of sight by far.
        now : float [s]
        here : (2,) array_like [m]
            Where this robot is; may be left out without a range of the sensor.
        """
        terms, is_after_gap = self.terms, now - self._observed_at > self.terms.gap
        self._observed_at = now
        has_range = terms.sensor_range < inf
        x, y = (0.0, 0.0) if not has_range else _pair(here)
        places = {other: _pair(place) for other, (place, _) in seen.items()}
        if has_range:
            self._is_stranger_near = any(
                hypot(place[0] - x, place[1] - y) <= terms.sensor_range for other, place in places.items()
                if other != self.robot_id and other not in self._sides)
        for other, side in self._sides.items():
            if has_range:
                place = places.get(other, (inf, inf))
                side = side.observed(hypot(place[0] - x, place[1] - y), is_after_gap, now, terms)
            if isinstance(side, OwnerSide) and other in self.heard:
                place, speed = places.get(other, (0.0, 0.0)), seen[other][1] if other in seen else inf
                side = side.watching(place, self.heard[other].radius, speed, is_after_gap, now, terms,
                                     self._geometry.clear_of)
            self._sides[other] = side

    def committed(self, now: float) -> None:
        """The plan in force has changed, or a cycle has passed: an offer that waits may be taken now."""
        for other, side in self._sides.items():
            if isinstance(side, PeerSide) and side.pending is not None:
                self._sides[other] = side.reconsidering(self._accepts)
                if self._sides[other] is not side:
                    self._owed.add(other)

    # What binds the robot

    def may_move(self, now: float, at_rest: bool) -> bool:
        """Return whether the plan may be changed at ``now`` [s] at all.

        Parameters
        ----------
        now : float [s]
        at_rest : bool
            Whether the robot is slower than `link.V_REST` when the change takes effect.
        """
        if self.terms.sensor_range < inf and (self._is_stranger_near or now - self._observed_at > self.terms.gap):
            return False
        return all(side.may_move(now, at_rest, self.terms) for side in self._sides.values())

    def forbidding(self, now: float, at_rest: bool) -> list[int]:
        """Return the robots whose links forbid at ``now`` [s] to change the plan; see `may_move`."""
        return [other for other, side in self._sides.items() if not side.may_move(now, at_rest, self.terms)]

    def breaking(self, keeps: Callable[[Contract, bool], bool]) -> tuple[int, ...]:
        """Return the robots with whom a contract is not kept, as ``keeps`` says of it and of who is its owner."""
        return tuple(other for other, side in self._sides.items()
                     if not all(keeps(contract, isinstance(side, OwnerSide)) for contract in side.bound()))

    def bound(self) -> list[tuple[Contract, bool]]:
        """Return the contracts that every commit must satisfy, and of each whether this robot is its owner."""
        return [(contract, isinstance(side, OwnerSide)) for side in self._sides.values() for contract in side.bound()]

    def discs(self) -> list[tuple[NDArray[np.float64], float]]:
        """Return place (2,) [m] and radius [m] of the robots at rest that every commit must stay clear of."""
        return [(np.array(side.place), side.radius) for side in self._sides.values() if side.mode is LinkMode.STATIC]

    # What goes out

    def expect_losses(self, are_any: bool) -> None:
        """Say again soon what is not answered, as from the beginning; or trust that all that is said arrives."""
        self._repetition.expects_losses = are_any

    @property
    def has_due(self) -> bool:
        """Whether there is something to say before the next cycle."""
        return bool(self._owed or self._stale or self._repetition.is_plan_awaited(self._newest_offers()) or any(
            other in self._sides and self._sides[other].is_heard and self._sides[other].open
            for other in self._repetition.seldom_offered()))

    def due(self, now: float) -> Contracts | None:
        """Return all offers and answers that are to be sent at ``now`` [s]; None if there are none.

        The robot is bound to what it offers from then on.
        """
        answers = {other: self._sides[other].status() for other in sorted(self._owed & self._sides.keys())}
        self._owed.clear()
        concerned = sorted(self._sides.keys() & (self._stale | self._repetition.offered))
        offers = [offer for other in concerned if (offer := self._offer_to(other, now)) is not None]
        if not (answers or offers):
            return None
        message = Contracts(self.robot_id, self.epoch, self.next_sequence(), tuple(offers), answers)
        self.sent(message.sequence, now)
        return message

    def _offer_to(self, other, now):
        """Return a fresh offer if something is newer than the last one, else the newest open one after a while."""
        side = self._sides[other]
        if not isinstance(side, OwnerSide):
            return None
        heard = self.heard.get(other)
        if other in self._stale and heard is not None and side.may_offer(self.terms) and not (
                side.is_settled and self._geometry.is_ample(side.contracts[0].contract, heard)):
            contract = self._drawn(side, heard)
            if contract is not None:
                self._sides[other] = side = side.offering(contract, heard.sequence, now)
                self._repetition.forget_offer(other)
        self._stale.discard(other)
        opened = side.open
        if not opened or not side.is_heard or not self._repetition.offers_again(other, now):
            return None
        return Offer(other, side.other_epoch, opened[-1].base_sequence, opened[-1].contract)

    def _drawn(self, side, heard):
        """Return a new contract with who was ``heard``, in range of a neighbour; None if there is none."""
        if heard.robot_id not in self._ranges:
            return self._geometry.offer(side.next_id, heard)
        contract = self._geometry.offer(side.next_id, heard, self._ranges[heard.robot_id])
        if contract is None and not side.is_tethered:
            contract = self._geometry.offer(side.next_id, heard)
        return contract

    def told(self, sequence: int, now: float) -> None:
        """Remember that the own plan goes out at ``now`` [s] in the message ``sequence`` of a cycle."""
        self.sent(sequence, now)
        self._repetition.told(sequence, now)

    def tells_again(self, now: float) -> bool:
        """Return whether the newest own plan is to be said again at ``now`` [s], as one that an owner seems to lack."""
        return self._repetition.tells_again(now, self._newest_offers())

    def _newest_offers(self):
        """Return the newest offer of each owner, taken or not; None where there is none."""
        return (side.pending or side.contract for side in self._sides.values() if isinstance(side, PeerSide))

    def links(self, now: float) -> dict[int, Link]:
        """Return what to say to each peer in the message of a cycle."""
        return {other: side.status() for other, side in self._sides.items()}

    def next_sequence(self) -> int:
        """Return the number of the next own message."""
        self._sequence += 1
        return self._sequence

    def sent(self, sequence: int, now: float) -> None:
        """Remember that the own message ``sequence`` goes out at ``now`` [s]."""
        self._sent[sequence] = now
        if len(self._sent) > MAX_SENT:
            del self._sent[next(iter(self._sent))]


def _pair(place):
    return float(place[0]), float(place[1])
