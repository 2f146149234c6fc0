"""Roadmaps: how long they take to build and to ask, ours and others: ``python -m benchmark.prm``.

On maze_10, 50 m x 50 m, in four tables, all times on the processor.

*Strategies*: build and first query from corner to corner for each way to check, and the second, equal query. "restart"
is the same lazy roadmap asked as RobWork's planner asks (re-stated here from what it does): shortest path, nodes
checked in turn from both of its ends, edges after them, and at the first that is not free it is taken out and the whole
search begins anew. Its searches and checks are ours.

*Neighbour searches*: all pairs within the radius, in each of the three ways.

*Problems*: the public ones in the plane from 5,000 nodes with full checks: how many roadmaps solve them, the time to
build and ask, and the cost over the best known, before and after `smooth` has had the rest of two seconds.

*Peers*: OMPL's PRM by its wheel grows for two seconds with a raster of 0.1 m as its checker, in Python as there is no
other, and is asked once; roboticstoolbox's PRM builds on the same raster, which it does not join to start and goal with
checked edges. Wants ompl and roboticstoolbox-python; where one is missing its lines are left out.
"""
import argparse
import platform
import time
from importlib import metadata, util
from pathlib import Path

import numpy as np

from mobile_planning.sampling.neighbour_search import NeighborSearchStrategy, neighbour_pairs
from mobile_planning.sampling.prm import PRMPlanner
from mobile_planning.sampling.prm_options import CollisionCheckingStrategy, ShortestPathSearchStrategy
from mobile_planning.sampling.prm_statistics import Stopwatch
from mobile_planning.sampling.problem import load_problem
from mobile_planning.sampling.roadmap_kernels import BLOCKED, FREE, UNKNOWN
from mobile_planning.sampling.roadmap_search import RoadmapSearch
from mobile_planning.sampling.smoothing import smooth
from mobile_planning.stop_flag import StopFlag

DATA = Path(__file__).resolve().parent.parent / 'test' / 'data' / 'sampling'
PACKAGES = ('numpy', 'scipy', 'numba', 'ompl', 'roboticstoolbox-python')
TABLES = ('strategies', 'neighbours', 'problems', 'peers')
MAZE = load_problem(DATA / 'maze_10.json')


def timed(function, *args, **options):
    """Return the time [s] on the processor that a call takes, and what it returns."""
    began = time.process_time()
    result = function(*args, **options)
    return time.process_time() - began, result


class OptimisticSearch(RoadmapSearch):
    """Takes all that is not known to be blocked for free."""

    def path(self, *args):
        """Return corners and length of the shortest path, however much of it may be blocked."""
        for states in (self._roadmap.node_states, self._roadmap.edge_states, self._states):
            states[states == UNKNOWN] = FREE
        return super().path(*args)


def restarted(planner, start, goal):
    """Return the cost by searching anew after each node or edge that is not free, and the searches and checks made."""
    space, roadmap = planner._space, planner.roadmap
    checked_nodes, checked_edges, searches, checks = set(), {}, 0, 0
    index = {tuple(point): node for node, point in enumerate(roadmap.points.tolist())}
    edges = {tuple(edge): number for number, edge in enumerate(roadmap.edges.tolist())}
    search = OptimisticSearch(space, roadmap, np.array(start, float), np.array(goal, float), StopFlag(), Stopwatch())
    while True:
        searches += 1
        found = search.path(ShortestPathSearchStrategy.A_STAR, np.inf, lambda: False)
        if found is None:
            return np.inf, searches, checks
        corners, cost = found
        nodes = [index[tuple(point)] for point in corners[1:-1].tolist()]
        order = [node for pair in zip(nodes, nodes[::-1]) for node in pair][:len(nodes) + 1]
        bad = None
        for node in order:
            if node not in checked_nodes:
                checks += 1
                if not space.free(roadmap.points[node][None])[0]:
                    bad = node
                    break
                checked_nodes.add(node)
        if bad is not None:
            roadmap.node_states[bad] = BLOCKED
            continue
        for k in range(len(corners) - 1):
            key = tuple(corners[k]) + tuple(corners[k + 1])
            if key not in checked_edges:
                checks += 1
                checked_edges[key] = bool(space.edges_free(corners[k][None], corners[k + 1][None])[0])
            if not checked_edges[key]:
                break
        else:
            return cost, searches, checks
        ends = [len(roadmap.points), *nodes, len(roadmap.points) + 1][k:k + 2]
        if 0 < k < len(corners) - 2:
            roadmap.edge_states[edges[tuple(sorted(ends))]] = BLOCKED
        else:
            arc = np.flatnonzero((search._tails == ends[0]) & (search._heads == ends[1]))
            search._states[arc] = BLOCKED


