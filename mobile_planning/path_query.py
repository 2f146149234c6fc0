"""One path query on one map: ends that may have to be moved, the route between them, and its poses."""
from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import GoalOccupied, GoalOutside, NoPath, StartOccupied, StartOutside
from mobile_planning.geometry import wrap_angle
from mobile_planning.grid_routes import KeptPlans
from mobile_planning.nearest_cell import nearest, shortest_way
from mobile_planning.planning_map import PlanningMap, place
from mobile_planning.stop_flag import StopFlag
from mobile_planning.world.cost_to_go import cost_to_go
from mobile_planning.world.row_blocks import by_rows


@dataclass(frozen=True, eq=False)
class PlannedPath:
    """The answer to a query.

    Attributes
    ----------
    poses : (N, 3) ndarray [m, m, rad]
        From exactly the start to exactly the goal. Each between is on a cell centre and headed to the next, those of
        the lattice on its curves and headed along them.
    cost : float [m]
        Length of the path from the start's cell centre to the goal's; of a planner that heeds costs each part of it
        times the cost there.
    planning_time : float [s]
    statistics : dict of str to str
        How the path came about.
    """

    poses: NDArray[np.float64]
    cost: float
    planning_time: float
    statistics: dict[str, str]


class PathQuery(NamedTuple):
    """One query, answered with the same map from its beginning to its end.

    Attributes
    ----------
    terrain : PlanningMap
    plans : KeptPlans
    planner : str
        Id.
    flag : StopFlag
        Whose ``with`` block is open.
    done : (2,) ndarray of int64
        What the planner has done, and of how much, where it can tell.
    """

    terrain: PlanningMap
    plans: KeptPlans
    planner: str
    flag: StopFlag
    done: NDArray[np.int64]

    def answer(self, start: NDArray[np.float64], goal: NDArray[np.float64],
               tolerance: float) -> tuple[NDArray[np.float64], float, dict[str, str]]:
        """Return the poses (N, 3) from start to goal, their cost [m], and how they came about.

        Parameters
        ----------
        start, goal : (3,) ndarray [m, m, rad]
        tolerance : float [m]
            How far an occupied goal may be moved.

        Raises
        ------
        PlanningError
            See `PathServer.plan_path`; Cancelled when the flag is set.
        """
        terrain, facts = self.terrain, {'planner': self.planner}
        way, end, goal, moved = self._ends(start, goal, tolerance)
        steps, yaw = np.diff(way, axis=0), terrain.grid.origin[2]
        # A robot that has come out of the inflation is headed the way it came.
        heading = np.arctan2(*steps[-1, ::-1]) if len(steps) else start[2] - yaw
        try:
            with self.plans.plan(self.planner, end, self.flag) as plan:
                route = plan.route(terrain, np.append(way[-1], heading), np.append(end, goal[2] - yaw),
                                   self.flag.array, self.done)
        except NoPath:
            raise NoPath(f'no path leads from start {place(start)} to goal {place(goal)}') from None
        points, cost = np.array(route.points, float), route.cost
        facts.update(route.facts)
        if moved:
            facts['goal_moved'] = f'{moved:.3f} m'
        if len(steps):
            length = float(np.hypot(*steps.T).sum())
            facts['left_inflation'] = f'{length * terrain.grid.resolution:.3f} m'
            before = np.column_stack([way[:-1], np.arctan2(*steps.T[::-1])])
            points, cost = np.concatenate([before[:, :points.shape[1]], points]), cost + length
        points[:, :2] = terrain.grid.grid_to_world(points[:, :2] + 0.5)
        facts['path_cells' if points.shape[1] == 2 else 'path_points'] = str(len(points))
        return _poses(points, start, goal, yaw), cost * terrain.grid.resolution, facts

    def _ends(self, start, goal, tolerance):
        """Return the way (N, 2) from the start's cell to where planning begins, the goal's cell, pose and move [m]."""
        terrain = self.terrain
        begin = terrain.cell(start, 'start', StartOutside)
        end = terrain.cell(goal, 'goal', GoalOutside)
        if terrain.obstacles[begin[1], begin[0]]:
            raise StartOccupied(terrain.why_occupied(start, begin, 'start'))
        is_inside, way, moved = bool(terrain.occupied[begin[1], begin[0]]), begin[None], 0.0
        if terrain.occupied[end[1], end[0]]:
            if tolerance == 0.0:
                raise GoalOccupied(terrain.why_occupied(goal, end, 'goal'))
            if is_inside:
                way = self._way_out(start, begin, ~terrain.occupied)
            end, moved = self._nearest_reachable(way[-1], goal, end, tolerance)
            goal = np.append(terrain.grid.cell_to_world(end), goal[2])
        elif is_inside:
            with self.plans.plan('distance_transform', end, self.flag) as plan:
                field = plan.field(terrain, self.flag.array, self.done)
                reaching = by_rows(np.isfinite, bool, self.flag.array, field)
            way = self._way_out(start, begin, reaching)
        return way, end, goal, moved

    def _way_out(self, start, begin, wanted):
        """Return the shortest way (N, 2) from within the inflation to a wanted cell."""
        way = shortest_way(self.terrain.obstacles, begin, wanted, self.plans.rules.corner_cutting, self.flag)
        if way is None:
            raise NoPath(f'no way leads out of the inflation around start {place(start)} to where the goal is reached; '
                         + self.terrain.why_occupied(start, begin, 'start'))
        return way

    def _nearest_reachable(self, begin, goal, end, tolerance):
        """Return the free cell nearest to the goal that is reached from a cell, and its distance [m]."""
        terrain = self.terrain
        field = cost_to_go(terrain.occupied, begin, corner_cutting=self.plans.rules.corner_cutting,
                           stop=self.flag.array)
        found = nearest(by_rows(np.isfinite, bool, self.flag.array, field), terrain.grid.world_to_grid(goal[:2]))
        distance = found[1] * terrain.grid.resolution
        if distance > tolerance * (1 + 1e-9):
            raise GoalOccupied(terrain.why_occupied(goal, end, 'goal') + '; the nearest one that can be reached is '
                               f'{distance:.2f} m away, beyond the tolerance of {tolerance:g} m')
        return found[0], distance


def _poses(points, start, goal, yaw):
    """Return the path's points (N, 2) or (N, 3) with start and goal for its ends, and a heading for each.

    Headings that the points have are relative to the grid's ``yaw``.
    """
    between = points[1:-1]
    poses = np.concatenate([start[None], np.column_stack([between[:, :2], np.zeros(len(between))]), goal[None]])
    if points.shape[1] == 3:
        poses[1:-1, 2] = wrap_angle(between[:, 2] + yaw)
    else:
        ahead = np.diff(poses[1:, :2], axis=0)
        poses[1:-1, 2] = np.arctan2(ahead[:, 1], ahead[:, 0])
    return poses
