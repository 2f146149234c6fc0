"""Two plans at once: whether they stay apart, or within range of each other, at every instant and for ever."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan, bezier
from mobile_planning.fleet.hulls import reach, unproved

#: Lengths below this [m] are rounding.
_ROUNDING = 1e-9


def stay_apart(p: Plan, q: Plan, knot: int, least: float) -> bool:
    """Return whether it is proved that ``p`` and ``q`` are ``least`` [m] apart from ``knot`` on.

    Examples
    --------
    >>> here, there = (Plan.at_rest(0, 0.1, (x, 0.0, 0.0)) for x in (0.0, 1.0))
    >>> stay_apart(here, there, 3, 1.0), stay_apart(here, there, 3, 1.1)
    (True, False)
    """
    need = least - _ROUNDING
    return not len(unproved(_relative(p, q, knot), lambda pieces: (
        reach(pieces) - need, np.linalg.norm(pieces[:, [0, -1]], axis=2).min(axis=1) - need)))


def stay_within(p: Plan, q: Plan, knot: int, most: float) -> bool:
    """Return whether it is proved that ``p`` and ``q`` are no more than ``most`` [m] apart from ``knot`` on."""
    need = most + _ROUNDING
    return not len(unproved(_relative(p, q, knot), lambda pieces: (
        need - np.linalg.norm(pieces, axis=2).max(axis=1),
        need - np.linalg.norm(pieces[:, [0, -1]], axis=2).max(axis=1))))


def begin_within(p: Plan, q: Plan, knot: int, most: float) -> bool:
    """Return whether ``p`` and ``q`` are no more than ``most`` [m] apart at ``knot``, or where the later begins.

    Where that holds of two plans that `stay_within`, it holds of all that goes on from them.
    """
    return bool(np.linalg.norm(_relative(p, q, knot)[0, 0]) <= most + _ROUNDING)


def _relative(p, q, knot) -> NDArray[np.float64]:
    """Return the Bezier points (S, 4, 2) [m] of ``p`` as seen from ``q``, until both are at rest."""
    first = max(knot, p.first_knot, q.first_knot)
    count = max(p.end_knot, q.end_knot, first) - first + 1
    return bezier(p.control(first, count + 3) - q.control(first, count + 3))
