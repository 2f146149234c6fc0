"""Growing a rapidly exploring random tree until it reaches the goal.

LaValle (1998), Rapidly-exploring random trees; with several nodes tried for a sample, the first free way is taken.
Each new node tries the whole way to the goal at once.
"""
from typing import NamedTuple

import numpy as np
from numba import b1, f8, i8, njit, types, u1, void
from numpy.typing import NDArray

from mobile_planning.sampling.random_kernels import STATE, uniform
from mobile_planning.sampling.steering import Car
from mobile_planning.sampling.steering_kernels import CAR, LENGTHS, LINE, cut, first_heading, steer, total, way_end
from mobile_planning.sampling.surroundings_kernels import SURROUNDINGS, pose_is_free, way_is_free
from mobile_planning.sampling.tree_kernels import (
    COUNT, IDS, ROWS, SAME, TREE, WAY_ROW, find_nearest, find_same, insert, parts_to, way_in)


class Task(NamedTuple):
    """What a tree grows for: a goal, and how to grow towards it."""

    #: (3,) x, y, heading [m, m, rad].
    goal: NDArray[np.float64]
    #: (3,) half widths of the goal zone [m, m, rad].
    precision: NDArray[np.float64]
    #: How it gets from pose to pose.
    car: Car
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


TASK = types.NamedTuple((f8[::1], f8[::1], CAR, f8, f8, f8, f8, i8, b1), Task)
STOP = u1[::1]
EXHAUSTED, REACHED, STOPPED, FULL = range(4)
# How often a sample is drawn beside the corner of a polygon, and how far away at most, in extents of the world.
_CORNERS, _BESIDE = 0.2, 0.03
# How often a straight way beyond a sample is tried, each time half as far.
_ONWARD = 2


@njit(f8(f8), nogil=True, cache=True, _nrt=False)
def wrapped(angle):
    """Return the angle in [-pi, pi]."""
    return angle - 2.0 * np.pi * np.floor((angle + np.pi) / (2.0 * np.pi))


