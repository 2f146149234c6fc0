"""Announcement: what the robots are told of a mission."""
from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.scene import MAX_ROBOTS


class State(IntEnum):
    """How far a mission is. PAUSED: all come to rest and wait, until it is STARTED once more."""

    WAITING = 0
    STARTED = 1
    STOPPED = 2
    PAUSED = 3


@dataclass(frozen=True)
class Announcement:
    """What all robots are told of a mission; each stands alone, the newest counts.

    Attributes
    ----------
    name : str
    state : State
    robot_ids : tuple of int
        Everybody who takes part, moving or not.
    start : float [s]
        No robot moves before it, on the common clock.
    left_out : tuple of int
        Of these, who is not to move: nobody knows where their bodies are. The mission goes on for the others.

    Raises
    ------
    InvalidInput
        There is no such state, or the robots are none, too many or not all different.
    """

    name: str
    state: State
    robot_ids: tuple[int, ...]
    start: float = 0.0
    left_out: tuple[int, ...] = ()

    def __post_init__(self):
        if self.state not in list(State):
            raise InvalidInput(f'a mission has no state {self.state}, only 0 to {max(State)}')
        ids = tuple(self.robot_ids)
        if not 1 <= len(ids) <= MAX_ROBOTS or len(set(ids)) != len(ids):
            raise InvalidInput(f'a mission has 1 to {MAX_ROBOTS} robots with ids of their own, not {len(ids)} '
                               f'of which {len(set(ids))} differ')
        if not set(self.left_out) <= set(ids):
            raise InvalidInput(f'robots {sorted(set(self.left_out) - set(ids))} are left out of a mission that they '
                               'take no part in')
        if not np.isfinite(self.start):
            raise InvalidInput(f'the start of a mission is {self.start}, not a time')
        object.__setattr__(self, 'state', State(self.state))
        object.__setattr__(self, 'robot_ids', ids)
        object.__setattr__(self, 'left_out', tuple(self.left_out))
