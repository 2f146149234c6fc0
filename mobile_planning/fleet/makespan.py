"""Makespan: the least time that a mission can take, were each robot alone in the world."""
from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from mobile_planning.errors import PlanningError
from mobile_planning.fleet.verification import Body
from mobile_planning.world.cost_to_go import cost_to_go, descend, shortcut
from mobile_planning.world.environment import Environment
from mobile_planning.world.occupancy_grid import OccupancyGrid

#: Of the grid that ways are measured on [m].
_RESOLUTION = 0.1


def lower_bound(bodies: Sequence[Body], environment: Environment) -> float:
    """Return the time [s] of the robot that has the longest way, from rest to rest at full speed, turns not counted.

    A robot with several goals comes to rest at each.

    Examples
    --------
    >>> body = Body(1, 0.2, np.array([1.0, 1.0, 0.0]), np.array([9.0, 1.0, 0.0]), 1.0, 5.0, 2.0)
    >>> lower_bound([body], Environment())
    8.5
    """
    return max(sum(least_time(way(a[:2], b[:2], body.radius, environment), body.v_max, body.a_max)
                   for a, b in pairwise((body.start, *body.goals))) for body in bodies)


def least_time(length: float, v_max: float, a_max: float) -> float:
    """Return the time [s] that ``length`` [m] takes from rest to rest."""
    if length < v_max**2 / a_max:
        return 2.0 * float(np.sqrt(length / a_max))
    return length / v_max + v_max / a_max


def way(start: ArrayLike, goal: ArrayLike, radius: float, environment: Environment) -> float:
    """Return the length [m] of a short way for a disc, not below the straight line.

    The shortest path on a grid of 0.1 m, pulled tight: around a corner it may be some 3 % longer
    than the shortest way. A cell is free if the disc fits anywhere in it, so that no way through a
    gap is overlooked; where the grid knows none at all, the straight line counts.
    """
    start, goal = np.asarray(start, float), np.asarray(goal, float)
    straight = float(np.linalg.norm(goal - start))
    along = start + np.linspace(0.0, 1.0, int(np.ceil(straight / 0.05)) + 1)[:, None] * (goal - start)
    if environment.clearance(along).min() >= radius:
        return straight
    try:
        grid, occupied = _grid(radius, environment)
        cells = grid.world_to_cell(np.array([start, goal]))
        field = cost_to_go(occupied, cells[1])
        path = grid.cell_to_world(shortcut(occupied, descend(field, cells[0], cells[1]))).astype(float)
    except PlanningError:
        return straight
    path[0], path[-1] = start, goal
    return max(straight, float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum()))


def _grid(radius, environment):
    """Return a grid over the world, and which of its cells (h, w) leave a disc no room."""
    x_min, y_min, x_max, y_max = environment.bounds
    shape = tuple(int(np.ceil(side / _RESOLUTION)) for side in (y_max - y_min, x_max - x_min))
    grid = OccupancyGrid(np.zeros(shape, np.int8), _RESOLUTION, (x_min, y_min, 0.0))
    rows, columns = np.indices(shape)
    room = environment.clearance(grid.cell_to_world(np.stack([columns, rows], axis=-1)))
    return grid, room < radius - _RESOLUTION * np.sqrt(0.5)
