"""The cost-to-go field side by side with other packages: ``python -m benchmark.cost_to_go [MAP.yaml ...]``.

The same field of the same grids, 8-connected with corner cutting, by each package in turn in one run; medians of
alternating runs, in milliseconds. A ratio is the peer's time over ours. An error is the largest difference [cells] from
scipy's Dijkstra, whose own sums of floats drift by up to 1e-9; its graph is built beforehand and not timed.

Wants dijkstra3d, scikit-image and roboticstoolbox-python 1.5.0 beside this package's own requirements; what is missing
is named and left out. The toolbox takes seconds, so it runs once, and not on serpentines beyond 512 x 512, where it
would take many minutes.
"""
import argparse
import platform
import time
from importlib import metadata, util
from pathlib import Path

import numpy as np
from scipy.sparse.csgraph import dijkstra

from benchmark.dijkstra import graph_of
from mobile_planning.world.cost_to_go import cost_to_go, warm_up
from mobile_planning.world.map_io import load_map


def empty(side):
    """Return a grid without obstacles."""
    return np.zeros((side, side), bool)


def scattered(side):
    """Return a grid of which 20 % is occupied at random."""
    occupied = np.random.default_rng(0).random((side, side)) < 0.2
    occupied[1, 1] = False
    return occupied


def serpentine(side):
    """Return a grid with a wall every 16 columns, open at the top and the bottom in turn."""
    occupied = empty(side)
    for i, x in enumerate(range(15, side - 1, 16)):
        occupied[:, x] = True
        occupied[0 if i % 2 else side - 1, x] = False
    return occupied


def with_scipy(occupied, goal):
    """Return a function that computes the field with scipy's Dijkstra."""
    graph = graph_of(np.where(occupied, np.inf, 1.0))
    index = goal[1] * occupied.shape[1] + goal[0]
    return lambda: dijkstra(graph, directed=False, indices=index).reshape(occupied.shape)


def with_dijkstra3d(occupied, goal):
    """Return a function that computes the field with dijkstra3d."""
    import dijkstra3d

    free = np.asfortranarray(~occupied.T).astype(np.uint8)
    return lambda: dijkstra3d.euclidean_distance_field(free, goal).T


def with_skimage(occupied, goal):
    """Return a function that computes the field with scikit-image."""
    from skimage.graph import MCP_Geometric

    costs = np.where(occupied, -1.0, 1.0)
    return lambda: MCP_Geometric(costs).find_costs([goal[::-1]])[0]


def with_toolbox(occupied, goal):
    """Return a function that computes the field with roboticstoolbox-python."""
    from roboticstoolbox import DistanceTransformPlanner

    planner = DistanceTransformPlanner(occgrid=occupied.astype(int))

    def run():
        planner.plan(goal=goal)
        return planner.distancemap

    return run


#: By package: the module to look for and what makes the function to time.
PEERS = {'dijkstra3d': ('dijkstra3d', with_dijkstra3d), 'scipy': ('scipy', with_scipy),
         'scikit-image': ('skimage', with_skimage), 'roboticstoolbox-python': ('roboticstoolbox', with_toolbox)}
SLOW = 'roboticstoolbox-python'


def timed(function):
    """Return the wall time of one run [s] and its result."""
    began = time.perf_counter()
    result = function()
    return time.perf_counter() - began, result


def compare(name, occupied, peers, repeats):
    """Print the row of one grid; the goal is the free cell nearest to (1, 1)."""
    free = np.argwhere(~occupied)[:, ::-1]
    goal = tuple(free[np.abs(free - 1).sum(axis=1).argmin()].tolist())
    exact = with_scipy(occupied, goal)()
    reached = np.isfinite(exact)
    runs = {'ours': lambda: cost_to_go(occupied, goal)}
    runs |= {peer: PEERS[peer][1](occupied, goal) for peer in peers
             if not (peer == SLOW and name == 'serpentine' and len(occupied) > 512)}
    times, errors = {peer: [] for peer in runs}, {}
    for round_ in range(repeats):
        for peer, run in runs.items():
            if peer != SLOW or round_ == 0:
                spent, field = timed(run)
                times[peer].append(spent)
                errors[peer] = np.abs(np.asarray(field, float)[reached] - exact[reached]).max()
    middle = {peer: np.median(spent) for peer, spent in times.items()}
    cells = [f'{occupied.shape[1]:>5} {name:<11}', f'{middle["ours"] * 1e3:>8.2f}',
             f'{middle["ours"] / reached.sum() * 1e9:>7.1f}', f'{errors["ours"]:>8.0e}']
    for peer in peers:
        cells.append(f'{middle[peer] * 1e3:>9.1f} {middle[peer] / middle["ours"]:>8.1f}x {errors[peer]:>7.0e}'
                     if peer in runs else f'{"-":>27}')
    print(' '.join(cells), flush=True)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('maps', nargs='*', type=Path, help="further maps in Nav2's format")
    parser.add_argument('--sides', type=int, nargs='+', default=[512, 1024], help='cells along each side')
    parser.add_argument('--repeats', type=int, default=11, help='runs of each, alternating; the toolbox runs once')
    options = parser.parse_args()
    peers = [package for package, (module, _) in PEERS.items() if util.find_spec(module)]
    print(f'Python {platform.python_version()},', ', '.join(
        f'{package} {metadata.version(package)}' if package in ['numpy', 'numba', *peers] else f'{package} is missing'
        for package in ('numpy', 'numba', *PEERS)))
    print(f'{"side":>5} {"grid":<11} {"ours":>8} {"ns/cell":>7} {"error":>8}',
          ' '.join(f'{peer[:9]:>9} {"ratio":>9} {"error":>7}' for peer in peers))
    warm_up()
    for side in options.sides:
        for grid in (empty, scattered, serpentine):
            compare(grid.__name__, grid(side), peers, options.repeats)
    for path in options.maps:
        compare(path.stem, load_map(path).occupied(), peers, options.repeats)


if __name__ == '__main__':
    main()
