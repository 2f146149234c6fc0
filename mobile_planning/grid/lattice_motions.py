"""The headings and motions of one lattice, what each motion costs, and the curves that they make."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import wrap_angle
from mobile_planning.grid.motion_primitives import heading_vectors, motion_primitives


class LatticeMotions:
    """Motion primitives with their costs.

    Parameters
    ----------
    headings : int
    radius : float [cells]
    costs : (3,) array_like, optional
    reverse_cost : float, optional
    turn_cost : float [1/rad]
        All as those of `LatticePlanner`.

    Attributes
    ----------
    angles : (headings,) ndarray [rad]
        Counted from +x to the left.
    primitives : tuple of MotionPrimitive
        Sorted by their first heading.
    costs : (M,) ndarray
        Of the primitives, above 0.

    Raises
    ------
    InvalidInput
        If a number is out of its range.
    """

    def __init__(self, headings: int = 4, radius: float = 1.0, costs: ArrayLike | None = None,
                 reverse_cost: float | None = None, turn_cost: float = 0.0):
        vectors = heading_vectors(headings)
        self.angles = np.arctan2(vectors[:, 1], vectors[:, 0])
        self.angles.flags.writeable = False
        self.primitives = motion_primitives(headings, radius, reverse_cost is not None)
        weights = np.ones(3) if costs is None else numbers(costs, 'costs')
        if weights.shape != (3,) or not (np.isfinite(weights) & (weights > 0)).all():
            raise InvalidInput(f'costs {costs!r} are not three finite numbers above 0')
        if reverse_cost is not None and not 0 < numbers(reverse_cost, 'reverse_cost') < np.inf:
            raise InvalidInput(f'reverse_cost {reverse_cost} is not a finite number above 0')
        if not 0 <= numbers(turn_cost, 'turn_cost') < np.inf:
            raise InvalidInput(f'turn_cost {turn_cost} is not a finite number of at least 0')
        if costs is not None:
            weights = weights / (1.0, np.pi / 2, np.pi / 2)
        weight = dict(zip('SLR', weights.tolist()))
        self.costs = np.array([
            (weight[motion.code.upper()] * motion.length + turn_cost * abs(motion.turn))
            * (reverse_cost if motion.is_reverse else 1.0) for motion in self.primitives])

    def nearest_headings(self, theta: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return the indices of the headings nearest to angles [rad], and how far off they are [rad]."""
        off = np.abs(wrap_angle(np.asarray(theta, float)[..., None] - self.angles))
        return off.argmin(axis=-1), off.min(axis=-1)

    def curve(self, path: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the poses (P, 3) along a path of configurations (N, 3) [cells, cells, rad], and directions (P,).

        See `LatticePlanner.curve`.
        """
        known = {(motion.heading, *motion.end, motion.end_heading): motion for motion in self.primitives}
        headings, _ = self.nearest_headings(path[:, 2])
        curve, directions = [path[:1]], [np.ones(1)]
        for begin, end, heading, end_heading in zip(path, path[1:], headings.tolist(), headings[1:].tolist()):
            offset = np.rint(end[:2] - begin[:2]).astype(int).tolist()
            motion = known.get((heading, *offset, end_heading))
            poses = end[None] if motion is None else motion.points()[1:] + (*begin[:2], 0.0)
            curve.append(poses)
            directions.append(np.full(len(poses), -1.0 if motion is not None and motion.is_reverse else 1.0))
        return np.concatenate(curve), np.concatenate(directions)


def numbers(values: ArrayLike, name: str) -> NDArray[np.float64]:
    """Return what a caller gave as an array of numbers, or raise InvalidInput."""
    try:
        return np.asarray(values, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{name} {values!r} is no number, or has parts that are none') from None
