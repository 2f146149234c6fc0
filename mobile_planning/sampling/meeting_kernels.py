"""Two trees that grow towards each other, from the start and from the goal.

Kuffner and LaValle (2000), RRT-Connect: an efficient approach to single-query path planning. Ways have a direction, so
the second tree is one of ways driven back: it grows like the first, from the goal turned round, and each of its ways
is the mirror in time of one that leads on to the goal. That holds for a disc, which is the same from behind, among
obstacles that stand still.
"""
import numpy as np
from numba import i8, njit, types, void

from mobile_planning.sampling.random_kernels import STATE
from mobile_planning.sampling.rrt_kernels import (
    EXHAUSTED, FULL, REACHED, STOP, STOPPED, TASK, draw_about_corners, extend, go_for_goal, in_goal, leads_on, wrapped)
from mobile_planning.sampling.steering_kernels import LENGTHS, PARTS, driven_back, total
from mobile_planning.sampling.surroundings_kernels import SURROUNDINGS, pose_is_free
from mobile_planning.sampling.tree_kernels import (
    COUNT, IDS, ROWS, TREE, find_nearest, find_same, insert, parts_to, way_in)

#: How many nodes of the other tree a new one is joined to, if the way is free.
JOINS = 3


@njit(i8(SURROUNDINGS, TREE, TREE, TASK, i8, IDS, ROWS), nogil=True, cache=True, _nrt=False)
def join(world, tree, other, task, node, ids, ways):
    """Return which of ``ids`` and ``ways`` leads from the other tree to a node of this one, -1 if none is free."""
    x, y, heading = tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2] + np.pi
    found = find_nearest(other, x, y, heading, task.car, task.by_line, ids, ways, JOINS)
    for k in range(found):
        word, parts = way_in(ways, k)
        if leads_on(world, other, task, ids[k], x, y, heading, word, parts):
            return k
    return -1


@njit(void(ROWS, i8, i8, LENGTHS), nogil=True, cache=True, _nrt=False)
def write_way(ways, k, word, parts):
    """Write word and parts of a way into a row of ``ways``."""
    ways[k, 2] = word
    for part in range(PARTS):
        ways[k, 3 + part] = parts[part]


@njit(types.UniTuple(i8, 4)(SURROUNDINGS, TREE, TREE, TASK, STATE, i8, IDS, ROWS, STOP), nogil=True, cache=True)
def grow_both(world, tree, other, task, random, iterations, ids, ways, stop):
    """Grow both trees in turns until they meet or the first reaches the goal zone.

    Return why it ended, the first tree's node, which of ``ids`` and ``ways`` joins it to the other tree (-1 in the
    goal zone), and the iterations made. The way is the one from the first tree on, its end the other tree's node.
    """
    sample = np.empty(3)
    if tree.sizes[COUNT] == 1 and iterations > 0:
        at_goal = go_for_goal(world, tree, task, 0)
        if at_goal >= 0:
            return REACHED, at_goal, -1, 1
    for iteration in range(iterations):
        if stop[0]:
            return STOPPED, -1, -1, iteration
        if tree.sizes[COUNT] + 1 >= len(tree.poses) or other.sizes[COUNT] + 1 >= len(other.poses):
            return FULL, -1, -1, iteration
        draw_about_corners(world, task, tree.box, random, sample)
        if iteration % 2 == 1:
            if in_goal(task, sample[0], sample[1], sample[2]):
                sample[0], sample[1], sample[2] = tree.poses[0, 0], tree.poses[0, 1], tree.poses[0, 2]
            sample[2] += np.pi
        if not pose_is_free(world, sample[0], sample[1], sample[2], 0.0):
            continue
        if iteration % 2 == 1:
            node = extend(world, other, task, sample, ids, ways, np.inf)
            if node >= 0:
                joined = join(world, other, tree, task, node, ids, ways)
                if joined >= 0:
                    # The same way, as seen from the first tree.
                    first, ids[joined] = ids[joined], node
                    return REACHED, first, joined, iteration + 1
            continue
        node = extend(world, tree, task, sample, ids, ways, np.inf)
        if node < 0:
            continue
        if in_goal(task, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]):
            return REACHED, node, -1, iteration + 1
        at_goal = go_for_goal(world, tree, task, node)
        if at_goal >= 0:
            return REACHED, at_goal, -1, iteration + 1
        joined = join(world, tree, other, task, node, ids, ways)
        if joined >= 0:
            word, parts = way_in(ways, joined)
            word, parts = driven_back(word, parts)
            write_way(ways, joined, word, parts)
            return REACHED, node, joined, iteration + 1
    return EXHAUSTED, -1, -1, iterations


@njit(i8(TREE, TREE, TASK, i8, i8, IDS, ROWS), nogil=True, cache=True, _nrt=False)
def take_branch(tree, other, task, node, joined, ids, ways):
    """Add to a tree the way that joins it to the other one, and the other's branch on to the goal; return the end."""
    there, (word, parts) = ids[joined], way_in(ways, joined)
    while True:
        x, y, heading = other.poses[there, 0], other.poses[there, 1], wrapped(other.poses[there, 2] + np.pi)
        if other.parents[there] < 0:
            heading = wrapped(task.goal[2])
        same = find_same(tree, x, y, heading)
        if same >= 0:
            node = same
        else:
            node = insert(tree, x, y, heading, node, tree.costs[node] + total(parts), word, parts)
        parent = other.parents[there]
        if parent < 0:
            return node
        word, parts = driven_back(other.words[there], parts_to(other, there))
        there = parent
