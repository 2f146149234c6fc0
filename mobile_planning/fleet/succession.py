"""Succession: what a robot's process takes over from the one before it, and leaves to the next."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from mobile_planning.fleet.journey import Journey
from mobile_planning.fleet.logbook import Entry, Logbook
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.solution import Solution

#: Starts of missions that are told apart by less [s] are those of one.
_ONE = 1e-3
#: A body that is found so near [m] to where its last plan ended has not been moved.
SAME_PLACE = 0.05


class Succession:
    """Hands each plan on to the body and to the logbook, and goes on with what the logbook holds.

    Parameters
    ----------
    book : Logbook
        Of the robot; what the processes before have written into it is gone on from.
    drive : callable
        Called with each plan that is put in force, before anybody is told of it.
    plans_kept : int
        So many of its newest plans are there for the judge.

    Attributes
    ----------
    is_where_left : bool
        Whether the body was found where the process before has left it; False where there was none.
    """

    def __init__(self, book: Logbook, drive: Callable[[Entry], None], plans_kept: int):
        self._book, self._drive, self._plans_kept = book, drive, plans_kept
        self._past, self._stages = book.read(), book.stages()
        self._driven = self._written = None
        self.is_where_left = False

    def hand_over(self, robot: Robot, epoch: int) -> None:
        """Let the plan in force be driven, if it is new."""
        robot.forget(self._plans_kept)
        solution = robot.sol
        if self._driven is None and self._past:
            found, left = solution.plans[0].points[0], self._past[-1].plan.end
            self.is_where_left = bool(np.linalg.norm(found - left) <= SAME_PLACE)
        if solution.plans[-1] is not self._driven:
            self._driven = solution.plans[-1]
            entry = Entry(solution.plans[-1], solution.commits[-1], epoch)
            self._drive(entry)
            self._book.write(entry)

    def note(self, journey: Journey, robot: Robot, mission_start: float) -> None:
        """Write down how far the robot is with its goals, if that is new."""
        news = mission_start, journey.orders, journey.itinerary.reached, robot.goal.tolist()
        if news != self._written:
            self._written = news
            self._book.note(journey.stage(robot, mission_start))

    def resume(self, journey: Journey, robot: Robot, mission_start: float, now: float) -> None:
        """Go on with the goals that the process before had in this mission, unless somebody has given others since."""
        stages = [stage for stage in self._stages if abs(stage.mission_start - mission_start) < _ONE]
        if stages and not journey.orders:
            journey.resume(robot, stages, now)
        self._stages = ()

    def solution(self, journey: Journey, robot: Robot, mission_start: float) -> Solution:
        """Return what the body has driven under all processes, and the goals that it was given."""
        if not np.isnan(robot.sol.commits[0]):
            # Older ones have been left out since: what came before them does not join on.
            return journey.solution(robot)
        begun = sum(entry.plan.first_knot * entry.plan.step <= mission_start for entry in self._past)
        # What it drove in other missions is none of this one's.
        return journey.solution(robot, self._past[max(begun - 1, 0):])
