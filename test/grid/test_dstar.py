"""D* against Dijkstra on an explicit graph, after any changes, and against the defects it must not have."""
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mobile_planning
from benchmark import movingai_dynamic
from benchmark.dijkstra import cost_field, cost_of_steps
from mobile_planning.errors import (
    Cancelled, GoalOccupied, GoalOutside, InvalidInput, NoMap, NoPath, StartOccupied, StartOutside)
from mobile_planning.grid.distance_transform import DistanceTransformPlanner
from mobile_planning.grid.dstar import DstarPlanner
from mobile_planning.world.occupancy_grid import OccupancyGrid

KINDS = ('uniform', 'whole', 'fractions', 'wild')


def random_costs(random, shape, kind):
    """Return costs of one kind, some of them inf."""
    costs = {'uniform': np.ones(shape), 'whole': random.integers(1, 10, shape),
             'fractions': random.random(shape) + 1e-3, 'wild': np.exp(random.normal(0, 4, shape))}[kind]
    return np.where(random.random(shape) < 0.25, np.inf, costs)


def random_cell(random, shape):
    return int(random.integers(shape[1])), int(random.integers(shape[0]))


def planned(costs, goal, **options):
    planner = DstarPlanner(costs, goal=goal, **options)
    planner.plan()
    return planner


def check(planner, costs, start, corner_cutting):
    """Check the answer from a start against Dijkstra; return the path, None if there is none."""
    x, y = start
    goal = planner.goal
    exact = cost_field(costs, goal, corner_cutting)[y, x]
    if np.isinf(costs[y, x]):
        kind = StartOccupied
    elif np.isinf(costs[goal[1], goal[0]]):
        kind = GoalOccupied
    elif np.isinf(exact):
        kind = NoPath
    else:
        path, status = planner.query(start)
        assert tuple(path[0]) == start and np.array_equal(path[-1], goal)
        assert status.cost == pytest.approx(exact, rel=1e-11, abs=0)
        assert cost_of_steps(costs, path, corner_cutting) == pytest.approx(exact, rel=1e-11, abs=0)
        return path
    with pytest.raises(kind):
        planner.query(start)


@given(st.integers(0, 2 ** 30), st.sampled_from(KINDS), st.booleans(), st.sampled_from([None, 0, 5, 10 ** 9]))
def test_after_any_changes_cost_and_path_are_those_of_a_new_plan(seed, kind, corner_cutting, max_expansions):
    random = np.random.default_rng(seed)
    shape = tuple(random.integers(1, 16, 2))
    costs, goal = random_costs(random, shape, kind), random_cell(random, shape)
    costs[goal[1], goal[0]] = 1.0
    planner = planned(costs, goal, corner_cutting=corner_cutting, max_expansions=max_expansions)
    for _ in range(6):
        changes = [(*random_cell(random, shape), float(random_costs(random, (), kind)))
                   for _ in range(random.integers(0, 9))]
        planner.update(changes)
        for x, y, cost in changes:
            costs[y, x] = cost
        assert np.array_equal(planner.costmap, costs) and np.array_equal(planner.occgrid, np.isinf(costs))
        start = random_cell(random, shape)
        path = check(planner, costs, start, corner_cutting)
        if path is not None:
            assert np.array_equal(path, planned(costs, goal, corner_cutting=corner_cutting).query(start)[0])
    exact = cost_field(costs, goal, corner_cutting)
    np.testing.assert_allclose(planner.distancemap, np.where(np.isinf(costs), np.nan, exact), rtol=1e-11)


@pytest.mark.parametrize('kind, corner_cutting', [('uniform', False), ('whole', True)])
def test_5000_random_changes_each_leave_the_cost_of_a_fresh_dijkstra(kind, corner_cutting):
    random = np.random.default_rng(8)
    costs, goal = random_costs(random, (41, 57), kind), (30, 20)
    planner = planned(costs, goal, corner_cutting=corner_cutting)
    for _ in range(500):
        # Half of the changes lie together, as a sensor sees them.
        at = np.where(np.arange(10)[:, None] < 5, random.integers((57, 41), size=(10, 2)), random.integers((53, 37)))
        at[5:] += random.integers(0, 4, (5, 2))
        new = random_costs(random, 10, kind)
        planner.update(np.column_stack([at, new]))
        for (x, y), cost in zip(at, new):
            costs[y, x] = cost
        check(planner, costs, random_cell(random, costs.shape), corner_cutting)


