"""Inner loops of the cost-to-go field and of the paths read from it.

The field is a Dijkstra search with two tricks. Its queue is a ring of three buckets of width 1: no edge is shorter, so
the cells of one bucket cannot improve each other and need no order. And a cell passes on only the moves that continue
a *canonical* path: a move is dropped when a way around the cell is shorter, or as long with its diagonal first (Harabor
and Grastien 2011, Sturtevant and Rabin 2016). One or two neighbours remain instead of eight. Where several optimal
paths meet in a cell it passes on the moves of all of them, which keeps the field exact.

A cell's state is one int64, ``straight << 36 | diagonal << 8 | directions``: how many straight and diagonal steps lead
to it, and the set of directions in which optimal paths enter it. The length ``straight + diagonal * sqrt(2)`` thus
never depends on the order of additions, and equal lengths are equal floats.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL. Indices are cast to unsigned integers because numba would otherwise test each one for being
negative.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, u1, u4

# Arrays that are only read may be read-only.
CELLS = types.Array(u1, 2, 'C', readonly=True)
CELLS_IN_A_ROW = types.Array(u1, 1, 'C', readonly=True)
FIELD = types.Array(f8, 2, 'C', readonly=True)
PATH = types.Array(i8, 2, 'C', readonly=True)

SQRT2 = np.sqrt(2.0)

# The eight moves, straight ones first; bit i of every mask stands for move i.
MOVE_X = np.array([1, 0, -1, 0, 1, -1, -1, 1])
MOVE_Y = np.array([0, 1, 0, -1, 1, 1, -1, -1])
NUMBER_OF_BITS = np.array([mask.bit_count() for mask in range(256)], dtype=np.uint8)
LOWEST_BIT = np.array([0] + [(mask & -mask).bit_length() - 1 for mask in range(1, 256)], dtype=np.uint8)

STRAIGHT = 1 << 36
DIAGONAL = 1 << 8
COUNT = (1 << 28) - 1
# What each move adds to a state without directions.
ADDED_BY = np.array([(STRAIGHT if move < 4 else DIAGONAL) | 1 << move for move in range(8)])
ALL_DIRECTIONS = 255
# Both decode to a length beyond any path's.
UNREACHED = -1
BLOCKED = -2


@njit(b1(CELLS, i8, i8, i8, i8, b1, b1), nogil=True, cache=True)
def is_legal(occupied, x, y, to_x, to_y, diagonals, corner_cutting):
    """Return whether a robot in cell (x, y) may step to the neighbour (to_x, to_y)."""
    height, width = occupied.shape
    if to_x < 0 or to_y < 0 or to_x >= width or to_y >= height or occupied[to_y, to_x]:
        return False
    if to_x == x or to_y == y:
        return True
    return diagonals and (corner_cutting or not (occupied[y, to_x] or occupied[to_y, x]))


@njit(b1(CELLS, i8, i8, b1, b1), nogil=True, cache=True)
def is_canonical(block, into, out, diagonals, corner_cutting):
    """Return whether move ``out`` from the centre of a 3 x 3 block continues a canonical path that came by ``into``."""
    start_x, start_y = 1 - MOVE_X[into], 1 - MOVE_Y[into]
    end_x, end_y = 1 + MOVE_X[out], 1 + MOVE_Y[out]
    if (start_x == end_x and start_y == end_y) or not is_legal(block, 1, 1, end_x, end_y, diagonals, corner_cutting):
        return False
    length = (SQRT2 if into > 3 else 1.0) + (SQRT2 if out > 3 else 1.0)
    for first in range(8):
        x, y = start_x + MOVE_X[first], start_y + MOVE_Y[first]
        if (x == 1 and y == 1) or not is_legal(block, start_x, start_y, x, y, diagonals, corner_cutting):
            continue
        around = SQRT2 if first > 3 else 1.0
        if x != end_x or y != end_y:
            if abs(end_x - x) > 1 or abs(end_y - y) > 1:
                continue
            if not is_legal(block, x, y, end_x, end_y, diagonals, corner_cutting):
                continue
            around += SQRT2 if x != end_x and y != end_y else 1.0
        # Of equal ways the one with its diagonal first stays; without diagonals the one with its x move first.
        ahead = (first > 3 and into <= 3) if diagonals else (first % 2 == 0 and into % 2 == 1)
        if around < length - 0.1 or (around < length + 0.1 and ahead):
            return False
    return True


@njit(u1[:, ::1](b1, b1), nogil=True, cache=True)
def canonical_moves(diagonals, corner_cutting):
    """Return masks (256, 256) of the moves a cell passes on, by [directions that enter it, occupied neighbours]."""
    moves = np.zeros((256, 256), np.uint8)
    block = np.zeros((3, 3), np.uint8)
    for around in range(256):
        for i in range(8):
            block[1 + MOVE_Y[i], 1 + MOVE_X[i]] = around >> i & 1
        for into in range(8):
            # The path came from there, whatever the pattern says.
            came_x, came_y = 1 - MOVE_X[into], 1 - MOVE_Y[into]
            kept, block[came_y, came_x] = block[came_y, came_x], 0
            for out in range(8):
                if is_canonical(block, into, out, diagonals, corner_cutting):
                    moves[1 << into, around] |= 1 << out
            block[came_y, came_x] = kept
    for directions in range(1, 256):
        lowest = directions & -directions
        for around in range(256):
            moves[directions, around] = moves[directions - lowest, around] | moves[lowest, around]
    return moves


@njit(u1[:, ::1](CELLS, u1[::1]), nogil=True, cache=True)
def occupied_neighbours(occupied, stop):
    """Return each cell's mask of occupied neighbours; beyond the border all is occupied. Unfinished if stopped."""
    height, width = occupied.shape
    masks = np.empty((height, width), np.uint8)
    below, here, above = np.ones(width + 2, np.uint8), np.ones(width + 2, np.uint8), np.ones(width + 2, np.uint8)
    above[1:-1] = occupied[0]
    for y in range(height):
        if stop[0]:
            break
        below, here, above = here, above, below
        if y + 1 < height:
            above[1:-1] = occupied[y + 1]
        else:
            above[:] = 1
        mask = masks[y]
        for x in range(width):
            mask[x] = (here[x + 2] | above[x + 1] << 1 | here[x] << 2 | below[x + 1] << 3
                       | above[x + 2] << 4 | above[x] << 5 | below[x] << 6 | below[x + 2] << 7)
    return masks


