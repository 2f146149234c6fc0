"""How far a body falls off its plans where its base turns less sharply than they ask.

Plans keep to their speeds, turn rates and accelerations; how fast their turn rate changes they do not bound. In place
it jumps: to its full value, and back to none when the robot sets out, which the body then does in another direction.
"""
from __future__ import annotations

import numpy as np

from mobile_planning.fleet.base import BaseOptions, SimulatedBase
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.pilot import Pilot
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.world.environment import Boundary

#: By so much the robot turns before it sets out [rad]: which is worst depends on how turns fit into spans.
_TURNS = 0.9, 1.3, 1.8, 2.2, 2.6, 3.1
#: And so is when commands come, as shares of the time between two, before a plan begins.
_PHASES = 0.0, 1 / 3, 2 / 3
#: The body is looked at so often at least [s], whenever its commands come.
_FINE = 0.01


def worst_lag(tracker: Tracker, u_max: tuple[float, float], a_max: tuple[float, float], Tc: float,
              period: float) -> float:
    """Return how far [m] a body comes off its plans where it turns in place and sets out, tried in simulation.

    The base changes its speeds steadily, by the greatest accelerations of the ``tracker``.

    Parameters
    ----------
    tracker : Tracker
    u_max : tuple of float [m/s, rad/s]
        Of the plans.
    a_max : tuple of float [m/s^2, rad/s^2]
        Of the plans.
    Tc : float [s]
        Between two sections.
    period : float [s]
        Between commands.

    Examples
    --------
    >>> sharp, slow = (Tracker(1.2, 6.0, a_max=3.0, alpha_max=alpha) for alpha in (30.0, 15.0))
    >>> [worst_lag(tracker, (1.0, 5.0), (2.0, 10.0), 0.25, 0.05) < 0.015 for tracker in (sharp, slow)]
    [True, False]
    """
    return max(lag(solution, tracker, period, phase) for solution in _set_out(_TURNS, u_max, a_max, Tc)
               for phase in _PHASES)


def lag(solution: Solution, tracker: Tracker, period: float, phase: float = 0.0) -> float:
    """Return the greatest distance [m] of a body from where its plans have it, at any time, if it drives them.

    Parameters
    ----------
    solution : Solution
        Each plan is known from its commit on.
    tracker : Tracker
    period : float [s]
        Between commands.
    phase : float
        By which share of the period the first command comes before the first knot.
    """
    first = solution.plans[0]
    later = list(zip(solution.plans, solution.commits))[1:]
    begin = first.first_knot * first.step
    pilot, base = Pilot(tracker, first), SimulatedBase(first.state(begin)[:3],
                                                       BaseOptions(tracker.a_max, tracker.alpha_max))
    parts = np.linspace(0.0, period, int(np.ceil(period / _FINE)) + 1)
    worst = 0.0
    for now in np.arange(begin - phase * period, solution.end + 0.5, period):
        # With which a process was switched on, a plan has no commit.
        while later and not later[0][1] > now:
            pilot.follow(later.pop(0)[0])
        pilot.localise(base.pose, now)
        command = pilot.command(now, period)
        for passed in parts[1:]:
            base.drive(command, parts[1])
            worst = max(worst, float(np.linalg.norm(base.pose[:2] - pilot.reference(now + passed)[:2])))
    return worst


def _set_out(turns, u_max, a_max, Tc):
    """Return what robots drive that have their goals aside by ``turns`` [rad], as far as they need to get up to speed.

    They share their world, and with it the roadmap that each makes as it starts.
    """
    far = u_max[0] * (u_max[0] / a_max[0] + 4 * Tc)
    world = Boundary((-1.0 - far, 1.0 + 2 * far), (-1.0 - far, 1.0 + far))
    models = [UnicycleKineModel((0, 0, -turn), (far, 0, 0), u_max=u_max, a_max=a_max) for turn in turns]
    robots = [Robot(1, model, [], world, Tc=Tc, Tp=12 * Tc) for model in models]
    for robot in robots:
        robot.start([1], 0.0)
        for cycle in range(1 + int(np.ceil((np.pi / u_max[1] + far / u_max[0]) / Tc))):
            robot.step(cycle * Tc + robot.phase - Tc)
    return [robot.sol for robot in robots]
