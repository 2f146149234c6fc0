"""Samples for a roadmap: evenly drawn, near obstacles, in narrow passages, and around given points."""
from __future__ import annotations

from collections.abc import Callable
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput, NoPath
from mobile_planning.sampling.spaces import Space
from mobile_planning.stop_flag import StopFlag

# Points drawn at once; always as many, so that a stream does not depend on how it is taken.
_BLOCK = 1024
# Blocks that may be drawn for each block of points that are free.
_MOST_BLOCKS = 10_000
# How far apart the ends of a bridge are, as a share of the bounds: between these, every scale as often.
_NARROWEST, _WIDEST = 0.002, 0.2


class SamplingStrategy(Enum):
    """Where the nodes of a roadmap are drawn.

    UNIFORM draws evenly. BRIDGE_TEST draws every other block of points in narrow passages (Hsu, Jiang, Reif and Sun
    2003), OBSTACLE_BASED draws it beside obstacles (Boor, Overmars and van der Stappen 1999).
    """

    UNIFORM = 0
    BRIDGE_TEST = 1
    OBSTACLE_BASED = 2


class SampleStream:
    """Points of a space one after the other: the first n do not depend on how many are taken, or when.

    Parameters
    ----------
    space : Space
    sampler : SamplingStrategy or callable
        See `PRMOptions`.
    seed : int
    only_free : bool
        Leave out what is not free.
    """

    def __init__(self, space: Space, sampler: SamplingStrategy | Callable[[np.random.Generator, int], ArrayLike],
                 seed: int, only_free: bool):
        self._space, self._only_free = space, only_free
        self._random = np.random.default_rng(seed)
        self._drawn, self._blocks = np.empty((0, len(space.low))), 0
        self._draw = {
            SamplingStrategy.UNIFORM: (self._uniform,), SamplingStrategy.BRIDGE_TEST: (self._uniform, self._bridges),
            SamplingStrategy.OBSTACLE_BASED: (self._uniform, self._beside_obstacles),
        }.get(sampler, (lambda: self._users(sampler),))

    def take(self, count: int, flag: StopFlag) -> NDArray[np.float64]:
        """Return the next points (count, d).

        Raises
        ------
        NoPath
            If next to nothing is free.
        InvalidInput
            If the user's sampler answers with something else than points within the bounds.
        PlanningTimeout, Cancelled
            If the flag says so.
        """
        ready, number = [self._drawn], len(self._drawn)
        most = _MOST_BLOCKS * (1 + count // _BLOCK)
        for _ in range(most):
            if number >= count:
                break
            flag.check()
            points = self._draw[self._blocks % len(self._draw)]()
            self._blocks += 1
            if self._only_free:
                points = points[self._space.free(points)]
            ready.append(points)
            number += len(points)
        points = np.concatenate(ready)
        self._drawn = points[count:]
        if number < count:
            raise NoPath(f'only {number} of {most * _BLOCK} samples are free: {count} nodes are wanted')
        return points[:count]

    def _uniform(self):
        return self._random.uniform(self._space.low, self._space.high, (_BLOCK, len(self._space.low)))

    def _bridges(self):
        return bridges(self._space, self._random, _BLOCK)

    def _beside_obstacles(self):
        return beside_obstacles(self._space, self._random, _BLOCK)

    def _users(self, sampler):
        points = np.array(sampler(self._random, _BLOCK), dtype=float)
        if points.ndim != 2 or points.shape[1] != len(self._space.low):
            raise InvalidInput(f'the sampler answers with shape {points.shape}, not (n, {len(self._space.low)})')
        if not ((points >= self._space.low) & (points <= self._space.high)).all():
            raise InvalidInput('the sampler answers with a point outside the bounds')
        return points


def bridges(space: Space, random: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Return the free middles of those of ``count`` short lines, at places drawn evenly, whose ends are not free."""
    starts, ends = _pairs(space, random, count)
    starts, ends = (part[~(_free(space, starts) | _free(space, ends))] for part in (starts, ends))
    middles = (starts + ends) / 2
    return middles[_free(space, middles)]


def beside_obstacles(space: Space, random: np.random.Generator, count: int) -> NDArray[np.float64]:
    """Return the free ends of those of ``count`` short lines, at places drawn evenly, that have one such end."""
    starts, ends = _pairs(space, random, count)
    start_free, end_free = _free(space, starts), _free(space, ends)
    return np.where(start_free[:, None], starts, ends)[start_free != end_free]


def around(space: Space, random: np.random.Generator, centres: NDArray[np.float64], radius: float, each: int
           ) -> NDArray[np.float64]:
    """Return free points that lie about centres (n, d), as a normal distribution as wide as the radius [m] has them.

    Parameters
    ----------
    each : int
        Points drawn for each centre; those outside the bounds are left out. (Moved onto the bounds, as RobWork has it,
        they would touch there whatever stands against them, and slip by.)
    """
    extent = space.high - space.low
    share = radius / float(space.lengths(space.low[None], space.high[None])[0])
    points = np.repeat(centres, each, axis=0)
    points = points + random.normal(size=points.shape) * share * extent
    return points[_free(space, points)]


def _pairs(space, random, count):
    """Return ends of short lines (count, d) whose first ends are drawn evenly."""
    extent = space.high - space.low
    starts = random.uniform(space.low, space.high, (count, len(extent)))
    scale = _NARROWEST * (_WIDEST / _NARROWEST) ** random.uniform(size=(count, 1))
    return starts, starts + random.normal(size=starts.shape) * scale * extent


def _free(space, points):
    """Return which points are free, none outside the bounds."""
    inside = ((points >= space.low) & (points <= space.high)).all(axis=1)
    inside[inside] = space.free(points[inside])
    return inside
