"""Verification: judge solutions from their published plans alone.

Shares geometry and obstacles with what it checks, and nothing else: splines are
evaluated by scipy, distances to occupied cells square by square. Between two
samples no robot can be farther from either than its speed allows; where that
leaves a doubt, the samples are refined to about a microsecond.
"""
from __future__ import annotations

from dataclasses import asdict, dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.track import TOLERANCE, Track
from mobile_planning.world.environment import Environment

#: Samples are this far apart [s], refined by this factor, at most so often.
_STEP, _REFINE, _DEPTH = 0.005, 8, 4


@dataclass(frozen=True, eq=False)
class Body:
    """What a robot is held to: its size, its mission, its limits.

    Attributes
    ----------
    eyed : int
    radius : float [m]
        Of the body alone, without margins.
    start, goal : (3,) ndarray [m, m, rad]
    v_max, omega_max, a_max : float [m/s, rad/s, m/s^2]
    """

    eyed: int
    radius: float
    start: NDArray[np.float64]
    goal: NDArray[np.float64]
    v_max: float
    omega_max: float
    a_max: float


@dataclass(frozen=True)
class Report:
    """What a mission came to.

    Attributes
    ----------
    name : str
    valid : bool
        All arrived and nothing was violated.
    robots, arrived : int
    min_separation : float [m]
        Between two centres; infinite for one robot.
    min_obstacle_clearance : float [m]
        Between the edge of a body and the static world.
    mission_time : float [s]
        From the start to the last arrival.
    violations : list of str
        One sentence each.
    closest : dict
        The pair of robots, the time [s] since the start and the two places [m] of the closest approach.
    """

    name: str
    valid: bool
    robots: int
    arrived: int
    min_separation: float
    min_obstacle_clearance: float
    mission_time: float
    violations: list[str] = field(default_factory=list)
    closest: dict | None = None

    def as_dict(self) -> dict:
        """Return the fields for JSON, which has no infinity: None stands for it."""
        return {key: None if isinstance(value, float) and not np.isfinite(value) else value
                for key, value in asdict(self).items()}

    def table(self) -> str:
        """Return the report for a person."""
        rows = [('mission', self.name), ('valid', 'yes' if self.valid else 'NO'),
                ('arrived', f'{self.arrived} of {self.robots} robots'), ('mission time', f'{self.mission_time:.2f} s'),
                ('min separation', f'{self.min_separation:.3f} m between centres'),
                ('min obstacle clearance', f'{self.min_obstacle_clearance:.3f} m'),
                *(('violation', sentence) for sentence in self.violations)]
        return '\n'.join(f'{name:<24}{value}' for name, value in rows)


def verify(solutions: dict[int, Solution], bodies: list[Body], environment: Environment,
           start_time: float = 0.0, name: str = 'mission') -> Report:
    """Return the report on ``solutions``, by robot id, of a mission that began at ``start_time`` [s].

    Robots without a solution have not arrived and are taken to stand at their start.
    """
    violations, tracks = [], {}
    for body in bodies:
        solution = solutions.get(body.eyed)
        tracks[body.eyed] = Track(body, solution, start_time)
        violations += tracks[body.eyed].violations()
    end = max(track.end for track in tracks.values())
    world = _StaticWorld(environment)
    clearance = min(_least_clearance(track, world, violations) for track in tracks.values())
    separation, closest = np.inf, None
    for a, b in combinations(tracks.values(), 2):
        distance, time = _least_separation(a, b, end, violations)
        if distance < separation:
            separation = distance
            closest = {'robots': [a.body.eyed, b.body.eyed], 'time': float(time),
                       'places': [track.at(np.array([time]))[0].tolist() for track in (a, b)]}
    arrivals = [track.arrival() for track in tracks.values()]
    arrived = int(np.isfinite(arrivals).sum())
    return Report(name, not violations and arrived == len(bodies), len(bodies), arrived, float(separation),
                  float(clearance), float(max((t for t in arrivals if np.isfinite(t)), default=0.0)),
                  violations, closest)


