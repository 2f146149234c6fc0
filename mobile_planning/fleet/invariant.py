"""Invariant: why no two robots of a simulation can ever collide, asked anew after every event.

At any instant each pair of robots is in one of three cases. Both are bound by
one contract, which both plans in force satisfy on all spans that are not yet
past. Or one is locked at rest, and the other's whole plan stays the sum of both
radii from its place. Or at least one goes by the other being far, and they are
out of sight of each other, or neither may set out. In all but the first, and
wherever a contract begins later than now, the two plans themselves must be that
far apart too.

Shares no geometry with what it judges: control points, normals and offsets are
all that it reads. What was found for the same plans and the same contracts is
not computed again.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import LinkMode
from mobile_planning.fleet.vehicle import Vehicle

#: Lengths [m] below this are rounding.
TOLERANCE = 1e-7
_EDGES = np.array(list(combinations(range(4), 2))).T
_TRIANGLES = np.array(list(combinations(range(4), 3))).T


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
                self._note(now, key, self._fault(low, high, pair, now))

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

    def _fault(self, low, high, pair, now):
        """Return what is wrong with a pair, empty if nothing is: the kind of fault, a colon, and the numbers."""
        knots, shared = (_knot(low, now), _knot(high, now)), pair.shared
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
            and np.array_equal(a.offsets, b.offsets))


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


# Geometry, written for this file alone


def rest_knot(plan: Plan) -> float:
    """Return from which knot on ``plan`` never leaves its last place; minus infinity if it never moves."""
    moves = np.flatnonzero((plan.points != plan.points[-1]).any(axis=1))
    return plan.first_knot + int(moves[-1]) + 1 if len(moves) else -np.inf


def curves(plan: Plan, first_span: int, count: int) -> NDArray[np.float64]:
    """Return the Bezier points (count, 4, 2) [m] of ``count`` spans; before its first knot a plan rests."""
    at = np.clip(np.arange(first_span, first_span + count + 3) - plan.first_knot, 0, len(plan.points) - 1)
    q = plan.points[at]
    thirds = q[:-1, None] + (q[1:] - q[:-1])[:, None] * np.array([[1 / 3], [2 / 3]])
    knots = (thirds[:-1, 1] + thirds[1:, 0]) / 2
    return np.stack([knots[:-1], thirds[1:-1, 0], thirds[1:-1, 1], knots[1:]], axis=1)


def hull_distance(points: NDArray) -> NDArray[np.float64]:
    """Return the distance (...) from the origin to the hull of each four points (..., 4, 2); 0 inside.

    Examples
    --------
    >>> hull_distance(np.array([[[3.0, 4.0]] * 4, [[1, 1], [1, -1], [2, 0], [2, 1]]])).tolist()
    [5.0, 1.0]
    """
    a, b = points[..., _EDGES[0], :], points[..., _EDGES[1], :]
    along = b - a
    length2 = (along**2).sum(axis=-1)
    share = np.clip(-(a * along).sum(axis=-1) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    nearest = a + share[..., None] * along
    distance = np.sqrt((nearest**2).sum(axis=-1).min(axis=-1))
    corners = points[..., _TRIANGLES, :]
    turned = corners[..., [1, 2, 0], :, :]
    cross = corners[..., 0] * turned[..., 1] - corners[..., 1] * turned[..., 0]
    inside = ((cross > 0).all(axis=-2) | (cross < 0).all(axis=-2)).any(axis=-1)
    return np.where(inside, 0.0, distance)


def contract_room(contract: Contract, plan: Plan, knot: int, is_owner: bool, radius: float,
                  whole: NDArray | None = None) -> float:
    """Return how far [m] ``plan`` stays on its side of ``contract``, for ever from ``knot`` on; below 0 it does not.

    After its last span the last line stands still, at the last of its offsets. ``whole`` is `curves` of the
    plan from its first span on, one span at rest included.
    """
    whole = curves(plan, plan.first_knot, len(plan.points) - 2) if whole is None else whole
    first = max(knot, contract.first_span)
    last, end = contract.first_span + len(contract.normals), max(plan.end_knot, first)
    spans = np.arange(first, max(end, last) + 1)
    line = np.minimum(spans - contract.first_span, len(contract.normals) - 1)
    offsets = contract.offsets[line]
    offsets[spans >= last] = contract.offsets[-1, 3]
    at = np.clip(spans - plan.first_knot, 0, len(whole) - 1)
    heights = np.einsum('sd,skd->sk', contract.normals[line], whole[at]) - offsets
    return float(heights.min() if is_owner else -heights.max()) - radius


def distance_of_plans(a: Plan, b: Plan, knot: int) -> float:
    """Return a lower bound [m] of the distance of two plans at equal times from ``knot`` on, exact at rest."""
    count = max(a.end_knot, b.end_knot, knot) + 1 - knot
    return float(hull_distance(curves(a, knot, count) - curves(b, knot, count)).min())


def distance_of_point(plan: Plan, place: NDArray, knot: int) -> float:
    """Return a lower bound [m] of the distance of ``plan`` from ``place`` (2,) [m] from ``knot`` on, exact at rest."""
    count = max(plan.end_knot, knot) + 1 - knot
    return float(hull_distance(curves(plan, knot, count) - place).min())


# The truth


def positions(plans: Sequence[Plan], times: NDArray) -> NDArray[np.float64]:
    """Return where a body is (N, 2) [m] that drives each of ``plans`` from its first knot to the next one's.

    Parameters
    ----------
    plans : sequence of Plan
    times : (N,) ndarray [s]
        On the clock of the body, increasing.
    """
    bounds = [0, *np.searchsorted(times, [plan.first_knot * plan.step for plan in plans[1:]]), len(times)]
    return np.concatenate([_positions(plan, times[low:high])
                           for plan, low, high in zip(plans, bounds, bounds[1:]) if high > low])


def _positions(plan, times):
    """Return the places (N, 2) [m] by de Casteljau's construction."""
    u = np.clip(times / plan.step - plan.first_knot, 0.0, len(plan.points) - 3)
    span = np.minimum(u.astype(int), len(plan.points) - 4)
    share = (u - span)[:, None, None]
    points = curves(plan, plan.first_knot, len(plan.points) - 3)[span]
    while points.shape[1] > 1:
        points = points[:, :-1] + share * (points[:, 1:] - points[:, :-1])
    return points[:, 0]


