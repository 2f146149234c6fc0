"""Joint plan: the ways of a group through a jam, and which move waits for which.

The group is brought home as pebbles on the roadmap, from where everybody's plan ends: places that all can reach and
where all can rest together. What comes out is no timetable: a move waits only for the moves of others that it would
meet, however long they take.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from mobile_planning.fleet import pebbles
from mobile_planning.fleet.move_order import finish_times, order_moves
from mobile_planning.fleet.pebble_clearing import by_open_ground
from mobile_planning.fleet.pebble_refinement import any_order, best_steps, refined
from mobile_planning.fleet.pebbles import Instance, Steps
from mobile_planning.fleet.roadmap import REACH, TIGHT, Roadmap, distances

#: Between two bodies, beside their radii [m]: room for a contract's line, and room to pass at speed.
GAP, WIDE = 0.035, 0.1
#: Configurations, one a search, for a plan that passes everybody at speed.
_WIDE_LIMITS = (300, 300)
#: Share of the searches in which robots choose in any order; in the others those first who go the same way.
_ANY_ORDER = 0.25
#: A start this near to the goal is the goal [m].
_HOME = 0.01
#: Who leaves the start or goal of another may come nearer to it by this [m].
_SHRINK = 1e-3
#: Who leaves one that stands may not: the guidance does not draw it there. Numbers are rounded, though [m].
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class Member:
    """One robot of a group.

    Attributes
    ----------
    start : (2,) array_like [m]
        Where its plan ends.
    goal : (2,) array_like [m]
    radius : float [m]
    urgency : float
        Whoever has more goes first.
    lead : float [m]
        What it has to drive before it is at its start.
    """

    start: ArrayLike
    goal: ArrayLike
    radius: float
    urgency: float = 0.0
    lead: float = 0.0


@dataclass(frozen=True, eq=False)
class JointWays:
    """Where each member goes, and what it waits for.

    Attributes
    ----------
    ways : list of (K + 1, 2) ndarray [m]
        From each member's start; move k leads from point k to point k + 1.
    needs : list of list of list of (int, int)
        For each move of each member the (member, moves) that must be over before it begins, without those that an
        earlier move has waited for.
    is_whole : bool
        Whether they lead everybody home, or to its start where nothing leads home.
    configurations : int
        Looked at to find them.
    """

    ways: list[NDArray[np.float64]]
    needs: list[list[list[tuple[int, int]]]]
    is_whole: bool
    configurations: int


def plan_jointly(roadmap: Roadmap, members: Sequence[Member], rng: np.random.Generator,
                 standing: Sequence[tuple[ArrayLike, float]] = (), horizon: int | None = None) -> JointWays:
    """Return the ways of all members, and the order of their moves.

    Parameters
    ----------
    roadmap : Roadmap
    members : sequence of Member
    rng : numpy.random.Generator
    standing : sequence of ((2,) array_like [m], float [m])
        Places and radii of those who will not move: they are passed like walls.
    horizon : int, optional
        Steps after which the ways end; by default they are whole.
    """
    urgency, radii, leads = ([getattr(member, name) for member in members] for name in ('urgency', 'radius', 'lead'))
    roadmap = roadmap.beside(standing, TIGHT)
    instance, places = make_instance(roadmap, members, standing, WIDE)

    def times(steps):
        return finish_times(instance, places, steps, radii, GAP, leads)

    draw = partial(_together, members)
    steps = best_steps(instance, urgency, rng, _WIDE_LIMITS, times, draw)
    if not steps.is_solved:
        instance = with_gap(instance, places, roadmap, members, GAP)
        steps = best_steps(instance, urgency, rng, times=times, draw=draw)
    if not steps.is_solved:
        # Those who touch each other may have no place to part to: there are more around each of them.
        bodies = [(member.start, member.radius) for member in members]
        instance, places = make_instance(roadmap.beside(bodies, GAP), members, standing)
        steps = best_steps(instance, urgency, rng, times=times, draw=draw)
    if not steps.is_solved:
        found = by_open_ground(instance, urgency, rng)
        steps = steps if found is None else refined(instance, found, rng, times=times)
    is_whole = steps.is_solved and (horizon is None or horizon >= len(steps.edges))
    if horizon is not None:
        steps = Steps(steps.places[:horizon + 1], steps.edges[:horizon], steps.is_solved, steps.configurations)
    ways, needs = order_moves(instance, places, steps, radii, GAP)
    return JointWays(ways, needs, is_whole, steps.configurations)


def _together(members, rng):
    """Return the urgency (N,) of members in any order, or so that those go first who go the way of one of them."""
    if rng.random() < _ANY_ORDER:
        return any_order(len(members), rng)
    starts = np.array([member.start for member in members], float)
    ways = np.array([member.goal for member in members], float) - starts
    headings = ways / np.maximum(np.linalg.norm(ways, axis=1), _HOME)[:, None]
    heading = headings[rng.integers(len(members))]
    # Among them whoever is ahead is first.
    ahead = starts @ heading
    return 10.0 * (headings @ heading) + ahead / max(np.ptp(ahead), _HOME)


def make_instance(roadmap: Roadmap, members: Sequence[Member],
                  standing: Sequence[tuple[ArrayLike, float]] = (), gap: float = GAP
                  ) -> tuple[Instance, NDArray[np.float64]]:
    """Return the instance of a group on a roadmap, and its places (n, 2) [m].

    The starts and goals are places of their own, each for one robot only: first all starts, then all goals, after the
    places of the roadmap. A start or a goal may be tighter than the rest; whoever leaves it must not come nearer to
    what makes it so.
    """
    count, base = len(members), len(roadmap.places)
    starts = np.array([member.start for member in members], float).reshape(-1, 2)
    goals = np.array([member.goal for member in members], float).reshape(-1, 2)
    radii = np.array([member.radius for member in members], float)
    own = np.concatenate([starts, goals])
    places = np.concatenate([roadmap.places, own])
    edges, room = _own_edges(roadmap, starts, goals, radii)
    edges = np.concatenate([roadmap.edges, edges])
    usable = np.zeros((count, len(edges)), bool)
    usable[:, :len(roadmap.edges)] = roadmap.rooms >= radii[:, None] + TIGHT
    owners = (edges[len(roadmap.edges):].max(axis=1) - base) % max(count, 1)
    usable[owners, np.arange(len(roadmap.edges), len(edges))] = room
    _avoid(usable, places, edges, starts, radii, base, standing)

    lengths = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
    at, home = base + np.arange(count), base + count + np.arange(count)
    home = np.where(np.linalg.norm(starts - goals, axis=1) < _HOME, at, home)
    to_go = np.empty((count, len(places)))
    for i in range(count):
        graph = csr_matrix((pebbles.move_costs(lengths[usable[i]]), edges[usable[i]].T), shape=(len(places),) * 2)
        to_go[i] = dijkstra(graph, directed=False, indices=home[i])
        if not np.isfinite(to_go[i, at[i]]):
            home[i] = at[i]
            to_go[i] = dijkstra(graph, directed=False, indices=home[i])
    instance = Instance(edges, lengths, at, home, usable, to_go, np.empty((0, 0), np.int64),
                        *np.empty((2, 0, 0, 0), bool))
    return with_gap(instance, places, roadmap, members, gap), places


def with_gap(instance: Instance, places: NDArray[np.float64], roadmap: Roadmap, members: Sequence[Member], gap: float
             ) -> Instance:
    """Return the instance where others are left more or less than before, ``gap`` [m], beside the radii."""
    radii = np.array([member.radius for member in members], float)
    count = len(members)
    needs = radii[:, None] + radii + gap
    sums, kinds = np.unique(needs.round(6), return_inverse=True)
    kinds = kinds.reshape(count, count).astype(np.int64)
    close = np.zeros((len(sums), len(places), len(places)), bool)
    swept = np.zeros((len(sums), len(instance.edges), len(places)), bool)
    for kind, distance in enumerate(sums.tolist()):
        _mark_conflicts(close[kind], swept[kind], roadmap, distance, gap, places, instance.edges)
    return replace(instance, kinds=kinds, close=close, swept=swept)


def _own_edges(roadmap, starts, goals, radii):
    """Return the edges (K, 2) that join starts and goals to the roadmap and to each other, and which have room (K,)."""
    own, base, count = np.concatenate([starts, goals]), len(roadmap.places), len(starts)
    who, where = roadmap.near(own)
    direct = np.flatnonzero(np.linalg.norm(starts - goals, axis=1) <= REACH)
    edges = np.concatenate([np.column_stack([where, who + base]),
                            np.column_stack([direct + base, direct + base + count])]).astype(np.int64)
    first = np.concatenate([own[who], starts[direct]])
    last = np.concatenate([roadmap.places[where], goals[direct]])
    need = np.concatenate([np.tile(radii, 2)[who], radii[direct]]) + TIGHT
    return edges, roadmap.has_room(first, last, need)


def _avoid(usable, places, edges, starts, radii, base, standing):
    """Rule out the edges that lead past those who stand; a start may be as near to one as it is."""
    if not len(standing):
        return
    discs, wide = np.array([place for place, _ in standing], float), np.array([radius for _, radius in standing])
    gaps = distances(places[edges[:, 0]], places[edges[:, 1]], discs)
    for i, radius in enumerate(radii):
        need = np.tile(radius + wide + TIGHT, (len(edges), 1))
        leaving = (edges == base + i).any(axis=1)
        need[leaving] = np.minimum(need[leaving], np.linalg.norm(discs - starts[i], axis=1) - _ROUNDING)
        usable[i] &= (gaps >= need).all(axis=1)


def _mark_conflicts(close, swept, roadmap, distance, gap, places, edges):
    """Mark which places are too close for two robots (n, n), and which edges are to places (m, n)."""
    base, few = len(roadmap.places), len(roadmap.edges)
    own = places[base:]
    count = len(own) // 2
    for table, pairs in zip((close, swept), roadmap.conflicts(distance)):
        table[pairs[0], pairs[1]] = True
    gaps = np.linalg.norm(own[:, None] - places, axis=2)
    # Starts and goals are what they are: robots do rest there together.
    gaps[:, base:] += gap
    close[base:], close[:, base:] = gaps < distance, (gaps < distance).T
    swept[:few, base:] = distances(places[edges[:few, 0]], places[edges[:few, 1]], own) < distance
    new = edges[few:]
    apart = distances(places[new[:, 0]], places[new[:, 1]], places)
    need = np.full(apart.shape, distance)
    between = np.linalg.norm(own[:, None] - own, axis=2)
    # Only places where two can rest together; from where they start they do, whatever was heard.
    between[between < distance - gap - 1e-6] = np.inf
    between[:count, :count] = np.linalg.norm(own[:count, None] - own[:count], axis=2)
    for end in new.T:
        is_own = end >= base
        need[is_own, base:] = np.minimum(need[is_own, base:], between[end[is_own] - base] - _SHRINK)
    # It is in nobody's way at its own start and goal.
    owner = (new.max(axis=1) - base) % max(count, 1)
    rows = np.arange(len(new))
    need[rows, base + owner] = need[rows, base + count + owner] = 0.0
    swept[few:] = apart < need