@pytest.mark.parametrize('kind, corner_cutting', [('uniform', True), ('whole', False)])
def test_10000_changes_of_one_cell_each_leave_the_cost_of_a_fresh_dijkstra(kind, corner_cutting):
    random = np.random.default_rng(9)
    costs, goal, start = random_costs(random, (9, 14), kind), (3, 7), (12, 1)
    planner = planned(costs, goal, corner_cutting=corner_cutting)
    for _ in range(10_000):
        (x, y), cost = random_cell(random, costs.shape), float(random_costs(random, (), kind))
        planner.update([(x, y, cost)])
        costs[y, x] = cost
        check(planner, costs, start, corner_cutting)


@given(st.integers(0, 2 ** 30), st.booleans())
def test_a_robot_that_senses_its_surroundings_never_takes_a_step_that_is_not_on_a_best_path(seed, corner_cutting):
    random = np.random.default_rng(seed)
    shape = tuple(random.integers(4, 20, 2))
    truth, start, goal = random_costs(random, shape, 'whole'), random_cell(random, shape), random_cell(random, shape)
    truth[start[1], start[0]] = truth[goal[1], goal[0]] = 1.0
    known = np.ones(shape)
    walked = []

    def sensor(cell):
        x, y = cell
        if walked:
            before, field = walked[-1]
            step = np.hypot(x - before[0], y - before[1]) * (known[y, x] + known[before[1], before[0]]) / 2
            assert step + field[y, x] == pytest.approx(field[before[1], before[0]])
        seen = [(a, b, truth[b, a]) for b in range(max(0, y - 2), min(shape[0], y + 3))
                for a in range(max(0, x - 2), min(shape[1], x + 3))]
        for a, b, cost in seen:
            known[b, a] = cost
        walked.append((cell, cost_field(known, goal, corner_cutting)))
        return seen

    planner = planned(np.ones(shape), goal, corner_cutting=corner_cutting)
    if np.isinf(cost_field(truth, goal, corner_cutting)[start[1], start[0]]):
        with pytest.raises(NoPath):
            planner.query(start, sensor)
        return
    path, status = planner.query(start, sensor)
    assert [cell for cell, _ in walked] == [tuple(cell) for cell in path[:-1].tolist()]
    assert status.cost == pytest.approx(cost_of_steps(known, path, corner_cutting))


def test_a_sensor_that_reports_nothing_changes_nothing():
    planner = planned(np.ones((6, 9)), (8, 5))
    path, status = planner.query((0, 0), lambda cell: [])
    same, same_status = planner.query((0, 0))
    assert np.array_equal(path, same)
    assert (status.expansions, status.full_replan) == (0, False)
    assert status.cost == pytest.approx(same_status.cost)


def test_the_sensor_is_asked_at_every_cell_but_the_goal():
    asked = []
    planned(np.ones((1, 4)), (3, 0)).query((0, 0), lambda cell: asked.append(cell) or [])
    assert asked == [(0, 0), (1, 0), (2, 0)]


@pytest.mark.parametrize('report', [None, 5, [(1, 2)], 'ab', [(9, 0, 1)], [(-1, 0, 1)], [(0.5, 0, 1)], [(0, 0, 0)],
                                    [(0, 0, -1)], [(0, 0, np.nan)], [(np.nan, 0, 1)], [(1, 2, 3), (1, 2)]])
def test_a_bad_report_is_named_and_changes_nothing(report):
    planner = planned(np.ones((3, 4)), (3, 0))
    with pytest.raises(InvalidInput, match='sensor'):
        planner.query((0, 0), lambda cell: report)
    with pytest.raises(InvalidInput, match='update'):
        planner.update(report)
    with pytest.raises(InvalidInput):
        planner.update([(1, 1, 7.0), (1, 1, -1.0)])
    assert (planner.costmap == 1).all()
    assert len(planner.query((0, 0))[0]) == 4


