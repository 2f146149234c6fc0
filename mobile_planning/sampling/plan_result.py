"""What a sampling planner answers."""
from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

#: Poses of a path are at most this far apart [m].
SPACING = 0.05


class PlanStatus(Enum):
    """How a query ended."""

    #: The path ends in the goal zone.
    SOLVED = 'solved'
    #: The iterations are used up; the path ends as near to the goal as was reached.
    APPROXIMATE = 'approximate'
    #: The deadline passed before a path was found; the path ends as near to the goal as was reached.
    TIMEOUT = 'timeout'
    #: The caller withdrew the query before a path was found.
    CANCELLED = 'cancelled'
    #: There is no path within what the planner searches.
    NO_PATH = 'no path'


class Improvement(NamedTuple):
    """A better path: when it was found, in seconds since the query began, and its cost [m]."""

    elapsed: float
    cost: float


@dataclass(frozen=True, eq=False)
class PlanResult:
    """The answer to one query.

    Parameters
    ----------
    status : PlanStatus
    path : (n, 3) or (n, 2) ndarray [m, m, rad]
        From the start on, at most 0.05 m apart; empty if there is none. Headings in (-pi, pi].
    cost : float [m]
        Length of the path, of its arcs and not of its chords; infinite without one.
    seed : int or None
        By which the same query gives the same answer; drawn, if none was given.
    history : tuple of Improvement
        The solutions one after the other, each cheaper than the one before.
    iterations : int
        Samples drawn.
    nodes : int
        Of the tree or the roadmap, after the query.
    elapsed : float [s]
    word : str
        L, S or R for each segment of a car's path.
    lengths : tuple of float [m]
        Of these segments; their sum is the cost.
    collision_checks : int
        Edges of a roadmap that were checked.
    """

    status: PlanStatus
    path: NDArray[np.float64]
    cost: float
    seed: int | None = None
    history: tuple[Improvement, ...] = ()
    iterations: int = 0
    nodes: int = 0
    elapsed: float = 0.0
    word: str = ''
    lengths: tuple[float, ...] = ()
    collision_checks: int = 0

    @property
    def is_solved(self) -> bool:
        """Whether the path ends in the goal zone."""
        return self.status is PlanStatus.SOLVED

    @property
    def first_solution(self) -> float | None:
        """When the first path was found, in seconds since the query began."""
        return self.history[0].elapsed if self.history else None
