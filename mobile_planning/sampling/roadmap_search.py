"""The shortest path between two points over a roadmap that is checked as far as the search comes."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import Cancelled
from mobile_planning.sampling.prm_options import ShortestPathSearchStrategy
from mobile_planning.sampling.prm_statistics import Stopwatch
from mobile_planning.sampling.roadmap import Roadmap
from mobile_planning.sampling.spaces import Space
from mobile_planning.stop_flag import StopFlag

# Expansions between two looks at the clock.
_TURN = 20_000


class RoadmapSearch:
    """One start and one goal beside a roadmap, joined to it by edges of their own.

    Both are joined to every node within the roadmap's radius, and to each other however far that is.

    Parameters
    ----------
    space : Space
    roadmap : Roadmap
        Only what is known of its nodes and edges changes.
    start, goal : (d,) ndarray
        Free points.
    flag : StopFlag
    watch : Stopwatch

    Attributes
    ----------
    checks : int
        Edges checked so far.
    expansions : int
    """

    def __init__(self, space: Space, roadmap: Roadmap, start: NDArray[np.float64], goal: NDArray[np.float64],
                 flag: StopFlag, watch: Stopwatch):
        from mobile_planning.sampling.roadmap_kernels import UNKNOWN

        self._space, self._roadmap, self._flag, self._watch = space, roadmap, flag, watch
        self._ends_at, self.checks, self.expansions = np.stack([start, goal]), 0, 0
        count = len(roadmap.points)
        there = space.lengths(start[None], roadmap.points)
        # What is still to go is the estimate of every node too.
        self._to_goal = space.lengths(roadmap.points, goal[None])
        first, last = (np.flatnonzero(lengths <= roadmap.radius) for lengths in (there, self._to_goal))
        direct = space.lengths(start[None], goal[None])
        self._tails = np.concatenate([np.full(len(first), count), last, [count]]).astype(np.int32)
        self._heads = np.concatenate([first, np.full(len(last), count + 1), [count + 1]]).astype(np.int32)
        self._lengths = np.concatenate([there[first], self._to_goal[last], direct])
        self._states = np.full(len(self._tails), UNKNOWN, np.uint8)
        self._goal_arcs = np.full(count + 2, -1, np.int32)
        self._goal_arcs[last] = len(first) + np.arange(len(last))
        self._goal_arcs[count] = len(self._tails) - 1
        self._estimate_at_start, self._closed = direct[0], np.zeros(count + 2, bool)

    def path(self, strategy: ShortestPathSearchStrategy, a_star_timeout: float, is_over: Callable[[], bool]
             ) -> tuple[NDArray[np.float64], float] | None:
        """Return the points (k, d) of the shortest path and its length [m], or None if there is none.

        Parameters
        ----------
        strategy : ShortestPathSearchStrategy
        a_star_timeout : float [s]
            After it Dijkstra's search begins; what has been checked is known to it.
        is_over : callable
            Whether to give up.

        Raises
        ------
        PlanningTimeout, Cancelled
            If the flag says so, or `is_over`.
        """
        from mobile_planning.sampling.roadmap_kernels import FOUND

        limit = self._watch.elapsed + a_star_timeout
        estimates = np.zeros(len(self._goal_arcs))
        if strategy is ShortestPathSearchStrategy.A_STAR:
            estimates[:-2], estimates[-2] = self._to_goal, self._estimate_at_start
        search, outcome = self._turns(estimates, lambda: is_over() or self._watch.elapsed > limit)
        if outcome is None and not is_over():
            search, outcome = self._turns(np.zeros(len(estimates)), is_over)
        if outcome is None:
            raise Cancelled('the stop criterion ended the query')
        return self._traced(search) if outcome == FOUND else None

    def barriers(self) -> NDArray[np.float64]:
        """Return the middles (k, d) of the edges that are not free and lead out of what the last search has reached.

        Once no path was found, all edges that lead out of it are of this kind, whatever was known before.
        """
        roadmap = self._roadmap
        tails, heads = self._closed[roadmap.edges.T]
        edges = roadmap.edges[tails > heads if roadmap.is_directed else tails != heads]
        return self._space.interpolate(*roadmap.points[edges.T], np.full(len(edges), 0.5))

    def _turns(self, estimates, is_over):
        """Search until a path is found or none is left; return the search and how it ended, None if it is over."""
        from mobile_planning.sampling.roadmap_kernels import PAUSED, STOPPED, advance

        roadmap, count = self._roadmap, len(self._roadmap.points)
        graph = (*roadmap.arcs, roadmap.lengths, roadmap.edge_states, roadmap.node_states, roadmap.points,
                 self._space.plane)
        ends = (self._tails, self._heads, self._lengths, self._states, self._goal_arcs, estimates, self._ends_at)
        room = len(roadmap.arcs[1]) + len(self._tails)
        search = (np.full(count + 2, np.inf), np.full(count + 2, -1, np.int32), np.zeros(count + 2, bool),
                  np.zeros(count + 2, np.int32), np.empty(room), np.empty(room, np.int32), np.zeros(4, np.int64))
        self._begin(search, estimates)
        self._closed = search[2]
        wanted = np.empty(self._space.lookahead, np.int32)
        while not is_over():
            with self._watch.part('search'):
                outcome = advance(graph, ends, search, wanted, _TURN, self._flag.array)
            if outcome == STOPPED:
                self._flag.check()
                raise Cancelled('the query was stopped')
            if outcome > 0:
                with self._watch.part('collision'):
                    self._check(wanted[:outcome])
            elif outcome != PAUSED:
                break
        else:
            outcome = None
        _, expansions, _, seen = search[-1].tolist()
        self.expansions, self.checks = self.expansions + expansions, self.checks + seen
        return search, outcome

    def _begin(self, search, estimates):
        """Put the arcs out of the start into the heap; a sorted list is one."""
        costs, _, closed, _, keys, arcs, counts = search
        count = len(self._roadmap.points)
        costs[count], closed[count] = 0.0, True
        first = np.flatnonzero(self._tails == count)
        estimated = self._lengths[first] + estimates[self._heads[first]]
        order = np.argsort(estimated, kind='stable')
        keys[:len(first)], arcs[:len(first)] = estimated[order], len(self._roadmap.arcs[1]) + first[order]
        counts[0] = len(first)

    def _check(self, arcs):
        """Find out which arcs are free."""
        self._flag.check()
        self.checks += len(arcs)
        count = len(self._roadmap.arcs[1])
        self._check_edges(arcs[arcs < count])
        self._check_ends(arcs[arcs >= count] - count)

    def _check_edges(self, arcs):
        """Find out which arcs of the roadmap are free."""
        if not len(arcs):
            return
        roadmap = self._roadmap
        _, _, heads, numbers = roadmap.arcs
        edges = numbers[arcs]
        roadmap.edge_states[edges] = self._states_of(
            heads[arcs], lambda open_: roadmap.points[roadmap.edges[edges[open_]].T])

    def _check_ends(self, arcs):
        """Find out which arcs of the query's own are free."""
        if not len(arcs):
            return
        count = len(self._roadmap.points)
        self._states[arcs] = self._states_of(
            np.where(self._heads[arcs] < count, self._heads[arcs], -1),
            lambda open_: (self._places(self._tails[arcs[open_]]), self._places(self._heads[arcs[open_]])))

    def _places(self, nodes):
        """Return the points (m, d) of nodes of the roadmap and of the two ends behind them."""
        count = len(self._roadmap.points)
        places, is_end = np.empty((len(nodes), self._ends_at.shape[1])), nodes >= count
        places[is_end], places[~is_end] = self._ends_at[nodes[is_end] - count], self._roadmap.points[nodes[~is_end]]
        return places

    def _states_of(self, heads, ends_of):
        """Return what is found of ways that lead to these nodes, -1 for a point of the query's own.

        A node of which nothing is known is checked first, and if it is not free no way to it is.
        """
        from mobile_planning.sampling.roadmap_kernels import BLOCKED, FREE, UNKNOWN

        known, space = self._roadmap.node_states, self._space
        unknown = np.unique(heads[heads >= 0])
        unknown = unknown[known[unknown] == UNKNOWN]
        if len(unknown):
            known[unknown] = np.where(space.free(self._roadmap.points[unknown]), FREE, BLOCKED)
        open_ = heads < 0
        open_[~open_] = known[heads[~open_]] == FREE
        states = np.full(len(heads), BLOCKED, np.uint8)
        starts, ends = ends_of(open_)
        states[open_] = np.where(space.edges_free(starts, ends), FREE, BLOCKED)
        return states

    def _traced(self, search):
        """Return the points of the path that was found, and its length."""
        costs, parents, *_ = search
        places, (_, tails, _, _) = self._roadmap.points, self._roadmap.arcs
        node, nodes = len(places) + 1, []
        while node != len(places):
            nodes.append(node)
            arc = parents[node]
            node = int(tails[arc] if arc < len(tails) else self._tails[arc - len(tails)])
        between = np.array(nodes[:0:-1], np.int64)
        return np.concatenate([self._ends_at[:1], places[between], self._ends_at[1:]]), float(costs[-1])
