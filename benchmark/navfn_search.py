"""A plain re-statement of the search of Nav2's NavFn, whose own package is not to be had as a wheel.

A wave of potentials spreads from the goal in rounds, each with a threshold: cells below it now, the others in the next
round. A cell's potential is interpolated between its lower neighbours in x and in y, as if the wave came at an angle,
with a polynomial in place of the square root; so it is no length of a path on the grid. The wave ends in the round that
reaches the start. The way down goes by the least of eight potentials.
"""
import numpy as np
from numba import f4, i8, njit, u1

NEUTRAL = 50.0
FAR = 1e10


@njit(i8(f4[::1], u1[::1], i8, i8, i8), nogil=True)
def spread_potential(potential, blocked, width, start, goal):
    """Fill the potential around the goal until the start has one; return how many cells were updated."""
    steps = np.array([1, -1, width, -width])
    now, near = np.empty(blocked.size, np.int64), np.empty(blocked.size, np.int64)
    far = np.empty(blocked.size, np.int64)
    pending = blocked.copy()
    potential[:] = FAR
    potential[goal] = 0.0
    now_count = near_count = far_count = updates = 0
    for step in steps:
        if not pending[goal + step]:
            now[now_count] = goal + step
            now_count += 1
            pending[goal + step] = 1
    threshold = NEUTRAL
    while True:
        if now_count == 0:
            if near_count == 0:
                if far_count == 0:
                    return updates
                threshold += 2.0 * NEUTRAL
                near, far = far, near
                near_count, far_count = far_count, 0
            now, near = near, now
            now_count, near_count = near_count, 0
        for i in range(now_count):
            pending[now[i]] = 0
        for i in range(now_count):
            cell = now[i]
            updates += 1
            beside = min(potential[cell - 1], potential[cell + 1])
            along = min(potential[cell - width], potential[cell + width])
            low, difference = min(beside, along), abs(beside - along)
            if difference >= NEUTRAL:
                value = low + NEUTRAL
            else:
                d = difference / NEUTRAL
                value = low + NEUTRAL * (-0.2301 * d * d + 0.5307 * d + 0.7040)
            if value >= potential[cell]:
                continue
            potential[cell] = value
            for step in steps:
                neighbour = cell + step
                if not pending[neighbour] and potential[neighbour] > value + 0.7071 * NEUTRAL:
                    pending[neighbour] = 1
                    if value < threshold:
                        near[near_count] = neighbour
                        near_count += 1
                    else:
                        far[far_count] = neighbour
                        far_count += 1
        now_count = 0
        if potential[start] < FAR:
            return updates


@njit(i8[::1](f4[::1], u1[::1], i8, i8, i8), nogil=True)
def go_down(potential, blocked, width, start, goal):
    """Return the cells on the way down, without cutting corners; it ends early where all neighbours are higher."""
    steps = np.array([1, width, -1, -width, width + 1, width - 1, -width - 1, 1 - width])
    path = np.empty(blocked.size, np.int64)
    path[0], count, cell = start, 1, start
    while cell != goal:
        best = cell
        for move in range(8):
            neighbour = cell + steps[move]
            if move > 3 and (blocked[cell + steps[move - 4]] or blocked[cell + steps[(move - 3) % 4]]):
                continue
            if potential[neighbour] < potential[best]:
                best = neighbour
        if best == cell:
            break
        cell = path[count] = best
        count += 1
    return path[:count].copy()


def navfn_path(occupied, start, goal):
    """Return the path (N, 2) that NavFn's search finds between two cells."""
    blocked = np.pad(occupied.astype(np.uint8), 1, constant_values=1)
    width = blocked.shape[1]
    ends = [(y + 1) * width + x + 1 for x, y in (start, goal)]
    potential = np.empty(blocked.size, np.float32)
    spread_potential(potential, blocked.reshape(-1), width, *ends)
    path = go_down(potential, blocked.reshape(-1), width, *ends)
    return np.column_stack([path % width - 1, path // width - 1])
