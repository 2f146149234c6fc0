"""Postscript: what a robot tells beside its intention."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from mobile_planning.fleet.hold_up import HoldUp


@dataclass(frozen=True)
class Postscript:
    """What a RobotMsg carries beside the intention: no robot plans by it.

    Attributes
    ----------
    mission_start : float [s]
        Of the mission that the sender drives, 0 for none.
    goals_reached : int
        In that mission.
    lags : mapping of int to float [s]
        Least time lately from a stamp of each peer to its arrival, by the clock of the sender; NaN for unknown.
    without_word_of : tuple of int
        Peers whose word the sender lacks to set out.
    held_up : HoldUp or None
        Why else it does not go on, as far as it knows.
    is_where_left : bool
        Whether its process has found the body where, by the logbook, the one before had left it.
    """

    mission_start: float = 0.0
    goals_reached: int = 0
    lags: Mapping[int, float] = field(default_factory=dict)
    without_word_of: tuple[int, ...] = ()
    held_up: HoldUp | None = None
    is_where_left: bool = False
