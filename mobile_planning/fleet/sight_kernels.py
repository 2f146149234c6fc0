"""Inner loops of the guidance: lines of sight, and how much room there is along them.

All lengths and places are in cells of a lattice: node (x, y) of the (h, w) arrays lies at (x, y), row first in the
index. ``squared`` holds at each node the squared distance to the nearest thing occupied, or less. Between nodes a bound
follows: the distance d to any set makes d(p)^2 - |p|^2 concave, so on a piece of length l, at share t of it,
d^2 >= (1 - t) d_a^2 + t d_b^2 - t (1 - t) l^2, and likewise within a cell. Discs are rows (x, y, squared radius).

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL.
"""
import numpy as np
from numba import b1, f4, f8, njit, types

ROOM = types.Array(f4, 2, 'C', readonly=True)
POINTS = types.Array(f8, 2, 'C', readonly=True)

#: The shortest piece of a segment, what its square takes off the room between two ends, and the least squared room.
STEP = 0.5
BETWEEN = STEP**2 / 4 + 1e-9
LEAST = 1e-6


@njit(f8(ROOM, f8, f8), nogil=True, cache=True, inline='always')
def room_within(squared, x, y):
    """Return a lower bound of the squared distance from (x, y) in the lattice to what is occupied."""
    height, width = squared.shape
    column, row = min(int(x), width - 2), min(int(y), height - 2)
    tx, ty = x - column, y - row
    low = (1 - tx) * squared[row, column] + tx * squared[row, column + 1]
    high = (1 - tx) * squared[row + 1, column] + tx * squared[row + 1, column + 1]
    return max(0.0, (1 - ty) * low + ty * high - tx * (1 - tx) - ty * (1 - ty))


@njit(f8(ROOM, f8, f8), nogil=True, cache=True)
def room_at(squared, x, y):
    """Return a lower bound of the squared distance from (x, y) to what is occupied; 0 outside the lattice."""
    height, width = squared.shape
    return room_within(squared, x, y) if 0.0 <= x <= width - 1 and 0.0 <= y <= height - 1 else 0.0


@njit(f8(f8, f8, f8), nogil=True, cache=True, inline='always')
def least_between(at_a, at_b, length2):
    """Return the least squared room on a segment between places of the given squared rooms, or less."""
    share = min(1.0, max(0.0, (length2 + at_a - at_b) / (2 * length2)))
    return (1 - share) * at_a + share * at_b - share * (1 - share) * length2


@njit(b1(POINTS, f8, f8, f8, f8), nogil=True, cache=True)
def is_clear_of_discs(discs, ax, ay, bx, by):
    """Return whether the segment from a to b enters no disc further than its ends do."""
    ex, ey = bx - ax, by - ay
    length2 = ex * ex + ey * ey
    for i in range(len(discs)):
        px, py = discs[i, 0] - ax, discs[i, 1] - ay
        at_a = px * px + py * py
        at_b = (px - ex) ** 2 + (py - ey) ** 2
        share = min(1.0, max(0.0, (px * ex + py * ey) / length2)) if length2 > 0.0 else 0.0
        nearest = (px - share * ex) ** 2 + (py - share * ey) ** 2
        if nearest < min(discs[i, 2], at_a, at_b) - 1e-9:
            return False
    return True


@njit(b1(ROOM, POINTS, f8, f8, f8, f8, f8), nogil=True, cache=True)
def is_clear(squared, discs, ax, ay, bx, by, need):
    """Return whether the segment from a to b has the squared room ``need``, or that of its ends where they have less.

    It must lie inside the lattice and touch nothing occupied. The next sample is as far ahead as may prove the piece up
    to it; where it does not, one half as far is looked at. Each has ``BETWEEN`` to spare, so that a way does not graze
    what a robot that follows it would brush against.
    """
    at_a, at_b = room_at(squared, ax, ay), room_at(squared, bx, by)
    if at_a < BETWEEN or at_b < BETWEEN:
        return False
    need = max(LEAST, min(need, at_a - BETWEEN, at_b - BETWEEN))
    length = np.sqrt((bx - ax) ** 2 + (by - ay) ** 2)
    at, room = 0.0, at_a
    while at < length:
        piece = min(length - at, max(STEP, 2.0 * np.sqrt(max(0.0, room - need))))
        while True:
            share = (at + piece) / length
            ahead = room_within(squared, ax + share * (bx - ax), ay + share * (by - ay))
            if ahead >= need + BETWEEN - 1e-12 and least_between(room, ahead, piece * piece) >= need - 1e-9:
                break
            if piece <= STEP:
                return False
            piece = max(STEP, piece / 2)
        at += piece
        room = ahead
    return is_clear_of_discs(discs, ax, ay, bx, by)


@njit(b1(ROOM, POINTS, f8, f8, f8, f8, f8), nogil=True, cache=True)
def is_open(squared, discs, ax, ay, bx, by, radius):
    """Return whether the segment from a to b has room for the body, or all of it as much as a where a has less."""
    least = min(radius * radius + BETWEEN, room_at(squared, ax, ay))
    return room_at(squared, bx, by) >= least and is_clear(squared, discs, ax, ay, bx, by, radius * radius)
