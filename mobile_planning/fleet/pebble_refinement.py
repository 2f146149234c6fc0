"""Refinement: better steps for pebbles than the first that lead home."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mobile_planning.fleet import pebbles
from mobile_planning.fleet.pebble_search import LIMITS, search, solve
from mobile_planning.fleet.pebbles import Instance, Steps

#: Searches in all, how many of them are bettered, and robots times configurations that they may look at.
_SEARCHES, _BETTERED, _WORK = 12, 3, 4000
#: Tries to better some moves, and places and times that one of them looks at.
_TRIES, _LOOKED_AT = 60, 20000
#: Places times steps that all tries together may span: on large maps there are fewer tries.
_SPANNED = 2_500_000


def best_steps(instance: Instance, urgency: Sequence[float], rng: np.random.Generator,
               limits: Sequence[int] = LIMITS) -> Steps:
    """Return good steps that bring everybody home, or the ones that come nearest if none was found.

    Which robots go first decides more than what can be bettered afterwards: several searches in random orders are
    made, and the best few of them refined.

    Parameters
    ----------
    instance : Instance
    urgency, rng, limits
        See `solve`.
    """
    first = solve(instance, urgency, rng, limits)
    if not first.is_solved or not len(first.edges):
        return first
    found, work = [first], 0
    while len(found) < _SEARCHES and work < _WORK:
        another = search(instance, 10.0 * rng.permutation(instance.count), rng, 2 * len(first.edges) + 20)
        work += instance.count * another.configurations
        found += [another] if another.is_solved else []
    found = sorted(found, key=lambda steps: pebbles.value(instance, steps))[:_BETTERED]
    tries = min(_TRIES, _SPANNED // (len(first.edges) * instance.to_go.shape[1]))
    found = [refined(instance, steps, rng, tries // (2 * _BETTERED)) for steps in found]
    best = min(found, key=lambda steps: pebbles.value(instance, steps))
    return refined(instance, best, rng, tries // 2)


def refined(instance: Instance, steps: Steps, rng: np.random.Generator, tries: int = _TRIES) -> Steps:
    """Return steps that are no worse: each robot alone, then a few at a time look for better ways among the others.

    Large neighbourhood search (Li, Chen, Harabor, Stuckey, Koenig 2021); it may be stopped after any number of tries.
    """
    if not steps.is_solved or not len(steps.edges):
        return steps
    best, value = steps, pebbles.value(instance, steps)
    singles = [[int(robot)] for robot in np.argsort(pebbles.costs(instance, steps))[::-1]]
    for turn in range(tries):
        chosen = singles[turn] if turn < len(singles) else _some(pebbles.costs(instance, best), rng)
        found = _replanned(instance, best, chosen)
        if found is not None and pebbles.value(instance, found) < value - 1e-6:
            best, value = found, pebbles.value(instance, found)
    moving = np.flatnonzero((best.edges >= 0).any(axis=1))
    last = moving[-1] + 1 if len(moving) else 0
    return Steps(best.places[:last + 1], best.edges[:last], True, steps.configurations)


def _some(costs, rng):
    """Return two to four robots in any order, those with costly moves more often."""
    count = min(len(costs), int(rng.integers(2, 5)))
    return rng.choice(len(costs), count, replace=False, p=(costs + 1.0) / (costs + 1.0).sum()).tolist()


def _replanned(instance, steps, robots):
    """Return steps in which some robots move anew, one after the other, among the rest; None where they cannot."""
    from mobile_planning.fleet import pebble_kernels as kernels

    places, edges = steps.places.copy(), steps.edges.copy()
    for index, robot in enumerate(robots):
        others = np.setdiff1d(np.arange(instance.count), robots[index:])
        new_places, new_edges = kernels.replan(
            *instance.adjacency, instance.usable[robot], instance.lengths, instance.to_go[robot], instance.close,
            instance.swept, instance.kinds[robot, others], np.ascontiguousarray(places[:, others]),
            np.ascontiguousarray(edges[:, others]), instance.starts[robot], instance.goals[robot],
            pebbles.WAIT, pebbles.EXTRA, _LOOKED_AT)
        if not len(new_places):
            return None
        places[:, robot], edges[:, robot] = new_places, new_edges
    found = Steps(places, edges, True)
    return None if any(pebbles.ranks(instance, found, t) is None for t in range(len(edges))) else found
