"""Moving-line contracts: what two robots agree on, so that each may plan alone and they never meet.

Of two robots the one with the lower id is the *owner*, the other the *peer*. On
each span of the time axis a contract has one line, which moves along its normal
during the span: its place is a cubic polynomial with four Bernstein coefficients,
the offsets. After the last span the line stands still. The owner keeps its radius
on one side of it, the peer its own on the other: on a span with Bezier points b,

    owner: n . b_k >= offset_k + r_owner      peer: n . b_k <= offset_k - r_peer

Added up, n . (b_owner - b_peer)_k >= r_owner + r_peer for all four k, and so at
every instant, for the Bernstein weights are not negative and add up to 1.

Neighbours that are to stay in range of each other have a `tether` in their contract as well.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import inf
from operator import index

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import MAX_NUMBER, MAX_POINTS, Plan
from mobile_planning.fleet.tether import Tether, between

#: What rounding may take of a room [m].
ROUNDING = 1e-9
MAX_SPANS = 2 * MAX_POINTS


@dataclass(frozen=True, eq=False)
class Contract:
    """One moving line.

    Attributes
    ----------
    id : int
        From 1 on; an owner never uses one twice in one life of its process.
    first_span : int
        Span k lasts from knot k to knot k + 1. Before the first nothing is agreed.
    normals : (L, 2) ndarray
        Unit vectors that point from the peer to the owner, one a span.
    offsets : (L, 4) ndarray [m]
    tether : Tether or None
        Of neighbours, on the same spans.

    Raises
    ------
    InvalidInput
        A number is not finite or out of its range, a normal has not the length 1, or the tether has other spans.
    """

    id: int
    first_span: int
    normals: NDArray[np.float64]
    offsets: NDArray[np.float64]
    tether: Tether | None = None

    def __post_init__(self):
        from mobile_planning.fleet.contract_kernels import are_lines

        try:
            number, first_span = index(self.id), index(self.first_span)
            normals, offsets = np.array(self.normals, dtype=float), np.array(self.offsets, dtype=float)
        except (TypeError, ValueError):
            raise InvalidInput('a contract has a whole id and first span, and normals and offsets that are numbers, '
                               f'not {self.id!r}, {self.first_span!r}, {self.normals!r}, {self.offsets!r}') from None
        if not (0 < number < MAX_NUMBER and abs(first_span) < MAX_NUMBER):
            raise InvalidInput(f'the id {number} or the first span {first_span} of a contract is out of range')
        spans = len(normals) if normals.ndim == 2 else 0
        if not 1 <= spans <= MAX_SPANS or normals.shape != (spans, 2) or offsets.shape != (spans, 4):
            raise InvalidInput(f'a contract has normals (L, 2) and offsets (L, 4), L from 1 to {MAX_SPANS}, '
                               f'not {normals.shape} and {offsets.shape}')
        if not are_lines(normals, offsets, 1e-9, 1e7):
            raise InvalidInput('normals must have the length 1, offsets must be finite and within 1e7 m')
        if self.tether is not None and len(self.tether.middles) != spans:
            raise InvalidInput(f'the tether of a contract with {spans} lines has {len(self.tether.middles)} middles')
        normals.flags.writeable = offsets.flags.writeable = False
        for name, value in (('id', number), ('first_span', first_span), ('normals', normals), ('offsets', offsets)):
            object.__setattr__(self, name, value)

    @cached_property
    def last_span(self) -> int:
        """The last span on which the line moves."""
        return self.first_span + len(self.normals) - 1

    def lines(self, first_span: int, count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the normals (count, 2) and offsets (count, 4) [m] of ``count`` spans from ``first_span`` on.

        Raises
        ------
        ValueError
            The contract has not begun at ``first_span``.
        """
        from mobile_planning.fleet import contract_kernels as kernels

        if first_span < self.first_span:
            raise ValueError(f'span {first_span} lies before the first of the contract, {self.first_span}')
        normals, offsets = np.empty((count, 2)), np.empty((count, 4))
        line = min(first_span - self.first_span, len(self.normals))
        kernels.go_on(self.normals, self.offsets, line, normals, offsets)
        return normals, offsets


def build(contract_id: int, owner_plan: Plan, peer_plan: Plan, first_span: int, owner_radius: float,
          peer_radius: float, reach: float = inf) -> Contract | None:
    """Return the contract between two plans that shares what room they leave equally; None if they come too close.

    None, too, if they are not within ``reach`` [m] of each other.

    Each line lies across the shortest way between the two on its span.

    Parameters
    ----------
    contract_id : int
    owner_plan, peer_plan : Plan
        None is returned too if they have different steps, or end too far apart for a contract.
    first_span : int
        Not before either plan.
    owner_radius, peer_radius : float [m]

    Raises
    ------
    ValueError
        One of the plans begins after ``first_span``.
    """
    from mobile_planning.fleet import contract_kernels as kernels

    owner_from, peer_from = _place(owner_plan, first_span), _place(peer_plan, first_span)
    count = max(owner_plan.end_knot, peer_plan.end_knot, first_span + 1) - first_span
    if owner_plan.step != peer_plan.step or count > MAX_SPANS:
        return None
    normals, offsets = np.empty((count, 2)), np.empty((count, 4))
    if not kernels.draw_lines(owner_plan.points, owner_from, peer_plan.points, peer_from, owner_radius, peer_radius,
                              2 * ROUNDING, normals, offsets):
        return None
    if reach == inf:
        return Contract(contract_id, first_span, normals, offsets)
    tether = between(owner_plan, peer_plan, first_span, count, reach)
    return None if tether is None else Contract(contract_id, first_span, normals, offsets, tether)


def room(contract: Contract, plan: Plan, first_span: int, is_owner: bool, radius: float) -> float:
    """Return how far [m] ``plan`` stays on its side of ``contract``, and in range, from ``first_span`` on and for ever.

    The plan satisfies the contract if this is not below ``-ROUNDING``.

    Parameters
    ----------
    contract : Contract
    plan : Plan
    first_span : int
        Spans before it, or before the contract, do not count.
    is_owner : bool
        Whose plan it is.
    radius : float [m]
        Of the plan's robot.

    Raises
    ------
    ValueError
        The plan begins after the first span that counts.
    """
    from mobile_planning.fleet.contract_kernels import least_distance

    first = max(first_span, contract.first_span)
    count = max(plan.end_knot, contract.last_span + 1) - first + 1
    line = min(first - contract.first_span, len(contract.normals))
    distance = least_distance(plan.points, _place(plan, first), contract.normals, contract.offsets, line,
                              max(count, 1), 1.0 if is_owner else -1.0)
    if contract.tether is None:
        return distance - radius
    return min(distance - radius, contract.tether.room(plan, first, first - contract.first_span))


def _place(plan, span):
    """Return which of the plan's spans is ``span``; a number past its end stands for all those at rest."""
    if span < plan.first_knot:
        raise ValueError(f'span {span} lies before the first of the plan, {plan.first_knot}')
    return min(span - plan.first_knot, len(plan.points))
