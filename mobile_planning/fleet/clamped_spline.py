"""Clamped cubic B-splines: how one section of the receding horizon is written, and how it becomes a published plan.

A section of duration T is a spline on normalised time u = 0..1 with few knots. Where its knots lie on the fleet's grid
of knots, it is a uniform spline on that grid too, point for point the same motion.
"""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

#: Degree of the splines; a section has so many control points more than knot intervals.
DEGREE = 3


def gen_knots(breaks: NDArray) -> NDArray[np.float64]:
    """Return the clamped knot vector (m + 7,) whose intervals end at ``breaks`` (m + 1,).

    Examples
    --------
    >>> gen_knots(np.array([0.0, 0.5, 1.0])).tolist()
    [0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0, 1.0]
    """
    return np.concatenate([np.full(DEGREE, breaks[0]), breaks, np.full(DEGREE, breaks[-1])]).astype(float)


def basis(knots: NDArray, u: NDArray, order: int = 0) -> NDArray[np.float64]:
    """Return the matrix (S, n) from n control points to the derivative of ``order`` at ``u`` (S,)."""
    spline = BSpline(knots, np.eye(len(knots) - DEGREE - 1), DEGREE)
    return (spline.derivative(order) if order else spline)(u)


def comb_bsp(knots: NDArray, points: NDArray, u: NDArray, order: int = 0) -> NDArray[np.float64]:
    """Return the derivative of ``order`` (S, 2) at ``u`` (S,) of the spline with the control ``points`` (n, 2)."""
    return basis(knots, u, order) @ points


def even_breaks(spans: int, intervals: int) -> NDArray[np.int64]:
    """Return the ends (intervals + 1,) of knot intervals, as even as the grid of ``spans`` spans allows.

    Examples
    --------
    >>> even_breaks(16, 5).tolist()
    [0, 3, 6, 10, 13, 16]
    """
    return np.round(np.linspace(0, spans, intervals + 1)).astype(int)


def to_uniform(breaks: NDArray) -> NDArray[np.float64]:
    """Return the matrix (M + 3, n) from clamped control points to those of the same motion on all M spans of the grid.

    Parameters
    ----------
    breaks : (m + 1,) ndarray of int
        Where the knots are on the grid, from 0 to M.
    """
    spans = int(breaks[-1])
    sites = np.sort(np.concatenate([np.arange(spans + 1), [0.5, spans - 0.5]]))
    return np.linalg.solve(basis(np.arange(-DEGREE, spans + DEGREE + 1.0), sites), basis(gen_knots(breaks), sites))


def start_points(u1: float, u2: float, motion: NDArray, duration: float) -> tuple[NDArray, NDArray]:
    """Return the first three control points (3, 2) [m] of a section, and their derivative by its duration [m/s].

    Parameters
    ----------
    u1, u2 : float
        Ends of the first two knot intervals, as shares of the duration.
    motion : (3, 2) ndarray [m, m/s, m/s^2]
        Position, velocity and acceleration at the start.
    duration : float [s]
    """
    position, velocity, acceleration = motion
    points = np.array([position, position + velocity * u1 * duration / 3,
                       position + (u1 + u2) * duration / 3 * velocity
                       + u1 * u2 * duration**2 / 6 * acceleration])
    slopes = np.array([np.zeros(2), velocity * u1 / 3,
                       (u1 + u2) / 3 * velocity + u1 * u2 * duration / 3 * acceleration])
    return points, slopes
