"""Account: what is known of a mission when it has ended, and the report that comes of it."""
from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mobile_planning.fleet.known_part import KnownPart
from mobile_planning.fleet.makespan import lower_bound
from mobile_planning.fleet.message import Death, RobotMsg
from mobile_planning.fleet.postscript import Postscript
from mobile_planning.fleet.report import Body, Report
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.waiting import Waiter, why_they_wait
from mobile_planning.world.environment import Environment

#: A body is found so near [m] to where its scene says that it starts: real ones are never there to the millimetre.
_FOUND = 0.5


@dataclass(frozen=True, eq=False)
class Account:
    """What is known of a mission.

    Attributes
    ----------
    name : str
    start_time : float [s]
        On the common clock.
    why : str
        Why it ended.
    is_complete : bool
        Whether all robots said that they are at their goals.
    was_started : bool
        Whether the robots were ever told to drive.
    heard : mapping of int to RobotMsg
        The newest message of each robot.
    silent : collection of int
        The robots that were not heard any more when it ended.
    last : sequence of (RobotMsg, Postscript)
        What each living robot that had not arrived said last before it ended.
    solutions : mapping of int to Solution
    deaths : mapping of int to Death
    left_out : sequence of str
        Who was left out, and why.
    """

    name: str
    start_time: float
    why: str
    is_complete: bool
    was_started: bool
    heard: Mapping[int, RobotMsg]
    silent: Collection[int]
    last: Sequence[tuple[RobotMsg, Postscript]]
    solutions: Mapping[int, Solution]
    deaths: Mapping[int, Death]
    left_out: Sequence[str]

    def report(self, bodies: Sequence[Body], environment: Environment) -> Report:
        """Return what the mission came to; why it ended is a violation too, unless it is complete."""
        # By what each robot was told since, where that is not the scene.
        bodies = [self._told_to(body) for body in bodies]
        unknown = {robot_id for robot_id, message in self.heard.items()
                   if robot_id not in self.solutions and message.plan_seq and self.was_started}
        judged = [body for body in bodies if body.eyed not in unknown]
        known = KnownPart.of(self.solutions, judged, self.start_time)
        report = known.report(environment, self.start_time, self.name)
        dead = set(self.deaths) | (unknown & set(self.silent))
        never_said = [f'robot {robot_id} has driven and never said what' for robot_id in sorted(unknown)]
        violations = [*report.violations, *self.left_out, *never_said]
        ended = max((solution.end for solution in self.solutions.values()), default=self.start_time) - self.start_time
        waiting = why_they_wait(self._waiters(report.at_goal), self._bodies_of_the_dead(), environment, ended)
        report = replace(report, robots=len(bodies), dead=len(dead), violations=violations, waiting=waiting,
                         lower_bound=lower_bound(bodies, environment))
        if self.is_complete:
            return replace(report, valid=report.valid and not unknown)
        return replace(report, valid=False, violations=[*violations, f'the mission ended: {self.why}'])

    def _told_to(self, body):
        """Return a body that starts where it was found, and is held to the goals that its robot says it was given."""
        solution = self.solutions.get(body.eyed)
        if solution is None:
            return body
        first, goals = solution.plans[0], solution.goals or body.goals
        found = first.state(first.first_knot * first.step)[:3]
        is_near = np.linalg.norm(found[:2] - body.start[:2]) <= _FOUND and not np.ptp(first.points, axis=0).any()
        return replace(body, start=found if is_near else body.start, goal=goals[-1], via=goals[:-1])

    def _waiters(self, at_goal):
        """Return the living robots that are not judged to be at their goals, as they told of themselves."""
        return [Waiter(message.robot_id, message.mode.name.lower(), message.lz, message.goal, message.radius,
                       message.v_max, message.links, told.without_word_of, told.held_up,
                       self.solutions.get(message.robot_id), self.start_time)
                for message, told in self.last if message.robot_id not in at_goal]

    def _bodies_of_the_dead(self):
        """Return where the bodies of the dead and of the silent rest, and their radii, by robot id."""
        certified = {robot_id: (death.place, death.radius) for robot_id, death in self.deaths.items()}
        return {**{robot_id: (message.plan.end, message.radius) for robot_id, message in self.heard.items()
                   if robot_id in self.silent}, **certified}
