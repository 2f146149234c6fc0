"""Inner loops of a roadmap: its edges by node, and the search that has an edge checked only when it comes to it.

The search stands in arrays that the caller keeps, so that it can stop wherever an edge must be checked and go on when
the answer is there. None of the functions holds the GIL.
"""
import numpy as np
from numba import b1, f8, i4, i8, njit, types, u1

from mobile_planning.sampling.edge_kernels import POINTS, straight_is_free
from mobile_planning.sampling.surroundings_kernels import SURROUNDINGS, pose_is_free

EDGES = types.Array(i8, 2, 'C', readonly=True)
LENGTHS = types.Array(f8, 1, 'C', readonly=True)
OFFSETS = types.Array(i8, 1, 'C', readonly=True)
INDICES = types.Array(i4, 1, 'C', readonly=True)

# What is known of a node or an edge.
UNKNOWN, FREE, BLOCKED = np.uint8(0), np.uint8(1), np.uint8(2)
# How a turn of the search ends when no edge must be checked.
EXHAUSTED, FOUND, STOPPED, PAUSED = 0, -1, -2, -3
# Slots of the heap that are looked through for one edge to be checked with the first.
SLOTS_PER_EDGE = 4


@njit(types.Tuple((i8[::1], i4[::1], i4[::1], i4[::1]))(EDGES, i8, b1), nogil=True, cache=True)
def adjacency(edges, nodes, is_directed):
    """Return the arcs ordered by their tails: where each node's begin, their tails, heads and edges."""
    begins = np.zeros(nodes + 1, np.int64)
    for edge in range(len(edges)):
        begins[edges[edge, 0] + 1] += 1
        if not is_directed:
            begins[edges[edge, 1] + 1] += 1
    for node in range(nodes):
        begins[node + 1] += begins[node]
    place, count = begins[:-1].copy(), begins[-1]
    tails, heads, numbers = np.empty(count, np.int32), np.empty(count, np.int32), np.empty(count, np.int32)
    for edge in range(len(edges)):
        for way in range(1 if is_directed else 2):
            tail = edges[edge, way]
            tails[place[tail]], heads[place[tail]], numbers[place[tail]] = tail, edges[edge, 1 - way], edge
            place[tail] += 1
    return begins, tails, heads, numbers


@njit(i8(f8[::1], i4[::1], i8, f8, i8), nogil=True, cache=True)
def push(keys, arcs, count, key, arc):
    """Put an arc into the binary heap and return the new count; there must be room."""
    place = count
    while place > 0:
        parent = (place - 1) >> 1
        if keys[parent] <= key:
            break
        keys[place], arcs[place] = keys[parent], arcs[parent]
        place = parent
    keys[place], arcs[place] = key, arc
    return count + 1


@njit(i8(f8[::1], i4[::1], i8), nogil=True, cache=True)
def drop_first(keys, arcs, count):
    """Remove the first entry of the heap and return the new count."""
    last = count - 1
    key, arc = keys[last], arcs[last]
    place = 0
    while True:
        child = 2 * place + 1
        if child >= last:
            break
        if child + 1 < last and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[place], arcs[place] = keys[child], arcs[child]
        place = child
    keys[place], arcs[place] = key, arc
    return last


GRAPH = types.Tuple((OFFSETS, INDICES, INDICES, INDICES, LENGTHS, u1[::1], u1[::1], POINTS, SURROUNDINGS))
ENDS = types.Tuple((INDICES, INDICES, LENGTHS, u1[::1], INDICES, LENGTHS, POINTS))
SEARCH = types.Tuple((f8[::1], i4[::1], b1[::1], i4[::1], f8[::1], i4[::1], i8[::1]))


@njit(types.Tuple((i8, i8, f8, u1))(GRAPH, ENDS, i8), nogil=True, cache=True)
def arc_of(graph, ends, arc):
    """Return tail, head, length and what is known of an arc, of the roadmap or of the query's ends."""
    _, tails, heads, numbers, lengths, edge_states, _, _, _ = graph
    if arc < len(tails):
        edge = numbers[arc]
        return tails[arc], heads[arc], lengths[edge], edge_states[edge]
    end_tails, end_heads, end_lengths, end_states, _, _, _ = ends
    end = arc - len(tails)
    return end_tails[end], end_heads[end], end_lengths[end], end_states[end]


@njit(i8(GRAPH, ENDS, SEARCH, i8, i8), nogil=True, cache=True)
def expand(graph, ends, search, node, count):
    """Put the arcs out of a node into the heap and return its new count; a known way is taken at once."""
    begins, tails, heads, numbers, lengths, edge_states, node_states, _, _ = graph
    _, _, _, _, to_goal, estimates, _ = ends
    costs, parents, closed, _, keys, arcs, _ = search
    nodes = len(node_states)
    for arc in range(begins[node], begins[node + 1]):
        head, edge = heads[arc], numbers[arc]
        if closed[head] or node_states[head] == BLOCKED or edge_states[edge] == BLOCKED:
            continue
        cost = costs[node] + lengths[edge]
        if cost >= costs[head]:
            continue
        if edge_states[edge] == FREE:
            costs[head], parents[head] = cost, arc
        count = push(keys, arcs, count, cost + estimates[head], arc)
    if to_goal[node] >= 0:
        _, _, length, state = arc_of(graph, ends, len(tails) + to_goal[node])
        if state != BLOCKED and costs[node] + length < costs[nodes + 1]:
            count = push(keys, arcs, count, costs[node] + length, len(tails) + to_goal[node])
    return count


