"""Pebbles: robots that go from place to place on a graph, step by step.

In a step several robots may move, if they can as well do so one after the other.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

#: What a step costs at least, and each move beside its length [m].
WAIT, EXTRA = 0.5, 0.02


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
        What the moves from each place to each robot's goal cost, at most; infinite where nothing leads there.
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
    def meets(self) -> NDArray[np.bool_]:
        """Whether two robots at two places can be in each other's way in a step (n, n), wherever they go."""
        from mobile_planning.fleet import pebble_kernels as kernels

        return kernels.may_meet(*self.adjacency, self.close, self.swept)

    @cached_property
    def moves(self) -> _Moves:
        """What each robot can do at each place."""
        return _Moves(self)

    @cached_property
    def rows(self) -> tuple[list, list, list, list]:
        """``kinds``, ``close``, ``swept`` and ``meets`` as nested lists, which Python reads faster."""
        return (self.kinds.tolist(), [_rows(table) for table in self.close], [_rows(table) for table in self.swept],
                _rows(self.meets))


def _rows(table):
    """Return the rows of a table (k, n) of bool as bytes."""
    content, width = table.tobytes(), table.shape[1]
    return [content[first:first + width] for first in range(0, len(content), width)]


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
        around = slice(first[place], first[place + 1])
        targets, by = targets[around], by[around]
        leads_on = usable[by] & np.isfinite(to_go[targets])
        targets, by = targets[leads_on], by[leads_on]
        moves = [(float(to_go[place]), int(place), -1), *zip(to_go[targets].tolist(), targets.tolist(), by.tolist())]
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
    ranks : (T, N) ndarray of int, optional
        See `ranks`, where they are known.
    """

    places: NDArray[np.int64]
    edges: NDArray[np.int64]
    is_solved: bool
    configurations: int = 0
    ranks: NDArray[np.int64] | None = None


def value(instance: Instance, steps: Steps) -> float:
    """Return what the steps cost [m]: what the last robot's moves do, and, less, the others'."""
    return worst_and_mean(costs(instance, steps))


def worst_and_mean(times: NDArray[np.float64]) -> float:
    """Return how bad it is that the robots are home after ``times`` (N,): the last counts, and, less, the others."""
    return float(times.max() + 0.5 * times.mean())


def costs(instance: Instance, steps: Steps) -> NDArray[np.float64]:
    """Return what the moves of each robot (N,) cost [m]; see `cost`."""
    return np.array([cost(instance, edges) for edges in steps.edges.T])


def cost(instance: Instance, edges: NDArray[np.int64]) -> float:
    """Return what one robot's moves (T,) cost [m]: their lengths, no step less than a wait, up to its last move."""
    moving = np.flatnonzero(edges >= 0)
    if not len(moving):
        return 0.0
    return float(move_costs(instance.lengths[edges[moving]]).sum() + WAIT * (moving[-1] + 1 - len(moving)))


def move_costs(lengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return what moves of some ``lengths`` (K,) [m] cost [m]."""
    return np.maximum(lengths, WAIT) + EXTRA


def ranks(instance: Instance, steps: Steps) -> NDArray[np.int64] | None:
    """Return in which turn each robot makes its move of each step (T, N); None if one can only be made all at once."""
    from mobile_planning.fleet import pebble_kernels as kernels

    if steps.ranks is not None:
        return steps.ranks
    turns = np.empty(steps.edges.shape, np.int64)
    playable = kernels.rank_steps(instance.close, instance.swept, instance.kinds, steps.places, steps.edges, turns)
    return turns if playable == len(turns) else None
