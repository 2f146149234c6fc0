"""Inner loops of the state lattice: its free motions, the graph that grows from a root, and the search for a path.

A state is one integer, ``cell * headings + heading``; cells are counted along the rows of a grid with an occupied
border as wide as the longest motion, so that no motion leaves the array. The motions of heading ``h`` are those from
``first[h]`` to ``first[h + 1]``. Motion ``m`` adds ``step[m]`` to the state, costs ``cost[m]`` and crosses the cells
``cell + swept[i]`` for ``i`` from ``bounds[m]`` to ``bounds[m + 1]``.

Which motions are free is found for all states beforehand, because for a whole row of cells at once that takes a few
nanoseconds a state, and for one state after the other tens: bit ``i % 8`` of ``free[state * octets + i // 8]`` is set
if the ``i``-th motion of the state's heading crosses no occupied cell.

A vertex of the graph is marked by the motion that found it, counted from 1, the root by `ROOT`, and with `LEAF` if it
was found last, so that its motions do not belong to the graph.

Every function has an explicit signature, so that it is compiled or read from numba's cache when this module is
imported. None holds the GIL. Indices are cast to unsigned integers because numba would otherwise test each one for
being negative.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, u1, u2, u4, u8

OCTETS = types.Array(u1, 1, 'C', readonly=True)
INTEGERS = types.Array(i8, 1, 'C', readonly=True)
NUMBERS = types.Array(f8, 1, 'C', readonly=True)
MARKS = types.Array(u2, 1, 'C', readonly=True)

LEAF = 1 << 15
ROOT = LEAF - 1
# How often the flag to stop is looked at [states].
PERIOD = 1 << 12


@njit(b1(u1[::1], OCTETS, i8, i8, i8, i8, INTEGERS, INTEGERS, INTEGERS, u1[::1]), nogil=True, cache=True)
def find_free(free, occupied, width, border, headings, octets, first, bounds, swept, stop):
    """Set the bits of the free motions in an array of zeros; return False if ``stop[0]`` was set before the end."""
    across = width - 2 * border
    blocked, bits = np.empty(across, np.uint8), np.empty(across, np.uint8)
    for row in range(border * width + border, occupied.size - border * width, width):
        if stop[0]:
            return False
        for heading in range(headings):
            for octet in range(octets):
                bits[:] = 0
                begin = first[heading] + 8 * octet
                for motion in range(begin, min(begin + 8, first[heading + 1])):
                    blocked[:] = 0
                    for i in range(bounds[motion], bounds[motion + 1]):
                        crossed = occupied[row + swept[i]:row + swept[i] + across]
                        for x in range(across):
                            blocked[x] |= crossed[x]
                    bit = np.uint8(1 << (motion - begin))
                    for x in range(across):
                        bits[x] |= np.uint8(0) if blocked[x] else bit
                for x in range(across):
                    free[np.uint64(((row + x) * headings + heading) * octets + octet)] = bits[x]
    return True


@njit(b1(OCTETS, u8, i8, i8), nogil=True, cache=True, inline='always')
def is_free(free, state, octets, i):
    """Return whether the ``i``-th motion of a state's heading is free."""
    return (free[state * np.uint64(octets) + np.uint64(i >> 3)] >> np.uint8(i & 7)) & 1 != 0


@njit(types.Tuple((u4[::1], i8, i8, b1))(
    u2[::1], OCTETS, i8, i8, i8, i8, i8, INTEGERS, INTEGERS, u1[::1], i8[::1]), nogil=True, cache=True)
def grow(graph, free, most, root, iterations, headings, octets, first, step, stop, done):
    """Add to an empty graph what ``iterations`` rounds of motions reach from the root.

    Returns the vertices in the order in which they were found, at most ``most``, how many of them were expanded, the
    number of edges, and False if ``stop[0]`` was set before the end.
    """
    # Its untouched pages cost nothing.
    vertices = np.empty(most, np.uint32)
    vertices[0], count, expanded, edges, rounds = root, 1, 0, 0, 0
    graph[root] = ROOT
    size = np.uint64(headings)
    while expanded < count and rounds < iterations:
        frontier = count
        while expanded < frontier:
            if expanded % PERIOD == 0:
                if stop[0]:
                    return vertices[:count], expanded, edges, False
                done[0] = expanded
            state = np.uint64(vertices[np.uint64(expanded)])
            expanded += 1
            heading = state % size
            begin = first[heading]
            for motion in range(begin, first[heading + np.uint64(1)]):
                if not is_free(free, state, octets, motion - begin):
                    continue
                edges += 1
                reached = np.uint64(np.int64(state) + step[motion])
                if graph[reached] == 0:
                    graph[reached] = motion + 1
                    vertices[np.uint64(count)] = reached
                    count += 1
        rounds += 1
    for i in range(expanded, count):
        graph[np.uint64(vertices[i])] |= LEAF
    return vertices[:count], expanded, edges, True


@njit(u2[::1](MARKS, i8, INTEGERS), nogil=True, cache=True)
def motions_from_root(graph, state, step):
    """Return the motions by which a vertex was first reached."""
    count, here = 0, state
    while graph[here] & ROOT != ROOT:
        here -= step[(graph[here] & ROOT) - 1]
        count += 1
    motions = np.empty(count, np.uint16)
    while count:
        count -= 1
        motions[count] = (graph[state] & ROOT) - 1
        state -= step[motions[count]]
    return motions


