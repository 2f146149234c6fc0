"""Plans: uniform cubic B-splines on absolute knots that end at rest.

Knot k is the time ``k * step`` of the common clock. Span m of a plan lasts from
knot ``first_knot + m`` to the next and uses the control points m to m + 3. The
last three points are equal: from the last knot on the robot stands still for
ever. All functions take any leading axes, so one call judges many candidates.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb, isfinite, isinf
from operator import index

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput

MAX_POINTS = 128
#: Ids, knots and spans are whole numbers below this, which 64 bits hold.
MAX_NUMBER = 2**62
#: Weights of the control points at each of the four Bezier points of a span.
_TO_BEZIER = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6.0
_FOUR = np.arange(4)


def bezier(points: NDArray) -> NDArray[np.float64]:
    """Return the Bezier points (..., S, 4, 2) [m] of the S spans of control points (..., S + 3, 2)."""
    return _TO_BEZIER @ points[..., np.arange(points.shape[-2] - 3)[:, None] + _FOUR, :]


def split(curves: NDArray, pieces: int) -> NDArray[np.float64]:
    """Return the Bezier points (..., S * pieces, 4, 2) of each curve (..., S, 4, 2) cut into equal parts."""
    parts = np.einsum('pij,...sjd->...spid', _cuts(pieces), curves)
    return parts.reshape(*curves.shape[:-3], curves.shape[-3] * pieces, 4, 2)


def _cuts(pieces):
    """Return the matrices (pieces, 4, 4) that map Bezier points to those of each part (de Casteljau)."""
    bernstein = np.linalg.inv(np.array([_bernstein(u, 3) for u in (0, 1 / 3, 2 / 3, 1)]))
    starts = np.arange(pieces)[:, None] / pieces
    samples = starts + np.array([0, 1 / 3, 2 / 3, 1]) / pieces
    return np.einsum('ij,pjk->pik', bernstein, _bernstein(samples, 3))


def _bernstein(u, degree):
    """Return the Bernstein basis (..., degree + 1) at ``u``."""
    u = np.asarray(u, float)[..., None]
    power = np.arange(degree + 1)
    return np.array([comb(degree, i) for i in power]) * u**power * (1 - u)**(degree - power)


#: Slower than this [m/s] is at rest.
_REST = 1e-6


def speed_bound(points: NDArray, step: float) -> NDArray[np.float64]:
    """Return an upper bound (...) [m/s] of the speed on all spans: the longest velocity control point."""
    return _longest(points[..., 1:, :] - points[..., :-1, :]) / step


def acceleration_bound(points: NDArray, step: float) -> NDArray[np.float64]:
    """Return an upper bound (...) [m/s^2] of the acceleration on all spans, likewise exact at knots."""
    steps = points[..., 1:, :] - points[..., :-1, :]
    return _longest(steps[..., 1:, :] - steps[..., :-1, :]) / step**2


def _longest(vectors):
    return np.sqrt((vectors * vectors).sum(axis=-1).max(axis=-1))


def keeps_turn_rate(points: NDArray, step: float, omega_max: float, pieces: int = 4) -> bool:
    """Return whether the turn rate of control points (n, 2) stays within ``omega_max`` [rad/s] at every instant.

    Sufficient, not necessary: the Bernstein coefficients of
    ``omega_max |z'|^2 -/+ z' x z''`` on each of ``pieces`` parts of a span are
    not negative, and the motion never stops on its way or turns back, where the
    heading would jump. A span from or to rest is straight and passes.
    """
    from mobile_planning.fleet import bspline_kernels as kernels

    points = np.ascontiguousarray(points, dtype=float)
    return kernels.goes_on(points, _REST * step) and kernels.keeps_turn_rate(points, step, omega_max, pieces)


@dataclass(frozen=True, eq=False)
class Plan:
    """One plan: where a robot is, and how it is turned, from its first knot on for ever.

    Attributes
    ----------
    first_knot : int
    step : float [s]
        Time between knots.
    points : (n, 2) ndarray [m]
        Control points, 4 to 128; the last three are equal.
    heading : float [rad]
        At the first knot. During spans at rest a plan turns in place, evenly,
        to the direction in which it departs.
    final_heading : float [rad]
        Turned to in place during the spans at rest at the end; NaN for none.
    reverse : bool
        A move departs forwards or backwards, whichever takes the smaller turn; without it always forwards.

    Raises
    ------
    InvalidInput
        A number is out of its range, or the plan does not end at rest.
    """

    first_knot: int
    step: float
    points: NDArray[np.float64]
    heading: float = 0.0
    final_heading: float = np.nan
    reverse: bool = False

    def __post_init__(self):
        try:
            points, first_knot = np.array(self.points, dtype=float), index(self.first_knot)
        except (TypeError, ValueError):
            raise InvalidInput(f'a plan has control points (n, 2) and a whole first knot, not {self.points!r} '
                               f'and {self.first_knot!r}') from None
        if not abs(first_knot) < MAX_NUMBER:
            raise InvalidInput(f'a plan begins at knot {first_knot}, not within {MAX_NUMBER - 1}')
        if points.ndim != 2 or points.shape[1] != 2 or not 4 <= len(points) <= MAX_POINTS:
            raise InvalidInput(f'a plan has 4 to {MAX_POINTS} control points (n, 2), not {points.shape}')
        # Not a number is not within it either.
        if not np.abs(points).max() <= 1e6:
            raise InvalidInput('control points must be finite and within 1e6 m')
        if not 1e-3 <= self.step <= 10.0:
            raise InvalidInput(f'the step between knots is {self.step} s, not in 0.001..10')
        if not isfinite(self.heading) or isinf(self.final_heading):
            raise InvalidInput(f'headings must be finite, not {self.heading} and {self.final_heading}')
        if (points[-3:-1] != points[-1]).any():
            raise InvalidInput('a plan must end at rest: its last three control points differ')
        points.flags.writeable = False
        object.__setattr__(self, 'points', points)
        object.__setattr__(self, 'first_knot', first_knot)

    @classmethod
    def at_rest(cls, first_knot: int, step: float, pose: NDArray) -> Plan:
        """Return the plan that stands at ``pose`` (3,) [m, m, rad] for ever."""
        return cls(first_knot, step, np.tile(np.asarray(pose, float)[:2], (4, 1)), float(pose[2]))

    @property
    def end_knot(self) -> int:
        """The knot from which nothing changes any more."""
        return self.first_knot + len(self.points) - 3

    @property
    def end(self) -> NDArray[np.float64]:
        """Where the plan comes to rest, (2,) [m]."""
        return self.points[-1]

    def control(self, first_knot: int, count: int) -> NDArray[np.float64]:
        """Return the ``count`` control points (count, 2) [m] from ``first_knot`` on; the last is repeated."""
        if first_knot < self.first_knot:
            raise ValueError(f'knot {first_knot} lies before the first of the plan, {self.first_knot}')
        wanted = np.arange(count) + (first_knot - self.first_knot)
        return self.points[np.minimum(wanted, len(self.points) - 1)]

    def curves(self, span: int) -> NDArray[np.float64]:
        """Return the Bezier points (S, 4, 2) [m] of all spans from ``span`` on, and of one at the least."""
        return bezier(self.control(span, max(self.end_knot - span, 1) + 3))

    def states(self, times: NDArray) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (N, 5) [m, m, rad, m/s, rad/s] at ``times`` (N,) [s]; v < 0 backwards."""
        from mobile_planning.fleet.bspline_kernels import states

        return states(self.points, self.step, self.first_knot, np.ascontiguousarray(times, float), *self._rests)

    def state(self, time: float) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (5,) at one ``time`` [s]."""
        return self.states(np.array([time]))[0]

    def turn_in_place(self) -> float:
        """Return the greatest rate [rad/s] at which the plan turns while it stands."""
        runs, _ = self._rests
        return max((abs(turn) / ((last - first) * self.step) for first, last, _, turn, _ in runs.tolist()), default=0.0)

    @cached_property
    def _rests(self):
        """The runs of spans at rest (R, 5), see the kernel, and whether a plan on the move starts backwards."""
        from mobile_planning.fleet.bspline_kernels import rests

        return rests(self.points, self.heading, self.final_heading, self.reverse)


def splice(plans: list[Plan], first_knot: int) -> Plan:
    """Return the one plan that drives ``plans`` in turn, each from its first knot on.

    The motion is theirs at every instant; a turn in place on the way is spread
    over all of the rest that it falls in.

    Parameters
    ----------
    plans : list of Plan
        In the order of their first knots; each starts as its predecessor goes on.
    first_knot : int
        Where the result starts; not before the first plan.

    Raises
    ------
    ValueError
        The plans have no place at ``first_knot`` yet.
    """
    started = [plan for plan in plans if plan.first_knot <= first_knot]
    if not started:
        raise ValueError(f'no plan has started at knot {first_knot}')
    later = [plan for plan in plans if plan.first_knot > first_knot]
    parts, knot, plan = [], first_knot, started[-1]
    for successor in later:
        parts.append(plan.control(knot, successor.first_knot - knot))
        plan, knot = successor, successor.first_knot
    parts.append(plan.control(knot, max(plan.end_knot - knot, 1) + 3))
    heading = started[-1].state(first_knot * plan.step)[2]
    return Plan(first_knot, plan.step, np.concatenate(parts), float(heading), plan.final_heading, plan.reverse)
