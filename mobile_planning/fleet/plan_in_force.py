"""PlanInForce: a robot's plan as its contracts see it: which ones it satisfies, and which can be offered from it."""
from __future__ import annotations

from math import floor

import numpy as np
from numpy.typing import ArrayLike

from mobile_planning.fleet import fences
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contract_options import KNOTS
from mobile_planning.fleet.contracts import ROUNDING, Contract, build, room
from mobile_planning.fleet.message import RobotMsg

#: A contract is renewed once a plan comes nearer to its line than what is driven in this time [s].
_AMPLE = 1.5


class PlanInForce:
    """The plan that a robot drives by, as `protocol.Geometry` is asked of it.

    Parameters
    ----------
    plan : Plan
    radius : float [m]
        Of the body, with its margin.

    Attributes
    ----------
    plan : Plan
        From the knot of the last commit on.
    now : float [s]
        From when on it is asked about.
    """

    def __init__(self, plan: Plan, radius: float):
        self.plan, self.now = plan, plan.first_knot * plan.step
        self._radius = radius

    @property
    def span(self) -> int:
        """The span that is being driven."""
        return max(floor(self.now / self.plan.step), self.plan.first_knot)

    def accepts(self, contract: Contract, is_owner: bool) -> bool:
        """Return whether the plan satisfies ``contract`` from now on."""
        # One that begins later than clocks may differ would forbid every commit until then.
        is_begun = contract.first_span <= self.span + KNOTS
        return is_begun and room(contract, self.plan, self.span, is_owner, self._radius) >= -ROUNDING

    def clear_of(self, place: ArrayLike, radius: float) -> bool:
        """Return whether the whole plan stays the own radius and ``radius`` [m] from ``place`` (2,) [m]."""
        curves = self.plan.curves(self.span)
        fence = fences.of_discs([(np.asarray(place, float), radius)], curves, self._radius)
        return bool(fence.room(curves).min() >= -ROUNDING)

    def is_ample(self, contract: Contract, heard: RobotMsg) -> bool:
        """Return whether both the plan and the one ``heard`` leave so much room that a fresher contract can wait."""
        enough, span = _AMPLE * heard.v_max, self.span
        if contract.first_span > span or room(contract, self.plan, span, True, self._radius) < enough:
            return False
        return room(contract, heard.plan, max(span, heard.plan.first_knot), False, heard.radius) >= enough

    def offer(self, contract_id: int, heard: RobotMsg, reach: float = np.inf) -> Contract | None:
        """Return a contract between the plan and the one ``heard``; None if there is none that the plan satisfies.

        It keeps the two within ``reach`` [m] of each other.
        """
        if heard.plan is None or heard.plan.step != self.plan.step:
            return None
        contract = build(contract_id, self.plan, heard.plan, max(self.span, heard.plan.first_knot),
                         self._radius, heard.radius, reach)
        return contract if contract is not None and self.accepts(contract, True) else None