def test_a_robot_whose_goal_or_cell_becomes_blocked_is_told_so():
    with pytest.raises(GoalOccupied):
        planned(np.ones((3, 4)), (3, 0)).query((0, 0), lambda cell: [(3, 0, np.inf)])
    with pytest.raises(StartOccupied):
        planned(np.ones((3, 4)), (3, 0)).query((0, 0), lambda cell: [(*cell, np.inf)])


def test_the_goal_can_be_blocked_and_freed_again():
    planner = planned(np.ones((5, 5)), (4, 4))
    expected = planner.query((0, 0))
    planner.update([(4, 4, np.inf)])
    with pytest.raises(GoalOccupied):
        planner.query((0, 0))
    assert np.isinf(planner.distancemap[0, 0]) and np.isnan(planner.distancemap[4, 4])
    planner.update([(4, 4, 1.0)])
    path, status = planner.query((0, 0))
    assert np.array_equal(path, expected[0]) and status.cost == expected[1].cost
    planner.update([(4, 4, np.inf)])
    planner.update([(4, 4, 3.0)])
    assert planner.query((0, 0))[1].cost == pytest.approx(expected[1].cost + np.sqrt(2))


def test_of_a_cell_named_twice_the_last_cost_counts():
    planner = planned(np.ones((1, 3)), (2, 0))
    planner.update([(1, 0, np.inf), (1, 0, 5.0)])
    assert planner.query((0, 0))[1].cost == 6.0


def test_a_new_obstacle_is_replanned_more_cheaply_than_from_scratch():
    planner = planned(np.ones((40, 40)), (38, 38))
    from_scratch = planner.nexpand
    planner.update([(10, 10, np.inf)])
    status = planner.query((1, 1))[1]
    assert planner.nexpand - from_scratch == status.expansions < from_scratch / 4
    assert not status.full_replan


def test_updates_wait_for_a_query_and_what_is_undone_costs_nothing():
    planner = planned(np.ones((30, 30)), (28, 28))
    before = planner.nexpand
    planner.update([(x, 15, np.inf) for x in range(30)])
    planner.update([(x, 15, 1.0) for x in range(30)])
    assert planner.nexpand == before
    assert planner.query((1, 1))[1].expansions == 0


def test_a_change_of_everything_is_planned_anew_and_the_status_says_so():
    planner = planned(np.ones((60, 60)), (58, 58))
    planner.update([(x, y, 2.0) for x in range(60) for y in range(60)])
    status = planner.query((1, 1))[1]
    assert status.full_replan and status.expansions == 3600
    assert not planner.query((1, 1))[1].full_replan


def test_the_cap_on_expansions_is_kept():
    costs = np.ones((60, 60))
    planner = planned(costs, (58, 58), max_expansions=10)
    planner.update([(57, y, np.inf) for y in range(59)])
    status = planner.query((1, 1))[1]
    assert status.full_replan and status.expansions <= 10 + 3600


def test_the_status_prints_as_documented():
    status = planned(np.ones((1, 3)), (2, 0)).query((0, 0))[1]
    assert repr(status) == str(status) == '_DstarStatus(cost=np.float64(2.0))'


def test_the_plan_expands_every_cell_once_and_a_second_one_starts_afresh():
    planner = planned(np.ones((6, 6)), (1, 1))
    assert planner.nexpand == 36
    planner.plan((5, 5))
    assert planner.query((4, 4))[1].cost == pytest.approx(np.sqrt(2))