def strategies(counts, seeds, most_restarted):
    """Print build and query times for each strategy and number of nodes."""
    print(f'{"nodes":>7} {"checks":<10} {"build ms":>9} {"query ms":>9} {"again ms":>9} {"sum ms":>8} {"cost/best":>9} '
          f'{"edges checked":>13} {"restart ms":>11} {"ratio":>6}')
    for count in counts:
        for checking in CollisionCheckingStrategy:
            rows = []
            for seed in range(seeds):
                planner = PRMPlanner(MAZE.environment, collision_checking=checking)
                build, _ = timed(planner.build_roadmap, count, seed=seed)
                query, result = timed(planner.query, MAZE.start, MAZE.goal)
                again, _ = timed(planner.query, MAZE.start, MAZE.goal)
                rows.append((build, query, again, build + query, result.cost / MAZE.best_known['cost'],
                             result.collision_checks))
            build, query, again, both, cost, checks = np.median(rows, axis=0)
            row = (f'{count:>7} {checking.name:<10} {1e3 * build:>9.1f} {1e3 * query:>9.1f} {1e3 * again:>9.1f} '
                   f'{1e3 * both:>8.1f} {cost:>9.3f} {checks:>13.0f}')
            if checking is CollisionCheckingStrategy.LAZY and count <= most_restarted:
                planner = PRMPlanner(MAZE.environment)
                planner.build_roadmap(count, seed=0)
                one, result = timed(planner.query, MAZE.start, MAZE.goal)
                planner.build_roadmap(count, seed=0)
                restart, (cost, searches, _) = timed(restarted, planner, MAZE.start, MAZE.goal)
                assert abs(cost - result.cost) < 1e-9 or result.nodes > count
                row += f' {1e3 * restart:>11.0f} {restart / one:>5.0f}x  ({searches} searches)'
            print(row, flush=True)


def problems(seeds):
    """Print success, time and cost of the public problems in the plane, also when the path has been shortened."""
    print(f'\n{"problem":<16} {"query":>5} {"solved":>7} {"ms":>7} {"worst":>7} {"cost/best":>9} {"shortened":>9} '
          f'{"worst":>7}')
    for name in ('bug_trap', 'maze_10', 'narrow_zigzag'):
        problem = load_problem(DATA / f'{name}.json')
        queries = [(problem.start, problem.goal, problem.best_known['cost']),
                   *((query.start, query.goal, query.cost) for query in problem.queries)]
        for number, (start, goal, best) in enumerate(queries):
            rows = [one_problem(problem.environment, start, goal, best, seed) for seed in range(seeds)]
            spent, first, shortened = np.array([row for row in rows if row is not None]).T
            print(f'{name:<16} {number:>5} {len(spent):>4}/{seeds:<2} {1e3 * np.median(spent):>7.1f} '
                  f'{1e3 * spent.max():>7.1f} {np.median(first):>9.4f} {np.median(shortened):>9.4f} '
                  f'{shortened.max():>7.4f}', flush=True)


def one_problem(environment, start, goal, best, seed):
    """Return the time of build and query [s], and the costs over the best, of the query and shortened within 2 s."""
    planner = PRMPlanner(environment, collision_checking=CollisionCheckingStrategy.FULL)
    build, _ = timed(planner.build_roadmap, 5000, seed=seed)
    query, result = timed(planner.query, start, goal, deadline=5.0)
    if not result.is_solved:
        return None
    shorter = smooth(result.path, environment, 0, deadline=max(0.01, 2.0 - build - query), seed=seed)
    assert environment.free_poses(result.path).all() and environment.free_poses(shorter.path).all()
    return build + query, result.cost / best, shorter.cost / best


def neighbour_searches(counts):
    """Print the time of each neighbour search."""
    print(f'\n{"nodes":>7} {"pairs":>9} ' + ' '.join(f'{way.name + " ms":>23}' for way in NeighborSearchStrategy))
    for count in counts:
        points = np.random.default_rng(0).uniform(0, 50, (count, 2))
        radius = np.sqrt(20 * 2500 / count / np.pi)
        row = ''
        for way in NeighborSearchStrategy:
            if way is NeighborSearchStrategy.BRUTE_FORCE and count > 20_000:
                row += f' {"-":>23}'
                continue
            spent = [timed(neighbour_pairs, points, radius, way) for _ in range(3)]
            row += f' {1e3 * min(each for each, _ in spent):>23.1f}'
            pairs = len(spent[0][1])
        print(f'{count:>7} {pairs:>9}' + row, flush=True)


def raster():
    """Return the occupied cells (500, 500) of the maze, 0.1 m wide, by their centres."""
    centres = np.stack(np.meshgrid(np.arange(500), np.arange(500)), axis=-1) * 0.1 + 0.05
    return ~MAZE.environment.free_poses(centres)


