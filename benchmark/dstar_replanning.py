"""D* after a change side by side with planning anew: ``python -m benchmark.dstar_replanning``.

On each map a plan is made, a block of cells is blocked on the path, and the time is taken from the update until the
robot knows its next step, and from the update to the whole new path; then the block is removed again, and so on;
medians. The fastest ways to plan anew are timed between: this package's cost-to-go field where all cells cost the same,
else D*'s own full plan; for the ratio of the paths with the way down it. A ratio is their time over the repair's. The
error is the largest relative difference of the path's cost from scipy's Dijkstra on an explicit graph.

The second table has smaller maps, with the D* of roboticstoolbox-python 1.5.0, scipy's Dijkstra and scikit-image's
MCP_Geometric; these need the packages. The toolbox's time is that between two calls of the sensor, so it has no path in
it; its excess is that of the path the robot takes in the end, in parts of the best one. The third table looks for the
worst change: what a query may take at most, in plans anew.
"""
import argparse
import platform
import time
from importlib import metadata, util

import numpy as np
from scipy.sparse.csgraph import dijkstra

from benchmark.cost_to_go import empty, scattered, serpentine, timed
from benchmark.dijkstra import cost_field, graph_of
from mobile_planning.grid.dstar import DstarPlanner
from mobile_planning.world.cost_to_go import cost_to_go, descend, warm_up

GOAL = (1, 1)
PACKAGES = ('numpy', 'numba', 'scipy', 'scikit-image', 'roboticstoolbox-python')


def unit(occupied):
    """Return costs 1 and inf."""
    return np.where(occupied, np.inf, 1.0)


def weighted(occupied):
    """Return whole costs from 1 to 9, drawn at random, and inf."""
    costs = np.where(occupied, np.inf, np.random.default_rng(1).integers(1, 10, occupied.shape))
    costs[GOAL[1], GOAL[0]] = 1.0
    return costs


