"""Paths by sampling on the current map and among the current obstacles, by the id of the planner."""
from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import ApproximateOnly, Cancelled, InvalidInput, NoPath, PlanningTimeout
from mobile_planning.geometry import wrap_angle
from mobile_planning.path_query import PlannedPath
from mobile_planning.sampling.plan_result import PlanStatus
from mobile_planning.sampling.prm import PRMPlanner
from mobile_planning.sampling.prm_statistics import RoadmapStatistics
from mobile_planning.sampling.rrt import RRT
from mobile_planning.sampling.smoothing import smooth
from mobile_planning.sampling.steering import Steering
from mobile_planning.sampling_options import ROADMAPS, SamplingOptions, check_planner, roadmap_id
from mobile_planning.sampling_scene import SamplingScene
from mobile_planning.world.moving_obstacle import MovingObstacle
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

# Trials to shorten the path of a roadmap.
_SMOOTHING = 2000


@dataclass(eq=False)
class Progress:
    """How far a query is, for another thread to look at.

    Attributes
    ----------
    best_cost : float [m]
        Of the best path so far, infinite without one.
    nodes : int
    began : float or None [s]
        When planning began, on the monotonic clock.
    """

    best_cost: float = np.inf
    nodes: int = 0
    began: float | None = None

    def update(self, best_cost: float, nodes: int) -> None:
        """Tell of a planner's progress."""
        self.best_cost, self.nodes = float(best_cost), int(nodes)