def ompl_prm(grow_for):
    """Print how OMPL's PRM does."""
    from ompl import base, geometric

    free = (~raster()).tolist()
    space, bounds = base.RealVectorStateSpace(2), base.RealVectorBounds(2)
    bounds.setLow(0)
    bounds.setHigh(50)
    space.setBounds(bounds)
    information = base.SpaceInformation(space)
    information.setStateValidityChecker(lambda state: free[min(int(state[1] * 10), 499)][min(int(state[0] * 10), 499)])
    information.setStateValidityCheckingResolution(0.001)
    information.setup()
    problem, (start, goal) = base.ProblemDefinition(information), (information.allocState() for _ in range(2))
    start[0], start[1] = MAZE.start
    goal[0], goal[1] = MAZE.goal
    problem.setStartAndGoalStates(start, goal)
    planner = geometric.PRM(information)
    planner.setProblemDefinition(problem)
    planner.setup()
    build, _ = timed(planner.growRoadmap, grow_for)
    count = planner.milestoneCount()
    query, _ = timed(planner.solve, base.timedPlannerTerminationCondition(5.0))
    cost = problem.getSolutionPath().length() / MAZE.best_known['cost'] if problem.hasExactSolution() else np.inf
    return count, planner.edgeCount(), build, query, cost


def toolbox_prm(count):
    """Print how roboticstoolbox's PRM does."""
    from roboticstoolbox import PRMPlanner as ToolboxPRM
    from roboticstoolbox.mobile import BinaryOccupancyGrid
    from roboticstoolbox.mobile.PlannerBase import NoPathError

    planner = ToolboxPRM(occgrid=BinaryOccupancyGrid(raster()[::5, ::5].astype(int)), npoints=count, seed=0)
    build, _ = timed(planner.plan)
    ends = [np.array(end) * 2 for end in (MAZE.start, MAZE.goal)]
    try:
        query, path = timed(planner.query, *ends)
    except NoPathError:
        return count, np.nan, build, np.nan, np.inf
    path = np.asarray(path, float) / 2
    return count, np.nan, build, query, np.hypot(*np.diff(path, axis=0).T).sum() / MAZE.best_known['cost']


def peers(grow_for):
    """Print the peers beside ours, full checks."""
    print(f'\n{"":<30} {"nodes":>7} {"edges":>8} {"build ms":>9} {"query ms":>9} {"nodes/s":>9} {"cost/best":>9}')

    def row(name, count, edges, build, query, cost):
        print(f'{name:<30} {count:>7} {edges:>8.0f} {1e3 * build:>9.1f} {1e3 * query:>9.1f} {count / build:>9.0f} '
              f'{cost:>9.3f}', flush=True)

    for count in (200, 1000, 10_000):
        planner = PRMPlanner(MAZE.environment, collision_checking=CollisionCheckingStrategy.FULL)
        build, _ = timed(planner.build_roadmap, count, seed=0)
        query, result = timed(planner.query, MAZE.start, MAZE.goal)
        row('ours, FULL', count, len(planner.roadmap.edges), build, query, result.cost / MAZE.best_known['cost'])
    if util.find_spec('roboticstoolbox') is not None:
        for count in (100, 200):
            row('roboticstoolbox', *toolbox_prm(count))
    if util.find_spec('ompl') is not None:
        row('OMPL wheel', *ompl_prm(grow_for))


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seeds', type=int, default=20, help='roadmaps for each line (20)')
    parser.add_argument('--nodes', type=int, nargs='+', default=[1000, 10_000, 100_000])
    parser.add_argument('--restart-up-to', type=int, default=10_000, help='most nodes of a restarting search (10000)')
    parser.add_argument('--tables', nargs='+', default=TABLES, choices=TABLES)
    parser.add_argument('--grow', type=float, default=2.0, help='time for OMPL [s] (2)')
    options = parser.parse_args()
    versions = ', '.join(f'{name} {metadata.version(name)}' for name in PACKAGES
                         if name.split('-')[0] in ('numpy', 'scipy', 'numba') or util.find_spec(name.split('-')[0]))
    print(f'Python {platform.python_version()}, {versions}\n')
    # What is loaded or compiled once is not counted.
    warm = PRMPlanner(MAZE.environment, collision_checking=CollisionCheckingStrategy.FULL)
    warm.build_roadmap(200, seed=0)
    warm.query(MAZE.start, MAZE.start)
    tables = {'strategies': lambda: strategies(options.nodes, options.seeds, options.restart_up_to),
              'neighbours': lambda: neighbour_searches(options.nodes),
              'problems': lambda: problems(options.seeds),
              'peers': lambda: peers(options.grow)}
    for name in options.tables:
        tables[name]()


if __name__ == '__main__':
    main()
