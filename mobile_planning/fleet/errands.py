"""Errands: where a robot of a simulation drives next when it has arrived."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.free_places import FreePlaces
from mobile_planning.world.environment import Environment

#: Room beside a body at a goal that is drawn [m], and beside it to the next goal.
_ROOM, _BESIDE = 0.2, 0.3


class Errands(Protocol):
    """What a simulation asks for a next goal."""

    def next_goal(self, robot_id: int, now: float, taken: Sequence[tuple[ArrayLike, float]]) -> NDArray | None:
        """Return the pose (3,) [m, m, rad] to drive to from ``now`` [s] on; None to stay.

        Parameters
        ----------
        robot_id : int
            Of who has arrived.
        now : float [s]
            From the start of the mission.
        taken : sequence of ((2,) array_like [m], float [m])
            The goals, or for the dead the places, and the radii of all others.
        """

    def left(self, robot_id: int) -> tuple[NDArray, ...]:
        """Return the goals (3,) that the robot has not been given and is held to all the same."""


class GoalQueues:
    """Goals given in advance.

    Parameters
    ----------
    goals : mapping of int to sequence of (3,) array_like [m, m, rad]
        By robot id, in order, without the goal that the robot sets out for.

    Examples
    --------
    >>> queues = GoalQueues({1: [(2, 3, 0)]})
    >>> [queues.next_goal(robot_id, 5.0, []) for robot_id in (1, 1, 2)]
    [array([2., 3., 0.]), None, None]
    """

    def __init__(self, goals: Mapping[int, Sequence[ArrayLike]]):
        self._left = {robot_id: [np.array(goal, float) for goal in listed] for robot_id, listed in goals.items()}

    def next_goal(self, robot_id: int, now: float, taken: Sequence[tuple[ArrayLike, float]]) -> NDArray | None:
        """Return the next goal of the robot, None when it has had all; see `Errands`."""
        left = self._left.get(robot_id)
        return left.pop(0) if left else None

    def left(self, robot_id: int) -> tuple[NDArray, ...]:
        """Return the goals that the robot has not come to."""
        return tuple(self._left.get(robot_id, ()))


class EndlessErrands:
    """A new goal at each arrival, drawn from the free places of a world, for a while.

    Then every robot drives to the goal that it has, so that the mission ends with all of them arrived.

    Parameters
    ----------
    environment : Environment
    radii : mapping of int to float [m]
        By robot id, with margins.
    until : float [s]
        From the start of the mission; who arrives later stays.
    seed : int
        Each robot draws numbers of its own from it.
    trip : float [m], optional
        Shortest distance of a goal from the one before, where there is one; by default 40 % of the world's longer side,
        at most 6 m.

    Raises
    ------
    InvalidInput
        A number is out of its range, or the world has no extent or no room.
    """

    def __init__(self, environment: Environment, radii: Mapping[int, float], until: float, seed: int = 0, *,
                 trip: float | None = None):
        if not 0.0 <= until < np.inf or seed < 0 or not (trip is None or 0.0 <= trip < np.inf):
            raise InvalidInput(f'errands until {until} s, seed {seed} or trips of {trip} m are out of range')
        x_min, y_min, x_max, y_max = environment.bounds
        self._trip = min(6.0, 0.4 * max(x_max - x_min, y_max - y_min)) if trip is None else float(trip)
        self._until, self._radii = float(until), dict(radii)
        first, *streams = np.random.default_rng(seed).spawn(1 + len(self._radii))
        self._rngs = dict(zip(sorted(self._radii), streams))
        self._places = FreePlaces(first, environment, max(self._radii.values()), _ROOM).points
        if not len(self._places):
            raise InvalidInput(f'no place is free for a body of {max(self._radii.values()):.3f} m')
        self._last: dict[int, NDArray] = {}

    def next_goal(self, robot_id: int, now: float, taken: Sequence[tuple[ArrayLike, float]]) -> NDArray | None:
        """Return a free pose away from all that is taken, None from the end on or where there is none."""
        if now >= self._until:
            return None
        free = np.ones(len(self._places), bool)
        for place, radius in taken:
            apart = self._radii[robot_id] + radius + _BESIDE
            free &= np.linalg.norm(self._places - np.asarray(place, float), axis=1) >= apart
        if robot_id in self._last:
            far = free & (np.linalg.norm(self._places - self._last[robot_id], axis=1) >= self._trip)
            free = far if far.any() else free
        choices = np.flatnonzero(free)
        if not len(choices):
            return None
        rng = self._rngs[robot_id]
        self._last[robot_id] = self._places[rng.choice(choices)]
        return np.array([*self._last[robot_id], rng.uniform(-np.pi, np.pi)])

    def left(self, robot_id: int) -> tuple[NDArray, ...]:
        """Return nothing: nobody is held to what was not drawn."""
        return ()
