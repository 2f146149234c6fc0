"""Solution: everything one robot has driven, as the plans it published."""
from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan


@dataclass(frozen=True)
class Solution:
    """The plans a robot has committed, each driven from its first knot to the next one's.

    Attributes
    ----------
    eyed : int
        The robot's id.
    plans : tuple of Plan
        In order; the first starts where the robot was switched on.
    done : bool
        The robot says that it is at its goal and at rest.
    section_times : tuple of float [s]
        To plan each section.
    commits : tuple of float [s]
        When each plan was committed, on the fleet's clock: from then on it binds, before it is driven. NaN for the one
        with which the robot was switched on; that, and what is left out at the end, is taken for the first knot.
    goals : tuple of (3,) ndarray [m, m, rad]
        That the robot was given in place of those of its scene, in order; empty for those of the scene.
    reached_before : int
        How many of its goals the robot had reached before the first of ``plans``, where older ones were left out.
    sample : float [s]
        Greatest time between samples.
    start_time : float [s] or None
        When the mission started, on the fleet's clock, from which ``t`` counts; None for the first knot, when the robot
        was switched on. The plans keep the knots of the fleet's clock.
    """

    eyed: int
    plans: tuple[Plan, ...]
    done: bool = False
    section_times: tuple[float, ...] = ()
    commits: tuple[float, ...] = field(default=(), kw_only=True)
    goals: tuple[NDArray[np.float64], ...] = field(default=(), kw_only=True)
    reached_before: int = field(default=0, kw_only=True)
    sample: float = field(default=0.01, kw_only=True)
    start_time: float | None = field(default=None, kw_only=True)

    @property
    def end(self) -> float:
        """Time [s], on the fleet's clock, from which the robot stands still."""
        return self.plans[-1].end_knot * self.plans[-1].step

    def states(self, times: NDArray) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (N, 5) at increasing ``times`` (N,) [s] of the fleet's clock."""
        starts = [plan.first_knot * plan.step for plan in self.plans]
        bounds = [0, *np.searchsorted(times, starts[1:]), len(times)]
        return np.concatenate([plan.states(times[low:high])
                               for plan, low, high in zip(self.plans, bounds, bounds[1:])])

    @cached_property
    def t(self) -> NDArray[np.float64]:
        """Sample times (N,) [s], from 0, the start of the mission, to the end; never more than ``sample`` apart."""
        duration = max(self.end - self._start, 0.0)
        return np.linspace(0.0, duration, int(np.ceil(duration / self.sample)) + 1)

    @property
    def _start(self):
        return self.plans[0].first_knot * self.plans[0].step if self.start_time is None else self.start_time

    @cached_property
    def _samples(self):
        return self.states(self._start + self.t)

    @property
    def x(self) -> NDArray[np.float64]:
        """The robot's x (N,) [m] at ``t``."""
        return self._samples[:, 0]

    @property
    def y(self) -> NDArray[np.float64]:
        """The robot's y (N,) [m] at ``t``."""
        return self._samples[:, 1]

    @property
    def theta(self) -> NDArray[np.float64]:
        """The robot's heading (N,) [rad] at ``t``."""
        return self._samples[:, 2]

    @property
    def v(self) -> NDArray[np.float64]:
        """The robot's speed (N,) [m/s] at ``t``."""
        return self._samples[:, 3]

    @property
    def omega(self) -> NDArray[np.float64]:
        """The robot's turn rate (N,) [rad/s] at ``t``."""
        return self._samples[:, 4]