@njit(f8(i8), nogil=True, cache=True)
def length_of(state):
    """Return the path length that a state stands for, in cells."""
    return (state >> 36) + (state >> 8 & COUNT) * SQRT2


@njit(u4[::1](u4[::1], i8, i8), nogil=True, cache=True)
def with_room(queue, count, more):
    """Return the queue, grown if fewer than ``more`` places are free behind its ``count`` entries."""
    if count + more <= queue.size:
        return queue
    grown = np.empty(2 * (count + more), np.uint32)
    grown[:count] = queue[:count]
    return grown


@njit(i8(i8[::1], CELLS_IN_A_ROW, CELLS, i8, u4[::1], i8, u1[::1]), nogil=True, cache=True)
def choose_moves(states, around, moves, bucket, cells, count, outs):
    """Write to ``outs`` the mask of moves that each cell of a bucket passes on, return the number of moves in all.

    The cells that pass on none are dropped from ``cells``; so are those that were improved since they were pushed,
    and done in an earlier bucket.
    """
    kept = total = 0
    for i in range(count):
        cell = cells[i]
        state = states[np.uint64(cell)]
        out = np.int64(moves[np.uint64(state & ALL_DIRECTIONS), np.uint64(around[np.uint64(cell)])])
        out = out if length_of(state) >= bucket else 0
        cells[np.uint64(kept)], outs[np.uint64(kept)] = cell, out
        kept += 1 if out else 0
        total += NUMBER_OF_BITS[np.uint64(out)]
    return total


