"""Track: the motion of one robot as a judge sees it, and the limits that it breaks.

Made from the control points of published plans by scipy; shares no code with the
planner. Times count from the start of the mission, so that a start in seconds
since 1970 costs no digits.
"""
from __future__ import annotations

from fractions import Fraction

import numpy as np
from scipy.interpolate import BSpline

from mobile_planning.geometry import wrap_angle

#: Lengths [m], and jumps of them and of their derivatives, below this are rounding.
TOLERANCE = 1e-6
#: What headings may differ by where they should be equal [rad].
_SAME_HEADING = 1e-3
#: Between two samples [s], and the nearness to the goal that counts as arrived [m, rad].
_STEP = 0.005
_ARRIVED, _TURNED = 0.05, 0.05


class Track:
    """The motion of one robot.

    Parameters
    ----------
    body : Body
        What the robot is held to.
    solution : Solution or None
        None stands for a robot that never left its start.
    start_time : float [s]
        Of the mission, on the fleet's clock.

    Attributes
    ----------
    body : Body
    end : float [s]
        From when on nothing changes.
    """

    def __init__(self, body, solution, start_time):
        self.body, self._plans = body, list(solution.plans) if solution is not None else []
        self._curves = [BSpline(np.arange(len(plan.points) + 4) - 3.0, plan.points, 3) for plan in self._plans]
        self._starts = np.array([float(plan.first_knot * Fraction(plan.step) - Fraction(start_time))
                                 for plan in self._plans])
        self._ends = np.array([start + (len(plan.points) - 3) * plan.step
                               for start, plan in zip(self._starts, self._plans)])
        self.end = max([0.0, *self._ends])

    def at(self, times):
        """Return the position (N, 2) [m] at ``times`` (N,)."""
        if not self._plans:
            return np.tile(self.body.start[:2], (len(times), 1))
        result, which = np.empty((len(times), 2)), self._in_force(times)
        for index in np.unique(which):
            result[which == index] = self._value(index, times[which == index], 0)
        return result

    def speed_bounds(self, times):
        """Return a bound (N,) [m/s] of the speed around ``times`` (N,).

        The greater one of two neighbours, a few milliseconds apart, holds all the time between them.
        """
        if not self._plans:
            return np.zeros(len(times))
        result, which = np.empty(len(times)), self._in_force(times)
        for index in np.unique(which):
            # The velocity is a convex combination of three control points of its own.
            speeds = np.linalg.norm(np.diff(self._plans[index].points, axis=0), axis=1) / self._plans[index].step
            spans = np.lib.stride_tricks.sliding_window_view(speeds, 3).max(axis=1)
            u = self._u(index, times[which == index])
            if self._plans[index].step < _STEP:
                spans[:] = spans.max()
            around = np.clip(np.array([u - 1e-9, u + 1e-9]).astype(int), 0, len(spans) - 1)
            result[which == index] = np.where((u > 0) & (u < len(spans)), spans[around].max(axis=0), 0.0)
        return result

    def _in_force(self, times):
        return np.clip(np.searchsorted(self._starts, times + 1e-9, side='right') - 1, 0, None)

    def _u(self, index, times):
        plan = self._plans[index]
        return np.clip((times - self._starts[index]) / plan.step, 0, len(plan.points) - 3)

    def _value(self, index, times, order):
        """Return the position (N, 2) or a derivative of it by plan ``index`` at ``times`` (N,)."""
        curve = self._curves[index] if order == 0 else self._curves[index].derivative(order)
        return curve(self._u(index, times)) / self._plans[index].step**order

    def arrival(self):
        """Return when the robot came to rest at its goal, infinite if it did not."""
        if not self._plans:
            return np.inf
        goal, end = self.body.goal, self._ends[-1]
        near = np.linalg.norm(self._plans[-1].points[-1] - goal[:2])
        turned = abs(float(wrap_angle(self._heading(-1, end) - goal[2])))
        return max(end, 0.0) if near <= _ARRIVED and turned <= _TURNED else np.inf

    def violations(self):
        """Say where the robot broke its own limits, jumped, or began elsewhere."""
        found = []
        for index, plan in enumerate(self._plans):
            if not index:
                found += self._wrong_start()
            elif self._starts[index] < self._starts[index - 1]:
                found.append(f'robot {self.body.eyed}: plan {index} starts before its predecessor')
            else:
                found += self._jumps(index)
            until = self._starts[index + 1] if index + 1 < len(self._plans) else self._ends[index]
            found += self._limits(index, max(until, self._starts[index]))
        return found

    def _wrong_start(self):
        """Compare the first pose with the one of the mission."""
        body, start = self.body, self._starts[:1]
        place, heading = self._value(0, start, 0)[0], self._heading(0, start[0])
        if np.linalg.norm(place - body.start[:2]) > TOLERANCE:
            return [f'robot {body.eyed} begins at {place}, not at its start {body.start[:2]}']
        if abs(wrap_angle(heading - body.start[2])) > _SAME_HEADING:
            return [f'robot {body.eyed} begins with the heading {heading:.4f} rad, not {body.start[2]:.4f}']
        return []

    def _jumps(self, index):
        """Compare position, velocity, acceleration and heading on both sides of a change of plan."""
        now, who = self._starts[index:index + 1], f'robot {self.body.eyed}'
        for order, what in enumerate(('position', 'velocity', 'acceleration')):
            before, after = (self._value(i, now, order) for i in (index - 1, index))
            if np.abs(before - after).max() > TOLERANCE:
                return [f'{who}: {what} jumps by {np.abs(before - after).max():.2g} at {now[0]:.3f} s']
        turn = abs(float(wrap_angle(self._heading(index, now[0]) - self._heading(index - 1, now[0]))))
        return [f'{who}: heading jumps by {turn:.2g} rad at {now[0]:.3f} s'] if turn > _SAME_HEADING else []

    def _limits(self, index, until):
        """Compare the speed, acceleration and turn rate of plan ``index``, while in force, with the limits."""
        plan, body = self._plans[index], self.body
        spans = float(self._u(index, until))
        even = np.linspace(0, spans, max(2, int(np.ceil(spans * plan.step / _STEP)) + 1))
        times = self._starts[index] + np.union1d(even, np.arange(spans)) * plan.step
        velocity, acceleration = (self._value(index, times, order) for order in (1, 2))
        speed = np.linalg.norm(velocity, axis=1)
        moving = speed > 1e-3
        cross = velocity[:, 0] * acceleration[:, 1] - velocity[:, 1] * acceleration[:, 0]
        turn = np.abs(cross[moving]) / speed[moving]**2
        # Where the robot slows down to turn on the spot, only the change of its heading shows how fast.
        heading = np.arctan2(velocity[moving, 1], velocity[moving, 0])
        sharpest = (np.abs(wrap_angle(np.diff(heading))) - _SAME_HEADING) / np.diff(times[moving]).clip(1e-9)
        in_place = [abs(wrap_angle(after - before)) / ((last - first) * plan.step)
                    for first, last, before, after in self._rests(plan) if first < spans]
        checks = [('speed', speed.max(), body.v_max, 'm/s'),
                  ('acceleration', np.linalg.norm(acceleration, axis=1).max(), body.a_max, 'm/s^2'),
                  ('turn rate', max(turn.max(initial=0.0), sharpest.max(initial=0.0)), body.omega_max, 'rad/s'),
                  ('turn rate in place', max(in_place, default=0.0), body.omega_max, 'rad/s')]
        return [f'robot {body.eyed}: {what} {value:.4f} {unit} exceeds {limit} at the plan of knot {plan.first_knot}'
                for what, value, limit, unit in checks if value > limit * (1 + 1e-6)]

    def _heading(self, index, time):
        """Return the heading [rad] by plan ``index`` at ``time``."""
        plan, u = self._plans[index], float(self._u(index, time))
        for first, last, before, after in self._rests(plan):
            if first - 1e-9 <= u <= last + 1e-9:
                return before + float(wrap_angle(after - before)) * min(max((u - first) / (last - first), 0.0), 1.0)
        velocity = self._value(index, np.array([time]), 1)[0]
        if np.linalg.norm(velocity) < 1e-9:
            ahead = _next_step(plan, int(u))
            velocity = _last_step(plan, int(u)) if ahead is None else ahead
        return float(np.arctan2(velocity[1], velocity[0]))

    @staticmethod
    def _rests(plan):
        """Return the runs of spans at rest: (first, last + 1, heading at the first, heading at the last [rad])."""
        count, rests, span = len(plan.points) - 3, [], 0
        moves = np.diff(plan.points, axis=0).any(axis=1)
        while span < count:
            first = span
            while span < count and not moves[span:span + 3].any():
                span += 1
            if span > first:
                back, ahead = _last_step(plan, first), _next_step(plan, first)
                before = plan.heading if back is None else np.arctan2(back[1], back[0])
                after = plan.final_heading if ahead is None else np.arctan2(ahead[1], ahead[0])
                rests.append((first, span, float(before), float(before if np.isnan(after) else after)))
            span += 1
        return rests


def _next_step(plan, span):
    """Return the next move between control points from ``span`` on, None if there is none."""
    steps = np.diff(plan.points, axis=0)[span:]
    return next((step for step in steps if step.any()), None)


def _last_step(plan, span):
    """Return the last move between control points before ``span``, None if there is none."""
    steps = np.diff(plan.points, axis=0)[:span + 2]
    return next((step for step in steps[::-1] if step.any()), None)
