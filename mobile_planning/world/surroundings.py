"""The world as paths are looked for in: exact shapes, and how much room there is in each cell of a grid over it."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.world.collision_space import CollisionSpace

# Cells along each axis.
_CELLS = 128


class Surroundings(NamedTuple):
    """The exact shapes, and the room at the middles of cells, which is worked out when it is first asked for.

    What lies clear of all, or deep in something, is told by the cells alone; the shapes tell the rest.
    """

    space: CollisionSpace
    #: (n, n) room [m] at the middle of each cell, nan where it is not known yet; (0, 0) where the cells tell nothing,
    #: because something moves or the robot has an outline.
    rooms: NDArray[np.float64]
    #: (4,) x_min, y_min [m], and the cells in a metre of x and of y.
    frame: NDArray[np.float64]


def surroundings(space: CollisionSpace, bounds: ArrayLike) -> Surroundings:
    """Return the surroundings within bounds (4,) x_min, y_min, x_max, y_max [m]."""
    x_min, y_min, x_max, y_max = bounds
    tells = space.reach[3] == 0 and not len(space.body)
    return Surroundings(space, np.full((_CELLS, _CELLS) if tells else (0, 0), np.nan),
                        np.array([x_min, y_min, _CELLS / (x_max - x_min), _CELLS / (y_max - y_min)]))
