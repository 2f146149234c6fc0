"""From tree to track and back."""
import numpy as np
from numba import f8, i8, njit

from mobile_planning.sampling.rrt_kernels import TASK, leads_on, wrapped
from mobile_planning.sampling.rrt_star_kernels import join_if_shorter
from mobile_planning.sampling.steering_kernels import CAR, first_heading, steer, total
from mobile_planning.sampling.surroundings_kernels import SURROUNDINGS, way_is_free
from mobile_planning.sampling.track_kernels import TRACK, append_way, pose_on
from mobile_planning.sampling.tree_kernels import COUNT, IDS, SAME, TREE, find_same, insert, parts_to
from mobile_planning.world.collision_kernels import POSES

# A stretch this short [m] is not divided again.
_SHORTEST = 1e-4


@njit(i8(TREE, IDS, CAR, TRACK), nogil=True, cache=True, _nrt=False)
def write_track(tree, nodes, car, track):
    """Write the ways between the given nodes, each the parent of the next, as one track; return its segments."""
    track.sizes[0] = 0
    for k in range(1, len(nodes)):
        parent, node = nodes[k - 1], nodes[k]
        x, y = tree.poses[parent, 0], tree.poses[parent, 1]
        heading = first_heading(
            tree.words[node], x, y, tree.poses[parent, 2], tree.poses[node, 0], tree.poses[node, 1])
        append_way(track, x, y, heading, tree.words[node], parts_to(tree, node), car)
    return track.sizes[0]


@njit(i8(SURROUNDINGS, TREE, TASK, i8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def grafted(world, tree, task, node, x, y, heading, stretch):
    """Return the node at a pose that a way from ``node`` no longer than ``stretch`` [m] leads to, if that is free.

    -1 if it is not, -2 if a node is there that cannot be reached at that cost.
    """
    length, word, parts = steer(
        task.car, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2], x, y, heading)
    if length > stretch + SAME or not leads_on(world, tree, task, node, x, y, heading, word, parts):
        return -1
    there = find_same(tree, x, y, wrapped(heading))
    if there < 0:
        return insert(tree, x, y, wrapped(heading), node, tree.costs[node] + total(parts), word, parts)
    if (tree.costs[there] > tree.costs[node] + length + SAME
            and not join_if_shorter(world, tree, task, node, there)):
        return -2
    return there


@njit(i8(SURROUNDINGS, TREE, TASK, TRACK, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def graft(world, tree, task, track, end_x, end_y, end_heading):
    """Add a track from the root as a branch of the tree; return its last node, -1 if the tree has no room for it.

    The track goes in as shortest ways between poses along it, each stretch as long as may be. The end is given, for
    the track has it but for rounding.
    """
    node, place, length = 0, 0.0, track.places[track.sizes[0]]
    while place < length:
        stretch, after = min(task.extension, length - place), -1
        while after == -1:
            if tree.sizes[COUNT] == len(tree.poses) or stretch < _SHORTEST:
                return -1
            x, y, heading = pose_on(track, place + stretch, task.car)
            if place + stretch >= length - SAME:
                x, y, heading = end_x, end_y, end_heading
            after = grafted(world, tree, task, node, x, y, heading, stretch)
            if after == -1:
                stretch *= 0.5
        if after < 0:
            return -1
        node, place = after, place + stretch
        if place >= length - SAME:
            break
    return node


@njit(i8(SURROUNDINGS, POSES, CAR, f8, f8, TRACK), nogil=True, cache=True, _nrt=False)
def join_poses(world, poses, car, t, speed, track):
    """Write the track from pose to pose (n, 3), begun at time t [s]; return -1, or the pose from which it cannot go on.

    It cannot if the way to the next pose is much longer than the line, or not free; the track then ends there.
    """
    track.sizes[0] = 0
    for k in range(len(poses) - 1):
        x, y, heading, to_x, to_y = poses[k, 0], poses[k, 1], poses[k, 2], poses[k + 1, 0], poses[k + 1, 1]
        length, word, parts = steer(car, x, y, heading, to_x, to_y, poses[k + 1, 2])
        # Half a circle is 1.571 times as long as the line between its ends; a car that reverses may turn between two.
        if not car.reverses and length > 1.6 * np.sqrt((to_x - x) ** 2 + (to_y - y) ** 2) + 1e-6:
            return k
        heading = first_heading(word, x, y, heading, to_x, to_y)
        t_here = t + track.places[track.sizes[0]] / speed
        if not way_is_free(world, car, x, y, heading, word, parts, t_here, speed):
            return k
        append_way(track, x, y, heading, word, parts, car)
    return -1
