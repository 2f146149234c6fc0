"""The short motions that a state lattice is made of: straight ahead, and arcs between its headings.

A lattice has ``n`` headings; each is the direction of a vector of integers, so that a straight motion ends on a cell
centre. With 4 they are the axes, otherwise those of the cells on the border of a square around the origin, counted
from +x by way of +y: (1, 0), (2, 1), (1, 1), (1, 2), (0, 1) ... for 16 (Pivtoraiko and Kelly 2005 call this a state
lattice; Nav2's Smac lattice counts its headings the same way).
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import gcd

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.world.cost_to_go import cost_to_go

MAX_HEADINGS = 64
MAX_RADIUS = 100.0
_TINY = 1e-9
# A turn over several headings at once is worth a motion of its own if its radius is so much smaller.
_SHARPER = 0.95


@dataclass(frozen=True, eq=False)
class MotionPrimitive:
    """A motion from the centre of cell (0, 0): at most one arc, with a straight piece before or after it.

    Attributes
    ----------
    code : str
        'S', 'L' or 'R': straight, left or right; the small letter for the same motion driven backwards.
    name : str
        The code, with the number of headings it turns by where several motions share it.
    heading, end_heading : int
        Indices of the first and the last heading.
    end : (2,) tuple of int [cells]
        Cell where it ends.
    length : float [cells]
    turn : float [rad]
        By which the heading changes, positive to the left.
    radius : float [cells]
        Of the arc, inf if it is straight.
    before, after : float [cells]
        Length of the straight pieces.
    angle : float [rad]
        Of the first heading.
    """

    code: str
    name: str
    heading: int
    end_heading: int
    end: tuple[int, int]
    length: float
    turn: float
    radius: float
    before: float
    after: float
    angle: float

    @property
    def is_reverse(self) -> bool:
        """Whether the robot drives backwards."""
        return self.code.islower()

    def pose_at(self, distance: ArrayLike) -> NDArray[np.float64]:
        """Return the pose after a distance.

        Parameters
        ----------
        distance : (N,) array_like [cells]
            From 0 to ``length``.

        Returns
        -------
        (N, 3) ndarray [cells, cells, rad]
            x, y and the heading, which does not jump by 2 pi.
        """
        along = np.asarray(distance, float)
        # Backwards the curve starts towards angle + pi, and bends to the side to which the heading turns.
        angle = self.angle + (np.pi if self.is_reverse else 0.0)
        bend = np.sign(self.turn)
        arc = np.clip(along - self.before, 0.0, self.length - self.before - self.after)
        straight = np.minimum(along, self.before), np.maximum(0.0, along - self.length + self.after)
        turned = bend * arc / self.radius
        # The chord of an arc of angle t is 2 r sin(t / 2) long, in the direction of its middle.
        chord = 2 * self.radius * np.sin(np.abs(turned) / 2) if bend else np.zeros_like(arc)
        x, y = (straight[0] * f(angle) + chord * f(angle + turned / 2) + straight[1] * f(angle + turned)
                for f in (np.cos, np.sin))
        return np.stack([x, y, self.angle + turned], axis=-1)

    def points(self, spacing: float = 0.1) -> NDArray[np.float64]:
        """Return poses (N, 3) along the motion, at most ``spacing`` [cells] apart on the arc."""
        if not self.turn:
            return self.pose_at([0.0, self.length])
        return self.pose_at(np.linspace(0.0, self.length, int(np.ceil(self.length / spacing)) + 1))

    # It takes as long as the search of many a query, and every planner with these motions needs it.
    @lru_cache(maxsize=4096)
    def swept_cells(self, corner_cutting: bool = True) -> NDArray[np.int64]:
        """Return the cells that a point crosses on this motion, its first and last included.

        Parameters
        ----------
        corner_cutting : bool
            Whether a cell may be left out that is only touched at a corner.

        Returns
        -------
        (N, 2) ndarray of int64
            Sorted, read-only.
        """
        stations = np.unique(np.concatenate([[0.0, self.length], self._grid_crossings()]).round(12))
        middles = self.pose_at((stations[1:] + stations[:-1]) / 2)[:, :2]
        cells = [np.rint(middles)]
        if not corner_cutting:
            crossings = self.pose_at(stations)[:, :2]
            corners = crossings[(np.abs(crossings - np.floor(crossings) - 0.5) < 1e-6).all(axis=1)]
            cells += [np.rint(corners + (0.25 * dx, 0.25 * dy)) for dx in (-1, 1) for dy in (-1, 1)]
        result = np.unique(np.concatenate(cells).astype(np.int64), axis=0)
        result.flags.writeable = False
        return result

    def _grid_crossings(self):
        """Return the distances [cells] at which the curve meets a line between cells."""
        reach = int(self.length) + 1
        lines = np.arange(-reach, reach) + 0.5
        found = []
        arc = self.length - self.before - self.after
        for begin, end in ((0.0, self.before), (self.before + arc, self.length)):
            (x, y), (to_x, to_y) = self.pose_at([begin, end])[:, :2]
            for low, high in ((x, to_x), (y, to_y)):
                if abs(high - low) > _TINY:
                    share = (lines - low) / (high - low)
                    found.append(begin + (end - begin) * share[(share >= 0) & (share <= 1)])
        if self.turn:
            bend = np.sign(self.turn)
            x, y, angle = self.pose_at([self.before])[0]
            # From the centre the curve's points are seen in this direction, and it turns as the heading does.
            side = angle + (np.pi if self.is_reverse else 0.0) - bend * np.pi / 2
            centre = np.array([x, y]) - self.radius * np.array([np.cos(side), np.sin(side)])
            for i, inverse in enumerate((np.arccos, np.arcsin)):
                value = (lines - centre[i]) / self.radius
                root = inverse(value[np.abs(value) <= 1])
                for direction in np.concatenate([root, (-root if i == 0 else np.pi - root)]):
                    turned = np.mod(bend * (direction - side), 2 * np.pi)
                    found.append([self.before + self.radius * turned] if self.radius * turned <= arc else [])
        return np.concatenate([np.empty(0), *found])


def heading_vectors(headings: int) -> NDArray[np.int64]:
    """Return the shortest vector of integers in each heading.

    Parameters
    ----------
    headings : int
        4, or a multiple of 8 up to 64.

    Returns
    -------
    (headings, 2) ndarray of int64

    Raises
    ------
    InvalidInput
        If the number is none of these.

    Examples
    --------
    >>> heading_vectors(16)[:5].tolist()
    [[1, 0], [2, 1], [1, 1], [1, 2], [0, 1]]
    """
    if isinstance(headings, bool) or headings not in (4, *range(8, MAX_HEADINGS + 1, 8)):
        raise InvalidInput(f'headings {headings!r} is not 4 or a multiple of 8 up to {MAX_HEADINGS}')
    half = max(1, int(headings) // 8)
    side = [(half, y) for y in range(0, half + 1)] + [(x, half) for x in range(half - 1, 0, -1)]
    quarter = [(1, 0)] if headings == 4 else [(x // gcd(x, y), y // gcd(x, y)) for x, y in side]
    turned = [quarter]
    for _ in range(3):
        turned.append([(-y, x) for x, y in turned[-1]])
    return np.array([vector for part in turned for vector in part])


@lru_cache(maxsize=16)
def motion_primitives(headings: int = 4, radius: float = 1.0, reverse: bool = False) -> tuple[MotionPrimitive, ...]:
    """Return the motions of a lattice, sorted by their first heading; within one S, L, R, then s, l, r.

    From each heading there is one straight motion, to the next cell centre in that direction; and to each side the
    shortest arc of at least the radius to the next heading, plus arcs to headings up to a quarter turn away where the
    lattice lets them be at least 5 % sharper. Each arc has the largest radius that fits between its ends.

    Parameters
    ----------
    headings : int
        4, or a multiple of 8 up to 64.
    radius : float [cells]
        Least turning radius, above 0 and at most 100.
    reverse : bool
        Whether each motion can also be driven backwards.

    Raises
    ------
    InvalidInput
        If a number is out of its range.

    Examples
    --------
    >>> [(p.code, p.end, round(p.length, 3)) for p in motion_primitives(4)[:3]]
    [('S', (1, 0), 1.0), ('L', (1, 1), 1.571), ('R', (1, -1), 1.571)]
    """
    vectors = heading_vectors(headings)
    if not (isinstance(radius, (int, float, np.number)) and 0 < radius <= MAX_RADIUS):
        raise InvalidInput(f'radius {radius!r} cells is not above 0 and at most {MAX_RADIUS:g}')
    angles = np.arctan2(vectors[:, 1], vectors[:, 0])
    forward = []
    for heading, vector in enumerate(vectors):
        length = float(np.hypot(*vector))
        forward.append(MotionPrimitive('S', 'S', heading, heading, tuple(vector.tolist()), length, 0.0, np.inf, length,
                                       0.0, float(angles[heading])))
        for code, side in (('L', 1), ('R', -1)):
            sharpest = np.inf
            for steps in range(1, headings // 4 + 1):
                end_heading = (heading + side * steps) % headings
                arc = _arc(code, steps, heading, end_heading, vectors, angles, radius)
                if arc.radius < _SHARPER * sharpest:
                    sharpest = arc.radius
                    forward.append(arc)
    backward = [_reversed(motion, angles) for motion in forward] if reverse else []
    return tuple(sorted(forward + backward, key=lambda motion: (motion.heading, motion.is_reverse)))


@lru_cache(maxsize=4096)
def octile_length(motion: MotionPrimitive, corner_cutting: bool) -> float:
    """Return the length [cells] of the shortest way from its first cell to its last in 8-connected steps on its cells.

    A lattice search guides itself by the cost-to-go field of such steps: no motion takes more off it than this.
    """
    cells = motion.swept_cells(corner_cutting)
    low = cells.min(axis=0)
    occupied = np.ones(cells.max(axis=0) - low + 1, bool).T
    occupied[tuple((cells - low).T[::-1])] = False
    start = -low
    return float(cost_to_go(occupied, motion.end - low, corner_cutting=corner_cutting)[start[1], start[0]])


def _arc(code, steps, heading, end_heading, vectors, angles, radius):
    """Return the shortest motion between two headings that ends on a cell centre and turns no tighter than allowed."""
    first, last = (vectors[i] / np.hypot(*vectors[i]) for i in (heading, end_heading))
    sine, cosine = first[0] * last[1] - first[1] * last[0], first @ last
    turn = float(np.arctan2(sine, cosine))
    tangent = float(abs(sine) / (1 + cosine))  # of half the turn; exact where the headings are axes
    # The sides from the start and the end to the point where the two lines meet; whole multiples of the vectors end
    # on a cell centre, so that no candidate need be longer.
    shortest = radius * tangent * (1 - _TINY)
    bound = sum(np.hypot(*vectors[i]) * np.ceil(shortest / np.hypot(*vectors[i])) for i in (heading, end_heading))
    span = np.arange(-int(bound) - 1, int(bound) + 2)
    x, y = (axis.ravel() for axis in np.meshgrid(span, span))
    before, after = (x * last[1] - y * last[0]) / sine, (first[0] * y - first[1] * x) / sine
    fits = (np.minimum(before, after) >= max(shortest, _TINY)) & (before + after <= bound + _TINY)
    x, y, before, after = x[fits], y[fits], before[fits], after[fits]
    fillet = np.minimum(before, after)
    length = before + after - 2 * fillet + abs(turn) * fillet / tangent
    # Of equally long ones the one that goes straight first: the same choice in every direction and for both sides.
    best = np.lexsort([-before.round(9), length.round(9)])[0]
    fillet = fillet[best]
    name = code if len(vectors) == 4 else f'{code}{steps}'
    return MotionPrimitive(
        code, name, heading, end_heading, (int(x[best]), int(y[best])), float(length[best]), turn,
        float(fillet / tangent), float(before[best] - fillet), float(after[best] - fillet), float(angles[heading]))


def _reversed(motion, angles):
    """Return the motion that takes another one back, driven backwards."""
    x, y = motion.end
    return MotionPrimitive(
        motion.code.lower(), motion.name.lower(), motion.end_heading, motion.heading, (-x, -y), motion.length,
        -motion.turn, motion.radius, motion.after, motion.before, float(angles[motion.end_heading]))
