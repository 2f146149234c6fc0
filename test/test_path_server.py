"""Poses in metres in, paths in metres out, and a sentence with a code for what cannot be answered."""
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning import errors
from mobile_planning.path_server import FIELD_PLANNERS, PathServer
from mobile_planning.world.cost_to_go import cost_to_go
from mobile_planning.world.map_io import load_map
from mobile_planning.world.occupancy_grid import OccupancyGrid

# Two rooms of 3 x 2 m with a door at the top; the wall is at x = 3 m.
ROOMS = np.zeros((20, 60), np.int8)
ROOMS[:-4, 30] = 100


PLANNERS = ('distance_transform', 'dstar', 'astar', 'lattice', 'bug2')
OPTIMAL = PLANNERS[:3]
FREE = (0.5, 0.5, 0.0)


def server_on(data=ROOMS, resolution=0.1, origin=(0, 0, 0), **options):
    server = PathServer(**options)
    server.set_map(OccupancyGrid(data, resolution, origin))
    return server


def length_of(poses):
    return np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()


def in_threads(function, calls):
    """Call a function with each tuple of arguments, each in a thread of its own, and wait for them all."""
    threads = [threading.Thread(target=function, args=arguments) for arguments in calls]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def ask_while_changing(change, ask, calls):
    """Ask in a thread for each tuple of arguments, while ``change(turn)`` is called over and over in one more."""
    over = threading.Event()

    def keep_changing():
        turn = 0
        while not over.is_set():
            turn += 1
            change(turn)

    changing = threading.Thread(target=keep_changing)
    changing.start()
    in_threads(ask, calls)
    over.set()
    changing.join()


@given(st.tuples(*[st.floats(0.0, 2.9)] * 2), st.tuples(*[st.floats(3.1, 5.9)] * 2), st.floats(-3, 3))
def test_a_path_begins_and_ends_exactly_as_asked_and_heads_along_itself(start, goal, theta):
    server = server_on()
    start, goal = (start[0], start[1] % 1.9, theta), (goal[0], goal[1] % 1.9, -theta)
    poses = server.plan_path('', start, goal).poses
    assert tuple(poses[0]) == start and tuple(poses[-1]) == goal
    ahead = np.diff(poses[1:, :2], axis=0)
    np.testing.assert_allclose(np.exp(1j * poses[1:-1, 2]), ahead @ (1, 1j) / np.hypot(*ahead.T))
    cells = np.floor(poses[:, :2] / 0.1).astype(int)
    assert not ROOMS[cells[:, 1], cells[:, 0]].any()


@pytest.mark.parametrize('origin', [(0, 0, 0), (-3, 7, 0.5), (1e4, -1e4, np.pi)])
def test_a_path_is_in_the_map_frame_wherever_the_map_lies(origin):
    grid = OccupancyGrid(ROOMS, 0.1, origin)
    start, goal = grid.cell_to_world([(2, 3), (57, 1)])
    path = server_on(origin=origin).plan_path('distance_transform', (*start, 0.0), (*goal, 1.0))
    assert path.cost == pytest.approx(length_of(path.poses))
    assert grid.contains(grid.world_to_cell(path.poses[:, :2])).all()
    # 28 cells to the door and 27 from it, up from row 3 to 16 and down to row 1.
    assert path.cost == pytest.approx(0.1 * (28 + 27 + (13 + 15) * (np.sqrt(2) - 1)))


def test_start_and_goal_in_one_cell_give_both_poses():
    path = server_on().plan_path('', (0.51, 0.51, 0.0), (0.58, 0.52, 1.0))
    assert path.poses.tolist() == [[0.51, 0.51, 0.0], [0.58, 0.52, 1.0]]
    assert path.cost == 0.0


def test_a_second_query_to_the_goal_reuses_the_plan_until_the_map_changes():
    server = server_on()
    plans = [server.plan_path('', start, (5.0, 0.5, 0)).statistics['plan'] for start in ((1, 1, 0), (2, 0.2, 0))]
    server.set_map(OccupancyGrid(ROOMS, 0.1))
    plans.append(server.plan_path('', (1, 1, 0), (5.0, 0.5, 0)).statistics['plan'])
    server.set_map(OccupancyGrid(ROOMS[:, ::-1], 0.1))
    plans.append(server.plan_path('', (1, 1, 0), (5.0, 0.5, 0)).statistics['plan'])
    assert plans == ['computed', 'reused', 'reused', 'computed']


