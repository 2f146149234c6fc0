"""Roadmaps: what every query promises, against scipy's Dijkstra on the roadmap that is valid, and against shapely."""
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from prm_worlds import NARROW, environments
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from mobile_planning import Boundary, Environment, PolygonObstacle, RoundObstacle
from mobile_planning.errors import (
    Cancelled, GoalOccupied, GoalOutside, InvalidInput, LimitExceeded, NoPath, NotBuilt, PlanningTimeout,
    StartOccupied, StartOutside, StrategyLocked)
from mobile_planning.sampling.dubins import dubins_lengths
from mobile_planning.sampling.plan_result import PlanStatus
from mobile_planning.sampling.prm import PRMPlanner
from mobile_planning.sampling.prm_options import CollisionCheckingStrategy, ShortestPathSearchStrategy
from mobile_planning.sampling.problem import load_problem
from mobile_planning.sampling.samplers import SamplingStrategy
from mobile_planning.sampling.spaces import JointSpace, joint_weights
from mobile_planning.sampling.spaces_environment import CarSpace, PlaneSpace

PROBLEMS = Path(__file__).resolve().parent.parent / 'data' / 'sampling'
seeds = st.integers(0, 2**31)
A_STAR, DIJKSTRA = ShortestPathSearchStrategy
LAZY, NODECHECK, FULL = CollisionCheckingStrategy
OPEN = Environment(Boundary((0, 10), (0, 10)), [RoundObstacle((5, 5), 2)])
SEALED = Environment(Boundary((0, 10), (0, 10)), [
    PolygonObstacle([(x, y), (x + w, y), (x + w, y + h), (x, y + h)])
    for x, y, w, h in ((6, 6, 3, .5), (6, 8.5, 3, .5), (6, 6, .5, 3), (8.5, 6, .5, 3))])


def arm(environment):
    """Return three joints, of which the first two carry a point through the world."""
    plane = PlaneSpace(environment)
    return JointSpace([0, 0, -1], [10, 10, 1], lambda q: plane.free(q[:, :2]), weights=[1, 1, 0.5], resolution=0.1)


def spaces(environment):
    """Return a space of each kind."""
    return {'plane': PlaneSpace(environment), 'dubins': CarSpace(environment, 0.6), 'joints': arm(environment)}


kinds = st.sampled_from(('plane', 'dubins', 'joints'))


def ends(space, seed):
    """Return a free start and a free goal, or None."""
    points = np.random.default_rng([seed, 1]).uniform(space.low, space.high, (200, len(space.low)))
    points = points[space.free(points)]
    return points[:2] if len(points) > 1 else None


def cost_by_scipy(space, roadmap, start, goal):
    """Return the shortest way's length over all that is free, every edge of it checked by itself."""
    points = np.concatenate([roadmap.points, [start, goal]])
    count = len(roadmap.points)
    there, back = space.lengths(start[None], roadmap.points), space.lengths(roadmap.points, goal[None])
    edges = [roadmap.edges] if space.is_directed else [roadmap.edges, roadmap.edges[:, ::-1]]
    edges += [[(count, node) for node in np.flatnonzero(there <= roadmap.radius)],
              [(node, count + 1) for node in np.flatnonzero(back <= roadmap.radius)], [(count, count + 1)]]
    edges = np.concatenate([np.array(part, np.int64).reshape(-1, 2) for part in edges])
    node_free = space.free(points)
    edges = edges[node_free[edges].all(axis=1)]
    edges = edges[space.edges_free(*points[edges.T])]
    lengths = space.lengths(*points[edges.T])
    graph = csr_array((np.maximum(lengths, 1e-300), edges.T), shape=(count + 2, count + 2))
    return dijkstra(graph, indices=count)[count + 1]


def length_of(space, path):
    """Return the length of a path."""
    return space.lengths(path[:-1], path[1:]).sum()


@settings(max_examples=40)
@given(environments(), kinds, seeds, st.sampled_from(CollisionCheckingStrategy), st.sampled_from(
    ShortestPathSearchStrategy))
