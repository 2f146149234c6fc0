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
from mobile_planning.fleet.tether import SIDES
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

    def within(self, points: NDArray, reach: NDArray) -> Fences:
        """Return those that the plan of control points (n, 2) [m] comes nearer to than ``reach`` (S,) [m].

        One number for each span of the plan; the last holds for all later ones.
        """
        from mobile_planning.fleet import section_kernels as kernels

        return self.on(kernels.are_within(points, self.spans, self.normals, self.bounds, reach))

    def on(self, chosen: NDArray) -> Fences:
        """Return those of an index or a mask."""
        return Fences(self.spans[chosen], self.normals[chosen], self.bounds[chosen])

    def __add__(self, other: Fences) -> Fences:
        return joined(self, other) if len(other) else self

    def __len__(self) -> int:
        return len(self.spans)


def joined(*parts: Fences) -> Fences:
    """Return all fences of the parts, in turn."""
    return Fences(*(np.concatenate([getattr(part, name) for part in parts]) for name in ('spans', 'normals', 'bounds')))


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

    Raises
    ------
    ValueError
        A contract has not begun at ``first_span``.
    """
    from mobile_planning.fleet import contract_kernels as kernels

    if not bound:
        return NONE
    contracts, sides = [contract for contract, _ in bound], [1.0 if is_owner else -1.0 for _, is_owner in bound]
    late = max(contract.first_span for contract in contracts)
    if first_span < late:
        raise ValueError(f'span {first_span} lies before the first of a contract, {late}')
    lengths = np.array([len(contract.normals) for contract in contracts])
    lines = np.minimum([first_span - contract.first_span for contract in contracts], lengths)
    normals, bounds = np.empty((len(bound) * count, 2)), np.empty((len(bound) * count, 4))
    kernels.write_sides(np.concatenate([contract.normals for contract in contracts]),
                        np.concatenate([contract.offsets for contract in contracts]), np.cumsum(lengths), lines,
                        np.array(sides), radius, normals, bounds)
    fences = Fences(np.tile(np.arange(count), len(bound)), normals, bounds)
    for contract in contracts:
        if contract.tether is not None:
            fences += Fences(np.repeat(np.arange(count), SIDES),
                             *contract.tether.sides(first_span - contract.first_span, count))
    return fences


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


def of_walls(pieces: ConvexPieces, count: int, radius: float) -> Fences:
    """Return the fences that keep a disc of ``radius`` [m] within the boundary and the map on ``count`` spans."""
    walls = len(pieces.wall_offsets)
    return Fences(np.repeat(np.arange(count), walls), np.tile(pieces.wall_normals, (count, 1)),
                  np.tile(pieces.wall_offsets[:, None] + radius, (count, 4)))


def of_pieces(pieces: ConvexPieces, curves: NDArray, radius: float, low: NDArray, high: NDArray,
              cap: int | None = None) -> Fences:
    """Return the fences that keep a disc on ``curves`` off the pieces of the static world.

    Parameters
    ----------
    pieces : ConvexPieces
    curves : (S, 4, 2) ndarray [m]
        Of a plan that keeps clear.
    radius : float [m]
        Of the disc.
    low, high : (S, 2) ndarray [m]
        Corners of a box for each span: the pieces that a disc in it may touch count.
    cap : int, optional
        So many of the nearest pieces for each span.
    """
    starts, found = pieces.near(low - radius, high + radius)
    near = np.repeat(np.arange(len(curves)), np.diff(starts))
    normals, offsets, distances = pieces.lines(curves, near, found)
    fences = Fences(near, normals, np.repeat(offsets + radius, 4).reshape(-1, 4))
    if cap is None or not len(near):
        return fences
    order = np.lexsort((distances, near))
    rank = np.arange(len(order)) - starts[near]                     # both are sorted by spans
    return fences.on(order[rank < cap])
