"""Journey: where one robot drives, goal after goal, as it was told to or as its scene says."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import inf

from numpy.typing import ArrayLike

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.fleet.errands import Errands
from mobile_planning.fleet.goal_request import GoalRequest, Outlook
from mobile_planning.fleet.itinerary import How, Itinerary
from mobile_planning.fleet.logbook import Entry
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.stage import Stage, pose

#: Who has asked for a way so long ago [s] asks again.
_PATIENCE = 5.0


class Journey:
    """Gives a robot its next goal whenever it has reached one.

    Parameters
    ----------
    robot_id : int
    errands : Errands, optional
        Asked when nobody has said where to drive.

    Attributes
    ----------
    itinerary : Itinerary
        Where the robot drives after the goal that it has.
    orders : int
        Times that it was told where to drive.
    trouble : str
        Why the last goal was left out; empty if it was not.
    """

    def __init__(self, robot_id: int, errands: Errands | None = None):
        self.itinerary, self.orders, self.trouble = Itinerary(robot_id, errands), 0, ''
        self._is_at_goal = self._is_counted = False
        self._told, self._next, self._is_asked, self._asked_at = 0, None, False, -inf

    @property
    def is_over(self) -> bool:
        """Whether the robot has reached all goals that are known."""
        return self._is_at_goal and self._next is None and not self.itinerary.left

    @property
    def is_between_goals(self) -> bool:
        """Whether the way to the next goal is being made."""
        return self._next is not None

    def set_goals(self, robot: Robot, goals: Sequence[ArrayLike], how: How, now: float) -> None:
        """Let the robot drive to ``goals``, (3,) [m, m, rad] each, one after the other, from ``now`` [s] on.

        Raises
        ------
        InvalidInput
            There is no goal, or one that is no pose.
        LimitExceeded
            They are too many.
        PlanningError
            The body does not fit at one of them, or nothing leads to the first. The old goals stand.
        """
        if not len(goals):
            raise InvalidInput('no goal is given')
        # Of those that replace the old ones the first is at hand, and comes again where they repeat.
        self.itinerary.require_room(len(goals) - (how is How.REPLACE), how)
        for goal in goals:
            robot.require_goal(goal)
        if how is How.APPEND:
            self.itinerary.take(goals, how)
        else:
            robot.set_goal(goals[0], now)
            self._set_out()
            self.itinerary.take([*goals[1:], goals[0]] if how is How.REPEAT else goals[1:], how)
        self.orders += 1

    def follow_path(self, robot: Robot, poses: ArrayLike, now: float) -> None:
        """Let the robot drive along a path (N, 3) [m, m, rad] from elsewhere to its end, and forget all other goals.

        Raises
        ------
        InvalidInput
            It is no path for this robot.
        PlanningError
            The body does not fit at its end. The old goals stand.
        """
        robot.follow_path(poses, now)
        self._set_out()
        self.itinerary.take([], How.REPLACE)
        self.orders += 1

    def go_on(self, robot: Robot, now: float, mission_start: float) -> None:
        """Choose the next goal of a robot that has reached its goal by ``now`` [s]; see `take_request`.

        Parameters
        ----------
        robot : Robot
        now, mission_start : float [s]
        """
        if self.is_between_goals:
            if now - self._asked_at > _PATIENCE:
                self._is_asked, self._asked_at = False, now
            return
        if not robot.is_done:
            return
        if not self._is_counted:
            self.itinerary.arrivals.append((robot.goal, now))
        self._is_at_goal = self._is_counted = True
        taken = [(message.goal, message.radius) for message in robot.heard().values()]
        self._next = self.itinerary.next_goal(now - mission_start, taken)
        self._is_asked, self._asked_at = False, now

    def take_request(self, robot: Robot) -> GoalRequest | None:
        """Return the request for the way to the goal that was chosen, if any; its answer goes to `set_out`.

        Once, and anew where no answer comes: whoever was to make the way has failed.
        """
        if self._next is None or self._is_asked:
            return None
        self._is_asked = True
        return GoalRequest(self._next, robot.looking_ahead(self._next))

    def set_out(self, robot: Robot, outlook: Outlook, now: float) -> None:
        """Send the robot at ``now`` [s] to the goal that was chosen, if no other was given since."""
        if outlook.goal is not self._next:
            return
        self._next = None
        try:
            if outlook.refusal is not None:
                raise outlook.refusal
            robot.set_goal(outlook.goal, now, outlook.course)
            self._set_out()
        except PlanningError as error:
            # It stays where it is, and goes on to the goal after this one.
            self.trouble = f'a goal is left out: {error}'

    def stage(self, robot: Robot, mission_start: float) -> Stage:
        """Return how far the robot is with its goals; what it has arrived at is told once."""
        arrivals = tuple((pose(goal), float(when)) for goal, when in self.itinerary.arrivals[self._told:])
        self._told = self.itinerary.reached
        return Stage(mission_start, pose(robot.goal), self._is_counted, arrivals=arrivals, **self.itinerary.stage)

    def resume(self, robot: Robot, stages: Sequence[Stage], now: float) -> None:
        """Send the robot at ``now`` [s] to the goal that the process before was at, by the last of its ``stages``."""
        self.itinerary.resume(stages)
        self._told = self.itinerary.reached
        try:
            robot.set_goal(stages[-1].goal, now)
            self._set_out()
            self._is_counted = stages[-1].is_reached
        except PlanningError as error:
            self.trouble = f'a goal is left out: {error}'

    def solution(self, robot: Robot, past: Sequence[Entry] = ()) -> Solution:
        """Return what the body has driven, by ``past`` and by the robot, and the goals that it was given."""
        driven = robot.sol
        driven = replace(driven, plans=(*(entry.plan for entry in past), *driven.plans),
                         commits=(*(entry.commit for entry in past), *driven.commits))
        first = driven.plans[0]
        return replace(driven, goals=self.itinerary.given(robot.goal, self._is_counted),
                       reached_before=self.itinerary.reached_by(first.first_knot * first.step))

    def _set_out(self):
        self._next, self._is_at_goal, self._is_counted = None, False, False
        self.trouble = ''