def test_the_cost_is_that_of_dijkstra_on_the_roadmap_that_is_valid(environment, kind, seed, checking, search):
    space = spaces(environment)[kind]
    pair = ends(space, seed)
    planner = PRMPlanner(space, collision_checking=checking, shortest_path_search=search, enhancements=0)
    if pair is None:
        return
    planner.build_roadmap(120, seed=seed)
    result, expected = planner.query(*pair), cost_by_scipy(space, planner.roadmap, *pair)
    assert (result.status is PlanStatus.SOLVED) == np.isfinite(expected)
    if result.status is PlanStatus.SOLVED:
        assert result.cost == pytest.approx(expected, rel=1e-9, abs=1e-9)
        assert np.allclose(result.path[[0, -1]], pair, rtol=0, atol=1e-12)
        assert length_of(space, result.path) == pytest.approx(result.cost, rel=1e-6, abs=1e-6)
    else:
        assert result.status is PlanStatus.NO_PATH and not len(result.path) and result.cost == np.inf


def filtered(space):
    """Return a sampler whose points are free."""
    def sampler(random, count):
        points = random.uniform(space.low, space.high, (count, len(space.low)))
        return points[space.free(points)]
    return sampler


@settings(max_examples=25)
@given(environments(), kinds, seeds)
def test_all_ways_to_check_and_to_search_agree_on_the_same_samples(environment, kind, seed):
    space = spaces(environment)[kind]
    pair = ends(space, seed)
    if pair is None:
        return
    costs = []
    for checking in CollisionCheckingStrategy:
        for search in ShortestPathSearchStrategy:
            planner = PRMPlanner(space, collision_checking=checking, shortest_path_search=search, enhancements=0,
                                 sampler=filtered(space))
            planner.build_roadmap(100, seed=seed)
            costs += [planner.query(*pair).cost, planner.query(*pair).cost]
    assert np.allclose(costs, costs[0], rtol=1e-9, atol=1e-9)


@settings(max_examples=25)
@given(environments(), kinds, seeds, st.booleans())
def test_all_neighbour_searches_make_the_same_roadmap(environment, kind, seed, in_two_steps):
    space, roadmaps = spaces(environment)[kind], []
    for search in (PRMPlanner.BRUTE_FORCE, PRMPlanner.PARTIAL_INDEX_TABLE, PRMPlanner.KDTREE):
        planner = PRMPlanner(space, neighbor_search=search)
        planner.build_roadmap(60 if in_two_steps else 100, seed=seed)
        if in_two_steps:
            planner.extend(40)
        roadmaps.append(planner.roadmap)
    for roadmap in roadmaps[1:]:
        assert np.array_equal(roadmap.points, roadmaps[0].points)
        assert np.array_equal(roadmap.edges, roadmaps[0].edges)


@settings(max_examples=20)
@given(kinds, seeds, st.integers(1, 100))
def test_a_roadmap_that_was_extended_is_the_one_that_was_built_at_once(kind, seed, first):
    space = spaces(OPEN)[kind]
    once, twice = (PRMPlanner(space, connection_radius=2.5) for _ in range(2))
    once.build_roadmap(130, seed=seed)
    twice.build_roadmap(first, seed=seed)
    twice.extend(130 - first)
    edges = [set(map(tuple, planner.roadmap.edges.tolist())) for planner in (once, twice)]
    assert np.array_equal(once.roadmap.points, twice.roadmap.points) and edges[0] == edges[1]


def content(planner):
    """Return all of a roadmap but what is known of it."""
    roadmap = planner.roadmap
    return [roadmap.points.tobytes(), roadmap.edges.tobytes(), roadmap.lengths.tobytes(), roadmap.radius,
            roadmap.difficult.tobytes()]


@settings(max_examples=25)
@given(environments(), kinds, seeds, st.sampled_from(CollisionCheckingStrategy))
def test_a_query_leaves_the_roadmap_as_it_was_and_is_answered_alike_again(environment, kind, seed, checking):
    space = spaces(environment)[kind]
    pair = ends(space, seed)
    planner = PRMPlanner(space, collision_checking=checking, enhancements=2)
    if pair is None:
        return
    planner.build_roadmap(60, seed=seed)
    before, known = content(planner), planner.roadmap.edge_states.copy()
    first = planner.query(*pair)
    planner.query(*pair[::-1])
    again = planner.query(*pair)
    assert content(planner) == before
    assert ((known == 0) | (known == planner.roadmap.edge_states)).all()
    assert first.status is again.status and first.cost == again.cost and np.array_equal(first.path, again.path)


