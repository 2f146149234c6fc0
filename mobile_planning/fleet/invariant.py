"""Invariant: why no two robots of a simulation can ever collide, asked anew after every event.

At any instant each pair of robots is in one of three cases. Both are bound by
one contract, which both plans in force satisfy on all spans that are not yet
past. Or one is locked at rest, and the other's whole plan stays the sum of both
radii from its place. Or at least one goes by the other being far, and they are
out of sight of each other, or neither may set out. In all but the first, and
wherever a contract begins later than now, the two plans themselves must be that
far apart too.

Where that contract has a tether, the two plans must also stay within its range of each other, and no contract without
one takes its place.

Shares no geometry with what it judges: control points, normals and offsets are
all that it reads, see `plan_distances`. What was found for the same plans and the same contracts is
not computed again, and a pair whose plans obey the contract of both to their ends is looked at again when one of the
two plans something else or is bound otherwise.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from operator import is_

import numpy as np

from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import LinkMode
from mobile_planning.fleet.owner_side import OwnerSide
from mobile_planning.fleet.peer_side import PeerSide
from mobile_planning.fleet.plan_distances import (contract_room, curves, distance_of_plans, distance_of_point,
                                                  farthest_of_plans, rest_knot)
from mobile_planning.fleet.vehicle import Vehicle

#: Lengths [m] below this are rounding.
TOLERANCE = 1e-7


@dataclass(frozen=True)
class Breach:
    """What broke, when [s] since the start of the mission, and between which two robots."""

    time: float
    robots: tuple[int, int]
    what: str

    def __str__(self) -> str:
        return f'robots {self.robots[0]} and {self.robots[1]} at {self.time:.3f} s: {self.what}'


class _View:
    """Where one robot drives, and what it is bound to by each of its links, as it was after its last event."""

    def __init__(self):
        self.plan = self.curves = None
        self._sides: dict[int, OwnerSide | PeerSide] = {}
        self._bound: dict[int, tuple[Contract, ...]] = {}
        # Whether the plan obeys a contract, by its id; the contract is kept so that the id stays its own.
        self.verdicts: dict[int, tuple[Contract, float]] = {}

    def bound_to(self, other):
        """Return the contracts with ``other``."""
        return self._bound.get(other, ())

    def changes(self, robot):
        """Take in ``robot`` as it is now; return with whom something has changed, None for everybody."""
        changed = self._rebound(robot.protocol.sides)
        if robot.plan is self.plan:
            return changed
        self.plan, self.verdicts = robot.plan, {}
        self.curves = curves(robot.plan, robot.plan.first_knot, len(robot.plan.points) - 2)
        return None

    def _rebound(self, sides):
        """Take in the sides of the links; return with whom the contracts are others than before."""
        gone = self._sides.keys() - sides.keys()
        changed = [other for other in gone if self._bound[other]]
        for other in gone:
            del self._sides[other], self._bound[other]
        for other, side in sides.items():
            # A side of a link is never altered, but replaced by another one.
            if side is not self._sides.get(other):
                before, self._bound[other], self._sides[other] = self.bound_to(other), side.bound(), side
                if not _is_same(before, self._bound[other]):
                    changed.append(other)
        return changed


class _Pair:
    """What is known of one pair as long as both plans and the contract in force of both stay the same."""

    def __init__(self, plans, shared):
        self.plans, self.shared = plans, shared
        self.is_settled = self.is_apart = False
        self.clear = set()


class Invariant:
    """Keeps watch over the robots of one simulation.

    Parameters
    ----------
    vehicles : sequence of Vehicle

    Attributes
    ----------
    breaches : list of Breach
        In order of time; a pair that stays broken is named once.
    checks : int
        Pairs looked at.
    """

    def __init__(self, vehicles: Sequence[Vehicle]):
        self.breaches: list[Breach] = []
        self.checks = 0
        self._pairs: dict[tuple[int, int], _Pair] = {}
        self._broken: dict[tuple[int, int], str] = {}
        self._tethered: set[tuple[int, int]] = set()
        self._vehicles = {vehicle.eyed: vehicle for vehicle in vehicles}
        self._views: dict[int, _View] = {}
        # With whom each has something that has to be looked at after every event.
        self._open: dict[int, set[int]] = {vehicle.eyed: set() for vehicle in vehicles}

    def check(self, vehicle: Vehicle, now: float) -> None:
        """Judge all pairs of ``vehicle``, after an event at ``now`` [s] that touched it."""
        if not self._views:
            self._views = {eyed: _View() for eyed in self._vehicles}
            for other in self._vehicles.values():
                self._look_at(other)
        self._look_at(vehicle)
        for other in tuple(self._open[vehicle.eyed]):
            self.checks += 1
            key = min(vehicle.eyed, other), max(vehicle.eyed, other)
            pair, low, high = self._pairs[key], self._vehicles[key[0]], self._vehicles[key[1]]
            self._note(now, key, self._fault(low, high, key, pair, now))
            if pair.is_settled:
                self._open[vehicle.eyed].discard(other)
                self._open[other].discard(vehicle.eyed)

    def _look_at(self, vehicle):
        """Take in what ``vehicle`` drives and is bound to now."""
        changed = self._views[vehicle.eyed].changes(vehicle.robot)
        for other in self._vehicles if changed is None else changed:
            if other != vehicle.eyed and other in self._vehicles:
                self._renew(min(vehicle.eyed, other), max(vehicle.eyed, other))

    def _renew(self, low, high):
        """Begin anew with a pair, unless its plans and its contract are still the same."""
        views, pair = (self._views[low], self._views[high]), self._pairs.get((low, high))
        plans, shared = (views[0].plan, views[1].plan), None if pair is None else pair.shared
        bound = views[0].bound_to(high), views[1].bound_to(low)
        if shared is None or not all(any(shared is each for each in side) for side in bound):
            shared = _shared(*bound)
        if pair is None or not _is_same(pair.plans, plans) or pair.shared is not shared:
            self._pairs[low, high] = _Pair(plans, shared)
            self._open[low].add(high)
            self._open[high].add(low)

    def _note(self, now, key, what):
        kind = what.split(':')[0]
        if what and self._broken.get(key) != kind:
            self.breaches.append(Breach(now, key, what))
        self._broken[key] = kind

    def _fault(self, low, high, key, pair, now):
        """Return what is wrong with a pair, empty if nothing is: the kind of fault, a colon, and the numbers."""
        knots, shared = (_knot(low, now), _knot(high, now)), pair.shared
        if shared is None or shared.tether is None:
            if shared is not None and key in self._tethered:
                return f'their range is given up: contract {shared.id} has no tether'
            self._tethered.discard(key)
        else:
            self._tethered.add(key)
            most = farthest_of_plans(*pair.plans, max(
                shared.first_span, *knots, *(plan.first_knot for plan in pair.plans)))
            if most > shared.tether.reach + TOLERANCE:
                return f'they leave their range: {most:.4f} m apart, {shared.tether.reach:.4f} m allowed'
        if shared is not None:
            for vehicle, knot, is_owner in ((low, knots[0], True), (high, knots[1], False)):
                room = self._room(vehicle, knot, shared, is_owner)
                if room < -TOLERANCE:
                    return f'robot {vehicle.eyed} breaks the contract of both: {shared.id}, by {-room:.2e} m'
            if shared.first_span <= min(knots):
                pair.is_settled = True
                return ''
        if not pair.is_apart:
            # Of two clocks one may lag behind the first span that the other robot's plan still tells of.
            since = max(min(knots), *(plan.first_knot for plan in pair.plans))
            least, need = distance_of_plans(*pair.plans, since), _sum(low, high)
            if least < need - TOLERANCE:
                return f'their plans in force collide: {least:.4f} m apart, {need:.4f} m needed'
            pair.is_apart = True
        return '' if shared is not None else _unbound(low, high, pair, knots, now)

    def _room(self, vehicle, knot, contract, is_owner):
        """Return the room of the plan of ``vehicle`` beside ``contract`` [m], from memory if it can be."""
        view = self._views[vehicle.eyed]
        known = view.verdicts.get(id(contract))
        if known is None or known[0] is not contract:
            room = contract_room(contract, view.plan, knot, is_owner, _radius(vehicle), view.curves)
            known = view.verdicts[id(contract)] = contract, room
        return known[1]


def _unbound(low, high, pair, knots, now):
    """Judge a pair without a contract of both."""
    for rests, passes, at, since in ((low, high, *knots), (high, low, *knots[::-1])):
        if at >= rest_knot(rests.robot.plan) and _is_locked(rests, now):
            if rests.eyed not in pair.clear:
                place = rests.robot.plan.points[-1]
                if distance_of_point(passes.robot.plan, place, since) < _sum(low, high) - TOLERANCE:
                    continue
                pair.clear.add(rests.eyed)
            return ''
    modes = _mode(low, high, now), _mode(high, low, now)
    if LinkMode.FAR in modes and _keep_off(low, high, now):
        return ''
    return f'no contract of both, and neither is locked at rest and clear of the other: {modes[0].name} ' \
           f'and {modes[1].name}'


def _shared(owned, kept):
    """Return the contract in force of both: the one the peer obeys, if it is among the owner's."""
    return next((theirs for theirs in kept if any(own is theirs for own in owned)), None) or next(
        (theirs for theirs in kept if any(_is_equal(own, theirs) for own in owned)), None)


