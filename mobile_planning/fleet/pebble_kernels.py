"""Inner loops of joint planning: the order of moves within a step, and one robot's way in place and time.

A robot moves from place to place along an edge, or stays (edge -1). ``close[c, u, w]``: two robots of kind c cannot
stand at u and w. ``swept[c, e, w]``: one cannot move along e while the other stands at w. The kind of a pair, the
distance it needs, is given by ``kinds``.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, void

INDICES = types.Array(i8, 1, 'C', readonly=True)
TABLE = types.Array(i8, 2, 'C', readonly=True)
FLAGS = types.Array(b1, 1, 'C', readonly=True)
PLANE = types.Array(b1, 2, 'C', readonly=True)
CUBE = types.Array(b1, 3, 'C', readonly=True)
LENGTHS = types.Array(f8, 1, 'C', readonly=True)
#: Entries of a heap to begin with.
_HEAP = 1024
#: Way [m] that is as good as none, and by which the last may be later: it need not wait as long as it seems.
_ROUNDING, _SLACK = 1e-6, 1.0


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


@njit(b1[:, ::1](INDICES, INDICES, INDICES, CUBE, CUBE), nogil=True, cache=True)
def may_meet(first, targets, by, close, swept):
    """Return whether two robots that are at u and w can be in each other's way in a step (n, n), of whatever kind.

    Parameters
    ----------
    first, targets, by : (n + 1,), (2 m,), (2 m,)
        See `replan`.
    """
    kinds, count, _ = close.shape
    # Column u: whether a robot that is at u before the step comes too close to one that stands at w.
    comes_near, meets = np.zeros((count, count), np.bool_), np.zeros((count, count), np.bool_)
    near = np.empty(count, np.bool_)
    for u in range(count):
        near[:] = False
        for c in range(kinds):
            near |= close[c, u]
            for k in range(first[u], first[u + 1]):
                near |= close[c, targets[k]]
                near |= swept[c, by[k]]
        comes_near[:, u] = near
    for w in range(count):
        meets[w] = comes_near[w]
        for k in range(first[w], first[w + 1]):
            meets[w] |= comes_near[targets[k]]
    return meets | meets.T


@njit(void(f8[::1], i8[::1], i8, f8, i8), nogil=True, cache=True)
def push(keys, codes, size, key, code):
    """Put (key, code) into a heap of ``size`` entries, ordered by both; it has one more then."""
    at = size
    while at > 0:
        above = (at - 1) >> 1
        if keys[above] < key or (keys[above] == key and codes[above] <= code):
            break
        keys[at], codes[at] = keys[above], codes[above]
        at = above
    keys[at], codes[at] = key, code


@njit(types.Tuple((f8, i8))(f8[::1], i8[::1], i8), nogil=True, cache=True)
def pop(keys, codes, size):
    """Take the least entry off a heap of ``size`` entries and return it; it has one less then."""
    least, key, code = (keys[0], codes[0]), keys[size - 1], codes[size - 1]
    at, below, last = 0, 1, size - 1
    while below < last:
        right = below + 1
        if right < last and (keys[right] < keys[below]
                             or (keys[right] == keys[below] and codes[right] < codes[below])):
            below = right
        if key < keys[below] or (key == keys[below] and code <= codes[below]):
            break
        keys[at], codes[at] = keys[below], codes[below]
        at = below
        below = 2 * at + 1
    keys[at], codes[at] = key, code
    return least


@njit(types.Tuple((i8[::1], i8[::1], i8))(
    INDICES, INDICES, INDICES, FLAGS, LENGTHS, LENGTHS, CUBE, CUBE, PLANE, INDICES, TABLE, TABLE, i8, i8, f8, f8, f8,
    i8), nogil=True, cache=True)
def replan(first, targets, by, usable, lengths, to_go, close, swept, meets, kinds, places, edges, start, goal, wait,
           extra, most, limit):
    """Return places (T + 1,) and edges (T,) of the cheapest way from ``start`` to ``goal`` among the others' moves.

    Beside them, how many places and times were looked at.

    Parameters
    ----------
    first, targets, by : (n + 1,), (2 m,), (2 m,)
        The neighbours of place u and the edges there are those from first[u] to first[u + 1].
    usable : (m,)
        The edges this robot may use.
    lengths, to_go : (m,), (n,) [m]
        Of the edges, and from each place to the goal.
    meets : (n, n)
        See `may_meet`.
    kinds : (O,)
        With each of the others.
    places, edges : (T + 1, O), (T, O)
        Where the others are before and after each step, and along which edge they move.
    wait, extra : float [m]
        A step without a move costs ``wait``, a move its length, ``wait`` at least, and ``extra``.
    most : float [m]
        Dearer ways are not looked at.
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
    count = len(to_go)
    cost = np.full((steps + 1, count), np.inf)
    via = np.empty((steps + 1, count), np.int32)
    near, met = np.empty((others, 4), np.int64), 0
    cost[0, start] = 0.0
    # Of equal estimates the one that is furthest on comes first.
    keys, codes, size = np.empty(_HEAP), np.empty(_HEAP, np.int64), 1
    keys[0], codes[0] = to_go[start], steps * count + start
    found, looked_at = -1, 0
    while size > 0 and looked_at < limit:
        estimate, code = pop(keys, codes, size)
        size -= 1
        t = steps - code // count
        u = code - (steps - t) * count
        so_far = cost[t, u]
        if estimate > so_far + to_go[u] + 1e-9:
            continue
        looked_at += 1
        if u == goal and t >= last:
            found = t
            break
        if t == steps:
            continue
        met = 0
        for o in range(others):
            if meets[u, places[t, o]]:
                near[met, 0], near[met, 1], near[met, 2] = places[t, o], places[t + 1, o], edges[t, o]
                near[met, 3] = kinds[o]
                met += 1
        for k in range(first[u], first[u + 1] + 1):
            v, e, total = u, np.int64(-1), so_far + wait
            if k < first[u + 1]:
                v, e = targets[k], by[k]
                if not usable[e]:
                    continue
                total = so_far + max(lengths[e], wait) + extra
            if total >= cost[t + 1, v] - 1e-9 or total + to_go[v] > most:
                continue
            is_free = True
            for i in range(met):
                if orders(close, swept, near[i, 3], u, v, e, near[i, 0], near[i, 1], near[i, 2]) == 0:
                    is_free = False
                    break
            if is_free:
                cost[t + 1, v], via[t + 1, v] = total, e
                if size == len(keys):
                    keys, codes = np.append(keys, np.empty(size)), np.append(codes, np.empty(size, np.int64))
                push(keys, codes, size, total + to_go[v], (steps - t - 1) * count + v)
                size += 1
    if found < 0:
        return np.empty(0, np.int64), np.empty(0, np.int64), looked_at
    own_places, own_edges = np.full(steps + 1, goal, np.int64), np.full(steps, -1, np.int64)
    for t in range(found, 0, -1):
        v, e = own_places[t], np.int64(via[t, own_places[t]])
        own_places[t - 1], own_edges[t - 1] = v, e
        for k in range(first[v], first[v + 1]):
            if by[k] == e:
                own_places[t - 1] = targets[k]
    return own_places, own_edges, looked_at