def test_only_a_few_plans_are_kept():
    server = server_on()
    for x in np.arange(0.15, 2.5, 0.1):
        server.plan_path('', (0.5, 0.5, 0), (x, 1, 0))
    assert server.plan_path('', (0.5, 0.5, 0), (0.15, 1, 0)).statistics['plan'] == 'computed'


def test_the_same_query_gives_the_same_path_every_time():
    answers = [server_on().plan_path('', (0.5, 0.5, 0), (5.5, 0.5, 0)).poses for _ in range(3)]
    assert np.array_equal(answers[0], answers[1]) and np.array_equal(answers[0], answers[2])


def test_diagonals_keep_off_corners_unless_told_otherwise():
    corner = np.array([[0, 0], [100, 0]], np.int8)
    ends = (0.5, 0.5, 0), (1.5, 1.5, 0)
    assert server_on(corner, 1.0).plan_path('', *ends).cost == 2.0
    assert server_on(corner, 1.0, corner_cutting=True).plan_path('', *ends).cost == np.sqrt(2)


def test_inflation_keeps_the_robots_radius_away_from_obstacles():
    poses = server_on(inflation_radius=0.25).plan_path('', (0.5, 0.5, 0), (5.5, 0.5, 0)).poses
    occupied = (np.argwhere(ROOMS)[:, ::-1] + 0.5) * 0.1
    assert np.hypot(*(poses[:, None, :2] - occupied).T).min() > 0.25


def test_unknown_cells_are_entered_only_when_told_so():
    unknown = np.array([[0, -1, 0]], np.int8)
    ends = (0.5, 0.5, 0), (2.5, 0.5, 0)
    with pytest.raises(errors.NoPath):
        server_on(unknown, 1.0).plan_path('', *ends)
    assert server_on(unknown, 1.0, unknown_is_free=True).plan_path('', *ends).cost == 2.0


@pytest.mark.parametrize('kind, code, planner, start, goal, message', [
    (errors.InvalidPlanner, 201, 'teleport', FREE, FREE, "'teleport' is not one of distance_transform"),
    (errors.StartOutside, 203, '', (-0.1, 0.5, 0), FREE,
     r'start \(-0.1, 0.5\), cell \(-1, 5\), is outside the map of 60 x'),
    (errors.GoalOutside, 204, '', FREE, (0.5, 2.0, 0), r'goal \(0.5, 2\), cell \(5, 20\), is outside'),
    (errors.StartOccupied, 205, '', (3.05, 0.55, 0), FREE,
     r'start \(3.05, 0.55\), cell \(30, 5\), is occupied; the nearest free cell \((29|31), 5\) is 0.10 m away'),
    (errors.GoalOccupied, 206, '', FREE, (3.05, 0.55, 0), r'goal \(3.05, 0.55\), cell \(30, 5\), is occupied'),
    (errors.InvalidInput, 251, '', (np.nan, 0, 0), FREE, 'start .*nan'),
    (errors.InvalidInput, 251, '', FREE, (0, 0, np.inf), 'goal .*inf'),
    (errors.InvalidInput, 251, '', (0, 0), FREE, 'start .*three'),
    (errors.InvalidInput, 251, '', 'here', FREE, 'start .*pose'),
])
def test_a_query_that_cannot_be_answered_says_why(kind, code, planner, start, goal, message):
    server = server_on()
    with pytest.raises(kind, match=message) as caught:
        server.plan_path(planner, start, goal)
    assert caught.value.code == code
    assert server.plan_path('', FREE, (5, 0.5, 0)).cost > 0


@pytest.mark.parametrize('options', [
    {'deadline': 0.0}, {'deadline': -1.0}, {'deadline': np.nan}, {'tolerance': -0.1}, {'tolerance': np.inf}])
def test_a_number_out_of_its_range_is_invalid(options):
    with pytest.raises(errors.InvalidInput):
        server_on().plan_path('', FREE, FREE, **options)


def test_the_servers_own_options_are_checked():
    with pytest.raises(errors.InvalidPlanner):
        PathServer('teleport')
    with pytest.raises(errors.InvalidInput):
        PathServer(inflation_radius=np.nan)
    with pytest.raises(errors.InvalidInput, match='not above 0'):
        PathServer(turning_radius=0.0)
    for reverse_cost in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(errors.InvalidInput, match='reverse cost'):
            PathServer(reverse_cost=reverse_cost)
    assert PathServer().planners == PLANNERS


