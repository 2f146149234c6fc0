"""Inner loops of A*, on cells that cost the same and on cells that do not.

Where all free cells cost the same the search passes on canonical moves only, with the states of `cost_to_go_kernels`:
one int64 per cell that counts straight and diagonal steps and names the directions in which optimal paths enter it.
Its queue is a ring of stacks, one for each half cell of the estimated path length. The last cell pushed is the first
taken, so that of equal ways the one nearest to the goal is followed first. Within a stack there is no order: a cell may
be expanded before its best path is known, and is expanded again when a better one arrives; the search ends when no
stack holds a cell whose estimate is below the length found.

Maps have a border of blocked cells and indices are unsigned, as in `dstar_kernels`.
"""
import numpy as np
from numba import b1, f8, i4, i8, njit, types, u1, u8

from mobile_planning.grid.dstar_kernels import COSTS, edge, least_cost, steps_of
from mobile_planning.grid.heap_kernels import drop_first, push, with_room
from mobile_planning.world.cost_to_go_kernels import (
    ALL_DIRECTIONS, CELLS, DIAGONAL, LOWEST_BIT, MOVE_X, MOVE_Y, SQRT2, STRAIGHT, length_of)

FLAT = types.Array(u1, 1, 'C', readonly=True)
# In a state: the cell waits in a stack. Path lengths leave this bit of the diagonal steps free.
WAITING = 1 << 35
# A move raises the estimate by at most 2 sqrt(2), so that it never goes round the ring.
STACKS = 8


@njit(u1(FLAT, u8, u8[::1]), nogil=True, cache=True)
def blocked_around(blocked, cell, steps):
    """Return the mask of a cell's blocked neighbours."""
    mask = np.uint8(0)
    for move in range(np.uint64(8)):
        mask |= blocked[cell + steps[move]] << move
    return mask


@njit(f8(i8, i8), nogil=True, cache=True)
def octile(run, rise):
    """Return the length of the shortest path on an empty map to a cell that lies so far in x and in y."""
    run, rise = abs(run), abs(rise)
    return max(run, rise) + (SQRT2 - 1.0) * min(run, rise)


@njit(i4[::1](i4[::1], i8), nogil=True, cache=True)
def doubled(numbers, count):
    """Return a copy of the first ``count`` numbers with room for as many again."""
    grown = np.empty(2 * count, np.int32)
    grown[:count] = numbers[:count]
    return grown


@njit(i8(i8[::1], FLAT, i8, i8, i8, CELLS, u1[::1]), nogil=True, cache=True)
def search_uniform(states, blocked, width, start, goal, moves, stop):
    """Search until the shortest path to the goal is known; return the expansions, -1 if stopped before that.

    ``states`` is all 0 at first. The goal's stays 0 if no path leads there.
    """
    steps, end = steps_of(width), np.uint64(goal)
    heads = np.full(STACKS, -1, np.int32)
    # An entry of a stack: its cell and the entry below it.
    cells, below = np.empty(4096, np.int32), np.empty(4096, np.int32)
    count, waiting, expansions, now = 1, 1, 0, 0
    # The estimates that equal the first one, but for rounding, are within the first stack.
    end_x, end_y = goal % width, goal // width
    first = octile(start % width - end_x, start // width - end_y) - 0.1
    states[start] = ALL_DIRECTIONS | WAITING
    cells[0], below[0], heads[0] = start, -1, 0
    found = np.inf
    while waiting > 0 and first + 0.5 * now < found:
        entry = heads[now % STACKS]
        if entry < 0:
            now += 1
            continue
        heads[now % STACKS] = below[entry]
        waiting -= 1
        cell = np.uint64(cells[entry])
        state = states[cell]
        if not state & WAITING:
            continue  # expanded from a better entry
        state ^= WAITING
        states[cell] = state
        run = np.int64(cell % np.uint64(width)) - end_x
        rise = np.int64(cell // np.uint64(width)) - end_y
        if length_of(state) + octile(run, rise) >= found:
            continue
        expansions += 1
        if expansions & 1023 == 0 and stop[0]:
            return -1
        if count + 8 > cells.size:
            cells, below = doubled(cells, cells.size), doubled(below, below.size)
        out = np.int64(moves[np.uint64(state & ALL_DIRECTIONS), np.uint64(blocked_around(blocked, cell, steps))])
        while out:
            move = np.uint64(LOWEST_BIT[out])
            out &= out - 1
            neighbour = cell + steps[move]
            reached = (state & ~ALL_DIRECTIONS) + (DIAGONAL if move > 3 else STRAIGHT)
            length, old = length_of(reached), states[neighbour]
            if old:
                old_length = length_of(old & ~WAITING)
                if length > old_length:
                    continue
                if length == old_length:
                    reached |= old & ALL_DIRECTIONS
                    if old & (WAITING | np.int64(1) << np.int64(move)):
                        # It will be expanded, or was, with this direction among the others.
                        states[neighbour] = old | np.int64(1) << np.int64(move)
                        continue
            states[neighbour] = reached | np.int64(1) << np.int64(move) | WAITING
            estimate = length + octile(run + MOVE_X[move], rise + MOVE_Y[move])
            if neighbour == end:
                found = length
            stack = max(now, int(2.0 * (estimate - first))) % STACKS
            cells[count], below[count] = neighbour, heads[stack]
            heads[stack] = count
            count += 1
            waiting += 1
    return expansions


@njit(i8[:, ::1](i8[::1], i8, i8, i8), nogil=True, cache=True)
def trace_back(states, width, start, goal):
    """Return the cells (N, 2) of the path that was found, from start to goal."""
    steps = steps_of(width)
    state = states[goal]
    size = (state >> 36) + (state >> 8 & (1 << 27) - 1) + 1
    path = np.empty((size, 2), np.int64)
    cell = np.uint64(goal)
    for i in range(size - 1, -1, -1):
        path[i, 0], path[i, 1] = np.int64(cell) % width - 1, np.int64(cell) // width - 1
        if i > 0:
            cell -= steps[np.uint64(LOWEST_BIT[np.uint64(states[cell] & ALL_DIRECTIONS)])]
    return path


@njit(i8(f8[::1], COSTS, i8, i8, i8, f8, b1, u1[::1]), nogil=True, cache=True)
def search_weighted(g, costs, width, start, goal, least, corner_cutting, stop):
    """Search until the least cost to the goal is known; return the expansions, -1 if stopped before that.

    ``g`` becomes the cost from the start, inf where the search did not come.
    """
    steps = steps_of(width)
    for row in range(0, g.size, width):
        if stop[0]:  # memory that is touched for the first time can be slow
            return -1
        g[row:row + width] = np.inf
    g[start] = 0.0
    keys, cells = np.empty(1024), np.empty(1024, np.uint32)
    count = push(keys, cells, 0, least_cost(start, goal, width, least), start)
    expansions = 0
    while count > 0 and keys[0] < g[goal]:
        key, cell = keys[0], np.uint64(cells[0])
        count = drop_first(keys, cells, count)
        if key > (g[cell] + least_cost(cell, goal, width, least)) * (1.0 + 1e-14):
            continue
        expansions += 1
        if expansions & 1023 == 0 and stop[0]:
            return -1
        keys, cells = with_room(keys, cells, count, 8)
        for move in range(np.uint64(8)):
            neighbour = cell + steps[move]
            value = g[cell] + edge(costs, cell, move, steps, corner_cutting)
            if value < g[neighbour]:
                g[neighbour] = value
                count = push(keys, cells, count, value + least_cost(neighbour, goal, width, least), neighbour)
    return expansions
