"""Probabilistic roadmaps: one roadmap for many queries.

Kavraki, L. E., Svestka, P., Latombe, J.-C., Overmars, M. H. (1996). Probabilistic roadmaps for path planning in
high-dimensional configuration spaces. IEEE Transactions on Robotics and Automation 12(4).
Bohlin, R., Kavraki, L. E. (2000). Path planning using lazy PRM. ICRA.
Sanchez, G., Latombe, J.-C. (2002). On delaying collision checking in PRM planning. IJRR 21(1).
"""
from __future__ import annotations

import sys
from dataclasses import fields, replace
from pathlib import Path
from typing import TextIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import (
    GoalOccupied, GoalOutside, InvalidInput, NotBuilt, StartOccupied, StartOutside, StrategyLocked)
from mobile_planning.sampling.neighbour_search import NeighborSearchStrategy
from mobile_planning.sampling.plan_result import PlanResult
from mobile_planning.sampling.prm_options import CollisionCheckingStrategy, PRMOptions, ShortestPathSearchStrategy
from mobile_planning.sampling.prm_query import RoadmapQuery
from mobile_planning.sampling.prm_request import check_count, continued_seed, free_end, seed_of
from mobile_planning.sampling.prm_space import check_dimensions, space_of
from mobile_planning.sampling.prm_statistics import RoadmapStatistics, TimeStatistics
from mobile_planning.sampling.roadmap import Roadmap
from mobile_planning.sampling.roadmap_file import load_roadmap, save_roadmap
from mobile_planning.sampling.roadmap_growth import RoadmapGrowth
from mobile_planning.sampling.samplers import SampleStream
from mobile_planning.sampling.spaces import Space
from mobile_planning.stop_flag import StopFlag
from mobile_planning.world.environment import Environment