def test_there_is_no_path_before_there_is_a_map():
    with pytest.raises(errors.NoMap) as caught:
        PathServer().plan_path('', FREE, FREE)
    assert caught.value.code == 250


def test_no_path_is_told_in_metres():
    walled = ROOMS.copy()
    walled[:, 30] = 100
    with pytest.raises(errors.NoPath, match=r'no path leads from start \(0.5, 0.5\) to goal \(5, 1\)') as caught:
        server_on(walled).plan_path('', FREE, (5, 1, 0))
    assert caught.value.code == 208


def test_a_goal_within_the_inflation_is_told_from_an_obstacle():
    with pytest.raises(errors.GoalOccupied, match='within the inflation radius of 0.3 m'):
        server_on(inflation_radius=0.3).plan_path('', FREE, (2.85, 0.5, 0))


def test_a_map_without_a_free_cell_says_so():
    with pytest.raises(errors.StartOccupied, match='no cell is free'):
        server_on(np.full((40, 30), 100)).plan_path('', FREE, FREE)


def test_an_occupied_goal_goes_to_the_nearest_cell_within_the_tolerance():
    data = ROOMS.copy()
    data[2:9, 44:55] = 100
    data[5, 49] = 0  # free, but walled in
    server = server_on(data)
    goal = (4.66, 0.55, 0.7)
    with pytest.raises(errors.GoalOccupied, match='beyond the tolerance of 0.2 m'):
        server.plan_path('', FREE, goal, tolerance=0.2)
    path = server.plan_path('', FREE, goal, tolerance=0.5)
    np.testing.assert_allclose(path.poses[-1], (4.35, 0.55, 0.7))
    assert path.statistics['goal_moved'] == '0.310 m'


def test_a_tolerance_moves_no_free_goal():
    path = server_on().plan_path('', FREE, (5, 1, 0), tolerance=1.0)
    assert tuple(path.poses[-1]) == (5, 1, 0) and 'goal_moved' not in path.statistics


@given(st.integers(0, 2 ** 30))
def test_the_nearest_reachable_cell_is_nearest_of_all(seed):
    random = np.random.default_rng(seed)
    data = (random.random((30, 40)) < 0.6).astype(np.int8) * 100
    data[0, 0], data[29, 39] = 0, 100
    goal = random.uniform((39, 29), (40, 30))
    path = server_on(data, 1.0).plan_path('', (0.5, 0.5, 0), (*goal, 0), tolerance=100.0)
    reached, rest = {(0, 0)}, [(0, 0)]
    while rest:
        x, y = rest.pop()
        for cell in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
            if 0 <= cell[0] < 40 and 0 <= cell[1] < 30 and not data[cell[1], cell[0]] and cell not in reached:
                reached.add(cell)
                rest.append(cell)
    nearest = np.hypot(*(np.array(list(reached)) + 0.5 - goal).T).min()
    assert np.hypot(*(path.poses[-1, :2] - goal)) == pytest.approx(nearest)


def test_a_deadline_that_passed_is_a_timeout():
    with pytest.raises(errors.PlanningTimeout, match='deadline of 1e-09 s') as caught:
        server_on().plan_path('', FREE, (5, 1, 0), deadline=1e-9)
    assert caught.value.code == 207


def test_a_deadline_ends_a_field_under_way():
    server = server_on(np.zeros((3000, 3000), np.int8))
    with pytest.raises(errors.PlanningTimeout):
        server.plan_path('', FREE, (299, 299, 0), deadline=0.005)


def test_a_deadline_that_suffices_changes_nothing():
    answer = server_on().plan_path('', FREE, (5, 1, 0), deadline=60.0, stop=np.zeros(1, np.uint8))
    assert np.array_equal(answer.poses, server_on().plan_path('', FREE, (5, 1, 0)).poses)


@pytest.mark.parametrize('planner', PLANNERS)
def test_what_is_done_of_a_field_is_counted_for_another_thread_to_see(planner):
    server, done, again = server_on(), np.zeros(2, np.int64), np.zeros(2, np.int64)
    server.plan_path(planner, FREE, (5, 1, 0), done=done)
    server.plan_path(planner, FREE, (5, 1, 0), done=again)
    if planner in FIELD_PLANNERS:
        assert ROOMS.size / 2 < done[0] <= done[1]
    else:
        assert done.tolist() == [0, 0]
    assert again.tolist() == [0, 0]


