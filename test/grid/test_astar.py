"""A* against the cost-to-go field, Dijkstra and the MovingAI lengths; cost maps and paths that go with it."""
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mobile_planning
from benchmark import movingai_rows as movingai
from benchmark.dijkstra import cost_field, cost_of_steps
from mobile_planning.errors import (
    Cancelled, GoalOccupied, GoalOutside, InvalidInput, NoPath, StartOccupied, StartOutside)
from mobile_planning.grid.astar import astar
from mobile_planning.grid.clearance_costs import clearance_costs
from mobile_planning.grid.resample import resample
from mobile_planning.world.cost_to_go import cost_to_go, line_of_sight, shortcut
from mobile_planning.world.occupancy_grid import OccupancyGrid


def scene(seed, most_crowd=0.6, side=24):
    """Return a random generator, occupied cells, and two free cells that may be one."""
    random = np.random.default_rng(seed)
    occupied = random.random(random.integers(1, side, 2)) < random.uniform(0, most_crowd)
    occupied.flat[random.integers(occupied.size, size=2)] = False
    free = np.argwhere(~occupied)[:, ::-1]
    return random, occupied, *free[random.integers(len(free), size=2)]


@given(st.integers(0, 2 ** 30), st.booleans())
def test_the_path_is_as_long_as_the_field_says_to_the_last_bit(seed, corner_cutting):
    _, occupied, start, goal = scene(seed)
    length = cost_to_go(occupied, goal, corner_cutting=corner_cutting)[start[1], start[0]]
    if np.isinf(length):
        with pytest.raises(NoPath):
            astar(occupied, start, goal, corner_cutting=corner_cutting)
        return
    path, cost = astar(occupied, start, goal, corner_cutting=corner_cutting)
    assert cost == length and isinstance(cost, float)
    assert np.array_equal(path[0], start) and np.array_equal(path[-1], goal)
    assert cost_of_steps(np.where(occupied, np.inf, 1.0), path, corner_cutting) == pytest.approx(length, abs=1e-9)


@given(st.integers(0, 2 ** 30), st.booleans())
def test_with_costs_the_path_costs_what_dijkstra_says(seed, corner_cutting):
    random, occupied, start, goal = scene(seed, side=16)
    costs = np.where(occupied, np.inf, random.choice([random.integers(1, 9, occupied.shape),
                                                      np.exp(random.normal(0, 3, occupied.shape))]))
    exact = cost_field(costs, goal, corner_cutting)[start[1], start[0]]
    if np.isinf(exact):
        with pytest.raises(NoPath):
            astar(occupied, start, goal, corner_cutting=corner_cutting, costs=costs)
        return
    path, cost = astar(occupied, start, goal, corner_cutting=corner_cutting, costs=costs)
    assert cost == pytest.approx(exact, rel=1e-11)
    assert np.array_equal(path[0], start) and np.array_equal(path[-1], goal)
    assert cost_of_steps(costs, path, corner_cutting) == pytest.approx(exact, rel=1e-11)


@pytest.mark.parametrize('corner_cutting', [True, False])
def test_on_a_larger_map_any_two_cells_are_joined_by_a_shortest_path(corner_cutting):
    random = np.random.default_rng(4)
    occupied = random.random((150, 190)) < 0.3
    free = np.argwhere(~occupied)[:, ::-1]
    for goal in free[random.integers(len(free), size=4)]:
        field = cost_to_go(occupied, goal, corner_cutting=corner_cutting)
        reached = free[np.isfinite(field[free[:, 1], free[:, 0]])]
        for start in reached[random.integers(len(reached), size=60)]:
            assert astar(occupied, start, goal, corner_cutting=corner_cutting)[1] == field[start[1], start[0]]


@pytest.mark.parametrize('path', movingai.map_files(movingai.SHIPPED), ids=lambda path: path.name)
def test_paths_without_corner_cutting_are_as_long_as_the_scenarios_say(path):
    occupied, rows = movingai.read_map(path), movingai.read_rows(path)
    for i in np.random.default_rng(6).choice(len(rows), min(60, len(rows)), replace=False):
        found, cost = astar(occupied, rows[i].start, rows[i].goal, corner_cutting=False)
        assert abs(cost - rows[i].listed) <= rows[i].precision
        assert movingai.path_length(found) == pytest.approx(cost)


def test_an_answer_is_the_same_every_time():
    _, occupied, start, goal = scene(11, 0.2)
    assert np.array_equal(astar(occupied, start, goal)[0], astar(occupied, start, goal)[0])


def test_start_and_goal_in_one_cell_give_one_point():
    for costs in (None, [[2.0]]):
        path, cost = astar([[0]], (0, 0), (0, 0), costs=costs)
        assert path.tolist() == [[0, 0]] and cost == 0.0


def test_bad_ends_are_told_apart():
    occupied = np.array([[0, 1, 0]])
    for kind, start, goal in ((StartOutside, (3, 0), (0, 0)), (StartOccupied, (1, 0), (0, 0)), (NoPath, (0, 0), (2, 0)),
                              (GoalOutside, (0, 0), (0, -1)), (GoalOccupied, (0, 0), (1, 0))):
        for costs in (None, np.ones((1, 3))):
            with pytest.raises(kind):
                astar(occupied, start, goal, costs=costs)
    with pytest.raises(GoalOccupied):
        astar(np.zeros((1, 3)), (0, 0), (2, 0), costs=[[1, 1, np.inf]])


