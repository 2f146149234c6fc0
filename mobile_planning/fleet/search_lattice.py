"""SearchLattice: the room that a static world leaves, on a lattice that ways to all goals are searched on."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.world.environment import Environment

#: Cells to the radius of the body, where that makes no more nodes than the first limit; half as many up to the second.
_FINE, _NODES, _MOST_NODES = 4.0, 1 << 17, 1 << 22
#: Nothing is free so far out [m], and squares would overflow.
_FAR = 1e12


class SearchLattice:
    """Nodes for the centre of a disc, with the room that each has.

    By default the radius is four cells, which costs some 2 % of it in room that is there and not seen. Where the world
    is larger than 8,000 times its square (18 m x 18 m for 0.2 m) the cells grow, up to half the radius; a door of three
    times the radius is then still found wherever it lies. Beyond 200 m x 200 m they grow further.

    Parameters
    ----------
    environment : Environment
        With a boundary or a grid, which give the extent.
    radius : float [m]
        Of the disc.
    resolution : float [m], optional
        Distance of the nodes; by default as fine as the extent of the world allows.

    Attributes
    ----------
    radius, resolution : float [m]
    low : (2,) ndarray [m]
        Of the node in the first row and column.
    squared : (h, w) ndarray of float32 [cells^2]
        How far the nearest thing static is at least, squared; node (x, y) in row y and column x.

    Raises
    ------
    InvalidInput
        If the world has no extent, or a number is not positive and finite.

    Examples
    --------
    >>> from mobile_planning import Boundary
    >>> lattice = SearchLattice(Environment(Boundary((0, 8), (0, 6))), radius=0.2)
    >>> lattice.resolution, lattice.squared.shape, lattice.to_cells((0.5, 1.0)).tolist()
    (0.05, (121, 161), [10.0, 20.0])
    """

    def __init__(self, environment: Environment, radius: float, resolution: float | None = None):
        self.radius = float(radius)
        if not 0 < self.radius < np.inf:
            raise InvalidInput(f'radius {radius} m must be positive and finite')
        low, high = np.reshape(environment.bounds, (2, 2))
        self.resolution = _resolution(high - low, self.radius) if resolution is None else float(resolution)
        if not 0 < self.resolution < np.inf:
            raise InvalidInput(f'resolution {resolution} m must be positive and finite')
        self.low = low
        columns, rows = np.maximum(np.ceil((high - low) / self.resolution).astype(int), 1) + 1
        nodes = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1) * self.resolution + low
        self.squared = ((np.maximum(environment.clearance(nodes), 0.0) / self.resolution)**2).astype(np.float32)

    def to_cells(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return where ``points`` (..., 2) [m] are, with the first node as the origin [cells]."""
        return (np.clip(np.asarray(points, float), -_FAR, _FAR) - self.low) / self.resolution

    def to_metres(self, points: NDArray) -> NDArray[np.float64]:
        """Return where ``points`` (..., 2) [cells] are in the world [m]."""
        return points * self.resolution + self.low


def _resolution(extent, radius):
    """Return the distance of nodes [m] for a world of ``extent`` (2,) [m] and a body of ``radius`` [m]."""
    area = float(extent.prod())
    fine = max(radius / _FINE, np.sqrt(area / _NODES))
    return max(min(fine, 2 * radius / _FINE), np.sqrt(area / _MOST_NODES))