@njit(b1(f8, f8, f8, f8), nogil=True, cache=True, inline='always')
def is_before(total, length, other_total, other_length):
    """Return whether an entry of the queue comes before another: the lower total, of equal ones the longer path."""
    return total < other_total or (total == other_total and length > other_length)


@njit(types.void(f8[::1], f8[::1], u4[::1], i8, f8, f8, i8), nogil=True, cache=True)
def push(totals, lengths, states, count, total, length, state):
    """Put an entry into the binary heap of ``count`` entries, which must have room."""
    hole = count
    while hole > 0:
        above = (hole - 1) >> 1
        if not is_before(total, length, totals[above], lengths[above]):
            break
        totals[hole], lengths[hole], states[hole] = totals[above], lengths[above], states[above]
        hole = above
    totals[hole], lengths[hole], states[hole] = total, length, state


@njit(types.void(f8[::1], f8[::1], u4[::1], i8), nogil=True, cache=True)
def pop(totals, lengths, states, count):
    """Take the first of ``count`` entries out of the binary heap."""
    count -= 1
    total, length, state = totals[count], lengths[count], states[count]
    hole = 0
    while 2 * hole + 1 < count:
        child = 2 * hole + 1
        if child + 1 < count and is_before(totals[child + 1], lengths[child + 1], totals[child], lengths[child]):
            child += 1
        if not is_before(totals[child], lengths[child], total, length):
            break
        totals[hole], lengths[hole], states[hole] = totals[child], lengths[child], states[child]
        hole = child
    totals[hole], lengths[hole], states[hole] = total, length, state


@njit(f8(NUMBERS, f8, f8, i8, i8, i8, i8), nogil=True, cache=True)
def least_cost(field, per_step, per_cell, cell, width, goal_x, goal_y):
    """Return a lower bound of the cost from a cell to the goal: by way of the field's steps, and as the crow flies."""
    straight = per_cell * np.hypot(np.float64(cell % width - goal_x), np.float64(cell // width - goal_y))
    return max(straight, per_step * field[np.uint64(cell)])


@njit(types.Tuple((i8, f8, i8))(
    f8[::1], u2[::1], MARKS, OCTETS, NUMBERS, i8, i8, i8, i8, i8, i8, f8, f8, INTEGERS, INTEGERS, NUMBERS,
    u1[::1]), nogil=True, cache=True)
def search(costs, came, graph, free, field, width, start, goal_cell, goal_heading, headings, octets, per_step,
           per_cell, first, step, cost, stop):
    """Search the cheapest path by A*; without a graph (size 0) every free motion may be taken.

    Parameters
    ----------
    costs : (states,) ndarray
        Anything; written where ``came`` is not 0.
    came : (states,) ndarray of uint16
        Zeros; the motion that reaches each state, counted from 1.
    field : (cells,) ndarray
        Lengths of octile paths to the goal's cell; times ``per_step`` they are lower bounds of the cost, and so are
        distances as the crow flies times ``per_cell``.
    goal_heading : int
        Any one if negative.

    Returns
    -------
    tuple of int, float, int
        The goal's state, -1 without a path and -2 if stopped; its cost; the number of expansions.
    """
    room = 1 << 10
    totals, lengths, states = np.empty(room), np.empty(room), np.empty(room, np.uint32)
    goal_x, goal_y = goal_cell % width, goal_cell // width
    size = np.uint64(headings)
    came[start], costs[start] = ROOT, 0.0
    bound = least_cost(field, per_step, per_cell, start // headings, width, goal_x, goal_y)
    push(totals, lengths, states, 0, bound, 0.0, start)
    count, expansions = 1 if bound < np.inf else 0, 0
    while count > 0:
        state, length = np.uint64(states[0]), lengths[0]
        pop(totals, lengths, states, count)
        count -= 1
        if length > costs[state]:
            continue  # reached more cheaply since it was pushed
        cell = state // size
        heading = state - cell * size
        if np.int64(cell) == goal_cell and (goal_heading < 0 or np.int64(heading) == goal_heading):
            return np.int64(state), length, expansions
        if graph.size > 0 and graph[state] & LEAF:
            continue
        expansions += 1
        if expansions % PERIOD == 0 and stop[0]:
            return -2, np.inf, expansions
        begin = first[heading]
        for motion in range(begin, first[heading + np.uint64(1)]):
            reached = np.uint64(np.int64(state) + step[motion])
            longer = length + cost[np.uint64(motion)]
            # Rounding must not decide between equal ways: the first one found stays.
            if came[reached] and longer >= costs[reached] - 1e-9:
                continue
            if not is_free(free, state, octets, motion - begin):
                continue
            bound = least_cost(field, per_step, per_cell, np.int64(reached // size), width, goal_x, goal_y)
            if not bound < np.inf:
                continue
            came[reached], costs[reached] = motion + 1, longer
            if count == room:
                room *= 2
                more_totals, more_lengths, more_states = np.empty(room), np.empty(room), np.empty(room, np.uint32)
                more_totals[:count], more_lengths[:count], more_states[:count] = totals, lengths, states
                totals, lengths, states = more_totals, more_lengths, more_states
            push(totals, lengths, states, count, longer + bound, longer, np.int64(reached))
            count += 1
    return -1, np.inf, expansions
