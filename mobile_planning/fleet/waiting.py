"""Waiting: who had not arrived when a mission ended, and what is known of why."""
from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import NoPath
from mobile_planning.fleet.guidance import Guidance
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.message import Link, LinkMode, Mode
from mobile_planning.fleet.report import Waiting
from mobile_planning.fleet.roadmap import TIGHT
from mobile_planning.fleet.search_lattice import SearchLattice
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.vehicle import Vehicle
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import RoundObstacle

#: A way is measured so often [s]; shorter by this [m] is nearer.
_SAMPLE, _NEARER = 0.25, 0.05


@dataclass(frozen=True, eq=False)
class Waiter:
    """A living robot that has not arrived, as it tells of itself.

    Attributes
    ----------
    robot : int
    mode : str
    place, goal : (2,) ndarray [m]
    radius, v_max : float [m, m/s]
    links : mapping of int to Link
    without_word_of : tuple of int
        See `Waiting`.
    held_up : HoldUp or None
    solution : Solution or None
        What it has driven; None if unknown.
    start : float [s]
        Of the mission, on the clock of the solution.
    """

    robot: int
    mode: str
    place: NDArray[np.float64]
    goal: NDArray[np.float64]
    radius: float
    v_max: float
    links: Mapping[int, Link]
    without_word_of: tuple[int, ...]
    held_up: HoldUp | None
    solution: Solution | None
    start: float


def waiting_at(vehicles: Sequence[Vehicle], at_goal: Collection[int], environment: Environment,
               now: float) -> tuple[Waiting, ...]:
    """Return what is known at ``now`` [s] of each living robot that is neither done nor judged to be ``at_goal``."""
    dead = {vehicle.eyed: (vehicle.robot.plan.end, vehicle.robot.limits.radius) for vehicle in vehicles
            if vehicle.has_joined and not vehicle.is_alive}
    waiters = [_waiter(vehicle, now) for vehicle in vehicles
               if vehicle.is_alive and not vehicle.robot.is_done and vehicle.eyed not in at_goal]
    return why_they_wait(waiters, dead, environment, now)


def why_they_wait(waiters: Sequence[Waiter], dead: Mapping[int, tuple[NDArray, float]], environment: Environment,
                  now: float) -> tuple[Waiting, ...]:
    """Return what is known of each of ``waiters`` at ``now`` [s] since the start.

    Parameters
    ----------
    waiters : sequence of Waiter
    dead : mapping of int to ((2,) ndarray [m], float [m])
        Where the bodies of the dead rest, and their radii, by robot id.
    environment : Environment
    now : float [s]
    """
    return tuple(_waiting(waiter, dead, environment, now) for waiter in waiters)


def is_cut_off(place: ArrayLike, goal: ArrayLike, radius: float, bodies: Sequence[tuple[NDArray, float]],
               environment: Environment) -> bool:
    """Return whether ``bodies``, discs at rest (place (2,) and radius [m]), leave a disc no way to its goal.

    A way leaves the room beside them without which no joint plan leads past.

    Examples
    --------
    >>> from mobile_planning import Boundary
    >>> lane = Environment(Boundary((0, 8), (0, 0.6)))
    >>> [is_cut_off((1, 0.3), (7, 0.3), 0.2, [((x, 0.3), 0.2)], lane) for x in (4, 7.5)]
    [True, False]
    """
    if not bodies:
        return False
    at_goal = [float(np.linalg.norm(np.subtract(goal, body))) - radius - size for body, size in bodies]
    if min(at_goal) < 0.0:
        return True
    # Whoever has a goal nearer than that gets there on its own.
    discs = [RoundObstacle(body, size + min(TIGHT, room)) for (body, size), room in zip(bodies, at_goal)]
    around = Environment(environment.boundary, [*environment.obstacles, *discs], environment.grid)
    try:
        Guidance(SearchLattice(around, radius), goal, v_max=1.0).path(place)
    except NoPath:
        return True
    return False


def _nearer_until(waiter, environment, now):
    """Return when [s] the body last came nearer to its goal than ever before; NaN if nobody knows."""
    if waiter.solution is None:
        return np.nan
    guidance = Guidance(SearchLattice(environment, waiter.radius), waiter.goal, waiter.v_max)
    times = np.arange(0.0, max(now, 0.0) + _SAMPLE, _SAMPLE)
    left = [guidance.length(place) for place in waiter.solution.states(waiter.start + times)[:, :2]]
    least, since = left[0], 0.0
    for time, length in zip(times.tolist(), left):
        if length < least - _NEARER:
            least, since = length, time
    return since


def _waiter(vehicle, now):
    robot, clock = vehicle.robot, vehicle.clock(now)
    forbidding = robot.protocol.forbidding(clock, True) if robot.mode is not Mode.STOPPED else []
    return Waiter(robot.eyed, 'paused' if robot.is_paused else robot.mode.name.lower(), robot.state(clock)[:2],
                  robot.k_mod.z_final, robot.limits.radius, robot.limits.v_max, robot.protocol.links(clock),
                  tuple(forbidding), robot.held_up, vehicle.solution, vehicle.clock(0.0))


def _waiting(waiter, dead, environment, now):
    place, links, held = tuple(map(float, waiter.place)), waiter.links, waiter.held_up
    others = () if held is None else held.for_robots
    return Waiting(
        waiter.robot, waiter.mode, _nearer_until(waiter, environment, now), place,
        tuple(sorted(waiter.without_word_of)),
        tuple(sorted(peer for peer in dead.keys() & links.keys() if links[peer].mode is LinkMode.CON)),
        *(others if held is not None and held.reason is reason else () for reason in (Reason.TURN, Reason.BLOCKED)),
        is_cut_off(place, waiter.goal, waiter.radius, list(dead.values()), environment))
