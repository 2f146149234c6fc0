"""A tree of poses in arrays: what the kernels grow, and the operations on it that need none."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Cells of the table by which nodes are found, at most.
_MOST_CELLS = 256 * 256
_FIRST_CAPACITY = 1024


class Tree(NamedTuple):
    """Nodes by number, the root is 0. A node's cost is the length [m] of the way from the root."""

    #: (n, 3) x, y, heading [m, m, rad].
    poses: NDArray[np.float64]
    #: (n,) the root's is -1.
    parents: NDArray[np.int64]
    #: (n,) [m].
    costs: NDArray[np.float64]
    #: (n,) word of the way from the parent.
    words: NDArray[np.int64]
    #: (n, 5) lengths of the way's parts [m], negative ones driven backwards.
    lengths: NDArray[np.float64]
    #: (n,) first child, next and previous sibling, -1 for none.
    child: NDArray[np.int64]
    after: NDArray[np.int64]
    before: NDArray[np.int64]
    #: First node of each cell, and the next one in a node's cell.
    heads: NDArray[np.int64]
    below: NDArray[np.int64]
    #: Number of nodes, cells along a side; first and last column and row of cells with nodes.
    sizes: NDArray[np.int64]
    #: x_min, y_min, x_max, y_max of the cells [m].
    box: NDArray[np.float64]

    @property
    def count(self) -> int:
        """The number of nodes."""
        return int(self.sizes[0])


def planted(root: ArrayLike, box: ArrayLike, capacity: int = _FIRST_CAPACITY) -> Tree:
    """Return a tree of one node, with room for more."""
    tree = Tree(np.zeros((capacity, 3)), np.full(capacity, -1), np.zeros(capacity), np.zeros(capacity, np.int64),
                np.zeros((capacity, 5)), np.full(capacity, -1), np.full(capacity, -1), np.full(capacity, -1),
                np.empty(_cells(capacity), np.int64), np.full(capacity, -1), np.array([1, 1, 0, 0, 0, 0]),
                np.array(box, float))
    tree.poses[0] = root
    tree.heads[0] = 0
    return tree


def with_room(tree: Tree, more: int) -> Tree:
    """Return the tree with room for ``more`` further nodes: itself if it has it."""
    capacity = len(tree.poses)
    if capacity - tree.count >= more:
        return tree
    grown = planted(tree.poses[0], tree.box, max(2 * capacity, tree.count + more))
    for name in ('poses', 'parents', 'costs', 'words', 'lengths', 'child', 'after', 'before', 'below'):
        getattr(grown, name)[:tree.count] = getattr(tree, name)[:tree.count]
    grown.heads[:len(tree.heads)] = tree.heads
    return grown._replace(sizes=tree.sizes)


def _cells(capacity: int) -> int:
    """Return how many cells the table of so many nodes may have: a power of four."""
    from mobile_planning.sampling.tree_kernels import CROWD

    cells = 16
    while cells < _MOST_CELLS and cells * CROWD < capacity:
        cells *= 4
    return cells


def descendants(tree: Tree) -> NDArray[np.int64]:
    """Return how many nodes (n,) lie below each node.

    A child costs no less than its parent and stands after it in the order of the walk from the root.
    """
    below = np.zeros(tree.count, np.int64)
    for node in reversed(walk(tree, 0)[1:]):
        below[tree.parents[node]] += below[node] + 1
    return below


def children(tree: Tree, node: int) -> list[int]:
    """Return a node's children, the oldest first."""
    found, child = [], int(tree.child[node])
    while child >= 0:
        found.append(child)
        child = int(tree.after[child])
    return found[::-1]


def walk(tree: Tree, top: int) -> list[int]:
    """Return ``top`` and all nodes below it, each after its parent."""
    found = [top]
    for node in found:
        found.extend(children(tree, node))
    return found


def lineage(tree: Tree, node: int) -> list[int]:
    """Return the nodes from the root to ``node``."""
    found = [node]
    while tree.parents[found[-1]] >= 0:
        found.append(int(tree.parents[found[-1]]))
    return found[::-1]


def kept(tree: Tree, nodes: list[int]) -> Tree:
    """Return a tree of the given nodes alone: the first is its root, each later one's parent is among those before.

    Costs are counted from the new root.
    """
    number = np.full(tree.count, -1)
    number[nodes] = np.arange(len(nodes))
    root = nodes[0]
    result = planted(tree.poses[root], tree.box, max(len(nodes) * 2, _FIRST_CAPACITY))
    for name in ('poses', 'words', 'lengths'):
        getattr(result, name)[:len(nodes)] = getattr(tree, name)[nodes]
    result.costs[:len(nodes)] = tree.costs[nodes] - tree.costs[root]
    result.words[0], result.lengths[0] = 0, 0.0
    result.parents[1:len(nodes)] = number[tree.parents[nodes[1:]]]
    for node in range(1, len(nodes)):
        parent = result.parents[node]
        first = result.child[parent]
        result.after[node] = first
        if first >= 0:
            result.before[first] = node
        result.child[parent] = node
    result.sizes[0] = len(nodes)
    from mobile_planning.sampling.tree_kernels import index_again

    index_again(result)
    return result
