"""KnownPart: the part of a mission that is known of all robots, where the oldest plans of some were left out.

A robot keeps the plans of half an hour, and one that was started anew without a logbook knows nothing of its life
before. What came earlier was proved message by message while they drove, see `Watch`, and is not judged again.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mobile_planning.fleet.bspline import splice
from mobile_planning.fleet.report import Body, Report
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import verify, visited
from mobile_planning.world.environment import Environment


@dataclass(frozen=True)
class KnownPart:
    """What the judge is given of a mission.

    Attributes
    ----------
    solutions : dict of int to Solution
    bodies : list of Body
        As they were where the known part begins, held to the goals that are left.
    start : float [s]
        Of the known part, on the clock of the fleet.
    reached : int
        Goals that all robots had reached before and are not held to again.
    """

    solutions: dict[int, Solution]
    bodies: list[Body]
    start: float
    reached: int

    @classmethod
    def of(cls, solutions: Mapping[int, Solution], bodies: Sequence[Body], start: float) -> KnownPart:
        """Return the known part of a mission that began at ``start`` [s]; all of it, as a rule."""
        begins = [(plan.first_knot, plan.step) for plan in (each.plans[0] for each in solutions.values())]
        late = [knot for knot, step in begins if knot * step > start + step]
        if not late:
            return cls(dict(solutions), list(bodies), start, 0)
        knot, step = max(late), begins[0][1]
        parts = [_part(body, solutions.get(body.eyed), knot) for body in bodies]
        return cls({solution.eyed: solution for solution, _, _ in parts if solution is not None},
                   [body for _, body, _ in parts], knot * step, sum(reached for _, _, reached in parts))

    def report(self, environment: Environment, start: float, name: str) -> Report:
        """Return the report on the mission that began at ``start`` [s]."""
        report = verify(self.solutions, self.bodies, environment, self.start, name)
        since = self.start - start
        if since <= 0.0:
            return report
        arrivals, end = report.arrivals + self.reached, report.mission_time + since
        return replace(report, judged_since=since, mission_time=end, arrivals=arrivals,
                       goals=report.goals + self.reached,
                       throughput=60.0 * arrivals / end if arrivals and end > 0.0 else None)


def _part(body, solution, knot):
    """Return what one robot drives from a knot on, what it is held to then, and how many goals it had reached."""
    if solution is None:
        return None, body, 0
    goals = body.goals[min(solution.reached_before, len(body.goals) - 1):]
    step, plans, commits = solution.plans[0].step, solution.plans, solution.commits
    at = max((index for index, plan in enumerate(plans) if plan.first_knot <= knot), default=0)
    first = splice([plans[at]], max(knot, plans[at].first_knot))
    begin = plans[0].first_knot * step
    pose = np.array(plans[0].state(begin)[:3])
    held = replace(body, start=pose, goal=goals[-1], via=goals[:-1], is_under_way=True)
    reached = visited(replace(solution, goals=()), held, begin, until=knot * step)
    left = goals[reached:]
    now = replace(held, start=np.array(first.state(first.first_knot * step)[:3]), goal=goals[-1], via=left[:-1],
                  is_under_way=True)
    # Who had reached all its goals is held to the last one still.
    return (replace(solution, plans=(first, *plans[at + 1:]), commits=(np.nan, *commits[at + 1:])), now,
            solution.reached_before + min(reached, len(goals) - 1))