@njit(types.UniTuple(f8, 2)(GRAPH, ENDS, i8), nogil=True, cache=True)
def place_of(graph, ends, node):
    """Return the first two coordinates of a node, the start or the goal."""
    points, ends_at = graph[7], ends[6]
    if node < len(points):
        return points[node, 0], points[node, 1]
    return ends_at[node - len(points), 0], ends_at[node - len(points), 1]


@njit(u1(GRAPH, ENDS, i8, i8), nogil=True, cache=True)
def state_in_plane(graph, ends, tail, head):
    """Return whether the line from a node that is free to another is FREE or BLOCKED; what is learnt of nodes is kept.

    A line counts as free from the lower node to the higher, whichever way it is gone.
    """
    node_states, plane = graph[6], graph[8]
    x0, y0 = place_of(graph, ends, tail)
    x1, y1 = place_of(graph, ends, head)
    if head < len(node_states) and node_states[head] == UNKNOWN:
        node_states[head] = FREE if pose_is_free(plane, x1, y1, 0.0, 0.0) else BLOCKED
        if node_states[head] == BLOCKED:
            return BLOCKED
    if head < tail < len(node_states):
        x0, y0, x1, y1 = x1, y1, x0, y0
    return FREE if straight_is_free(plane, x0, y0, x1, y1) else BLOCKED


@njit(b1(GRAPH, ENDS, i8, i8, i8), nogil=True, cache=True)
def is_found_out(graph, ends, arc, tail, head):
    """Return whether the search can check an arc by itself, and remember what it finds."""
    if graph[8].rooms.size == 0:
        return False
    state = state_in_plane(graph, ends, tail, head)
    if arc < len(graph[1]):
        graph[5][graph[3][arc]] = state
    else:
        ends[3][arc - len(graph[1])] = state
    return True


@njit(i8(GRAPH, ENDS, SEARCH, i8, i4[::1]), nogil=True, cache=True)
def unknown_arcs(graph, ends, search, count, wanted):
    """Fill ``wanted`` with arcs that must be checked, the first of the heap and others near it; return how many.

    No two lead to the same node: of those the second is needed only if the first is blocked.
    """
    costs, _, closed, asked, _, arcs, counts = search
    counts[2] += 1
    found = 0
    for slot in range(min(count, SLOTS_PER_EDGE * len(wanted))):
        tail, head, length, state = arc_of(graph, ends, arcs[slot])
        if state == UNKNOWN and not closed[head] and asked[head] < counts[2] and costs[tail] + length < costs[head]:
            asked[head] = counts[2]
            wanted[found] = arcs[slot]
            found += 1
            if found == len(wanted):
                break
    return found


@njit(i8(GRAPH, ENDS, SEARCH, i4[::1], i8, u1[::1]), nogil=True, cache=True)
def advance(graph, ends, search, wanted, most, stop):
    """Search until an arc must be checked, and return how many are in ``wanted``; or how the turn ended.

    A* that has an edge checked when it is taken from the queue, as the lazy weighted A* of Cohen, Phillips and
    Likhachev (2014) does, with weight 1. The estimates are consistent, so that the first free arc that comes to a node
    is the last of its shortest path.

    Parameters
    ----------
    graph : tuple of ndarray
        Begins, tails, heads and edges of the arcs; lengths and states of the edges; states and places of the nodes;
        the plane, without cells if the space is another one.
    ends : tuple of ndarray
        Tails, heads, lengths and states of the arcs that belong to the query alone; which of them leads from each node
        to the goal, -1 for none; the estimate of each node; the places of both ends. The start is node n, the goal
        n + 1.
    search : tuple of ndarray
        Cost and parent arc of each node, whether it is closed, and in which batch an arc to it was asked for; keys and
        arcs of the heap; counts of entries, expansions, batches and edges checked here.
    wanted : (k,) ndarray of int32
    most : int
        Expansions of this turn.
    stop : (1,) ndarray of uint8
    """
    costs, parents, closed, _, keys, arcs, counts = search
    count, expansions, goal = counts[0], 0, len(graph[6]) + 1
    outcome = EXHAUSTED
    while count > 0:
        tail, head, length, state = arc_of(graph, ends, arcs[0])
        cost = costs[tail] + length
        if closed[head] or cost > costs[head] or state == BLOCKED or (
                head < goal - 1 and graph[6][head] == BLOCKED):
            count = drop_first(keys, arcs, count)
            continue
        if expansions >= most:
            outcome = PAUSED
            break
        if stop[0]:
            outcome = STOPPED
            break
        if state == UNKNOWN:
            if cost == costs[head]:
                count = drop_first(keys, arcs, count)
                continue
            if is_found_out(graph, ends, arcs[0], tail, head):
                counts[3] += 1
                continue
            outcome = unknown_arcs(graph, ends, search, count, wanted)
            break
        arc = arcs[0]
        count = drop_first(keys, arcs, count)
        costs[head], parents[head], closed[head] = cost, arc, True
        expansions += 1
        if head == goal:
            outcome = FOUND
            break
        count = expand(graph, ends, search, head, count)
    counts[0], counts[1] = count, counts[1] + expansions
    return outcome
