"""Scene: who drives from where to where in which world.

Lengths are in metres, angles in radians, times in seconds.
"""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.robot import Robot
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

# The judge's scipy would cost each robot 45 MB and a quarter of a second: it is imported where it is needed.
if TYPE_CHECKING:
    from mobile_planning.fleet.verification import Body
    from mobile_planning.fleet.world_sim import WorldSim

MAX_ROBOTS = 256


@dataclass(frozen=True, eq=False)
class RobotSpec:
    """One robot of a scene: its id, mission, size and limits."""

    id: int
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    radius: float = 0.2
    u_max: tuple[float, float] = (1.0, 5.0)
    a_max: tuple[float, float] = (2.0, 10.0)

    def __post_init__(self):
        if not isinstance(self.id, int) or isinstance(self.id, bool) or not 0 <= self.id < 2**32:
            raise InvalidInput(f'a robot id is a whole number from 0 to 4294967295, not {self.id!r}')
        if not is_number(self.radius) or not 0 < self.radius <= 100:
            raise InvalidInput(f'radius is {self.radius!r}, not in 0..100 m')
        for key, size in (('start', 3), ('goal', 3), ('u_max', 2), ('a_max', 2)):
            value = getattr(self, key)
            if not isinstance(value, Iterable) or [is_number(entry) for entry in value] != [True] * size:
                raise InvalidInput(f'{key} must be {size} numbers, not {value!r}')
        self.kine_model()

    def kine_model(self) -> UnicycleKineModel:
        """Return the kinematic model with start, goal and limits."""
        return UnicycleKineModel(self.start, self.goal, u_max=self.u_max, a_max=self.a_max)


@dataclass(frozen=True, eq=False)
class Scene:
    """A world and the robots that drive in it.

    Attributes
    ----------
    name : str
    robots : tuple of RobotSpec
    obstacles : tuple of Obstacle
    boundary : Boundary or None
    grid : OccupancyGrid or None
    map_path : Path or None
        Where ``grid`` was read from.
    on_map : bool
        The robots drive on a map, which ``grid`` holds where it has been read.
    timeout : float [s]
        A mission longer than this has failed.
    """

    name: str
    robots: tuple[RobotSpec, ...]
    obstacles: tuple[Obstacle, ...] = ()
    boundary: Boundary | None = None
    grid: OccupancyGrid | None = None
    map_path: Path | None = None
    on_map: bool = False
    timeout: float = 60.0

    def __post_init__(self):
        ids = [robot.id for robot in self.robots]
        if not 1 <= len(ids) <= MAX_ROBOTS or len(set(ids)) != len(ids):
            raise InvalidInput(f'a scene has 1 to {MAX_ROBOTS} robots with ids of their own, not {ids}')
        if self.boundary is None and self.grid is None and not self.on_map:
            raise InvalidInput('a scene needs a map or a boundary')
        if not 0 < self.timeout <= 86400:
            raise InvalidInput(f'timeout is {self.timeout} s, not in 0..86400')

    def robot(self, robot_id: int, grid: OccupancyGrid | None = None, **options) -> Robot:
        """Return the robot with ``robot_id``; ``grid`` replaces the scene's, ``options`` go to ``Robot``.

        Raises
        ------
        InvalidInput
            The scene has no such robot.
        """
        spec = next((spec for spec in self.robots if spec.id == robot_id), None)
        if spec is None:
            raise InvalidInput(f'scene {self.name} has the robots {[s.id for s in self.robots]}, not {robot_id}')
        return Robot(spec.id, spec.kine_model(), self.obstacles, self.boundary, rho=spec.radius,
                     grid=self.grid if grid is None else grid, **options)

    def world_sim(self, **options) -> WorldSim:
        """Return the mission, ready to run in process; ``options`` go to every ``Robot``."""
        from mobile_planning.fleet.world_sim import WorldSim
        return WorldSim(self.name, [self.robot(spec.id, **options) for spec in self.robots],
                        self.obstacles, self.boundary, self.grid)

    def environment(self) -> Environment:
        """Return the static world."""
        return Environment(self.boundary, self.obstacles, self.grid)

    def bodies(self) -> list[Body]:
        """Return what each robot is held to when its solution is judged."""
        from mobile_planning.fleet.verification import Body
        return [Body(spec.id, spec.radius, np.array(spec.start, float), np.array(spec.goal, float),
                     *map(float, spec.u_max), float(spec.a_max[0])) for spec in self.robots]


def is_number(value: object) -> bool:
    """Return whether ``value`` is a real number, which a truth value is not."""
    return isinstance(value, Real) and not isinstance(value, bool)
