"""Inner loops of joint planning: the order of moves within a step, and one robot's way in place and time.

A robot moves from place to place along an edge, or stays (edge -1). ``close[c, u, w]``: two robots of kind c cannot
stand at u and w. ``swept[c, e, w]``: one cannot move along e while the other stands at w. The kind of a pair, the
distance it needs, is given by ``kinds``.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
"""
from heapq import heappop, heappush

import numpy as np
from numba import b1, f8, i8, njit, types

INDICES = types.Array(i8, 1, 'C', readonly=True)
TABLE = types.Array(i8, 2, 'C', readonly=True)
FLAGS = types.Array(b1, 1, 'C', readonly=True)
CUBE = types.Array(b1, 3, 'C', readonly=True)
LENGTHS = types.Array(f8, 1, 'C', readonly=True)


@njit(i8(CUBE, CUBE, i8, i8, i8, i8, i8, i8, i8), nogil=True, cache=True)
def orders(close, swept, kind, u, v, e, other_u, other_v, other_e):
    """Return who may move first: 0 for nobody, 1 for the first robot, 2 for the other, 3 for either."""
    if e < 0 and other_e < 0:
        return 3
    if close[kind, v, other_v]:
        return 0
    first = (e < 0 or not swept[kind, e, other_u]) and (other_e < 0 or not swept[kind, other_e, v])
    second = (other_e < 0 or not swept[kind, other_e, u]) and (e < 0 or not swept[kind, e, other_v])
    return int(first) + 2 * int(second)


@njit(b1(CUBE, CUBE, TABLE, INDICES, INDICES, INDICES, i8[::1]), nogil=True, cache=True)
def rank_moves(close, swept, kinds, before, after, edges, ranks):
    """Fill in ``ranks`` (N,) so that whoever must move before another has a lower one; return False if nobody can."""
    count = len(before)
    waits_for = np.zeros((count, count), np.bool_)
    for a in range(count):
        for b in range(a):
            order = orders(close, swept, kinds[a, b], before[a], after[a], edges[a], before[b], after[b], edges[b])
            if order == 0:
                return False
            if order == 1:
                waits_for[b, a] = True
            elif order == 2:
                waits_for[a, b] = True
    ranks[:] = -1
    placed, rank = 0, 0
    while placed < count:
        previous = placed
        for a in range(count):
            if ranks[a] >= 0:
                continue
            is_next = True
            for b in range(count):
                if waits_for[a, b] and (ranks[b] < 0 or ranks[b] == rank):
                    is_next = False
                    break
            if is_next:
                ranks[a] = rank
                placed += 1
        if placed == previous:
            return False
        rank += 1
    return True


@njit(i8(CUBE, CUBE, TABLE, TABLE, TABLE, i8[:, ::1]), nogil=True, cache=True)
def rank_steps(close, swept, kinds, places, edges, ranks):
    """Fill in the ``ranks`` (T, N) of all steps; return how many have any before the first that has none."""
    for t in range(len(edges)):
        if not rank_moves(close, swept, kinds, places[t], places[t + 1], edges[t], ranks[t]):
            return t
    return len(edges)


@njit(types.UniTuple(i8[::1], 2)(INDICES, INDICES, INDICES, FLAGS, LENGTHS, LENGTHS, CUBE, CUBE, INDICES, TABLE, TABLE,
                                 i8, i8, f8, f8, i8), nogil=True, cache=True)
