"""Ground: the static world, as the body of one robot has room in it."""
from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import (
    GoalOccupied,
    GoalOutside,
    InvalidInput,
    PlanningError,
    StartOccupied,
    StartOutside,
)
from mobile_planning.fleet import fences
from mobile_planning.fleet.contracts import ROUNDING
from mobile_planning.fleet.search_lattice import SearchLattice
from mobile_planning.world.convex_pieces import ConvexPieces
from mobile_planning.world.environment import Environment


class Ground:
    """The static world under a disc.

    Parameters
    ----------
    environment : Environment
    radius : float [m]
        Of the body, with its margin.
    robot_id : int
        Whose body it is, for what is said of it.

    Attributes
    ----------
    environment : Environment
    pieces : ConvexPieces
        What it consists of.
    radius : float [m]
    robot_id : int
    """

    def __init__(self, environment: Environment, radius: float, robot_id: int):
        self.environment, self.radius, self.robot_id = environment, radius, robot_id
        self.pieces = ConvexPieces(environment)

    @cached_property
    def lattice(self) -> SearchLattice:
        """What ways to all goals on this ground are searched on."""
        return SearchLattice(self.environment, self.radius)

    def room(self, place: ArrayLike) -> float:
        """Return how far [m] ``place`` (2,) is from anything; what is farther than twice the radius counts so."""
        curve, reach = np.tile(place, (1, 4, 1)), 2 * self.radius
        around = (fences.of_walls(self.pieces, 1, 0.0)
                  + fences.of_pieces(self.pieces, curve, 0.0, curve[:, 0] - reach, curve[:, 0] + reach))
        return float(min(reach, around.room(curve).min(initial=np.inf)))

    def along(self, curves: NDArray) -> tuple[int, float]:
        """Return on which of ``curves`` the body first touches anything, and the least room [m] that it has there.

        Parameters
        ----------
        curves : (S, 4, 2) ndarray [m]
            Bezier points.

        Returns
        -------
        first : int
            S where it touches nothing.
        room : float [m]
            Infinite with nothing around.
        """
        around = (fences.of_walls(self.pieces, len(curves), self.radius)
                  + fences.of_pieces(self.pieces, curves, self.radius, curves.min(axis=1), curves.max(axis=1)))
        room = around.room(curves).min(axis=1, initial=np.inf)
        touched = around.spans[room < -ROUNDING]
        return int(touched.min()) if len(touched) else len(curves), float(room.min(initial=np.inf))

    def require_way(self, points: NDArray) -> None:
        """Raise InvalidInput where the body does not fit along straight lines from one of ``points`` to the next.

        Parameters
        ----------
        points : (N, 2) ndarray [m]
            Two at the least.
        """
        thirds = np.linspace(0.0, 1.0, 4)[:, None]
        first, least = self.along(points[:-1, None] + thirds * np.diff(points, axis=0)[:, None])
        if least < -ROUNDING:
            x, y = points[first]
            raise InvalidInput(f'the path leads from ({x:.3f}, {y:.3f}) on where robot {self.robot_id} does not fit, '
                               f'by {-least:.3f} m')

    def require_start(self, place: NDArray) -> None:
        """Raise StartOutside or StartOccupied where the body cannot start at ``place`` (2,) [m]."""
        self._require_room('start', place, StartOutside, StartOccupied)

    def require_goal(self, place: NDArray) -> None:
        """Raise GoalOutside or GoalOccupied where the body cannot end at ``place`` (2,) [m]."""
        self._require_room('goal', place, GoalOutside, GoalOccupied)

    def _require_room(self, name: str, place: NDArray, outside: type[PlanningError], occupied: type[PlanningError]):
        x_min, y_min, x_max, y_max = self.environment.bounds
        said = f'{name} ({place[0]:.3f}, {place[1]:.3f}) of robot {self.robot_id}'
        if not (x_min <= place[0] <= x_max and y_min <= place[1] <= y_max):
            raise outside(f'{said} lies outside the world, x in {x_min:g}..{x_max:g} m, y in {y_min:g}..{y_max:g} m')
        free = self.room(place)
        if free < self.radius - ROUNDING:
            raise occupied(f'{said} has {free:.3f} m of room, with its margin it needs {self.radius:.3f} m')