def test_a_withdrawn_query_is_cancelled_and_the_server_serves_on():
    server, stop = server_on(), np.ones(1, np.uint8)
    with pytest.raises(errors.Cancelled) as caught:
        server.plan_path('', FREE, (5, 1, 0), stop=stop, deadline=60.0)
    assert caught.value.code == 253
    assert server.plan_path('', FREE, (5, 1, 0)).cost > 0


def test_a_map_replaced_while_plans_run_never_gives_an_answer_from_a_mix():
    # On one map the door is at the top, on the other at the bottom, and they lie 100 m apart.
    grids = [OccupancyGrid(ROOMS[::turn], 0.1, (0, y, 0)) for turn, y in ((1, 0), (-1, 100))]
    server = PathServer()
    server.set_map(grids[0])
    expected = {i: server_on(ROOMS[::turn], origin=(0, y, 0)).plan_path('', (0.5, y + 1, 0), (5.5, y + 1, 0)).poses
                for i, (turn, y) in enumerate(((1, 0), (-1, 100)))}
    wrong = []

    def ask(i, y):
        answers = 0
        for _ in range(20000):
            if answers >= 30:
                return
            try:
                poses = server.plan_path('', (0.5, y + 1, 0), (5.5, y + 1, 0)).poses
            except errors.StartOutside:
                continue  # the other map is up
            answers += 1
            if not np.array_equal(poses, expected[i]):
                wrong.append(poses)

    ask_while_changing(lambda turn: server.set_map(grids[turn % 2]), ask, ((0, 0), (0, 0), (1, 100)))
    assert wrong == []


def test_queries_from_many_threads_to_one_goal_do_not_disturb_each_other():
    server = server_on()
    starts = [(0.15 + 0.1 * i, 0.35, 0.0) for i in range(20)]
    expected = [server.plan_path('', start, (5.5, 1, 0)).poses for start in starts]
    wrong = []

    def ask(i):
        for _ in range(50):
            if not np.array_equal(server.plan_path('', starts[i], (5.5, 1, 0)).poses, expected[i]):
                wrong.append(i)

    in_threads(ask, [(i,) for i in range(len(starts))])
    assert wrong == []


def is_free_way(poses, occupied, resolution):
    """Return whether the points of a path lie in free cells."""
    cells = np.floor(poses[:, :2] / resolution).astype(int)
    return not occupied[cells[:, 1], cells[:, 0]].any()


@pytest.mark.parametrize('planner', PLANNERS)
def test_every_planner_joins_the_ends_through_free_cells(planner):
    start, goal = (0.55, 0.55, 0.3), (5.45, 0.35, -1.5)
    path = server_on(turning_radius=0.3).plan_path(planner, start, goal)
    assert tuple(path.poses[0]) == start and tuple(path.poses[-1]) == goal
    assert is_free_way(path.poses, ROOMS, 0.1)
    assert path.cost >= server_on().plan_path('', start, goal).cost * 0.9 and path.statistics['planner'] == planner


@pytest.mark.parametrize('planner', PLANNERS)
@pytest.mark.parametrize('start, goal, code', [
    ((-1, 0, 0), FREE, 203), (FREE, (0, 99, 0), 204), ((3.05, 0.5, 0), FREE, 205), (FREE, (3.05, 0.5, 0), 206)])
def test_every_planner_refuses_what_it_cannot_answer_with_the_same_code(planner, start, goal, code):
    with pytest.raises(errors.PlanningError) as caught:
        server_on().plan_path(planner, start, goal)
    assert caught.value.code == code


@pytest.mark.parametrize('planner', PLANNERS)
def test_every_planner_says_when_there_is_no_path(planner):
    walled = ROOMS.copy()
    walled[:, 30] = 100
    with pytest.raises(errors.NoPath, match=r'from start \(0.5, 0.5\) to goal \(5, 1\)'):
        server_on(walled).plan_path(planner, FREE, (5, 1, 0))


@pytest.mark.parametrize('planner', PLANNERS)
def test_every_planner_ends_at_its_deadline_and_serves_on(planner):
    rows = np.zeros((1500, 1500), np.int8)
    rows[3::4, :-1], rows[1::4, 1:] = 100, 100
    server = server_on(rows, 0.1, turning_radius=0.1)
    goal = (0.05, 149.65, 0.0)
    with pytest.raises(errors.PlanningTimeout):
        server.plan_path(planner, (0.05, 0.05, 0), goal, deadline=0.01)
    assert server.plan_path(planner, (0.15, 0.05, 0), (5.05, 0.05, 0), deadline=60.0).cost > 0


