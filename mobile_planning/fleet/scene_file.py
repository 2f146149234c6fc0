"""Scene files: a scene is read from YAML.

A file names its robots one by one::

    name: crossing
    map: ../maps/depot.yaml           # beside this file; or a boundary, or both
    boundary: {x: [0, 10], y: [0, 8]}
    obstacles:
      - {position: [3.0, 4.0], radius: 0.5}
      - {vertices: [[1, 1], [2, 1], [2, 2]]}
    timeout: 60
    method: receding_horizon          # or contracts, the default
    receding_horizon: {Tc: 0.5}       # options of that method, see HorizonOptions
    neighbours: [[1, 2]]              # pairs that stay within com_range of each other
    com_range: 4.0
    robots:
      - {id: 1, start: [2.0, 2.0, 0.0], goal: [8.0, 6.0, 0.0], radius: 0.2, u_max: [1.0, 5.0], a_max: [2.0, 10.0]}

A robot that has ``goals: [[8.0, 6.0, 0.0], [2.0, 6.0, 0.0]]`` instead of a goal drives to one after the other. The file
may also ask a family of ``scenarios`` for world and robots, with the parameters of that family::

    scenario: corridor
    robots: 4
    seed: 3
    width: 0.9

With ``endless: 40`` a robot that arrives within 40 s of the start is given a new goal, drawn by the seed of the run.
The family ``depot`` draws its missions on the map, boundary and obstacles of the file, where it has any.
Lengths are in metres, angles in radians, times in seconds.
"""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import yaml

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet import scenarios
from mobile_planning.fleet.scene import RobotSpec, Scene, is_number
from mobile_planning.world.environment import Boundary
from mobile_planning.world.map_io import load_map
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle

_WORLD = {'map', 'boundary', 'obstacles'}
_MOST_GOALS = 1000
_METHOD = {'method', 'receding_horizon', 'neighbours', 'com_range'}


def load_scene(path: str | Path, robots: int | None = None) -> Scene:
    """Return the scene of a YAML file.

    Parameters
    ----------
    path : path
    robots : int, optional
        Drive with so many: the first of the listed ones, or as many as the family is asked for.

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
    if not isinstance(content.get('neighbours', []), list):
        raise InvalidInput(f'neighbours must be a list of pairs, not {content["neighbours"]!r}')
    for key in ('timeout', 'endless', 'com_range'):
        if not is_number(content.get(key, 0.0)):
            raise InvalidInput(f'{key} must be a number, not {content[key]!r}')
    scene = _drawn(path, content, robots) if 'scenario' in content else _listed(path, content, robots)
    return replace(scene, name=str(content.get('name', path.stem)), method=content.get('method', scene.method),
                   horizon=content.get('receding_horizon', {}), timeout=float(content.get('timeout', scene.timeout)),
                   endless=float(content.get('endless', 0.0)), **_neighbours(content, scene, robots))


def _neighbours(content, scene, robots):
    """Return who stays with whom; of fewer robots than the file lists, those that are left."""
    pairs = tuple(map(tuple, content.get('neighbours', ())))
    if robots is not None:
        pairs = tuple(pair for pair in pairs if set(pair) <= {spec.id for spec in scene.robots})
        if not pairs:
            return {}
    return {'neighbours': pairs, 'com_range': float(content.get('com_range', scene.com_range))}


def _listed(path, content, robots):
    """Return the scene of a file that lists its robots."""
    allowed = {'name', 'timeout', 'endless', 'robots', *_WORLD, *_METHOD}
    _refuse_unknown(content, allowed, 'a scene that lists its robots')
    if not isinstance(content.get('robots'), list):
        raise InvalidInput(f'robots must be a list, not {content.get("robots")!r}')
    specs = [_robot(entry) for entry in content['robots']]
    if robots is not None and not 1 <= robots <= len(specs):
        raise InvalidInput(f'{robots} robots are asked for, the scene lists {len(specs)}')
    world = _world(path, content)
    return Scene('', tuple(specs[:robots]), **world, on_map=world['grid'] is not None)


def _drawn(path, content, robots):
    """Return the scene of a file that names a family."""
    family, own_world = content['scenario'], _WORLD & set(content)
    known = scenarios.parameters(family)
    allowed = {'name', 'timeout', 'endless', 'scenario', 'seed', *_WORLD, *_METHOD, *known}
    _refuse_unknown(content, allowed, f'a scene of family {family}')
    parameters = {key: value for key, value in content.items() if key in known}
    if robots is not None:
        parameters['robots'] = robots
    if not own_world:
        return scenarios.scene(family, content.get('seed', 0), **parameters)
    if family != 'depot':
        raise InvalidInput(f'family {family} has a world of its own: {", ".join(sorted(own_world))} cannot be given')
    return scenarios.random_scene('', content.get('seed', 0), **parameters, **_world(path, content))


def _world(path, content):
    """Return the fields of a scene that say what surrounds the robots."""
    for key, kind, default in (('map', str, ''), ('obstacles', list, [])):
        if type(content.get(key, default)) is not kind:
            raise InvalidInput(f'{key} must be of type {kind.__name__}, not {content[key]!r}')
    map_path = path.parent / content['map'] if content.get('map') else None
    return {'obstacles': tuple(_obstacle(entry) for entry in content.get('obstacles', ())),
            'boundary': _boundary(content['boundary']) if 'boundary' in content else None,
            'grid': load_map(map_path) if map_path else None, 'map_path': map_path}


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
    _refuse_unknown(entry, {'goals'} | set(RobotSpec.__dataclass_fields__) - {'via'}, 'a robot')
    if ('goal' in entry) + ('goals' in entry) != 1:
        raise InvalidInput(f'a robot has a goal or a list of goals: {entry!r}')
    for key in ('id', 'start'):
        if key not in entry:
            raise InvalidInput(f'a robot lacks its {key}: {entry!r}')
    fields = dict(entry)
    goals = fields.pop('goals', None)
    if goals is not None:
        if not isinstance(goals, list) or not 1 <= len(goals) <= _MOST_GOALS:
            raise InvalidInput(f'goals must be a list of 1 to {_MOST_GOALS} poses, not {goals!r}')
        fields |= {'via': tuple(goals[:-1]), 'goal': goals[-1]}
    return RobotSpec(**fields)