def replan(first, targets, by, usable, lengths, to_go, close, swept, kinds, places, edges, start, goal, wait, extra,
           limit):
    """Return places (T + 1,) and edges (T,) of the cheapest way from ``start`` to ``goal`` among the others' moves.

    Parameters
    ----------
    first, targets, by : (n + 1,), (2 m,), (2 m,)
        The neighbours of place u and the edges there are those from first[u] to first[u + 1].
    usable : (m,)
        The edges this robot may use.
    lengths, to_go : (m,), (n,) [m]
        Of the edges, and from each place to the goal.
    kinds : (O,)
        With each of the others.
    places, edges : (T + 1, O), (T, O)
        Where the others are before and after each step, and along which edge they move.
    wait, extra : float [m]
        A step without a move costs ``wait``, a move its length, ``wait`` at least, and ``extra``.
    limit : int
        Places and times looked at; both arrays are empty where that is not enough, or where there is no way.
    """
    steps, others = edges.shape
    # Only when nobody comes by any more may it stay at its goal.
    last = 0
    for t in range(steps):
        for o in range(others):
            if orders(close, swept, kinds[o], goal, goal, -1, places[t, o], places[t + 1, o], edges[t, o]) == 0:
                last = t + 1
    cost = np.full((steps + 1, len(to_go)), np.inf)
    came = np.full((steps + 1, len(to_go)), -1, np.int64)
    via = np.full((steps + 1, len(to_go)), -1, np.int64)
    cost[0, start] = 0.0
    heap = [(to_go[start], np.int64(0), start)]
    found = -1
    while len(heap) > 0 and limit > 0:
        estimate, negative, u = heappop(heap)
        t = -negative
        so_far = cost[t, u]
        if estimate > so_far + to_go[u] + 1e-9:
            continue
        limit -= 1
        if u == goal and t >= last:
            found = t
            break
        if t == steps:
            continue
        for k in range(first[u], first[u + 1] + 1):
            v, e, total = u, np.int64(-1), so_far + wait
            if k < first[u + 1]:
                v, e = targets[k], by[k]
                if not usable[e]:
                    continue
                total = so_far + max(lengths[e], wait) + extra
            if total >= cost[t + 1, v] - 1e-9 or to_go[v] == np.inf:
                continue
            is_free = True
            for o in range(others):
                if orders(close, swept, kinds[o], u, v, e, places[t, o], places[t + 1, o], edges[t, o]) == 0:
                    is_free = False
                    break
            if is_free:
                cost[t + 1, v], came[t + 1, v], via[t + 1, v] = total, u, e
                heappush(heap, (total + to_go[v], -(t + 1), v))
    if found < 0:
        return np.empty(0, np.int64), np.empty(0, np.int64)
    own_places, own_edges = np.full(steps + 1, goal, np.int64), np.full(steps, -1, np.int64)
    for t in range(found, 0, -1):
        own_edges[t - 1] = via[t, own_places[t]]
        own_places[t - 1] = came[t, own_places[t]]
    return own_places, own_edges


@njit(b1(INDICES, INDICES, INDICES, types.Array(b1, 2, 'C', readonly=True), LENGTHS,
         types.Array(f8, 2, 'C', readonly=True), CUBE, CUBE, TABLE, i8[:, ::1], i8[:, ::1], INDICES, INDICES, INDICES,
         f8, f8, i8, i8[:, ::1]), nogil=True, cache=True)
def replan_some(first, targets, by, usable, lengths, to_go, close, swept, kinds, places, edges, starts, goals, robots,
                wait, extra, limit, ranks):
    """Let ``robots`` move anew, one after the other, among the rest; return False where they cannot.

    All are changed in ``places`` (T + 1, N) and ``edges`` (T, N), and their ``ranks`` (T, N) are filled in; for the
    rest see `replan`.
    """
    steps, count = edges.shape
    is_left = np.zeros(count, np.bool_)
    for robot in robots:
        is_left[robot] = True
    for robot in robots:
        others = np.flatnonzero(~is_left)
        around, along = np.empty((steps + 1, len(others)), np.int64), np.empty((steps, len(others)), np.int64)
        kind = np.empty(len(others), np.int64)
        for o in range(len(others)):
            kind[o] = kinds[robot, others[o]]
            around[:, o], along[:, o] = places[:, others[o]], edges[:, others[o]]
        own_places, own_edges = replan(first, targets, by, usable[robot], lengths, to_go[robot], close, swept, kind,
                                       around, along, starts[robot], goals[robot], wait, extra, limit)
        if len(own_places) == 0:
            return False
        places[:, robot], edges[:, robot] = own_places, own_edges
        is_left[robot] = False
    return rank_steps(close, swept, kinds, places, edges, ranks) == steps
