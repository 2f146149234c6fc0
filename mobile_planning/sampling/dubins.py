"""Dubins paths: the shortest curves between two poses for a car that drives forwards.

Dubins, L. E. (1957). On curves of minimal length with a constraint on average curvature, and with prescribed initial
and terminal positions and tangents. American Journal of Mathematics 79(3).
"""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput, NoPath
from mobile_planning.sampling.curve import Curve, pose_of, poses_of, radius_of

#: In the order of their codes in the kernels.
WORDS = ('LSL', 'RSR', 'RSL', 'LSR', 'RLR', 'LRL')


@dataclass(frozen=True)
class DubinsPath(Curve):
    """A curve of three segments, driven forwards (see `Curve`).

    Examples
    --------
    >>> path = dubins_shortest((0, 0, 0), (10, 0, 0), radius=2)
    >>> path.word, path.length, path.pose_at(4)
    ('LSL', 10.0, (4.0, 0.0, 0.0))
    >>> path.sample(5)
    array([[ 0.,  0.,  0.],
           [ 5.,  0.,  0.],
           [10.,  0.,  0.]])
    """

    def __post_init__(self):
        super().__post_init__()
        if self.word not in WORDS or min(self.lengths) < 0:
            raise InvalidInput(f'word {self.word!r} with lengths {self.lengths} m is none of Dubins: {WORDS}, '
                               'no length below 0')


def dubins_shortest(start: ArrayLike, goal: ArrayLike, radius: float,
                    words: Iterable[str] = WORDS) -> DubinsPath:
    """Return the shortest path from start to goal, of those whose word is allowed.

    Parameters
    ----------
    start, goal : (3,) array_like [m, m, rad]
        x, y and heading.
    radius : float [m]
        Least turning radius, above 0.
    words : iterable of str
        Some of LSL, RSR, RSL, LSR, RLR and LRL.

    Raises
    ------
    InvalidInput
        If a number is not finite, the radius is not above 0 or a word is unknown.
    NoPath
        If none of the words leads there; LSL and RSR always do.

    Examples
    --------
    >>> round(dubins_shortest((0, 0, 0), (0, 0, np.pi), radius=1).length, 6)
    7.330383
    """
    from mobile_planning.sampling.dubins_kernels import shortest_between

    start, goal, radius = pose_of(start, 'start'), pose_of(goal, 'goal'), radius_of(radius)
    _, code, *lengths = shortest_between(*start, *goal, radius, _mask(words))
    if code < 0:
        raise NoPath(f'none of the words {", ".join(words)} leads from {start.tolist()} to {goal.tolist()}')
    return DubinsPath(tuple(start), WORDS[code], tuple(lengths), radius)


def dubins_options(start: ArrayLike, goal: ArrayLike, radius: float) -> list[DubinsPath]:
    """Return the path of each word that leads from start to goal, the shortest first, equal ones in the order of WORDS.

    Parameters
    ----------
    start, goal : (3,) array_like [m, m, rad]
    radius : float [m]

    Examples
    --------
    >>> [path.word for path in dubins_options((0, 0, 0), (20, 5, 0), radius=2)]
    ['LSR', 'LSL', 'RSR', 'RSL']
    """
    from mobile_planning.sampling.dubins_kernels import shortest_between

    start, goal, radius = pose_of(start, 'start'), pose_of(goal, 'goal'), radius_of(radius)
    found = [shortest_between(*start, *goal, radius, 1 << code) for code in range(len(WORDS))]
    return [DubinsPath(tuple(start), WORDS[code], tuple(lengths), radius)
            for _, code, *lengths in sorted(found) if code >= 0]


def dubins_lengths(starts: ArrayLike, goals: ArrayLike, radius: float,
                   words: Iterable[str] = WORDS) -> NDArray[np.float64]:
    """Return the length of the shortest path of each pair of poses.

    Parameters
    ----------
    starts, goals : (n, 3) or (3,) array_like [m, m, rad]
        One pose alone goes with all of the other's.
    radius : float [m]
    words : iterable of str

    Returns
    -------
    (n,) ndarray [m]
        Infinite where none of the words leads there.

    Examples
    --------
    >>> dubins_lengths([(0, 0, 0), (3, 4, 0)], (10, 4, 0), radius=1).round(3)
    array([10.79,  7.  ])
    """
    from mobile_planning.sampling.dubins_kernels import lengths_between

    starts, goals = (poses_of(np.atleast_2d(np.asarray(poses, float)), name)
                     for poses, name in ((starts, 'starts'), (goals, 'goals')))
    count = max(len(starts), len(goals)) if len(starts) and len(goals) else 0
    if not (len(starts) in (1, count) and len(goals) in (1, count)):
        raise InvalidInput(f'{len(starts)} starts and {len(goals)} goals do not make pairs')
    lengths = np.empty(count)
    lengths_between(starts, goals, radius_of(radius), _mask(words), lengths)
    return lengths


def _mask(words: Iterable[str]) -> int:
    """Return the set of words as the kernels' bits."""
    words = tuple(words)
    unknown = set(words) - set(WORDS)
    if unknown or not words:
        raise InvalidInput(f'words {words} must be some of {WORDS}')
    return sum(1 << WORDS.index(word) for word in set(words))
