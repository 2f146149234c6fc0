"""Free places: where bodies can stand apart, and drive from one to every other."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.world.cost_to_go import cost_to_go
from mobile_planning.world.environment import Environment

#: Room beside the body [m] that a way must have to count as one, and side [m] of the cells it is sought in.
_WAY, _CELL = 0.05, 0.1
_DRAWS = 10


class FreePlaces:
    """Random places, one in each free cell, all joined by free ways.

    Parameters
    ----------
    rng : numpy.random.Generator
    environment : Environment
    radius : float [m]
        Of a body.
    room : float [m]
        Free beside the body, at least.

    Attributes
    ----------
    points : (K, 2) ndarray [m]
    """

    def __init__(self, rng: np.random.Generator, environment: Environment, radius: float, room: float):
        x_min, y_min, x_max, y_max = environment.bounds
        x, y = np.arange(x_min + _CELL / 2, x_max, _CELL), np.arange(y_min + _CELL / 2, y_max, _CELL)
        centres = np.stack(np.meshgrid(x, y), axis=-1)
        points = centres[_largest_part(environment.clearance(centres) < radius + _WAY)]
        points += rng.uniform(-_CELL / 2, _CELL / 2, points.shape)
        self.points = points[environment.clearance(points) >= radius + room]
        self._rng = rng

    def missions(self, robots: int, apart: float, trip: float = 0.0, starts_in: NDArray | bool = True,
                 goals_in: NDArray | bool = True) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return starts and goals (N, 2), (N, 2) [m].

        Parameters
        ----------
        robots : int
        apart : float [m]
            Least distance of two starts, and of two goals.
        trip : float [m]
            Least distance from a start to its goal.
        starts_in, goals_in : (N, K) ndarray of bool
            Which of ``points`` may be the start, and the goal, of each robot; all if not given.

        Raises
        ------
        InvalidInput
            Ten draws have found no room.
        """
        shape = robots, len(self.points)
        for _ in range(_DRAWS):
            starts = self._drawn(np.broadcast_to(starts_in, shape), apart)
            if starts is None:
                continue
            far = np.linalg.norm(self.points - starts[:, None], axis=-1) >= trip
            goals = self._drawn(far & goals_in, apart)
            if goals is not None:
                return starts, goals
        raise InvalidInput(f'no room for {robots} robots whose starts, and whose goals, are {apart:g} m apart')

    def _drawn(self, suits, apart):
        """Return a place for each row (N, K) of what suits, None where earlier ones have left no room."""
        free, taken = np.ones(len(self.points), bool), np.empty((len(suits), 2))
        for index, suiting in enumerate(suits):
            choices = np.flatnonzero(free & suiting)
            if not len(choices):
                return None
            taken[index] = self.points[self._rng.choice(choices)]
            free &= np.linalg.norm(self.points - taken[index], axis=1) >= apart
        return taken


def _largest_part(blocked):
    """Return which cells (h, w) make up the largest part that is connected."""
    left, largest = ~blocked, np.zeros_like(blocked)
    while left.sum() > largest.sum():
        row, column = np.argwhere(left)[0]
        part = np.isfinite(cost_to_go(blocked, (column, row), corner_cutting=False))
        left &= ~part
        if part.sum() > largest.sum():
            largest = part
    return largest
