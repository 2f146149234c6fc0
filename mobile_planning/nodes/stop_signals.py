"""How a signal stops an executable: it is remembered, and the loop looks at that.

rclpy's own signal handling shuts the context down from another thread, at any moment: signals get lost, and a node
that is just being built or just publishing dies with a traceback. So the handlers here only set a flag.
"""
from __future__ import annotations

import signal


class StopSignals:
    """Remembers the first SIGINT or SIGTERM instead of dying of it, while the context lasts.

    The same signal a second time acts as usual, for the user who has lost patience; the other one does not, for
    Ctrl-C in a terminal reaches a node twice, as SIGINT from the terminal and as SIGTERM from the script around it.

    Attributes
    ----------
    received : int or None
        The number of the signal.

    Examples
    --------
    >>> with StopSignals() as stop:
    ...     signal.raise_signal(signal.SIGTERM)
    ...     signal.Signals(stop.received).name
    'SIGTERM'
    """

    def __init__(self):
        self.received: int | None = None
        self._before = {}

    def __enter__(self) -> StopSignals:
        self._before = {number: signal.signal(number, self._remember) for number in (signal.SIGINT, signal.SIGTERM)}
        return self

    def __exit__(self, *_) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)

    def _remember(self, number, _frame):
        """Handle the signal: nothing here may raise or take a lock."""
        self.received = self.received or number
        signal.signal(number, signal.SIG_DFL)