class PRMPlanner:
    """Builds a roadmap of a space once, and answers many queries on it.

    Parameters
    ----------
    environment : Environment or Space
        Obstacles in the plane, for points and with ``turning_radius`` for a car; or any space, such as a `JointSpace`.
    **options
        The fields of `PRMOptions`.

    Attributes
    ----------
    options : PRMOptions
    roadmap : Roadmap or None
    seed : int or None
        Of the newest build.
    time_statistics : TimeStatistics
        Of the last build, extension or query.

    Raises
    ------
    InvalidInput
        If an option is unknown or out of its range, or the environment has no bounds.

    Examples
    --------
    >>> from mobile_planning import Boundary, Environment, RoundObstacle
    >>> planner = PRMPlanner(Environment(Boundary((0, 10), (0, 10)), [RoundObstacle((5, 5), 2)]))
    >>> planner.build_roadmap(1000, seed=1)
    >>> result = planner.query((1, 5), (9, 5), deadline=1.0)
    >>> result.status.name, 9.0 < result.cost < 9.5
    ('SOLVED', True)
    """

    BRUTE_FORCE, PARTIAL_INDEX_TABLE, KDTREE = NeighborSearchStrategy
    LAZY, NODECHECK, FULL = CollisionCheckingStrategy
    A_STAR, DIJKSTRA = ShortestPathSearchStrategy

    def __init__(self, environment: Environment | Space, **options):
        unknown = set(options) - {field.name for field in fields(PRMOptions)}
        if unknown:
            raise InvalidInput(f'{", ".join(sorted(unknown))}: no option of PRMPlanner')
        self.roadmap: Roadmap | None = None
        self.seed: int | None = None
        self.time_statistics = TimeStatistics()
        self._stream = None
        self.options = PRMOptions(**options)
        self._space = space_of(environment, self.options)

    def build_roadmap(self, n: int = 1000, *, seed: int | None = None, deadline: float | None = None,
                      stop: NDArray[np.uint8] | None = None) -> None:
        """Build a roadmap of n nodes, in place of the one that is there.

        Parameters
        ----------
        n : int
            Nodes; with NODECHECK and FULL all of them are free.
        seed : int, optional
            One seed, one roadmap. Drawn if not given, and told in `seed`.
        deadline : float, optional [s]
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread to give up.

        Raises
        ------
        NoPath
            If next to nothing is free.
        PlanningTimeout, Cancelled
            If it takes too long or is stopped. The roadmap stays as it was, whatever is raised.
        """
        check_count(n)
        seed = seed_of(seed)
        stream = SampleStream(self._space, self.options.sampler, seed, self._only_free)
        self._grow(n, stream, None, deadline, stop)
        self.seed = seed

    def extend(self, n: int, *, deadline: float | None = None, stop: NDArray[np.uint8] | None = None) -> None:
        """Add n nodes to the roadmap; the radius stays. Parameters and errors as in `build_roadmap`.

        The paths that the roadmap had it keeps, so that the cost of none of them rises.
        """
        check_count(n)
        self._grow(n, self._stream, self._require_roadmap(), deadline, stop)

    def query(self, start: ArrayLike, goal: ArrayLike, deadline: float | None = None, *, seed: int | None = None,
              stop: NDArray[np.uint8] | None = None) -> PlanResult:
        """Return the shortest path from start to goal over the roadmap.

        Where it has none, nodes are added for this query alone. The roadmap stays as it was, but for what becomes known
        of its nodes and edges.

        Parameters
        ----------
        start, goal : (d,) array_like
        deadline : float, optional [s]
            From now on; then the status is TIMEOUT.
        seed : int, optional
            Of the nodes that a query adds; the roadmap's if not given.
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread to end the query; the status is CANCELLED.

        Raises
        ------
        NotBuilt
            If there is no roadmap yet.
        InvalidInput
            If a number is not finite or there are not as many as the space has dimensions.
        StartOutside, GoalOutside, StartOccupied, GoalOccupied
            If an end is outside the bounds or not free.
        """
        roadmap = self._require_roadmap()
        if deadline is not None and not deadline > 0:
            raise InvalidInput(f'deadline {deadline} s is not above 0')
        start = free_end(self._space, start, 'start', StartOutside, StartOccupied)
        goal = free_end(self._space, goal, 'goal', GoalOutside, GoalOccupied)
        flag = StopFlag(deadline, stop)
        growth = RoadmapGrowth(self._space, self.options, flag)
        query = RoadmapQuery(growth, roadmap, start, goal, self.seed if seed is None else seed_of(seed))
        result = query.result()
        self.time_statistics = growth.watch.statistics()
        return result

    def save(self, path: str | Path) -> None:
        """Write the roadmap to a file, see `save_roadmap`."""
        save_roadmap(path, self._require_roadmap(), self._space, self.seed)

    def load(self, path: str | Path) -> None:
        """Take the roadmap of a file; nodes and edges are checked anew, as the strategy asks for.

        Raises
        ------
        OSError, InvalidInput
            See `load_roadmap`; the roadmap stays as it was.
        """
        roadmap, seed = load_roadmap(path, self._space)
        self.roadmap = RoadmapGrowth(self._space, self.options, StopFlag()).validated(roadmap)
        self.seed = seed
        self._stream = SampleStream(self._space, self.options.sampler, continued_seed(seed, roadmap), self._only_free)

    def change_environment(self, environment: Environment | Space) -> None:
        """Plan on among other obstacles: nodes and edges stay, and are checked anew as the strategy asks for.

        Raises
        ------
        InvalidInput
            If it is a space of another kind or with other bounds.
        """
        space = space_of(environment, self.options)
        if space.kind != self._space.kind or not np.array_equal([space.low, space.high],
                                                                [self._space.low, self._space.high]):
            raise InvalidInput(f'the roadmap is for {self._space.kind!r} within {self._space.low.tolist()} to '
                               f'{self._space.high.tolist()}, not for {space.kind!r} within {space.low.tolist()} to '
                               f'{space.high.tolist()}')
        self._space = space
        if self.roadmap is not None:
            self.roadmap = RoadmapGrowth(space, self.options, StopFlag()).validated(self.roadmap)
            self._stream = SampleStream(space, self.options.sampler, continued_seed(self.seed, self.roadmap),
                                        self._only_free)

    def clear(self) -> None:
        """Forget the roadmap."""
        self.roadmap = self.seed = self._stream = None

    def statistics(self) -> RoadmapStatistics:
        """Return what is in the roadmap."""
        from mobile_planning.sampling.roadmap_kernels import BLOCKED, UNKNOWN

        roadmap = self._require_roadmap()
        nodes, edges = len(roadmap.points), len(roadmap.edges)
        return RoadmapStatistics(
            nodes, edges, int((roadmap.node_states != UNKNOWN).sum()), int((roadmap.edge_states != UNKNOWN).sum()),
            int((roadmap.node_states == BLOCKED).sum()), int((roadmap.edge_states == BLOCKED).sum()),
            roadmap.radius, (1 if roadmap.is_directed else 2) * edges / nodes)

    def print_time_stats(self, file: TextIO | None = None) -> None:
        """Write where the time of the last run went, to stdout if not told otherwise."""
        (file or sys.stdout).write(f'{self.time_statistics}\n')

    def set_neighbor_count(self, n: int) -> None:
        """Have n neighbours of a node on average; locked once the roadmap is built, as the next four are not."""
        self._change(neighbor_count=n)

    def set_neigh_search_strategy(self, strategy: NeighborSearchStrategy) -> None:
        """Find neighbours in another way from now on; all find the same ones."""
        self._change(neighbor_search=strategy)

    def set_partial_index_table_dimensions(self, dimensions: int) -> None:
        """Have another number of axes in the index table from now on."""
        self._change(partial_index_dimensions=dimensions)

    def set_collision_checking_strategy(self, strategy: CollisionCheckingStrategy) -> None:
        """Check more or less when the roadmap is built; locked once it is."""
        self._change(collision_checking=strategy)

    def set_shortest_path_search_strategy(self, strategy: ShortestPathSearchStrategy) -> None:
        """Search in another way from now on; both find paths of the same length."""
        self._change(shortest_path_search=strategy)

    def set_a_star_time_out_time(self, timeout: float) -> None:
        """Give A* another time [s], after which Dijkstra's search takes over."""
        self._change(a_star_timeout=timeout)

    def _change(self, **changes):
        """Replace an option, unless the roadmap that stands was built with it."""
        locked = {'neighbor_count', 'collision_checking'} & set(changes)
        if self.roadmap is not None and locked:
            raise StrategyLocked(f'{locked.pop()} cannot change while a roadmap stands that was built with it: '
                                 'clear it first')
        options = replace(self.options, **changes)
        check_dimensions(options, self._space)
        self.options = options

    @property
    def _only_free(self):
        return self.options.collision_checking is not CollisionCheckingStrategy.LAZY

    def _require_roadmap(self):
        if self.roadmap is None:
            raise NotBuilt('there is no roadmap yet: build or load one first')
        return self.roadmap

    def _grow(self, count, stream, roadmap, deadline, stop):
        """Take so many samples into a roadmap, a new one if None."""
        flag = StopFlag(deadline, stop)
        growth = RoadmapGrowth(self._space, self.options, flag)
        with flag:
            with growth.watch.part('sampling'):
                points = stream.take(count, flag)
            roadmap = growth.grown(growth.empty(points) if roadmap is None else roadmap, points)
        self.roadmap, self._stream = roadmap, stream
        self.time_statistics = growth.watch.statistics()
