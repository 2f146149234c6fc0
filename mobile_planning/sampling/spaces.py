"""Spaces that a roadmap is laid in: n joints with a collision function of the user's, and what every space must do.

The plane and the car of Dubins are in `spaces_environment`.
"""
from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.world.environment import Environment
from mobile_planning.world.surroundings import Surroundings

# Points that one call of a collision function is given at most.
_CHUNK = 1 << 14
NO_PLANE = Surroundings(Environment().space(), np.empty((0, 0)), np.zeros(4))


class Space(Protocol):
    """Where points are, how far one is from another, and which are free.

    Attributes
    ----------
    low, high : (d,) ndarray
        Bounds of the points.
    is_directed : bool
        Whether the way from a to b is another one than from b to a.
    lookahead : int
        Edges that a lazy search has checked at once: 1 where a check is dear, more where the call costs more than the
        check.
    plane : Surroundings
        Of straight lines in the plane: what `PlaneSpace` knows of it, so that a search checks its edges by itself.
        `NO_PLANE` in any other space.
    kind : str
        Names the space and what its lengths depend on; a saved roadmap is loaded into the same kind only.
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]
    is_directed: bool
    lookahead: int
    plane: Surroundings
    kind: str

    def normalised(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the same points (n, d), angles in the range that the bounds have them in."""

    def coordinates(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return (n, k) coordinates whose Euclidean distance is nowhere more than the length of the way."""

    def lengths(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the length (n,) [m] of the shortest way from each start (n, d) to its end, were nothing in the way."""

    def free(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which points (n, d) are free."""

    def edges_free(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which ways are free from one end to the other; both ends are free already."""

    def interpolate(self, starts: NDArray[np.float64], ends: NDArray[np.float64],
                    shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points (n, d) where these shares (n,) of each way lie behind."""


class JointSpace:
    """n joints between bounds, moved along straight lines, with a collision function of the user's.

    Parameters
    ----------
    low, high : (n,) array_like
        Bounds of each joint [rad or m].
    free : callable
        Takes configurations (m, n) and returns which (m,) are free of collision.
    weights : (n,) array_like, optional
        Metres that the robot moves at most for each unit of a joint, above 0; 1 by default. `joint_weights` estimates
        them. The metric is the Euclidean distance of the weighted joints.
    resolution : float [m]
        A straight way counts as free when points of it are that are at most this far apart in the metric.
    lookahead : int
        Edges that a lazy search checks at once; between them it looks at the clock.

    Raises
    ------
    InvalidInput
        If a bound is not finite or not above the other, or a weight or the resolution not above 0.

    Examples
    --------
    >>> space = JointSpace([-1, -1], [1, 1], lambda q: np.linalg.norm(q, axis=1) > 0.5, resolution=0.01)
    >>> space.edges_free(np.array([[-1.0, 0.0], [-1.0, 0.9]]), np.array([[1.0, 0.0], [1.0, 0.9]]))
    array([False,  True])
    """

    is_directed = False
    plane = NO_PLANE

    def __init__(self, low: ArrayLike, high: ArrayLike, free: Callable[[NDArray[np.float64]], ArrayLike], *,
                 weights: ArrayLike | None = None, resolution: float = 0.05, lookahead: int = 8):
        self.low, self.high = (np.array(bound, dtype=float).reshape(-1) for bound in (low, high))
        if self.low.shape != self.high.shape or not len(self.low):
            raise InvalidInput(f'{len(self.low)} lower and {len(self.high)} upper bounds of joints')
        if not (np.isfinite([self.low, self.high]).all() and (self.low < self.high).all()):
            raise InvalidInput(f'the bounds {self.low.tolist()} to {self.high.tolist()} are not finite and ascending')
        self.weights = np.ones(len(self.low)) if weights is None else np.array(weights, dtype=float).reshape(-1)
        if self.weights.shape != self.low.shape or not (np.isfinite(self.weights).all() and (self.weights > 0).all()):
            raise InvalidInput(f'the weights {self.weights.tolist()} are not {len(self.low)} finite numbers above 0')
        if not 0 < resolution < np.inf:
            raise InvalidInput(f'the resolution of {resolution} m is not above 0')
        if not lookahead >= 1:
            raise InvalidInput(f'a lookahead of {lookahead} edges is below 1')
        self.resolution, self.lookahead = float(resolution), int(lookahead)
        self._free = free

    @property
    def kind(self) -> str:
        """The number of joints and their weights."""
        return f'joints, weights {self.weights.tolist()}'

    def normalised(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points."""
        return points

    def coordinates(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the weighted joints."""
        return points * self.weights

    def lengths(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the weighted Euclidean distances (n,) [m]."""
        return np.sqrt((((ends - starts) * self.weights) ** 2).sum(axis=-1))

    def free(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which configurations (n, d) are free.

        Raises
        ------
        InvalidInput
            If the user's function does not answer with one truth value for each.
        """
        return checked_mask(self._free, points)

    def edges_free(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which straight ways are free, checked from the coarse to the fine."""
        return free_between(self, self.free, starts, ends, self.resolution)

    def interpolate(self, starts: NDArray[np.float64], ends: NDArray[np.float64],
                    shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points (n, d) on the straight ways."""
        return starts + (ends - starts) * shares[:, None]


def joint_weights(position: Callable[[NDArray[np.float64]], ArrayLike], low: ArrayLike, high: ArrayLike, *,
                  seed: int = 0, samples: int = 1000) -> NDArray[np.float64]:
    """Return the weight of each joint, estimated as RobWork's planner does: the worst motion of the tool.

    At ``samples`` configurations drawn evenly, the column of the tool's Jacobian that belongs to a joint says how far
    the tool moves for one unit of it; the longest one counts. A joint that does not move the tool gets a thousandth of
    the greatest weight, since a motion that costs nothing would never be looked at.

    Parameters
    ----------
    position : callable
        Takes configurations (m, n) and returns the tool's positions (m, k) [m].
    low, high : (n,) array_like
        Bounds of the joints.
    seed : int
    samples : int

    Returns
    -------
    (n,) ndarray [m per unit]

    Raises
    ------
    InvalidInput
        If a position is not finite, or no joint moves the tool.

    Examples
    --------
    >>> joint_weights(lambda q: np.column_stack([2 * q[:, 0], q[:, 1]]), [0, 0], [1, 1]).round(6).tolist()
    [2.0, 1.0]
    """
    low, high = np.array(low, dtype=float), np.array(high, dtype=float)
    points = np.random.default_rng(seed).uniform(low, high, (samples, len(low)))
    weights = np.empty(len(low))
    for joint, span in enumerate(high - low):
        step = np.zeros(len(low))
        step[joint] = 1e-6 * span
        moved = (np.asarray(position(points + step)) - np.asarray(position(points - step))) / (2e-6 * span)
        weights[joint] = np.linalg.norm(moved.reshape(samples, -1), axis=1).max()
    if not np.isfinite(weights).all() or not weights.max() > 0:
        raise InvalidInput(f'the position moves by {weights.tolist()} m for one unit of each joint')
    return np.maximum(weights, 1e-3 * weights.max())


def free_between(space: Space, free: Callable[[NDArray[np.float64]], NDArray[np.bool_]], starts: NDArray[np.float64],
                 ends: NDArray[np.float64], resolution: float) -> NDArray[np.bool_]:
    """Return which ways are free at points between their ends that are at most a resolution apart.

    The middle of every way is looked at first, then the quarters and so on (Sanchez and Latombe 2002), so that most
    ways that are not free cost little.

    Parameters
    ----------
    space : Space
    free : callable
        Takes points (m, d) and returns which are free.
    starts, ends : (n, d) ndarray
    resolution : float [m]
    """
    is_free = np.ones(len(starts), bool)
    parts = np.maximum(space.lengths(starts, ends) / resolution, 1.0)
    level = 1
    while (open_ := np.flatnonzero(is_free & (parts > 2.0 ** (level - 1)))).size:
        shares = (2 * np.arange(2 ** (level - 1)) + 1) / 2.0 ** level
        ways = np.repeat(open_, len(shares))
        shares = np.tile(shares, len(open_))
        for first in range(0, len(ways), _CHUNK):
            part = slice(first, first + _CHUNK)
            points = space.interpolate(starts[ways[part]], ends[ways[part]], shares[part])
            is_free[ways[part][~free(points)]] = False
        level += 1
    return is_free


def checked_mask(function: Callable[[NDArray[np.float64]], ArrayLike], points: NDArray[np.float64]
                 ) -> NDArray[np.bool_]:
    """Return what a function of the user's says of each point, or raise InvalidInput if it is no answer."""
    if not len(points):
        return np.empty(0, bool)
    answer = np.asarray(function(points))
    if answer.shape != (len(points),) or answer.dtype != bool:
        raise InvalidInput(f'the function answers {len(points)} points with {answer.dtype} of shape {answer.shape}, '
                           'not with one bool each')
    return answer


class ConstrainedSpace:
    """A space of which only those points count as free that a further constraint allows.

    Parameters
    ----------
    space : Space
    constraint : callable
        Takes points (m, d) and returns which are allowed.
    resolution : float [m]
        How far apart the points of a way are at which it is asked.
    """

    plane = NO_PLANE

    def __init__(self, space: Space, constraint: Callable[[NDArray[np.float64]], ArrayLike], resolution: float):
        self._space, self._constraint, self._resolution = space, constraint, resolution
        self.low, self.high, self.kind = space.low, space.high, space.kind
        self.is_directed, self.lookahead = space.is_directed, space.lookahead
        self.normalised, self.coordinates = space.normalised, space.coordinates
        self.lengths, self.interpolate = space.lengths, space.interpolate

    def free(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which points are free in the space and allowed."""
        return self._space.free(points) & checked_mask(self._constraint, points)

    def edges_free(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which ways are free in the space and allowed all along."""
        is_free = self._space.edges_free(starts, ends)
        allowed = free_between(self._space, lambda points: checked_mask(self._constraint, points),
                               starts[is_free], ends[is_free], self._resolution)
        is_free[is_free] = allowed
        return is_free
