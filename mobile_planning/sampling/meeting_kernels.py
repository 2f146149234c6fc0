"""Two trees that grow towards each other, from the start and from the goal.

Kuffner and LaValle (2000), RRT-Connect: an efficient approach to single-query path planning. Ways have a direction, so
the second tree is one of ways driven back: it grows like the first, from the goal turned round, and each of its ways
is the mirror in time of one that leads on to the goal. That holds for a disc, which is the same from behind, among
obstacles that stand still.
"""
import numpy as np
from numba import f8, i8, njit, types

from mobile_planning.sampling.random_kernels import STATE
from mobile_planning.sampling.rrt_kernels import (
    EXHAUSTED, FULL, REACHED, STOP, STOPPED, TASK, draw_sample, extend, go_for_goal, in_goal, wrapped)
from mobile_planning.sampling.steering_kernels import STRAIGHT, first_heading, way_is_free
from mobile_planning.sampling.tree_kernels import COUNT, IDS, ROWS, TREE, find_nearest, find_same, insert
from mobile_planning.world.collision_kernels import is_free
from mobile_planning.world.distance_kernels import SPACE

# The words driven back, LSL, RSR, RSL, LSR, RLR, LRL and the line: the order turns round, and left and right.
_BACK = np.array([1, 0, 2, 3, 5, 4, 6])
#: How many nodes of the other tree a new one is joined to, if the way is free.
JOINS = 3


@njit(types.Tuple((i8, f8, f8, f8))(i8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def driven_back(word, a, b, c):
    """Return word and lengths of a way that is driven back, turned round."""
    return (word, a, b, c) if word == STRAIGHT else (_BACK[word], c, b, a)


@njit(i8(SPACE, TREE, TREE, TASK, i8, IDS, ROWS), nogil=True, cache=True, _nrt=False)
def join(space, tree, other, task, node, ids, ways):
    """Return which of ``ids`` and ``ways`` leads from the other tree to a node of this one, -1 if none is free."""
    x, y, heading = tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2] + np.pi
    found = find_nearest(other, x, y, heading, task.radius, task.by_line, ids, ways, JOINS)
    for k in range(found):
        near, word = ids[k], int(ways[k, 2])
        at_x, at_y = other.poses[near, 0], other.poses[near, 1]
        first = first_heading(word, at_x, at_y, other.poses[near, 2], x, y)
        if way_is_free(space, at_x, at_y, first, word, ways[k, 3], ways[k, 4], ways[k, 5], task.radius, 0.0, 1.0):
            return k
    return -1


@njit(types.UniTuple(i8, 4)(SPACE, TREE, TREE, TASK, STATE, i8, IDS, ROWS, STOP), nogil=True, cache=True)
def grow_both(space, tree, other, task, random, iterations, ids, ways, stop):
    """Grow both trees in turns until they meet or the first reaches the goal zone.

    Return why it ended, the first tree's node, which of ``ids`` and ``ways`` joins it to the other tree (-1 in the
    goal zone), and the iterations made. The way is the one from the first tree on, its end the other tree's node.
    """
    sample = np.empty(3)
    for iteration in range(iterations):
        if stop[0]:
            return STOPPED, -1, -1, iteration
        if tree.sizes[COUNT] + 1 >= len(tree.poses) or other.sizes[COUNT] + 1 >= len(other.poses):
            return FULL, -1, -1, iteration
        draw_sample(task, tree.box, random, sample)
        if iteration % 2 == 1:
            if in_goal(task, sample[0], sample[1], sample[2]):
                sample[0], sample[1], sample[2] = tree.poses[0, 0], tree.poses[0, 1], tree.poses[0, 2]
            sample[2] += np.pi
        if not is_free(space, sample[0], sample[1], sample[2], 0.0):
            continue
        if iteration % 2 == 1:
            node = extend(space, other, task, sample, ids, ways)
            if node >= 0:
                joined = join(space, other, tree, task, node, ids, ways)
                if joined >= 0:
                    # The same way, as seen from the first tree.
                    first, ids[joined] = ids[joined], node
                    return REACHED, first, joined, iteration + 1
            continue
        node = extend(space, tree, task, sample, ids, ways)
        if node < 0:
            continue
        if in_goal(task, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]):
            return REACHED, node, -1, iteration + 1
        at_goal = go_for_goal(space, tree, task, node)
        if at_goal >= 0:
            return REACHED, at_goal, -1, iteration + 1
        joined = join(space, tree, other, task, node, ids, ways)
        if joined >= 0:
            word, a, b, c = driven_back(int(ways[joined, 2]), ways[joined, 3], ways[joined, 4], ways[joined, 5])
            ways[joined, 2], ways[joined, 3], ways[joined, 4], ways[joined, 5] = word, a, b, c
            return REACHED, node, joined, iteration + 1
    return EXHAUSTED, -1, -1, iterations


@njit(i8(TREE, TREE, TASK, i8, i8, IDS, ROWS), nogil=True, cache=True, _nrt=False)
def take_branch(tree, other, task, node, joined, ids, ways):
    """Add to a tree the way that joins it to the other one, and the other's branch on to the goal; return the end."""
    there, word = ids[joined], int(ways[joined, 2])
    a, b, c = ways[joined, 3], ways[joined, 4], ways[joined, 5]
    while True:
        x, y, heading = other.poses[there, 0], other.poses[there, 1], wrapped(other.poses[there, 2] + np.pi)
        if other.parents[there] < 0:
            heading = wrapped(task.goal[2])
        same = find_same(tree, x, y, heading)
        if same >= 0:
            node = same
        else:
            node = insert(tree, x, y, heading, node, tree.costs[node] + (a + b + c), word, a, b, c)
        parent = other.parents[there]
        if parent < 0:
            return node
        word, a, b, c = driven_back(
            other.words[there], other.lengths[there, 0], other.lengths[there, 1], other.lengths[there, 2])
        there = parent