def _least(values, slack, times, limit):
    """Return the least of ``values(times)`` and its time, refined where it may fall below ``limit`` in between.

    Between two neighbours the value changes by at most ``slack`` a second, so it
    stays above their mean less half of what it may change in between.
    """
    least, when, times = np.inf, times[0], times[None]
    for _ in range(_DEPTH + 1):
        found, most = (function(times.ravel()).reshape(times.shape) for function in (values, slack))
        row, column = np.unravel_index(found.argmin(), found.shape)
        if found[row, column] < least:
            least, when = found[row, column], times[row, column]
        change = np.maximum(most[:, 1:], most[:, :-1]) * np.diff(times, axis=1)
        rows, columns = np.nonzero(found[:, :-1] + found[:, 1:] - change < 2 * limit)
        if least < limit or not len(rows):
            break
        times = np.linspace(times[rows, columns], times[rows, columns + 1], _REFINE + 1, axis=1)
    return least, when


def _times(end):
    return np.linspace(0.0, max(end, _STEP), max(2, int(np.ceil(end / _STEP)) + 1))


def _least_clearance(track, world, violations):
    """Return the least distance from the body's edge to the static world, and note a breach."""
    least, when = _least(lambda times: world.distance(track.at(times)) - track.body.radius, track.speed_bounds,
                         _times(track.end), -TOLERANCE)
    if least < -TOLERANCE:
        violations.append(f'robot {track.body.eyed} is {-least:.4f} m inside the static world at {when:.3f} s')
    return least


def _least_separation(a, b, end, violations):
    """Return the least distance of two centres and its time, and note a breach."""
    limit = a.body.radius + b.body.radius
    least, when = _least(lambda times: np.linalg.norm(a.at(times) - b.at(times), axis=1),
                         lambda times: a.speed_bounds(times) + b.speed_bounds(times), _times(end), limit - TOLERANCE)
    if least < limit - TOLERANCE:
        violations.append(f'robots {a.body.eyed} and {b.body.eyed} are {least:.4f} m apart at {when:.3f} s, '
                          f'their radii need {limit:.4f} m')
    return least, when


class _StaticWorld:
    """Exact distances to the static world: boundary, obstacles and the squares of occupied cells."""

    def __init__(self, environment):
        self._environment, self._grid = environment, environment.grid
        if self._grid is not None:
            rows, columns = np.nonzero(environment.occupied)
            self._centres = np.column_stack([columns, rows]) + 0.5
            self._tree = cKDTree(self._centres) if len(self._centres) else None

    def distance(self, points):
        """Return the signed distance (N,) [m] of ``points`` (N, 2) [m]; occupied cells have none below 0."""
        distance = np.full(len(points), np.inf)
        if self._environment.boundary is not None:
            distance = np.minimum(distance, self._environment.boundary.distance(points))
        for obstacle in self._environment.obstacles:
            distance = np.minimum(distance, obstacle.distance(points))
        if self._grid is not None:
            distance = np.minimum(distance, self._grid_distance(points))
        return distance

    def _grid_distance(self, points):
        x, y, yaw = self._grid.origin
        offset = points - (x, y)
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        cells = offset @ turn / self._grid.resolution
        distance = np.minimum(cells, (self._grid.width, self._grid.height) - cells).min(axis=1)
        if self._tree is not None:
            distance = np.minimum(distance, self._distance_to_squares(cells))
        return distance * self._grid.resolution

    def _distance_to_squares(self, cells):
        """Return the distance (N,) of places (N, 2) to the nearest occupied square, all in cells."""
        distance, count, left = np.empty(len(cells)), 12, np.arange(len(cells))
        while len(left):
            count = min(count, len(self._centres))
            to_centre, nearest = self._tree.query(cells[left], k=range(1, count + 1))
            gap = np.abs(cells[left, None] - self._centres[nearest]) - 0.5
            distance[left] = np.linalg.norm(gap.clip(0.0), axis=-1).min(axis=1)
            # A square beyond those looked at is nearer than its centre by at most half a diagonal.
            unsure = to_centre[:, -1] < distance[left] + np.sqrt(0.5)
            left, count = left[unsure & (count < len(self._centres))], 4 * count
        return distance
