"""Growing a tree on after the goal is reached, so that its paths become shorter.

RRT*: Karaman and Frazzoli (2011), Sampling-based algorithms for optimal motion planning. Ways have a direction, so the
two questions are asked each its own way round: from which node is the new one reached at the least cost, and which
nodes are reached at a lower cost from the new one. Samples are drawn where a path shorter than the best may pass:
Gammell, Srinivasa and Barfoot (2014), Informed RRT*.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, void

from mobile_planning.sampling.random_kernels import STATE, uniform
from mobile_planning.sampling.rrt_kernels import (
    EXHAUSTED, FULL, STOP, STOPPED, TASK, draw_sample, extend, in_goal, leads_on)
from mobile_planning.sampling.steering_kernels import first_heading, steer, total
from mobile_planning.sampling.surroundings_kernels import SURROUNDINGS, pose_is_free, way_is_free
from mobile_planning.sampling.tree_kernels import (
    COUNT, IDS, SAME, SIDE, TREE, WAY_ROW, adopt, cell_of, following, leave, parts_to, set_parts)

# Where obstacles move, a node with more nodes below it is not rerouted: each of their ways would be checked again.
MOST_BELOW = 64


@njit(void(TREE, TASK, STATE, f8, f8[::1]), nogil=True, cache=True, _nrt=False)
def draw_informed(tree, task, random, bound, sample):
    """Write a pose through which a path shorter than the bound may pass: in the ellipse about root and goal zone."""
    draw_sample(task, tree.box, random, sample)
    root_x, root_y = tree.poses[0, 0], tree.poses[0, 1]
    wide = bound + np.sqrt(task.precision[0] ** 2 + task.precision[1] ** 2)
    dx, dy = task.goal[0] - root_x, task.goal[1] - root_y
    between = np.sqrt(dx * dx + dy * dy)
    if not wide < np.inf or in_goal(task, sample[0], sample[1], sample[2]) or between == 0.0:
        return
    narrow = np.sqrt(max(wide * wide - between * between, 0.0))
    cos, sin = dx / between, dy / between
    for _ in range(64):
        radius, angle = np.sqrt(uniform(random)), 2.0 * np.pi * uniform(random)
        u, v = 0.5 * wide * radius * np.cos(angle), 0.5 * narrow * radius * np.sin(angle)
        x, y = root_x + 0.5 * dx + cos * u - sin * v, root_y + 0.5 * dy + sin * u + cos * v
        if tree.box[0] <= x <= tree.box[2] and tree.box[1] <= y <= tree.box[3]:
            sample[0], sample[1] = x, y
            return


@njit(i8(TREE, f8, f8, f8, IDS), nogil=True, cache=True, _nrt=False)
def list_near(tree, x, y, radius, near):
    """Write the nodes within a distance of a point into ``near``, as many as it takes; return how many."""
    found = 0
    side = tree.sizes[SIDE]
    low, high = cell_of(tree, x - radius, y - radius), cell_of(tree, x + radius, y + radius)
    for row in range(low // side, high // side + 1):
        for column in range(low % side, high % side + 1):
            node = tree.heads[row * side + column]
            while node >= 0 and found < len(near):
                if (tree.poses[node, 0] - x) ** 2 + (tree.poses[node, 1] - y) ** 2 <= radius * radius:
                    near[found] = node
                    found += 1
                node = tree.below[node]
    return found


@njit(b1(SURROUNDINGS, TREE, TASK, i8, f8), nogil=True, cache=True, _nrt=False)
def free_when_earlier(world, tree, task, top, gain):
    """Return whether all ways below a node, not too many, stay free when they are driven earlier by so many metres."""
    node, seen = following(tree, top, top), 0
    while node >= 0:
        seen += 1
        if seen > MOST_BELOW:
            return False
        parent = tree.parents[node]
        x, y = tree.poses[parent, 0], tree.poses[parent, 1]
        heading = first_heading(
            tree.words[node], x, y, tree.poses[parent, 2], tree.poses[node, 0], tree.poses[node, 1])
        if not way_is_free(world, task.car, x, y, heading, tree.words[node], parts_to(tree, node),
                           task.begin + (tree.costs[parent] - gain) / task.speed, task.speed):
            return False
        node = following(tree, node, top)
    return True


@njit(b1(SURROUNDINGS, TREE, TASK, i8, i8), nogil=True, cache=True, _nrt=False)
def join_if_shorter(world, tree, task, parent, node):
    """Make ``parent`` the parent of ``node`` if that lowers its cost and the way is free; return whether it did."""
    x, y, heading = tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]
    line = np.sqrt((x - tree.poses[parent, 0]) ** 2 + (y - tree.poses[parent, 1]) ** 2)
    if tree.costs[parent] + line >= tree.costs[node] - SAME:
        return False
    length, word, parts = steer(
        task.car, tree.poses[parent, 0], tree.poses[parent, 1], tree.poses[parent, 2], x, y, heading)
    gain = tree.costs[node] - tree.costs[parent] - length
    # A child no dearer than its parent would make a circle.
    if gain <= SAME or length <= SAME or length > task.extension:
        return False
    if not leads_on(world, tree, task, parent, x, y, heading, word, parts):
        return False
    if world.space.reach[3] > 0.0 and not free_when_earlier(world, tree, task, node, gain):
        return False
    leave(tree, node)
    adopt(tree, parent, node)
    tree.words[node] = word
    set_parts(tree, node, parts)
    tree.costs[node] = tree.costs[parent] + total(parts)
    below = following(tree, node, node)
    while below >= 0:
        # From the parent each time, so that the sum holds to the last bit.
        tree.costs[below] = tree.costs[tree.parents[below]] + total(parts_to(tree, below))
        below = following(tree, below, node)
    return True


@njit(types.UniTuple(i8, 2)(SURROUNDINGS, TREE, TASK, STATE, IDS, f8, f8, i8, STOP), nogil=True, cache=True)
def grow_star(world, tree, task, random, goals, bound, density, iterations, stop):
    """Grow and reroute the tree; return why it ended, and the iterations made.

    ``goals`` lists the nodes in the goal zone: their number, then each. Nodes that cannot be part of a path shorter
    than ``bound`` [m] are not added. A new node gets the best parent near by, and others are rerouted through it.
    """
    sample, near = np.empty(3), np.empty(512, np.int64)
    ids, ways = np.empty(task.nb_options, np.int64), np.empty((task.nb_options, WAY_ROW))
    is_static = world.space.reach[3] == 0.0
    extent = np.sqrt((tree.box[2] - tree.box[0]) * (tree.box[3] - tree.box[1]))
    for iteration in range(iterations):
        if stop[0]:
            return STOPPED, iteration
        if tree.sizes[COUNT] == len(tree.poses) or goals[0] + 1 == len(goals):
            return FULL, iteration
        draw_informed(tree, task, random, bound, sample)
        if is_static and not pose_is_free(world, sample[0], sample[1], sample[2], 0.0):
            continue
        count = tree.sizes[COUNT] + 1.0
        reach = min(task.extension, density * extent * np.sqrt(np.log(count) / count))
        node = extend(world, tree, task, sample, ids, ways, bound)
        if node < 0:
            continue
        count = list_near(tree, tree.poses[node, 0], tree.poses[node, 1], reach, near)
        for j in range(count):
            if near[j] != node:
                join_if_shorter(world, tree, task, near[j], node)
        for j in range(count):
            if near[j] != node and near[j] != 0:
                join_if_shorter(world, tree, task, node, near[j])
        if in_goal(task, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]):
            goals[0] += 1
            goals[goals[0]] = node
            bound = min(bound, tree.costs[node])
    return EXHAUSTED, iterations
