"""Verification: judge solutions from their published plans alone.

Shares geometry and obstacles with what it checks, and nothing else: splines are
evaluated by scipy, distances to occupied cells square by square. Between two
samples no robot can be farther from either than its speed allows; where that
leaves a doubt, the samples are refined until there is none.
"""
from __future__ import annotations

from dataclasses import asdict, dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial import cKDTree

from mobile_planning.fleet.solution import Solution
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.environment import Environment

#: Samples are this far apart [s], refined by this factor, at most so often.
_STEP, _REFINE, _DEPTH = 0.005, 8, 3
_TOLERANCE = 1e-6
_ARRIVED, _TURNED = 0.05, 0.05


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
        tracks[body.eyed] = _Track(body, solution, start_time)
        violations += tracks[body.eyed].violations()
    end = max(track.end for track in tracks.values())
    world = _StaticWorld(environment)
    clearance = min(_least_clearance(track, world, start_time, end, violations) for track in tracks.values())
    separation, closest = np.inf, None
    for a, b in combinations(tracks.values(), 2):
        distance, time = _least_separation(a, b, start_time, end, violations)
        if distance < separation:
            separation = distance
            closest = {'robots': [a.body.eyed, b.body.eyed], 'time': float(time - start_time),
                       'places': [track.at(np.array([time]))[0].tolist() for track in (a, b)]}
    arrivals = [track.arrival() for track in tracks.values()]
    arrived = int(np.isfinite(arrivals).sum())
    return Report(name, not violations and arrived == len(bodies), len(bodies), arrived, float(separation),
                  float(clearance), float(max((t for t in arrivals if np.isfinite(t)), default=start_time) - start_time),
                  violations, closest)


class _Track:
    """The positions of one robot in time, from its plans' control points by scipy."""

    def __init__(self, body, solution, start_time):
        self.body, self._plans = body, list(solution.plans) if solution is not None else []
        self._curves = [BSpline(np.arange(len(plan.points) + 4) - 3.0, plan.points, 3) for plan in self._plans]
        self._starts = np.array([plan.first_knot * plan.step for plan in self._plans])
        self.end = max([start_time, *(plan.end_knot * plan.step for plan in self._plans)])
        self.top_speed = 0.0 if not self._plans else max(self._fastest(i) for i in range(len(self._plans)))

    def _fastest(self, index):
        """The velocity is a convex combination of its own control points."""
        return np.linalg.norm(np.diff(self._plans[index].points, axis=0), axis=1).max() / self._plans[index].step

    def at(self, times, order=0):
        """Return the position (N, 2) or a derivative of it at ``times``."""
        if not self._plans:
            return np.tile(self.body.start[:2] if order == 0 else np.zeros(2), (len(times), 1))
        result = np.empty((len(times), 2))
        which = np.clip(np.searchsorted(self._starts, times + 1e-9, side='right') - 1, 0, None)
        for index in np.unique(which):
            plan, curve = self._plans[index], self._curves[index]
            u = np.clip(times[which == index] / plan.step - plan.first_knot, 0, len(plan.points) - 3)
            result[which == index] = (curve if order == 0 else curve.derivative(order))(u) / plan.step**order
        return result

    def arrival(self):
        """Return when the robot came to rest at its goal, infinite if it did not."""
        if not self._plans:
            return np.inf
        last, goal = self._plans[-1], self.body.goal
        turned = abs(float(wrap_angle(self._final_heading() - goal[2])))
        near = np.linalg.norm(last.points[-1] - goal[:2])
        return self.end if near <= _ARRIVED and turned <= _TURNED else np.inf

    def _final_heading(self):
        last = self._plans[-1]
        moves = np.diff(last.points, axis=0)
        moved = np.flatnonzero(moves.any(axis=1))
        arrival = np.arctan2(*moves[moved[-1]][::-1]) if len(moved) else last.heading
        can_turn = not len(moved) or moved[-1] < len(moves) - 3
        return last.final_heading if can_turn and np.isfinite(last.final_heading) else arrival

    def violations(self):
        """Say where the robot broke its own limits, jumped, or began elsewhere."""
        body, found = self.body, []
        if not self._plans:
            return found
        who = f'robot {body.eyed}'
        if np.linalg.norm(self.at(self._starts[:1])[0] - body.start[:2]) > _TOLERANCE:
            found.append(f'{who} begins at {self.at(self._starts[:1])[0]}, not at its start {body.start[:2]}')
        for index, plan in enumerate(self._plans):
            if index and plan.first_knot < self._plans[index - 1].first_knot:
                found.append(f'{who}: plan {index} starts before its predecessor')
            if index:
                found += self._jumps(who, index)
            until = self._starts[index + 1] if index + 1 < len(self._plans) else plan.end_knot * plan.step
            found += self._limits(who, plan, self._curves[index], until)
        return found

    def _jumps(self, who, index):
        """Compare position, velocity and acceleration on both sides of a change of plan."""
        now = self._starts[index:index + 1]
        for order, what in enumerate(('position', 'velocity', 'acceleration')):
            before, after = (self._value(i, now, order) for i in (index - 1, index))
            if np.abs(before - after).max() > 1e-6:
                return [f'{who}: {what} jumps by {np.abs(before - after).max():.2g} at {now[0]:.3f} s']
        return []

    def _value(self, index, times, order):
        plan, curve = self._plans[index], self._curves[index]
        u = np.clip(times / plan.step - plan.first_knot, 0, len(plan.points) - 3)
        return (curve if order == 0 else curve.derivative(order))(u) / plan.step**order

    def _limits(self, who, plan, curve, until):
        spans = min(until / plan.step - plan.first_knot, len(plan.points) - 3)
        u = np.linspace(0, spans, max(2, int(np.ceil(spans * plan.step / _STEP)) + 1))
        velocity, acceleration = (curve.derivative(order)(u) / plan.step**order for order in (1, 2))
        speed = np.linalg.norm(velocity, axis=1)
        moving = speed > 1e-3
        cross = velocity[:, 0] * acceleration[:, 1] - velocity[:, 1] * acceleration[:, 0]
        turn = np.abs(cross[moving]) / speed[moving]**2
        moving_spans = np.flatnonzero(np.ptp(
            np.lib.stride_tricks.sliding_window_view(plan.points, 4, axis=0), axis=2).any(axis=1))
        checks = [('speed', speed.max(), self.body.v_max, 'm/s'),
                  ('acceleration', np.linalg.norm(acceleration, axis=1).max(), self.body.a_max, 'm/s^2'),
                  ('turn rate', turn.max(initial=0.0), self.body.omega_max, 'rad/s'),
                  ('turn rate in place', self._turn_in_place(plan, moving_spans), self.body.omega_max, 'rad/s')]
        return [f'{who}: {what} {value:.4f} {unit} exceeds {limit} at the plan of knot {plan.first_knot}'
                for what, value, limit, unit in checks if value > limit * (1 + 1e-6)]

    @staticmethod
    def _turn_in_place(plan, moving):
        """Return the rate of the turns before the first and after the last moving span."""
        count = len(plan.points) - 3
        steps = np.diff(plan.points, axis=0)
        if not len(moving):
            final = plan.heading if np.isnan(plan.final_heading) else plan.final_heading
            return abs(float(wrap_angle(final - plan.heading))) / (count * plan.step)
        first, last = moving[0], moving[-1] + 1
        rates = [0.0]
        moves = steps[steps.any(axis=1)]
        if first > 0:
            departure = np.arctan2(moves[0][1], moves[0][0])
            rates.append(abs(float(wrap_angle(departure - plan.heading))) / (first * plan.step))
        if last < count and np.isfinite(plan.final_heading):
            arrival = np.arctan2(moves[-1][1], moves[-1][0])
            rates.append(abs(float(wrap_angle(plan.final_heading - arrival))) / ((count - last) * plan.step))
        return max(rates)