@njit(f8(i8[:], LENGTHS, f8, f8), nogil=True, cache=True)
def way_cost(edges, lengths, wait, extra):
    """Return what one robot's moves (T,) cost up to the last; see `replan`."""
    total, waits = 0.0, 0
    for e in edges:
        if e < 0:
            waits += 1
            continue
        total += waits * wait + max(lengths[e], wait) + extra
        waits = 0
    return total


@njit(types.Tuple((b1, i8))(
    INDICES, INDICES, INDICES, PLANE, LENGTHS, types.Array(f8, 2, 'C', readonly=True), CUBE, CUBE, PLANE, TABLE,
    i8[:, ::1], i8[:, ::1], INDICES, INDICES, INDICES, f8, f8, i8, i8[:, ::1]), nogil=True, cache=True)
def replan_some(first, targets, by, usable, lengths, to_go, close, swept, meets, kinds, places, edges, starts, goals,
                robots, wait, extra, limit, ranks):
    """Let ``robots`` move anew, one after the other, among the rest; return whether they can, and what was looked at.

    All are changed in ``places`` (T + 1, N) and ``edges`` (T, N), and their ``ranks`` (T, N) are filled in; for the
    rest see `replan`.
    """
    steps, count = edges.shape
    is_left = np.zeros(count, np.bool_)
    for robot in robots:
        is_left[robot] = True
    # The first has the way that it takes now; those after it may have lost theirs to it. Who would be home later than
    # the last one is now makes nothing better.
    latest, looked_at = 0.0, 0
    for robot in range(count):
        latest = max(latest, way_cost(edges[:, robot], lengths, wait, extra))
    most = way_cost(edges[:, robots[0]], lengths, wait, extra) + _ROUNDING
    for robot in robots:
        others = np.flatnonzero(~is_left)
        around, along = np.empty((steps + 1, len(others)), np.int64), np.empty((steps, len(others)), np.int64)
        kind = np.empty(len(others), np.int64)
        for o in range(len(others)):
            kind[o] = kinds[robot, others[o]]
            around[:, o], along[:, o] = places[:, others[o]], edges[:, others[o]]
        own_places, own_edges, more = replan(
            first, targets, by, usable[robot], lengths, to_go[robot], close, swept, meets, kind, around, along,
            starts[robot], goals[robot], wait, extra, most, limit)
        most, looked_at = latest + _SLACK, looked_at + more
        if len(own_places) == 0:
            return False, looked_at
        places[:, robot], edges[:, robot] = own_places, own_edges
        is_left[robot] = False
    return rank_steps(close, swept, kinds, places, edges, ranks) == steps, looked_at
