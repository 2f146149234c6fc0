"""Track: what one robot has published, span by span, as a judge reads it; shares no code with the planner."""
from fractions import Fraction
from math import floor

import numpy as np

from mobile_planning.geometry import wrap_angle

#: Lengths below this [m] are rounding, and headings [rad] below that.
TOLERANCE, SAME_HEADING = 1e-7, 1e-4
#: From this knot on a robot stands at its start, until it is switched on.
_EVER = -2**40
_TO_BEZIER = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6


class Track:
    """All plans of one robot, of which plan 0 is its rest at the start, each with one span more at rest.

    A plan binds from its commit on, and is driven from its first knot on.

    Attributes
    ----------
    faults : list of str
        What is wrong with single plans; from a plan that is none on, the robot counts as silent.
    first, last, low, high : (P, ...) ndarray
        Of each plan the knot from which it is driven, the one from which it rests, and a box around it [m]. Knots
        count from the last one before the mission's start: a start in seconds since 1970 costs no digits.
    commit : (P,) ndarray
        From when on each plan binds, in the same unit.
    is_found : (P,) ndarray of bool
        Whether a process that was started anew begins with the plan, where it has found the body.
    plan, knot, points, curves, turn, theta : (K, ...) ndarray
        Of each span its plan, its knot, its control points and Bezier points (4, 2) [m], how far it turns at rest [rad]
        and the heading at its start [rad].
    velocity, ahead : (K, 3, 2) ndarray [m per span]
        Control points of the velocity; the same without its zeros at the ends of a move, so that its direction is left.
    """

    def __init__(self, body, plans, commits, start_time, step):
        self.body, self.step, self.faults = body, step, []
        start, plans = Fraction(start_time) / Fraction(step), self._sound(plans)
        self._shift = float(start - floor(start))
        controls = [np.tile(body.start[:2], (4, 1)), *(plan.points for plan in plans)]
        sizes = np.array([len(control) - 2 for control in controls])
        self.first = np.array([_EVER, *(plan.first_knot - floor(start) for plan in plans)])
        self.commit = self._binding(commits, floor(start))
        # Of the plans that nobody committed: a process begins with them, where it finds its body.
        self.is_found = np.zeros(len(self.first), bool)
        self.is_found[2:len(commits) + 1] = np.isnan(np.array(commits[1:len(self.first) - 1], float))
        self.last, self._offset = self.first + sizes - 1, np.cumsum(sizes) - sizes
        self.plan = np.repeat(np.arange(len(sizes)), sizes)
        self.knot = self.first[self.plan] + np.arange(len(self.plan)) - self._offset[self.plan]
        self.points = np.concatenate([np.lib.stride_tricks.sliding_window_view(
            np.concatenate([control, control[-1:]]), 4, axis=0) for control in controls]).transpose(0, 2, 1)
        self.curves = _TO_BEZIER @ self.points
        self.low, self.high = (function.reduceat(function.reduce(self.curves, axis=1), self._offset, axis=0)
                               for function in (np.minimum, np.maximum))
        d = np.diff(self.points, axis=1)
        self.velocity = np.stack([(d[:, 0] + d[:, 1]) / 2, d[:, 1], (d[:, 1] + d[:, 2]) / 2], axis=1)
        self.ahead, self._moves = _without_zeros(*self.velocity.transpose(1, 0, 2)), d.any(axis=(1, 2))
        self.theta, self.turn = np.full(len(d), float(body.start[2])), np.zeros(len(d))
        along = np.arctan2(self.ahead[..., 1], self.ahead[..., 0])
        for plan, low, size in zip(plans, self._offset[1:], sizes[1:]):
            self._set_headings(plan, low, low + size - 1, along)

    def _sound(self, plans):
        """Return the plans up to the first that is none."""
        for index, plan in enumerate(plans):
            points, before = np.asarray(plan.points), plans[max(index - 1, 0)]
            if not (points.ndim == 2 and len(points) >= 4 and (np.abs(points) <= 1e6).all() and plan.step == self.step
                    and (points[-3:] == points[-1]).all() and plan.first_knot >= before.first_knot
                    and np.isfinite(plan.heading) and not np.isinf(plan.final_heading)):
                self.faults.append(f'robot {self.body.eyed}: what starts at knot {plan.first_knot} is no plan: those '
                                   f'are finite, end at rest, follow each other and have knots {self.step} s apart')
                return plans[:index]
        return plans

    def _binding(self, commits, zero):
        """Return when each plan binds: once it is committed, and driven at the latest, or its successor binds.

        Before the robot was switched on nothing binds it but its place.
        """
        known = np.full(len(self.first), np.nan)
        commits = np.array(commits[:len(known) - 1], float) / self.step - zero
        known[1:len(commits) + 1] = np.maximum(commits, self.first[1:2])
        return np.minimum.accumulate(np.fmin(known, self.first)[::-1])[::-1]

    def _set_headings(self, plan, span, high, along):
        """Follow the heading through one plan: along the motion or against it, turned evenly at rest."""
        heading, side, low = float(plan.heading), 0.0, span
        while span < high:
            departs = span + int(np.append(self._moves[span:high], True).argmax())
            wanted = heading if np.isnan(plan.final_heading) else float(plan.final_heading)
            if departs < high:
                if departs > span or span == low:
                    is_behind = abs(wrap_angle(along[departs, 0] - heading)) > np.pi / 2 + 1e-9
                    side = np.pi if plan.reverse and is_behind else 0.0
                wanted = along[departs, 0] + side
            if departs > span:
                self.turn[span:departs] = wrap_angle(wanted - heading) / (departs - span)
                self.theta[span:departs] = heading + self.turn[span] * np.arange(departs - span)
            elif abs(wrap_angle(wanted - heading)) > SAME_HEADING:
                self.faults.append(f'robot {self.body.eyed}: heading jumps at {self.time(self.knot[span]):.3f} s')
            self.theta[departs] = wanted
            heading, span = along[departs, 2] + side if departs < high else wanted, departs + 1
        self.theta[high] = heading

    def time(self, knot):
        """Return the time [s] since the start at ``knot``."""
        return (knot - self._shift) * self.step

    def at(self, plans, knots):
        """Return the index of the span of each of ``plans`` that starts at each of ``knots``."""
        return self._offset[plans] + np.clip(knots, self.first[plans], self.last[plans]) - self.first[plans]

    def driven(self, knots):
        """Return which plan is driven from each of ``knots`` on."""
        return np.searchsorted(self.first, knots, side='right') - 1

    def bound(self, moments):
        """Return the last plan that binds at each of ``moments``, in knots: driven as soon as its predecessors let it.
        """
        return np.searchsorted(self.commit, moments, side='right') - 1

    def to_come(self, plans, knots):
        """Return the index of the span from each of ``knots`` on if each of ``plans`` is the last."""
        return self.at(np.minimum(self.driven(knots), plans), knots)

    def boxes(self, first, last):
        """Return corners (N, 2) [m] of boxes around the plans from each of ``first`` to each of ``last``."""
        ranges = np.column_stack([first, last + 1]).ravel()
        return [function.reduceat(np.vstack([corners, corners[-1:]]), ranges, axis=0)[::2]
                for function, corners in ((np.minimum, self.low), (np.maximum, self.high))]

    def places(self, times):
        """Return where the robot is (N, 2) [m] at ``times`` (N,) [s] since the start, by the B-spline's own basis."""
        knots = np.floor(u := times / self.step + self._shift).astype(np.int64)
        s, q = (u - knots)[:, None], self.points[self.at(self.driven(knots), knots)]
        return ((1 - s)**3 * q[:, 0] + (3 * s**3 - 6 * s**2 + 4) * q[:, 1]
                + (3 * (s + s**2 - s**3) + 1) * q[:, 2] + s**3 * q[:, 3]) / 6

    def rests_from(self):
        """Return from when on [s] since the start the robot, as driven, neither moves nor turns."""
        is_active = (self._moves | (self.turn != 0)) & (self.driven(self.knot) == self.plan)
        return max(0.0, float(self.time(self.knot[is_active].max(initial=_EVER) + 1)))


def _without_zeros(p0, p1, p2):
    """Return velocities (K, 2) each divided by the zeros at their ends, s^m and (1 - s)^n, as points (K, 3, 2)."""
    starts, halts, ends = (~p.any(axis=1)[:, None, None] for p in (p0, p1, p2))
    forms = (p1, p1, p1), (p2, p2, p2), (p0, p0, p0), (2 * p1, p1 + p2 / 2, p2), (p0, p0 / 2 + p1, 2 * p1)
    return np.select([starts & ends, starts & halts, halts & ends, starts, ends],
                     [np.stack(form, axis=1) for form in forms], np.stack([p0, p1, p2], axis=1))
