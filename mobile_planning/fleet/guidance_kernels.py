"""Inner loops of the guidance: the field of the way to a goal, ways around standing robots, and ways pulled taut.

Lattice, rooms and discs are those of `sight_kernels`.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL.
"""
from heapq import heappop, heappush

import numpy as np
from numba import b1, f8, i1, i4, i8, njit, types, void

from mobile_planning.fleet.sight_kernels import (
    POINTS, ROOM, STEP, is_clear, is_clear_of_discs, is_open, least_between, room_at)

COSTS = types.Array(f8, 2, 'C', readonly=True)
ANCHORS = types.Array(i4, 2, 'C', readonly=True)
NODES = types.Array(i8, 1, 'C', readonly=True)
NUMBERS = types.Array(f8, 1, 'C', readonly=True)

#: Sixteen neighbours: straight, diagonal, and a knight's move.
MOVE_X = np.array([1, 2, 1, 1, 0, -1, -1, -2, -1, -2, -1, -1, 0, 1, 1, 2])
MOVE_Y = np.array([0, 1, 1, 2, 1, 2, 1, 1, 0, -1, -1, -2, -1, -2, -1, -1])

#: What a search knows of a node's anchor: nothing yet, that the node sees it, or that the way by it is the best.
HOPED, SEEN, CLOSED = 0, 1, 2


@njit(b1(POINTS, POINTS), nogil=True, cache=True)
def is_clear_way(discs, way):
    """Return whether no leg of a way enters a disc further than its ends do, and no way-point lies in one."""
    for i in range(1, len(way)):
        if not is_clear_of_discs(discs, way[i - 1, 0], way[i - 1, 1], way[i, 0], way[i, 1]):
            return False
        for j in range(len(discs) if i < len(way) - 1 else 0):
            if (way[i, 0] - discs[j, 0]) ** 2 + (way[i, 1] - discs[j, 1]) ** 2 < discs[j, 2] - 1e-9:
                return False
    return True


@njit(b1(f8, f8, i8, f8), nogil=True, cache=True)
def has_room(at_a, at_b, move, need):
    """Return whether a step between nodes of the given squared rooms has the squared room ``need``."""
    length2 = float(MOVE_X[move] ** 2 + MOVE_Y[move] ** 2)
    return min(at_a, at_b) >= need + length2 / 4 or least_between(at_a, at_b, length2) >= need


@njit(types.UniTuple(f8, 3)(ROOM, COSTS, i8, f8, f8, f8, f8), nogil=True, cache=True)
def lead_by(squared, cost, anchor, origin_x, origin_y, radius, comfort):
    """Return the place (x, y) of an anchor, a node or (-1) the origin, and what all ways by it cost up to there.

    To bend beside a wall costs as much as the comfort that is missing there: more than to bend further out.
    """
    if anchor < 0:
        return origin_x, origin_y, 0.0
    row, column = anchor // squared.shape[1], anchor % squared.shape[1]
    missing = max(0.0, comfort + radius - np.sqrt(squared[row, column]))
    return float(column), float(row), cost[row, column] + missing


@njit(f8(ROOM, COSTS, i8, f8, f8, f8, f8, f8, f8), nogil=True, cache=True)
def cost_by(squared, cost, anchor, x, y, origin_x, origin_y, radius, comfort):
    """Return the cost to (x, y) straight from an anchor; see `lead_by`."""
    from_x, from_y, so_far = lead_by(squared, cost, anchor, origin_x, origin_y, radius, comfort)
    return so_far + np.sqrt((x - from_x) ** 2 + (y - from_y) ** 2)


