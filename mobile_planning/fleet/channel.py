"""A seeded channel that loses, delays and so reorders messages."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mobile_planning.errors import InvalidInput


@dataclass(frozen=True)
class Channel:
    """How a message fares on its way to one receiver.

    Attributes
    ----------
    loss : float
        Share of the messages that never arrive, 0 to 1.
    delay : float [s]
        Each message takes between ``least`` and ``least + delay``, evenly drawn.
    least : float [s]
        Shortest time on the way.
    """

    loss: float = 0.0
    delay: float = 0.0
    least: float = 0.002

    def __post_init__(self):
        if not 0.0 <= self.loss <= 1.0:
            raise InvalidInput(f'loss is {self.loss}, not a share in 0..1')
        if not (0.0 <= self.delay < np.inf and 0.0 <= self.least < np.inf):
            raise InvalidInput(f'delays of {self.delay} s and {self.least} s must be finite and not negative')

    def travel_time(self, rng: np.random.Generator) -> float | None:
        """Return how long the next message takes [s], None if it is lost."""
        lost, share = rng.random(2)
        return None if lost < self.loss else self.least + share * self.delay
