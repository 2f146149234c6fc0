"""Itinerary: the goals of one robot, from a person, a program or its scene."""
from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import LimitExceeded
from mobile_planning.fleet.errands import EndlessErrands, Errands
from mobile_planning.fleet.stage import Stage, pose

#: Goals of one robot.
MAX_GOALS = 1000


class How(IntEnum):
    """What becomes of the goals that a robot has when it is given others."""

    REPLACE = 0
    APPEND = 1
    REPEAT = 2


class Itinerary:
    """What a robot drives to after the goal that it has.

    Parameters
    ----------
    robot_id : int
    errands : Errands, optional
        Asked when nobody has said where to drive.

    Attributes
    ----------
    arrivals : list of ((3,) ndarray [m, m, rad], float [s])
        Goals at which the robot has arrived, and when on its clock.

    Examples
    --------
    >>> itinerary = Itinerary(1)
    >>> itinerary.take([(1, 1, 0), (2, 1, 0)], How.REPEAT)
    >>> [itinerary.next_goal(0.0, ()).tolist() for _ in range(3)]
    [[1.0, 1.0, 0.0], [2.0, 1.0, 0.0], [1.0, 1.0, 0.0]]
    """

    def __init__(self, robot_id: int, errands: Errands | None = None):
        self.arrivals: list[tuple[NDArray[np.float64], float]] = []
        self._is_of_scene = not isinstance(errands, EndlessErrands)
        self._id, self._errands = robot_id, errands
        self._goals: deque[NDArray[np.float64]] = deque()
        self._repeats = False

    @property
    def reached(self) -> int:
        """Number of goals at which the robot has arrived."""
        return len(self.arrivals)

    def reached_by(self, time: float) -> int:
        """Return at how many goals the robot had arrived at ``time`` [s]."""
        return sum(when <= time for _, when in self.arrivals)

    def given(self, goal: ArrayLike, is_there: bool) -> tuple[NDArray[np.float64], ...]:
        """Return all goals that the robot is held to, if they are others than those of its scene; else nothing.

        Parameters
        ----------
        goal : (3,) array_like [m, m, rad]
            At hand.
        is_there : bool
            Whether the robot has arrived at it, and it is among ``arrivals``.
        """
        if self._is_of_scene:
            return ()
        ahead = () if self._repeats else self._goals
        return (*(goal for goal, _ in self.arrivals), *([] if is_there else [np.array(goal, float)]), *ahead)

    @property
    def ahead(self) -> tuple[NDArray[np.float64], ...]:
        """Goals that are known and to come, those of the scene included."""
        return (*self._goals, *(() if self._errands is None else self._errands.left(self._id)))

    @property
    def stage(self) -> dict[str, object]:
        """What is to come, as `Stage` has it."""
        return {'ahead': tuple(map(pose, self.ahead)), 'repeats': bool(self._repeats),
                'is_of_scene': self._is_of_scene, 'draws': isinstance(self._errands, EndlessErrands)}

    def resume(self, stages: Sequence[Stage]) -> None:
        """Go on from the last of ``stages``, in order, of the same robot."""
        last = stages[-1]
        self.arrivals = [(np.array(goal), when) for stage in stages for goal, when in stage.arrivals]
        self._goals = deque(map(np.array, last.ahead))
        self._repeats, self._is_of_scene = last.repeats, last.is_of_scene
        if not last.draws:
            self._errands = None

    @property
    def left(self) -> int:
        """Goals that are known and to come."""
        return len(self._goals)

    def require_room(self, count: int, how: How) -> None:
        """Raise LimitExceeded where ``count`` goals are more than `take` would take."""
        total = count + (len(self._goals) if how is How.APPEND else 0)
        if total > MAX_GOALS:
            raise LimitExceeded(f'robot {self._id} would have {total} goals, the limit is {MAX_GOALS}')

    def take(self, goals: Sequence[ArrayLike], how: How) -> None:
        """Drive to ``goals``, (3,) [m, m, rad] each, after the one at hand.

        Raises
        ------
        LimitExceeded
            They are too many.
        """
        self.require_room(len(goals), how)
        if how is not How.APPEND:
            # Who says where to drive knows better than the scene.
            self._goals.clear()
            self._errands = None
        self._is_of_scene = False
        self._repeats = how is How.REPEAT or self._repeats and how is How.APPEND
        self._goals.extend(np.array(goal, float) for goal in goals)

    def next_goal(self, now: float, taken: Sequence[tuple[ArrayLike, float]]) -> NDArray[np.float64] | None:
        """Return the pose (3,) [m, m, rad] to drive to next, None to stay.

        Parameters
        ----------
        now : float [s]
            Since the start of the mission.
        taken : sequence of ((2,) array_like [m], float [m])
            The goals and radii of the others.
        """
        if self._goals:
            goal = self._goals.popleft()
            if self._repeats:
                self._goals.append(goal)
            return goal
        return None if self._errands is None else self._errands.next_goal(self._id, now, taken)
