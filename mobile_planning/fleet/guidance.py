"""Where to go: the way to the goal around walls and parked robots, and where to draw a plan at each knot.

Safety never depends on it: a plan is committed for what it proves, not for where it leads.
"""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput, NoPath
from mobile_planning.fleet import prediction
from mobile_planning.fleet.neighbour import Neighbour
from mobile_planning.fleet.roundabout import Roundabout
from mobile_planning.fleet.search_lattice import SearchLattice
from mobile_planning.fleet.way_finder import WayFinder
from mobile_planning.geometry import finite_points

#: Room left beside a parked robot on the way [m], when a plan is drawn past it, and when that is along a given way.
_PASS, _BRUSH, _GRAZE = 0.1, 0.05, 0.01
#: The reference runs ahead of the fastest drive by this distance [m] and this factor.
_AHEAD, _FASTER = 0.15, 1.05
#: Right-hand rule: a robot counts as ahead from this cosine on, and as near for so long at full speed [s].
_IN_FRONT, _NEAR_TIME = 0.25, 0.7
#: It turns by the first angle [rad], after 1 s without progress by more each second [rad/s], up to the last.
_TURN, _TURN_RATE, _MOST_TURN = np.deg2rad((60.0, 20.0, 120.0))
#: The prediction lasts longer than the plan by this [s]; nearer than this [m] is there.
_LONGER, _THERE = 0.5, 1e-6
#: Squares of places further out [m] would overflow.
_FAR = 1e12
#: Farther than this [m] from a given way, or without progress for so long [s], a robot is led by the own way.
_STRAY, _GIVES_UP = 1.5, 4.0


