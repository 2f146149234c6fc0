"""One-off queries side by side: ``python -m benchmark.point_to_point FOLDER``.

Queries of MovingAI scenarios in the folder, without corner cutting, each by every package in turn; all return the path.
A ratio is the package's mean time over that of `astar`. "exact" counts the paths that are as long as the scenario
says, "excess" is the mean length above that. What stands for Nav2 is our own plain re-statement of its searches.
Packages may keep what they make of a map before the queries; `astar` and the re-statements are given the array only.

Wants w9-pathfinding and scikit-image; what is missing is left out. roboticstoolbox-python has no one-off search: its D*
plans the whole map, and its one query takes minutes on these maps.
"""
import argparse
import platform
import sys
from importlib import metadata, util
from pathlib import Path

import numpy as np
from scipy.sparse.csgraph import dijkstra

from benchmark import movingai_rows as movingai
from benchmark.cost_to_go import timed
from benchmark.dijkstra import graph_of
from benchmark.navfn_search import navfn_path
from benchmark.smac_search import smac_path
from mobile_planning.grid.astar import astar
from mobile_planning.world.cost_to_go import cost_to_go, descend

MAPS = ('brc202d', 'random512-10-0', 'maze512-8-0')
PACKAGES = ('numpy', 'numba', 'scipy', 'scikit-image', 'w9-pathfinding')


def with_w9(occupied):
    """Return the two searches of w9-pathfinding on a map."""
    from w9_pathfinding.envs import DiagonalMovement, Grid
    from w9_pathfinding.pf import AStar, BiAStar

    grid = Grid(np.where(occupied, -1.0, 1.0).tolist(), diagonal_movement=DiagonalMovement.only_when_no_obstacle,
                diagonal_movement_cost_multiplier=2 ** 0.5)
    return {'w9-pathfinding AStar': AStar(grid).find_path, 'w9-pathfinding BiAStar': BiAStar(grid).find_path}


def with_scipy(occupied):
    """Return the whole tree of scipy's Dijkstra on a graph made before, with the path read from it."""
    graph, width = graph_of(np.where(occupied, np.inf, 1.0), corner_cutting=False), occupied.shape[1]

    def search(start, goal):
        _, parents = dijkstra(graph, directed=False, indices=goal[1] * width + goal[0], return_predecessors=True)
        cell = start[1] * width + start[0]
        path = []
        while cell >= 0:
            path.append((cell % width, cell // width))
            cell = parents[cell]
        return path

    return search


def with_skimage(occupied):
    """Return scikit-image's search, which has no rule on corners and cuts them."""
    from skimage.graph import route_through_array

    costs = np.where(occupied, -1.0, 1.0)
    return lambda start, goal: np.array(route_through_array(costs, start[::-1], goal[::-1])[0])[:, ::-1]


def searches_on(occupied):
    """Return the searches by name; the first one is ours."""
    def by_field(start, goal):
        return descend(cost_to_go(occupied, goal, corner_cutting=False), start, goal, corner_cutting=False)

    searches = {'astar': lambda start, goal: astar(occupied, start, goal, corner_cutting=False)[0],
                'cost_to_go, descend': by_field}
    if util.find_spec('w9_pathfinding'):
        searches.update(with_w9(occupied))
    searches['NavFn, re-stated'] = lambda start, goal: navfn_path(occupied, start, goal)
    searches['Smac 2D, re-stated'] = lambda start, goal: smac_path(occupied, start, goal)
    searches['scipy dijkstra'] = with_scipy(occupied)
    if util.find_spec('skimage'):
        searches['skimage MCP (cuts corners)'] = with_skimage(occupied)
    return searches


def compare(name, occupied, rows):
    """Print the rows of one map."""
    searches = searches_on(occupied)
    times, lengths = {key: [] for key in searches}, {key: [] for key in searches}
    for search in searches.values():
        search(rows[0].start, rows[0].goal)
    for row in rows:
        for key, search in searches.items():
            took, path = timed(lambda: search(row.start, row.goal))
            times[key].append(took)
            path = np.array(path)
            # A search that got stuck has no length.
            lengths[key].append(movingai.path_length(path) if tuple(path[-1]) == row.goal else np.nan)
    listed, precision = np.array([(row.listed, row.precision) for row in rows]).T
    for key in searches:
        mean, error = np.mean(times[key]), np.array(lengths[key]) - listed
        print(f'{name:<16} {key:<27} {mean * 1e3:>9.3f} {mean / np.mean(times["astar"]):>7.2f}x '
              f'{(np.abs(error) <= precision).sum():>4} of {len(rows)} {np.nanmean(error / listed):>10.1e} '
              f'{np.isnan(error).sum():>6}', flush=True)


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('folder', nargs='?', type=Path, default=movingai.SHIPPED, help='maps with their scenarios')
    parser.add_argument('--maps', nargs='+', default=MAPS)
    parser.add_argument('--rows', type=int, default=60, help='queries on each map')
    options = parser.parse_args()
    installed = {item.metadata['Name'] for item in metadata.distributions()}
    print(f'Python {platform.python_version()},',
          ', '.join(f'{package} {metadata.version(package)}' for package in PACKAGES if package in installed))
    print(f'{"map":<16} {"search":<27} {"mean [ms]":>9} {"ratio":>8} {"exact":>10} {"excess":>10} {"stuck":>6}')
    paths = {path.name.split('.')[0]: path for path in movingai.map_files(options.folder)}
    for name in options.maps:
        if name not in paths:
            print(f'{name:<16} is not in {options.folder}')
            continue
        rows = movingai.read_rows(paths[name])
        chosen = np.random.default_rng(1).choice(len(rows), min(options.rows, len(rows)), replace=False)
        compare(name, movingai.read_map(paths[name]), [rows[i] for i in chosen])


if __name__ == '__main__':
    sys.exit(main())
