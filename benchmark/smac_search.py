"""A plain re-statement of the search of Nav2's Smac 2D, whose own package is not to be had as a wheel.

A* on eight neighbours with a binary heap and the straight distance as its estimate; cells are expanded once.
Like Smac 2D it looks only at whether a cell is free, so that it may cut corners unless told otherwise.
"""
import numpy as np
from numba import b1, i8, njit, u1

from mobile_planning.grid.heap_kernels import drop_first, push, with_room


@njit(i8[::1](u1[::1], i8, i8, i8, b1), nogil=True)
def smac_cells(blocked, width, start, goal, corner_cutting):
    """Return the cells from goal to start, none if there is no path."""
    steps = np.array([1, width, -1, -width, width + 1, width - 1, -width - 1, 1 - width])
    lengths = np.array([1.0] * 4 + [np.sqrt(2.0)] * 4)
    cost, parent = np.full(blocked.size, np.inf), np.full(blocked.size, -1)
    visited = np.zeros(blocked.size, np.uint8)
    keys, cells = np.empty(1024), np.empty(1024, np.uint32)
    cost[start] = 0.0
    count = push(keys, cells, 0, 0.0, start)
    while count > 0:
        cell = np.int64(cells[0])
        count = drop_first(keys, cells, count)
        if visited[cell]:
            continue
        visited[cell] = 1
        if cell == goal:
            break
        keys, cells = with_room(keys, cells, count, 8)
        for move in range(8):
            neighbour = cell + steps[move]
            if blocked[neighbour] or visited[neighbour]:
                continue
            if move > 3 and not corner_cutting and (
                    blocked[cell + steps[move - 4]] or blocked[cell + steps[(move - 3) % 4]]):
                continue
            value = cost[cell] + lengths[move]
            if value < cost[neighbour]:
                cost[neighbour], parent[neighbour] = value, cell
                away = np.hypot(neighbour % width - goal % width, neighbour // width - goal // width)
                count = push(keys, cells, count, value + away, neighbour)
    path = np.empty(blocked.size, np.int64)
    size, cell = 0, goal
    while cell >= 0 and visited[goal]:
        path[size] = cell
        size, cell = size + 1, parent[cell]
    return path[:size].copy()


def smac_path(occupied, start, goal, corner_cutting=False):
    """Return the path (N, 2) that Smac 2D's search finds between two cells."""
    blocked = np.pad(occupied.astype(np.uint8), 1, constant_values=1)
    width = blocked.shape[1]
    ends = [(y + 1) * width + x + 1 for x, y in (start, goal)]
    path = smac_cells(blocked.reshape(-1), width, *ends, corner_cutting)[::-1]
    return np.column_stack([path % width - 1, path // width - 1])
