"""The options of the roadmap planner."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import inf, isfinite
from numbers import Integral, Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.sampling.neighbour_search import NeighborSearchStrategy
from mobile_planning.sampling.samplers import SamplingStrategy
from mobile_planning.sampling.steering import Steering

Sampler = Callable[[np.random.Generator, int], ArrayLike]


class CollisionCheckingStrategy(Enum):
    """What is checked when a roadmap is built; a query checks the rest, as far as it comes to it.

    LAZY checks nothing, NODECHECK the nodes, FULL the nodes and the edges.
    """

    LAZY = 0
    NODECHECK = 1
    FULL = 2


class ShortestPathSearchStrategy(Enum):
    """How the shortest path is searched for: both find one of the same length."""

    A_STAR = 0
    DIJKSTRA = 1


@dataclass(frozen=True)
class PRMOptions:
    """What a `PRMPlanner` is told once.

    Attributes
    ----------
    neighbor_count : int
        Neighbours that a node has on average, if the radius follows from them.
    connection_radius : float, optional [m]
        Longest edge of the roadmap; estimated from ``neighbor_count`` and the first nodes if not given.
    neighbor_search : NeighborSearchStrategy
    partial_index_dimensions : int, optional
        Axes of the index table, from 1 to those of the space; 4, or as many as there are, if not given.
    collision_checking : CollisionCheckingStrategy
    shortest_path_search : ShortestPathSearchStrategy
    a_star_timeout : float [s]
        Time that A* has, before Dijkstra's search takes over what is left.
    resolution : float [m]
        How far apart the points of an edge are at which ``constraint`` is asked. Obstacles are checked exactly; the
        resolution of joints is that of their `JointSpace`.
    turning_radius : float, optional [m]
        Plan for a car that turns no tighter: points are poses, edges its shortest paths. Without it the edges are
        straight lines in the plane.
    steering : Steering or str
        Of the car: forwards only, or backwards too.
    sampler : SamplingStrategy or callable
        A callable takes a numpy Generator and how many points are wanted, and returns points (m, d).
    constraint : callable, optional
        Takes points (m, d) and returns which (m,) are allowed, beside what the environment says.
    enhancements : int
        How many times a query that finds no path may add nodes of its own where the roadmap is difficult.
    stop_criterion : callable, optional
        Asked now and then while a query lasts; once it returns True, the query ends as cancelled.

    Raises
    ------
    InvalidInput
        If one is out of its range.
    """

    neighbor_count: int = 20
    connection_radius: float | None = None
    neighbor_search: NeighborSearchStrategy = NeighborSearchStrategy.PARTIAL_INDEX_TABLE
    partial_index_dimensions: int | None = None
    collision_checking: CollisionCheckingStrategy = CollisionCheckingStrategy.LAZY
    shortest_path_search: ShortestPathSearchStrategy = ShortestPathSearchStrategy.A_STAR
    a_star_timeout: float = 1.0
    resolution: float = 0.05
    turning_radius: float | None = None
    steering: Steering = Steering.DUBINS
    sampler: SamplingStrategy | Sampler = SamplingStrategy.UNIFORM
    constraint: Callable[[NDArray[np.float64]], ArrayLike] | None = None
    enhancements: int = 20
    stop_criterion: Callable[[], bool] | None = None

    def __post_init__(self):
        object.__setattr__(self, 'steering', Steering(self.steering))
        for name, least in (('neighbor_count', 1), ('partial_index_dimensions', 1), ('enhancements', 0)):
            value = getattr(self, name)
            if value is not None and (not isinstance(value, Integral) or isinstance(value, bool) or value < least):
                raise InvalidInput(f'{name} {value!r} is not a whole number of at least {least}')
        for name, most in (('connection_radius', None), ('resolution', None), ('turning_radius', None),
                           ('a_star_timeout', inf)):
            value = getattr(self, name)
            if value is not None and not (isinstance(value, Real) and value > 0 and (isfinite(value) or value == most)):
                raise InvalidInput(f'{name} {value!r} is not a finite number above 0')
        for name, kind in (('neighbor_search', NeighborSearchStrategy),
                           ('collision_checking', CollisionCheckingStrategy),
                           ('shortest_path_search', ShortestPathSearchStrategy)):
            if not isinstance(getattr(self, name), kind):
                raise InvalidInput(f'{name} {getattr(self, name)!r} is not a {kind.__name__}')
        for name in ('constraint', 'stop_criterion'):
            if getattr(self, name) is not None and not callable(getattr(self, name)):
                raise InvalidInput(f'{name} {getattr(self, name)!r} cannot be called')
        if not isinstance(self.sampler, SamplingStrategy) and not callable(self.sampler):
            raise InvalidInput(f'sampler {self.sampler!r} is neither a SamplingStrategy nor a function')
