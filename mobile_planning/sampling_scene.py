"""What a sampling planner plans among: a map, obstacles beside it, and how they move."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from mobile_planning.errors import NoMap
from mobile_planning.world.environment import Environment
from mobile_planning.world.moving_obstacle import MovingObstacle
from mobile_planning.world.obstacles import Obstacle, PolygonObstacle, RoundObstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid


@dataclass(frozen=True, eq=False)
class SamplingScene:
    """A map and what stands and moves on it.

    Attributes
    ----------
    robot_radius : float [m]
    unknown_is_free : bool
    map : Environment or None
        Without obstacles beside it.
    fixed : tuple of Obstacle
    moving : tuple of MovingObstacle
    since : float [s]
        When the moving ones were where their shapes are.
    """

    robot_radius: float = 0.0
    unknown_is_free: bool = False
    map: Environment | None = None
    fixed: tuple[Obstacle, ...] = ()
    moving: tuple[MovingObstacle, ...] = ()
    since: float = 0.0

    def in_motion(self, now: float) -> Environment:
        """Return the world from a time [s] on, which is its time 0; NoMap if there is none."""
        return self._environment(self.fixed, self._moved(now)) if self.moving else self._fixed

    def standing_still(self, now: float) -> Environment:
        """Return the world as it stands at a time [s]; NoMap if there is none."""
        if not self.moving:
            return self._fixed
        return self._environment((*self.fixed, *(each.shape for each in self._moved(now))))

    def is_as_before(self, now: float, before: SamplingScene, then: float) -> bool:
        """Return whether it stands now as another one stood then."""
        return self is before and (not self.moving or now == then)

    def with_map(self, grid: OccupancyGrid) -> SamplingScene:
        """Return the scene on another map."""
        return replace(self, map=Environment(grid=grid, footprint=self.robot_radius,
                                             unknown_is_free=self.unknown_is_free))

    @cached_property
    def _fixed(self):
        """The world without what moves, with all that queries have found out about it."""
        return self._environment(self.fixed)

    def _environment(self, fixed, moving=()):
        if self.map is None:
            raise NoMap('no map has come yet')
        return self.map.with_obstacles(fixed, moving)

    def _moved(self, now):
        """Return the moving obstacles with their shapes where they are at a time."""
        return [MovingObstacle(_shifted(each.shape, np.multiply(each.velocity, now - self.since)), each.velocity)
                for each in self.moving]


def _shifted(shape, offset):
    """Return an obstacle elsewhere."""
    if isinstance(shape, PolygonObstacle):
        return PolygonObstacle(shape.vertices + offset)
    return RoundObstacle(shape.centroid + offset, shape.radius)
