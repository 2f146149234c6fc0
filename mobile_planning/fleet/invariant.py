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
not computed again.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from mobile_planning.fleet.message import LinkMode
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
    """What one robot is bound to, and where it drives, as long as that stays the same."""

    def __init__(self, plan, bound, before):
        self.plan = plan
        self.owned = {id(contract): contract for contract, is_owner in bound if is_owner}
        self.kept = {id(contract): contract for contract, is_owner in bound if not is_owner}
        self._ids = [id(contract) for contract, _ in bound]
        is_same_plan = before is not None and before.plan is plan
        self.curves = before.curves if is_same_plan else curves(plan, plan.first_knot, len(plan.points) - 2)
        # Whether the plan obeys a contract, by its id; the contract is kept so that the id stays its own.
        self.verdicts = before.verdicts if is_same_plan else {}

    def is_still(self, plan, bound):
        return plan is self.plan and self._ids == [id(contract) for contract, _ in bound]


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
        self._views: dict[int, _View] = {}
        self._pairs: dict[tuple[int, int], _Pair] = {}
        self._broken: dict[tuple[int, int], str] = {}
        self._tethered: set[tuple[int, int]] = set()
        self._vehicles = tuple(vehicles)
        self._pairs_of = {vehicle.eyed: [] for vehicle in vehicles}
        for low, high in combinations(sorted(vehicles, key=lambda vehicle: vehicle.eyed), 2):
            for vehicle in (low, high):
                self._pairs_of[vehicle.eyed].append((low, high, (low.eyed, high.eyed)))

    def check(self, vehicle: Vehicle, now: float) -> None:
        """Judge all pairs of ``vehicle``, after an event at ``now`` [s] that touched it."""
        has_changed = [self._look_at(each) for each in ((vehicle,) if self._views else self._vehicles)][-1]
        for low, high, key in self._pairs_of[vehicle.eyed]:
            self.checks += 1
            pair = self._pair(key) if has_changed or key not in self._pairs else self._pairs[key]
            if not pair.is_settled:
                self._note(now, key, self._fault(low, high, key, pair, now))

    def _look_at(self, vehicle):
        """Take in what ``vehicle`` is bound to now; return whether that has changed."""
        plan, bound, view = vehicle.robot.plan, vehicle.robot.protocol.bound(), self._views.get(vehicle.eyed)
        if view is not None and view.is_still(plan, bound):
            return False
        self._views[vehicle.eyed] = _View(plan, bound, view)
        return True

    def _pair(self, key):
        """Return what is known of a pair: all of it, if nothing of the pair has changed."""
        low, high, pair = self._views[key[0]], self._views[key[1]], self._pairs.get(key)
        shared = pair.shared if pair is not None else None
        if shared is None or id(shared) not in low.owned or id(shared) not in high.kept:
            shared = _shared(low, high)
        if pair is None or pair.plans[0] is not low.plan or pair.plans[1] is not high.plan or pair.shared is not shared:
            pair = self._pairs[key] = _Pair((low.plan, high.plan), shared)
        return pair

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


def _shared(low, high):
    """Return the contract in force of both: the one the peer obeys, if it is among the owner's."""
    for identity, theirs in high.kept.items():
        if identity in low.owned:
            return theirs
    return next((theirs for theirs in high.kept.values() for own in low.owned.values() if _is_equal(own, theirs)),
                None)


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
