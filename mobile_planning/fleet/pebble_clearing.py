"""Clearing: pebbles that must turn their order round in a dead end all leave it first, by way of open ground.

A search that is drawn to the goals finds that late: each time it lets one out, the next goes in.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from mobile_planning.fleet.pebble_search import solve
from mobile_planning.fleet.pebbles import Instance, Steps, move_costs

#: Choices of open places, fewer for many robots; places to choose from for each, and configurations looked at.
_CHOICES, _ROBOTS, _POOL, _LIMITS = 6, 24, 6, (300, 300, 600)


def by_open_ground(instance: Instance, urgency: Sequence[float], rng: np.random.Generator) -> Steps | None:
    """Return steps that lead everybody home by way of open places, None if none were found.

    What leads from the goals to the open places, played backwards, leads from there to the goals.

    Parameters
    ----------
    instance : Instance
    urgency : (N,) sequence of float
        Whoever has more leaves first.
    rng : numpy.random.Generator
    """
    for _ in range(max(1, min(_CHOICES, _ROBOTS // instance.count))):
        places = _open_places(instance, rng)
        if places is None:
            return None
        out = solve(_between(instance, instance.starts, places), urgency, rng, _LIMITS)
        if not out.is_solved:
            continue
        back = solve(_between(instance, instance.goals, places), urgency, rng, _LIMITS)
        if back.is_solved:
            return Steps(np.concatenate([out.places, back.places[-2::-1]]),
                         np.concatenate([out.edges, back.edges[::-1]]), True,
                         out.configurations + back.configurations)
    return None


def _between(instance, starts, goals):
    """Return the instance of the same robots from ``starts`` to ``goals`` (N,)."""
    return replace(instance, starts=starts, goals=goals,
                   to_go=np.array([_costs(instance, robot, goal) for robot, goal in enumerate(goals)]))


def _costs(instance, robot, place) -> NDArray[np.float64]:
    """Return what the moves of a robot cost from each place (n,) to one."""
    usable, size = instance.usable[robot], instance.to_go.shape[1]
    graph = csr_matrix((move_costs(instance.lengths[usable]), instance.edges[usable].T), shape=(size, size))
    return dijkstra(graph, directed=False, indices=place)


def _open_places(instance, rng):
    """Return a place (N,) for each robot from which many edges lead on, near where they are; None if they lack room."""
    edges = instance.edges[instance.usable.all(axis=0)]
    degree = np.bincount(edges.ravel(), minlength=instance.to_go.shape[1])
    far = np.max([_costs(instance, robot, start) for robot, start in enumerate(instance.starts)], axis=0)
    is_open = (degree >= np.percentile(degree[degree > 0], 50) if len(edges) else degree < 0) & np.isfinite(far)
    pool = np.flatnonzero(is_open)
    pool = rng.permutation(pool[np.argsort(far[pool], kind='stable')[:_POOL * instance.count]])
    chosen = []
    for robot in range(instance.count):
        kinds = instance.kinds[robot, :robot]
        free = [place for place in pool.tolist() if not instance.close[kinds, chosen, place].any()]
        if not free:
            return None
        chosen.append(free[0])
    return np.array(chosen, np.int64)
