"""Where to go: the shortest free path to the goal on a grid, around whoever is parked on it.

Safety never depends on it: a plan is committed for what it proves, not for where it leads.
"""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import NoPath
from mobile_planning.world.cost_to_go import cost_to_go, descend, shortcut
from mobile_planning.world.environment import Environment
from mobile_planning.world.occupancy_grid import OccupancyGrid


class Guidance:
    """The way to one goal for a disc in a static world.

    Parameters
    ----------
    environment : Environment
        With a boundary or a grid, which give the extent of the search.
    goal : (2,) array_like [m]
    radius : float [m]
        Of the disc.
    resolution : float [m]
        Of the grid that is searched.
    margins : sequence of float [m]
        Room to leave beside the disc: the first that admits a path is taken.
    """

    def __init__(self, environment: Environment, goal: ArrayLike, radius: float,
                 resolution: float = 0.1, margins: tuple[float, ...] = (0.15, 0.05, 0.01)):
        self.goal = np.asarray(goal, float)
        self._radius = radius
        self._margins = margins
        x_min, y_min, x_max, y_max = environment.bounds
        shape = (max(1, int(np.ceil((y_max - y_min) / resolution))), max(1, int(np.ceil((x_max - x_min) / resolution))))
        self._grid = OccupancyGrid(np.zeros(shape, np.int8), resolution, (x_min, y_min, 0.0))
        rows, columns = np.indices(shape)
        self._centres = self._grid.cell_to_world(np.stack([columns, rows], axis=-1))
        self._clearance = environment.clearance(self._centres)
        self._fields: dict[tuple, tuple] = {}

    def path(self, position: ArrayLike, parked: ArrayLike = (), keep_off: float = 0.0) -> NDArray[np.float64]:
        """Return way-points (W, 2) [m] from ``position`` to the goal, each in sight of the next.

        Parameters
        ----------
        position : (2,) array_like [m]
        parked : (P, 2) array_like [m]
            Centres of robots that stand still; where no path avoids them all, they are left out.
        keep_off : float [m]
            Distance to keep from the centres.

        Raises
        ------
        NoPath
            The static world alone lets no path through.
        """
        position = np.asarray(position, float)
        parked = np.asarray(parked, float).reshape(-1, 2)
        choices = [(margin, parked) for margin in self._margins] if len(parked) else []
        for margin, discs in choices + [(margin, parked[:0]) for margin in self._margins]:
            blocked, field = self._field(margin, discs, keep_off)
            start = self._nearest_reached(position, field)
            if start is None:
                continue
            cells = descend(field, start, self._goal_cell(), corner_cutting=False)
            way = self._grid.cell_to_world(shortcut(blocked, cells))
            return np.concatenate([position[None], way[1:-1], self.goal[None]])
        raise NoPath(f'no path for a disc of radius {self._radius} m leads from {position} to {self.goal}')

    def _goal_cell(self):
        return self._grid.world_to_cell(self.goal)

    def _field(self, margin, discs, keep_off):
        """Return the blocked cells and the cost-to-go field; the last eight are kept."""
        key = (margin, keep_off, discs.tobytes())
        if key not in self._fields:
            blocked = self._clearance < self._radius + margin
            for disc in discs:
                blocked |= np.hypot(*np.moveaxis(self._centres - disc, -1, 0)) < keep_off + margin
            # The goal itself may lie nearer to a wall than the margin asks for.
            near_goal = np.hypot(*np.moveaxis(self._centres - self.goal, -1, 0)) <= margin + self._grid.resolution
            blocked[near_goal & (self._clearance >= self._radius)] = False
            x, y = self._goal_cell()
            blocked[y, x] = False
            if len(self._fields) >= 8:
                del self._fields[next(iter(self._fields))]
            self._fields[key] = blocked, cost_to_go(blocked, (x, y), corner_cutting=False)
        return self._fields[key]

    def _nearest_reached(self, position, field, reach=0.5):
        """Return the cell nearest to ``position`` from which the goal is reached, None beyond ``reach`` [m]."""
        cell, span = self._grid.world_to_cell(position), int(np.ceil(reach / self._grid.resolution))
        low = np.maximum(cell - span, 0)
        window = (slice(low[1], cell[1] + span + 1), slice(low[0], cell[0] + span + 1))
        distance = np.hypot(*np.moveaxis(self._centres[window] - position, -1, 0))
        distance = np.where(np.isfinite(field[window]), distance, np.inf)
        if not distance.size or distance.min() > reach:
            return None
        row, column = np.unravel_index(distance.argmin(), distance.shape)
        return low + (column, row)


class Polyline:
    """A path by its arc length.

    Parameters
    ----------
    points : (W, 2) ndarray [m]
        At least one; repeated points are dropped.
    """

    def __init__(self, points: NDArray):
        keep = np.append(True, np.abs(np.diff(points, axis=0)).max(axis=1) > 1e-9)
        self.points = points[keep]
        steps = np.diff(self.points, axis=0)
        lengths = np.linalg.norm(steps, axis=1)
        self._starts, self._steps, self._lengths = self.points[:-1], steps, lengths
        self._at = np.append(0.0, np.cumsum(lengths))
        self.length = float(self._at[-1])

    def project(self, positions: NDArray) -> tuple[NDArray, NDArray]:
        """Return the arc length and the distance (K,), (K,) [m] of the nearest point to each (K, 2)."""
        if not len(self._lengths):
            return np.zeros(len(positions)), np.linalg.norm(positions - self.points[0], axis=1)
        offset = positions[:, None] - self._starts
        share = np.clip((offset * self._steps).sum(-1) / self._lengths**2, 0.0, 1.0)
        distance = np.linalg.norm(offset - share[..., None] * self._steps, axis=-1)
        nearest = distance.argmin(axis=1)
        rows = np.arange(len(positions))
        return self._at[nearest] + share[rows, nearest] * self._lengths[nearest], distance[rows, nearest]

    def beside(self, arc: NDArray, offset: NDArray) -> NDArray[np.float64]:
        """Return the points (K, 2) [m] at ``arc`` (K,), ``offset`` (K,) to the left of the path."""
        if not len(self._lengths):
            return np.repeat(self.points, len(arc), axis=0)
        segment = np.clip(np.searchsorted(self._at, arc, side='right') - 1, 0, len(self._lengths) - 1)
        direction = self._steps[segment] / self._lengths[segment, None]
        normal = np.column_stack([-direction[:, 1], direction[:, 0]])
        return self._starts[segment] + (arc - self._at[segment])[:, None] * direction + offset[:, None] * normal
