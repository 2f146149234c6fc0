"""Sampling planners side by side on the problems of test/data/sampling.

For each problem and planner: how many runs were solved, thread time to the first path (median), how many times as long
as ours that is, cost over the best known after 0.5, 2 and 5 s or other ``--marks`` (median; of others of the path that
they end with), how many paths are free at 0.02 m on the exact shapes, and by how much the latest run missed its
deadline. RRT* of OMPL does not stop at its first path: its time is all of its 2 s. OMPL's RRT is its planner for a car
that drives forwards, its RRTConnect, which asks for ways that can be driven back, is asked in the plane alone. Ours is
timed with all that it does, set-up and points of the path among it; the world as kernels want it is made once and keeps
what earlier runs have found out about its cells; OMPL's raster and space are not counted either.

    python benchmark/sampling.py [--seeds 20] [--problems forest_60 ...] [--marks 0.5 2 5] [--peers ...] [--first]
        [--pictures FOLDER]

With ``--first`` all stop at their first path, and what takes longer (the costs, RRT* of OMPL) is left out; with
``--peers`` only those named take part, none if none is.

The OMPL wheel (`pip install ompl`) takes part if it is installed.
"""
import argparse
import time
from pathlib import Path

import numpy as np
from sampling_peers import Ompl, Raster
from sampling_published import Shapes, poses_along, rrt_dubins, rrt_python_robotics

from mobile_planning import RRT, load_problem

FOLDER = Path(__file__).resolve().parent.parent / 'test' / 'data' / 'sampling'
LIMIT = 5.0
COLUMNS = '{:19} {:24} {:>7} {:>11} {:>8} {:>20} {:>7} {:>8}'
PEERS = ('RRT', 'RRTConnect', 'RRTstar', 'RRT-Dubins', 'PythonRobotics')


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


def run_ours(problem, seeds, only_first, marks):
    """Return rows (solved, first path [s], costs after the marks, fine, time over the deadline [s]) of our planner."""
    best, rows = problem.best_known['cost'], []
    for seed in range(seeds):
        rrt, begun = planted(problem), time.thread_time()
        results = [rrt.run(problem.goal, deadline=LIMIT, seed=seed)]
        spent = time.thread_time() - begun
        late = 0.0
        if not only_first:
            rrt, begun = planted(problem), time.perf_counter()
            results.append(rrt.run(problem.goal, deadline=marks[-1], seed=seed, star=True))
            late = time.perf_counter() - begun - marks[-1]
        costs = [min((step.cost for step in results[-1].history if only_first or step.elapsed <= mark),
                     default=np.inf) / best for mark in marks]
        fine = all(result.is_solved and is_fine(problem, result.path) for result in results)
        rows.append((all(result.is_solved for result in results), spent, costs, fine, late))
    return rows


def run_peer(problem, seeds, plan):
    """Return the rows of a peer that ends with its first path."""
    best, rows = problem.best_known['cost'], []
    for seed in range(seeds):
        spent, cost, points = plan(seed)
        fine = points is not None and is_fine(problem, points)
        rows.append((points is not None, spent, [cost / best], fine, 0.0))
    return rows


class Table:
    """Prints a line for each planner; the first one of a problem is what the others' times are compared with."""

    def __init__(self, problem):
        self._name, self._ours = problem.name, None

    def add(self, planner, rows):
        """Print one line."""
        solved = [row for row in rows if row[0]]
        first = np.median([row[1] for row in rows])
        self._ours = first if self._ours is None else self._ours
        costs = ' '.join(f'{cost:.3f}' for cost in np.median([row[2] for row in rows], axis=0))
        print(COLUMNS.format(self._name, planner, f'{len(solved)}/{len(rows)}', f'{1e3 * first:.2f} ms',
                             f'{first / self._ours:.1f}', costs, f'{sum(row[3] for row in rows)}/{len(solved)}',
                             f'{1e3 * max(row[4] for row in rows):.1f} ms'),
              flush=True)


def peers(problem, table, seeds, names):
    """Run those of the peers named that can plan the problem."""
    few = max(1, seeds // 4)
    try:
        ompl = Ompl(problem, Raster(problem))
    except ImportError:
        names = [name for name in names if not name.startswith('RRT') or name == 'RRT-Dubins']
    if 'RRT' in names:
        table.add('OMPL RRT', run_peer(problem, seeds, lambda seed: ompl.solve('RRT', LIMIT)))
    if 'RRTConnect' in names and problem.kind != 'dubins':
        table.add('OMPL RRTConnect', run_peer(problem, seeds, lambda seed: ompl.solve('RRTConnect', LIMIT)))
    if 'RRTstar' in names:
        table.add('OMPL RRT* 2 s', run_peer(problem, few, lambda seed: ompl.solve('RRTstar', 2.0)))
    for name, planner in (('RRT-Dubins', rrt_dubins), ('PythonRobotics', rrt_python_robotics)):
        if name not in names or problem.kind != 'dubins':
            continue
        shapes = Shapes(problem)

        def plan(seed, planner=planner, shapes=shapes):
            spent, cost, path = planner(problem, shapes, seed, LIMIT)
            return spent, cost, None if path is None else poses_along(path, problem.turning_radius)
        table.add(f'{name}, restated', run_peer(problem, few, plan))


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
    parser.add_argument('--marks', nargs='+', type=float, default=[0.5, 2.0, 5.0], help='[s]; the last ends a run')
    parser.add_argument('--peers', nargs='*', default=PEERS, choices=PEERS)
    parser.add_argument('--first', action='store_true')
    parser.add_argument('--pictures', type=Path)
    options = parser.parse_args()
    print(COLUMNS.format('problem', 'planner', 'solved', 'first path', 'x ours', 'cost at the marks', 'fine', 'late'))
    for name in options.problems:
        problem = load_problem(FOLDER / f'{name}.json')
        planted(problem).run(problem.goal, 1000, seed=0, star=True)  # reads the kernels
        if options.pictures is not None:
            draw(problem, options.pictures)
            continue
        table = Table(problem)
        table.add('ours', run_ours(problem, options.seeds, options.first, [LIMIT] if options.first else options.marks))
        if not problem.environment.moving:
            slow = {'RRTstar'} if options.first else set()
            peers(problem, table, options.seeds, [name for name in options.peers if name not in slow])


if __name__ == '__main__':
    main()
