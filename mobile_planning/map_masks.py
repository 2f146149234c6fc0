"""Masks over a map: further grids that forbid cells or limit the speed there, and may lie otherwise than the map."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid

# Cells that are looked up at once.
_BLOCK = 1 << 20


def forbidden_cells(keepout: OccupancyGrid, grid: OccupancyGrid) -> NDArray[np.bool_]:
    """Return which cells (h, w) of a map have their centre in an occupied cell of a mask.

    Parameters
    ----------
    keepout, grid : OccupancyGrid
        The mask and the map, in the same frame.
    """
    return mask_values(keepout, grid) >= OCCUPIED_FROM


def slowness(speed: OccupancyGrid, grid: OccupancyGrid) -> NDArray[np.float64]:
    """Return how many times longer each cell (h, w) of a map takes than at full speed, at least 1.

    Parameters
    ----------
    speed, grid : OccupancyGrid
        The mask, of which a value is the percentage of full speed, 0 and unknown for no limit; and the map.

    Examples
    --------
    >>> slowness(OccupancyGrid([[0, 50, 25]]), OccupancyGrid([[0, 0, 0, 0]])).tolist()
    [[1.0, 2.0, 4.0, 1.0]]
    """
    percent = mask_values(speed, grid).astype(float)
    return 100.0 / np.where(percent > 0, percent, 100.0)


def mask_values(mask: OccupancyGrid, grid: OccupancyGrid) -> NDArray[np.int8]:
    """Return the mask's value (h, w) at the centre of each cell of a map, unknown outside the mask."""
    if (mask.shape, mask.resolution, mask.origin) == (grid.shape, grid.resolution, grid.origin):
        return mask.data
    values = np.full(grid.shape, UNKNOWN, np.int8)
    rows = max(1, _BLOCK // grid.width)
    for first in range(0, grid.height, rows):
        y, x = np.mgrid[first:min(first + rows, grid.height), :grid.width]
        cells = mask.world_to_cell(grid.cell_to_world(np.stack([x, y], axis=-1)))
        inside = mask.contains(cells)
        values[first:first + rows][inside] = mask.data[tuple(cells[inside].T[::-1])]
    return values
