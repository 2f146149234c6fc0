"""The cost-to-go of a cost map by scipy's Dijkstra on an explicit graph: the oracle of tests and benchmarks."""
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra


def graph_of(costs, corner_cutting=True):
    """Return the graph of all steps of a cost map, each listed in one direction, as a CSR array.

    A step costs the mean of its cells' costs times its length; no step enters a cell that costs inf, nor, without
    corner cutting, passes between two cells of which one does.
    """
    costs = np.asarray(costs, float)
    height, width = costs.shape
    free, cells = np.isfinite(costs), np.arange(costs.size).reshape(costs.shape)
    edges = []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (-1, 1)):
        here = np.s_[:height - dy, max(0, -dx):width - max(0, dx)]
        there = np.s_[dy:, max(0, dx):width + min(0, dx)]
        joined = free[here] & free[there]
        if dx and dy and not corner_cutting:
            joined &= free[here[0], there[1]] & free[there[0], here[1]]
        lengths = (costs[here][joined] + costs[there][joined]) / 2 * np.hypot(dx, dy)
        edges.append((cells[here][joined], cells[there][joined], lengths))
    rows, columns, lengths = map(np.concatenate, zip(*edges))
    return coo_array((lengths, (rows, columns)), shape=(costs.size,) * 2).tocsr()


def cost_field(costs, goal, corner_cutting=True):
    """Return the least cost from every cell to the goal (x, y), inf where there is no path."""
    costs = np.asarray(costs, float)
    if not np.isfinite(costs[goal[1], goal[0]]):
        return np.full(costs.shape, np.inf)
    index = goal[1] * costs.shape[1] + goal[0]
    return dijkstra(graph_of(costs, corner_cutting), directed=False, indices=index).reshape(costs.shape)


def cost_of_steps(costs, path, corner_cutting):
    """Return the cost of a path (N, 2) from the map alone, after checking that each of its steps is allowed."""
    total = 0.0
    for (x, y), (to_x, to_y) in zip(path[:-1], path[1:]):
        assert max(abs(to_x - x), abs(to_y - y)) == 1
        assert corner_cutting or (np.isfinite(costs[y, to_x]) and np.isfinite(costs[to_y, x]))
        total += np.hypot(to_x - x, to_y - y) * (costs[y, x] + costs[to_y, to_x]) / 2
    return total
