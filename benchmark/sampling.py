"""Sampling planners side by side on the problems of test/data/sampling.

For each problem and planner: how many runs were solved, thread time to the first path (median), cost over the best
known after 0.5, 2 and 5 s (median; of others of the path that they end with), and how many paths are free at 0.02 m
on the exact shapes. RRT* of OMPL does not stop at its first path: its time is all of its 2 s.

    python benchmark/sampling.py [--seeds 20] [--problems forest_60 ...] [--without-peers] [--pictures FOLDER]

The OMPL wheel (`pip install ompl`) takes part if it is installed.
"""
import argparse
import time
from pathlib import Path

import numpy as np
from sampling_peers import Ompl, Raster, poses_along, rrt_dubins, rrt_python_robotics

from mobile_planning import RRT, load_problem

FOLDER = Path(__file__).resolve().parent.parent / 'test' / 'data' / 'sampling'
LIMIT = 5.0
MARKS = (0.5, 2.0, 5.0)
COLUMNS = '{:19} {:22} {:>7} {:>10} {:>22} {:>10}'


def is_fine(problem, points):
    """Return whether a path's points, taken every 0.02 m, are free of the exact shapes by all but a millimetre."""
    points = np.asarray(points)[:, :2]
    places = np.append(0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    fine = np.append(np.arange(0, places[-1], 0.02), places[-1])
    dense = np.column_stack([np.interp(fine, places, points[:, axis]) for axis in range(2)])
    return bool((problem.environment.clearance(dense, fine / problem.speed) >= -1e-3).all())


def planted(problem):
    """Return our planner with the problem's start."""
    rrt = RRT(problem.environment, problem.goal_tolerance, radius=problem.turning_radius, speed=problem.speed)
    rrt.set_start(problem.start)
    return rrt


def run_ours(problem, seeds):
    """Return rows (solved, first path [s], costs after the marks, fine) of our planner."""
    best, rows = problem.best_known['cost'], []
    for seed in range(seeds):
        rrt, begun = planted(problem), time.thread_time()
        first = rrt.run(problem.goal, deadline=LIMIT, seed=seed)
        spent = time.thread_time() - begun
        result = planted(problem).run(problem.goal, deadline=LIMIT, seed=seed, star=True)
        costs = [min((step.cost for step in result.history if step.elapsed <= mark), default=np.inf) / best
                 for mark in MARKS]
        fine = all(each.is_solved and is_fine(problem, each.path) for each in (first, result))
        rows.append((first.is_solved and result.is_solved, spent, costs, fine))
    return rows


def run_peer(problem, seeds, plan):
    """Return the rows of a peer that ends with its first path."""
    best, rows = problem.best_known['cost'], []
    for seed in range(seeds):
        spent, cost, points = plan(seed)
        fine = points is not None and is_fine(problem, points)
        rows.append((points is not None, spent, [cost / best] * len(MARKS), fine))
    return rows


def show(name, planner, rows, marks=True):
    """Print one line of the table."""
    solved = [row for row in rows if row[0]]
    first = f'{1e3 * np.median([row[1] for row in rows]):.2f} ms' if solved else '-'
    costs = np.median([row[2] for row in rows], axis=0)
    costs = ' '.join(f'{cost:.3f}' for cost in (costs if marks else costs[:1]))
    print(COLUMNS.format(name, planner, f'{len(solved)}/{len(rows)}', first, costs,
                         f'{sum(row[3] for row in rows)}/{len(solved)}'), flush=True)


def peers(problem, seeds):
    """Run the peers that can plan the problem."""
    raster, few = Raster(problem), max(1, seeds // 4)
    try:
        ompl = Ompl(problem, raster)
    except ImportError:
        ompl = None
    if ompl is not None:
        show(problem.name, 'OMPL RRT', run_peer(problem, seeds, lambda seed: ompl.solve('RRT', LIMIT)), False)
        show(problem.name, 'OMPL RRT* 2 s', run_peer(problem, few, lambda seed: ompl.solve('RRTstar', 2.0)), False)
    if problem.kind == 'dubins':
        for name, planner in (('RRT-Dubins', rrt_dubins), ('PythonRobotics', rrt_python_robotics)):
            def plan(seed, planner=planner):
                spent, cost, path = planner(problem, raster, seed, LIMIT)
                return spent, cost, None if path is None else poses_along(path, problem.turning_radius)
            show(problem.name, f'{name}, restated', run_peer(problem, few, plan), False)


def draw(problem, folder):
    """Draw the tree and the path after 2 s."""
    from mobile_planning.drawing import maps
    from mobile_planning.sampling.rrt_plot import draw_tree_in

    rrt = planted(problem)
    result = rrt.run(problem.goal, deadline=2.0, seed=0, star=True)
    x_min, y_min, x_max, y_max = problem.environment.bounds
    title = f'{problem.name}: {result.cost:.2f} m, best known {problem.best_known["cost"]:.2f} m, {result.nodes} nodes'
    figure, axes = maps.new_figure(x_max - x_min, y_max - y_min, title)
    draw_tree_in(axes, rrt, path=result.path)
    folder.mkdir(parents=True, exist_ok=True)
    maps.save(figure, folder / f'{problem.name}.png')


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seeds', type=int, default=20)
    parser.add_argument('--problems', nargs='*', default=sorted(path.stem for path in FOLDER.glob('*.json')))
    parser.add_argument('--without-peers', action='store_true')
    parser.add_argument('--pictures', type=Path)
    options = parser.parse_args()
    print(COLUMNS.format('problem', 'planner', 'solved', 'first path', 'cost 0.5 / 2 / 5 s', 'fine'))
    for name in options.problems:
        problem = load_problem(FOLDER / f'{name}.json')
        if options.pictures is not None:
            draw(problem, options.pictures)
            continue
        planted(problem).run(problem.goal, 1000, seed=0)  # reads the kernels
        show(name, 'ours', run_ours(problem, options.seeds))
        if not (options.without_peers or problem.environment.moving):
            peers(problem, options.seeds)


if __name__ == '__main__':
    main()
