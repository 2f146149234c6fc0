"""Growing a rapidly exploring random tree until it reaches the goal.

LaValle (1998), Rapidly-exploring random trees; with several nodes tried for a sample, the first free way is taken.
Each new node tries the whole way to the goal at once.
"""
from typing import NamedTuple

import numpy as np
from numba import b1, f8, i8, njit, types, u1, void
from numpy.typing import NDArray

from mobile_planning.sampling.random_kernels import STATE, uniform
from mobile_planning.sampling.steering_kernels import cut, first_heading, steer, way_end, way_is_free
from mobile_planning.sampling.tree_kernels import COUNT, IDS, ROWS, SAME, TREE, find_nearest, find_same, insert
from mobile_planning.world.collision_kernels import is_free
from mobile_planning.world.distance_kernels import SPACE


class Task(NamedTuple):
    """What a tree grows for: a goal, and how to grow towards it."""

    #: (3,) x, y, heading [m, m, rad].
    goal: NDArray[np.float64]
    #: (3,) half widths of the goal zone [m, m, rad].
    precision: NDArray[np.float64]
    #: Turning radius [m]; 0 goes straight.
    radius: float
    #: Length of a way, at most [m].
    extension: float
    #: Speed [m/s], and the time [s] at the root.
    speed: float
    begin: float
    #: How often a sample is drawn in the goal zone.
    goal_rate: float
    #: How many nodes are tried for a sample.
    nb_options: int
    #: Whether nodes are near by the straight line rather than by the way.
    by_line: bool


TASK = types.NamedTuple((f8[::1], f8[::1], f8, f8, f8, f8, f8, i8, b1), Task)
STOP = u1[::1]
EXHAUSTED, REACHED, STOPPED, FULL = range(4)


@njit(f8(f8), nogil=True, cache=True, _nrt=False)
def wrapped(angle):
    """Return the angle in [-pi, pi]."""
    return angle - 2.0 * np.pi * np.floor((angle + np.pi) / (2.0 * np.pi))


@njit(b1(TASK, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def in_goal(task, x, y, heading):
    """Return whether a pose lies in the goal zone."""
    return (abs(x - task.goal[0]) <= task.precision[0] and abs(y - task.goal[1]) <= task.precision[1]
            and (task.radius == 0.0 or abs(wrapped(heading - task.goal[2])) <= task.precision[2]))


@njit(void(TASK, f8[::1], STATE, f8[::1]), nogil=True, cache=True, _nrt=False)
def draw_sample(task, box, random, sample):
    """Write a pose to grow towards: now and then the goal, every second time a pose of its zone; else any."""
    if uniform(random) < task.goal_rate:
        spread = 0.0 if uniform(random) < 0.5 else 2.0
        for axis in range(3):
            sample[axis] = task.goal[axis] + spread * (uniform(random) - 0.5) * task.precision[axis]
        return
    sample[0] = box[0] + (box[2] - box[0]) * uniform(random)
    sample[1] = box[1] + (box[3] - box[1]) * uniform(random)
    sample[2] = np.pi * (2.0 * uniform(random) - 1.0)


@njit(i8(SPACE, TREE, TASK, f8[::1], IDS, ROWS), nogil=True, cache=True, _nrt=False)
def extend(space, tree, task, sample, ids, ways):
    """Grow the tree towards a sample and return the new node, -1 if no way is free or the pose is in the tree."""
    found = find_nearest(tree, sample[0], sample[1], sample[2], task.radius, task.by_line, ids, ways, task.nb_options)
    for k in range(found):
        length, word = ways[k, 1], int(ways[k, 2])
        a, b, c = ways[k, 3], ways[k, 4], ways[k, 5]
        if length <= SAME:
            return -1
        node = ids[k]
        x, y, heading = tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]
        heading = first_heading(word, x, y, heading, sample[0], sample[1])
        if length > task.extension:
            length = task.extension
            a, b, c = cut(a, b, c, length)
        t = task.begin + tree.costs[node] / task.speed
        if not way_is_free(space, x, y, heading, word, a, b, c, task.radius, t, task.speed):
            continue
        if ways[k, 1] > task.extension:
            x, y, heading = way_end(x, y, heading, word, a, b, c, task.radius)
        else:
            x, y, heading = sample[0], sample[1], sample[2]
        if find_same(tree, x, y, wrapped(heading)) >= 0:
            continue
        return insert(tree, x, y, wrapped(heading), node, tree.costs[node] + length, word, a, b, c)
    return -1


@njit(i8(SPACE, TREE, TASK, i8), nogil=True, cache=True, _nrt=False)
def go_for_goal(space, tree, task, node):
    """Join the goal itself to a node if the whole way there is free; return the node there, -1 if it is not."""
    x, y, heading = tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]
    length, word, a, b, c = steer(x, y, heading, task.goal[0], task.goal[1], task.goal[2], task.radius)
    heading = first_heading(word, x, y, heading, task.goal[0], task.goal[1])
    t = task.begin + tree.costs[node] / task.speed
    if not way_is_free(space, x, y, heading, word, a, b, c, task.radius, t, task.speed):
        return -1
    return insert(tree, task.goal[0], task.goal[1], wrapped(task.goal[2]), node, tree.costs[node] + (a + b + c), word,
                  a, b, c)


@njit(types.UniTuple(i8, 3)(SPACE, TREE, TASK, STATE, i8, STOP), nogil=True, cache=True)
def grow(space, tree, task, random, iterations, stop):
    """Grow the tree until a node lies in the goal zone; return why it ended, that node or -1, and the iterations made.

    It ends too when the tree's arrays are full; call again with larger ones.
    """
    sample = np.empty(3)
    ids, ways = np.empty(task.nb_options, np.int64), np.empty((task.nb_options, 6))
    is_static = space.reach[3] == 0.0
    for iteration in range(iterations):
        if stop[0]:
            return STOPPED, -1, iteration
        if tree.sizes[COUNT] + 1 >= len(tree.poses):
            return FULL, -1, iteration
        draw_sample(task, tree.box, random, sample)
        if is_static and not is_free(space, sample[0], sample[1], sample[2], 0.0):
            continue
        node = extend(space, tree, task, sample, ids, ways)
        if node >= 0 and in_goal(task, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]):
            return REACHED, node, iteration + 1
        if node >= 0 and task.goal_rate > 0.0:
            node = go_for_goal(space, tree, task, node)
            if node >= 0:
                return REACHED, node, iteration + 1
    return EXHAUSTED, -1, iterations
