"""What an RRT plans in: the world for a robot, with its options, and the goal zone."""
from __future__ import annotations

from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import GoalOccupied, GoalOutside, InvalidInput, StartOccupied, StartOutside
from mobile_planning.geometry import wrap_angle
from mobile_planning.sampling.request import as_pose
from mobile_planning.sampling.rrt_options import RRTOptions
from mobile_planning.sampling.steering import Car, car_of
from mobile_planning.world.collision_space import TOUCH
from mobile_planning.world.environment import Environment
from mobile_planning.world.surroundings import Surroundings

if TYPE_CHECKING:
    from mobile_planning.sampling.rrt_kernels import Task

# How deep a path may lie in what it touches [m]: rounding.
_ALLOWED = 1e-9
# Poses of the goal zone that are looked at before the goal is called occupied.
_GOAL_POSES = 200


class Setting:
    """An environment with the options and the precision of a tree.

    Parameters
    ----------
    environment : Environment
        With a boundary or a grid. What has an outline and turns on the spot is planned for as the disc that it covers.
    options : RRTOptions
    precision : tuple of three float [m, m, rad]
    """

    def __init__(self, environment: Environment, options: RRTOptions, precision: tuple[float, float, float]):
        self.bounds = environment.bounds
        turns_on_the_spot = options.radius == 0 and environment.footprint.outline is not None
        self.environment = environment.for_footprint(environment.footprint.reach) if turns_on_the_spot else environment
        self.options, self.precision = options, precision

    @cached_property
    def car(self) -> Car:
        """How the robot gets from pose to pose."""
        return car_of(self.options.radius, self.options.steering)

    def position(self, pose: NDArray[np.float64]) -> tuple[float, ...]:
        """Return a pose as the caller names it: without heading where it means nothing."""
        return tuple(pose[:3 if self.options.radius > 0 else 2].tolist())

    def pose(self, position: ArrayLike, name: str) -> NDArray[np.float64]:
        """Return a position as a pose, the heading in (-pi, pi]; 0 where it means nothing."""
        return as_pose(position, name, self.options.radius > 0)

    def is_in_zone(self, pose: NDArray[np.float64], goal: NDArray[np.float64]) -> bool:
        """Return whether a pose lies in the zone about a goal."""
        offset = np.abs(pose - goal)
        offset[2] = abs(wrap_angle(offset[2])) if self.options.radius > 0 else 0.0
        return bool((offset <= self.precision).all())

    def check_start(self, pose: NDArray[np.float64], time: float) -> None:
        """Refuse a start where the robot cannot be at that time [s]."""
        if not (np.isreal(time) and isfinite(time)):
            raise InvalidInput(f'time {time} s is not a finite number')
        self._check_inside(pose, StartOutside, 'start')
        if not (self._is_free(pose, time, _ALLOWED) or self._is_free(pose, time, TOUCH)):
            raise StartOccupied(f'start {self.position(pose)} is occupied')

    def world(self, root: NDArray[np.float64], begin: float, goal: NDArray[np.float64]) -> tuple[Surroundings, bool]:
        """Return the world for the kernels, and whether the goal itself is free; paths may touch what the ends touch.

        Raises
        ------
        GoalOutside, GoalOccupied
            If no pose of the goal zone is free of what stands still.
        """
        self._check_inside(goal, GoalOutside, 'goal')
        still = self._at_rest
        is_free = still._is_free(goal, 0.0, _ALLOWED)
        touches = not is_free and still._is_free(goal, 0.0, TOUCH)
        if not (is_free or touches or still._has_free_pose(goal)):
            raise GoalOccupied(f'goal {self.position(goal)} is occupied')
        world = self.environment.surroundings(TOUCH) if touches and still is self else self.world_about(root, begin)
        return world, is_free or touches

    def world_about(self, root: NDArray[np.float64], begin: float) -> Surroundings:
        """Return the world for the kernels; paths may touch things as deep as the root does."""
        return self.environment.surroundings(_ALLOWED if self._is_free(root, begin, _ALLOWED) else TOUCH)

    def task(self, goal: NDArray[np.float64], begin: float, goal_rate: float, metric: str) -> Task:
        """Return what a tree that begins at a time [s] grows for."""
        from mobile_planning.sampling.rrt_kernels import Task

        options = self.options
        extension = options.max_extension
        if extension is None:
            extension = 4 * options.radius if options.radius > 0 else 0.3 * max(
                self.bounds[2] - self.bounds[0], self.bounds[3] - self.bounds[1])
        return Task(goal, np.array(self.precision), self.car, float(extension), float(options.speed), float(begin),
                    float(goal_rate), options.nb_options, metric != 'local')

    @cached_property
    def _at_rest(self) -> Setting:
        """The setting without what moves."""
        if not self.environment.moving:
            return self
        return Setting(self.environment.at_rest(), self.options, self.precision)

    def _is_free(self, pose: NDArray[np.float64], time: float, allowed: float) -> bool:
        from mobile_planning.world.collision_kernels import is_free

        return is_free(self.environment.space(allowed), pose[0], pose[1], pose[2], float(time))

    def _has_free_pose(self, goal: NDArray[np.float64]) -> bool:
        shifts = np.random.default_rng(0).uniform(-1, 1, (_GOAL_POSES, 3)) * self.precision
        return bool(self.environment.free_poses(goal + shifts).any())

    def _check_inside(self, pose, kind, name) -> None:
        x_min, y_min, x_max, y_max = self.bounds
        if not (x_min <= pose[0] <= x_max and y_min <= pose[1] <= y_max):
            raise kind(f'{name} {self.position(pose)} lies outside the world, '
                       f'x {x_min:g} to {x_max:g} and y {y_min:g} to {y_max:g} m')
