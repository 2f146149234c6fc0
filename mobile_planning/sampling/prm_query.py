"""One query of a roadmap: its search, and the nodes of its own where the roadmap has no path."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import Cancelled, PlanningTimeout
from mobile_planning.sampling.plan_result import Improvement, PlanResult, PlanStatus
from mobile_planning.sampling.roadmap import Roadmap
from mobile_planning.sampling.roadmap_growth import RoadmapGrowth
from mobile_planning.sampling.roadmap_search import RoadmapSearch
from mobile_planning.sampling.samplers import around, bridges

# Points of a path are at most so far apart [m].
_SPACING = 0.05
# Of each enhancement: centres of both kinds, points about each, blocks drawn for passages, share of the nodes added.
_CENTRES, _AROUND, _BLOCKS, _SHARE = 20, 3, 8, 0.1
_BLOCK = 1024


@dataclass(eq=False)
class RoadmapQuery:
    """One query, whose nodes are its own: the roadmap only learns which of its nodes and edges are free.

    Attributes
    ----------
    growth : RoadmapGrowth
        With space, options, the flag whose ``with`` block is open, and the watch.
    roadmap : Roadmap
    start, goal : (d,) ndarray
        Free points.
    seed : int
    """

    growth: RoadmapGrowth
    roadmap: Roadmap
    start: NDArray[np.float64]
    goal: NDArray[np.float64]
    seed: int

    def __post_init__(self):
        self._random, self._checks, self._expansions = np.random.default_rng(self.seed), 0, 0

    def result(self) -> PlanResult:
        """Return the shortest path, or why there is none."""
        try:
            with self.growth.flag:
                found = self._path()
        except PlanningTimeout:
            return self._answer(PlanStatus.TIMEOUT)
        except Cancelled:
            return self._answer(PlanStatus.CANCELLED)
        return self._answer(PlanStatus.NO_PATH) if found is None else self._answer(PlanStatus.SOLVED, *found)

    def _path(self):
        """Return the corners of the shortest path and its length, or None."""
        found, barriers = self._search()
        for _ in range(self.growth.options.enhancements):
            if found is not None or self._is_over():
                break
            with self.growth.watch.part('enhancement'):
                self.roadmap = self.growth.grown(self.roadmap, self._points_where_it_is_difficult(barriers))
            found, barriers = self._search()
        return found

    def _search(self):
        """Return the path, or None, and where the roadmap is difficult."""
        options, growth = self.growth.options, self.growth
        search = RoadmapSearch(growth.space, self.roadmap, self.start, self.goal, growth.flag, growth.watch)
        try:
            found = search.path(options.shortest_path_search, options.a_star_timeout, self._is_over)
        finally:
            self._checks, self._expansions = self._checks + search.checks, self._expansions + search.expansions
        return found, () if found is not None else np.concatenate([search.barriers(), self.roadmap.difficult])

    def _is_over(self):
        criterion = self.growth.options.stop_criterion
        return criterion is not None and bool(criterion())

    def _points_where_it_is_difficult(self, barriers):
        """Return free points about barriers, both ends and evenly drawn points, and others in narrow passages.

        After RobWork's planner, whose queries leave up to 120 nodes of the first and the third kind in the roadmap.
        """
        space, random = self.growth.space, self._random
        chosen = barriers[random.permutation(len(barriers))[:_CENTRES]]
        even = random.uniform(space.low, space.high, (_CENTRES, len(space.low)))
        centres = np.concatenate([chosen, even, np.repeat([self.start, self.goal], _AROUND, axis=0)])
        found = [around(space, random, centres, self.roadmap.radius, _AROUND)]
        wanted = max(_CENTRES * _AROUND, int(_SHARE * len(self.roadmap.points)))
        for _ in range(_BLOCKS):
            self.growth.flag.check()
            found.append(bridges(space, random, _BLOCK)[:wanted])
            wanted -= len(found[-1])
        return np.concatenate(found)

    def _answer(self, status, corners=None, cost=np.inf):
        """Return the result, with the path's points a few centimetres apart."""
        space, elapsed = self.growth.space, self.growth.watch.elapsed
        path = np.empty((0, len(space.low))) if corners is None else dense(space, corners, _SPACING)
        return PlanResult(
            status=status, path=path, cost=float(cost), seed=self.seed,
            history=() if corners is None else (Improvement(elapsed, float(cost)),),
            iterations=self._expansions, nodes=len(self.roadmap.points), collision_checks=self._checks, elapsed=elapsed)


def dense(space, corners: NDArray[np.float64], spacing: float) -> NDArray[np.float64]:
    """Return the points (n, d) of the ways from corner to corner, at most a spacing [m] apart; each corner once.

    Parameters
    ----------
    space : Space
    corners : (k, d) ndarray
    spacing : float [m]
    """
    parts = np.maximum(np.ceil(space.lengths(corners[:-1], corners[1:]) / spacing), 1).astype(np.int64)
    ways = np.repeat(np.arange(len(parts)), parts)
    shares = (np.arange(len(ways)) - np.repeat(np.cumsum(parts) - parts, parts)) / parts[ways]
    points = np.concatenate([space.interpolate(corners[ways], corners[ways + 1], shares), corners[-1:]])
    is_new = np.append(True, (np.diff(points, axis=0) != 0).any(axis=1))
    points[np.concatenate([[0], np.cumsum(parts)])] = corners
    return points[is_new]