@settings(max_examples=25)
@given(environments(footprint=st.sampled_from((0.0, 0.25))), seeds, st.sampled_from(CollisionCheckingStrategy))
def test_no_path_enters_a_shape(environment, seed, checking):
    planner = PRMPlanner(environment, collision_checking=checking, enhancements=3)
    pair = ends(planner._space, seed)
    if pair is None:
        return
    planner.build_roadmap(80, seed=seed)
    path = planner.query(*pair).path
    if len(path) > 1:
        line = shapely.LineString(path)
        room = environment.footprint.radius - 2e-3
        for obstacle in environment.obstacles:
            is_round = hasattr(obstacle, 'radius')
            core = (shapely.Point(obstacle.centroid).buffer(obstacle.radius + room, 64) if is_round and
                    obstacle.radius + room > 0 else shapely.Polygon() if is_round else
                    shapely.Polygon(obstacle.vertices).buffer(room))
            assert not line.intersects(core)
        assert (np.hypot(*np.diff(path, axis=0).T) <= 0.05 + 1e-9).all()


@settings(max_examples=20)
@given(kinds, seeds)
def test_more_nodes_never_raise_the_cost(kind, seed):
    space = spaces(OPEN)[kind]
    pair = ends(space, seed)
    planner = PRMPlanner(space, connection_radius=3.0, enhancements=0)
    planner.build_roadmap(40, seed=seed)
    costs = [planner.query(*pair).cost]
    for _ in range(3):
        planner.extend(40)
        costs.append(planner.query(*pair).cost)
    assert all(later <= earlier + 1e-9 for earlier, later in zip(costs, costs[1:]))


@settings(max_examples=20)
@given(environments(), seeds)
def test_another_obstacle_never_lowers_the_cost(environment, seed):
    planner = PRMPlanner(environment, enhancements=0)
    planner.build_roadmap(80, seed=seed)
    harder = Environment(environment.boundary, [*environment.obstacles, RoundObstacle((5, 5), 1.5)])
    pair = ends(PlaneSpace(harder), seed)
    if pair is None:
        return
    before = planner.query(*pair).cost
    planner.change_environment(harder)
    assert planner.query(*pair).cost >= before - 1e-9
    planner.change_environment(environment)
    assert planner.query(*pair).cost == before


@pytest.mark.parametrize('kind', ['plane', 'dubins', 'joints'])
def test_start_and_goal_may_be_the_same(kind):
    planner = PRMPlanner(spaces(OPEN)[kind])
    planner.build_roadmap(50, seed=1)
    point = [1.0, 1.0, 0.5][:len(planner._space.low)]
    result = planner.query(point, point)
    assert result.status is PlanStatus.SOLVED and result.cost == 0 and np.array_equal(result.path, [point])


@pytest.mark.parametrize('kind', ['plane', 'dubins', 'joints'])
@pytest.mark.parametrize('checking', CollisionCheckingStrategy)
def test_a_sealed_goal_has_no_path_and_that_is_said_by_the_deadline(kind, checking):
    planner = PRMPlanner(spaces(SEALED)[kind], collision_checking=checking, enhancements=3)
    planner.build_roadmap(200, seed=1)
    start, goal = ([1, 1, 0], [7.5, 7.5, 0])
    size = len(planner._space.low)
    assert planner.query(start[:size], goal[:size]).status is PlanStatus.NO_PATH
    began = time.monotonic()
    timed = PRMPlanner(spaces(SEALED)[kind], collision_checking=checking, enhancements=10**6)
    timed.build_roadmap(200, seed=1)
    assert timed.query(start[:size], goal[:size], deadline=0.15).status is PlanStatus.TIMEOUT
    assert time.monotonic() - began < 20


def test_a_query_ends_when_it_is_told_to():
    planner, stop = PRMPlanner(SEALED, enhancements=10**6), np.zeros(1, np.uint8)
    planner.build_roadmap(200, seed=1)
    timer = threading.Timer(0.1, lambda: stop.__setitem__(0, 1))
    timer.start()
    assert planner.query((1, 1), (7.5, 7.5), deadline=30, stop=stop).status is PlanStatus.CANCELLED
    timer.join()
    asked = iter([False] * 20)
    planner = PRMPlanner(SEALED, stop_criterion=lambda: next(asked, True), enhancements=10**6)
    planner.build_roadmap(200, seed=1)
    assert planner.query((1, 1), (7.5, 7.5), deadline=30).status is PlanStatus.CANCELLED


