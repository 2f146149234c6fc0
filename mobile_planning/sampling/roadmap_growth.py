"""How a roadmap grows: new nodes, the edges to their neighbours, and the checks that its strategy asks for."""
from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import LimitExceeded
from mobile_planning.sampling.neighbour_search import neighbour_pairs
from mobile_planning.sampling.prm_options import CollisionCheckingStrategy, PRMOptions
from mobile_planning.sampling.prm_statistics import Stopwatch
from mobile_planning.sampling.roadmap import Roadmap
from mobile_planning.sampling.spaces import Space
from mobile_planning.stop_flag import StopFlag

MOST_EDGES = 50_000_000
# Nodes from which the radius is estimated.
_PROBES = 32
# Edges checked between two looks at the clock, for each edge of the space's lookahead.
_CHUNK = 32


@dataclass(frozen=True, eq=False)
class RoadmapGrowth:
    """Adds nodes to roadmaps of one space.

    Attributes
    ----------
    space : Space
    options : PRMOptions
    flag : StopFlag
        Asked between the steps.
    watch : Stopwatch
    """

    space: Space
    options: PRMOptions
    flag: StopFlag
    watch: Stopwatch = field(default_factory=Stopwatch)

    def empty(self, points: NDArray[np.float64]) -> Roadmap:
        """Return a roadmap without nodes whose radius suits these points, or is the one that was asked for."""
        with self.watch.part('neighbours'):
            radius = self.options.connection_radius or typical_radius(self.space, points, self.options.neighbor_count)
        return Roadmap.empty(points.shape[1], radius, self.space.is_directed)

    def grown(self, roadmap: Roadmap, points: NDArray[np.float64]) -> Roadmap:
        """Return a roadmap with these nodes too, joined to each other and to the old ones within the radius.

        With FULL, edges that are not free are left out.

        Parameters
        ----------
        roadmap : Roadmap
        points : (n, d) ndarray
            Free, unless the strategy is LAZY.

        Raises
        ------
        LimitExceeded
            If there would be more than `MOST_EDGES` edges.
        PlanningTimeout, Cancelled
            If the flag says so; the roadmap stays as it was.
        """
        from mobile_planning.sampling.roadmap_kernels import FREE, UNKNOWN

        strategy = self.options.collision_checking
        everyone = np.concatenate([roadmap.points, points])
        with self.watch.part('neighbours'):
            edges, lengths = self._candidates(everyone, len(roadmap.points), roadmap.radius)
        difficult, edge_state = np.empty((0, points.shape[1])), UNKNOWN
        if strategy is CollisionCheckingStrategy.FULL:
            with self.watch.part('collision'):
                is_free = self._free(everyone, edges)
            blocked, edge_state = edges[~is_free][:1000], FREE
            difficult = self.space.interpolate(*everyone[blocked.T], np.full(len(blocked), 0.5))
            edges, lengths = edges[is_free], lengths[is_free]
        node_state = UNKNOWN if strategy is CollisionCheckingStrategy.LAZY else FREE
        return roadmap.extended(points, edges, lengths, node_state, edge_state, difficult)

    def validated(self, roadmap: Roadmap) -> Roadmap:
        """Return the same nodes and edges, of which is known what a roadmap of the strategy knows when it is built."""
        from mobile_planning.sampling.roadmap_kernels import BLOCKED, FREE, UNKNOWN

        strategy, points = self.options.collision_checking, roadmap.points
        nodes, edges = (np.full(len(items), UNKNOWN, np.uint8) for items in (points, roadmap.edges))
        if strategy is not CollisionCheckingStrategy.LAZY:
            nodes[:] = np.where(self.space.free(points), FREE, BLOCKED)
        if strategy is CollisionCheckingStrategy.FULL:
            ends_free = (nodes[roadmap.edges] == FREE).all(axis=1)
            edges[:] = BLOCKED
            edges[ends_free] = np.where(self._free(points, roadmap.edges[ends_free]), FREE, BLOCKED)
        return replace(roadmap, node_states=nodes, edge_states=edges)

    def _candidates(self, points, first, radius):
        """Return edges (m, 2) at most a radius long that end at a node from ``first`` on, and their lengths."""
        self.flag.check()
        # A radius that was estimated from these nodes gives them as many neighbours as were asked for.
        neighbours = (self.options.neighbor_count if first == 0 and self.options.connection_radius is None
                      else _mean_neighbours(self.space, points, radius))
        if neighbours * len(points) > 2 * MOST_EDGES:
            raise LimitExceeded(f'{len(points)} nodes would have about {neighbours:.0f} neighbours each within '
                                f'{radius:g} m: {MOST_EDGES} edges are allowed')
        # A little more than the radius, so that rounding in the search leaves no edge out: the length decides.
        pairs = neighbour_pairs(
            self.space.coordinates(points), radius * (1 + 1e-9), self.options.neighbor_search,
            self.options.partial_index_dimensions or 4, first)
        self.flag.check()
        if self.space.is_directed:
            pairs = np.stack([pairs, pairs[:, ::-1]], axis=1).reshape(-1, 2)
        lengths = self.space.lengths(*points[pairs.T])
        short = lengths <= radius
        return pairs[short], lengths[short]

    def _free(self, points, edges):
        """Return which edges are free."""
        chunk, is_free = _CHUNK * self.space.lookahead, np.empty(len(edges), bool)
        for first in range(0, len(edges), chunk):
            self.flag.check()
            part = slice(first, first + chunk)
            is_free[part] = self.space.edges_free(*points[edges[part].T])
        return is_free


def typical_radius(space: Space, points: NDArray[np.float64], neighbours: int) -> float:
    """Return the radius [m] within which nodes have so many neighbours on average, those at the border counted too.

    All there are, if there are no more. The nodes must be in random order.
    """
    distances = _probe_lengths(space, points)
    if distances.size == 0:
        return float(space.lengths(space.low[None], space.high[None])[0])
    rank = neighbours * len(distances) - 1
    return float(np.partition(distances, rank, axis=None)[rank] if rank < distances.size else distances.max())


def _mean_neighbours(space, points, radius):
    """Return about how many neighbours a node has within the radius."""
    distances = _probe_lengths(space, points)
    return (distances <= radius).sum() / max(1, len(distances))


def _probe_lengths(space, points):
    """Return the lengths (k, n - 1) from some nodes to all others."""
    probes = min(_PROBES, len(points)) if len(points) > 1 else 0
    return np.array([np.delete(space.lengths(points[probe][None], points), probe) for probe in range(probes)])
