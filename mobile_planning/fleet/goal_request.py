"""Goal request: what has to be made before a robot can drive to its next goal."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import PlanningError


@dataclass(frozen=True, eq=False)
class Outlook:
    """The answer to a `GoalRequest`.

    Attributes
    ----------
    goal : (3,) ndarray [m, m, rad]
        The very one that was asked for.
    course : object
        For `Robot.set_goal`; None where nothing has to be made.
    refusal : PlanningError or None
        Why the robot cannot drive there.
    """

    goal: NDArray[np.float64]
    course: Any = None
    refusal: PlanningError | None = None


@dataclass(frozen=True, eq=False)
class GoalRequest:
    """The way to a goal, which takes some ten milliseconds or more where the goal is not in plain sight.

    Attributes
    ----------
    goal : (3,) ndarray [m, m, rad]
    make : callable
        Makes what `Robot.set_goal` takes for the goal.
    """

    goal: NDArray[np.float64]
    make: Callable[[], Any]

    def plan(self) -> Outlook:
        """Make it; this touches nothing of the robot, and may be called in any thread."""
        try:
            return Outlook(self.goal, self.make())
        except PlanningError as error:
            return Outlook(self.goal, refusal=error)