@njit(types.UniTuple(i8, 2)(i8[::1], i8[::1], i8, u4[::1], u1[::1], i8, u4[::1], i8, u4[::1], i8),
      nogil=True, cache=True)
def offer_paths(states, step, bucket, cells, outs, total, near, near_count, far, far_count):
    """Offer each neighbour that ``outs`` names the path by way of its cell, return the counts of the two queues.

    A neighbour is pushed if the offer moves it into another bucket. All ``total`` moves are one loop, and what becomes
    of an offer is arithmetic: on a cluttered map the processor would guess the number of a cell's moves and the queue
    wrong half of the time.
    """
    at, left = 0, np.int64(outs[0])
    for _ in range(total):
        cell, move = np.uint64(cells[np.uint64(at)]), np.uint64(LOWEST_BIT[np.uint64(left)])
        left &= left - 1
        at += 1 if left == 0 else 0
        # A guess that can fail, but to wait for this load in each round costs more.
        left = left if left else np.int64(outs[np.uint64(at)])
        neighbour = np.uint64(np.int64(cell) + step[move])
        state, old = (states[cell] & ~ALL_DIRECTIONS) + ADDED_BY[move], states[neighbour]
        length, old_length = length_of(state), length_of(old)
        direction = state & ALL_DIRECTIONS if length <= old_length else 0
        states[neighbour] = (state if length < old_length else old) | direction
        is_near = length < bucket + 2
        # Written in any case, counted if pushed.
        near[np.uint64(near_count)] = far[np.uint64(far_count)] = neighbour
        near_count += is_near & (old_length >= bucket + 2)
        far_count += (not is_near) & (old_length >= bucket + 3)
    return near_count, far_count


@njit(b1(i8[::1], CELLS_IN_A_ROW, i8, i8, CELLS, u1[::1], i8[::1]), nogil=True, cache=True)
def spread(states, around, width, goal, moves, stop, done):
    """Search from the goal until every reachable cell has its shortest path; return False when stopped before that."""
    step = MOVE_X + width * MOVE_Y
    now, near, far = np.empty(1024, np.uint32), np.empty(1024, np.uint32), np.empty(1024, np.uint32)
    outs = np.empty(1024, np.uint8)
    now[0], now_count, near_count, far_count = goal, 1, 0, 0
    states[goal] = ALL_DIRECTIONS
    bucket = 0
    while now_count + near_count + far_count > 0:
        if stop[0]:
            return False
        done[0] += now_count
        if now_count >= outs.size:
            outs = np.empty(2 * now_count, np.uint8)
        total = choose_moves(states, around, moves, bucket, now, now_count, outs)
        # One place more than the offers need: those that push nothing are written behind the last entry. Asked here
        # because two calls cost as much as three cells, and a bucket in a corridor holds few.
        if near_count + total >= near.size:
            near = with_room(near, near_count, total + 1)
        if far_count + total >= far.size:
            far = with_room(far, far_count, total + 1)
        near_count, far_count = offer_paths(states, step, bucket, now, outs, total, near, near_count, far, far_count)
        now, near, far = near, far, now
        now_count, near_count, far_count = near_count, far_count, 0
        bucket += 1
    return True


@njit(types.void(i8[::1], CELLS_IN_A_ROW), nogil=True, cache=True)
def write_states(states, occupied):
    """Write the state in which each cell of a row starts."""
    for i in range(states.size):
        states[i] = BLOCKED if occupied[i] else UNREACHED


@njit(types.void(f8[::1], i8[::1]), nogil=True, cache=True)
def write_lengths(lengths, states):
    """Write the path length that each state of a row stands for: NaN where it is blocked, inf where unreached."""
    for i in range(lengths.size):
        state = states[i]
        lost = np.inf if state == UNREACHED else np.nan
        lengths[i] = length_of(state) if state >= 0 else lost


