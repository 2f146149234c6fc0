"""Collisions: the truth about a simulation, by samples of where the bodies were."""
from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.invariant import TOLERANCE, Breach
from mobile_planning.fleet.plan_distances import curves
from mobile_planning.fleet.vehicle import Vehicle


def positions(plans: Sequence[Plan], times: NDArray) -> NDArray[np.float64]:
    """Return where a body is (N, 2) [m] that drives each of ``plans`` from its first knot to the next one's.

    Parameters
    ----------
    plans : sequence of Plan
    times : (N,) ndarray [s]
        On the clock of the body, increasing.
    """
    bounds = [0, *np.searchsorted(times, [plan.first_knot * plan.step for plan in plans[1:]]), len(times)]
    return np.concatenate([_positions(plan, times[low:high])
                           for plan, low, high in zip(plans, bounds, bounds[1:]) if high > low])


def _positions(plan, times):
    """Return the places (N, 2) [m] by de Casteljau's construction."""
    u = np.clip(times / plan.step - plan.first_knot, 0.0, len(plan.points) - 3)
    span = np.minimum(u.astype(int), len(plan.points) - 4)
    share = (u - span)[:, None, None]
    points = curves(plan, plan.first_knot, len(plan.points) - 3)[span]
    while points.shape[1] > 1:
        points = points[:, :-1] + share * (points[:, 1:] - points[:, :-1])
    return points[:, 0]


def collisions(vehicles: Sequence[Vehicle], until: float, step: float = 0.01) -> tuple[float, list[Breach]]:
    """Return the least distance of two centres [m], and where bodies overlap, by samples on the fleet's clock.

    Parameters
    ----------
    vehicles : sequence of Vehicle
    until : float [s]
        Since the start of the mission.
    step : float [s]
        Between two samples.

    Returns
    -------
    least : float [m]
        Infinite for one robot.
    breaches : list of Breach
        The first sample of each pair that collides.
    """
    times = np.arange(0.0, until + step, step)
    places = [positions(vehicle.solution.plans, vehicle.clock(times)) for vehicle in vehicles]
    least, breaches = np.inf, []
    for (a, at_a), (b, at_b) in combinations(zip(vehicles, places), 2):
        distance = np.hypot(*(at_a - at_b).T)
        least = min(least, float(distance.min()))
        hits = np.flatnonzero(distance < a.robot.rho + b.robot.rho - TOLERANCE)
        if len(hits):
            breaches.append(Breach(float(times[hits[0]]), tuple(sorted((a.eyed, b.eyed))),
                                   f'they collide: centres {distance[hits[0]]:.4f} m apart, later {distance.min():.4f} '
                                   f'm, their bodies need {a.robot.rho + b.robot.rho:.4f} m'))
    return least, sorted(breaches, key=lambda breach: breach.time)
