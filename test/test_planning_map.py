"""What a robot must keep off: every obstacle grown by its radius, whether the map, the mask or an update says so."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from benchmark.dijkstra import cost_field
from mobile_planning import errors
from mobile_planning.path_server import PathServer
from mobile_planning.world.occupancy_grid import OccupancyGrid


def closed_cells(data, mask, told, radius, unknown_is_free):
    """Return where no robot may be, from the rules alone: cell by cell, each distance taken."""
    lethal, unknown = data >= 65, (data == -1) & (not unknown_is_free)
    for (x, y), cost in told.items():
        lethal[y, x], unknown[y, x] = cost == np.inf, False
    lethal |= mask >= 65
    sources = np.argwhere(lethal)
    if len(sources) == 0:
        return unknown
    near = cdist(np.argwhere(np.ones_like(lethal)), sources).min(axis=1).reshape(data.shape) <= radius + 1e-9
    return unknown | near


def costs_of(data, speed, told):
    """Return what each cell costs where a robot may be: what was told last, else what the speed mask says."""
    costs = 100.0 / np.where(speed > 0, speed, 100)
    for (x, y), cost in told.items():
        costs[y, x] = cost
    return costs


def field_or_nothing(server, goal, planner):
    """Return the costs to a goal, NaN where no robot may be; None if the goal itself is such a place."""
    try:
        return server.cost_to_go((*np.add(goal, 0.5), 0.0), planner)[1]
    except errors.GoalOccupied:
        return None


@given(st.integers(0, 2 ** 30), st.sampled_from([0.0, 1.0, 1.5, 2.3]), st.booleans(), st.booleans())
def test_updates_and_masks_close_and_cost_what_the_rules_say(seed, radius, unknown_is_free, has_masks):
    random = np.random.default_rng(seed)
    shape = tuple(random.integers(3, 22, 2))
    size, goal = shape[::-1], tuple(random.integers(0, shape[::-1]).tolist())

    def drawn(values, shares):
        return random.choice(values, p=shares, size=shape).astype(np.int8)

    server, told = PathServer(inflation_radius=radius, unknown_is_free=unknown_is_free), {}
    for turn in range(6):
        if turn % 3 == 0:
            data, told = drawn([0, 30, 100, -1], [0.85, 0.05, 0.05, 0.05]), {}
            mask = drawn([0, 100], [0.97, 0.03]) if has_masks else np.zeros(shape, np.int8)
            speed = drawn([0, 50, 20], [0.6, 0.2, 0.2]) if has_masks else np.zeros(shape, np.int8)
            masks = {'keepout': OccupancyGrid(mask), 'speed': OccupancyGrid(speed)} if has_masks else {}
            server.set_map(OccupancyGrid(data), **masks)
        cells = random.integers((0, 0), size, (random.integers(0, 6), 2))
        costs = random.choice([np.inf, 1.0, 4.0, 0.5], len(cells))
        server.update_costs(cells, costs)
        told.update(zip(map(tuple, cells.tolist()), costs))

        closed = closed_cells(data, mask, told, radius, unknown_is_free)
        costs = np.where(closed, np.inf, costs_of(data, speed, told))
        fields = {planner: field_or_nothing(server, goal, planner) for planner in ('distance_transform', 'dstar')}
        if closed[goal[1], goal[0]]:
            assert fields == {'distance_transform': None, 'dstar': None}
            continue
        lengths = np.where(closed, np.inf, 1.0)
        for planner, expected in (('distance_transform', lengths), ('dstar', costs)):
            field = np.where(closed, np.nan, cost_field(expected, goal, corner_cutting=False))
            np.testing.assert_allclose(fields[planner], field, rtol=1e-11)


def corridor(width=9, length=30, **masks):
    """Return a server of a robot of 2.5 cells in an open corridor."""
    server = PathServer(inflation_radius=0.25)
    masks = {name: OccupancyGrid(mask, 0.1) for name, mask in masks.items()}
    server.set_map(OccupancyGrid(np.zeros((width, length), np.int8), 0.1), **masks)
    return server


START, GOAL = (0.25, 0.45, 0.0), (2.75, 0.45, 0.0)


def clearance(poses, cell):
    """Return the least distance of the cells of a path from the centre of a cell [m]."""
    return np.hypot(*(poses[1:-1, :2] - (np.array(cell) + 0.5) * 0.1).T).min()


@pytest.mark.parametrize('planner', ['distance_transform', 'dstar', 'astar', 'bug2'])
def test_a_blocked_cell_is_passed_at_the_robots_radius_until_it_is_freed(planner):
    server = corridor()
    server.update_costs([(15, 4)], [np.inf])
    assert clearance(server.plan_path(planner, START, GOAL).poses, (15, 4)) > 0.25
    server.update_costs([(15, 4)], [1.0])
    assert server.plan_path(planner, START, GOAL).cost == pytest.approx(2.5)


@pytest.mark.parametrize('planner', ['distance_transform', 'dstar', 'astar', 'bug2'])
def test_a_forbidden_cell_is_passed_at_the_robots_radius_and_no_update_opens_it(planner):
    mask = np.zeros((9, 30), np.int8)
    mask[4, 15] = 100
    server = corridor(keepout=mask)
    for told in ([], [(15, 4)]):
        server.update_costs(told, [1.0] * len(told))
        assert clearance(server.plan_path(planner, START, GOAL).poses, (15, 4)) > 0.25
        with pytest.raises(errors.GoalOccupied, match='is forbidden'):
            server.plan_path(planner, START, (1.55, 0.45, 0))
        with pytest.raises(errors.GoalOccupied, match='within the inflation radius of 0.25 m'):
            server.plan_path(planner, START, (1.45, 0.45, 0))


def test_of_two_obstacles_that_share_their_inflation_one_may_go():
    server = corridor()
    server.update_costs([(14, 3), (16, 3)], [np.inf, np.inf])
    server.update_costs([(14, 3)], [1.0])
    field = server.cost_to_go(GOAL)[1]
    assert np.isnan(field[3, 15]) and np.isnan(field[3, 14]) and field[3, 13] > 0


def test_a_cost_that_was_told_counts_once_the_inflation_is_gone():
    server = corridor()
    everywhere = [(x, y) for x in range(14, 17) for y in range(9)]
    server.update_costs([(15, 0)], [np.inf])
    server.update_costs(everywhere, [3.0 if cell != (15, 0) else np.inf for cell in everywhere])
    server.update_costs([(15, 0)], [3.0])
    assert server.plan_path('dstar', START, GOAL).cost == pytest.approx(2.5 + 0.6)


def test_a_robot_beside_an_obstacle_that_an_update_reports_is_led_away():
    server = corridor()
    server.update_costs([(4, 4)], [np.inf])
    path = server.plan_path('', START, GOAL)
    assert path.statistics['left_inflation'] == '0.100 m'


def test_a_small_update_of_a_large_map_keeps_plans_that_it_does_not_concern():
    server = PathServer(inflation_radius=0.3)
    server.set_map(OccupancyGrid(np.zeros((300, 300), np.int8), 0.1))
    ends = (1.05, 1.05, 0), (29.05, 1.05, 0)
    server.update_costs([(50, 200)], [np.inf])
    plans = [server.plan_path(planner, *ends).statistics['plan'] for planner in ('distance_transform', 'dstar')]
    # Within the inflation of the first one: no other cell is closed by it, and none is opened.
    server.update_costs([(50, 201)], [1.0])
    plans += [server.plan_path(planner, *ends).statistics['plan'] for planner in ('distance_transform', 'dstar')]
    assert plans == ['computed', 'computed', 'reused', 'reused']
