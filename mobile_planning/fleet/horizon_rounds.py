"""Rounds: what a robot intends in each round of the exchange before a section begins.

First alone; then, where that is not clear of what others drive or intend, among all; then among seniors.
"""
from __future__ import annotations

from time import thread_time

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet import plan_pairs
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.exchange import Exchange
from mobile_planning.fleet.horizon_blocks import Collision, Communication
from mobile_planning.fleet.horizon_options import HorizonOptions
from mobile_planning.fleet.horizon_section import Kind, Start
from mobile_planning.fleet.intention import Intention
from mobile_planning.fleet.proved_sections import ProvedSections, path_of
from mobile_planning.fleet.section import Limits

#: Rounds of the exchange in the time of one section: alone, among all, among seniors, and the last word.
ROUNDS = 4


class Rounds:
    """Plans one robot's intentions, and judges those of others.

    Parameters
    ----------
    options : HorizonOptions
    limits : Limits
    neigh : tuple of int
        Peers to stay in range of, from when they are in range on, as long as they live.

    Attributes
    ----------
    sections : ProvedSections
        To the goal, in the world as it is.
    exchange : Exchange
        With what the others drive and intend.
    options : HorizonOptions
    now : float [s]
        Plans are judged from then on.
    """

    sections: ProvedSections
    exchange: Exchange

    def __init__(self, options: HorizonOptions, limits: Limits, neigh: tuple[int, ...]):
        self.options, self.now = options, 0.0
        self._limits, self._neigh = limits, neigh

    def due(self, now: float) -> tuple[int, int]:
        """Return the first knot of the next section, and which round of its exchange it is at ``now`` [s]."""
        passed = now / self.options.Tc + 1e-9
        section = int(np.floor(passed))
        return (section + 1) * self.options.knots, min(int((passed - section) * ROUNDS), ROUNDS - 1)

    def intention(self, kind: Kind, start: Start, place: NDArray, first: int, number: int) -> Intention:
        """Return what the robot intends for the section that begins at the knot ``first``, in the round ``number``.

        Parameters
        ----------
        kind : Kind
        start : Start
        place : (2,) ndarray [m]
            Where it is now.
        first, number : int
        """
        began = thread_time()
        found, plan, withdraws = self._planned(kind, start, place, first, number)
        return Intention(first, number, plan, withdraws, kind, thread_time() - began, found)

    def _planned(self, kind, start, place, first, number):
        """Return outcome, plan and whether to withdraw the candidate."""
        candidate, options = self.exchange.candidate, self.options
        if candidate is not None and candidate.plan.first_knot != first:
            candidate = None                                        # of a section that was missed

        def find(blocks, duration, heeded):
            return self.sections.find(kind, first, start, place, blocks, duration,
                                      lambda plan: self._is_clear(plan, heeded))
        if number == 0 or candidate is None and number == 1:
            return *find([], options.Tp, ()), True
        allowed = list(self.exchange.allowed())
        heeded = allowed + [(other, plan) for other, plan in self.exchange.requests()
                            if number == 1 or self.exchange.is_senior(other)]
        if candidate is not None and self._is_clear(candidate.plan, heeded):
            return None, None, False
        blocks = self._blocks(start.points[1], first, heeded)
        if number == 1:
            # What others intend they may plan again, so that only what they may drive already must be clear.
            blocks.append(Communication(path_of(candidate.plan, first * options.step), options.def_epsilon))
            return *find(blocks, options.Td, allowed), False
        return *find(blocks, options.Td, heeded), True

    def _blocks(self, here, first, heeded):
        """Return the blocks of collision and communication for the plans ``heeded``, as far as they may matter."""
        blocks, options = [], self.options
        for other, plan in heeded:
            path = path_of(plan, first * options.step)
            away = float(np.linalg.norm(path(np.zeros(1))[0][0] - here))
            need, moves = self._need(other), np.ptp(plan.points, axis=0).any()
            if away <= need + (2 if moves else 1) * self._limits.v_max * options.Tp:
                blocks.append(Collision(path, min(need + options.safe_epsilon, max(need, away - 1e-3))))
            might_part = away + 2 * self._limits.v_max * options.Tp >= options.com_range
            if self._is_company(other) and might_part and away <= options.com_range:
                blocks.append(Communication(path, options.com_range - options.safe_epsilon))
        return blocks

    def _need(self, other):
        return self._limits.radius + self.exchange.peers[other].radius

    def _is_clear(self, plan, others):
        return all(self.are_clear(plan, other, theirs) for other, theirs in others)

    def are_clear(self, own: Plan, other: int, theirs: Plan) -> bool:
        """Return whether two plans keep apart, and neighbours in range within it, from now on and for ever."""
        knot = int(np.floor(self.now / self.options.step + 1e-9))
        if not plan_pairs.stay_apart(own, theirs, knot, self._need(other)):
            return False
        reach = self.options.com_range
        return (not self._is_company(other) or not plan_pairs.begin_within(own, theirs, knot, reach)
                or plan_pairs.stay_within(own, theirs, knot, reach))

    def _is_company(self, other):
        """Return whether to stay in range of ``other``, once there: who counts as dead follows nobody."""
        return other in self._neigh and not self.exchange.is_silent(other, self.now)