def random_grid(seed, share=0.3, shape=(18, 23)):
    """Return a random grid with free corners, and the generator."""
    random = np.random.default_rng(seed)
    data = np.where(random.random(shape) < share, 100, 0).astype(np.int8)
    data[0, 0] = data[-1, -1] = 0
    return data, random


def answer(server, planner, start, goal):
    """Return the cost of a path, inf if there is none."""
    try:
        return server.plan_path(planner, start, goal).cost
    except errors.NoPath:
        return np.inf


CORNERS = (0.5, 0.5, 0.0), (22.5, 17.5, 0.0)


@given(st.integers(0, 2 ** 30), st.booleans())
def test_planners_of_shortest_paths_agree_after_every_update(seed, corner_cutting):
    data, random = random_grid(seed)
    server = server_on(data, 1.0, corner_cutting=corner_cutting)
    for _ in range(5):
        costs = [answer(server, planner, *CORNERS) for planner in OPTIMAL]
        assert costs == pytest.approx([costs[0]] * 3)
        assert (answer(server, 'bug2', *CORNERS) < np.inf) == (costs[0] < np.inf)
        cells = random.integers((1, 0), (23, 17), (random.integers(1, 12), 2))
        server.update_costs(cells, random.choice([1.0, np.inf], len(cells)))
        fresh = server_on(np.where(server._site.terrain.occupied, 100, 0), 1.0, corner_cutting=corner_cutting)
        assert answer(server, 'dstar', *CORNERS) == pytest.approx(answer(fresh, '', *CORNERS))


@given(st.integers(0, 2 ** 30), st.booleans())
def test_dstar_and_astar_heed_costs_and_give_what_a_fresh_server_gives(seed, corner_cutting):
    data, random = random_grid(seed)
    server = server_on(data, 1.0, corner_cutting=corner_cutting)
    for _ in range(4):
        cells = random.integers((1, 0), (23, 17), (random.integers(1, 12), 2))
        server.update_costs(cells, random.choice([0.5, 1.0, 3.7, np.inf], len(cells)))
        fresh = server_on(data, 1.0, corner_cutting=corner_cutting)
        fresh.update_costs(*server.updates)
        costs = [answer(one, planner, *CORNERS) for one in (server, fresh) for planner in ('dstar', 'astar')]
        assert costs == pytest.approx([costs[0]] * 4)
        if costs[0] < np.inf:
            paths = [one.plan_path('dstar', *CORNERS).poses for one in (server, fresh, server)]
            assert np.array_equal(paths[0], paths[1]) and np.array_equal(paths[0], paths[2])


@given(st.integers(0, 2 ** 30))
def test_a_map_that_differs_in_a_few_cells_repairs_a_plan_and_forgets_updates(seed):
    data, random = random_grid(seed)
    server = server_on(data, 1.0)
    for _ in range(3):
        answer(server, 'dstar', *CORNERS)
        if random.random() < 0.5:
            server.update_costs(random.integers((1, 0), (23, 17), (4, 2)), [2.0, np.inf, 1.0, 0.3])
        data[random.integers(0, 17, 3), random.integers(1, 23, 3)] = random.choice([0, 100])
        server.set_map(OccupancyGrid(data, 1.0))
        assert len(server.updates[1]) == 0
        expected = answer(server_on(data, 1.0), '', *CORNERS)
        assert [answer(server, planner, *CORNERS) for planner in OPTIMAL] == pytest.approx([expected] * 3)


def test_an_update_repairs_the_plan_of_dstar_and_leaves_the_others_that_it_does_not_concern():
    server = server_on(np.zeros((300, 300), np.int8), 0.1)
    ends = (1.05, 15.05, 0), (29.05, 15.05, 0)

    def plans():
        return [server.plan_path(planner, *ends).statistics['plan'] for planner in ('distance_transform', 'dstar')]

    assert plans() == ['computed', 'computed'] and plans() == ['reused', 'reused']
    server.update_costs([(20, 150)], [5.0])
    assert plans() == ['reused', 'repaired']
    server.update_costs([(30, 150)], [np.inf])
    assert plans() == ['computed', 'repaired']
    for x in range(200):
        # More than a map remembers one by one.
        server.update_costs([(x, 299)], [np.inf])
    answers = [server.plan_path('dstar', *ends), server.plan_path('astar', *ends)]
    assert answers[0].cost == pytest.approx(answers[1].cost)
    assert int(answers[0].statistics['expansions']) < 90_000


