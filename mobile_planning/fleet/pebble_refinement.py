"""Refinement: better steps for pebbles than the first that lead home."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet import pebbles
from mobile_planning.fleet.pebble_search import LIMITS, search, solve
from mobile_planning.fleet.pebbles import Instance, Steps

#: Searches in all, how many of them are bettered, and robots times configurations that they may look at.
_SEARCHES, _BETTERED, _WORK = 10, 3, 4000
#: Tries to better some moves, and places and times that one of them looks at, and all of them.
_TRIES, _LOOKED_AT, _ALL = 80, 20000, 70_000
#: Share of the tries with robots at random; in the others one chooses before so many that were home before it.
_AT_RANDOM, _OVERTAKEN = 0.5, 5
#: One step in so many is added in which nobody moves.
_IDLE = 4
#: Places times steps that all tries together may span: on large maps there are fewer tries.
_SPANNED = 2_500_000


def best_steps(instance: Instance, urgency: Sequence[float], rng: np.random.Generator,
               limits: Sequence[int] = LIMITS, times: Callable[[Steps], NDArray[np.float64]] | None = None,
               draw: Callable[[np.random.Generator], NDArray[np.float64]] | None = None) -> Steps:
    """Return good steps that bring everybody home, or the ones that come nearest if none was found.

    Which robots go first decides more than what can be bettered afterwards: several searches in random orders are
    made, and the best few of them refined.

    Parameters
    ----------
    instance : Instance
    urgency, rng, limits
        See `solve`.
    times : callable
        Returns for steps when each robot (N,) is home; by default `pebbles.costs`.
    draw : callable
        Returns the urgency (N,) for another search, given ``rng``; by default any order.
    """
    times = times or partial(pebbles.costs, instance)

    def value(steps):
        return pebbles.worst_and_mean(times(steps))

    first = solve(instance, urgency, rng, limits)
    if not first.is_solved or not len(first.edges):
        return first
    found, work = [first], 0
    while len(found) < _SEARCHES and work < _WORK:
        urgent = draw(rng) if draw else any_order(instance.count, rng)
        another = search(instance, urgent, rng, 2 * len(first.edges) + 20)
        work += instance.count * another.configurations
        found += [another] if another.is_solved else []
    found = sorted(found, key=value)[:_BETTERED]
    tries = min(_TRIES, _SPANNED // (len(first.edges) * instance.to_go.shape[1]))
    found = [refined(instance, steps, rng, tries // (2 * _BETTERED), times, _ALL // (2 * _BETTERED)) for steps in found]
    best = min(found, key=value)
    return refined(instance, best, rng, tries // 2, times, _ALL // 2)


def any_order(count: int, rng: np.random.Generator) -> NDArray[np.float64]:
    """Return the urgency (count,) of robots in any order."""
    return 10.0 * rng.permutation(count)


def refined(instance: Instance, steps: Steps, rng: np.random.Generator, tries: int = _TRIES,
            times: Callable[[Steps], NDArray[np.float64]] | None = None, work: int = _ALL) -> Steps:
    """Return steps that are no worse: each robot alone, then a few at a time look for better ways among the others.

    Large neighbourhood search (Li, Chen, Harabor, Stuckey, Koenig 2021); it is stopped after so many ``tries``, or when
    they have looked at ``work`` places and times.
    """
    if not steps.is_solved or not len(steps.edges):
        return steps
    times = times or partial(pebbles.costs, instance)
    best, at = _with_idle(steps), times(steps)
    singles = [[int(robot)] for robot in np.argsort(at)[::-1]]
    for turn in range(tries):
        if work <= 0:
            break
        chosen = singles[turn] if turn < len(singles) else _some(at, rng)
        found, looked_at = _replanned(instance, best, chosen)
        work -= looked_at
        if found is not None:
            found_at = times(found)
            if pebbles.worst_and_mean(found_at) < pebbles.worst_and_mean(at) - 1e-6:
                best, at = found, found_at
    moving = np.flatnonzero((best.edges >= 0).any(axis=1))
    last = moving[-1] + 1 if len(moving) else 0
    return Steps(best.places[:last + 1], best.edges[:last], True, steps.configurations)


def _with_idle(steps):
    """Return the steps with some more in which nobody moves: another order may take longer before it takes less."""
    more = len(steps.edges) // _IDLE + 1
    return Steps(np.concatenate([steps.places, np.repeat(steps.places[-1:], more, axis=0)]),
                 np.concatenate([steps.edges, np.full((more, steps.edges.shape[1]), -1)]), True, steps.configurations)


def _some(times, rng):
    """Return robots in the order in which they choose: by turns a few at random, or one earlier than it did."""
    count, weights = len(times), (times + 1.0) / (times + 1.0).sum()
    if rng.random() < _AT_RANDOM:
        return rng.choice(count, min(count, int(rng.integers(2, 5))), replace=False, p=weights).tolist()
    upto = np.cumsum(weights)
    late = int(np.searchsorted(upto / upto[-1], rng.random(), side='right'))
    order = np.argsort(times, kind='stable')
    rank = int(np.flatnonzero(order == late)[0])
    first = int(rng.integers(max(0, rank - _OVERTAKEN), rank + 1))
    return [late, *order[first:rank].tolist()]


def _replanned(instance, steps, robots):
    """Return steps in which some robots move anew, one after the other, among the rest, and what was looked at.

    None for the steps where there are no others.
    """
    from mobile_planning.fleet import pebble_kernels as kernels

    places, edges, ranks = steps.places.copy(), steps.edges.copy(), np.empty(steps.edges.shape, np.int64)
    has_found, looked_at = kernels.replan_some(
        *instance.adjacency, instance.usable, instance.lengths, instance.to_go, instance.close, instance.swept,
        instance.meets, instance.kinds, places, edges, instance.starts, instance.goals, np.array(robots, np.int64),
        pebbles.WAIT, pebbles.EXTRA, _LOOKED_AT, ranks)
    if not has_found or np.array_equal(edges, steps.edges):
        return None, looked_at
    return Steps(places, edges, True, ranks=ranks), looked_at
