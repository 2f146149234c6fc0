"""Fences: everything that a plan must keep to, as half-planes that its Bezier points must not leave.

A span lies in the convex hull of its four Bezier points, so a plan whose points
keep to their fences keeps to them at every instant. The fences of a plan are
made from that plan, which keeps to them; what keeps to them is convex, so any
mixture of two plans that keep to all fences does too.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.contracts import Contract
from mobile_planning.world.convex_pieces import ConvexPieces


@dataclass(frozen=True, eq=False)
class Fences:
    """Half-planes ``normals[q] . b >= bounds[q, k]`` for the Bezier point b = (span, k) of span ``spans[q]``.

    Attributes
    ----------
    spans : (K,) ndarray of int
        Counted from the first span of the plan.
    normals : (K, 2) ndarray
        Unit vectors that point to the plan's side.
    bounds : (K, 4) ndarray [m]
    """

    spans: NDArray[np.intp]
    normals: NDArray[np.float64]
    bounds: NDArray[np.float64]

    def room(self, curves: NDArray) -> NDArray[np.float64]:
        """Return how far (K, 4) [m] the Bezier points (S, 4, 2) are inside their fences."""
        return np.einsum('qd,qkd->qk', self.normals, curves[self.spans]) - self.bounds

    def __add__(self, other: Fences) -> Fences:
        return Fences(np.concatenate([self.spans, other.spans]), np.concatenate([self.normals, other.normals]),
                      np.concatenate([self.bounds, other.bounds]))

    def __len__(self) -> int:
        return len(self.spans)


NONE = Fences(np.zeros(0, np.intp), np.zeros((0, 2)), np.zeros((0, 4)))


def of_contracts(bound: Sequence[tuple[Contract, bool]], first_span: int, count: int, radius: float) -> Fences:
    """Return the fences of contracts for ``count`` spans from ``first_span`` on.

    Parameters
    ----------
    bound : sequence of (Contract, bool)
        With whether this robot is the owner.
    first_span, count : int
    radius : float [m]
        Of this robot's disc.
    """
    if not bound:
        return NONE
    normals, bounds = np.empty((len(bound), count, 2)), np.empty((len(bound), count, 4))
    for row, (contract, is_owner) in enumerate(bound):
        side = 1.0 if is_owner else -1.0
        lines, offsets = contract.lines(first_span, count)
        normals[row], bounds[row] = side * lines, side * offsets + radius
    return Fences(np.tile(np.arange(count), len(bound)), normals.reshape(-1, 2), bounds.reshape(-1, 4))


def of_discs(discs: Sequence[tuple[NDArray, float]], curves: NDArray, radius: float) -> Fences:
    """Return the fences that keep a disc of ``radius`` [m] on ``curves`` (S, 4, 2) off ``discs`` (place, radius)."""
    from mobile_planning.fleet.contract_kernels import find_nearest

    fences, spans = NONE, np.arange(len(curves))
    for place, other in discs:
        normals = np.empty((len(curves), 2))
        for relative, normal in zip(curves - place, normals):
            find_nearest(relative, normal)
        bounds = np.repeat((normals @ place + radius + other)[:, None], 4, axis=1)
        fences += Fences(spans, normals, bounds)
    return fences


def of_pieces(pieces: ConvexPieces, curves: NDArray, radius: float, reach: NDArray, cap: int | None = None) -> Fences:
    """Return the fences that keep a disc on ``curves`` off the static world.

    Parameters
    ----------
    pieces : ConvexPieces
    curves : (S, 4, 2) ndarray [m]
        Of a plan that keeps clear.
    radius : float [m]
        Of the disc.
    reach : (S,) ndarray [m] or (2, S, 2) ndarray [m]
        What may come into play: the pieces no farther than this from the disc on each span, or those
        that touch the box from ``reach[0]`` to ``reach[1]`` of a span.
    cap : int, optional
        So many of the nearest pieces for each span.
    """
    spans = np.arange(len(curves))
    walls = len(pieces.wall_offsets)
    fences = Fences(np.repeat(spans, walls), np.tile(pieces.wall_normals, (len(spans), 1)),
                    np.repeat(np.tile(pieces.wall_offsets + radius, len(spans))[:, None], 4, axis=1))
    if reach.ndim == 1:
        low, high = curves.min(axis=1) - (reach + radius)[:, None], curves.max(axis=1) + (reach + radius)[:, None]
    else:
        low, high = reach[0] - radius, reach[1] + radius
    starts, found = pieces.near(low, high)
    near = np.repeat(spans, np.diff(starts))
    normals, offsets, distances = pieces.lines(curves, near, found)
    if cap is not None and len(near):
        order = np.lexsort((distances, near))
        rank = np.arange(len(order)) - starts[near[order]]
        keep = order[rank < cap]
        near, normals, offsets = near[keep], normals[keep], offsets[keep]
    return fences + Fences(near, normals, np.repeat((offsets + radius)[:, None], 4, axis=1))