def test_a_star_that_has_no_time_leaves_the_rest_to_dijkstra():
    patient, hasty = PRMPlanner(OPEN), PRMPlanner(OPEN, a_star_timeout=1e-9)
    for planner in (patient, hasty):
        planner.build_roadmap(2000, seed=1)
    expected, result = (planner.query((1, 5), (9, 5)) for planner in (patient, hasty))
    assert result.cost == pytest.approx(expected.cost) and result.iterations > expected.iterations


def test_a_lazy_query_checks_far_fewer_edges_than_there_are():
    planner = PRMPlanner(load_problem(PROBLEMS / 'maze_10.json').environment)
    planner.build_roadmap(3000, seed=1)
    checks = planner.query((2.5, 2.5), (22.5, 2.5)).collision_checks
    assert 0 < checks < len(planner.roadmap.edges) / 2
    assert planner.query((2.5, 2.5), (22.5, 2.5)).collision_checks < checks / 5


@pytest.mark.parametrize('name', ['bug_trap', 'maze_10', 'narrow_zigzag'])
@pytest.mark.parametrize('checking', [LAZY, FULL])
def test_public_problems_are_solved(name, checking):
    problem = load_problem(PROBLEMS / f'{name}.json')
    planner = PRMPlanner(problem.environment, collision_checking=checking)
    planner.build_roadmap(4000, seed=3)
    queries = [(problem.start, problem.goal, problem.best_known['cost']),
               *((query.start, query.goal, query.cost) for query in problem.queries)]
    for start, goal, best in queries:
        result = planner.query(start, goal, deadline=10.0)
        assert result.status is PlanStatus.SOLVED and best - 1e-6 <= result.cost <= 1.15 * best
        assert problem.environment.free_poses(result.path).all()


def test_a_car_drives_through_the_forest():
    problem = load_problem(PROBLEMS / 'forest_60.json')
    planner = PRMPlanner(problem.environment, turning_radius=problem.turning_radius)
    planner.build_roadmap(1000, seed=1)
    result = planner.query(problem.start, problem.goal, deadline=10.0)
    assert result.status is PlanStatus.SOLVED and result.cost <= 1.15 * problem.best_known['cost']
    assert problem.environment.free_poses(result.path).all()
    assert result.cost == pytest.approx(dubins_lengths(result.path[:-1], result.path[1:], 4.0).sum())


def test_a_world_of_narrow_passages_is_solved_although_no_even_sample_is_in_them():
    planner = PRMPlanner(NARROW, collision_checking=FULL)
    planner.build_roadmap(150, seed=5)
    result = planner.query((5, 5), (50, 5), deadline=10.0)
    assert result.status is PlanStatus.SOLVED and result.nodes > 150 == planner.statistics().nodes


@pytest.mark.parametrize('strategy', SamplingStrategy)
def test_the_same_seed_makes_the_same_roadmap_and_leaves_numpy_alone(strategy):
    state = np.random.get_state()[1].copy()
    planners = [PRMPlanner(NARROW, sampler=strategy, collision_checking=NODECHECK) for _ in range(2)]
    results = []
    for planner in planners:
        planner.build_roadmap(1500, seed=9)
        results.append(planner.query((5, 5), (50, 5)))
    assert content(planners[0]) == content(planners[1])
    assert results[0].cost == results[1].cost and np.array_equal(results[0].path, results[1].path)
    assert np.array_equal(np.random.get_state()[1], state)


def test_another_process_finds_the_same_path_to_the_last_bit():
    code = ('from mobile_planning import Boundary, Environment, PRMPlanner, RoundObstacle\n'
            'planner = PRMPlanner(Environment(Boundary((0, 10), (0, 10)), [RoundObstacle((5, 5), 2)]))\n'
            'planner.build_roadmap(500, seed=7)\n'
            'print(planner.query((1, 1), (9, 9)).path.tobytes().hex())')
    told = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True, timeout=300,
                          env={**os.environ, 'PYTHONHASHSEED': '7'}, cwd=PROBLEMS.parents[2])
    planner = PRMPlanner(OPEN)
    planner.build_roadmap(500, seed=7)
    assert told.stdout.strip() == planner.query((1, 1), (9, 9)).path.tobytes().hex(), told.stderr


def test_a_seed_that_was_drawn_is_told_and_makes_the_same_roadmap_again():
    first, again = PRMPlanner(OPEN), PRMPlanner(OPEN)
    first.build_roadmap(100)
    again.build_roadmap(100, seed=first.seed)
    assert content(first) == content(again) and first.query((1, 1), (9, 9)).seed == first.seed