class Guidance:
    """The way of a disc to one goal in a static world, among other robots.

    The field of the way to the goal is computed once, when it is first needed, or by `prepare`: a goal in plain sight
    needs none.

    Parameters
    ----------
    lattice : SearchLattice
        Of the room that the world leaves the disc.
    goal : (2,) array_like [m]
    v_max : float [m/s]

    Attributes
    ----------
    goal : (2,) ndarray [m]
    radius : float [m]
        Of the disc.
    v_max : float [m/s]

    Raises
    ------
    InvalidInput
        A number is not finite or not positive.

    Examples
    --------
    >>> from mobile_planning import Boundary, Environment, RoundObstacle
    >>> room = Environment(Boundary((0, 8), (0, 6)), [RoundObstacle((4, 3.1), 0.5)])
    >>> guidance = Guidance(SearchLattice(room, radius=0.2), goal=(7, 3), v_max=1.0)
    >>> len(guidance.path((1, 3))) > 2, bool(6.0 < guidance.length((1, 3)) < 6.4)
    (True, True)
    >>> guidance.reference([(1.0, 3.0), (1.0, 3.0)], (), step=0.25, stalled=0.0).shape
    (2, 2)
    """

    def __init__(self, lattice: SearchLattice, goal: ArrayLike, v_max: float):
        self.goal = _place(goal, 'goal')
        self.radius, self.v_max = lattice.radius, float(v_max)
        if not 0 < self.v_max < np.inf:
            raise InvalidInput(f'v_max {v_max} m/s must be positive and finite')
        self._finder = WayFinder(lattice, self.goal)
        self._given, self._passed = None, 0

    def lead(self, way: ArrayLike) -> None:
        """Lead along ``way`` (W, 2) [m], which ends at the goal, instead of the own way, as long as that gets on.

        A robot that has strayed from it, or has long made no progress, is led by the own way.
        """
        self._given, self._passed = finite_points(way), 0

    def prepare(self) -> None:
        """Compute the field of the way now: from a tenth of a second on, the larger the world the longer."""
        self._finder.prepare()

    # The way

    def path(self, position: ArrayLike, parked: Sequence[Neighbour] = ()) -> NDArray[np.float64]:
        """Return way-points (W, 2) [m] from ``position`` to the goal, each in sight of the next.

        Parameters
        ----------
        position : (2,) array_like [m]
        parked : sequence of Neighbour
            Robots that stand still. Each is passed on the side that makes the shorter way, as a rule the nearer one,
            at a distance of both radii and 0.1 m; where no way leads around all of them, they are left out.

        Raises
        ------
        NoPath
            The static world alone lets no path through.
        """
        way = self._finder.way(_place(position, 'position'), self._discs(parked, _PASS))
        if not len(way):
            raise NoPath(f'no path for a disc of radius {self.radius} m leads from {position} to {self.goal}')
        return way

    def length(self, position: ArrayLike) -> float:
        """Return what is left to drive from ``position`` (2,) [m], infinite if nothing leads to the goal.

        Along the given way, if that is near: who drives along a detour comes no nearer to the goal by the shortest one.
        """
        try:
            given = self._rest_of_given(np.asarray(position, float), 0.0)
            path = self.path(position) if given is None else given
        except NoPath:
            return np.inf
        return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())

    def reference(self, standing: ArrayLike, neighbours: Sequence[Neighbour], step: float, stalled: float, *,
                  roundabout: Roundabout | None = None,
                  velocity: ArrayLike | None = None) -> NDArray[np.float64]:
        """Return where to draw the new plan at each knot.

        Parameters
        ----------
        standing : (M, 2) array_like [m]
            Where the plan in force is at the knots to come.
        neighbours : sequence of Neighbour
        step : float [s]
            Between knots.
        stalled : float [s]
            How long there has been no progress.
        roundabout : Roundabout, optional
            To be taken where it lies in the way and nothing static stands in it.
        velocity : (2,) array_like [m/s], optional
            Of this robot at the first row. With it, and the goal in sight, the robot goes where the
            `prediction` of everybody's ways leads it; else the right-hand rule holds.

        Returns
        -------
        (M, 2) ndarray [m]
            Each in sight of the same row of ``standing``, for a body of this radius; ``standing`` itself where there
            is no way.
        """
        standing = finite_points(standing)
        parked = [other for other in neighbours if other.is_parked]
        way = None
        if roundabout is not None and self._finder.room(roundabout.centre) >= roundabout.radius + self.radius:
            way = roundabout.way(standing[0], self.goal)
        if way is None:
            given = self._rest_of_given(standing[0], stalled)
            try:
                way = self.path(standing[0], parked) if given is None else given
            except NoPath:
                return standing.copy()
            if velocity is not None and len(way) == 2 and given is None:
                return self._predicted(way, standing, neighbours, parked, stalled, step, velocity)
            way = self._keep_right(way, standing, neighbours, parked, stalled, step)
            return self._drawn(way, standing, step, self._discs(parked, _BRUSH))
        pace = roundabout.pace(way, neighbours, self.radius)
        return self._drawn(way, standing, step, self._discs(parked, _BRUSH), pace)

    def follow(self, way: ArrayLike, standing: ArrayLike, step: float,
               parked: Sequence[Neighbour] = ()) -> NDArray[np.float64]:
        """Return the points of a way to draw the new plan to, row by row in sight of ``standing``.

        Parameters
        ----------
        way : (W, 2) array_like [m]
        standing : (M, 2) array_like [m]
        step : float [s]
        parked : sequence of Neighbour
            They block the sight as well.

        Returns
        -------
        (M, 2) ndarray [m]
        """
        return self._drawn(finite_points(way), finite_points(standing), step, self._discs(parked, _GRAZE))

    # How it works

    def _drawn(self, way, standing, step, discs, pace=1.0):
        """Return for each row of ``standing`` the furthest point of the way that it sees and that is to be reached."""
        reach = pace * (_AHEAD + _FASTER * self.v_max * step * np.arange(1.0, len(standing) + 1))
        return self._finder.drawn(way, standing, discs, reach)

    def _rest_of_given(self, position, stalled):
        """Return what is left of the given way from ``position`` (2,) [m] on; None where there is none to follow."""
        if self._given is None or stalled > _GIVES_UP:
            return None
        a, b = self._given[self._passed:-1], self._given[self._passed + 1:]
        along = b - a
        share = np.clip(((position - a) * along).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-18), 0.0, 1.0)
        nearest = a + share[:, None] * along
        gaps = np.linalg.norm(nearest - position, axis=1)
        # Of a way that comes back to itself the first part that is near counts.
        index = int(np.argmax(gaps <= gaps.min() + _STRAY / 10))
        if gaps[index] > _STRAY:
            return None
        self._passed += index
        way = np.concatenate([position[None], nearest[index][None], self._given[self._passed + 1:]])
        moves = np.linalg.norm(np.diff(way, axis=0), axis=1) > 1e-6
        way = np.concatenate([way[:1], way[1:][moves]])
        return way if len(way) > 1 else None

    def _discs(self, parked, room):
        """Return the places of robots and how far to keep from them (P, 3) [m]."""
        keep = self.radius + room
        return np.array([(*_near(other.position), other.radius + keep) for other in parked]).reshape(-1, 3)

    def _predicted(self, way, standing, neighbours, parked, stalled, step, velocity):
        """Return the reference (M, 2) [m] along the own part of the prediction, no faster than that goes."""
        way = np.array([standing[0], self.goal])
        others = [other for other in neighbours if np.abs(other.position).max() < _FAR]
        # A little longer than the plan, for the reference runs ahead.
        seconds = step * len(standing) + _LONGER
        track = prediction.drive_on(self._finder, way, velocity, self.radius, self.v_max, others, seconds, stalled)
        reach = _AHEAD + _FASTER * prediction.arcs(track, seconds, step * np.arange(len(standing)))
        if np.abs(track[-1] - self.goal).max() < _THERE:
            track[-1] = self.goal
        return self._finder.drawn(track, standing, self._discs(parked, _BRUSH), reach)

    def _keep_right(self, way, standing, neighbours, parked, stalled, step):
        """Return the way, turned to the right where moving robots are ahead and no wall is there."""
        here, end = _near(standing[0]), _near(standing[-1])
        leg = self._heading(way)
        if leg is None:
            return way
        closeness = self._closeness(leg, here, end, [other for other in neighbours if not other.is_parked])
        if closeness < 0.05:
            return way
        turn = min(_TURN + _TURN_RATE * max(0.0, stalled - 1.0), _MOST_TURN) * closeness
        discs = self._discs(parked, _BRUSH)
        look = min(self.v_max, float(np.linalg.norm(way[1] - way[0])))
        for angle in (turn, turn / 2):
            right = leg @ np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            if self._finder.is_open(here, here + look * right, discs):
                return np.stack([here, here + (_AHEAD + _FASTER * self.v_max * step * len(standing)) * right])
        return way

    def _heading(self, way):
        """Return the unit vector (2,) of the first leg that is longer than rounding, None at the goal."""
        if np.linalg.norm(self.goal - way[0]) < 1.5 * self.radius:
            return None
        legs = way[1:] - way[0]
        lengths = np.linalg.norm(legs, axis=1)
        index = np.argmax(lengths > 0.25 * self.radius)
        return legs[index] / lengths[index]

    def _closeness(self, leg, here, end, moving):
        """Return how much, 0..1, the nearest of the robots that come towards this one is in its way."""
        if not moving:
            return 0.0
        positions, ends, goals = (_near([getattr(other, name) for other in moving])
                                  for name in ('position', 'end', 'goal'))
        touch = np.array([other.radius for other in moving], float) + self.radius
        near = touch + _NEAR_TIME * self.v_max
        to_go = goals - ends
        left = np.linalg.norm(to_go, axis=1)
        same_way = (left > 1.5 * self.radius) & (to_go @ leg > 0.5 * left)
        closeness = 0.0
        for own, others in ((end, ends), (here, positions)):
            offset = others - own
            distance = np.linalg.norm(offset, axis=1)
            # One that will stop beyond this robot's goal is not in its way.
            beyond = ((np.linalg.norm(goals - others, axis=1) < 0.25 * self.radius)
                      & (np.linalg.norm(self.goal - here) < distance))
            cosine = offset @ leg / np.maximum(distance, 1e-9)
            counts = (distance < near) & (distance > 1e-9) & (cosine >= _IN_FRONT) & ~same_way & ~beyond
            share = np.clip((near - distance) / (near - touch), 0.0, 1.0) * np.minimum(1.0, 2.0 * cosine)
            closeness = max(closeness, float(np.where(counts, share, 0.0).max()))
        return closeness


def _near(points):
    """Return points [m], those that are too far out nearer."""
    return np.clip(np.asarray(points, float), -_FAR, _FAR)


def _place(point, name):
    """Return one finite point (2,) [m]."""
    place = np.array(finite_points(point))
    if place.shape != (2,):
        raise InvalidInput(f'{name} has shape {place.shape}: it must be one point (x, y)')
    return place