@given(st.integers(0, 2 ** 30), st.booleans())
def test_on_equal_costs_the_path_is_that_of_the_distance_transform(seed, corner_cutting):
    random = np.random.default_rng(seed)
    occupied = random.random((12, 17)) < 0.3
    start, goal = random_cell(random, occupied.shape), random_cell(random, occupied.shape)
    occupied[start[1], start[0]] = occupied[goal[1], goal[0]] = False
    other = DistanceTransformPlanner(occupied, goal=goal, corner_cutting=corner_cutting)
    other.plan()
    planner = planned(np.where(occupied, np.inf, 1.0), goal, corner_cutting=corner_cutting)
    np.testing.assert_allclose(planner.distancemap, other.distancemap)
    if np.isfinite(other.distancemap[start[1], start[0]]):
        assert np.array_equal(planner.query(start)[0], other.query(start))


def test_next_steps_along_the_path_of_the_query():
    planner = planned(np.ones((9, 9)), (4, 4))
    planner.update([(3, 3, np.inf), (2, 4, 9.0)])
    path = planner.query((0, 2))[0]
    steps = [path[0]]
    while (step := planner.next(steps[-1])) is not None:
        steps.append(step)
    assert np.array_equal(steps, path)


def test_neither_the_cost_map_nor_a_report_is_written():
    costs, report = np.ones((4, 4)), np.array([[1, 1, np.inf]])
    for array in (costs, report):
        array.flags.writeable = False
    planner = planned(costs, (3, 3))
    planner.update(report)
    planner.query((0, 0), lambda cell: report)
    assert (costs == 1).all()
    for view in (planner.costmap, planner.occgrid):
        with pytest.raises(ValueError):
            view[0, 0] = 1


def test_an_occupancy_grid_costs_1_where_it_is_free():
    grid = OccupancyGrid(np.array([[0, 64, 100, -1]], np.int8))
    planner = mobile_planning.DstarPlanner(grid)
    assert planner.costmap.tolist() == [[1.0, 1.0, np.inf, np.inf]]
    assert DstarPlanner(grid, unknown_is_free=True).costmap[0, 3] == 1.0


def test_inflation_grows_obstacles_and_an_update_has_the_last_word():
    costs = np.ones((5, 5))
    costs[2, 2] = np.inf
    planner = planned(costs, (4, 2), inflate=1)
    assert planner.occgrid.sum() == 5
    with pytest.raises(StartOccupied, match='within 1 cells'):
        planner.query((1, 2))
    planner.update([(1, 2, 1.0), (2, 2, 1.0), (3, 2, 1.0)])
    assert planner.query((1, 2))[1].cost == 3.0


@pytest.mark.parametrize('costs', [np.zeros((2, 2)), -np.ones((2, 2)), [[1, np.nan]], [[1, -np.inf]], [1, 2], 'map',
                                   np.ones((0, 3)), [[1, 2], [3]]])
def test_a_cost_map_is_an_array_of_positive_numbers(costs):
    with pytest.raises(InvalidInput):
        DstarPlanner(costs)


def test_bad_ends_are_refused():
    planner = DstarPlanner([[1.0, np.inf, 1.0]])
    with pytest.raises(GoalOccupied):
        planner.plan((1, 0))
    with pytest.raises(GoalOutside):
        planner.plan((-1, 0))
    planner.plan((0, 0))
    with pytest.raises(StartOccupied):
        planner.query((1, 0))
    with pytest.raises(StartOutside):
        planner.query((0, -1))
    with pytest.raises(NoPath):
        planner.query((2, 0))
    assert planner.query((0, 0))[0].tolist() == [[0, 0]] and planner.next((0, 0)) is None


def test_what_is_missing_is_named():
    with pytest.raises(NoMap):
        DstarPlanner(goal=(0, 0)).plan()
    with pytest.raises(NoMap):
        DstarPlanner().update([(0, 0, 1.0)])
    planner = DstarPlanner(np.ones((3, 3)))
    with pytest.raises(InvalidInput, match='no goal'):
        planner.plan()
    with pytest.raises(InvalidInput, match='no start'):
        planner.query()
    planner.goal = (1, 1)
    with pytest.raises(RuntimeError, match='plan()'):
        planner.query((0, 0))
    with pytest.raises(TypeError):
        DstarPlanner(np.ones((3, 3)), conectivity=4)