def collisions(vehicles: Sequence[Vehicle], until: float, step: float = 0.01) -> tuple[float, list[Breach]]:
    """Return the least distance of two centres [m], and where bodies overlap, by samples on the fleet's clock.

    Parameters
    ----------
    vehicles : sequence of Vehicle
    until : float [s]
        Since the start of the mission.
    step : float [s]
        Between two samples.

    Returns
    -------
    least : float [m]
        Infinite for one robot.
    breaches : list of Breach
        The first sample of each pair that collides.
    """
    times = np.arange(0.0, until + step, step)
    places = [positions(vehicle.solution.plans, vehicle.clock(times)) for vehicle in vehicles]
    least, breaches = np.inf, []
    for (a, at_a), (b, at_b) in combinations(zip(vehicles, places), 2):
        distance = np.hypot(*(at_a - at_b).T)
        least = min(least, float(distance.min()))
        hits = np.flatnonzero(distance < a.robot.rho + b.robot.rho - TOLERANCE)
        if len(hits):
            breaches.append(Breach(float(times[hits[0]]), tuple(sorted((a.eyed, b.eyed))),
                                   f'they collide: centres {distance[hits[0]]:.4f} m apart, later {distance.min():.4f} '
                                   f'm, their bodies need {a.robot.rho + b.robot.rho:.4f} m'))
    return least, sorted(breaches, key=lambda breach: breach.time)
