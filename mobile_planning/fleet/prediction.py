"""Where everybody around will be in a moment, if each drives to its goal and gives way by half: the own part is a way.

Each robot predicts for itself from what it has heard, and nearby robots predict nearly the same; so each shifts aside a
little and early, where a rule for one robot alone would have it turn off late. Nothing depends on it but time.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet.neighbour import Neighbour
from mobile_planning.fleet.way_finder import WayFinder

#: Steps [s], and how many there are at most; then they are longer.
_STEP, _STEPS = 0.125, 80
#: Robots give way so long [s] before they would touch, and keep so many radii more than they need.
_HORIZON, _SPARE = 2.0, 0.15
#: So many of the robots nearer than what is driven in this time [s] are predicted.
_MOST, _NEAR = 20, 6.0
#: Nobody changes its velocity faster than from rest to full speed in this time [s].
_AGILITY = 1.0 / 6.0
#: To who is met within this sine of the middle, all pass on the right.
_MIDDLE = 0.1
#: After so long [s] without progress all drive to the right of their ways, by more each second [rad/s], up to so long.
_PATIENCE, _RIGHT, _LONGEST = 0.7, 0.35, 4.0
#: Walls are kept off as if they would be touched in this time [s].
_WALL = 0.5


def drive_on(finder: WayFinder, way: ArrayLike, velocity: ArrayLike, radius: float, v_max: float,
             others: Sequence[Neighbour], seconds: float, stalled: float = 0.0) -> NDArray[np.float64]:
    """Return where a robot will be (T, 2) [m], evenly from now on for ``seconds``, if all drive on and give way.

    Optimal reciprocal collision avoidance, run ahead (van den Berg, Guy, Lin and Manocha, Reciprocal n-body collision
    avoidance, 2011); who meets head-on passes on the right.

    Parameters
    ----------
    finder : WayFinder
        Of the static world, which all keep off.
    way : (W, 2) array_like [m]
        Of the robot, from where it is.
    velocity : (2,) array_like [m/s]
        Of the robot.
    radius, v_max : float [m, m/s]
    others : sequence of Neighbour
        Whoever does not see its goal is taken to drive to the end of its plan first.
    seconds : float [s]
    stalled : float [s]
        How long there has been no progress.

    Examples
    --------
    >>> from mobile_planning import Boundary, Environment
    >>> from mobile_planning.fleet.search_lattice import SearchLattice
    >>> finder = WayFinder(SearchLattice(Environment(Boundary((0, 10), (0, 6))), 0.2), np.array((9.0, 3.0)))
    >>> meets = Neighbour((6, 3), (4, 3), (1, 3), 0.2, velocity=(-1, 0))
    >>> track = drive_on(finder, [(2, 3), (9, 3)], (1, 0), 0.2, 1.0, [meets], 3.5)
    >>> bool(-0.4 < track[:, 1].min() - 3.0 < -0.1), bool(track[-1, 0] > 5.0)
    (True, True)
    """
    from mobile_planning.fleet import prediction_kernels as kernels

    way = np.ascontiguousarray(way, float)
    others = _nearest(way[0], others, _NEAR * v_max)
    places = np.array([way[0], *(other.position for other in others)], float)
    velocities = np.array([velocity, *(other.velocity for other in others)], float)
    goals = np.array([way[-1], *(other.goal for other in others)], float)
    targets = np.array([way[-1], *(other.goal if finder.is_open(other.position, other.goal) else other.end
                                   for other in others)], float)
    radii = np.array([radius, *(other.radius for other in others)], float)
    speeds = np.array([v_max, *(0.0 if other.is_parked else other.v_max for other in others)], float)
    right = _RIGHT * min(max(0.0, stalled - _PATIENCE), _LONGEST)
    lattice, steps = finder.lattice, min(int(np.ceil(seconds / _STEP)), _STEPS)
    return kernels.drive_on(places, velocities, targets, goals, radii, speeds, way, lattice.squared, lattice.low,
                            lattice.resolution, steps, seconds / steps, _HORIZON, _SPARE * radius, _AGILITY, _MIDDLE,
                            right, _WALL)[:, 0]


def arcs(track: NDArray, seconds: float, times: NDArray) -> NDArray[np.float64]:
    """Return how far (M,) [m] the robot has come at ``times`` (M,) [s] along a track (T, 2) [m] of ``seconds``."""
    driven = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(track, axis=0).T))])
    return np.interp(times, np.linspace(0.0, seconds, len(driven)), driven)


def _nearest(here, others, reach):
    """Return the nearest of the robots within ``reach`` [m], in an order that does not hang on that of ``others``."""
    if not others:
        return []
    places = np.array([other.position for other in others], float)
    distance = np.hypot(*(places - here).T)
    order = np.lexsort((places[:, 1], places[:, 0], distance))[:_MOST]
    return [others[index] for index in order if distance[index] <= reach]
