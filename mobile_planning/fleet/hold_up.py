"""HoldUp: why a robot that is not at its goal does not go on, and whom it waits for."""
from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Reason(Enum):
    """Why a robot waits."""

    #: Others go first by the joint plan in force.
    TURN = 'turn'
    #: It makes no progress, and a joint plan is not in force yet.
    STALLED = 'stalled'
    #: The newest joint plan found no way to its goal past those who stand.
    BLOCKED = 'blocked'
    #: Its process was started anew, and found the body elsewhere than the last plan has led it.
    LEFT_OUT = 'left out'


@dataclass(frozen=True)
class HoldUp:
    """That a robot waits.

    Attributes
    ----------
    since : float [s]
        On the fleet's clock.
    reason : Reason
    for_robots : tuple of int
        Who must go first; where the robot is blocked, who stands within its reach, be it at its goal, stopped or
        silent.
    """

    since: float
    reason: Reason
    for_robots: tuple[int, ...] = ()

    def __str__(self):
        others = f' for {", ".join(map(str, self.for_robots))}' if self.for_robots else ''
        return f'{self.reason.value}{others} since {self.since:.2f} s'
