"""What can be done with a tree once it is grown: choose an edge, cut branches, drive on."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from mobile_planning.errors import InvalidInput, NoPath
from mobile_planning.sampling.curve import Curve
from mobile_planning.sampling.plan_result import PlanResult
from mobile_planning.sampling.rrt_graph import Edge
from mobile_planning.sampling.tree import children, descendants, kept, lineage, walk


class EdgeRule(Enum):
    """By which rule the best edge from the root is chosen."""

    #: The most nodes below it, as the seed document has it.
    DESCENDANTS = 'descendants'
    #: On the cheapest way into the goal zone, or else to the node nearest to the goal.
    GOAL = 'goal'

    @classmethod
    def _missing_(cls, value: object) -> None:
        raise InvalidInput(f'rule {value!r} is none of {", ".join(each.value for each in cls)}')


class Option(NamedTuple):
    """A way to join a sample to the tree: from which node, and the path."""

    node: tuple[float, ...]
    path: Curve


@dataclass(frozen=True, eq=False)
class Drive:
    """What `RRT.drive` did: the edges driven, in order, the last plan, and whether the goal zone was reached."""

    edges: tuple[Edge, ...]
    plan: PlanResult
    arrived: bool


class RRTMoves:
    """The operations of `RRT` on the tree that it has grown."""

    def select_options(self, sample: ArrayLike, nb_options: int, metric: str = 'local') -> list[Option]:
        """Chooses the best nodes for the expansion of the tree, and returns them in a list ordered by increasing cost.

        Parameters
        ----------
        sample : tuple
            The (x, y, psi) coordinates of the node we wish to connect to the tree.
        nb_options : int
            The number of options requested.
        metric : str
            One of 'local', 'euclidean' ('euclidian'): with the first the shortest paths of all nodes and words, with
            the second the nearest nodes by the straight line, each with its shortest path.

        Returns
        -------
        options : list of Option
            Sorted by the length of their paths; obstacles do not count.
        """
        if nb_options < 1:
            raise InvalidInput(f'nb_options {nb_options!r} is not a whole number of at least 1')
        if metric not in ('local', 'euclidean', 'euclidian'):
            raise InvalidInput(f'metric {metric!r} is none of local, euclidean, euclidian')
        pose, nodes = self._setting.pose(sample, 'sample'), list(self.nodes)
        positions = self._tree.poses[:self._tree.count]
        lines = np.hypot(*(positions[:, :2] - pose[:2]).T)
        nearest = np.argsort(lines, kind='stable')
        if metric != 'local':
            found = [Option(nodes[k], self.local_planner.shortest(positions[k], pose))
                     for k in nearest[:nb_options]]
            return sorted(found, key=lambda option: option.path.length)
        found = []
        for k in nearest:
            # No path is shorter than the straight line.
            if len(found) >= nb_options and lines[k] > found[nb_options - 1].path.length:
                break
            found += [Option(nodes[k], path) for path in self.local_planner.options(positions[k], pose)]
            found.sort(key=lambda option: option.path.length)
        return found[:nb_options]

    def select_best_edge(self, rule: EdgeRule = EdgeRule.DESCENDANTS) -> Edge:
        """Selects the best edge of the tree among the ones leaving from the root.

        Parameters
        ----------
        rule : EdgeRule
            By the number of nodes below, or towards the goal.

        Returns
        -------
        edge : Edge
            The best edge.

        Raises
        ------
        NoPath
            If no edge leaves the root.
        """
        child = self._best_child(EdgeRule(rule))
        positions = list(self.nodes)
        return self.edges[positions[0], positions[child]]

    def children_count(self, node: tuple[float, ...]) -> int:
        """Return how many nodes lie below a node, given by its position."""
        return len(walk(self._tree, self._number(node))) - 1

    def delete_all_children(self, node: tuple[float, ...]) -> None:
        """Removes all the nodes of the tree below the requested node, given by its position."""
        lost = set(walk(self._tree, self._number(node))[1:])
        self._plant(kept(self._tree, [each for each in walk(self._tree, 0) if each not in lost]))

    def advance(self, edge: Edge) -> None:
        """Move the root along one of its edges: what lies below its end is kept, the rest is cut off.

        Costs count from the new root, times go on.
        """
        child = self._number(edge.node_to)
        if self._tree.parents[child] != 0 or edge.node_from != self.root:
            raise InvalidInput(f'{edge} does not leave the root {self.root}')
        self._begin += float(self._tree.costs[child]) / self.options.speed
        self._plant(kept(self._tree, walk(self._tree, child)))

    def prune(self) -> int:
        """Cut off every branch whose way is no longer free, and return how many nodes went.

        For an environment that has changed: set ``rrt.environment`` first.
        """
        from mobile_planning.sampling.rrt_kernels import edge_is_free

        root = self._tree.poses[0]
        world, task = self._setting.world_about(root, self._begin), self._setting.task(root, self._begin, 0.0, 'local')
        alive = [0]
        for node in alive:
            alive += [child for child in children(self._tree, node) if edge_is_free(world, self._tree, task, child)]
        lost = self._tree.count - len(alive)
        if lost:
            self._plant(kept(self._tree, alive))
        return lost

    def drive(
        self, goal: ArrayLike, nb_iteration: int = 200, *, rule: EdgeRule = EdgeRule.GOAL, most_edges: int = 1000,
        seed: int = 0, on_edge: Callable[[Edge], ArrayLike | None] | None = None, **run_options,
    ) -> Drive:
        """Plan and drive in turns: grow the tree, drive its best edge, cut off what that leaves behind, and grow on.

        Parameters
        ----------
        goal : tuple
            The final requested position (x, y, psi).
        nb_iteration : int
            Iterations before each edge.
        rule : EdgeRule
            By which the edge is chosen.
        most_edges : int
            Driven at most.
        seed : int
            Of the first run; each further run has the next number.
        on_edge : callable, optional
            Drives the edge: called with each before the root moves to its end. It may set ``rrt.environment`` to what
            the world has become, and may return a new goal.
        **run_options
            As for `run`: goal_rate, metric, deadline, star, cancel, progress.

        Returns
        -------
        Drive

        Raises
        ------
        NoPath
            If at some place not one edge could be grown.
        """
        edges, plan = [], None
        for turn in range(most_edges + 1):
            self.prune()
            plan = self.run(goal, nb_iteration, seed=seed + turn, **run_options)
            if self.in_goal_region(self.root) or turn == most_edges:
                break
            if plan.status.name == 'CANCELLED':
                break
            edge = self.select_best_edge(rule)
            edge.path  # read before the tree changes
            shifted = None if on_edge is None else on_edge(edge)
            goal = goal if shifted is None else shifted
            self.advance(edge)
            edges.append(edge)
        return Drive(tuple(edges), plan, self.in_goal_region(self.root))

    def _number(self, node: tuple[float, ...]) -> int:
        """Return the number of the node at a position."""
        try:
            return self._as_graph().numbers[tuple(node)]
        except KeyError:
            raise InvalidInput(f'{node} is no node of the tree') from None

    def _best_child(self, rule: EdgeRule) -> int:
        """Return the root's child that the rule prefers; of equal ones the oldest."""
        self._as_graph()
        offered = children(self._tree, 0)
        if not offered:
            raise NoPath(f'no edge leaves the root {self.root}')
        if rule is EdgeRule.DESCENDANTS:
            below = descendants(self._tree)
            return max(offered, key=lambda child: below[child])
        inside = [number for number, position in enumerate(self.nodes) if number and self.in_goal_region(position)]
        if inside:
            target = min(inside, key=lambda node: self._tree.costs[node])
        else:
            goal = self._setting.pose(self.goal, 'goal')
            away = np.hypot(*(self._tree.poses[1:self._tree.count, :2] - goal[:2]).T)
            target = int(np.argmin(away)) + 1
        return lineage(self._tree, target)[1]