class SamplingServer:
    """Answers queries by trees and roadmaps; the roadmaps are kept from query to query and from map to map.

    Parameters
    ----------
    options : SamplingOptions

    Examples
    --------
    >>> server = SamplingServer(SamplingOptions(roadmap_nodes=300))
    >>> server.set_map(OccupancyGrid(np.zeros((50, 50), int), 0.1))
    >>> plan = server.plan('prm', (1, 1, 0), (4, 4, 0), deadline=60.0, seed=1)
    >>> round(plan.cost, 2), plan.poses[0].tolist()
    (4.24, [1.0, 1.0, 0.0])
    """

    def __init__(self, options: SamplingOptions):
        self.options = options
        self._scene = SamplingScene(options.robot_radius, options.unknown_is_free)
        # Each with the scene and the time on which it was checked last.
        self._roadmaps: dict[str, tuple[PRMPlanner, SamplingScene, float]] = {}
        self._draw: Callable[[], NDArray[np.float64]] = _nothing

    def set_map(self, grid: OccupancyGrid) -> None:
        """Plan on this map from now on; roadmaps stay, and are checked on it, as far as it is as large."""
        self._scene = self._scene.with_map(grid)

    def set_obstacles(self, fixed: Sequence[Obstacle], moving: Sequence[MovingObstacle] = (), since: float = 0.0
                      ) -> None:
        """Plan among these obstacles from now on, in place of those before.

        Parameters
        ----------
        fixed : sequence of Obstacle
        moving : sequence of MovingObstacle
        since : float [s]
            When the moving ones were where their shapes are, on the clock of ``now`` in `plan`.
        """
        self._scene = replace(self._scene, fixed=tuple(fixed), moving=tuple(moving), since=float(since))

    def plan(self, planner: str, start: ArrayLike, goal: ArrayLike, *, deadline: float = 2.0, seed: int = 0,
             now: float = 0.0, stop: NDArray[np.uint8] | None = None, progress: Progress | None = None) -> PlannedPath:
        """Return the path between two poses.

        A tree meets moving obstacles where they will be when the robot comes by; a roadmap takes them to stay where
        they are now.

        Parameters
        ----------
        planner : str
            Id, empty for the default: rrt for the first path of a car that is found, rrt_star for the best one until
            the deadline, prm for straight lines, prm_dubins for a car, prm_reeds_shepp for one that reverses, all
            three with a roadmap.
        start, goal : (3,) array_like [m, m, rad]
        deadline : float [s]
            Above 0; rrt_star takes all of it.
        seed : int
        now : float [s]
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread to withdraw the query.
        progress : Progress, optional
            Kept up to date meanwhile.

        Raises
        ------
        InvalidPlanner
            If there is no planner of that id.
        NoMap
            If no map was set.
        StartOutside, GoalOutside, StartOccupied, GoalOccupied, InvalidInput
            If an end makes no sense.
        PlanningTimeout, Cancelled, NoPath, ApproximateOnly
            If there is no path.
        """
        began, progress = time.perf_counter(), Progress() if progress is None else progress
        planner, progress.began = planner or self.options.default_planner, time.monotonic()
        check_planner(planner)
        if not 0 < deadline < np.inf:
            raise InvalidInput(f'deadline {deadline} s is not a finite number above 0')
        answer = self._by_roadmap if planner in ROADMAPS else self._by_tree
        until = time.monotonic() + deadline
        result, facts = answer(planner, start, goal, now, until, seed, stop, progress)
        progress.update(result.cost if result.is_solved else np.inf, result.nodes)
        _raise_unless_solved(result)
        facts = {'planner': planner, 'seed': str(result.seed), 'nodes': str(result.nodes),
                 'collision_checks': str(result.collision_checks), **facts}
        return PlannedPath(_poses(result.path, start, goal), result.cost, time.perf_counter() - began, facts)

    def build_roadmap(self, planner: str = '', nodes: int = 0, *, seed: int = 0, now: float = 0.0,
                      deadline: float | None = None, stop: NDArray[np.uint8] | None = None) -> RoadmapStatistics:
        """Build the roadmap of a planner anew; 0 nodes are those of the options. Errors as in `PRMPlanner`."""
        roadmap = self._new_roadmap(roadmap_id(planner), now)
        roadmap.build_roadmap(nodes or self.options.roadmap_nodes, seed=seed, deadline=deadline, stop=stop)
        self._keep(roadmap_id(planner), roadmap, now)
        return roadmap.statistics()

    def save_roadmap(self, planner: str, path: str | Path) -> RoadmapStatistics:
        """Write the roadmap of a planner to a file; NotBuilt if there is none, OSError if it cannot be written."""
        planner = roadmap_id(planner)
        roadmap = self._roadmaps[planner][0] if planner in self._roadmaps else self._new_roadmap(planner, 0.0)
        roadmap.save(path)
        return roadmap.statistics()

    def load_roadmap(self, planner: str, path: str | Path, *, now: float = 0.0) -> RoadmapStatistics:
        """Take the roadmap of a planner from a file; InvalidInput if it is none for this map, OSError if unreadable."""
        roadmap = self._new_roadmap(roadmap_id(planner), now)
        roadmap.load(path)
        self._keep(roadmap_id(planner), roadmap, now)
        return roadmap.statistics()

    def clear(self) -> None:
        """Forget all roadmaps and the newest tree."""
        self._roadmaps.clear()
        self._draw = _nothing

    def newest_graph(self) -> NDArray[np.float64]:
        """Return the edges (n, 2, 2) [m] of the newest tree or roadmap, from node to node."""
        return self._draw()

    def _new_roadmap(self, planner, now):
        """Return the planner of a roadmap that is still to be built."""
        scene = self._scene.standing_still(now)
        if planner == 'prm':
            return PRMPlanner(scene)
        return PRMPlanner(scene, turning_radius=self.options.turning_radius, steering=_steering(planner))

    def _keep(self, planner, roadmap, now):
        """Answer with this roadmap from now on."""
        self._roadmaps[planner] = roadmap, self._scene, now
        graph = roadmap.roadmap
        self._draw = lambda: graph.points[graph.edges][..., :2]

    def _kept(self, planner, now):
        """Return the roadmap of a planner, checked on the scene as it is now; None if it does not suit the map."""
        kept, scene, then = self._roadmaps.get(planner, (None, None, None))
        if kept is None or self._scene.is_as_before(now, scene, then):
            return kept
        try:
            kept.change_environment(self._scene.standing_still(now))
        except InvalidInput:
            return None  # the map has another size
        self._keep(planner, kept, now)
        return kept

    def _by_roadmap(self, planner, start, goal, now, until, seed, stop, progress):
        """Return the result of a roadmap, which is built if there is none that suits the map."""
        kept, made = self._kept(planner, now), 'reused'
        if kept is None:
            self.build_roadmap(planner, seed=seed, now=now, deadline=_remaining(until), stop=stop)
            kept, made = self._roadmaps[planner][0], 'built'
        progress.update(np.inf, kept.statistics().nodes)
        ends = [_position(end) for end in (start, goal)] if planner == 'prm' else (start, goal)
        result = kept.query(*ends, deadline=_remaining(until), seed=seed, stop=stop)
        facts = {'roadmap': made, 'edges': str(kept.statistics().edges), 'roadmap_cost': f'{result.cost:.3f} m'}
        if result.status is PlanStatus.SOLVED and result.cost > 0:
            radius = 0.0 if planner == 'prm' else self.options.turning_radius
            shorter = smooth(result.path, self._scene.standing_still(now), radius, _remaining(until), seed,
                             nb_iteration=_SMOOTHING, steering=_steering(planner), cancel=stop)
            result = replace(result, path=shorter.path, cost=shorter.cost)
        return result, facts

    def _by_tree(self, planner, start, goal, now, until, seed, stop, progress):
        """Return the result of a tree that grows from the start."""
        tree = RRT(self._scene.in_motion(now), self.options.precision, radius=self.options.turning_radius,
                   steering=self.options.steering, speed=self.options.speed)
        tree.set_start(start)
        result = tree.run(goal, deadline=_remaining(until), seed=seed, star=planner == 'rrt_star', cancel=stop,
                          progress=lambda cost, nodes, _: progress.update(cost, nodes))
        self._draw = lambda: _tree_edges(tree)
        first = result.first_solution
        return result, {'iterations': str(result.iterations),
                        'first_path': 'none' if first is None else f'{1e3 * first:.1f} ms'}


