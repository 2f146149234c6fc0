"""Search for steps that bring all pebbles home.

PIBT (Okumura, Machida, Defago and Tamura 2022) finds a step in which robots push whoever is in their way; LaCAM
(Okumura 2023) searches the sequence of steps with it, and finds one if there is one.
"""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.pebbles import Instance, Steps

#: Configurations that one search looks at before it is begun anew: restarts beat one long search.
LIMITS = (300, 300, 600, 1200, 4800)


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
            moves = _best_first(instance.moves[robot, here.places[robot]], noise)
            here.constraints.extend(constraint + ((robot, v, e),) for _, _, v, e in moves)
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


def _best_first(moves, noise):
    """Return the ``moves`` (to_go, place, edge), each after its cost with noise and its turn, by these."""
    return sorted([(to_go + noise[v % 64], turn, v, e) for turn, (to_go, v, e) in enumerate(moves)])


class _Step:
    """One step being put together: who goes where, and who must go before whom."""

    def __init__(self, instance, places, noise):
        self.next: list = [None] * len(places)
        # Bit b of before[a]: b moves before a.
        self.before = [0] * len(places)
        self._places, self._moves, self._noise = places, instance.moves, noise
        self._kinds, self._close, self._swept, meets = instance.rows
        # Nobody else can be in a robot's way in this step.
        self._near = [[other for other, v in enumerate(places) if meets[u][v] and other != robot]
                      for robot, u in enumerate(places)]

    def choose(self, robot):
        """Settle the move of one robot and of all that are in its way; return whether there is one."""
        places, noise, kinds = self._places, self._noise, self._kinds[robot]
        for _, _, v, e in _best_first(self._moves[robot, places[robot]], noise):
            kept = self.next[:], self.before[:]
            if self.settle(robot, v, e):
                pushed = () if e < 0 else [
                    other for other in self._near[robot] if self.next[other] is None
                    and (self._swept[kinds[other]][e][places[other]] or self._close[kinds[other]][v][places[other]])]
                if all(self.next[other] is not None or self.choose(other) for other in pushed):
                    return True
            self.next, self.before = kept
        return False

    def settle(self, robot, v, e):
        """Let the robot move to v along e; return False, and leave all in pieces, if that cannot be with the others."""
        places = self._places
        u, kinds = places[robot], self._kinds[robot]
        for other in self._near[robot]:
            chosen = self.next[other]
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