@njit(b1(TASK, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def in_goal(task, x, y, heading):
    """Return whether a pose lies in the goal zone."""
    return (abs(x - task.goal[0]) <= task.precision[0] and abs(y - task.goal[1]) <= task.precision[1]
            and (task.car.turns_in_place or abs(wrapped(heading - task.goal[2])) <= task.precision[2]))


@njit(f8(TASK, f8, f8), nogil=True, cache=True, _nrt=False)
def to_go(task, x, y):
    """Return a lower bound of the length [m] from a point to the goal zone."""
    dx = max(abs(x - task.goal[0]) - task.precision[0], 0.0)
    dy = max(abs(y - task.goal[1]) - task.precision[1], 0.0)
    return np.sqrt(dx * dx + dy * dy)


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


@njit(void(SURROUNDINGS, TASK, f8[::1], STATE, f8[::1]), nogil=True, cache=True, _nrt=False, forceinline=True)
def draw_about_corners(world, task, box, random, sample):
    """Write a pose to grow towards: as `draw_sample` does, or one beside the corner of a polygon.

    Shortest paths bend at corners, and narrow ways in lead along them.
    """
    draw_sample(task, box, random, sample)
    edges = world.space.edges
    if len(edges) == 0 or world.rooms.size == 0 or uniform(random) > _CORNERS or in_goal(
            task, sample[0], sample[1], sample[2]):
        return
    edge = int(len(edges) * uniform(random))
    extent = max(box[2] - box[0], box[3] - box[1])
    away = world.space.reach[0] + _BESIDE * extent * 10.0 ** (-2.0 * uniform(random))
    angle = 2.0 * np.pi * uniform(random)
    sample[0], sample[1] = edges[edge, 0] + away * np.cos(angle), edges[edge, 1] + away * np.sin(angle)


@njit(b1(SURROUNDINGS, TREE, TASK, i8, f8, f8, f8, i8, LENGTHS), nogil=True, cache=True, _nrt=False, forceinline=True)
def leads_on(world, tree, task, node, x, y, heading, word, parts):
    """Return whether a way from a node to a pose is free, when the robot is there; its heading only names lines."""
    at_x, at_y = tree.poses[node, 0], tree.poses[node, 1]
    heading = first_heading(word, at_x, at_y, tree.poses[node, 2], x, y)
    return way_is_free(world, task.car, at_x, at_y, heading, word, parts, task.begin + tree.costs[node] / task.speed,
                       task.speed)


@njit(b1(SURROUNDINGS, TREE, TASK, i8), nogil=True, cache=True, _nrt=False)
def edge_is_free(world, tree, task, node):
    """Return whether the way from a node's parent to it is free, at the time when it is driven."""
    return leads_on(world, tree, task, tree.parents[node], tree.poses[node, 0], tree.poses[node, 1],
                    tree.poses[node, 2], tree.words[node], parts_to(tree, node))


@njit(f8(SURROUNDINGS, TREE, TASK, i8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def room_beyond(world, tree, task, node, x, y, length):
    """Return how many times as far as to (x, y), which is ``length`` [m] away, one can go straight on from a node."""
    share = task.extension / length
    for _ in range(_ONWARD):
        far_x = tree.poses[node, 0] + share * (x - tree.poses[node, 0])
        far_y = tree.poses[node, 1] + share * (y - tree.poses[node, 1])
        if share > 1.0 and leads_on(
                world, tree, task, node, far_x, far_y, 0.0, LINE, (share * length, 0.0, 0.0, 0.0, 0.0)):
            return share
        share = 0.5 * (share + 1.0)
    return 1.0


@njit(i8(SURROUNDINGS, TREE, TASK, f8[::1], IDS, ROWS, f8), nogil=True, cache=True, _nrt=False)
def extend(world, tree, task, sample, ids, ways, bound):
    """Grow the tree towards a sample and return the new node, -1 if no way is free or the pose is in the tree.

    A node that cannot be part of a path shorter than ``bound`` [m] is not added. Without a bound a line goes on beyond
    the sample, so that trees soon get far along a corridor.
    """
    found = find_nearest(tree, sample[0], sample[1], sample[2], task.car, task.by_line, ids, ways, task.nb_options)
    for k in range(found):
        node, (word, parts) = ids[k], way_in(ways, k)
        if ways[k, 1] <= SAME:
            return -1
        x, y, heading = sample[0], sample[1], sample[2]
        if ways[k, 1] > task.extension:
            parts = cut(parts, task.extension)
            first = first_heading(word, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2], x, y)
            x, y, heading = way_end(task.car, tree.poses[node, 0], tree.poses[node, 1], first, word, parts)
        cost = tree.costs[node] + total(parts)
        if cost + to_go(task, x, y) >= bound or not leads_on(world, tree, task, node, x, y, heading, word, parts):
            continue
        if word == LINE and bound == np.inf and not in_goal(task, x, y, heading):
            share = room_beyond(world, tree, task, node, x, y, total(parts))
            x = tree.poses[node, 0] + share * (x - tree.poses[node, 0])
            y = tree.poses[node, 1] + share * (y - tree.poses[node, 1])
            parts = (share * parts[0], 0.0, 0.0, 0.0, 0.0)
            cost = tree.costs[node] + parts[0]
        if find_same(tree, x, y, wrapped(heading)) < 0:
            return insert(tree, x, y, wrapped(heading), node, cost, word, parts)
    return -1


@njit(i8(SURROUNDINGS, TREE, TASK, i8), nogil=True, cache=True, _nrt=False)
def go_for_goal(world, tree, task, node):
    """Join the goal itself to a node if the whole way there is free; return the node there, -1 if it is not."""
    x, y, heading = task.goal[0], task.goal[1], task.goal[2]
    _, word, parts = steer(task.car, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2], x, y, heading)
    if not leads_on(world, tree, task, node, x, y, heading, word, parts):
        return -1
    return insert(tree, x, y, wrapped(heading), node, tree.costs[node] + total(parts), word, parts)


@njit(types.UniTuple(i8, 3)(SURROUNDINGS, TREE, TASK, STATE, i8, STOP), nogil=True, cache=True)
def grow(world, tree, task, random, iterations, stop):
    """Grow the tree until a node lies in the goal zone; return why it ended, that node or -1, and the iterations made.

    It ends too when the tree's arrays are full; call again with larger ones.
    """
    sample = np.empty(3)
    ids, ways = np.empty(task.nb_options, np.int64), np.empty((task.nb_options, WAY_ROW))
    is_static = world.space.reach[3] == 0.0
    if tree.sizes[COUNT] == 1 and task.goal_rate > 0.0 and iterations > 0:
        node = go_for_goal(world, tree, task, 0)
        if node >= 0:
            return REACHED, node, 1
    for iteration in range(iterations):
        if stop[0]:
            return STOPPED, -1, iteration
        if tree.sizes[COUNT] + 1 >= len(tree.poses):
            return FULL, -1, iteration
        draw_about_corners(world, task, tree.box, random, sample)
        if is_static and not pose_is_free(world, sample[0], sample[1], sample[2], 0.0):
            continue
        node = extend(world, tree, task, sample, ids, ways, np.inf)
        if node >= 0 and in_goal(task, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]):
            return REACHED, node, iteration + 1
        if node >= 0 and task.goal_rate > 0.0:
            node = go_for_goal(world, tree, task, node)
            if node >= 0:
                return REACHED, node, iteration + 1
    return EXHAUSTED, -1, iterations
