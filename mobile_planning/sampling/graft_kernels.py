"""From tree to track and back."""
import numpy as np
from numba import f8, i8, njit

from mobile_planning.sampling.rrt_kernels import TASK, wrapped
from mobile_planning.sampling.rrt_star_kernels import join_if_shorter
from mobile_planning.sampling.steering_kernels import first_heading, steer, way_is_free
from mobile_planning.sampling.track_kernels import TRACK, append_way, pose_on
from mobile_planning.sampling.tree_kernels import COUNT, IDS, SAME, TREE, find_same, insert
from mobile_planning.world.collision_kernels import POSES
from mobile_planning.world.distance_kernels import SPACE

# A stretch this short [m] is not divided again.
_SHORTEST = 1e-4


@njit(i8(TREE, IDS, f8, TRACK), nogil=True, cache=True, _nrt=False)
def write_track(tree, nodes, radius, track):
    """Write the ways between the given nodes, each the parent of the next, as one track; return its segments."""
    track.sizes[0] = 0
    for k in range(1, len(nodes)):
        parent, node = nodes[k - 1], nodes[k]
        x, y = tree.poses[parent, 0], tree.poses[parent, 1]
        heading = first_heading(
            tree.words[node], x, y, tree.poses[parent, 2], tree.poses[node, 0], tree.poses[node, 1])
        append_way(track, x, y, heading, tree.words[node], tree.lengths[node, 0], tree.lengths[node, 1],
                   tree.lengths[node, 2], radius)
    return track.sizes[0]


@njit(i8(SPACE, TREE, TASK, TRACK, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def graft(space, tree, task, track, end_x, end_y, end_heading):
    """Add a track from the root as a branch of the tree; return its last node, -1 if the tree has no room for it.

    The track goes in as shortest ways between poses along it, each stretch as long as may be. The end is given, for
    the track has it but for rounding.
    """
    node, place, total = 0, 0.0, track.places[track.sizes[0]]
    while place < total:
        stretch = min(task.extension, total - place)
        while True:
            if tree.sizes[COUNT] == len(tree.poses):
                return -1
            is_last = place + stretch >= total - SAME
            x, y, heading = pose_on(track, place + stretch, task.radius)
            if is_last:
                x, y, heading = end_x, end_y, end_heading
            at_x, at_y, at_heading = tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2]
            length, word, a, b, c = steer(at_x, at_y, at_heading, x, y, heading, task.radius)
            first = first_heading(word, at_x, at_y, at_heading, x, y)
            t = task.begin + tree.costs[node] / task.speed
            if length <= stretch + SAME and way_is_free(space, at_x, at_y, first, word, a, b, c, task.radius, t,
                                                        task.speed):
                there = find_same(tree, x, y, wrapped(heading))
                if there < 0:
                    node = insert(tree, x, y, wrapped(heading), node, tree.costs[node] + (a + b + c), word, a, b, c)
                    break
                if (tree.costs[there] > tree.costs[node] + length + SAME
                        and not join_if_shorter(space, tree, task, node, there)):
                    return -1
                node = there
                break
            stretch *= 0.5
            if stretch < _SHORTEST:
                return -1
        place += stretch
        if is_last:
            break
    return node


@njit(i8(SPACE, POSES, f8, f8, f8, TRACK), nogil=True, cache=True, _nrt=False)
def join_poses(space, poses, radius, t, speed, track):
    """Write the track from pose to pose (n, 3), begun at time t [s]; return -1, or the pose from which it cannot go on.

    It cannot if the way to the next pose is much longer than the line, or not free; the track then ends there.
    """
    track.sizes[0] = 0
    for k in range(len(poses) - 1):
        x, y, heading, to_x, to_y = poses[k, 0], poses[k, 1], poses[k, 2], poses[k + 1, 0], poses[k + 1, 1]
        length, word, a, b, c = steer(x, y, heading, to_x, to_y, poses[k + 1, 2], radius)
        # Half a circle is 1.571 times as long as the line between its ends.
        if length > 1.6 * np.sqrt((to_x - x) ** 2 + (to_y - y) ** 2) + 1e-6:
            return k
        heading = first_heading(word, x, y, heading, to_x, to_y)
        t_here = t + track.places[track.sizes[0]] / speed
        if not way_is_free(space, x, y, heading, word, a, b, c, radius, t_here, speed):
            return k
        append_way(track, x, y, heading, word, a, b, c, radius)
    return -1
