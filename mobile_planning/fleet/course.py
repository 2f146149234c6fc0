"""Course: one robot's way to one goal, and how it gets on with it; another goal is another course."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import PlanningError
from mobile_planning.fleet.ground import Ground
from mobile_planning.fleet.guidance import Guidance
from mobile_planning.fleet.horizon import Horizon
from mobile_planning.fleet.neighbour import Neighbour
from mobile_planning.fleet.roundabout import Roundabout, predict_crowd, updated
from mobile_planning.fleet.section import SectionProblem
from mobile_planning.geometry import wrap_angle

#: A robot has arrived within this of its goal [m] and of its final heading [rad].
GOAL_TOLERANCE = 0.02
HEADING_TOLERANCE = 0.02
#: Getting nearer to the goal by this [m] is progress.
_PROGRESS = 0.05
#: Cycles between two looks for a way where there was none.
_SEEK_AGAIN = 8


class Course:
    """The way of one robot to one goal.

    Parameters
    ----------
    goal : (3,) ndarray [m, m, rad]
    here : (2,) ndarray [m]
        From where a way must lead there.
    ground : Ground
    problem : SectionProblem
    reverse : bool
        Whether the robot may drive backwards.
    now : float [s]
        When it is set.

    Attributes
    ----------
    guidance : Guidance
        Where to go.
    horizon : Horizon
        How to get there, a section at a time.
    progress_at : float [s]
        When the robot last made progress.
    trouble : str
        Why nothing leads to the goal in the world as it is by now; empty as long as something does.

    Raises
    ------
    GoalOutside, GoalOccupied, NoPath
        The body does not fit there, or nothing leads there.
    """

    def __init__(self, goal: NDArray, here: NDArray, ground: Ground, problem: SectionProblem, *, reverse: bool,
                 now: float):
        self._goal, self._place, self._radius = goal, goal[:2], ground.radius
        self._problem, self._v_max, self._reverse = problem, problem.limits.v_max, reverse
        self.guidance = self._guidance_on(ground, here)
        self.horizon = self._horizon_on(ground)
        self.progress_at, self._least_left = now, np.inf
        self._roundabout: Roundabout | None = None
        self.trouble, self._ground, self._sought = '', ground, 0

    def _guidance_on(self, ground, here):
        ground.require_goal(self._place)
        guidance = Guidance(ground.lattice, self._place, self._v_max)
        guidance.path(here)
        return guidance

    def _horizon_on(self, ground):
        return Horizon(self._problem, self._place, ground.pieces, reverse=self._reverse)

    # The goal

    def leads(self, goal: ArrayLike, ground: Ground) -> bool:
        """Return whether this is the way to ``goal`` (3,) [m, m, rad], on that very ground."""
        return ground is self._ground and np.array_equal(goal, self._goal)

    @property
    def final_heading(self) -> float:
        """The heading [rad] at the goal."""
        return self._goal[2]

    def ends_at(self, place: NDArray) -> bool:
        """Return whether ``place`` (2,) [m] is the goal's, within the tolerance."""
        return bool(np.linalg.norm(place - self._place) <= GOAL_TOLERANCE)

    def ends_towards(self, heading: float) -> bool:
        """Return whether ``heading`` [rad] is the goal's, within the tolerance."""
        return bool(abs(wrap_angle(self._goal[2] - heading)) <= HEADING_TOLERANCE)

    # The way

    def reference(self, standing: NDArray, velocity: NDArray, neighbours: Sequence[Neighbour], step: float,
                  now: float) -> NDArray[np.float64]:
        """Return where (M, 2) [m] to draw the next plan; see `Guidance.reference`."""
        return self.guidance.reference(standing, neighbours, step, now - self.progress_at,
                                       roundabout=self._roundabout, velocity=velocity)

    def look_around(self, here: NDArray, neighbours: Sequence[Neighbour]) -> None:
        """Predict a crowd on the way of a robot that is ``here`` (2,) [m]; due once in about three cycles."""
        moving = [other for other in neighbours if not other.is_parked]
        places = np.array([here, *(other.position for other in moving)])
        goals = np.array([self._place, *(other.goal for other in moving)])
        under_way = np.linalg.norm(goals - places, axis=1) > 1.5 * self._radius
        crowd = None
        if under_way[0]:
            crowd = predict_crowd(places[under_way], goals[under_way], self._radius, self._v_max)
        self._roundabout = updated(self._roundabout, crowd, here, self._radius)

    # A world that changes

    def enter(self, ground: Ground, here: NDArray, now: float) -> None:
        """Go by another static world; without a way in it from ``here`` (2,) [m] on ``trouble`` says so."""
        self.horizon, self._ground = self._horizon_on(ground), ground
        self._roundabout, self._sought = None, 0
        self._seek(here, now)

    def seek_again(self, here: NDArray, now: float) -> None:
        """Look once in a few cycles for a way, if there was none: somebody may clear it."""
        if self.trouble:
            self._sought += 1
            if self._sought % _SEEK_AGAIN == 1:
                self._seek(here, now)

    def _seek(self, here, now):
        try:
            self.guidance = self._guidance_on(self._ground, here)
            self.trouble, self._least_left, self.progress_at = '', np.inf, now
        except PlanningError as error:
            self.trouble = str(error)

    # Progress

    def note_progress(self, here: NDArray, now: float) -> None:
        """Notice whether the robot, ``here`` (2,) [m] at ``now`` [s], has come nearer to its goal."""
        left = self.guidance.length(here)
        if left < self._least_left - _PROGRESS:
            self._least_left, self.progress_at = left, now

    def count_anew(self, here: NDArray, now: float) -> None:
        """Take ``here`` (2,) [m] at ``now`` [s] for progress: the robot stands, or goes, where it is told to."""
        self._least_left, self.progress_at = self.guidance.length(here), now
