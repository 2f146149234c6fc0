"""Reeds-Shepp paths: the shortest curves between two poses for a car that drives forwards and backwards.

Reeds, J. A. and Shepp, L. A. (1990). Optimal paths for a car that goes both forwards and backwards. Pacific Journal of
Mathematics 145(2).
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.sampling.curve import TURN_OF, Curve, pose_of, poses_of, radius_of

_LETTER_OF = {turn: letter for letter, turn in TURN_OF.items()}
# Two ways to the same path differ by rounding only.
_SAME = 1e-9


@dataclass(frozen=True)
class ReedsSheppPath(Curve):
    """A curve of up to five segments, those of negative length driven backwards (see `Curve`).

    Examples
    --------
    >>> path = reeds_shepp_shortest((0, 0, 0), (-3, 0, 0), radius=2)
    >>> path.word, path.lengths, path.length
    ('S', (-3.0,), 3.0)
    """


def reeds_shepp_shortest(start: ArrayLike, goal: ArrayLike, radius: float) -> ReedsSheppPath:
    """Return the shortest path from start to goal.

    Parameters
    ----------
    start, goal : (3,) array_like [m, m, rad]
        x, y and heading.
    radius : float [m]
        Least turning radius, above 0.

    Raises
    ------
    InvalidInput
        If a number is not finite or the radius is not above 0.

    Examples
    --------
    >>> round(reeds_shepp_shortest((0, 0, 0), (0, 0, np.pi), radius=1).length, 6)
    3.141593
    """
    from mobile_planning.sampling.reeds_shepp_kernels import shortest_between

    start, goal, radius = pose_of(start, 'start'), pose_of(goal, 'goal'), radius_of(radius)
    _, word, *lengths = shortest_between(*start, *goal, radius)
    return _path(start, word, lengths, radius)


def reeds_shepp_options(start: ArrayLike, goal: ArrayLike, radius: float) -> list[ReedsSheppPath]:
    """Return the path of each word that leads from start to goal, the shortest first; each path once.

    Examples
    --------
    >>> [(path.word, round(path.length, 3)) for path in reeds_shepp_options((0, 0, 0), (4, 0, 0), radius=1)][:2]
    [('S', 4.0), ('LRLR', 4.429)]
    """
    from mobile_planning.sampling.reeds_shepp_kernels import FORMULAS, miss, solve_word, total, wrapped

    start, goal, radius = pose_of(start, 'start'), pose_of(goal, 'goal'), radius_of(radius)
    dx, dy = (goal[:2] - start[:2]) / radius
    cos, sin = np.cos(start[2]), np.sin(start[2])
    local = (cos * dx + sin * dy, cos * dy - sin * dx, wrapped(goal[2] - start[2]))
    found = []
    for word in (formula + 16 * change for change in range(8) for formula in range(FORMULAS)):
        lengths = solve_word(*local, word)
        if total(lengths) < np.inf and miss(*local, word, lengths) < 1e-8:
            found.append(_path(start, word, [radius * length for length in lengths], radius))
    found.sort(key=lambda path: path.length)
    unique = {}
    for path in found:
        unique.setdefault((path.word, *np.round(np.array(path.lengths) / _SAME / 1e3)), path)
    return list(unique.values())


def reeds_shepp_lengths(starts: ArrayLike, goals: ArrayLike, radius: float) -> NDArray[np.float64]:
    """Return the length [m] (n,) of the shortest path of each pair of poses (n, 3); one pose goes with all others.

    Examples
    --------
    >>> reeds_shepp_lengths([(0, 0, 0), (9, 0, 0)], (4, 0, 0), radius=1)
    array([4., 5.])
    """
    from mobile_planning.sampling.reeds_shepp_kernels import lengths_between

    starts, goals = (poses_of(np.atleast_2d(np.asarray(poses, float)), name)
                     for poses, name in ((starts, 'starts'), (goals, 'goals')))
    count = max(len(starts), len(goals)) if len(starts) and len(goals) else 0
    if not (len(starts) in (1, count) and len(goals) in (1, count)):
        raise InvalidInput(f'{len(starts)} starts and {len(goals)} goals do not make pairs')
    lengths = np.empty(count)
    lengths_between(starts, goals, radius_of(radius), lengths)
    return lengths


def _path(start: NDArray[np.float64], word: int, lengths: list[float], radius: float) -> ReedsSheppPath:
    """Return the path that a kernel's solution stands for, without its empty segments."""
    from mobile_planning.sampling.reeds_shepp_kernels import BACKWARDS, MIRRORED, REVERSED, TURNS

    pieces = [(turn, length) for turn, length in zip(TURNS[word & 15].tolist(), lengths) if turn != 9]
    pieces = pieces[::-1] if word & REVERSED else pieces
    mirror, sign = (-1 if word & MIRRORED else 1), (-1.0 if word & BACKWARDS else 1.0)
    pieces = [(_LETTER_OF[mirror * turn], sign * length) for turn, length in pieces if abs(length) > 1e-12 * radius]
    pieces = pieces or [('S', 0.0)]
    return ReedsSheppPath(tuple(start), ''.join(letter for letter, _ in pieces),
                          tuple(length for _, length in pieces), radius)
