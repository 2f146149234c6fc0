"""Inner loops of D*: the first field, and its repair where costs changed.

The repair is D* Lite (Koenig and Likhachev 2002). Each cell has a cost-to-go ``g`` and the value ``rhs`` that its
neighbours would give it; cells where the two differ wait in a heap, ordered by how long a path through them would be
at least. The repair ends as soon as no waiting cell can concern the robot. It differs from the paper in four points:

- The heuristic is smaller than the octile distance by one part in a million. A path's cells thus have strictly growing
  keys: one number orders the heap, ties included, and rounding never decides whether a cell must be looked at.
- ``g`` and ``rhs`` count as equal within rounding: the first field may come from a kernel that adds in another order.
- An entry whose cell has another key by now stays in the heap and is found out when it is popped. A waiting cell thus
  needs a new entry only if its key sinks.
- A cell that was blocked loses its value at once: no path leads through it any more.

All arrays are flat and have a border of blocked cells around the grid, so that no neighbour has to be tested for
lying outside: cell (x, y) has the index ``(y + 1) * width + x + 1``, with the ``width`` of the bordered grid.
Indices are unsigned, because numba would otherwise test each one for being negative; a step back is a number that
wraps around. An edge costs the mean of its two cells times its length. None of the functions holds the GIL.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, u1, u4, u8

from mobile_planning.grid.heap_kernels import drop_first, push, with_room
from mobile_planning.world.cost_to_go_kernels import (
    BLOCKED, CELLS, MOVE_X, MOVE_Y, SQRT2, UNREACHED, length_of, occupied_neighbours, spread)

HEURISTIC = 1.0 - 1e-6
ROUNDING = 1e-13

SETTLED, CAPPED, STOPPED = 0, 1, 2

QUEUE = (f8[::1], u4[::1], i8)
COSTS = types.Array(f8, 1, 'C', readonly=True)
ROWS = types.Array(f8, 2, 'C', readonly=True)


@njit(u8[::1](i8), nogil=True, cache=True)
def steps_of(width):
    """Return by how much each of the eight moves changes a cell's index."""
    return (MOVE_X + width * MOVE_Y).astype(np.uint64)


@njit(f8(COSTS, u8, u8, u8[::1], b1), nogil=True, cache=True)
def edge(costs, cell, move, steps, corner_cutting):
    """Return the cost of a move from a cell, inf if it is not allowed."""
    both = costs[cell] + costs[cell + steps[move]]
    if move < 4:
        return 0.5 * both
    if not corner_cutting:
        left, right = move & np.uint64(3), (move + np.uint64(1)) & np.uint64(3)
        if max(costs[cell + steps[left]], costs[cell + steps[right]]) == np.inf:
            return np.inf
    return 0.5 * SQRT2 * both


@njit(f8(COSTS, f8[::1], u8, u8[::1], b1, f8), nogil=True, cache=True)
def best_of_neighbours(costs, g, cell, steps, corner_cutting, enough):
    """Return the least edge cost plus neighbour's value of a cell, or the first that is at most ``enough``."""
    best = np.inf
    if costs[cell] == np.inf:
        return best
    for move in range(np.uint64(8)):
        value = g[cell + steps[move]]
        if value < best:
            best = min(best, value + edge(costs, cell, move, steps, corner_cutting))
            if best <= enough:
                break
    return best


@njit(b1(f8, f8), nogil=True, cache=True)
def differ(g, rhs):
    """Return whether two values, each possibly inf, differ by more than rounding."""
    return abs(g - rhs) > ROUNDING * min(g, rhs)


