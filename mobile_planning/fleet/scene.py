"""Scene: who drives from where to where in which world.

Lengths are in metres, angles in radians, times in seconds.
"""
from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.tether import SHARE
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

# The judge's scipy would cost each robot 45 MB and a quarter of a second: it is imported where it is needed.
if TYPE_CHECKING:
    from mobile_planning.fleet.errands import Errands
    from mobile_planning.fleet.verification import Body
    from mobile_planning.fleet.world_sim import WorldSim

MAX_ROBOTS = 256
#: Room beside a body at a goal that is drawn [m].
_MARGIN = 0.025
METHODS = 'contracts', 'receding_horizon'


@dataclass(frozen=True, eq=False)
class RobotSpec:
    """One robot of a scene: its id, mission, size and limits.

    ``via`` are the goals before the last one, ``goal``, in order.
    """

    id: int
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    radius: float = 0.2
    u_max: tuple[float, float] = (1.0, 5.0)
    a_max: tuple[float, float] = (2.0, 10.0)
    via: tuple[tuple[float, float, float], ...] = ()

    def __post_init__(self):
        if not isinstance(self.id, int) or isinstance(self.id, bool) or not 0 <= self.id < 2**32:
            raise InvalidInput(f'a robot id is a whole number from 0 to 4294967295, not {self.id!r}')
        if not is_number(self.radius) or not 0 < self.radius <= 100:
            raise InvalidInput(f'radius is {self.radius!r}, not in 0..100 m')
        for key, size in (('start', 3), ('goal', 3), ('u_max', 2), ('a_max', 2)):
            _require_numbers(key, getattr(self, key), size)
        for goal in self.via:
            _require_numbers('goal', goal, 3)
            UnicycleKineModel(self.start, goal)
        self.kine_model()

    def kine_model(self) -> UnicycleKineModel:
        """Return the kinematic model with start, first goal and limits."""
        return UnicycleKineModel(self.start, [*self.via, self.goal][0], u_max=self.u_max, a_max=self.a_max)


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
    endless : float [s]
        So long a robot that arrives is given a new goal, drawn from the free places of the world; 0 for never.
    method : str
        By which all robots plan, see `Robot`.
    horizon : dict
        Options of the method ``'receding_horizon'``, see `HorizonOptions`; other methods leave them alone.
    neighbours : tuple of (int, int)
        Pairs of robots that stay within ``com_range`` of each other.
    com_range : float [m]
        Infinite for as far as they like.
    """

    name: str
    robots: tuple[RobotSpec, ...]
    obstacles: tuple[Obstacle, ...] = ()
    boundary: Boundary | None = None
    grid: OccupancyGrid | None = None
    map_path: Path | None = None
    on_map: bool = False
    timeout: float = 60.0
    endless: float = 0.0
    method: str = 'contracts'
    horizon: Mapping[str, float] = field(default_factory=dict)
    neighbours: tuple[tuple[int, int], ...] = ()
    com_range: float = np.inf

    def __post_init__(self):
        ids = [robot.id for robot in self.robots]
        if not 1 <= len(ids) <= MAX_ROBOTS or len(set(ids)) != len(ids):
            raise InvalidInput(f'a scene has 1 to {MAX_ROBOTS} robots with ids of their own, not {ids}')
        if self.boundary is None and self.grid is None and not self.on_map:
            raise InvalidInput('a scene needs a map or a boundary')
        if not 0 < self.timeout <= 86400:
            raise InvalidInput(f'timeout is {self.timeout} s, not in 0..86400')
        if not 0 <= self.endless < self.timeout:
            raise InvalidInput(f'endless is {self.endless} s, not in 0..{self.timeout}, the timeout: when it is over '
                               'all drive to the goals that they have')
        if self.endless and any(robot.via for robot in self.robots):
            raise InvalidInput('robots with a list of goals have no endless mission')
        self._require_neighbours()
        if self.method not in METHODS:
            raise InvalidInput(f'method is {self.method!r}; known are {" and ".join(METHODS)}')
        if self.horizon:
            from mobile_planning.fleet.horizon_options import HorizonOptions
            try:
                HorizonOptions(**self.horizon)
            except TypeError:
                known = ', '.join(each.name for each in fields(HorizonOptions))
                raise InvalidInput(f'the receding horizon has the options {known}, not {self.horizon!r}') from None

    def _require_neighbours(self):
        """Require that pairs of neighbours are pairs of robots that start and end within their range."""
        if not is_number(self.com_range) or not self.com_range > 0:
            raise InvalidInput(f'com_range is {self.com_range!r}, not a length above 0')
        if bool(self.neighbours) != (self.com_range < np.inf):
            raise InvalidInput('neighbours need a com_range to stay in, and a com_range needs neighbours')
        specs = {spec.id: spec for spec in self.robots}
        for pair in self.neighbours:
            if not isinstance(pair, Sequence) or len(pair) != 2 or pair[0] == pair[1] or not set(pair) <= set(specs):
                raise InvalidInput(f'neighbours are pairs of robots of the scene, {sorted(specs)}, not {pair!r}')
            one, other = (specs[eyed] for eyed in pair)
            for where in ('start', 'goal'):
                apart = float(np.hypot(*np.subtract(getattr(one, where), getattr(other, where))[:2]))
                if apart > self.com_range * SHARE:
                    raise InvalidInput(f'robots {pair[0]} and {pair[1]} have {where}s {apart:.3f} m apart, neighbours '
                                       f'may have no more than {self.com_range * SHARE:.3f} m with com_range '
                                       f'{self.com_range} m')

    def spec(self, robot_id: int) -> RobotSpec:
        """Return what the robot with ``robot_id`` is like.

        Raises
        ------
        InvalidInput
            The scene has no such robot.
        """
        spec = next((spec for spec in self.robots if spec.id == robot_id), None)
        if spec is None:
            raise InvalidInput(f'scene {self.name} has the robots {[s.id for s in self.robots]}, not {robot_id}')
        return spec

    def robot(self, robot_id: int, grid: OccupancyGrid | None = None, **options) -> Robot:
        """Return the robot with ``robot_id``; ``grid`` replaces the scene's, ``options`` go to ``Robot``.

        Raises
        ------
        InvalidInput
            The scene has no such robot.
        """
        spec = self.spec(robot_id)
        options = {'method': self.method, **options}
        if self.neighbours:
            near = [set(pair) - {robot_id} for pair in self.neighbours if robot_id in pair]
            options = {'neigh': sorted(set().union(*near)), 'com_range': self.com_range, **options}
        if options['method'] == 'receding_horizon':
            options = {**self.horizon, **{name: value for name, value in options.items() if value is not None}}
        return Robot(spec.id, spec.kine_model(), self.obstacles, self.boundary, rho=spec.radius,
                     grid=self.grid if grid is None else grid, **options)

    def world_sim(self, **options) -> WorldSim:
        """Return the mission, ready to run in process; ``options`` go to every ``Robot``.

        Raises
        ------
        InvalidInput
            Robots overlap at their starts, first goals or last goals.
        PlanningError
            A robot has no room at its start or one of its goals, or no way there.
        """
        from mobile_planning.fleet.world_sim import WorldSim, require_apart
        require_apart(self.bodies())
        robots = [self.robot(spec.id, **options) for spec in self.robots]
        for robot, spec in zip(robots, self.robots):
            for goal in [*spec.via, spec.goal][1:]:
                robot.require_goal(goal)
        return WorldSim(self.name, robots, self.obstacles, self.boundary, self.grid)

    def errands(self, seed: int = 0) -> Errands | None:
        """Return where robots drive next when they have arrived, None for missions with one goal a robot.

        Parameters
        ----------
        seed : int
            Of the goals that are drawn, where the mission is endless.
        """
        from mobile_planning.fleet.errands import EndlessErrands, GoalQueues
        if self.endless:
            radii = {spec.id: spec.radius + _MARGIN for spec in self.robots}
            return EndlessErrands(self.environment(), radii, self.endless, seed)
        if any(spec.via for spec in self.robots):
            return GoalQueues({spec.id: [*spec.via, spec.goal][1:] for spec in self.robots})
        return None

    def environment(self) -> Environment:
        """Return the static world."""
        return Environment(self.boundary, self.obstacles, self.grid)

    def bodies(self) -> list[Body]:
        """Return what each robot is held to when its solution is judged."""
        from mobile_planning.fleet.verification import Body
        return [Body(spec.id, spec.radius, np.array(spec.start, float), np.array(spec.goal, float),
                     *map(float, spec.u_max), float(spec.a_max[0]), tuple(np.array(goal, float) for goal in spec.via))
                for spec in self.robots]


def _require_numbers(key, value, size):
    if not isinstance(value, Iterable) or [is_number(entry) for entry in value] != [True] * size:
        raise InvalidInput(f'{key} must be {size} numbers, not {value!r}')


def is_number(value: object) -> bool:
    """Return whether ``value`` is a real number, which a truth value is not."""
    return isinstance(value, Real) and not isinstance(value, bool)
