"""A map as the planners see it: where obstacles are, where a robot may be, and what each cell costs."""
from __future__ import annotations

from copy import copy

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.map_masks import forbidden_cells, slowness
from mobile_planning.nearest_cell import nearest
from mobile_planning.world.inflation import grown, regrown
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, UNKNOWN, OccupancyGrid
from mobile_planning.world.row_blocks import row_blocks

# Changes that a map remembers; a plan that is further behind compares all cells.
_CHANGES_KEPT = 64


class PlanningMap:
    """One state of a map, which never changes: `updated` and `replaced` return the next one.

    A query that holds one is answered on it as a whole, whatever comes meanwhile.

    Occupied cells of the map, forbidden ones of the mask and those that an update blocks all grow by the inflation
    radius; unknown ones do not. A robot that stands in a cell of another kind than an obstacle may leave it.

    Parameters
    ----------
    grid : OccupancyGrid
    inflation_radius : float [m]
    unknown_is_free : bool
    keepout, speed : OccupancyGrid, optional
        Masks, see `map_masks`.

    Attributes
    ----------
    grid : OccupancyGrid
        The map as it came.
    obstacles : (h, w) ndarray of bool
        Cells with an obstacle, or unknown, read-only.
    occupied : (h, w) ndarray of bool
        Cells where a robot must not plan to be, read-only: obstacles, forbidden ones, and the inflation of both. The
        same object as long as no cell of it changes.
    weights : (h, w) ndarray or None
        What each cell costs unless it is occupied, read-only; None as long as that is 1 everywhere.
    version : int
        Grows with every change.
    """

    def __init__(self, grid: OccupancyGrid, inflation_radius: float = 0.0, unknown_is_free: bool = False, *,
                 keepout: OccupancyGrid | None = None, speed: OccupancyGrid | None = None):
        self.grid = grid
        self._inflation_radius, self._reach = inflation_radius, inflation_radius / grid.resolution
        self.obstacles = _fixed(grid.occupied(unknown_is_free=unknown_is_free))
        self._forbidden = np.zeros(grid.shape, bool) if keepout is None else forbidden_cells(keepout, grid)
        # What grows, and what it has grown to.
        self._lethal = _fixed((grid.data >= OCCUPIED_FROM) | self._forbidden)
        self._inflated = _fixed(grown(self._lethal, self._reach))
        self.occupied = _fixed(self.obstacles | self._inflated)
        times = None if speed is None else slowness(speed, grid)
        self.weights = None if times is None or (times == 1).all() else _fixed(times)
        self.version = 0
        # What each of the last versions changed, as rows (x, y, cost).
        self._changes = ()

    def cost_map(self, stop: NDArray[np.uint8] | None = None) -> NDArray[np.float64]:
        """Return the cost of each cell (h, w), inf where occupied; raise Cancelled if stopped."""
        costs = np.empty(self.grid.shape)
        for rows in row_blocks(costs.shape, stop):
            costs[rows] = self._costs_at(rows)
        return costs

    def updated(self, rows: NDArray[np.float64]) -> PlanningMap:
        """Return the map with other costs of some cells.

        A blocked cell is an obstacle and grows. Any other is free, if it is not forbidden nor within the inflation of
        another one, and costs what it is told.

        Parameters
        ----------
        rows : (N, 3) ndarray
            Of x, y and cost, see `checked_update`; each cell once.
        """
        told, costs = rows[:, :2].astype(np.int64), rows[:, 2]
        x, y = told.T
        blocked = np.isinf(costs)
        result = copy(self)
        result.obstacles = _changed(self.obstacles, x, y, blocked)
        result._lethal = _changed(self._lethal, x, y, blocked | self._forbidden[y, x])
        is_other = self._lethal[y, x] != result._lethal[y, x]
        if is_other.any():
            inflated, differing = regrown(self._inflated, result._lethal, self._reach, told[is_other])
            result._inflated, told = _fixed(inflated), np.concatenate([told, differing])
        if self.weights is not None or (costs[~blocked] != 1).any():
            weights = np.ones(self.grid.shape) if self.weights is None else self.weights
            result.weights = _changed(weights, x[~blocked], y[~blocked], costs[~blocked])
        x, y = told.T
        result.occupied = _changed(self.occupied, x, y, result.obstacles[y, x] | result._inflated[y, x])
        result._note(x, y, self)
        return result

    def replaced(self, newer: PlanningMap) -> PlanningMap | None:
        """Return a newer map as a change of this one, or None if it has another size or lies elsewhere.

        Parameters
        ----------
        newer : PlanningMap
            As it was made, without updates.
        """
        ours, theirs = self.grid, newer.grid
        if (ours.shape, ours.resolution, ours.origin) != (theirs.shape, theirs.resolution, theirs.origin):
            return None
        result = copy(newer)
        if np.array_equal(self.occupied, newer.occupied):
            # Plans are kept for this object.
            result.occupied = self.occupied
        if self.weights is newer.weights:
            is_other = self.occupied != newer.occupied
        else:
            is_other = self.cost_map() != newer.cost_map()
        y, x = np.nonzero(is_other)
        result._note(x, y, self)
        return result

    def changes_since(self, version: int) -> NDArray[np.float64] | None:
        """Return rows (x, y, cost) that lead from an earlier version to this one; None if they are not known."""
        count = self.version - version
        if not 0 <= count <= len(self._changes):
            return None
        return np.concatenate([np.empty((0, 3)), *self._changes[len(self._changes) - count:]])

    def changes_from(self, costs: NDArray[np.float64], stop: NDArray[np.uint8] | None = None) -> NDArray[np.float64]:
        """Return rows (x, y, cost) that lead from other costs (h, w) to those of this map; Cancelled if stopped."""
        changes = [np.empty((0, 3))]
        for rows in row_blocks(costs.shape, stop):
            ours = self._costs_at(rows)
            y, x = np.nonzero(ours != costs[rows])
            changes.append(np.column_stack([x, y + rows.start, ours[y, x]]))
        return np.concatenate(changes)

    def cell(self, pose: ArrayLike, name: str, outside: type[Exception]) -> NDArray[np.int64]:
        """Return the cell (2,) of a pose, or raise ``outside``."""
        cell = self.grid.world_to_cell(pose[:2])
        if not self.grid.contains(cell):
            size = np.multiply((self.grid.width, self.grid.height), self.grid.resolution)
            raise outside('{} {}, cell ({}, {}), is outside the map of {} x {} cells ({:g} x {:g} m from {})'.format(
                name, place(pose), *cell, self.grid.width, self.grid.height, *size, place(self.grid.origin)))
        return cell

    def why_occupied(self, pose: ArrayLike, cell: NDArray[np.int64], name: str) -> str:
        """Return the sentence for a pose in an occupied cell."""
        x, y = cell
        if self.obstacles[y, x]:
            value = self.grid.data[y, x]
            reason = ('occupied' if value >= OCCUPIED_FROM else 'unknown' if value == UNKNOWN
                      else 'occupied since an update of the costs')
        elif self._forbidden[y, x]:
            reason = 'forbidden'
        else:
            reason = f'within the inflation radius of {self._inflation_radius:g} m of an obstacle or a forbidden cell'
        found = nearest(~self.occupied, self.grid.world_to_grid(pose[:2]))
        where = 'no cell is free' if found is None else (
            'the nearest free cell ({}, {}) is {:.2f} m away'.format(*found[0], found[1] * self.grid.resolution))
        return '{} {}, cell ({}, {}), is {}; {}'.format(name, place(pose), *cell, reason, where)

    def _note(self, x, y, before):
        """Become the version after another one, from which these cells differ."""
        self.version = before.version + 1
        self._changes = (*before._changes, np.column_stack([x, y, self._costs_at((y, x))]))[-_CHANGES_KEPT:]

    def _costs_at(self, index):
        """Return the costs of a part of the map, inf where occupied."""
        return np.where(self.occupied[index], np.inf, 1.0 if self.weights is None else self.weights[index])


def place(pose: ArrayLike) -> str:
    """Return the position of a pose as text."""
    return f'({pose[0]:g}, {pose[1]:g})'


def _fixed(array):
    array.flags.writeable = False
    return array


def _changed(array, x, y, values):
    """Return a fixed copy with other values, or the array itself if it has them already."""
    if (array[y, x] == values).all():
        return array
    array = array.copy()
    array[y, x] = values
    return _fixed(array)