@njit(f8(u8, u8, u8, f8), nogil=True, cache=True)
def least_cost(cell, other, width, least):
    """Return a lower bound of the cost between two cells, where no cell costs less than ``least``."""
    run = abs(np.int64(cell % width) - np.int64(other % width))
    rise = abs(np.int64(cell // width) - np.int64(other // width))
    return least * HEURISTIC * (max(run, rise) + (SQRT2 - 1.0) * min(run, rise))


@njit(types.Tuple((f8, f8, i8))(COSTS), nogil=True, cache=True)
def cost_range(costs):
    """Return the least and the greatest finite cost, inf and 0 if all cells are blocked; and how many are not."""
    least, most, free = np.inf, 0.0, 0
    for cost in costs:
        least = min(least, cost)
        most = max(most, cost if cost < np.inf else 0.0)
        free += cost < np.inf
    return least, most, free


@njit(types.UniTuple(i8, 2)(f8[::1], f8[::1], COSTS, i8, i8, CELLS, f8, u1[::1], i8[::1]), nogil=True, cache=True)
def fill_uniform(g, rhs, costs, width, goal, moves, cost, stop, done):
    """Fill both fields where every free cell has the same cost.

    Returns how many cells reach the goal and how many of them have an occupied neighbour; -1 and 0 if stopped before.
    """
    states = g.view(np.int64)
    blocked = np.empty(g.size, np.uint8)
    for row in range(0, g.size, width):
        if stop[0]:  # memory that is touched for the first time can be slow
            return -1, 0
        for cell in range(row, row + width):
            blocked[cell] = costs[cell] == np.inf
            states[cell] = BLOCKED if blocked[cell] else UNREACHED
    around = occupied_neighbours(blocked.reshape(g.size // width, width), stop).reshape(g.size)
    if stop[0] or not spread(states, around, width, goal, moves, stop, done):
        return -1, 0
    reached = beside = 0
    for row in range(0, g.size, width):
        if stop[0]:
            return -1, 0
        for cell in range(row, row + width):
            state = states[cell]
            g[cell] = rhs[cell] = cost * length_of(state) if state >= 0 else np.inf
            reached += state >= 0
            beside += state >= 0 and around[cell] != 0
    return reached, beside


@njit(i8(f8[::1], f8[::1], COSTS, i8, i8, b1, u1[::1], i8[::1]), nogil=True, cache=True)
def fill_weighted(g, rhs, costs, width, goal, corner_cutting, stop, done):
    """Fill both fields by a Dijkstra search; return how many cells reach the goal, -1 if stopped before that."""
    steps, reached = steps_of(width), 0
    for row in range(0, g.size, width):
        if stop[0]:
            return -1
        g[row:row + width] = np.inf
    g[goal] = 0.0
    keys, cells = np.empty(1024), np.empty(1024, np.uint32)
    count, popped = push(keys, cells, 0, 0.0, goal), 0
    while count > 0:
        popped += 1
        if popped & 255 == 0 and stop[0]:
            return -1
        key, cell = keys[0], np.uint64(cells[0])
        count = drop_first(keys, cells, count)
        if key > g[cell]:
            continue
        reached += 1
        done[0] = reached
        keys, cells = with_room(keys, cells, count, 8)
        for move in range(np.uint64(8)):
            neighbour = cell + steps[move]
            value = key + edge(costs, cell, move, steps, corner_cutting)
            if value < g[neighbour]:
                g[neighbour] = value
                count = push(keys, cells, count, value, neighbour)
    for row in range(0, g.size, width):
        if stop[0]:
            return -1
        rhs[row:row + width] = g[row:row + width]
    return reached


@njit(types.Tuple((*QUEUE, f8))(
    f8[::1], u4[::1], i8, f8[::1], f8[::1], COSTS, i8[::1], i8, i8, i8, f8, f8, b1, u1[::1]), nogil=True, cache=True)
def enqueue_changes(
        keys, cells, count, g, rhs, costs, changed, goal, width, start, least, offset, corner_cutting, stop):
    """Bring ``rhs`` up to date around the changed cells and queue the cells that need repair.

    Every edge that a cell takes part in, also at a corner that it blocks, ends in its 3 x 3 neighbourhood. Returns the
    queue and the least value of a cell there; a count of -1 if stopped, and then only a new plan helps.
    """
    steps, goal_cell = steps_of(width), np.uint64(goal)
    concerned = np.empty(9 * changed.size, np.uint32)
    size, lowest = 0, np.inf
    for i in range(changed.size):
        if i & 1023 == 0 and stop[0]:
            return keys, cells, -1, lowest
        for move in range(9):
            cell = np.uint64(changed[i]) + (steps[move] if move < 8 else np.uint64(0))
            # A NaN marks what is already in the list.
            if cell != goal_cell and rhs[cell] == rhs[cell]:
                concerned[size] = cell
                size += 1
                rhs[cell] = np.nan
                lowest = min(lowest, g[cell])
        if costs[changed[i]] == np.inf and changed[i] != goal:
            g[changed[i]] = np.inf
    keys, cells = with_room(keys, cells, count, size)
    for i in range(size):
        if i & 1023 == 0 and stop[0]:
            return keys, cells, -1, lowest
        cell = np.uint64(concerned[i])
        rhs[cell] = best_of_neighbours(costs, g, cell, steps, corner_cutting, 0.0)
        if differ(g[cell], rhs[cell]):
            key = min(g[cell], rhs[cell]) + least_cost(cell, start, width, least) + offset
            count = push(keys, cells, count, key, cell)
    return keys, cells, count, lowest


@njit(i8(f8[::1], u4[::1], i8, f8[::1], f8[::1], i8, i8, f8, u1[::1]), nogil=True, cache=True)
def order_anew(keys, cells, count, g, rhs, width, start, least, stop):
    """Give each waiting cell one entry, with its key for a robot at ``start``, and return their count.

    The count is -1 if stopped, and then only a new plan helps.
    """
    kept = 0
    for i in range(count):
        cell = cells[i]
        value = rhs[cell]
        if value == value and differ(g[cell], value):
            keys[kept], cells[kept] = value, cell
            rhs[cell] = np.nan
            kept += 1
    for i in range(kept):
        rhs[cells[i]] = keys[i]
    for i in range(kept):
        if i & 1023 == 0 and stop[0]:
            return -1
        cell = cells[i]
        push(keys, cells, i, min(g[cell], rhs[cell]) + least_cost(cell, start, width, least), cell)
    return kept


@njit(types.Tuple((*QUEUE, f8, i8, i8))(
    f8[::1], u4[::1], i8, f8[::1], f8[::1], COSTS, i8, i8, f8, f8, b1, i8, u1[::1]), nogil=True, cache=True)
def repair(keys, cells, count, g, rhs, costs, width, start, least, offset, corner_cutting, cap, stop):
    """Repair the field until it is right on every best path from ``start``.

    Returns the queue, the least value that a cell had before or after it was changed, the outcome and the number of
    expansions.
    """
    steps, expansions, lowest = steps_of(width), 0, np.inf
    while count > 0 and keys[0] <= (offset + rhs[start]) * (1.0 + 10.0 * ROUNDING):
        if expansions >= cap:
            return keys, cells, count, lowest, CAPPED, expansions
        if stop[0]:
            return keys, cells, count, lowest, STOPPED, expansions
        cell = np.uint64(cells[0])
        old = g[cell]
        if not differ(old, rhs[cell]):
            count = drop_first(keys, cells, count)
            continue
        key = min(old, rhs[cell]) + least_cost(cell, start, width, least) + offset
        late = keys[0] < key
        count = drop_first(keys, cells, count)
        if late:
            count = push(keys, cells, count, key, cell)
            continue
        expansions += 1
        keys, cells = with_room(keys, cells, count, 9)
        lower = old > rhs[cell]
        g[cell] = rhs[cell] if lower else np.inf
        through = min(old, rhs[cell])
        lowest = min(lowest, through)
        for move in range(np.uint64(8)):
            neighbour = cell + steps[move]
            before = rhs[neighbour]
            # Spares most neighbours the rest: no way to them leads through this cell. The goal is never concerned.
            if through > before:
                continue
            value = through + edge(costs, cell, move, steps, corner_cutting)
            if lower:
                if not value < before:
                    continue
                rhs[neighbour] = value
            else:
                # Only what may have stood on this cell's old value loses it.
                if value == np.inf or value > before * (1.0 + ROUNDING):
                    continue
                rhs[neighbour] = best_of_neighbours(costs, g, neighbour, steps, corner_cutting, before)
            value = min(g[neighbour], rhs[neighbour])
            is_waiting = differ(g[neighbour], before) and value >= min(g[neighbour], before)
            if differ(g[neighbour], rhs[neighbour]) and not is_waiting:
                key = value + least_cost(neighbour, start, width, least) + offset
                count = push(keys, cells, count, key, neighbour)
        if not lower and rhs[cell] < np.inf:
            key = rhs[cell] + least_cost(cell, start, width, least) + offset
            count = push(keys, cells, count, key, cell)
    return keys, cells, count, lowest, SETTLED, expansions


@njit(types.Tuple((i8, b1, i8[::1]))(ROWS, f8[::1], b1[:, ::1]), nogil=True, cache=True)
def set_costs(rows, costs, blocked):
    """Set the costs of rows (x, y, cost) in order.

    Returns the first row that is no cell with a positive cost, and then nothing is set, or -1; whether a cost became
    another; and the indices of the cells.
    """
    height, width = blocked.shape
    changed, is_new = np.empty(len(rows), np.int64), False
    for i in range(len(rows)):
        x, y = rows[i, 0], rows[i, 1]
        if not (0 <= x < width and 0 <= y < height and x == np.floor(x) and y == np.floor(y) and rows[i, 2] > 0.0):
            return i, False, changed
    for i in range(len(rows)):
        x, y, cost = int(rows[i, 0]), int(rows[i, 1]), rows[i, 2]
        changed[i] = (y + 1) * (width + 2) + x + 1
        is_new = is_new or costs[changed[i]] != cost
        costs[changed[i]] = cost
        blocked[y, x] = cost == np.inf
    return -1, is_new, changed