@pytest.mark.parametrize('cells, costs, kind, words', [
    ([(60, 0)], [1.0], errors.InvalidInput, r'\(60, 0\)'), ([(0, -1)], [1.0], errors.InvalidInput, r'\(0, -1\)'),
    ([(0.5, 0)], [1.0], errors.InvalidInput, '0.5'), ([(0, 0)], [0.0], errors.InvalidInput, 'cost 0.0'),
    ([(0, 0)], [np.nan], errors.InvalidInput, 'nan'), ([(0, 0)], [-2.0], errors.InvalidInput, '-2'),
    ([(0, 0)], [1.0, 2.0], errors.InvalidInput, 'not'), ([(np.nan, 0)], [1.0], errors.InvalidInput, 'nan'),
    ('cells', [1.0], errors.InvalidInput, 'numbers'),
    (np.zeros((1_000_001, 2), int), np.ones(1_000_001), errors.LimitExceeded, '1000001 cells: the limit is 1000000')])
def test_a_bad_update_changes_nothing(cells, costs, kind, words):
    server = server_on()
    before = server.plan_path('dstar', FREE, (5, 1, 0))
    if len(cells) == 1:
        cells, costs = [(30, 19), *cells], [np.inf, *costs]
    with pytest.raises(kind, match=words):
        server.update_costs(cells, costs)
    after = server.plan_path('dstar', FREE, (5, 1, 0))
    assert np.array_equal(before.poses, after.poses) and after.statistics['plan'] == 'reused'


def test_an_update_needs_a_map_and_may_be_empty():
    with pytest.raises(errors.NoMap):
        PathServer().update_costs([(0, 0)], [1.0])
    server = server_on()
    server.update_costs([], [])
    server.update_costs(np.empty((0, 2), int), np.empty(0))
    assert server.plan_path('', FREE, (5, 1, 0)).cost > 0


def test_a_start_that_an_update_blocked_is_occupied():
    server = server_on(inflation_radius=0.15)
    server.update_costs([(5, 5)], [np.inf])
    with pytest.raises(errors.StartOccupied, match='since an update') as caught:
        server.plan_path('', (0.55, 0.55, 0), (5, 1, 0))
    assert caught.value.code == 205


@pytest.mark.parametrize('planner', PLANNERS)
def test_a_start_within_the_inflation_is_left_by_the_shortest_way(planner):
    server = server_on(inflation_radius=0.25, turning_radius=0.2)
    # Two cells beside the wall, which lies on column 30; the first free column is 27.
    path = server.plan_path(planner, (2.95, 0.55, 0), (0.55, 0.55, np.pi))
    assert path.statistics['left_inflation'] == '0.200 m'
    assert path.poses[2, :2] == pytest.approx((2.75, 0.55))
    assert is_free_way(path.poses, ROOMS, 0.1)
    assert 'left_inflation' not in server.plan_path(planner, (2.75, 0.55, np.pi), (0.55, 0.55, np.pi)).statistics


@given(st.integers(0, 2 ** 30))
def test_the_way_out_of_the_inflation_is_the_shortest_to_where_the_goal_is_reached(seed):
    data, random = random_grid(seed, 0.12)
    server = server_on(data, 1.0, inflation_radius=1.0)
    terrain = server._site.terrain
    inside = np.argwhere(terrain.occupied & ~terrain.obstacles)[:, ::-1]
    free = np.argwhere(~terrain.occupied)[:, ::-1]
    if len(inside) == 0 or len(free) == 0:
        return
    start, goal = random.choice(inside), random.choice(free)
    reaching = np.isfinite(cost_to_go(terrain.occupied, goal, corner_cutting=False))
    expected = cost_to_go(terrain.obstacles, start, corner_cutting=False)[reaching].min()
    ends = (*start + 0.5, 0), (*goal + 0.5, 0)
    if np.isinf(expected):
        with pytest.raises(errors.NoPath, match='no way leads out'):
            server.plan_path('', *ends)
        return
    for planner in OPTIMAL:
        path = server.plan_path(planner, *ends)
        assert float(path.statistics['left_inflation'].split()[0]) == pytest.approx(expected, abs=1e-3)
        assert path.cost == pytest.approx(length_of(path.poses)) and is_free_way(path.poses, data, 1.0)


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.sampled_from([0.0, 0.7, -2.0]))
def test_the_lattice_heeds_headings_and_its_curves_turn_no_tighter_than_the_radius(begin, end, yaw):
    grid = OccupancyGrid(np.zeros((80, 80), np.int8), 0.1, (1.0, 2.0, yaw))
    server = PathServer(turning_radius=0.6)
    server.set_map(grid)
    start, goal = grid.cell_to_world([(30, 30), (55, 60)])
    path = server.plan_path('lattice', (*start, begin), (*goal, end))
    off = [float(path.statistics[f'{name}_heading_off'].split()[0]) for name in ('start', 'goal')]
    # Headings of a grid are up to 26.6 degrees apart.
    assert max(off) <= 0.2325 and int(path.statistics['segments']) > 0
    steps, middle = np.diff(path.poses[:, :2], axis=0), path.poses[1:-1]
    lengths = np.hypot(*steps.T)
    assert lengths.sum() == pytest.approx(path.cost, rel=1e-3)
    # Each point lies ahead of the one before, on an arc of at least that radius.
    turns = np.abs(np.angle(np.exp(1j * np.diff(middle[:, 2]))))
    assert (turns <= lengths[1:-1] / 0.6 * 1.01 + 1e-9).all()
    heading = np.exp(1j * middle[:-1, 2]) * np.exp(0.5j * np.angle(np.exp(1j * np.diff(middle[:, 2]))))
    np.testing.assert_allclose(steps[1:-1] @ (1, 1j) / lengths[1:-1], heading, atol=5e-3)