def test_the_users_sampler_and_constraint_are_heeded():
    planner = PRMPlanner(OPEN, sampler=lambda random, count: random.uniform((0, 6), (10, 10), (count, 2)),
                         constraint=lambda points: points[:, 1] > 4.5)
    planner.build_roadmap(500, seed=1)
    assert (planner.roadmap.points[:, 1] >= 6).all()
    assert (planner.query((1, 5), (9, 5)).path[:, 1] > 4.5).all()
    with pytest.raises(StartOccupied):
        planner.query((1, 1), (9, 5))


def arm_points(q, links=6, step=12):
    """Return points (m, k, 2) on an arm of six links of 0.5 m that stands at (2, 2), at configurations (m, 6)."""
    angles = np.cumsum(q, axis=1)
    bones = 0.5 * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    joints = np.concatenate([np.zeros((len(q), 1, 2)), np.cumsum(bones, axis=1)], axis=1) + 2.0
    along = np.linspace(0, 1, step)[:, None, None, None]
    between = joints[:, :-1] + along * (joints[:, 1:] - joints[:, :-1])
    return np.moveaxis(between, 0, 2).reshape(len(q), links * step, 2)


def test_an_arm_of_six_joints_moves_between_discs():
    discs = [((4.0, 3.0), 0.6), ((0.5, 3.5), 0.5), ((3.0, 4.2), 0.4)]

    def free(q):
        points = arm_points(q)
        rooms = [np.hypot(*(points - centre).transpose(2, 0, 1)).min(axis=1) - radius for centre, radius in discs]
        return np.min(rooms, axis=0) > 0.05

    low, high = np.full(6, -1.5), np.full(6, 1.5)
    weights = joint_weights(lambda q: arm_points(q)[:, -1], low, high, seed=1)
    assert (np.diff(weights) < 0).all() and weights[0] <= 3 + 1e-6
    space = JointSpace(low, high, free, weights=weights, resolution=0.1)
    planner = PRMPlanner(space, partial_index_dimensions=3)
    planner.build_roadmap(800, seed=2)
    start, goal = [1.5, 0, 0, 0, 0, 0], [-0.2, 0, 0, 0, 0, 0]
    result = planner.query(start, goal, deadline=60.0)
    assert result.is_solved and np.array_equal(result.path[[0, -1]], [start, goal])
    # No point of the arm moves further between two checks than the resolution.
    points = arm_points(result.path)
    assert (np.hypot(*np.diff(points, axis=0).transpose(2, 0, 1)).max() <= 0.05 * np.sqrt(6))
    for centre, radius in discs:
        assert np.hypot(*(points - centre).transpose(2, 0, 1)).min() > radius


def test_the_radius_gives_nodes_as_many_neighbours_as_were_asked_for():
    for kind, space in spaces(Environment(Boundary((0, 10), (0, 10)))).items():
        planner = PRMPlanner(space, neighbor_count=15)
        planner.build_roadmap(1500, seed=2)
        assert 11 < planner.statistics().mean_neighbours < 19, kind


def test_statistics_tell_what_is_known():
    planner = PRMPlanner(OPEN, collision_checking=FULL)
    planner.build_roadmap(300, seed=1)
    facts = planner.statistics()
    assert facts.nodes == facts.checked_nodes == 300 and facts.edges == facts.checked_edges > 0
    assert facts.blocked_nodes == facts.blocked_edges == 0
    times = planner.time_statistics
    assert 0 < times.collision < times.total and times.search == 0
    planner.query((1, 1), (9, 9))
    assert planner.time_statistics.neighbours == 0 < planner.time_statistics.search
    lazy = PRMPlanner(OPEN)
    lazy.build_roadmap(300, seed=1)
    assert lazy.statistics().checked_edges == 0
    lazy.query((1, 1), (9, 9))
    assert lazy.statistics().checked_edges > 0


def test_the_time_statistics_are_written_where_they_are_wanted(capsys):
    planner = PRMPlanner(OPEN)
    planner.build_roadmap(20, seed=1)
    planner.print_time_stats()
    assert capsys.readouterr().out == f'{planner.time_statistics}\n'


