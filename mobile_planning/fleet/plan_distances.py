"""Distances of plans, written for those who judge them alone: nothing here is shared with what makes the plans."""
from __future__ import annotations

from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import Contract

#: Pairs and triples of the four points of a hull.
_EDGES = np.array(list(combinations(range(4), 2))).T
_TRIANGLES = np.array(list(combinations(range(4), 3))).T


def rest_knot(plan: Plan) -> float:
    """Return from which knot on ``plan`` never leaves its last place; minus infinity if it never moves."""
    moves = np.flatnonzero((plan.points != plan.points[-1]).any(axis=1))
    return plan.first_knot + int(moves[-1]) + 1 if len(moves) else -np.inf


def curves(plan: Plan, first_span: int, count: int) -> NDArray[np.float64]:
    """Return the Bezier points (count, 4, 2) [m] of ``count`` spans; before its first knot a plan rests."""
    at = np.clip(np.arange(first_span, first_span + count + 3) - plan.first_knot, 0, len(plan.points) - 1)
    q = plan.points[at]
    thirds = q[:-1, None] + (q[1:] - q[:-1])[:, None] * np.array([[1 / 3], [2 / 3]])
    knots = (thirds[:-1, 1] + thirds[1:, 0]) / 2
    return np.stack([knots[:-1], thirds[1:-1, 0], thirds[1:-1, 1], knots[1:]], axis=1)


def hull_distance(points: NDArray) -> NDArray[np.float64]:
    """Return the distance (...) from the origin to the hull of each four points (..., 4, 2); 0 inside.

    Examples
    --------
    >>> hull_distance(np.array([[[3.0, 4.0]] * 4, [[1, 1], [1, -1], [2, 0], [2, 1]]])).tolist()
    [5.0, 1.0]
    """
    a, b = points[..., _EDGES[0], :], points[..., _EDGES[1], :]
    along = b - a
    length2 = (along**2).sum(axis=-1)
    share = np.clip(-(a * along).sum(axis=-1) / np.where(length2 > 0, length2, 1.0), 0.0, 1.0)
    nearest = a + share[..., None] * along
    distance = np.sqrt((nearest**2).sum(axis=-1).min(axis=-1))
    corners = points[..., _TRIANGLES, :]
    turned = corners[..., [1, 2, 0], :, :]
    cross = corners[..., 0] * turned[..., 1] - corners[..., 1] * turned[..., 0]
    inside = ((cross > 0).all(axis=-2) | (cross < 0).all(axis=-2)).any(axis=-1)
    return np.where(inside, 0.0, distance)


def contract_room(contract: Contract, plan: Plan, knot: int, is_owner: bool, radius: float,
                  whole: NDArray | None = None) -> float:
    """Return how far [m] ``plan`` stays on its side of ``contract``, for ever from ``knot`` on; below 0 it does not.

    Where the contract has a tether, nowhere nearer to the edge of the disc about its middle.
    After its last span the last line stands still, at the last of its offsets. ``whole`` is `curves` of the
    plan from its first span on, one span at rest included.
    """
    whole = curves(plan, plan.first_knot, len(plan.points) - 2) if whole is None else whole
    first = max(knot, contract.first_span)
    last, end = contract.first_span + len(contract.normals), max(plan.end_knot, first)
    spans = np.arange(first, max(end, last) + 1)
    line = np.minimum(spans - contract.first_span, len(contract.normals) - 1)
    offsets = contract.offsets[line]
    offsets[spans >= last] = contract.offsets[-1, 3]
    at = np.clip(spans - plan.first_knot, 0, len(whole) - 1)
    heights = np.einsum('sd,skd->sk', contract.normals[line], whole[at]) - offsets
    room = float(heights.min() if is_owner else -heights.max()) - radius
    if contract.tether is None:
        return room
    middles = contract.tether.middles[line]
    middles[spans >= last] = contract.tether.middles[-1, 3]
    return min(room, contract.tether.reach / 2 - float(np.hypot(*np.moveaxis(whole[at] - middles, -1, 0)).max()))


def distance_of_plans(a: Plan, b: Plan, knot: int) -> float:
    """Return a lower bound [m] of the distance of two plans at equal times from ``knot`` on, exact at rest."""
    count = max(a.end_knot, b.end_knot, knot) + 1 - knot
    return float(hull_distance(curves(a, knot, count) - curves(b, knot, count)).min())


def farthest_of_plans(a: Plan, b: Plan, knot: int) -> float:
    """Return an upper bound [m] of the distance of two plans at equal times from ``knot`` on, exact at rest."""
    count = max(a.end_knot, b.end_knot, knot) + 1 - knot
    return float(np.hypot(*np.moveaxis(curves(a, knot, count) - curves(b, knot, count), -1, 0)).max())


def distance_of_point(plan: Plan, place: NDArray, knot: int) -> float:
    """Return a lower bound [m] of the distance of ``plan`` from ``place`` (2,) [m] from ``knot`` on, exact at rest."""
    count = max(plan.end_knot, knot) + 1 - knot
    return float(hull_distance(curves(plan, knot, count) - place).min())