def _remaining(until):
    """Return the time until then [s], or raise PlanningTimeout if there is none left."""
    remaining = until - time.monotonic()
    if remaining <= 0:
        raise PlanningTimeout('the deadline passed before a path was found')
    return remaining


def _steering(planner):
    """Return how the car of a planner with a roadmap is steered."""
    return Steering.REEDS_SHEPP if planner == 'prm_reeds_shepp' else Steering.DUBINS


def _position(pose):
    """Return the position of a pose, whose heading must be a number too."""
    pose = np.asarray(pose, dtype=float)
    if pose.shape != (3,) or not np.isfinite(pose).all():
        raise InvalidInput(f'{pose.tolist()} is not three finite numbers (x, y, theta)')
    return pose[:2]


def _nothing():
    """Return no edges."""
    return np.empty((0, 2, 2))


def _tree_edges(tree):
    """Return the ends (n, 2, 2) [m] of a tree's edges."""
    edges = [(start[:2], end[:2]) for start, end in tree.edges]
    return np.array(edges, dtype=float).reshape(-1, 2, 2)


def _raise_unless_solved(result):
    """Raise the error that a result without a path stands for."""
    kind, words = {
        PlanStatus.SOLVED: (None, ''),
        PlanStatus.TIMEOUT: (PlanningTimeout, 'the deadline passed before a path was found'),
        PlanStatus.CANCELLED: (Cancelled, 'the query was withdrawn'),
        PlanStatus.NO_PATH: (NoPath, 'the planner has found no path'),
        PlanStatus.APPROXIMATE: (ApproximateOnly, 'the path that was found ends before the goal')}[result.status]
    if kind is not None:
        raise kind(f'{words}, after {result.elapsed:.2f} s and with {result.nodes} nodes')


def _poses(path, start, goal):
    """Return the path's points or poses (N, 3) from start to goal, points headed to the next."""
    path = np.asarray(path)
    if path.shape[1] == 3:
        return path
    poses = np.column_stack([path, np.zeros(len(path))])
    steps = np.diff(path, axis=0)
    poses[:-1, 2] = np.arctan2(steps[:, 1], steps[:, 0])
    poses[0, 2], poses[-1, 2] = wrap_angle(start[2]), wrap_angle(goal[2])
    return poses
