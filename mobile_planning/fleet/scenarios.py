"""Scenes: who drives from where to where in which world, read from YAML.

A scene names its robots one by one, or asks a generator for them::

    name: crossing
    map: ../maps/depot.yaml           # beside this file; or a boundary, or both
    boundary: {x: [0, 10], y: [0, 8]}
    obstacles:
      - {position: [3.0, 4.0], radius: 0.5}
      - {vertices: [[1, 1], [2, 1], [2, 2]]}
    timeout: 60
    robots:
      - {id: 1, start: [2.0, 2.0, 0.0], goal: [8.0, 6.0, 0.0], radius: 0.2, u_max: [1.0, 5.0], a_max: [2.0, 10.0]}

    scenario: depot                   # random free starts and goals, far from each other
    robots: 8
    seed: 3

Lengths are in metres, angles in radians, times in seconds.
"""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import yaml

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.robot import Robot
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.map_io import load_map
from mobile_planning.world.obstacles import Obstacle, PolygonObstacle, RoundObstacle
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
        if not _is_number(self.radius) or not 0 < self.radius <= 100:
            raise InvalidInput(f'radius is {self.radius!r}, not in 0..100 m')
        for key, size in (('start', 3), ('goal', 3), ('u_max', 2), ('a_max', 2)):
            value = getattr(self, key)
            if not isinstance(value, Iterable) or [_is_number(entry) for entry in value] != [True] * size:
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

    def world_sim(self) -> WorldSim:
        """Return the mission, ready to run in process."""
        from mobile_planning.fleet.world_sim import WorldSim
        return WorldSim(self.name, [self.robot(spec.id) for spec in self.robots],
                        self.obstacles, self.boundary, self.grid)

    def environment(self) -> Environment:
        """Return the static world."""
        return Environment(self.boundary, self.obstacles, self.grid)

    def bodies(self) -> list[Body]:
        """Return what each robot is held to when its solution is judged."""
        from mobile_planning.fleet.verification import Body
        return [Body(spec.id, spec.radius, np.array(spec.start, float), np.array(spec.goal, float),
                     *map(float, spec.u_max), float(spec.a_max[0])) for spec in self.robots]


def load_scene(path: str | Path, robots: int | None = None) -> Scene:
    """Return the scene of a YAML file.

    Parameters
    ----------
    path : path
    robots : int, optional
        Drive with so many: the first of the listed ones, or as many random ones.

    Raises
    ------
    InvalidInput
        The file cannot be read or says something impossible; the message names the key.
    MapError
        The scene's map cannot be read.
    """
    path = Path(path)
    try:
        content = yaml.safe_load(path.read_text())
    except OSError as error:
        raise InvalidInput(f'scene {path}: {error.strerror}') from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise InvalidInput(f'scene {path} is not YAML: {" ".join(str(error).split())[:200]}') from None
    try:
        return _scene(path, content, robots)
    except (InvalidInput, TypeError) as error:
        raise InvalidInput(f'scene {path}: {error}') from None


def _scene(path, content, robots):
    if not isinstance(content, dict):
        raise InvalidInput('the file must be a mapping')
    keys = {'name', 'map', 'boundary', 'obstacles', 'timeout', 'robots', 'scenario', 'seed'}
    _refuse_unknown(content, keys, 'the scene')
    for key, kind, default in (('map', str, ''), ('obstacles', list, []), ('seed', int, 0)):
        if type(content.get(key, default)) is not kind:
            raise InvalidInput(f'{key} must be of type {kind.__name__}, not {content[key]!r}')
    if not _is_number(content.get('timeout', 60.0)):
        raise InvalidInput(f'timeout must be a number, not {content["timeout"]!r}')
    map_path = path.parent / content['map'] if content.get('map') else None
    grid = load_map(map_path) if map_path else None
    boundary = _boundary(content['boundary']) if 'boundary' in content else None
    obstacles = tuple(_obstacle(entry) for entry in content.get('obstacles', ()))
    listed = content.get('robots')
    if 'scenario' in content:
        if content['scenario'] != 'depot' or type(listed) is not int:
            raise InvalidInput(f'scenario {content["scenario"]!r} with robots {listed!r}: '
                               'known is depot, with a number of robots')
        specs = random_missions(Environment(boundary, obstacles, grid), listed if robots is None else robots,
                                content.get('seed', 0))
    else:
        if not isinstance(listed, list):
            raise InvalidInput('robots must be a list')
        specs = [_robot(entry) for entry in listed]
        if robots is not None and not 1 <= robots <= len(specs):
            raise InvalidInput(f'{robots} robots are asked for, the scene lists {len(specs)}')
        specs = specs[:robots]
    return Scene(str(content.get('name', path.stem)), tuple(specs), obstacles, boundary, grid, map_path,
                 grid is not None, float(content.get('timeout', 60.0)))


