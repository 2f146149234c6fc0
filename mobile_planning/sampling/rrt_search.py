"""One query of an RRT: grow to the first path, then make it shorter while there is time."""
from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mobile_planning.geometry import wrap_angle
from mobile_planning.sampling.plan_result import Improvement
from mobile_planning.sampling.track import Track, empty_track
from mobile_planning.sampling.tree import Tree, lineage, planted, with_room
from mobile_planning.world.surroundings import Surroundings

if TYPE_CHECKING:
    from mobile_planning.sampling.rrt_kernels import Task

# Work between two looks at the clock: samples for a tree, trials to shorten a path.
_SAMPLES, _STAR_SAMPLES, _TRIALS, _POLISH = 2000, 200, 2000, 4000
# A path that is so much longer than the best after a first smoothing is not smoothed further.
_HOPELESS = 1.15
# How many goal nodes a tree may have before the dearer half of them is forgotten.
_GOALS = 4096
#: Nodes in a tree, at most.
MOST_NODES = 1_000_000
# Widest circle in which nodes are rerouted, relative to the extent of the world.
_DENSITY = 0.5
# Between two reports of the progress [s].
_PERIOD = 0.1

Progress = Callable[[float, int, float], None]


@dataclass
class Search:
    """The state of one query.

    Parameters
    ----------
    world : Surroundings
    tree : Tree
        From which to grow.
    task : Task
    seed : int
    budget : int
        Samples to draw, at most.
    stop : (1,) ndarray of uint8
        Ends it when set.
    progress : callable, optional
        Called with the best cost [m] (or infinity), the number of nodes and the time [s] since the query began.
    has_scouts : bool
        Whether to look for other ways with fresh trees.
    has_two_trees : bool
        Whether a second tree grows from the goal, where it can; the goal itself must be free.
    """

    world: Surroundings
    tree: Tree
    task: Task
    seed: int
    budget: float
    stop: NDArray[np.uint8]
    progress: Progress | None = None
    has_scouts: bool = True
    has_two_trees: bool = True
    track: Track | None = None
    end: NDArray[np.float64] | None = None
    iterations: int = 0
    history: list[Improvement] = field(default_factory=list)

    def __post_init__(self):
        self._begun = self._reported = time.perf_counter()
        self._random = np.random.default_rng(self.seed).integers(2**64, size=1, dtype=np.uint64)
        self._goals = np.zeros(_GOALS, np.int64)
        self._raw = np.inf
        self.has_two_trees = self.has_two_trees and self._can_be_driven_back
        self._other = self._from_goal()

    @property
    def cost(self) -> float:
        """The length of the best path [m], infinite without one."""
        return self.history[-1].cost if self.history else np.inf

    @property
    def elapsed(self) -> float:
        """Seconds since the query began."""
        return time.perf_counter() - self._begun

    @property
    def _is_over(self) -> bool:
        return bool(self.stop[0]) or self.iterations >= self.budget

    @property
    def _can_be_driven_back(self) -> bool:
        """Whether a way to the goal is free if and only if it is when driven from the goal back, turned round."""
        space = self.world.space
        return self.task.goal_rate > 0 and space.reach[3] == 0 and not len(space.body)

    def to_first_path(self, most: float = np.inf) -> None:
        """Grow the tree until it reaches the goal zone, with so many samples at most, or until the search is over."""
        if self.history:
            return
        inside = self._nodes_in_zone()
        if len(inside):
            self._goals[0] = min(len(inside), _GOALS - 1)
            self._goals[1:1 + self._goals[0]] = inside[:_GOALS - 1]
            self._take_best_of_tree()
            return
        self.tree, self._other, node = self._grown(self.tree, self._other, most)
        if node >= 0:
            self._goals[:2] = 1, node
            self._take_best_of_tree()

    def improve(self) -> None:
        """Make the path shorter until the search is over: reroute the tree, send scouts, polish what is best."""
        while not self._is_over and self.cost > 0.0:
            self._reroute()
            if self.has_scouts:
                self._scout()
            if self.track is not None:
                polished = self.track.copy()
                self._shorten(polished, _TRIALS)
                self._offer(polished, self.end)
            self._report()

    def nearest_to_goal(self) -> int:
        """Return the node of the tree from which the straight way to the goal is the shortest."""
        places = self.tree.poses[:self.tree.count, :2]
        return int(np.argmin(np.hypot(*(places - self.task.goal[:2]).T)))

    def track_to(self, node: int, tree: Tree | None = None) -> Track:
        """Return the track from the root to a node, with room to be shortened."""
        from mobile_planning.sampling.graft_kernels import write_track

        tree = self.tree if tree is None else tree
        nodes = np.array(lineage(tree, node))
        track = empty_track(tree.poses[0], 10 * len(nodes) + 256)
        write_track(tree, nodes, self.task.car, track)
        return track

    def _nodes_in_zone(self) -> NDArray[np.int64]:
        offset = np.abs(self.tree.poses[:self.tree.count] - self.task.goal)
        offset[:, 2] = np.abs(wrap_angle(offset[:, 2])) if not self.task.car.turns_in_place else 0.0
        return np.flatnonzero((offset <= self.task.precision).all(axis=1))

    def _from_goal(self) -> Tree | None:
        """Return a new tree from the goal turned round, if there is to be one."""
        if not self.has_two_trees:
            return None
        return planted(self.task.goal + (0.0, 0.0, np.pi), self.tree.box)

    def _grown(self, tree: Tree, other: Tree | None, most: float = np.inf) -> tuple[Tree, Tree | None, int]:
        """Return the trees grown until the first one reaches the goal zone, and its node there or -1."""
        from mobile_planning.sampling.rrt_kernels import FULL, REACHED, grow

        end = self.iterations + most
        while not self._is_over and self.iterations < end and tree.count < MOST_NODES:
            samples = int(min(_SAMPLES, self.budget - self.iterations, end - self.iterations))
            if other is None:
                reason, node, made = grow(self.world, tree, self.task, self._random, samples, self.stop)
            else:
                reason, tree, node, made = self._grow_both(tree, other, samples)
            self.iterations += made
            if reason == REACHED:
                return tree, other, node
            if reason == FULL:
                tree = with_room(tree, tree.count)
                other = None if other is None else with_room(other, other.count)
            self._report()
        return tree, other, -1

    def _grow_both(self, tree: Tree, other: Tree, samples: int) -> tuple[int, Tree, int, int]:
        """Grow both trees; return why that ended, the first tree, its node in the goal zone and the samples drawn."""
        from mobile_planning.sampling.meeting_kernels import grow_both, take_branch
        from mobile_planning.sampling.rrt_kernels import REACHED
        from mobile_planning.sampling.tree_kernels import WAY_ROW

        count = max(self.task.nb_options, 10)
        ids, ways = np.empty(count, np.int64), np.empty((count, WAY_ROW))
        reason, node, joined, made = grow_both(
            self.world, tree, other, self.task, self._random, samples, ids, ways, self.stop)
        if reason == REACHED and joined >= 0:
            tree = with_room(tree, other.count + 1)
            node = take_branch(tree, other, self.task, node, joined, ids, ways)
        return reason, tree, node, made

    def _reroute(self) -> None:
        """Grow the tree by RRT*, and take up the best path that it has."""
        from mobile_planning.sampling.rrt_star_kernels import grow_star

        if self.tree.count + _STAR_SAMPLES > MOST_NODES:
            self.iterations += _STAR_SAMPLES
            return
        self.tree = with_room(self.tree, _STAR_SAMPLES + 1)
        self._forget_dear_goals()
        samples = int(min(_STAR_SAMPLES, self.budget - self.iterations))
        _, made = grow_star(self.world, self.tree, self.task, self._random, self._goals, self.cost, _DENSITY, samples,
                            self.stop)
        self.iterations += made
        self._take_best_of_tree()

    def _forget_dear_goals(self) -> None:
        """Leave room in the list of goal nodes."""
        count = int(self._goals[0])
        if count > _GOALS // 2:
            listed = self._goals[1:1 + count]
            cheapest = listed[np.argsort(self.tree.costs[listed], kind='stable')[:_GOALS // 4]]
            self._goals[0] = len(cheapest)
            self._goals[1:1 + len(cheapest)] = cheapest

    def _take_best_of_tree(self) -> None:
        """Shorten the tree's best path if it is new, and keep it if it is the best of all."""
        listed = self._goals[1:1 + self._goals[0]]
        if not len(listed):
            return
        node = int(listed[np.argmin(self.tree.costs[listed])])
        if not self.tree.costs[node] < self._raw - 1e-9:
            return
        self._raw = float(self.tree.costs[node])
        track = self.track_to(node)
        is_first = not self.history
        self._offer(track.copy(), self.tree.poses[node].copy())
        if not is_first:
            self._shorten(track, _TRIALS)
            self._offer(track, self.tree.poses[node].copy())

    def _scout(self) -> None:
        """Look for another way with a fresh tree, and shorten it."""
        scout, _, node = self._grown(planted(self.tree.poses[0], self.tree.box), self._from_goal(), _SAMPLES)
        if node < 0:
            return
        track = self.track_to(node, scout)
        self._shorten(track, _TRIALS)
        if track.length < _HOPELESS * self.cost:
            self._shorten(track, _POLISH)
        self._offer(track, scout.poses[node].copy())

    def _shorten(self, track: Track, trials: int) -> None:
        from mobile_planning.sampling.track_kernels import shorten

        shorten(self.world, track, track.copy(), self._random, self.task.car, self.task.begin, self.task.speed, trials,
                self.stop)

    def _offer(self, track: Track, end: NDArray[np.float64]) -> None:
        """Keep a track that is the shortest so far, and make it a branch of the tree."""
        if not track.length < self.cost - 1e-9:
            return
        is_first = not self.history
        self.track, self.end = track.copy(), end
        self.history.append(Improvement(self.elapsed, track.length))
        if not is_first:
            self._graft()

    def _graft(self) -> None:
        from mobile_planning.sampling.graft_kernels import graft

        if self._raw <= self.cost * 1.001 or self._goals[0] + 2 > _GOALS:
            return
        self.tree = with_room(self.tree, 4 * self.track.count + 64)
        node = graft(self.world, self.tree, self.task, self.track, *self.end)
        if node >= 0:
            if node not in self._goals[1:1 + self._goals[0]]:
                self._goals[0] += 1
                self._goals[self._goals[0]] = node
            self._raw = min(self._raw, float(self.tree.costs[node]))

    def _report(self) -> None:
        now = time.perf_counter()
        if self.progress is not None and now - self._reported >= _PERIOD:
            self._reported = now
            self.progress(self.cost, self.tree.count, now - self._begun)