def test_updates_before_the_plan_count():
    planner = DstarPlanner(np.ones((1, 3)), goal=(2, 0))
    planner.update([(1, 0, 3.0)])
    planner.plan()
    assert planner.query((0, 0))[1].cost == 4.0


def test_a_stopped_plan_and_a_stopped_repair_are_finished_by_the_next_query():
    stop, costs = np.ones(1, np.uint8), np.ones((9, 9))
    planner = DstarPlanner(costs, goal=(8, 8))
    with pytest.raises(Cancelled):
        planner.plan(stop=stop)
    check(planner, costs, (0, 0), True)
    costs[4, 1:8] = np.inf
    planner.update([(x, 4, np.inf) for x in range(1, 8)])
    with pytest.raises(Cancelled):
        planner.query((4, 0), stop=stop)
    check(planner, costs, (4, 0), True)
    with pytest.raises(Cancelled):
        planner.query((4, 0), lambda cell: [], stop=stop)


@pytest.mark.parametrize('costs', [np.ones((3000, 3000)), np.arange(1.0, 9e6 + 1).reshape(3000, 3000)])
def test_another_thread_can_stop_a_plan_under_way(costs):
    planner, stop = DstarPlanner(costs, goal=(0, 0)), np.zeros(1, np.uint8)
    timer = threading.Timer(0.02, lambda: stop.fill(1))
    timer.start()
    with pytest.raises(Cancelled):
        while not stop[0]:
            planner.plan(stop=stop)
        planner.plan(stop=stop)
    timer.join()


def test_a_long_life_keeps_the_queue_short():
    planner = planned(np.ones((30, 30)), (0, 0), max_expansions=10 ** 9)
    for i in range(3000):
        planner.update([(25 + i % 3, y, np.inf if i // 3 % 2 else 1.0) for y in range(8)])
        planner.query((10, 10))
    assert planner._field._queue[0].size < 30000


def test_the_plan_can_be_told_and_drawn(capsys, tmp_path):
    planner = DstarPlanner([[1, np.inf, 1], [1, 2, 1]], goal=(0, 0), verbose=True)
    assert planner.distancemap is None and 'plan: none' in str(planner)
    planner.plan()
    assert 'reach the goal (0, 0)' in capsys.readouterr().out
    assert '5 cells reach the goal' in str(planner) and 'expansions: 5' in str(planner)
    planner.plot(planner.query((2, 0))[0]).figure.savefig(tmp_path / 'plan.png')


def test_the_dynamic_scenarios_are_reproduced(data_folder):
    path = data_folder / 'maps' / 'movingai' / 'dynamic' / 'dao_arena2.scen'
    if not path.is_file():
        pytest.skip(f'{path} is missing')
    shape, commands = movingai_dynamic.read_set(path)
    assert movingai_dynamic.wrong_queries(shape, commands) == []
    starts, goal = [(6, 144), (140, 100), (40, 20)], (277, 165)
    errors = list(movingai_dynamic.errors_of_a_fixed_goal(shape, commands, starts, goal, every=9))
    assert len(errors) == 49 and max(errors) < 1e-9


def test_the_documents_options_of_plan_and_query_are_served(capsys, tmp_path):
    planner, shares = DstarPlanner(np.ones((30, 40)), goal=(1, 1)), []
    planner.plan(progress=shares.append, summary=True)
    assert shares[-1] == 1.0 and 'expansions: ' in capsys.readouterr().out
    path, status = planner.query((38, 28), verbose=True, movie=tmp_path / 'drive.gif')
    assert f'{len(path)} points' in capsys.readouterr().out
    assert (tmp_path / 'drive.gif').read_bytes().startswith(b'GIF8')


def test_the_progress_of_a_weighted_plan_grows_to_the_end():
    costs, done = np.random.default_rng(1).uniform(1, 9, (40, 50)), np.zeros(2, np.int64)
    costs[5:, 7] = np.inf
    planner = DstarPlanner(costs, goal=(0, 0))
    planner.plan(progress=done)
    assert done.tolist() == [np.isfinite(costs).sum()] * 2
