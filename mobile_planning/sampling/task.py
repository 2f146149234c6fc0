"""What a tree grows for, as the kernels take it."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Task(NamedTuple):
    """A goal and how to grow towards it."""

    #: (3,) x, y, heading [m, m, rad].
    goal: NDArray[np.float64]
    #: (3,) half widths of the goal zone [m, m, rad].
    precision: NDArray[np.float64]
    #: Turning radius [m]; 0 goes straight.
    radius: float
    #: Length of a way, at most [m].
    extension: float
    #: Speed [m/s], and the time [s] at the root.
    speed: float
    begin: float
    #: How often a sample is drawn in the goal zone.
    goal_rate: float
    #: How many nodes are tried for a sample.
    nb_options: int
    #: Whether nodes are near by the straight line rather than by the way.
    by_line: bool
