"""A tree as nodes and edges to look at, named by their poses."""
from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mobile_planning.sampling.curve import TURN_OF, Curve
from mobile_planning.sampling.dubins import DubinsPath
from mobile_planning.sampling.plan_result import SPACING
from mobile_planning.sampling.reeds_shepp import ReedsSheppPath
from mobile_planning.sampling.steering import Car
from mobile_planning.sampling.tree import Tree, children

Pose = tuple[float, ...]
_LETTERS = {turn: letter for letter, turn in TURN_OF.items()}


class Node:
    """Node of the rapidly exploring random tree.

    Parameters
    ----------
    position : tuple
        The position of the node: x, y and, for a car, psi [m, m, rad].
    time : float [s]
        The instant at which this node is reached.
    cost : float [m]
        The cost needed to reach this node.

    Attributes
    ----------
    destination_list : list of tuple
        The positions of the nodes reachable from this one.
    """

    def __init__(self, position: Pose, time: float, cost: float):
        self.destination_list = []
        self.position = position
        self.time = time
        self.cost = cost

    def __repr__(self) -> str:
        return f'Node({self.position}, {self.time:g}, {self.cost:g})'


class Edge:
    """Edge of the rapidly exploring random tree.

    Parameters
    ----------
    node_from, node_to : tuple
        Ids of the starting and of the end node: their positions.
    path : sequence of tuple, or callable that returns one
        The successive positions yielded by the local planner; a callable is asked when the path is first read.
    cost : float [m]
        Cost of the transition between the two nodes.
    """

    def __init__(self, node_from: Pose, node_to: Pose, path: Sequence[Pose] | Callable[[], Sequence[Pose]],
                 cost: float):
        self.node_from = node_from
        self.node_to = node_to
        self.cost = cost
        self._path = path

    def __repr__(self) -> str:
        return f'Edge({self.node_from}, {self.node_to}, cost={self.cost:g})'

    @property
    def path(self) -> list[Pose]:
        """The successive positions along the edge, at most 0.05 m apart."""
        if callable(self._path):
            self._path = list(self._path())
        return self._path


class Graph:
    """The nodes and edges of a tree, as they are now.

    Parameters
    ----------
    tree : Tree
    car : Car
        A position of one that goes in straight lines has no heading.
    begin, speed : float [s], [m/s]
        When the root is left, and how fast.

    Attributes
    ----------
    nodes : dict of tuple to Node
    edges : dict of (tuple, tuple) to Edge
        By the positions of both ends.
    numbers : dict of tuple to int
        The number of each node in the tree.
    """

    def __init__(self, tree: Tree, car: Car, begin: float, speed: float):
        size = 2 if car.turns_in_place else 3
        positions = [tuple(pose) for pose in tree.poses[:tree.count, :size].tolist()]
        costs = tree.costs[:tree.count].tolist()
        self.numbers = {position: node for node, position in enumerate(positions)}
        self.nodes = {position: Node(position, begin + cost / speed, cost) for position, cost in zip(positions, costs)}
        self.edges = {}
        for parent, position in enumerate(positions):
            for child in children(tree, parent):
                self.nodes[position].destination_list.append(positions[child])
                curve = curve_to(tree, child, car)
                self.edges[position, positions[child]] = Edge(
                    position, positions[child], lambda curve=curve: list(map(tuple, sampled(curve, size).tolist())),
                    float(np.abs(tree.lengths[child]).sum()))


def curve_to(tree: Tree, node: int, car: Car) -> Curve:
    """Return the curve from a node's parent to it."""
    parent = tree.parents[node]
    x, y, heading = tree.poses[parent].tolist()
    lengths = tree.lengths[node]
    if car.turns_in_place:
        dx, dy = (tree.poses[node, :2] - tree.poses[parent, :2]).tolist()
        return Curve((x, y, float(np.arctan2(dy, dx))), 'S', (float(lengths[0]),), car.radius)
    turns = (int(tree.words[node]) >> 2 * np.arange(len(lengths)) & 3) - 1
    if not car.reverses:
        return DubinsPath((x, y, heading), word_of(turns[:3]), tuple(lengths[:3].tolist()), car.radius)
    driven = lengths != 0
    return ReedsSheppPath((x, y, heading), word_of(turns[driven]), tuple(lengths[driven].tolist()), car.radius)


def sampled(curve: Curve, size: int) -> NDArray[np.float64]:
    """Return poses (n, size) along a curve."""
    return curve.sample(SPACING)[:, :size]


def word_of(turns: NDArray[np.int64]) -> str:
    """Return the letters of turns.

    Examples
    --------
    >>> word_of(np.array([1, 0, -1]))
    'LSR'
    """
    return ''.join(_LETTERS[turn] for turn in turns.tolist())
