"""HorizonMotion: the sections that a robot drives by the receding horizon, and how another one comes into force.

That is what all who count have granted, or, where the plan in force leads into what is occupied by now, a brake.
"""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan, splice
from mobile_planning.fleet.emergency import braked
from mobile_planning.fleet.exchange import Exchange, Peer, gap
from mobile_planning.fleet.horizon_options import HorizonOptions
from mobile_planning.fleet.horizon_section import Start
from mobile_planning.fleet.plan_record import PlanRecord
from mobile_planning.fleet.section import Limits

#: A commit this near to its first knot [s] comes too late.
_GUARD = 0.005
#: To plan how to brake [s].
_BUDGET = 0.03


class HorizonMotion:
    """What one robot drives by.

    Parameters
    ----------
    first : Plan
        With which it is switched on.
    exchange : Exchange
    options : HorizonOptions
    limits : Limits

    Attributes
    ----------
    record : PlanRecord
    target : int or None
        First knot of the newest section.
    is_last : bool
        Whether that is the last one.
    is_blocked : bool
        The plan in force leads into what is occupied by now.
    broken : tuple of int
        The robots that a brake in force is not clear of.
    """

    def __init__(self, first: Plan, exchange: Exchange, options: HorizonOptions, limits: Limits):
        self.record, self.target, self.is_last = PlanRecord(first), None, False
        self.is_blocked, self.broken = False, ()
        self._has_braked = False
        self._exchange, self._limits, self._step, self._far = exchange, limits, first.step, options.far(limits)

    def plan(self, now: float, *later: Plan) -> Plan:
        """Return the plan in force from the knot that is driven at ``now`` [s] on, and what may come ``later``."""
        knot = int(np.floor(now / self._step + 1e-9))
        plans = [*self.record.since(knot), *later]
        return splice(plans, max(knot, plans[0].first_knot))

    def start(self, first: int, elapsed: float) -> Start:
        """Return what a section goes on from that begins at the knot ``first``, ``elapsed`` [s] into the mission."""
        plan = self.record.at(first)
        return Start(plan.control(max(first, plan.first_knot), 3), self.record.heading(first), max(0.0, elapsed))

    def is_in_time(self, first: int, now: float) -> bool:
        """Return whether what begins at the knot ``first`` can still come into force at ``now`` [s]."""
        return now <= first * self._step - _GUARD

    def is_open(self, first: int, now: float) -> bool:
        """Return whether a section that begins at the knot ``first`` may be proposed at ``now`` [s]."""
        return self.target != first and self.is_in_time(first, now)

    def drop_what_is_late(self, now: float) -> None:
        """Have no candidate that begins too soon after ``now`` [s]."""
        candidate = self._exchange.candidate
        if candidate is not None and not self.is_in_time(candidate.plan.first_knot, now):
            self.record.late += 1
            self._exchange.drop()

    def settle(self, now: float) -> None:
        """Put the candidate in force at ``now`` [s], if all that count have granted it."""
        candidate = self._exchange.candidate
        if candidate is None or not self.is_in_time(candidate.plan.first_knot, now):
            return
        here = self.record.state(now)[:2]
        plan = self._exchange.take(now, lambda peer: self._is_far(peer, here, now))
        if plan is not None:
            self.record.add(plan, now)
            self.is_blocked, self.broken = False, ()
            self.target, self.is_last = plan.first_knot, bool(np.isfinite(plan.final_heading))

    def _is_far(self, peer: Peer, here: NDArray, now: float) -> bool:
        return gap(here, peer, now) > self._far

    # How it brakes

    def enter(self, is_free: Callable[[Plan], bool], now: float) -> None:
        """Notice that another world, in which a plan may be free or not, takes the place of the old one."""
        self.is_blocked, self._has_braked = not is_free(self.plan(now)), False
        self.is_last &= not self.is_blocked

    @property
    def must_brake(self) -> bool:
        """Whether the robot is to brake, and has not yet."""
        return self.is_blocked and not self._has_braked

    def braked(self, now: float) -> Plan | None:
        """Return the plan that brakes as soon as that can come into force; None for none, see `emergency`."""
        knot = max(int(np.ceil((now + _BUDGET) / self._step)), self.record.newest.first_knot)
        return braked(self.plan(now), knot, self.record.heading(knot), self._limits)

    def brake(self, plan: Plan, is_free: Callable[[Plan], bool], now: float) -> None:
        """Put ``plan`` in force, if that is not too late, though nobody has granted it."""
        if not self.is_in_time(plan.first_knot, now):
            return
        self.broken = self._exchange.impose(plan)
        self.record.add(plan, now)
        self._has_braked, self.is_blocked = True, not is_free(self.plan(now))
