"""A*: one path on one map, without a plan that is kept."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import Cancelled, InvalidInput, NoPath
from mobile_planning.grid.dstar import positive_costs
from mobile_planning.grid.planner import PlannerBase
from mobile_planning.grid.repairable_field import bordered, canonical_moves_of, checked_path
from mobile_planning.world.occupancy_grid import OccupancyGrid
from mobile_planning.world.row_blocks import by_rows


def astar(
    occgrid: ArrayLike | OccupancyGrid,
    start: ArrayLike,
    goal: ArrayLike,
    *,
    corner_cutting: bool = True,
    costs: ArrayLike | None = None,
    stop: NDArray[np.uint8] | None = None,
) -> tuple[NDArray[np.int64], float]:
    """Return the best path between two cells and its cost.

    Parameters
    ----------
    occgrid : (h, w) array_like or OccupancyGrid
        Nonzero where a robot must not enter.
    start, goal : (2,) array_like
        Cells (x, y).
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell at its side; if not, both cells beside it must be free.
    costs : (h, w) array_like, optional
        Cost of each cell, any positive number, inf where a robot must not enter: a step costs the mean of its two
        cells' costs times its length. See `clearance_costs`. If not given, every free cell costs 1.
    stop : (1,) ndarray of uint8, optional
        Set ``stop[0]`` from another thread to give up.

    Returns
    -------
    path : (N, 2) ndarray of int64
        Cells from start to goal, both included.
    cost : float
        Without ``costs`` the length of the path [cells], exact: ``s + d * sqrt(2)`` for its numbers of steps.

    Raises
    ------
    StartOutside, StartOccupied, GoalOutside, GoalOccupied
        If an end is no free cell.
    NoPath
        If no path joins them.
    InvalidInput
        If a number is not finite or out of its range.
    Cancelled
        If ``stop`` was set.

    Examples
    --------
    >>> path, cost = astar([[0, 0, 0], [0, 1, 0]], (2, 1), (0, 1), corner_cutting=False)
    >>> path.tolist(), cost
    ([[2, 1], [2, 0], [1, 0], [0, 0], [0, 1]], 4.0)
    """
    stop = np.zeros(1, np.uint8) if stop is None else stop
    occupied = PlannerBase(occgrid).occgrid
    if costs is not None:
        costs = positive_costs(costs, stop)
        if costs.shape != occupied.shape:
            raise InvalidInput(f'costs of shape {costs.shape} for a grid of shape {occupied.shape}')
        costs = by_rows(lambda is_closed, cost: np.where(is_closed, np.inf, cost), float, stop, occupied, costs)
        occupied = by_rows(np.isinf, bool, stop, costs)
    ends = PlannerBase(occupied, start=start, goal=goal)
    search = _search_uniform if costs is None else _search_weighted
    path, cost = search(occupied if costs is None else costs, ends.start, ends.goal, bool(corner_cutting), stop)
    if len(path) == 0:
        raise NoPath('no path leads from start ({}, {}) to goal ({}, {})'.format(*ends.start, *ends.goal))
    return path, cost


def _search_uniform(occupied, start, goal, corner_cutting, stop):
    """Return the shortest path and its length, an empty one if there is none."""
    from mobile_planning.grid import astar_kernels as kernels
    from mobile_planning.world.cost_to_go_kernels import length_of

    blocked = bordered(occupied.view(np.uint8), 1, stop)
    width = blocked.shape[1]
    ends = [int((y + 1) * width + x + 1) for x, y in (start, goal)]
    # Fresh zeros cost nothing where the search does not come.
    states = np.zeros(blocked.size, np.int64)
    moves = canonical_moves_of(corner_cutting)
    if kernels.search_uniform(states, blocked.reshape(-1), width, *ends, moves, stop) < 0:
        raise Cancelled('the search for a path was stopped before it was complete')
    if states[ends[1]] == 0:
        return np.empty((0, 2), np.int64), np.inf
    return kernels.trace_back(states, width, *ends), length_of(states[ends[1]] & ~kernels.WAITING)


def _search_weighted(costs, start, goal, corner_cutting, stop):
    """Return the path of least cost and that cost, an empty one if there is none."""
    from mobile_planning.grid import astar_kernels, descent_kernels

    grid = bordered(costs, np.inf, stop)
    width, flat = grid.shape[1], grid.reshape(-1)
    ends = [int((y + 1) * width + x + 1) for x, y in (start, goal)]
    least, g = float(costs.min()), np.empty_like(flat)
    if astar_kernels.search_weighted(g, flat, width, *ends, least, corner_cutting, stop) < 0:
        raise Cancelled('the search for a path was stopped before it was complete')
    if g[ends[1]] == np.inf:
        return np.empty((0, 2), np.int64), np.inf
    # The field leads back to the start.
    back, sums, first = descent_kernels.descend(np.array([start]), np.zeros(1), 0, np.inf, flat, g, width, ends[1],
                                                least, corner_cutting, stop)
    return checked_path(back[first:], tuple(goal.tolist()), stop)[::-1], sums[first]
