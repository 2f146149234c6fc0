"""A curve of arcs and straights, as a car with a least turning radius drives it."""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import ceil, isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import wrap_angle

TURN_OF = {'L': 1, 'S': 0, 'R': -1}
# A sampling finer than this many poses is taken for a mistake.
_MOST_POSES = 10_000_000


class Segment(NamedTuple):
    """One piece of a curve: ``kind`` L(eft), S(traight) or R(ight), ``length`` [m], negative if driven backwards."""

    kind: str
    length: float


@dataclass(frozen=True)
class Curve:
    """A curve from a start pose, segment by segment.

    Parameters
    ----------
    start : tuple of three float [m, m, rad]
        x, y and heading.
    word : str
        One letter a segment: L, S or R.
    lengths : tuple of float [m]
        Of the segments; negative where the car drives backwards.
    radius : float [m]
        Of the arcs, above 0.

    Raises
    ------
    InvalidInput
        If a number is not finite, a letter is unknown, or there are not as many lengths as letters.
    """

    start: tuple[float, float, float]
    word: str
    lengths: tuple[float, ...]
    radius: float

    def __post_init__(self):
        object.__setattr__(self, 'start', tuple(float(value) for value in pose_of(self.start, 'start')))
        object.__setattr__(self, 'radius', radius_of(self.radius))
        object.__setattr__(self, 'lengths', tuple(float(length) for length in self.lengths))
        if not set(self.word) <= set(TURN_OF) or len(self.word) != len(self.lengths) or not self.word:
            raise InvalidInput(f'word {self.word!r} with {len(self.lengths)} lengths: one letter L, S or R a length')
        if not all(isfinite(length) for length in self.lengths):
            raise InvalidInput(f'segment lengths {self.lengths} m are not all finite')

    @cached_property
    def length(self) -> float:
        """The sum of the segments' lengths [m]."""
        return float(sum(abs(length) for length in self.lengths))

    @property
    def segments(self) -> tuple[Segment, ...]:
        """The pieces in order."""
        return tuple(map(Segment, self.word, self.lengths))

    @property
    def end(self) -> tuple[float, float, float]:
        """The pose (x, y, heading) at the end [m, m, rad]."""
        return self.pose_at(self.length)

    def pose_at(self, s: float) -> tuple[float, float, float]:
        """Return the pose (x, y, heading) [m, m, rad] after ``s`` [m] along the curve, from 0 to its length.

        Raises
        ------
        InvalidInput
            If ``s`` lies outside the curve by more than rounding.
        """
        return tuple(float(value) for value in self._poses(np.array([self._inside(s)]))[0])

    def sample(self, step: float) -> NDArray[np.float64]:
        """Return poses along the curve, at most ``step`` apart, with every end of a segment among them.

        Parameters
        ----------
        step : float [m]
            Above 0.

        Returns
        -------
        (n, 3) ndarray [m, m, rad]
            From start to end; one pose if the length is 0.
        """
        if not (isfinite(step) and step > 0):
            raise InvalidInput(f'step {step} m is not a finite number above 0')
        if self.length / step > _MOST_POSES:
            raise InvalidInput(f'step {step} m would give more than {_MOST_POSES} poses')
        places, begun = [np.zeros(1)], 0.0
        for length in map(abs, self.lengths):
            if length > 0:
                places.append(begun + np.linspace(0.0, length, ceil(length / step) + 1)[1:])
            begun += length
        return self._poses(np.concatenate(places))

    def split(self, s: float) -> tuple[Curve, Curve]:
        """Return the curve up to ``s`` [m] and the curve from there on; their lengths add up to this one's."""
        place = self._inside(s)
        first, second = [], []
        for length in self.lengths:
            share = min(place, abs(length))
            place -= share
            sign = -1.0 if length < 0 else 1.0
            first.append(sign * share)
            second.append(sign * (abs(length) - share))
        kind = type(self)
        return (kind(self.start, self.word, tuple(first), self.radius),
                kind(self.pose_at(s), self.word, tuple(second), self.radius))

    @cached_property
    def _turns(self) -> NDArray[np.int64]:
        return np.array([TURN_OF[letter] for letter in self.word], np.int64)

    def _inside(self, s: float) -> float:
        slack = 1e-9 * max(1.0, self.length)
        if not -slack <= s <= self.length + slack:
            raise InvalidInput(f's = {s} m lies outside the curve of {self.length} m')
        return min(max(float(s), 0.0), self.length)

    def _poses(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        from mobile_planning.world.curve_kernels import write_poses

        poses = np.empty((len(places), 3))
        write_poses(*self.start, self._turns, np.array(self.lengths), self.radius, places, poses)
        poses[:, 2] = wrap_angle(poses[:, 2])
        return poses


def pose_of(pose: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return the pose as an array (3,), if it is x, y and a heading, all finite.

    Raises
    ------
    InvalidInput
    """
    return poses_of(pose, name, 1)


def poses_of(poses: ArrayLike, name: str, dimensions: int = 2) -> NDArray[np.float64]:
    """Return poses as a contiguous array (3,) or (n, 3), if all numbers are finite.

    Raises
    ------
    InvalidInput
    """
    try:
        poses = np.ascontiguousarray(poses, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{name} {poses!r} is not made of numbers (x, y, heading)') from None
    if poses.ndim != dimensions or poses.shape[-1] != 3:
        raise InvalidInput(f'{name} has shape {poses.shape}: it must be {"(n, 3)" if dimensions == 2 else "(3,)"}')
    if not np.isfinite(poses).all():
        raise InvalidInput(f'{name} {poses[~np.isfinite(poses)][0]} is not a finite number')
    return poses


def radius_of(radius: float) -> float:
    """Return the turning radius [m] as a float, if it is a finite number above 0.

    Raises
    ------
    InvalidInput
    """
    try:
        value = float(radius)
    except (TypeError, ValueError):
        value = float('nan')
    if not (isfinite(value) and value > 0):
        raise InvalidInput(f'turning radius {radius!r} m is not a finite number above 0')
    return value
