"""One horizon: from the plan in force to the next one, among fences, towards a reference.

A robot on the move goes on; one at rest turns and departs; one whose goal lies
within the horizon arrives there as soon as it can. What comes out is proved by
`shorten`, wherever it came from.
"""
from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet import fences
from mobile_planning.fleet.bspline import bezier, keeps_turn_rate
from mobile_planning.fleet.fences import Fences
from mobile_planning.fleet.section import Departure, SectionProblem, shorten
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.convex_pieces import ConvexPieces

#: Static obstacles farther than this [m] are left to `shorten`, and so are all but so many of the nearest.
_LOOK, _NEAREST = 1.5, 4
#: Limits are kept but for so little, which a reach [m] must not overlook.
_ROUNDING = 1e-6
#: A robot at rest that would set out within this [rad] of its heading sets out along its heading.
_AHEAD = 0.35
#: A robot at rest does not set out for less than this [m], and then towards where it is so far away.
_WORTH, _SETS_OUT = 0.01, 0.05


class Horizon:
    """Plans one robot's sections.

    Parameters
    ----------
    problem : SectionProblem
        With limits, knots and the length of a section.
    goal : (2,) ndarray [m]
    pieces : ConvexPieces
        The static world.
    reverse : bool
        Whether the robot may drive backwards.
    """

    def __init__(self, problem: SectionProblem, goal: NDArray, pieces: ConvexPieces, *, reverse: bool = False):
        self._problem, self._limits, self._step, self._spans = problem, problem.limits, problem.step, problem.spans
        self._goal, self._pieces, self._reverse = goal, pieces, reverse
        self._walls = fences.of_walls(pieces, problem.spans, problem.limits.radius)

    def plan(self, old: NDArray, heading: float, reference: NDArray,
             own: Fences) -> tuple[NDArray[np.float64] | None, float]:
        """Return control points (n, 2) [m] that go on from ``old`` and keep to all fences, None to keep ``old``.

        The second result is the heading [rad] to turn to on the spot first, where the turn before a departure takes
        longer than a section; else NaN.

        Parameters
        ----------
        old : (n, 2) ndarray [m]
            The plan in force from the first knot on.
        heading : float [rad]
            At the first knot.
        reference : (n - 3, 2) ndarray [m]
            Where to be at the knots after the first.
        own : Fences
            Of the other robots.
        """
        curves = bezier(old)
        # Within its limits the robot gets nowhere near the rest; the commit tests them all the same.
        own = own.within(old, self._problem.reach + _ROUNDING)
        look = np.minimum(self._problem.reach, _LOOK)[:, None]
        near = fences.of_pieces(self._pieces, curves, self._limits.radius, curves.min(axis=1) - look,
                                curves.max(axis=1) + look, _NEAREST)
        known = fences.joined(own, self._walls, near)
        departures = [None]
        if not np.ptp(old[:3], axis=0).any():
            departures = self._departures(old, heading, reference, known)
        for departure in departures:
            if departure is not None and departure.hold > self._problem.longest_hold:
                return np.repeat(old[:1], 4, axis=0), departure.heading
            new = self._proved(old, curves, reference, own, known, departure)
            if new is not None:
                return new, np.nan
        return None, np.nan

    def brake(self, old: NDArray, stop: NDArray, own: Fences) -> NDArray[np.float64] | None:
        """Return control points (n, 2) [m] that go on from ``old`` and come to rest near ``stop`` (2,) [m].

        They keep to the fences of the other robots as far as a convex program can; the static world does not count.
        None where nothing is found.
        """
        new = self._problem.solve(old, np.repeat([stop], self._spans, axis=0), own)
        return new if self._is_drivable(new) else None

    def _proved(self, old, curves, reference, own, known, departure):
        """Return control points (n, 2) that keep to all fences; None where that is no progress."""
        new = self._solve(old, reference, known, departure)
        if departure is not None and not self._is_drivable(new):
            new = self._problem.solve(old, reference, known, replace(departure, is_straight=True))
        if new is None:
            return None
        swept = np.concatenate([curves, bezier(new)], axis=1)
        touched = fences.of_pieces(self._pieces, curves, self._limits.radius, swept.min(axis=1), swept.max(axis=1))
        new = shorten(old, new, fences.joined(own, self._walls, touched), self._limits, self._step)
        return None if new is old or departure is not None and np.linalg.norm(new[-1] - old[2]) < _WORTH else new

    def _is_drivable(self, new):
        return new is not None and keeps_turn_rate(new, self._step, self._limits.omega_max)

    def _solve(self, old, reference, known, departure):
        """Return the soonest plan that ends at the goal, or else the one that follows ``reference`` best."""
        goal = self._goal
        if np.linalg.norm(reference[-1] - goal) > 1e-6:
            return self._problem.solve(old, reference, known, departure)
        resting = rest_index(old) if np.array_equal(old[-1], goal) else self._spans + 1
        least = max(3, 2 + int(np.ceil(np.linalg.norm(goal - old[2]) / (self._limits.v_max * self._step))))
        if departure is not None:
            # It turns first.
            least += departure.hold
        best, low, high = None, least, resting - 1
        while low <= high:
            index = (low + high) // 2
            new = self._problem.solve(old, reference, known, departure, arrival=(index, goal))
            if not self._is_drivable(new):
                low = index + 1
            else:
                best, high = new, index - 1
        if best is None and resting > self._spans:
            return self._problem.solve(old, reference, known, departure)
        return best

    def _departures(self, old, heading, reference, known):
        """Return the ways to set out, the better first, of a robot at rest at the first knot; none if it stays."""
        leading = _leading_rest(old)
        if leading < len(old):
            direction = old[leading] - old[2]
            return [Departure(direction / np.linalg.norm(direction), leading - 3)]
        free = self._problem.solve(old, reference, known)
        if free is None:
            return []
        way = free - old[2]
        left = np.linalg.norm(way, axis=1)
        if left.max() < _WORTH:
            return []
        # Where it is to go, not the very first step: among others that may be no step at all.
        first = np.argmax(left > min(_SETS_OUT, 0.5 * left.max()))
        direction = way[first] / left[first]
        turn = float(wrap_angle(np.arctan2(direction[1], direction[0]) - heading))
        side = 1.0
        if self._reverse and abs(turn) > np.pi / 2 + 1e-9:
            turn, side = float(wrap_angle(turn + np.pi)), -1.0
        hold = int(np.ceil(abs(turn) / (self._limits.omega_max * self._step) + 1e-6))
        turned = Departure(direction, hold, float(wrap_angle(heading + turn)))
        if abs(turn) > _AHEAD:
            return [turned]
        # Along its heading it need not turn, but there may be a wall.
        return [Departure(side * np.array([np.cos(heading), np.sin(heading)]), 0, heading), turned]


def rest_index(points: NDArray) -> int:
    """Return the index from which all control points (n, 2) are equal."""
    differ = np.flatnonzero((points != points[-1]).any(axis=1))
    return int(differ[-1]) + 1 if len(differ) else 0


def _leading_rest(points):
    """Return the index of the first control point that differs from its first one; their number if none does."""
    differ = np.flatnonzero((points != points[0]).any(axis=1))
    return int(differ[0]) if len(differ) else len(points)