def block_at(costs, cell, side, keep):
    """Return the rows that block a square around a cell, and those that free it again, but for the cells to keep."""
    height, width = costs.shape
    x, y = np.meshgrid(*[np.arange(c - side // 2, c - side // 2 + side) for c in cell])
    inside = (x >= 0) & (x < width) & (y >= 0) & (y < height)
    inside &= ~np.isin(y * width + x, [b * width + a for a, b in keep])
    x, y = x[inside], y[inside]
    return [list(zip(x.tolist(), y.tolist(), cost.tolist())) for cost in (np.full(x.shape, np.inf), costs[y, x])]


def cases(path):
    """Yield the changes that are timed: a name, the cell, and the side of the block."""
    yield '1 cell, 3 ahead', path[3], 1
    yield '10x10, 8 ahead', path[8], 10
    yield '10x10, half way', path[len(path) // 2], 10
    yield '10x10, near goal', path[-15], 10


def relative_error(planner, start, cost):
    """Return how far a cost is from that of scipy's Dijkstra on the planner's map."""
    exact = cost_field(planner.costmap, planner.goal)[start[1], start[0]]
    return abs(cost - exact) / exact


def time_repair(planner, start, block, freed, answer):
    """Return the time from the update with a block to the answer [s], and the answer; the block is removed before."""
    planner.update(freed)
    planner.query(start)
    return timed(lambda: (planner.update(block), answer(start))[1])


def compare(name, costs, repeats):
    """Print the rows of one map."""
    planner = DstarPlanner(costs, goal=GOAL)
    planner.plan()
    reached = np.argwhere(np.isfinite(planner.distancemap))
    height, width = costs.shape
    start = tuple(reached[np.argmin(np.abs(reached - (0.7 * height, 0.95 * width)).sum(axis=1))][::-1].tolist())
    path, _ = planner.query(start)
    is_uniform = len(np.unique(costs[np.isfinite(costs)])) == 1
    other = None if is_uniform else DstarPlanner(costs, goal=GOAL)

    def plan_anew():
        if is_uniform:
            return cost_to_go(np.isinf(planner.costmap), GOAL)
        other.plan()

    def path_anew(field):
        return descend(field, start, GOAL) if is_uniform else other.query(start)

    path_anew(plan_anew())
    for case, cell, side in cases(path):
        block, freed = block_at(costs, cell, side, (GOAL, start))
        times = []
        for _ in range(repeats):
            to_step, _ = time_repair(planner, start, block, freed, planner.next)
            to_path, (_, status) = time_repair(planner, start, block, freed, planner.query)
            to_field, field = timed(plan_anew)
            times.append((to_step, to_path, to_field, to_field + timed(lambda: path_anew(field))[0]))
        error = relative_error(planner, start, status.cost)
        planner.update(freed)
        planner.query(start)
        to_step, to_path, field_anew, all_anew = np.median(times, axis=0)
        print(f'{width:>5} {name:<20} {case:<17} {to_step * 1e6:>9.0f} {to_path * 1e6:>9.0f} {status.expansions:>9} '
              f'{"yes" if status.full_replan else "no":>4} {field_anew * 1e3:>9.2f} {field_anew / to_step:>8.1f}x '
              f'{all_anew / to_path:>8.1f}x {error:>9.1e}', flush=True)


def toolbox_replan(costs, start, block):
    """Return the time of the toolbox's replanning and the relative excess of the path its robot takes, and its plan."""
    from roboticstoolbox import DstarPlanner as ToolboxPlanner

    planner = ToolboxPlanner(np.array(costs), goal=GOAL)
    plan_time, _ = timed(lambda: planner.plan())
    calls = []

    def sensor(cell):
        calls.append(time.perf_counter())
        return block if len(calls) == 1 else []

    path, _ = planner.query(start=start, sensor=sensor)
    changed = np.array(costs)
    for x, y, cost in block:
        changed[y, x] = cost
    path = np.rint(path).astype(int)
    lengths = np.hypot(*np.diff(path, axis=0).T)
    along = changed[path[:, 1], path[:, 0]]
    driven = (lengths * (along[1:] + along[:-1]) / 2).sum()
    return plan_time, calls[1] - calls[0], driven / cost_field(changed, GOAL)[start[1], start[0]] - 1


def compare_with_packages(name, costs, repeats):
    """Print the row of one map, with the other packages."""
    planner = DstarPlanner(costs, goal=GOAL)
    planner.plan()
    field = planner.distancemap
    y, x = np.argwhere(np.isfinite(field))[-1].tolist()
    start = (x, y)
    path, _ = planner.query(start)
    block, freed = block_at(costs, path[12], 5, (GOAL, start))
    runs = [time_repair(planner, start, block, freed, planner.query) for _ in range(repeats)]
    took = np.median([seconds for seconds, _ in runs])
    error = relative_error(planner, start, runs[-1][1][1].cost)
    changed = planner.costmap
    graph = graph_of(changed)
    scipy_time = np.median([timed(lambda: dijkstra(graph, directed=False, indices=GOAL[1] * len(costs[0]) + GOAL[0]))[0]
                            for _ in range(3)])
    text = (f'{len(costs):>5} {name:<20} {took * 1e6:>8.0f} {error:>8.1e} '
            f'{scipy_time * 1e3:>9.1f} {scipy_time / took:>7.0f}x')
    if util.find_spec('skimage'):
        from skimage.graph import MCP_Geometric

        mcp = MCP_Geometric(np.where(np.isinf(changed), -1.0, changed))
        mcp_time = np.median([timed(lambda: mcp.find_costs([GOAL[::-1]]))[0] for _ in range(3)])
        text += f' {mcp_time * 1e3:>9.1f} {mcp_time / took:>7.0f}x'
    if util.find_spec('roboticstoolbox'):
        plan_time, replan_time, excess = toolbox_replan(costs, start, block)
        text += f' {plan_time * 1e3:>9.0f} {replan_time * 1e3:>9.2f} {replan_time / took:>7.1f}x {excess:>9.1e}'
    print(text, flush=True)


def processor_time(function):
    """Return the processor time of a call [s]: that of other processes is not in it."""
    began = time.process_time()
    function()
    return time.process_time() - began


def query_after(planner, start, rows):
    """Return the processor time of the query after an update [s], whether or not it finds a path."""
    planner.update(rows)

    def query():
        try:
            planner.query(start)
        except RuntimeError:
            pass  # the block closed the only way

    return processor_time(query)


def worst_query(costs, tries, max_expansions):
    """Return the longest query after random changes on the path, in plans anew.

    A change counts with the least of five times, for other processes disturb single ones.
    """
    random = np.random.default_rng(5)
    planner = DstarPlanner(costs, goal=GOAL, max_expansions=max_expansions)
    planner.plan()
    y, x = np.argwhere(np.isfinite(planner.distancemap))[-1].tolist()
    start = (x, y)
    path, _ = planner.query(start)
    plan_time = np.median([processor_time(lambda: (planner.plan(), planner.query(start))) for _ in range(15)])
    worst = 0.0
    for _ in range(tries):
        block, freed = block_at(costs, path[random.integers(len(path))], random.integers(1, 40), (GOAL, start))
        times = [[query_after(planner, start, rows) for rows in (block, freed)] for _ in range(5)]
        worst = max(worst, np.min(times, axis=0).max() / plan_time)
    return worst


def look_for_the_worst(name, costs, tries):
    """Print the longest query over random changes on the path, in plans anew, with the cap and without."""
    print(f'{len(costs):>5} {name:<20} {worst_query(costs, tries, None):>9.2f}x '
          f'{worst_query(costs, tries, 10 ** 12):>11.2f}x', flush=True)


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--sides', type=int, nargs='+', default=[512, 1024], help='cells along each side')
    parser.add_argument('--repeats', type=int, default=15, help='runs of each, alternating')
    parser.add_argument('--tries', type=int, default=40, help='changes in the search for the worst')
    options = parser.parse_args()
    versions = [f'{package} {metadata.version(package)}' for package in PACKAGES
                if package in {item.metadata['Name'] for item in metadata.distributions()}]
    print(f'Python {platform.python_version()}, {", ".join(versions)}\n')
    warm_up()
    maps = [(grid.__name__, lambda side, grid=grid: unit(grid(side))) for grid in (empty, scattered, serpentine)]
    maps += [(f'{grid.__name__}, costs 1-9', lambda side, grid=grid: weighted(grid(side)))
             for grid in (empty, scattered)]
    print(f'{"side":>5} {"map":<20} {"block":<17} {"step [us]":>9} {"path [us]":>9} {"expanded":>9} {"full":>4} '
          f'{"anew [ms]":>9} {"ratio":>9} {"ratio":>9} {"error":>9}')
    for side in options.sides:
        for name, make in maps:
            compare(name, make(side), options.repeats)
    print(f'\n{"side":>5} {"map":<20} {"D* [us]":>8} {"error":>8} {"scipy[ms]":>9} {"ratio":>8} {"MCP [ms]":>9} '
          f'{"ratio":>8} {"toolbox plan, replan [ms]":>9} {"ratio":>8} {"excess":>9}')
    for name, make in maps:
        for side in (64, 128):
            compare_with_packages(name, make(side), options.repeats)
    print(f'\n{"side":>5} {"map":<20} {"worst/plan":>10} {"without cap":>12}')
    for name, make in maps:
        look_for_the_worst(name, make(options.sides[0]), options.tries)


if __name__ == '__main__':
    main()
