"""Exact distances to the static world, for those who judge and not for those who drive."""
from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from mobile_planning.geometry import depth_in_box
from mobile_planning.world.environment import Environment


class ExactDistance:
    """Distances to the boundary, the obstacles, the squares of occupied cells and the edge of the grid.

    Unlike `Environment.clearance` exact for cells too; but slower by far.

    Parameters
    ----------
    environment : Environment

    Examples
    --------
    >>> from mobile_planning.world.occupancy_grid import OccupancyGrid
    >>> world = Environment(grid=OccupancyGrid([[0, 0, 0, 100], [0, 0, 0, 0]]))
    >>> ExactDistance(world)(np.array([[1.0, 1.0], [2.75, 0.75], [9.0, 1.0]])).tolist()
    [1.0, 0.25, -5.0]
    """

    def __init__(self, environment: Environment):
        self._shapes = [*environment.obstacles]
        if environment.boundary is not None:
            self._shapes.append(environment.boundary)
        self._grid, self._squares = environment.grid, None
        if self._grid is not None and environment.occupied.any():
            rows, columns = np.nonzero(environment.occupied)
            self._squares = shapely.STRtree(shapely.box(columns, rows, columns + 1, rows + 1))

    def __call__(self, points: NDArray) -> NDArray[np.float64]:
        """Return the distance (N,) [m] of ``points`` (N, 2) [m]: 0 in occupied cells, else negative where not free."""
        distance = np.full(len(points), np.inf)
        for shape in self._shapes:
            distance = np.minimum(distance, shape.distance(points))
        if self._grid is not None:
            cells = self._grid.world_to_grid(points)
            distance = np.minimum(distance, depth_in_box(cells, (0, 0), (self._grid.width, self._grid.height))
                                  * self._grid.resolution)
            if self._squares is not None:
                _, gaps = self._squares.query_nearest(shapely.points(cells), return_distance=True, all_matches=False)
                distance = np.minimum(distance, gaps * self._grid.resolution)
        return distance
