"""Pilot: drives one body along the plans that its robot has committed, whatever becomes of the planner.

Others count on a committed plan: they may be on their way to where this body is now. So a pilot that loses its pose
does not stop where it stands, but drives on by what it has commanded, as long as that is sure to stay within the
margin of the proof. No clock, no thread and no I/O.
"""
from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.tracking import Tracker, driven
from mobile_planning.geometry import wrap_angle

#: Plans beside the newest that may still be driven, and commands that are remembered.
_PLANS, _COMMANDS = 4, 256
#: The greatest error of so long [s], and of as long before, is kept.
_WINDOW = 2.0


@dataclass(frozen=True)
class PilotStatus:
    """How a body keeps to its plan.

    Attributes
    ----------
    tracking_error : float [m]
        Greatest distance, lately, from the pose as measured to the plan at the same time.
    localisation_error : float [m]
        Of the newest pose, as it says of itself; NaN for unknown.
    drift : float [m]
        By how much the body may be elsewhere than thought, since the newest pose.
    pose_age : float [s]
        Infinite before the first pose.
    is_tracking : bool
        Whether the body follows the plan; it stands where nobody knows where it is.
    """

    tracking_error: float = 0.0
    localisation_error: float = np.nan
    drift: float = 0.0
    pose_age: float = np.inf
    is_tracking: bool = False


class Pilot:
    """The follower of one robot's plans.

    `follow` and `localise` may be called in other threads than `command`: each hands over one whole value.

    Parameters
    ----------
    tracker : Tracker
    plan : Plan
        In force.
    drift_rate : float
        By which share of the way a body that drives by its commands alone may be elsewhere.
    most_drift : float [m]
        Beyond it the body stops.

    Attributes
    ----------
    status : PilotStatus
        As of the newest command.

    Raises
    ------
    InvalidInput
        A number is not positive.

    Examples
    --------
    >>> plan = Plan(0, 0.5, [(0, 0), (0, 0), (0.1, 0), (0.4, 0), (0.5, 0), (0.5, 0), (0.5, 0)])
    >>> pilot = Pilot(Tracker(1.2, 5.0), plan)
    >>> pilot.command(0.75, 0.02).tolist()
    [0.0, 0.0]
    >>> pilot.localise(plan.state(0.75)[:3], 0.75)
    >>> bool(abs(pilot.command(0.75, 0.02)[0] - plan.state(0.76)[3]) < 1e-3)
    True
    """

    def __init__(self, tracker: Tracker, plan: Plan, *, drift_rate: float = 0.05, most_drift: float = 0.05):
        if not (0 < drift_rate < np.inf and 0 < most_drift < np.inf):
            raise InvalidInput(f'drift_rate {drift_rate} and most_drift {most_drift} m must be positive and finite')
        self.status = PilotStatus()
        self._tracker, self._drift_rate, self._most_drift = tracker, drift_rate, most_drift
        self._plans: tuple[Plan, ...] = (plan,)
        self._fix: tuple[NDArray[np.float64], float, float] | None = None
        self._commands: deque[tuple[float, NDArray[np.float64]]] = deque(maxlen=_COMMANDS)
        self._worst = _Worst()

    def follow(self, plan: Plan) -> None:
        """Drive ``plan`` from its first knot on."""
        self._plans = (*self._plans, plan)[-_PLANS:]

    def localise(self, pose: ArrayLike, time: float, error: float = np.nan) -> None:
        """Take in where the body was at ``time`` [s]; an older pose than the newest is passed over.

        Parameters
        ----------
        pose : (3,) array_like [m, m, rad]
        time : float [s]
        error : float [m]
            By which the place may be wrong; NaN for unknown.
        """
        if self._fix is not None and time <= self._fix[1]:
            return
        pose = np.array(pose, float)
        x, y, *_ = self.reference(time)
        self._worst.note(float(np.hypot(pose[0] - x, pose[1] - y)), time)
        self._fix = pose, time, error

    def reset(self) -> None:
        """Forget all poses: the clock was set back."""
        self._fix, self._worst = None, _Worst()
        self._commands.clear()

    def reference(self, time: float) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (5,) at ``time`` [s] by the plans."""
        return self._references(time)[0]

    def _references(self, *times):
        """Return the states (N, 5) at ``times`` [s] by the plans."""
        plans = self._plans
        at = [next((plan for plan in reversed(plans) if plan.first_knot * plan.step <= time), plans[0])
              for time in times]
        if all(plan is at[0] for plan in at):
            return at[0].states(np.array(times))
        return np.stack([plan.state(time) for plan, time in zip(at, times)])

    def command(self, now: float, period: float) -> NDArray[np.float64]:
        """Return the speeds (v, omega) [m/s, rad/s] from ``now`` [s] on, for about ``period`` [s]."""
        fix, command = self._fix, np.zeros(2)
        if fix is None:
            self.status = PilotStatus()
            return command
        pose, way = self._reckoned(fix, now)
        drift = self._drift_rate * way
        is_tracking = drift <= self._most_drift
        if is_tracking:
            # What is commanded now holds for the whole period: the speeds are those in its middle.
            command = self._tracker.command(self._wanted(now, now + period / 2), pose)
        command = self._tracker.eased(command, self._commands[-1][1] if self._commands else np.zeros(2), period)
        self._commands.append((now, command))
        self.status = PilotStatus(self._worst.error, fix[2], drift, now - fix[1], is_tracking)
        return command

    def _wanted(self, now, middle):
        """Return x, y, theta at ``now`` [s] by the plans, and v and omega (5,) in the ``middle`` [s] of the period.

        Plans begin and end to turn at once. A drive that begins as much earlier as it ends later has turned as far:
        so the turn rate is that of the drive's window.
        """
        window = self._tracker.window
        here, there, before, after = self._references(now, middle, middle - window / 2, middle + window / 2)
        here[3] = there[3]
        here[4] = wrap_angle(after[2] - before[2]) / window if window else there[4]
        return here

    def _reckoned(self, fix, now):
        """Return the pose at ``now`` by what was commanded since the fix, and the length of that way [m]."""
        pose, since, _ = fix
        pose = pose.tolist()
        parts, end, way = [], now, 0.0
        for begin, command in reversed(self._commands):
            parts.append((command, end - max(begin, since)))
            end = begin
            if begin <= since:
                break
        for command, duration in reversed(parts):
            if duration > 0.0:
                pose = driven(pose, command.tolist(), duration)
                way += abs(float(command[0])) * duration
        return pose, way


class _Worst:
    """The greatest of the errors of the last seconds."""

    def __init__(self):
        self._since, self._before, self._now = -np.inf, 0.0, 0.0

    @property
    def error(self):
        return max(self._before, self._now)

    def note(self, error, time):
        if time - self._since > _WINDOW:
            self._since, self._before, self._now = time, self._now, 0.0
        self._now = max(self._now, error)
