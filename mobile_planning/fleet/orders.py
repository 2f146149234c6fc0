"""Orders: what a robot has been told to do, and what it therefore does."""
from __future__ import annotations

import numpy as np

from mobile_planning.fleet.message import Mode


class Orders:
    """Whether a robot waits, drives, is done, was stopped, or is paused.

    Attributes
    ----------
    mission_start : float [s]
        When it may set out; infinite as long as there is no mission, or none any more.
    is_paused : bool
        Whether it comes to rest, or rests, until `resume`.

    Examples
    --------
    >>> orders = Orders()
    >>> orders.start(5.0)
    >>> orders.note(4.0, has_arrived=False)
    >>> before = orders.mode.name
    >>> orders.note(5.0, has_arrived=False)
    >>> before, orders.mode.name
    ('WAITING', 'DRIVING')
    """

    def __init__(self):
        self.mission_start, self.is_paused = np.inf, False
        self._mode = Mode.WAITING

    @property
    def mode(self) -> Mode:
        """What the robot is doing; while it is paused it has stopped."""
        return Mode.STOPPED if self.is_paused and self._mode is not Mode.WAITING else self._mode

    @property
    def is_done(self) -> bool:
        """Whether the robot is at its goal and at rest."""
        return self._mode is Mode.DONE

    @property
    def has_mission(self) -> bool:
        """Whether it drives, or is to."""
        return self.mission_start < np.inf

    def start(self, mission_start: float) -> None:
        """Drive from ``mission_start`` [s] on."""
        self.mission_start = float(mission_start)

    def stop(self) -> None:
        """Drive no more, wherever the robot is by now."""
        self.mission_start = np.inf
        if not self.is_done:
            self._mode = Mode.STOPPED

    def renew(self) -> None:
        """Take up another goal: who was done drives on, if there is still a mission."""
        if self.is_done:
            self._mode = Mode.DRIVING if self.has_mission else Mode.STOPPED

    def note(self, now: float, has_arrived: bool) -> None:
        """Notice at ``now`` [s] that the robot drives, or that its mission is done."""
        if now >= self.mission_start:
            self._mode = Mode.DONE if has_arrived else Mode.DRIVING
