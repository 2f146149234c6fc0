"""The cost-to-go field side by side with dijkstra3d and roboticstoolbox-python: ``python benchmark/cost_to_go.py``.

The same field of the same grids, 8-connected with corner cutting, by each package in turn in one run; medians of
alternating runs. A ratio is the peer's time over ours. The error is the largest difference [cells] from scipy's
Dijkstra on an explicit graph, whose own sums of floats drift by up to 1e-9.

Wants dijkstra3d and roboticstoolbox-python 1.5.0 beside this package's own requirements; what is missing is named and
left out. The toolbox takes seconds, so it runs once, and not on serpentines beyond 512 x 512, where it would take many
minutes.
"""
import argparse
import platform
import time
from importlib import metadata, util

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from mobile_planning.world.cost_to_go import cost_to_go, warm_up

GOAL = (1, 1)
PEERS = {'dijkstra3d': 'dijkstra3d', 'roboticstoolbox-python': 'roboticstoolbox'}


def empty(side):
    """Return a grid without obstacles."""
    return np.zeros((side, side), bool)


def scattered(side):
    """Return a grid of which 20 % is occupied at random."""
    occupied = np.random.default_rng(0).random((side, side)) < 0.2
    occupied[GOAL[1], GOAL[0]] = False
    return occupied


def serpentine(side):
    """Return a grid with a wall every 16 columns, open at the top and the bottom in turn."""
    occupied = empty(side)
    for i, x in enumerate(range(15, side - 1, 16)):
        occupied[:, x] = True
        occupied[0 if i % 2 else side - 1, x] = False
    return occupied


def exact_field(occupied):
    """Return the field by scipy's Dijkstra."""
    height, width = occupied.shape
    cells = np.arange(occupied.size).reshape(height, width)
    edges = []
    for dx, dy in ((1, 0), (0, 1), (1, 1), (-1, 1)):
        here = np.s_[:height - dy, max(0, -dx):width - max(0, dx)]
        there = np.s_[dy:, max(0, dx):width + min(0, dx)]
        joined = ~occupied[here] & ~occupied[there]
        edges.append((cells[here][joined], cells[there][joined], np.full(joined.sum(), np.hypot(dx, dy))))
    rows, columns, lengths = map(np.concatenate, zip(*edges))
    graph = coo_array((lengths, (rows, columns)), shape=(occupied.size,) * 2).tocsr()
    field = dijkstra(graph, directed=False, indices=cells[GOAL[1], GOAL[0]]).reshape(occupied.shape)
    field[occupied] = np.nan
    return field


def with_dijkstra3d(occupied):
    """Return a function that computes the field with dijkstra3d."""
    import dijkstra3d

    free = np.asfortranarray(~occupied.T).astype(np.uint8)
    return lambda: dijkstra3d.euclidean_distance_field(free, GOAL).T


def with_toolbox(occupied):
    """Return a function that computes the field with roboticstoolbox-python."""
    from roboticstoolbox import DistanceTransformPlanner

    planner = DistanceTransformPlanner(occgrid=occupied.astype(int))

    def run():
        planner.plan(goal=GOAL)
        return planner.distancemap

    return run


def timed(function):
    """Return the wall time of one run [s] and its result."""
    began = time.perf_counter()
    result = function()
    return time.perf_counter() - began, result


def worst_error(field, exact):
    """Return the largest difference on the cells that can be reached."""
    reached = np.isfinite(exact)
    return np.abs(np.asarray(field, float)[reached] - exact[reached]).max()


def text_of_ratio(times, ours):
    """Return the time of a peer and how many times ours it is."""
    return f'{times * 1e3:>9.1f} ms {times / ours:>8.1f}x' if times else f'{"-":>12} {"-":>9}'


def compare(name, occupied, peers, repeats):
    """Print the row of one grid."""
    def ours():
        return cost_to_go(occupied, GOAL)

    exact = exact_field(occupied)
    reached = np.isfinite(exact).sum()
    fast = with_dijkstra3d(occupied) if 'dijkstra3d' in peers else None
    times, fast_times = [], []
    errors = [worst_error(ours(), exact), worst_error(fast(), exact) if fast else np.nan]
    for _ in range(repeats):
        times.append(timed(ours)[0])
        if fast:
            fast_times.append(timed(fast)[0])
    toolbox_time, toolbox_error = None, np.nan
    if 'roboticstoolbox-python' in peers and not (name == 'serpentine' and len(occupied) > 512):
        toolbox_time, field = timed(with_toolbox(occupied))
        toolbox_error = worst_error(field, exact)
    time_of_ours = np.median(times)
    print(f'{len(occupied):>5} {name:<11} {time_of_ours * 1e3:>7.2f} ms {time_of_ours / reached * 1e9:>7.1f} '
          f'{text_of_ratio(np.median(fast_times) if fast else None, time_of_ours)} '
          f'{text_of_ratio(toolbox_time, time_of_ours)} '
          f'{errors[0]:>9.1e} {errors[1]:>10.1e} {toolbox_error:>9.1e}', flush=True)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--sides', type=int, nargs='+', default=[512, 1024], help='cells along each side')
    parser.add_argument('--repeats', type=int, default=11, help='runs of each, alternating; the toolbox runs once')
    options = parser.parse_args()
    peers = {package for package, module in PEERS.items() if util.find_spec(module)}
    versions = [f'{package} {metadata.version(package)}' if package in {*peers, 'numpy', 'numba', 'scipy'} else
                f'{package} is missing: its columns stay empty' for package in ('numpy', 'numba', 'scipy', *PEERS)]
    print(f'Python {platform.python_version()}, {", ".join(versions)}')
    print(f'{"side":>5} {"grid":<11} {"ours":>10} {"ns/cell":>7} {"dijkstra3d":>12} {"ratio":>9} '
          f'{"toolbox":>12} {"ratio":>9} {"err ours":>9} {"dijkstra3d":>10} {"toolbox":>9}')
    warm_up()
    for side in options.sides:
        for grid in (empty, scattered, serpentine):
            compare(grid.__name__, grid(side), peers, options.repeats)


if __name__ == '__main__':
    main()
