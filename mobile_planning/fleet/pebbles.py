"""Pebbles: bring all robots of a group from place to place on a graph, step by step.

In a step several robots may move, if they can as well do so one after the other. PIBT (Okumura, Machida, Defago and
Tamura 2022) finds a step in which robots push whoever is in their way; LaCAM (Okumura 2023) searches the sequence of
steps with it, and finds one if there is one.
"""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

#: Configurations that one search looks at before it is begun anew: restarts beat one long search.
LIMITS = (300, 300, 600, 1200, 4800)
#: What a step without a move costs, and each move beside its length [m].
WAIT, EXTRA = 0.5, 0.02
#: Tries to better some moves, and places and times that one of them looks at.
_TRIES, _LOOKED_AT = 60, 20000


@dataclass(frozen=True, eq=False)
class Instance:
    """Who has to go where on a graph, and who is in whose way.

    Attributes
    ----------
    edges : (m, 2) ndarray of int
        Places that each edge joins.
    lengths : (m,) ndarray [m]
    starts, goals : (N,) ndarray of int
    usable : (N, m) ndarray of bool
        The edges that each robot may use.
    to_go : (N, n) ndarray [m]
        From each place to each robot's goal; infinite where nothing leads there.
    kinds : (N, N) ndarray of int
        Which of the tables holds for a pair of robots.
    close : (c, n, n) ndarray of bool
        Whether two robots are too close at two places.
    swept : (c, m, n) ndarray of bool
        Whether a robot on an edge comes too close to one at a place.
    """

    edges: NDArray[np.int64]
    lengths: NDArray[np.float64]
    starts: NDArray[np.int64]
    goals: NDArray[np.int64]
    usable: NDArray[np.bool_]
    to_go: NDArray[np.float64]
    kinds: NDArray[np.int64]
    close: NDArray[np.bool_]
    swept: NDArray[np.bool_]

    @property
    def count(self) -> int:
        """Number of robots."""
        return len(self.starts)

    @cached_property
    def adjacency(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Neighbours of place u and the edges there: first (n + 1,), targets and edges (2 m,) from first[u] on."""
        tails, heads = np.concatenate([self.edges.T, self.edges.T[::-1]], axis=1)
        turn = np.argsort(tails, kind='stable')
        first = np.searchsorted(tails[turn], np.arange(self.to_go.shape[1] + 1))
        return first.astype(np.int64), heads[turn], turn % max(len(self.edges), 1)

    @cached_property
    def moves(self) -> _Moves:
        """What each robot can do at each place."""
        return _Moves(self)

    @cached_property
    def rows(self) -> tuple[list, list, list]:
        """``kinds``, ``close`` and ``swept`` as nested lists, which Python reads faster."""
        return (self.kinds.tolist(), [[bytes(row) for row in table] for table in self.close],
                [[bytes(row) for row in table] for table in self.swept])


class _Moves(dict):
    """(robot, place) to the moves (to_go, place, edge) that lead somewhere, to stay among them; made when asked for."""

    def __init__(self, instance: Instance):
        super().__init__()
        self._instance = instance

    def __missing__(self, key):
        robot, place = key
        instance = self._instance
        first, targets, by = instance.adjacency
        to_go, usable = instance.to_go[robot], instance.usable[robot]
        moves = [(float(to_go[place]), int(place), -1)]
        for v, e in zip(targets[first[place]:first[place + 1]].tolist(), by[first[place]:first[place + 1]].tolist()):
            if usable[e] and np.isfinite(to_go[v]):
                moves.append((float(to_go[v]), v, e))
        self[key] = moves
        return moves


@dataclass(frozen=True, eq=False)
class Steps:
    """Where everybody is before and after each step.

    Attributes
    ----------
    places : (T + 1, N) ndarray of int
    edges : (T, N) ndarray of int
        Along which each robot moves; -1 if it stays.
    is_solved : bool
        Whether all are at their goals in the end.
    configurations : int
        Looked at to find them.
    """

    places: NDArray[np.int64]
    edges: NDArray[np.int64]
    is_solved: bool
    configurations: int = 0


def solve(instance: Instance, urgency: Sequence[float], rng: np.random.Generator,
          limits: Sequence[int] = LIMITS) -> Steps:
    """Return steps that bring everybody home, or as near as was found.

    Parameters
    ----------
    instance : Instance
    urgency : (N,) sequence of float
        Whoever has more goes first.
    rng : numpy.random.Generator
        Settles ties, and draws another order for each search that is begun anew.
    limits : sequence of int
        Of configurations, one a search.
    """
    best, looked_at = None, 0
    for turn, limit in enumerate(limits):
        urgent = np.asarray(urgency, float)
        if turn:
            urgent = 10.0 * rng.permutation(instance.count) + urgent * (turn % 2)
        found = search(instance, urgent, rng, limit)
        looked_at += found.configurations
        if best is None or found.is_solved or _left(instance, found) < _left(instance, best):
            best = found
        if found.is_solved or found.configurations < limit:
            break
    return Steps(best.places, best.edges, best.is_solved, looked_at)


def _left(instance, steps):
    return instance.to_go[np.arange(instance.count), steps.places[-1]].sum()


class _Configuration:
    """A node of the search: where everybody is, how that came, and what is still to be tried."""

    def __init__(self, places, parent, edges, waiting, left):
        self.places, self.parent, self.edges, self.waiting, self.left = places, parent, edges, waiting, left
        self.order = sorted(range(len(places)), key=lambda robot: -waiting[robot])
        self.constraints = deque([()])


def search(instance: Instance, urgency: NDArray[np.float64], rng: np.random.Generator, limit: int) -> Steps:
    """Return the steps that LaCAM finds within ``limit`` configurations; it finds some if there are any and time."""
    start, goal = tuple(instance.starts.tolist()), tuple(instance.goals.tolist())
    to_go = instance.to_go
    robots = range(instance.count)
    # Who is urgent goes first, then who has far to go; who has waited for a step comes before both.
    base = [1e-3 * urgency[i] + 1e-4 * to_go[i, start[i]] for i in robots]
    root = _Configuration(start, None, None, base, sum(to_go[i, start[i]] for i in robots))
    known, stack, best, looked_at = {start: root}, [root], root, 0
    while stack and looked_at < limit:
        looked_at += 1
        here = stack[-1]
        if here.left < best.left:
            best = here
        if here.places == goal:
            best = here
            break
        if not here.constraints:
            stack.pop()
            continue
        constraint = here.constraints.popleft()
        noise = (1e-3 * rng.random(64)).tolist()
        if len(constraint) < len(here.order):
            robot = here.order[len(constraint)]
            moves = sorted(instance.moves[robot, here.places[robot]], key=lambda move: move[0] + noise[move[1] % 64])
            here.constraints.extend(constraint + ((robot, v, e),) for _, v, e in moves)
        step = next_step(instance, here.places, here.order, constraint, noise)
        if step is None:
            continue
        places = tuple(v for v, _ in step)
        if places == here.places:
            continue
        if places in known:
            stack.append(known[places])
            continue
        waiting = [base[i] if places[i] == goal[i] else here.waiting[i] + 1 for i in robots]
        left = sum(to_go[i, places[i]] for i in robots)
        known[places] = _Configuration(places, here, [e for _, e in step], waiting, left)
        stack.append(known[places])
    return _history(best, best.places == goal, looked_at)


def _history(configuration, is_solved, looked_at):
    places, edges = [configuration.places], []
    while configuration.parent is not None:
        edges.append(configuration.edges)
        configuration = configuration.parent
        places.append(configuration.places)
    count = len(configuration.places)
    return Steps(np.array(places[::-1], np.int64), np.array(edges[::-1], np.int64).reshape(-1, count), is_solved,
                 looked_at)


def next_step(instance: Instance, places: Sequence[int], order: Sequence[int],
              constraint: Sequence[tuple[int, int, int]], noise: Sequence[float]) -> list[tuple[int, int]] | None:
    """Return the place and the edge that each robot takes next by PIBT, None if the constraint leaves no step.

    Parameters
    ----------
    instance : Instance
    places : (N,) sequence of int
    order : (N,) sequence of int
        Robots, the one that chooses first first.
    constraint : sequence of (robot, place, edge)
        Moves that are settled.
    noise : (64,) sequence of float [m]
        Settles ties between places.
    """
    step = _Step(instance, places, noise)
    for robot, place, edge in constraint:
        if not step.settle(robot, place, edge):
            return None
    for robot in order:
        if step.next[robot] is None and not step.choose(robot):
            return None
    return step.next


class _Step:
    """One step being put together: who goes where, and who must go before whom."""

    def __init__(self, instance, places, noise):
        self.next: list = [None] * len(places)
        # Bit b of before[a]: b moves before a.
        self.before = [0] * len(places)
        self._places, self._moves, self._noise = places, instance.moves, noise
        self._kinds, self._close, self._swept = instance.rows

    def choose(self, robot):
        """Settle the move of one robot and of all that are in its way; return whether there is one."""
        places, noise, kinds = self._places, self._noise, self._kinds[robot]
        for _, v, e in sorted(self._moves[robot, places[robot]], key=lambda move: move[0] + noise[move[1] % 64]):
            kept = self.next[:], self.before[:]
            if self.settle(robot, v, e):
                pushed = () if e < 0 else [
                    other for other, chosen in enumerate(self.next) if chosen is None
                    and (self._swept[kinds[other]][e][places[other]] or self._close[kinds[other]][v][places[other]])]
                if all(self.next[other] is not None or self.choose(other) for other in pushed):
                    return True
            self.next, self.before = kept
        return False

    def settle(self, robot, v, e):
        """Let the robot move to v along e; return False, and leave all in pieces, if that cannot be with the others."""
        places = self._places
        u, kinds = places[robot], self._kinds[robot]
        for other, chosen in enumerate(self.next):
            if chosen is None:
                continue
            v2, e2 = chosen
            if e < 0 and e2 < 0:
                continue
            close, swept = self._close[kinds[other]], self._swept[kinds[other]]
            if close[v][v2]:
                return False
            u2 = places[other]
            first = (e < 0 or not swept[e][u2]) and (e2 < 0 or not swept[e2][v])
            second = (e2 < 0 or not swept[e2][u]) and (e < 0 or not swept[e][v2])
            if first and second:
                continue
            if not (first and self._precede(robot, other) or second and self._precede(other, robot)):
                return False
        self.next[robot] = v, e
        return True

    def _precede(self, a, b):
        """Note that a moves before b; return False if b must move before a."""
        before = self.before
        if before[a] >> b & 1:
            return False
        earlier = before[a] | 1 << a
        for robot in range(len(before)):
            if robot == b or before[robot] >> b & 1:
                before[robot] |= earlier
        return True


def refined(instance: Instance, steps: Steps, rng: np.random.Generator, tries: int = _TRIES) -> Steps:
    """Return steps that are no worse: each robot alone, then a few at a time look for better ways among the others.

    Large neighbourhood search (Li, Chen, Harabor, Stuckey, Koenig 2021); it may be stopped after any number of tries.
    """
    if not steps.is_solved or not len(steps.edges):
        return steps
    best, value = steps, _value(instance, steps)
    singles = [[int(robot)] for robot in np.argsort(_costs(instance, steps))[::-1]]
    for turn in range(tries):
        chosen = singles[turn] if turn < len(singles) else _some(_costs(instance, best), rng)
        found = _replanned(instance, best, chosen)
        if found is not None and _value(instance, found) < value - 1e-6:
            best, value = found, _value(instance, found)
    moving = np.flatnonzero((best.edges >= 0).any(axis=1))
    last = moving[-1] + 1 if len(moving) else 0
    return Steps(best.places[:last + 1], best.edges[:last], True, steps.configurations)


def _some(costs, rng):
    """Return two to four robots in any order, those with costly moves more often."""
    count = min(len(costs), int(rng.integers(2, 5)))
    return rng.choice(len(costs), count, replace=False, p=(costs + 1.0) / (costs + 1.0).sum()).tolist()


def _value(instance, steps):
    """Return what the steps cost: what the last robot's moves do, and, less, the others'."""
    costs = _costs(instance, steps)
    return costs.max() + 0.5 * costs.mean()


def _costs(instance, steps):
    return np.array([cost(instance, edges) for edges in steps.edges.T])


def cost(instance: Instance, edges: NDArray[np.int64]) -> float:
    """Return what one robot's moves (T,) cost [m]: their lengths, and what it waits before its last."""
    moving = np.flatnonzero(edges >= 0)
    if not len(moving):
        return 0.0
    return float((instance.lengths[edges[moving]] + EXTRA).sum() + WAIT * (moving[-1] + 1 - len(moving)))


def _replanned(instance, steps, robots):
    """Return steps in which some robots move anew, one after the other, among the rest; None where they cannot."""
    from mobile_planning.fleet import pebble_kernels as kernels

    places, edges = steps.places.copy(), steps.edges.copy()
    for index, robot in enumerate(robots):
        others = np.setdiff1d(np.arange(instance.count), robots[index:])
        new_places, new_edges = kernels.replan(
            *instance.adjacency, instance.usable[robot], instance.lengths, instance.to_go[robot], instance.close,
            instance.swept, instance.kinds[robot, others], np.ascontiguousarray(places[:, others]),
            np.ascontiguousarray(edges[:, others]), instance.starts[robot], instance.goals[robot], WAIT, EXTRA,
            _LOOKED_AT)
        if not len(new_places):
            return None
        places[:, robot], edges[:, robot] = new_places, new_edges
    found = Steps(places, edges, True)
    return None if any(ranks(instance, found, t) is None for t in range(len(edges))) else found


def ranks(instance: Instance, steps: Steps, t: int) -> NDArray[np.int64] | None:
    """Return in which turn each robot (N,) makes its move of step ``t``; None if they can only move all at once."""
    from mobile_planning.fleet import pebble_kernels as kernels

    turn = np.empty(instance.count, np.int64)
    is_playable = kernels.rank_moves(instance.close, instance.swept, instance.kinds, steps.places[t],
                                     steps.places[t + 1], steps.edges[t], turn)
    return turn if is_playable else None