def test_the_lattice_backs_out_of_a_dead_end_only_where_it_may_drive_backwards():
    data = np.full((40, 60), 100, np.int8)
    data[18:21] = 0  # too narrow to turn in
    ends = (4.0, 1.95, 0.0), (1.0, 1.95, 0.0)
    forwards, both = (PathServer(turning_radius=0.5, reverse_cost=cost) for cost in (None, 2.0))
    for server in (forwards, both):
        server.set_map(OccupancyGrid(data, 0.1))
    with pytest.raises(errors.NoPath):
        forwards.plan_path('lattice', *ends)
    path = both.plan_path('lattice', *ends)
    assert (np.diff(path.poses[:, 0]) < 0).all() and (path.poses[:, 2] == 0).all()
    assert path.cost == pytest.approx(3.0)


def test_the_lattice_goes_between_its_headings_in_one_bend_instead_of_a_zigzag():
    server = PathServer(turning_radius=0.5)
    server.set_map(OccupancyGrid(np.zeros((120, 400), np.int8), 0.05))
    path = server.plan_path('lattice', (1.0, 1.0, 0.0), (16.0, 4.0, 0.0))
    turned = np.angle(np.exp(1j * np.diff(path.poses[:, 2])))
    # Out of the first heading and back into it, by the angle to the next one.
    assert np.abs(turned).sum() < 2.1 * np.arctan(0.5)


def test_the_field_of_costs_is_in_metres_and_heeds_updates_for_dstar():
    server = server_on()
    grid, field = server.cost_to_go((0.55, 0.55))
    assert field.shape == grid.shape and field[5, 5] == 0 and field[5, 15] == pytest.approx(1.0)
    assert np.isnan(field[0, 30])
    server.update_costs([(10, y) for y in range(20)], [3.0] * 20)
    assert server.cost_to_go((0.55, 0.55, 1.0), 'dstar')[1][5, 15] == pytest.approx(1.2)
    assert server.cost_to_go((0.55, 0.55, 1.0))[1][5, 15] == pytest.approx(1.0)
    with pytest.raises(errors.GoalOccupied):
        server.cost_to_go((3.05, 0.5))
    with pytest.raises(errors.InvalidPlanner):
        server.cost_to_go((0.5, 0.5), 'bug2')


def test_updates_and_maps_that_come_while_plans_run_never_give_an_answer_from_a_mix():
    # The door of the wall is either at the top or at the bottom, in one update or in one map.
    doors = np.array([(30, y) for y in (*range(16, 20), *range(4))])
    top = [1.0] * 4 + [np.inf] * 4
    server, ends = server_on(), ((0.55, 1.05, 0), (5.45, 1.05, 0))
    right, wrong = [], []
    for costs in (top, top[::-1]):
        server.update_costs(doors, costs)
        right += [server.plan_path(planner, *ends).poses.tolist() for planner in PLANNERS]

    def change(turn):
        if turn % 7 == 0:
            server.set_map(OccupancyGrid(ROOMS, 0.1))
        else:
            server.update_costs(doors, top[::-1] if turn % 2 else top)

    def ask(planner):
        for _ in range(25):
            try:
                poses = server.plan_path(planner, *ends).poses.tolist()
            except Exception as error:
                poses = error
            if poses not in right:
                wrong.append((planner, poses))

    ask_while_changing(change, ask, [(planner,) for planner in (*PLANNERS, 'dstar', 'distance_transform')])
    assert wrong == []