def _least(values, times, slack, limit, depth=_DEPTH):
    """Return the least of ``values(times)`` and its time, refined wherever ``slack`` per second leaves a doubt.

    ``values`` changes by at most ``slack`` a second, so between two samples it
    stays above their mean less half of what it may change in between.
    """
    found = values(times)
    least, when = found.min(), times[found.argmin()]
    width = np.diff(times)
    doubt = (found[:-1] + found[1:] - slack * width) / 2 < min(limit, least)
    if depth and doubt.any() and least >= limit:
        starts = np.flatnonzero(doubt)
        finer = np.unique(np.concatenate([np.linspace(times[i], times[i + 1], _REFINE + 1) for i in starts]))
        below, at = _least(values, finer, slack, limit, depth - 1)
        if below < least:
            least, when = below, at
    return least, when


def _times(start, end):
    return np.linspace(start, max(end, start + _STEP), max(2, int(np.ceil((end - start) / _STEP)) + 1))


def _least_clearance(track, world, start, end, violations):
    """Return the least distance from the body's edge to the static world, and note a breach."""
    def clearance(times):
        return world.distance(track.at(times)) - track.body.radius
    least, when = _least(clearance, _times(start, min(end, track.end)), track.top_speed, 0.0)
    if least < -_TOLERANCE:
        violations.append(f'robot {track.body.eyed} is {-least:.4f} m inside the static world at {when - start:.3f} s')
    return least


def _least_separation(a, b, start, end, violations):
    """Return the least distance of two centres and its time, and note a breach."""
    limit = a.body.radius + b.body.radius
    least, when = _least(lambda times: np.linalg.norm(a.at(times) - b.at(times), axis=1),
                         _times(start, end), a.top_speed + b.top_speed, limit)
    if least < limit - _TOLERANCE:
        violations.append(f'robots {a.body.eyed} and {b.body.eyed} are {least:.4f} m apart at {when - start:.3f} s, '
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
            # The nearest square is not always that of the nearest centre, but one of the nearest few.
            _, nearest = self._tree.query(cells, k=min(12, len(self._centres)))
            gap = np.abs(cells[:, None] - self._centres[nearest.reshape(len(cells), -1)]) - 0.5
            distance = np.minimum(distance, np.linalg.norm(gap.clip(0.0), axis=-1).min(axis=1))
        return distance * self._grid.resolution