def _is_same(before, after):
    """Return whether two sequences hold the very same objects."""
    return len(before) == len(after) and all(map(is_, before, after))


def _is_equal(a, b):
    return ((a.id, a.first_span) == (b.id, b.first_span) and np.array_equal(a.normals, b.normals)
            and np.array_equal(a.offsets, b.offsets) and _has_equal_tether(a.tether, b.tether))


def _has_equal_tether(a, b):
    return a is b or None not in (a, b) and a.reach == b.reach and np.array_equal(a.middles, b.middles)


def _radius(vehicle):
    return vehicle.robot.limits.radius


def _sum(low, high):
    return _radius(low) + _radius(high)


def _knot(vehicle, now):
    return int(np.floor(vehicle.clock(now) / vehicle.robot.plan.step + 1e-9))


def _mode(vehicle, other, now):
    """Return the mode of the link of ``vehicle`` to ``other``; without a link it has not been told of any other."""
    link = vehicle.robot.protocol.links(vehicle.clock(now)).get(other.eyed)
    return LinkMode.NONE if link is None else link.mode


def _keep_off(low, high, now):
    """Return whether two robots are out of sight of each other, or neither may set out."""
    # What they saw of each other may be a cycle old.
    sight = max(v.robot.sensor_range - v.robot.protocol.terms.margin for v in (low, high))
    return np.hypot(*(low.place(now) - high.place(now))) > sight or _is_locked(low, now) and _is_locked(high, now)


def _is_locked(vehicle, now):
    """Return whether ``vehicle`` cannot set out: nobody is there to do so, or its links forbid it."""
    return not vehicle.is_alive or not vehicle.robot.protocol.may_move(vehicle.clock(now), True)