@njit(b1(ROOM, POINTS, i8, f8, f8, f8, f8, f8), nogil=True, cache=True)
def sees(squared, discs, anchor, x, y, origin_x, origin_y, ample):
    """Return whether (x, y) sees an anchor with ample room, or with as much as the two have."""
    if anchor < 0:
        return is_clear(squared, discs, origin_x, origin_y, x, y, ample)
    return is_clear(squared, discs, anchor % squared.shape[1], anchor // squared.shape[1], x, y, ample)


@njit(b1(ROOM, POINTS, f8[:, ::1], i4[:, ::1], i1[:, ::1], i8, f8, f8, f8, f8), nogil=True, cache=True)
def settle(squared, discs, cost, anchors, state, node, origin_x, origin_y, radius, comfort):
    """Close a node if it sees its anchor; else give it the best of its closed neighbours' ways and return False."""
    height, width = squared.shape
    y, x = node // width, node % width
    ample, hoped = (radius + comfort) ** 2, anchors[y, x]
    if state[y, x] == SEEN or sees(squared, discs, hoped, x, y, origin_x, origin_y, ample):
        state[y, x] = CLOSED
        return True
    best, best_anchor = np.inf, -1
    for move in range(16):
        near_x, near_y = x + MOVE_X[move], y + MOVE_Y[move]
        if near_x < 0 or near_y < 0 or near_x >= width or near_y >= height or state[near_y, near_x] != CLOSED:
            continue
        if not has_room(squared[y, x], squared[near_y, near_x], move, radius * radius):
            continue
        total = cost_by(squared, cost, near_y * width + near_x, x, y, origin_x, origin_y, radius, comfort)
        if total < best:
            best, best_anchor = total, near_y * width + near_x
        anchor = anchors[near_y, near_x]
        total = cost_by(squared, cost, anchor, x, y, origin_x, origin_y, radius, comfort)
        if total < best and anchor != hoped and sees(squared, discs, anchor, x, y, origin_x, origin_y, ample):
            best, best_anchor = total, anchor
    cost[y, x], anchors[y, x], state[y, x] = best, best_anchor, SEEN
    return False


@njit(void(POINTS, f8[:, ::1], i4[::1], i8[::1]), nogil=True, cache=True)
def close_discs(discs, reached, touched, count):
    """Mark the nodes inside the discs so that no search enters them, and note them."""
    height, width = reached.shape
    for i in range(len(discs)):
        radius = np.sqrt(discs[i, 2])
        for y in range(max(0, int(np.ceil(discs[i, 1] - radius))), min(height, int(discs[i, 1] + radius) + 1)):
            for x in range(max(0, int(np.ceil(discs[i, 0] - radius))), min(width, int(discs[i, 0] + radius) + 1)):
                inside = (x - discs[i, 0]) ** 2 + (y - discs[i, 1]) ** 2 < discs[i, 2] - 1e-9
                if inside and reached[y, x] == np.inf:
                    reached[y, x] = -1.0
                    touched[count[0]] = y * width + x
                    count[0] += 1


@njit(b1(ROOM, POINTS, NODES, NODES, f8, f8, f8, f8, f8[:, ::1], i4[:, ::1]), nogil=True, cache=True)
def spread(squared, discs, ends, wanted, goal_x, goal_y, radius, comfort, cost, anchors):
    """Fill in the cost of the way from each node to the goal, and where it bends first (-1: nowhere).

    ``cost`` must come filled with inf; it stays so where no way leads around the discs. ``ends`` are nodes in sight of
    the goal. Where there are ``wanted`` nodes the search is over when it has come to all of them; the nodes that it has
    not come to by then keep inf. Return whether it has come to all nodes that a way leads to.

    The search is Lazy Theta* (Nash, Koenig and Tovey 2010) without a heuristic: Dijkstra's, but along straight lines.
    """
    height, width = squared.shape
    need, state = radius * radius, np.zeros((height, width), np.int8)
    touched, count = np.empty(squared.size, np.int32), np.zeros(1, np.int64)
    close_discs(discs, cost, touched, count)
    heap = [(np.inf, np.int64(0))]
    for i in range(len(ends)):
        y, x = ends[i] // width, ends[i] % width
        if cost[y, x] < 0.0:
            continue
        cost[y, x], anchors[y, x], state[y, x] = np.hypot(x - goal_x, y - goal_y), -1, SEEN
        heappush(heap, (cost[y, x], ends[i]))
    is_wanted, left = np.zeros(squared.size, np.bool_), 0
    for node in wanted:
        if not is_wanted[node] and cost[node // width, node % width] >= 0.0:
            is_wanted[node], left = True, left + 1
    is_over = False
    while len(heap) > 1 and not is_over:
        so_far, node = heappop(heap)
        y, x = node // width, node % width
        if so_far > cost[y, x] or state[y, x] == CLOSED:
            continue
        if not settle(squared, discs, cost, anchors, state, node, goal_x, goal_y, radius, comfort):
            heappush(heap, (cost[y, x], node))
            continue
        if is_wanted[node]:
            left -= 1
            is_over = left == 0
        from_x, from_y, so_far = lead_by(squared, cost, anchors[y, x], goal_x, goal_y, radius, comfort)
        for move in range(16):
            to_x, to_y = x + MOVE_X[move], y + MOVE_Y[move]
            if to_x < 0 or to_y < 0 or to_x >= width or to_y >= height or state[to_y, to_x] == CLOSED:
                continue
            total = so_far + np.sqrt((to_x - from_x) ** 2 + (to_y - from_y) ** 2)
            if total < cost[to_y, to_x] - 1e-9 and has_room(squared[y, x], squared[to_y, to_x], move, need):
                cost[to_y, to_x], anchors[to_y, to_x], state[to_y, to_x] = total, anchors[y, x], HOPED
                heappush(heap, (total, to_y * width + to_x))
    for y in range(height if is_over else 0):
        for x in range(width):
            if state[y, x] != CLOSED:
                cost[y, x] = np.inf
    for i in range(count[0]):
        cost[touched[i] // width, touched[i] % width] = np.inf
    return not is_over


@njit(f8[:, ::1](ANCHORS, i8), nogil=True, cache=True)
def follow_anchors(anchors, node):
    """Return the nodes (n, 2) from ``node`` to the last anchor."""
    width = anchors.shape[1]
    count, at = 0, node
    while at >= 0:
        at, count = np.int64(anchors[at // width, at % width]), count + 1
    way = np.empty((count, 2))
    at = node
    for i in range(count):
        way[i, 0], way[i, 1] = at % width, at // width
        at = np.int64(anchors[at // width, at % width])
    return way


@njit(b1(ANCHORS, POINTS, f8[:, ::1], i1[:, ::1], i8, f8, f8), nogil=True, cache=True)
def is_free_from(anchors, discs, reached, knowledge, node, goal_x, goal_y):
    """Return whether the way from ``node`` over its anchors avoids the discs; each node on the way is asked once.

    Nodes inside the discs have a negative value in ``reached``.
    """
    width = anchors.shape[1]
    at, found = node, 1
    while at >= 0:
        if knowledge[at // width, at % width] != 0:
            found = np.int64(knowledge[at // width, at % width])
            break
        to = np.int64(anchors[at // width, at % width])
        to_x, to_y = (float(to % width), float(to // width)) if to >= 0 else (goal_x, goal_y)
        is_inside = to >= 0 and reached[to // width, to % width] < 0.0
        if is_inside or not is_clear_of_discs(discs, at % width, at // width, to_x, to_y):
            knowledge[at // width, at % width] = found = 2
            break
        at = to
    last, at = at, node
    while at != last:
        knowledge[at // width, at % width] = found
        at = np.int64(anchors[at // width, at % width])
    return found == 1


@njit(void(ANCHORS, i1[:, ::1], i8), nogil=True, cache=True)
def forget(anchors, knowledge, node):
    """Undo what `is_free_from` has noted."""
    width = anchors.shape[1]
    at = node
    while at >= 0 and knowledge[at // width, at % width] != 0:
        knowledge[at // width, at % width] = 0
        at = np.int64(anchors[at // width, at % width])


@njit(f8[:, ::1](ROOM, COSTS, ANCHORS, POINTS, NODES, POINTS, f8, f8, f8[:, ::1], i1[:, ::1],
                 i4[:, ::1], i1[:, ::1], i8), nogil=True, cache=True)
def way_around(squared, cost, anchors, discs, starts, ends, radius, comfort, reached, state, came, knowledge, limit):
    """Return the cheapest way (n, 2) over nodes between two places, the rows of ``ends``, around discs; empty if none.

    Lazy Theta* from the nodes ``starts``, which see the first place, as far as a node whose way over its ``anchors``
    avoids the discs. The cost without the discs hardly ever overestimates, so the search looks at little more than
    the way it finds; it gives up after ``limit`` nodes. ``reached`` must come filled with inf, ``state`` and
    ``knowledge`` with 0, and all are left so; ``came`` may hold anything.
    """
    height, width = squared.shape
    (start_x, start_y), (goal_x, goal_y) = ends[0], ends[1]
    touched, count = np.empty(squared.size, np.int32), np.zeros(1, np.int64)
    close_discs(discs, reached, touched, count)
    heap = [(np.inf, 0.0, np.int64(0))]
    for i in range(len(starts)):
        y, x = starts[i] // width, starts[i] % width
        if reached[y, x] == np.inf and cost[y, x] < np.inf:
            touched[count[0]] = starts[i]
            count[0] += 1
            reached[y, x], came[y, x], state[y, x] = np.hypot(x - start_x, y - start_y), -1, SEEN
            heappush(heap, (reached[y, x] + cost[y, x], reached[y, x], starts[i]))
    last = np.int64(-1)
    while len(heap) > 1 and limit > 0:
        _, so_far, node = heappop(heap)
        y, x = node // width, node % width
        if so_far > reached[y, x] or state[y, x] == CLOSED:
            continue
        if not settle(squared, discs, reached, came, state, node, start_x, start_y, radius, comfort):
            heappush(heap, (reached[y, x] + cost[y, x], reached[y, x], node))
            continue
        if is_free_from(anchors, discs, reached, knowledge, node, goal_x, goal_y):
            last = node
            break
        limit -= 1
        from_x, from_y, so_far = lead_by(squared, reached, came[y, x], start_x, start_y, radius, comfort)
        for move in range(16):
            to_x, to_y = x + MOVE_X[move], y + MOVE_Y[move]
            if to_x < 0 or to_y < 0 or to_x >= width or to_y >= height or state[to_y, to_x] == CLOSED:
                continue
            total = so_far + np.sqrt((to_x - from_x) ** 2 + (to_y - from_y) ** 2)
            if cost[to_y, to_x] == np.inf or total >= reached[to_y, to_x] - 1e-9:
                continue
            if has_room(squared[y, x], squared[to_y, to_x], move, radius * radius):
                if reached[to_y, to_x] == np.inf:
                    touched[count[0]] = to_y * width + to_x
                    count[0] += 1
                reached[to_y, to_x], came[to_y, to_x], state[to_y, to_x] = total, came[y, x], HOPED
                heappush(heap, (total + cost[to_y, to_x], total, to_y * width + to_x))
    for i in range(count[0]):
        reached[touched[i] // width, touched[i] % width] = np.inf
        state[touched[i] // width, touched[i] % width] = HOPED
        forget(anchors, knowledge, np.int64(touched[i]))
    if last < 0:
        return np.empty((0, 2))
    there, onwards = follow_anchors(came, last), follow_anchors(anchors, last)
    return np.concatenate((there[::-1], onwards[1:]))


@njit(f8[:, ::1](ROOM, POINTS, POINTS, f8, f8), nogil=True, cache=True)
def pull_string(squared, discs, way, radius, comfort):
    """Return the points of the way that remain when each is joined to the last one it sees in a row.

    A shortcut comes no nearer to what is occupied than the points it leaves out, unless it has room to spare.
    """
    kept = np.empty_like(way)
    kept[0] = way[0]
    count, need, ample = 1, np.inf, (radius + comfort) ** 2
    for i in range(1, len(way) - 1):
        ax, ay, x, y = kept[count - 1, 0], kept[count - 1, 1], way[i, 0], way[i, 1]
        # A line hardly ever runs through the very middle of a passage: a tenth of the squared room is given away.
        need = min(need, max(radius * radius, 0.9 * room_at(squared, x, y)))
        if not is_clear(squared, discs, ax, ay, way[i + 1, 0], way[i + 1, 1], min(need, ample)):
            kept[count] = way[i]
            count, need = count + 1, np.inf
    if len(way) > 1:
        kept[count] = way[-1]
        count += 1
    return kept[:count].copy()


@njit(f8[:, ::1](ROOM, POINTS, POINTS, b1, POINTS, NUMBERS, f8), nogil=True, cache=True)
def draw_ahead(squared, discs, way, to_goal, standing, reach, radius):
    """Return for each row m of ``standing`` the furthest point of the way it sees, up to ``reach[m]`` along it.

    Where it sees none the row stays as it is. The way's last point may be tight if it is the goal.
    """
    drawn = standing.copy()
    arc = np.zeros(len(way))
    for i in range(1, len(way)):
        arc[i] = arc[i - 1] + np.hypot(way[i, 0] - way[i - 1, 0], way[i, 1] - way[i - 1, 1])
    for m in range(len(standing)):
        x, y = standing[m]
        at = min(reach[m], arc[-1])
        if to_goal and at == arc[-1] and is_clear(squared, discs, x, y, way[-1, 0], way[-1, 1], radius * radius):
            drawn[m] = way[-1]
            continue
        i = len(way) - 1
        while at >= 0.0:
            while i > 0 and arc[i] > at:
                i -= 1
            drawn[m] = way[i]
            if i < len(way) - 1:
                drawn[m] += (at - arc[i]) / (arc[i + 1] - arc[i]) * (way[i + 1] - way[i])
            if is_open(squared, discs, x, y, drawn[m, 0], drawn[m, 1], radius):
                break
            # The same points for every row, and from one call to the next.
            at = STEP * (np.ceil(at / STEP) - 1.0)
        if at < 0.0:
            drawn[m, 0], drawn[m, 1] = x, y
    return drawn
