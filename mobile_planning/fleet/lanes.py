"""Lanes: who wants through which narrow passage, and whether two meet in it."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from mobile_planning.fleet.roadmap import TIGHT, Roadmap

#: Two meet in a lane unless they are this far apart in time, and it matters if the first comes so soon [s].
_APART, _SOON = 1.5, 6.0
_STEP = 0.1
#: A generation of fields ends when each has been asked for so often, on the average and with some questions to spare,
#: or when there are too many. Who is not asked for by the end of the next one is let go.
_OFTEN, _SPARE, _MOST = 4, 16, 128


@dataclass(frozen=True, eq=False)
class Use:
    """How a robot will drive through a lane.

    Attributes
    ----------
    entry, exit : (2,) ndarray [m]
    since, until : float [s]
        From now.
    """

    entry: NDArray[np.float64]
    exit: NDArray[np.float64]
    since: float
    until: float

    def meets(self, other: Use) -> bool:
        """Return whether two come against each other, at about the same time and soon."""
        if self.since > other.until + _APART or other.since > self.until + _APART:
            return False
        if min(self.since, other.since) > _SOON:
            return False
        against = np.linalg.norm(self.entry - other.exit) + np.linalg.norm(self.exit - other.entry)
        along = np.linalg.norm(self.entry - other.entry) + np.linalg.norm(self.exit - other.exit)
        return bool(against < along)

    def may_meet(self, soonest: float) -> bool:
        """Return whether this can meet the use of one who is not in the lane before ``soonest`` [s]."""
        return soonest <= self.until + _APART and min(self.since, soonest) <= _SOON


class LaneFinder:
    """The lanes on the ways to goals; the fields of the goals that were asked for of late are kept.

    Parameters
    ----------
    roadmap : Roadmap
    """

    def __init__(self, roadmap: Roadmap):
        self.roadmap = roadmap
        self._fields: dict[tuple, tuple] = {}
        self._older: dict[tuple, tuple] = {}
        self._questions = 0
        self._extents: dict[int, tuple] = {}

    def uses(self, place: ArrayLike, goal: ArrayLike, radius: float, v_max: float) -> dict[int, Use]:
        """Return how a robot that drives from ``place`` to ``goal`` (2,) [m] uses the lanes, by their numbers."""
        if not self.roadmap.has_lanes:
            return {}
        way = self._way(np.asarray(place, float), np.asarray(goal, float), radius)
        lengths = np.linalg.norm(np.diff(way, axis=0), axis=1)
        arc = np.append(0.0, np.cumsum(lengths))
        at = np.arange(0.0, arc[-1] + _STEP, _STEP)
        points = np.column_stack([np.interp(at, arc, way[:, axis]) for axis in range(2)])
        lanes = self.roadmap.lane_at(points)
        found = {}
        for lane in np.unique(lanes[lanes > 0]).tolist():
            first, last = np.flatnonzero(lanes == lane)[[0, -1]]
            # From before to beyond, so that a mere door has a direction too.
            found[lane] = Use(points[max(first - 1, 0)], points[min(last + 1, len(points) - 1)],
                              at[first] / v_max, at[last] / v_max)
        return found

    def soonest(self, lane: int, place: ArrayLike, v_max: float) -> float:
        """Return a time [s] before which nobody who is at ``place`` (2,) [m] is in a lane; far quicker than `uses`."""
        if lane not in self._extents:
            self._extents[lane] = self.roadmap.lane_extent(lane)
        low, high = self._extents[lane]
        away = np.maximum(np.maximum(low - place, place - high), 0.0)
        return float(np.hypot(*away)) / v_max

    def _way(self, place, goal, radius):
        """Return way-points (W, 2) over the roadmap; just the place where there is no way."""
        cost, onwards = self._field(goal, radius)
        _, near = self.roadmap.near(place)
        if not len(near):
            return place[None]
        fits = self.roadmap.has_room(np.broadcast_to(place, (len(near), 2)), self.roadmap.places[near], radius + TIGHT)
        lengths = np.linalg.norm(self.roadmap.places[near] - place, axis=1)
        total = np.where(fits, lengths + cost[near], np.inf)
        if not np.isfinite(total.min()):
            return place[None]
        nodes = [int(near[total.argmin()])]
        while 0 <= onwards[nodes[-1]] < len(self.roadmap.places):
            nodes.append(int(onwards[nodes[-1]]))
        return np.concatenate([place[None], self.roadmap.places[nodes], goal[None]])

    def _field(self, goal, radius):
        """Return the cost from each place to the goal and the place that comes next (n,)."""
        if self._questions >= _OFTEN * len(self._fields) + _SPARE or len(self._fields) >= _MOST:
            self._fields, self._older, self._questions = {}, self._fields, 0
        self._questions += 1
        key = (*goal.tolist(), radius)
        if key not in self._fields:
            known = self._older.get(key)
            self._fields[key] = self._search(goal, radius) if known is None else known
        return self._fields[key]

    def _search(self, goal, radius):
        roadmap, count = self.roadmap, len(self.roadmap.places)
        _, near = roadmap.near(goal)
        near = near[roadmap.has_room(np.broadcast_to(goal, (len(near), 2)), roadmap.places[near], radius + TIGHT)]
        usable = roadmap.edges[roadmap.rooms >= radius + TIGHT]
        edges = np.concatenate([usable, np.column_stack([near, np.full(len(near), count)])])
        places = np.concatenate([roadmap.places, goal[None]])
        lengths = np.linalg.norm(places[edges[:, 0]] - places[edges[:, 1]], axis=1)
        graph = csr_matrix((lengths, edges.T), shape=(count + 1, count + 1))
        return dijkstra(graph, directed=False, indices=count, return_predecessors=True)