def test_forbidden_cells_are_gone_around_and_a_robot_in_one_leaves():
    open_floor = OccupancyGrid(np.zeros((20, 60), np.int8), 0.1)
    # Cells of 0.5 m, turned by a quarter: the column from x = 2.5 m to 3 m, up to y = 1.5 m.
    mask = OccupancyGrid(np.full((1, 3), 100), 0.5, (3.0, 0.0, np.pi / 2))
    server = PathServer()
    server.set_map(open_floor, keepout=mask)
    for planner in PLANNERS:
        poses = server.plan_path(planner, (0.55, 0.55, 0), (5.45, 0.55, 0)).poses
        assert not ((poses[:, 0] > 2.5) & (poses[:, 0] < 3.0) & (poses[:, 1] < 1.5)).any()
    assert server.plan_path('', (2.95, 0.55, 0), (5.45, 0.55, 0)).statistics['left_inflation'] == '0.100 m'
    with pytest.raises(errors.GoalOccupied, match='forbidden'):
        server.plan_path('', (0.55, 0.55, 0), (2.75, 0.55, 0))
    server.set_map(open_floor)
    assert server.plan_path('', (0.55, 0.55, 0), (5.45, 0.55, 0)).cost == pytest.approx(4.9)


@pytest.mark.parametrize('planner', PLANNERS)
def test_the_depots_keepout_mask_is_gone_around(data_folder, planner):
    folder = data_folder / 'maps' / 'nav2'
    if not (folder / 'depot_keepout.yaml').is_file():
        pytest.skip(f'{folder} has no depot_keepout')
    depot, mask = load_map(folder / 'depot.yaml'), load_map(folder / 'depot_keepout.yaml')
    entered, costs = [], []
    for masks in ({}, {'keepout': mask}):
        server = PathServer(inflation_radius=0.25, turning_radius=0.2)
        server.set_map(depot, **masks)
        path = server.plan_path(planner, (26.62, 10.23, 3.14), (4.58, 0.58, -1.57))
        x, y = depot.world_to_cell(path.poses[:, :2]).T
        entered.append((mask.data[y, x] == 100).sum())
        costs.append(path.cost)
    assert entered[0] > 0 == entered[1] and (costs[0] < costs[1] or planner == 'bug2')


def test_slow_zones_cost_dstar_and_astar_as_much_more_as_they_take_longer():
    floor, zone = np.zeros((20, 60), np.int8), np.zeros((20, 60), np.int8)
    zone[:, 20:40] = 50
    server, ends = PathServer(), ((0.55, 0.55, 0), (5.45, 0.55, 0))
    server.set_map(OccupancyGrid(floor, 0.1))
    for speed, cost in ((None, 4.9), (zone, 6.9), (None, 4.9)):
        server.set_map(OccupancyGrid(floor, 0.1), speed=None if speed is None else OccupancyGrid(speed, 0.1))
        costs = [server.plan_path(planner, *ends).cost for planner in OPTIMAL]
        assert costs == pytest.approx([4.9, cost, cost])


@given(st.integers(0, 2 ** 30), st.sampled_from(OPTIMAL[:2]))
def test_a_robot_on_its_way_is_told_the_rest_of_the_same_path(seed, planner):
    data, random = random_grid(seed, 0.2)
    server = server_on(data, 1.0)
    if answer(server, planner, *CORNERS) == np.inf:
        return
    poses = server.plan_path(planner, *CORNERS).poses
    k = random.integers(1, len(poses) - 1)
    rest = server.plan_path(planner, poses[k], CORNERS[1]).poses
    assert np.array_equal(rest[:, :2], poses[k:, :2])


def test_a_query_that_waits_for_another_ones_plan_ends_at_its_deadline():
    server = server_on()
    server.plan_path('dstar', FREE, (5, 1, 0))
    (plan,) = server._site.plans._plans.values()
    with plan.lock, pytest.raises(errors.PlanningTimeout):
        server.plan_path('dstar', FREE, (5, 1, 0), deadline=0.02)
    assert server.plan_path('dstar', FREE, (5, 1, 0), deadline=60.0).cost > 0
