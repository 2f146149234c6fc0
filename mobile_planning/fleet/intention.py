"""Intention and SectionRecord: what a robot by the receding horizon has in mind, and what its sections took."""
from __future__ import annotations

from dataclasses import dataclass

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.horizon_section import Found, Kind


@dataclass(frozen=True, eq=False)
class Intention:
    """What a robot has planned and not yet said.

    Attributes
    ----------
    first_knot : int
        Of the section.
    round : int
        Of the exchange, in which it was planned.
    new : Plan or None
        To propose; None to leave things as they are.
    withdraws : bool
        The candidate that was said before must not be driven.
    kind : Kind
    seconds : float [s]
        To plan it.
    found : Found or None
        What became of the programs; None if there was none to solve.
    brake : Plan or None
        To drive at once, before what the plan in force leads into.
    """

    first_knot: int
    round: int
    new: Plan | None = None
    withdraws: bool = False
    kind: Kind = Kind.INTERMEDIATE
    seconds: float = 0.0
    found: Found | None = None
    brake: Plan | None = None


@dataclass
class SectionRecord:
    """What one section took.

    Attributes
    ----------
    kind : Kind
    seconds : float [s]
        In all rounds.
    solves, infeasible, refused : int
        Programs solved, those whose answer broke a constraint, and rounds that ended without a proved section.
    """

    kind: Kind
    seconds: float = 0.0
    solves: int = 0
    infeasible: int = 0
    refused: int = 0
