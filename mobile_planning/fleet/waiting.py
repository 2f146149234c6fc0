"""Waiting: who had not arrived when a mission ended, and what is known of why."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import NoPath
from mobile_planning.fleet.guidance import Guidance
from mobile_planning.fleet.hold_up import Reason
from mobile_planning.fleet.message import LinkMode, Mode
from mobile_planning.fleet.report import Waiting
from mobile_planning.fleet.vehicle import Vehicle
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import RoundObstacle

#: A way is measured so often [s]; shorter by this [m] is nearer.
_SAMPLE, _NEARER = 0.25, 0.05


def waiting_at(vehicles: Sequence[Vehicle], environment: Environment, now: float) -> tuple[Waiting, ...]:
    """Return what is known of each living robot that has not arrived at ``now`` [s]."""
    dead = [vehicle for vehicle in vehicles if vehicle.has_joined and not vehicle.is_alive]
    bodies = [(vehicle.robot.plan.end, vehicle.robot.limits.radius) for vehicle in dead]
    gone = {vehicle.eyed for vehicle in dead}
    return tuple(_waiting(vehicle, gone, bodies, environment, now) for vehicle in vehicles
                 if vehicle.is_alive and not vehicle.robot.is_done)


def is_cut_off(place: ArrayLike, goal: ArrayLike, radius: float, bodies: Sequence[tuple[NDArray, float]],
               environment: Environment) -> bool:
    """Return whether ``bodies``, discs at rest (place (2,) and radius [m]), leave a disc no way to its goal.

    Examples
    --------
    >>> from mobile_planning import Boundary
    >>> lane = Environment(Boundary((0, 8), (0, 0.6)))
    >>> [is_cut_off((1, 0.3), (7, 0.3), 0.2, [((x, 0.3), 0.2)], lane) for x in (4, 7.5)]
    [True, False]
    """
    if not bodies:
        return False
    if any(np.linalg.norm(np.subtract(goal, body)) < radius + size for body, size in bodies):
        return True
    around = Environment(environment.boundary, [*environment.obstacles, *(RoundObstacle(*body) for body in bodies)],
                         environment.grid)
    try:
        Guidance(around, goal, radius, v_max=1.0).path(place)
    except NoPath:
        return True
    return False


def _nearer_until(vehicle, environment, now):
    """Return when [s] the body last came nearer to its goal than ever before."""
    robot, solution = vehicle.robot, vehicle.solution
    guidance = Guidance(environment, robot.k_mod.z_final, robot.limits.radius, robot.limits.v_max)
    times = np.arange(0.0, max(now, 0.0) + _SAMPLE, _SAMPLE)
    left = [guidance.length(place) for place in solution.states(vehicle.clock(times))[:, :2]]
    least, since = left[0], 0.0
    for time, length in zip(times.tolist(), left):
        if length < least - _NEARER:
            least, since = length, time
    return since


def _waiting(vehicle, gone, bodies, environment, now):
    robot, clock = vehicle.robot, vehicle.clock(now)
    place = tuple(map(float, robot.state(clock)[:2]))
    links = robot.protocol.links(clock)
    mode = 'paused' if robot.is_paused else robot.mode.name.lower()
    held = robot.held_up
    others = () if held is None else held.for_robots
    forbidding = robot.protocol.forbidding(clock, True) if robot.mode is not Mode.STOPPED else []
    return Waiting(
        robot.eyed, mode, _nearer_until(vehicle, environment, now), place, tuple(sorted(forbidding)),
        tuple(sorted(peer for peer in gone & links.keys() if links[peer].mode is LinkMode.CON)),
        *(others if held is not None and held.reason is reason else () for reason in (Reason.TURN, Reason.BLOCKED)),
        is_cut_off(place, robot.k_mod.z_final, robot.limits.radius, bodies, environment))