@njit(b1(f8[:, ::1], CELLS, i8, i8, CELLS, u1[::1], i8[::1]), nogil=True, cache=True)
def fill_cost_to_go(field, occupied, goal_x, goal_y, moves, stop, done):
    """Fill ``field`` with the path length to the goal; return False when ``stop[0]`` was set before it was done.

    The cells that the search has passed are counted in ``done[0]``.
    """
    height, width = field.shape
    # The states lie in the field's own memory.
    states = field.reshape(field.size).view(np.int64)
    for y in range(height):
        if stop[0]:  # memory that is touched for the first time can be slow
            return False
        write_states(states[y * width:(y + 1) * width], occupied[y])
    around = occupied_neighbours(occupied, stop).reshape(field.size)
    if not spread(states, around, width, goal_y * width + goal_x, moves, stop, done):
        return False
    for y in range(height):
        if stop[0]:
            return False
        # From a copy: between arrays that share memory the compiler would go number by number.
        write_lengths(field[y], states[y * width:(y + 1) * width].copy())
    return True


@njit(i8[:, ::1](FIELD, i8, i8, i8, b1, i8), nogil=True, cache=True)
def descend_field(field, x, y, connectivity, corner_cutting, most_steps):
    """Return the path of least field value plus step length from (x, y) to value 0, or no row where it gets stuck."""
    height, width = field.shape
    # Each step is at least 1 long and takes at least as much off the value.
    path = np.empty((min(most_steps, int(field[y, x]) + 1) + 1, 2), np.int64)
    count = 0
    while True:
        path[count, 0], path[count, 1] = x, y
        count += 1
        if field[y, x] == 0.0 or count > most_steps:
            return path[:count].copy()
        best, best_cost = -1, np.inf
        for move in range(connectivity):
            to_x, to_y = x + MOVE_X[move], y + MOVE_Y[move]
            if to_x < 0 or to_y < 0 or to_x >= width or to_y >= height or not field[to_y, to_x] < field[y, x]:
                continue
            if move > 3 and not corner_cutting and (np.isnan(field[y, to_x]) or np.isnan(field[to_y, x])):
                continue
            cost = field[to_y, to_x] + (SQRT2 if move > 3 else 1.0)
            # Rounding must not decide between equal ways: the first in the list of moves wins.
            if cost < best_cost - 1e-8:
                best, best_cost = move, cost
        if best < 0:
            return path[:0].copy()
        x, y = x + MOVE_X[best], y + MOVE_Y[best]


@njit(b1(CELLS, i8, i8, i8, i8), nogil=True, cache=True)
def is_visible(occupied, x, y, to_x, to_y):
    """Return whether the segment between two cell centres touches no occupied cell, not even a corner of one."""
    height, width = occupied.shape
    if min(x, y, to_x, to_y) < 0 or max(x, to_x) >= width or max(y, to_y) >= height:
        return False
    run, rise = abs(to_x - x), abs(to_y - y)
    step_x, step_y = (1 if to_x > x else -1), (1 if to_y > y else -1)
    # Positive when the segment leaves the cell through a side in x, negative in y, zero through the corner.
    side = run - rise
    while x != to_x or y != to_y:
        if occupied[y, x]:
            return False
        if side == 0 and (occupied[y, x + step_x] or occupied[y + step_y, x]):
            return False
        across = side
        if across >= 0:
            x += step_x
            side -= 2 * rise
        if across <= 0:
            y += step_y
            side += 2 * run
    return not occupied[y, x]


@njit(i8[:, ::1](CELLS, PATH), nogil=True, cache=True)
def pull_string(occupied, path):
    """Return the points of the path that remain when each is joined to the last one it sees in a row."""
    kept = np.empty_like(path)
    if len(path) == 0:
        return kept
    kept[0] = path[0]
    count = 1
    for i in range(1, len(path) - 1):
        anchor, ahead = kept[count - 1], path[i + 1]
        if not is_visible(occupied, anchor[0], anchor[1], ahead[0], ahead[1]):
            kept[count] = path[i]
            count += 1
    if len(path) > 1:
        kept[count] = path[-1]
        count += 1
    return kept[:count].copy()
