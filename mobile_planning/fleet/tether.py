"""Tethers: the part of a contract that keeps two robots within a range of each other, be they driving or at rest.

On each span a tether has a *middle* that moves, a cubic Bezier curve with the points m; after the last span it stands
where it ends. Both robots keep their own Bezier points b to a polygon about it, with the outward normals u:

    u . (b_k - m_k) <= c,    c = range / 2 cos(pi / sides)

The polygon lies in the disc of half the range. So at every instant, for the Bernstein weights are not negative and add
up to 1, each robot is within half the range of the middle, and the two are within the range of each other. Like lines,
polygons are convex and linear: what holds of a plan in force and of an answer holds of any mixture of them.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan, bezier

#: Sides of the polygon; their number is even, so that it is its own mirror image.
SIDES = 16
#: Its outward normals (SIDES, 2), and how near they come to the circle, as a share of its radius.
NORMALS = np.column_stack([function(2 * np.pi * np.arange(SIDES) / SIDES) for function in (np.cos, np.sin)])
SHARE = float(np.cos(np.pi / SIDES))
#: Middles are within this [m] of the origin, and ranges are shorter.
_FARTHEST = 1e7


@dataclass(frozen=True, eq=False)
class Tether:
    """One moving middle and the range about it.

    Attributes
    ----------
    reach : float [m]
        The greatest distance of the two robots.
    middles : (L, 4, 2) ndarray [m]
        Bezier points of each span.

    Raises
    ------
    InvalidInput
        A number is not finite or out of its range.
    """

    reach: float
    middles: NDArray[np.float64]

    def __post_init__(self):
        try:
            reach, middles = float(self.reach), np.array(self.middles, dtype=float)
        except (TypeError, ValueError):
            raise InvalidInput(f'a tether has a reach and middles that are numbers, not {self.reach!r}') from None
        if not 0 < reach <= _FARTHEST or middles.ndim != 3 or middles.shape[1:] != (4, 2) or not len(middles):
            raise InvalidInput(f'a tether has a reach in 0..{_FARTHEST:g} m and middles (L, 4, 2), not {reach} and '
                               f'{middles.shape}')
        # Written so that a number that is not finite fails too.
        if not np.abs(middles).max() <= _FARTHEST:
            raise InvalidInput(f'middles must be finite and within {_FARTHEST:g} m')
        middles.flags.writeable = False
        object.__setattr__(self, 'reach', reach)
        object.__setattr__(self, 'middles', middles)

    @property
    def _half(self):
        """How far [m] the polygon's sides are from the middle."""
        return self.reach / 2 * SHARE

    def along(self, span: int, count: int) -> NDArray[np.float64]:
        """Return the middles (count, 4, 2) [m] of ``count`` spans from its ``span`` on, counted from its first."""
        at = np.arange(span, span + count)
        middles = self.middles[np.minimum(at, len(self.middles) - 1)]
        middles[at >= len(self.middles)] = self.middles[-1, 3]
        return middles

    def room(self, plan: Plan, plan_span: int, span: int) -> float:
        """Return how far [m] ``plan`` stays inside the polygon for ever, below 0 if it leaves it.

        Parameters
        ----------
        plan : Plan
        plan_span : int
            From which span of the common time axis on.
        span : int
            Which span of the tether that is.
        """
        count = max(plan.end_knot - plan_span, len(self.middles) - span, 0) + 1
        away = bezier(plan.control(plan_span, count + 3)) - self.along(span, count)
        return self._half - float((away @ NORMALS.T).max())

    def sides(self, span: int, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the polygons of ``count`` spans from ``span`` on as half-planes ``n . b_k >= bound_k``.

        Normals (count * SIDES, 2) and bounds (count * SIDES, 4) [m], span by span.
        """
        normals = np.tile(-NORMALS, (count, 1))
        bounds = np.einsum('jd,skd->sjk', -NORMALS, self.along(span, count)).reshape(-1, 4) - self._half
        return normals, bounds


def between(one: Plan, other: Plan, first_span: int, count: int, reach: float) -> Tether | None:
    """Return the tether midway between two plans; None if they are too far apart.

    Parameters
    ----------
    one, other : Plan
        With the same step, neither beginning after ``first_span``.
    first_span, count : int
        From which span on, and how many, until both are at rest.
    reach : float [m]

    Examples
    --------
    >>> here, there = (Plan.at_rest(0, 0.125, (x, 0.0, 0.0)) for x in (0.0, 3.0))
    >>> between(here, there, 0, 1, 3.5).middles[0, 0].tolist(), between(here, there, 0, 1, 2.9)
    ([1.5, 0.0], None)
    """
    curves = [bezier(plan.control(first_span, count + 3)) for plan in (one, other)]
    tether = Tether(reach, (curves[0] + curves[1]) / 2)
    is_within = (np.abs((curves[0] - curves[1]) @ NORMALS.T) / 2).max() <= tether._half
    return tether if is_within else None
