"""ControlLoop: drives the bodies of a process, in a thread that nothing of the planner can stop."""
from __future__ import annotations

import threading
from time import monotonic
from typing import Protocol

from mobile_planning.nodes.guard import Guard


class Driven(Protocol):
    """What a `ControlLoop` drives."""

    def tick(self, period: float) -> None:
        """Drive on for ``period`` [s]."""


class ControlLoop:
    """Drives bodies at one rate.

    Parameters
    ----------
    rate : float [Hz]
    guard : Guard
    """

    def __init__(self, rate: float, guard: Guard):
        self._period, self._guard, self._bodies = 1.0 / rate, guard, ()
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._drive, name='control loop', daemon=True)
        self._thread.start()

    def add(self, body: Driven) -> None:
        """Drive one more body."""
        self._bodies = (*self._bodies, body)

    def close(self) -> None:
        """Let the thread end."""
        self._is_over.set()
        self._thread.join(1.0)

    def _drive(self):
        due = monotonic()
        while not self._is_over.wait(max(0.0, due - monotonic())):
            # What was missed is not made up for.
            due = max(due + self._period, monotonic())
            for body in self._bodies:
                try:
                    body.tick(self._period)
                except Exception as error:
                    self._guard.note(error, 'tick')
