"""Emergency: the plan by which a robot brakes as hard as it can, whatever comes after."""
from __future__ import annotations

import numpy as np

from mobile_planning.fleet import fences
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.horizon import rest_index
from mobile_planning.fleet.section import Limits, SectionProblem, shorten

#: Spans beside those in which a robot at full speed comes to rest.
_SPARE = 6


def braked(plan: Plan, knot: int, heading: float, limits: Limits) -> Plan | None:
    """Return the plan that goes on from ``plan`` at ``knot`` and comes to rest as soon as the limits allow.

    Parameters
    ----------
    plan : Plan
        In force.
    knot : int
    heading : float [rad]
        At ``knot``.
    limits : Limits

    Returns
    -------
    Plan or None
        None where the robot rests from ``knot`` on, or no sooner end is proved to keep to the limits.

    Examples
    --------
    >>> x = np.cumsum([0, 0, 0, 0.03, 0.06, 0.09, 0.12, 0.12, 0.12, 0.12, 0.12, 0.12, 0.09, 0.06, 0.03, 0, 0])
    >>> way, limits = Plan(0, 0.125, np.column_stack([x, 0 * x])), Limits(1.0, 2.0, 5.0, 0.2)
    >>> round(braked(way, 6, 0.0, limits).end[0], 2), round(way.end[0], 2)
    (np.float64(0.73), np.float64(1.08))
    >>> braked(way, 14, 0.0, limits) is None
    True
    """
    step, spans = plan.step, int(np.ceil(limits.v_max / limits.a_max / plan.step)) + _SPARE
    old = plan.control(knot, max(spans, plan.end_knot - knot) + 3)
    if not np.ptp(old, axis=0).any():
        return None
    if not np.ptp(old[:3], axis=0).any():
        return Plan(knot, step, np.repeat(old[:1], 4, axis=0), heading)
    velocity = (old[2] - old[0]) / (2 * step)
    stop = (old[0] + 4 * old[1] + old[2]) / 6 + velocity * np.linalg.norm(velocity) / (2 * limits.a_max)
    problem = SectionProblem(limits, step, len(old) - 3)
    new = problem.solve(old, np.repeat([stop], problem.spans, axis=0), fences.NONE)
    new = old if new is None else shorten(old, new, fences.NONE, limits, step)
    return None if new is old else Plan(knot, step, new[:max(rest_index(new) + 3, 4)], heading)