def _is_number(value):
    return isinstance(value, Real) and not isinstance(value, bool)


def _refuse_unknown(entry, known, what):
    if not isinstance(entry, dict) or set(entry) - known:
        raise InvalidInput(f'{what} may have the keys {", ".join(sorted(known))}, not {entry!r}')


def _boundary(entry):
    _refuse_unknown(entry, {'x', 'y'}, 'the boundary')
    return Boundary(entry.get('x'), entry.get('y'))


def _obstacle(entry):
    _refuse_unknown(entry, {'position', 'radius', 'vertices'}, 'an obstacle')
    if set(entry) not in ({'position', 'radius'}, {'vertices'}):
        raise InvalidInput(f'an obstacle has position and radius, or vertices, not {entry!r}')
    try:
        if 'vertices' in entry:
            return PolygonObstacle(entry['vertices'])
        return RoundObstacle(entry['position'], entry['radius'])
    except (InvalidInput, TypeError) as error:
        raise InvalidInput(f'obstacle {entry!r}: {error}') from None


def _robot(entry):
    _refuse_unknown(entry, set(RobotSpec.__dataclass_fields__), 'a robot')
    for key in ('id', 'start', 'goal'):
        if key not in entry:
            raise InvalidInput(f'a robot lacks its {key}: {entry!r}')
    return RobotSpec(**entry)


def random_missions(environment: Environment, count: int, seed: int, radius: float = 0.2) -> list[RobotSpec]:
    """Return ``count`` robots with random free starts and goals, at least 6 m apart where the world allows.

    Starts keep 1 m from starts, and goals from goals.

    Raises
    ------
    InvalidInput
        There is no room for so many.
    """
    if not 1 <= count <= MAX_ROBOTS:
        raise InvalidInput(f'robots is {count}, not in 1..{MAX_ROBOTS}')
    if seed < 0:
        raise InvalidInput(f'seed is {seed}, below 0')
    rng = np.random.default_rng(seed)
    x_min, y_min, x_max, y_max = environment.bounds
    least_trip = min(6.0, 0.4 * max(x_max - x_min, y_max - y_min))
    starts, goals = np.empty((0, 2)), np.empty((0, 2))
    for _ in range(200 * count):
        start, goal = rng.uniform((x_min, y_min), (x_max, y_max), (2, 2))
        if (environment.clearance(np.array([start, goal])).min() >= radius + 0.2
                and np.linalg.norm(goal - start) >= least_trip
                and all(np.linalg.norm(places - place, axis=1).min(initial=np.inf) >= 1.0
                        for places, place in ((starts, start), (goals, goal)))):
            starts, goals = np.vstack([starts, start]), np.vstack([goals, goal])
        if len(starts) == count:
            break
    else:
        raise InvalidInput(f'no room for {count} robots: {len(starts)} found a free start and goal')
    headings = rng.uniform(-np.pi, np.pi, (count, 2))
    return [RobotSpec(index + 1, (*map(float, start), float(turn[0])), (*map(float, goal), float(turn[1])), radius)
            for index, (start, goal, turn) in enumerate(zip(starts, goals, headings))]
