"""Planning problems in files: a world, a start and a goal, and the best that is known of them."""
from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from typing import Any

from mobile_planning.errors import InvalidInput
from mobile_planning.world.boundary import Boundary
from mobile_planning.world.environment import Environment
from mobile_planning.world.moving_obstacle import MovingObstacle
from mobile_planning.world.obstacles import Obstacle, PolygonObstacle, RectangleObstacle, RoundObstacle

_KINDS = {'dubins': 3, 'holonomic': 2}
_EXPECTED = ('solved', 'infeasible')


@dataclass(frozen=True, eq=False)
class Problem:
    """A start, a goal, and what stands between them.

    Parameters
    ----------
    name : str
    kind : str
        ``'dubins'``: a car, poses are (x, y, heading); ``'holonomic'``: a point that goes anywhere, (x, y).
    environment : Environment
    start, goal : tuple of float [m, m, rad]
    turning_radius : float [m]
        0 for the holonomic kind.
    goal_tolerance : tuple of three float [m, m, rad]
    speed : float [m/s]
        At which arrival times are counted where obstacles move.
    expect : str
        ``'solved'`` or ``'infeasible'``.
    best_known : mapping or None
        ``cost`` [m] and how it was found.
    queries : tuple of Query
        Further pairs of start and goal in the same world.
    """

    name: str
    kind: str
    environment: Environment
    start: tuple[float, ...]
    goal: tuple[float, ...]
    turning_radius: float = 0.0
    goal_tolerance: tuple[float, float, float] = (0.0, 0.0, 0.0)
    speed: float = 1.0
    expect: str = 'solved'
    best_known: Mapping[str, Any] | None = None
    queries: tuple[Query, ...] = ()


@dataclass(frozen=True)
class Query:
    """A further start and goal of a problem, and the cost [m] of the best path known."""

    start: tuple[float, ...]
    goal: tuple[float, ...]
    cost: float | None = None


def load_problem(path: str | Path) -> Problem:
    """Return the problem in a JSON file (format 1).

    Raises
    ------
    InvalidInput
        If the file is not of that format or a number is out of its range; the message says which.
    OSError
        If the file cannot be read.
    """
    path = Path(path)
    try:
        data = json.loads(path.read_text(encoding='utf-8'))
    except ValueError as error:
        raise InvalidInput(f'{path}: {error}') from None
    try:
        return _problem(data)
    except KeyError as error:
        raise InvalidInput(f'{path}: {error.args[0]!r} is missing') from None
    except (TypeError, AttributeError, ValueError) as error:
        raise InvalidInput(f'{path}: {error}') from None


def _problem(data: Mapping[str, Any]) -> Problem:
    """Return the problem that the contents of a file describe."""
    if data['format'] != 1:
        raise InvalidInput(f'format {data["format"]!r} is not 1')
    kind = data['kind']
    if kind not in _KINDS:
        raise InvalidInput(f'kind {kind!r} is none of {", ".join(_KINDS)}')
    expect = data.get('expect', 'solved')
    if expect not in _EXPECTED:
        raise InvalidInput(f'expect {expect!r} is none of {", ".join(_EXPECTED)}')
    x_min, y_min, x_max, y_max = data['bounds']
    fixed, moving = [], []
    for shape in data['obstacles']:
        velocity = tuple(shape.get('velocity', (0.0, 0.0)))
        if any(velocity):
            moving.append(MovingObstacle(_obstacle(shape), velocity))
        else:
            fixed.append(_obstacle(shape))
    environment = Environment(Boundary((x_min, x_max), (y_min, y_max)), fixed, moving=moving,
                              footprint=data.get('footprint_radius', 0.0))
    size = _KINDS[kind]
    queries = tuple(
        Query(_numbers(each['start'], size, 'start'), _numbers(each['goal'], size, 'goal'),
              each.get('best_known_cost'))
        for each in data.get('queries', ()))
    return Problem(
        name=data['name'], kind=kind, environment=environment, start=_numbers(data['start'], size, 'start'),
        goal=_numbers(data['goal'], size, 'goal'),
        turning_radius=_positive(data['turning_radius'], 'turning_radius') if kind == 'dubins' else 0.0,
        goal_tolerance=_numbers(data.get('goal_tolerance', (0.0, 0.0, 0.0)), 3, 'goal_tolerance'),
        speed=_positive(data.get('speed', 1.0), 'speed'), expect=expect, best_known=data.get('best_known'),
        queries=queries)


def _obstacle(shape: Mapping[str, Any]) -> Obstacle:
    """Return the obstacle that one entry describes."""
    kind = shape['type']
    if kind == 'rect':
        return RectangleObstacle(shape['min'], shape['max'])
    if kind == 'circle':
        return RoundObstacle(shape['center'], shape['radius'])
    if kind == 'polygon':
        return PolygonObstacle(shape['points'])
    raise InvalidInput(f'obstacle type {kind!r} is none of rect, circle, polygon')


def _numbers(values: Any, count: int, name: str) -> tuple[float, ...]:
    """Return so many finite numbers."""
    numbers = tuple(float(value) for value in values)
    if len(numbers) != count or not all(map(isfinite, numbers)):
        raise InvalidInput(f'{name} {values} is not made of {count} finite numbers')
    return numbers


def _positive(value: Any, name: str) -> float:
    """Return a finite number above 0."""
    if not (isfinite(value) and value > 0):
        raise InvalidInput(f'{name} {value} is not a finite number above 0')
    return float(value)