def test_strategies_change_but_not_under_a_roadmap_that_was_built_with_them():
    planner = PRMPlanner(OPEN)
    planner.set_collision_checking_strategy(PRMPlanner.NODECHECK)
    planner.set_neighbor_count(8)
    planner.set_neigh_search_strategy(PRMPlanner.KDTREE)
    planner.set_partial_index_table_dimensions(1)
    planner.build_roadmap(100, seed=1)
    planner.set_shortest_path_search_strategy(PRMPlanner.DIJKSTRA)
    planner.set_a_star_time_out_time(2.0)
    for change, value in ((planner.set_collision_checking_strategy, LAZY), (planner.set_neighbor_count, 9)):
        with pytest.raises(StrategyLocked):
            change(value)
    assert planner.options.collision_checking is NODECHECK and planner.options.shortest_path_search is DIJKSTRA
    planner.clear()
    planner.set_collision_checking_strategy(PRMPlanner.LAZY)
    with pytest.raises(NotBuilt):
        planner.query((1, 1), (9, 9))


@pytest.mark.parametrize('options', [
    {'neighbour_count': 3}, {'neighbor_count': 0}, {'neighbor_count': 2.0}, {'neighbor_count': True},
    {'connection_radius': 0.0}, {'connection_radius': np.nan}, {'a_star_timeout': -1}, {'resolution': 0},
    {'partial_index_dimensions': 0}, {'partial_index_dimensions': 3}, {'turning_radius': -1.0},
    {'turning_radius': np.inf}, {'collision_checking': 'lazy'}, {'neighbor_search': 1}, {'sampler': 'uniform'},
    {'constraint': 3}, {'stop_criterion': 3}, {'enhancements': -1}, {'shortest_path_search': LAZY}])
def test_bad_options_are_refused(options):
    with pytest.raises(InvalidInput):
        PRMPlanner(OPEN, **options)


@pytest.mark.parametrize('start, goal, error', [
    ((1, 1, 0), (9, 9), InvalidInput), ((np.nan, 1), (9, 9), InvalidInput), (('a', 1), (9, 9), InvalidInput),
    ((1, 1), (np.inf, 9), InvalidInput), ((-1, 1), (9, 9), StartOutside), ((1, 1), (9, 10.1), GoalOutside),
    ((5, 5), (9, 9), StartOccupied), ((1, 1), (5, 6), GoalOccupied)])
def test_bad_ends_are_refused(start, goal, error):
    planner = PRMPlanner(OPEN)
    planner.build_roadmap(50, seed=1)
    before = content(planner)
    with pytest.raises(error):
        planner.query(start, goal)
    assert content(planner) == before


def test_bad_numbers_change_nothing():
    planner = PRMPlanner(OPEN)
    with pytest.raises(NotBuilt):
        planner.extend(3)
    planner.build_roadmap(50, seed=1)
    before = content(planner)
    for call in (lambda: planner.build_roadmap(0), lambda: planner.build_roadmap(2.5), lambda: planner.extend(-1),
                 lambda: planner.build_roadmap(5, seed=-1), lambda: planner.build_roadmap(5, seed=0.5),
                 lambda: planner.query((1, 1), (9, 9), deadline=0.0), lambda: planner.query((1, 1), (9, 9), seed=-2)):
        with pytest.raises(InvalidInput):
            call()
    with pytest.raises(PlanningTimeout):
        planner.build_roadmap(10**6, deadline=0.02)
    with pytest.raises(Cancelled):
        planner.build_roadmap(10**5, stop=np.ones(1, np.uint8))
    assert content(planner) == before and planner.seed == 1


def test_a_radius_that_joins_everything_to_everything_is_refused():
    planner = PRMPlanner(Environment(Boundary((0, 10), (0, 10))), connection_radius=20.0)
    with pytest.raises(LimitExceeded):
        planner.build_roadmap(20_000, seed=1)


def test_a_world_without_room_has_no_roadmap():
    planner = PRMPlanner(JointSpace([0], [1], lambda q: np.zeros(len(q), bool)), collision_checking=FULL)
    with pytest.raises(NoPath):
        planner.build_roadmap(10, seed=1)


def test_headings_may_be_given_whole_turns_away():
    planner = PRMPlanner(OPEN, turning_radius=0.5)
    planner.build_roadmap(300, seed=1)
    costs = [planner.query((1, 1, 0.3 + 2 * np.pi * turns), (9, 9, 0)).cost for turns in (0, 1, -3)]
    assert np.allclose(costs, costs[0])
