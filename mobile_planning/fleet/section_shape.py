"""The shape of one section: control points and samples as functions of the variables of its program.

The section goes on from a given motion and ends at rest, so that its first three control points are given and its last
three are equal. A robot that sets out from rest leaves along a given direction.
"""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet import clamped_spline
from mobile_planning.fleet.horizon_blocks import Samples

#: A departure's first step [m] at least, so that later points do not choose another direction.
_LEAVES = 1e-3


class SectionShape:
    """The spline of one section.

    Parameters
    ----------
    breaks : (m + 1,) array_like
        Ends of the knot intervals, from 0 to 1, m at least 4.
    motion : (3, 2) ndarray [m, m/s, m/s^2]
        Position, velocity and acceleration that it goes on from.
    duration : float [s] or None
        None: it is free, the last variable.
    goal : (2,) ndarray [m] or None
        Where it ends; None: that is free, two variables.
    direction : (2,) ndarray or None
        Unit vector along which it leaves; only from rest.
    samples : int
        Number of even sample times, the start counted but left out; the knots come on top.

    Attributes
    ----------
    size : int
        Variables: coordinates [m] from the start of the free control points, in order, then the duration [s].
    """

    def __init__(self, breaks: ArrayLike, motion: NDArray, duration: float | None, *, goal: NDArray | None = None,
                 direction: NDArray | None = None, samples: int = 20):
        breaks = np.asarray(breaks, float)
        self._first, self._motion, self._duration = breaks[1:3], motion, duration
        self._direction, self._goal = direction, goal
        knots = clamped_spline.gen_knots(breaks)
        count = len(knots) - clamped_spline.DEGREE - 1
        self._sites = np.array([knots[i + 1:i + 4].mean() for i in range(count)])
        # At the knots too, where the acceleration is greatest.
        self.u = np.unique(np.concatenate([np.linspace(0.0, 1.0, samples), breaks]).round(12))[1:]
        self._basis = np.stack([clamped_spline.basis(knots, self.u, order) for order in range(3)])
        columns = []
        for index in range(3, count - 2):
            is_end = index == count - 3
            if is_end and goal is not None:
                continue
            rows = slice(index, count) if is_end else slice(index, index + 1)
            along = [direction] if index == 3 and direction is not None and not is_end else np.eye(2)
            for axis in along:
                column = np.zeros((count, 2))
                column[rows] = axis
                columns.append(column)
        self._spread = np.stack(columns, axis=2)                    # (n, 2, X)
        self._base = np.tile(motion[0], (count, 1))
        if goal is not None:
            self._base[-3:] = goal
        self.is_free = duration is None
        self.size = len(columns) + self.is_free
        spread = np.concatenate([self._spread, np.zeros((count, 2, int(self.is_free)))], axis=2)
        self._sampled = np.einsum('osn,ndx->osdx', self._basis, spread)

    def duration(self, x: NDArray) -> float:
        """Return the duration [s]."""
        return float(x[-1]) if self.is_free else self._duration

    def points(self, x: NDArray) -> NDArray[np.float64]:
        """Return the clamped control points (n, 2) [m]."""
        return self._points(x)[0]

    def _points(self, x):
        points = self._base + self._spread @ x[:self._spread.shape[2]]
        points[:3], slopes = clamped_spline.start_points(*self._first, self._motion, self.duration(x))
        return points, slopes

    def samples(self, x: NDArray) -> Samples:
        """Return the motion at the sample times, and its slopes."""
        points, slopes = self._points(x)
        duration, (dz, dv, da) = self.duration(x), self._sampled
        z, v, a = self._basis @ points
        v, a, dv, da = v / duration, a / duration**2, dv / duration, da / duration**2
        if self.is_free:
            moved = self._basis[:, :, :3] @ slopes
            dz, dv, da = dz.copy(), dv.copy(), da.copy()
            dz[:, :, -1] = moved[0]
            dv[:, :, -1] = moved[1] / duration - v / duration
            da[:, :, -1] = moved[2] / duration**2 - 2 * a / duration
        return Samples(self.u, duration, z, v, a, dz, dv, da, self.is_free)

    def guess(self, target: NDArray, duration: float, bend: float = 0.0) -> NDArray[np.float64]:
        """Return variables of a section on the line to ``target`` (2,) [m], or bent by ``bend`` [m] to its right."""
        fixed, _ = clamped_spline.start_points(*self._first, self._motion, duration)
        share = np.clip((self._sites - self._sites[2]) / (self._sites[-3] - self._sites[2]), 0.0, 1.0)[:, None]
        way = target - fixed[2]
        right = np.array([way[1], -way[0]]) / max(np.linalg.norm(way), 1e-9)
        return self.fit(fixed[2] + share * way + bend * np.sin(np.pi * share) * right, duration)

    def fit(self, points: NDArray, duration: float) -> NDArray[np.float64]:
        """Return the variables whose control points are nearest to ``points`` (n, 2) [m]."""
        away = points - self._base
        x = (self._spread * away[:, :, None]).sum(axis=(0, 1)) / (self._spread**2).sum(axis=(0, 1))
        if self._direction is not None:
            x[0] = max(x[0], _LEAVES)
        return np.append(x, duration) if self.is_free else x

    def bounds(self, reach: float, shortest: float, longest: float) -> tuple[NDArray, NDArray]:
        """Return bounds (size,) of the variables: ``reach`` [m] from the start, and of a free duration [s]."""
        low, high = np.full(self.size, -reach), np.full(self.size, reach)
        if self._direction is not None:
            low[0] = _LEAVES
        if self.is_free:
            low[-1], high[-1] = shortest, longest
        return low, high

    def roughness(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return Hessian and gradient of half the sum of the squared second differences of the control points."""
        second = np.diff(np.eye(len(self._base)), n=2, axis=0)
        base = self._base.copy()
        base[:3] = clamped_spline.start_points(*self._first, self._motion, self._duration or 1.0)[0]
        rows = np.einsum('mn,ndx->mdx', second, self._spread).reshape(-1, self._spread.shape[2])
        hessian, gradient = np.zeros((self.size, self.size)), np.zeros(self.size)
        count = self._spread.shape[2]
        hessian[:count, :count], gradient[:count] = rows.T @ rows, rows.T @ (second @ base).ravel()
        return hessian, gradient

    @property
    def ends_at_goal(self) -> bool:
        """Whether the section ends at a given place."""
        return self._goal is not None

    @property
    def end(self) -> slice:
        """Which variables are the end of the section, where that is free."""
        count = self._spread.shape[2]
        return slice(count - 2, count)
