"""What a section of the receding horizon is, what it goes on from, and what became of planning it."""
from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class Kind(Enum):
    """Which section of a mission."""

    FIRST = 'first'
    INTERMEDIATE = 'intermediate'
    LAST = 'last'


@dataclass(frozen=True, eq=False)
class Start:
    """What a section goes on from.

    Attributes
    ----------
    points : (3, 2) ndarray [m]
        Control points of the plan in force at the first knot.
    heading : float [rad]
    elapsed : float [s]
        Since the start of the mission.
    """

    points: NDArray[np.float64]
    heading: float
    elapsed: float

    @property
    def is_at_rest(self) -> bool:
        """Whether the robot stands."""
        return not np.ptp(self.points, axis=0).any()

    def motion(self, step: float) -> NDArray[np.float64]:
        """Return position, velocity and acceleration (3, 2) [m, m/s, m/s^2]."""
        before, at, after = self.points
        return np.array([(before + 4 * at + after) / 6, (after - before) / (2 * step),
                         (before - 2 * at + after) / step**2])


@dataclass(frozen=True, eq=False)
class Found:
    """The outcome of planning one section.

    Attributes
    ----------
    points : (n, 2) ndarray [m] or None
        Uniform control points from the first knot on; None: nothing that is proved.
    solves, infeasible : int
        Programs solved, and those whose answer broke a constraint.
    """

    points: NDArray[np.float64] | None
    solves: int = 0
    infeasible: int = 0