@pytest.mark.parametrize('costs', [np.zeros((1, 3)), [[1, -1, 1]], [[1, np.nan, 1]], [[1, 1]], 'map'])
def test_costs_are_positive_and_of_the_grids_shape(costs):
    with pytest.raises(InvalidInput):
        astar([[0, 0, 0]], (0, 0), (2, 0), costs=costs)


def test_an_occupancy_grid_is_searched_in_cells_and_no_array_is_written():
    data = np.array([[0, 100, 0], [0, 0, -1], [0, 0, 0]], np.int8)
    path, cost = mobile_planning.astar(OccupancyGrid(data, 0.1, (5, 5, 1)), (0, 0), (2, 2), corner_cutting=False)
    assert cost == pytest.approx(2 + np.sqrt(2)) and path[-1].tolist() == [2, 2]
    occupied, costs = np.zeros((3, 3), bool), np.ones((3, 3))
    for array in (occupied, costs):
        array.flags.writeable = False
    astar(occupied, (0, 0), (2, 2), costs=costs)


@pytest.mark.parametrize('costs', [None, 'equal'])
def test_a_search_can_be_stopped(costs):
    side, stop = 2000, np.zeros(1, np.uint8)
    occupied = np.zeros((side, side), bool)
    occupied[1::4, :-1] = occupied[3::4, 1:] = True
    timer = threading.Timer(0.01, lambda: stop.fill(1))
    timer.start()
    with pytest.raises(Cancelled):
        while True:
            astar(occupied, (0, 0), (0, side - 2), costs=costs and np.ones((side, side)), stop=stop)
    timer.join()


@given(st.integers(0, 2 ** 30), st.floats(0.5, 9), st.floats(0, 20))
def test_clearance_costs_fall_with_the_distance_to_the_nearest_obstacle(seed, radius, weight):
    _, occupied, _, _ = scene(seed)
    costs = clearance_costs(occupied, radius, weight=weight)
    walls = np.argwhere(occupied)
    for y, x in np.argwhere(~occupied)[::5]:
        distance = np.hypot(*(walls - (y, x)).T).min(initial=np.inf)
        assert costs[y, x] == pytest.approx(1 + weight * max(0, 1 - distance / radius) ** 2)
    assert np.isinf(costs[occupied]).all()


@pytest.mark.parametrize('numbers', [(0, 1), (-1, 1), (np.nan, 1), (np.inf, 1), (1, -1), (1, np.inf)])
def test_clearance_costs_want_finite_numbers(numbers):
    with pytest.raises(InvalidInput):
        clearance_costs([[0]], numbers[0], weight=numbers[1])


def test_a_path_on_clearance_costs_keeps_to_the_middle_of_a_corridor():
    occupied = np.ones((11, 40), bool)
    occupied[1:-1, 1:-1] = False
    near, _ = astar(occupied, (1, 1), (38, 1))
    far, _ = astar(occupied, (1, 1), (38, 1), costs=clearance_costs(occupied, 5, weight=10))
    assert (near[:, 1] == 1).all()
    assert (far[8:-8, 1] == 5).all()


@given(st.integers(0, 2 ** 30))
def test_a_smoothed_path_cuts_no_wall_and_is_no_longer(seed):
    _, occupied, start, goal = scene(seed)
    try:
        path, cost = astar(occupied, start, goal, corner_cutting=False)
    except NoPath:
        return
    points = shortcut(occupied, path)
    assert all(line_of_sight(occupied, a, b) for a, b in zip(points[:-1], points[1:]))
    assert movingai.path_length(points) <= cost + 1e-9


paths = st.lists(st.tuples(*[st.floats(-1e3, 1e3)] * 2), min_size=1, max_size=9)


@given(paths, st.floats(20, 1e4))
def test_a_resampled_path_has_equal_distances_and_the_same_ends(path, spacing):
    points = resample(path, spacing)
    assert tuple(points[0]) == path[0] and tuple(points[-1]) == path[-1]
    # Measured along the path: each point lies on it, where the distance says.
    along = np.concatenate([[0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    step = along[-1] / max(1, len(points) - 1)
    assert step <= spacing * (1 + 1e-9)
    for i, point in enumerate(points[1:-1], 1):
        j = min(np.searchsorted(along, i * step, side='right') - 1, len(path) - 2)
        a, b = np.array(path[j]), np.array(path[j + 1])
        share = (i * step - along[j]) / (along[j + 1] - along[j])
        np.testing.assert_allclose(point, a + share * (b - a), atol=1e-6)


def test_resampling_cuts_no_more_often_than_it_must():
    assert len(resample([(0, 0), (0.3, 0)], 0.1)) == 4
    assert resample([(1, 2)], 1).tolist() == [[1, 2]]


@pytest.mark.parametrize('path, spacing', [([], 1), ([(0, 0, 0)], 1), ([(0, np.nan)], 1), ([(0, 0)], 0), ([(0, 0)], -1),
                                           ([(0, 0)], np.inf), ([(0, 0)], np.nan)])
def test_resampling_nonsense_is_invalid_input(path, spacing):
    with pytest.raises(InvalidInput):
        resample(path, spacing)
