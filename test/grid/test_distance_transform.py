"""The distance transform planner against its documentation, its field and the defects it must not have."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import mobile_planning
from mobile_planning.errors import (
    Cancelled, GoalOccupied, InvalidInput, NoMap, NoPath, StartOccupied, StartOutside)
from mobile_planning.grid.distance_transform import DistanceTransformPlanner
from mobile_planning.world.occupancy_grid import OccupancyGrid


def random_grid(seed, crowd=0.25):
    """Return the occupied cells and two free ones."""
    random = np.random.default_rng(seed)
    occupied = random.random(random.integers(2, 16, 2)) < crowd
    occupied.flat[random.choice(occupied.size, 2, replace=False)] = False
    free = np.argwhere(~occupied)[:, ::-1]
    return occupied, *free[random.choice(len(free), 2, replace=False)]


def length_of(path):
    return np.hypot(*np.diff(path, axis=0).T).sum()


@given(st.integers(0, 2 ** 30), st.booleans())
def test_a_path_is_as_long_as_the_distance_map_says(seed, corner_cutting):
    occupied, start, goal = random_grid(seed)
    planner = DistanceTransformPlanner(occupied, goal=goal, corner_cutting=corner_cutting)
    planner.plan()
    if np.isinf(planner.distancemap[start[1], start[0]]):
        with pytest.raises(NoPath):
            planner.query(start)
        return
    path = planner.query(start)
    assert np.array_equal(path[0], start) and np.array_equal(path[-1], goal)
    assert not occupied[path[:, 1], path[:, 0]].any()
    assert length_of(path) == pytest.approx(planner.distancemap[start[1], start[0]], abs=1e-9)


@given(st.integers(0, 2 ** 30), st.sampled_from(['euclidean', 'manhattan']), st.sampled_from([4, 8]))
def test_stepping_with_next_gives_the_path_of_the_query(seed, metric, connectivity):
    occupied, start, goal = random_grid(seed, 0.15)
    planner = DistanceTransformPlanner(occupied, metric, goal=goal, connectivity=connectivity)
    planner.plan()
    if np.isinf(planner.distancemap[start[1], start[0]]):
        return
    steps = [start]
    while (step := planner.next(steps[-1])) is not None:
        steps.append(step)
    assert np.array_equal(steps, planner.query(start))


@given(st.integers(0, 2 ** 30))
def test_a_path_of_four_neighbours_has_as_many_steps_as_the_map_says(seed):
    occupied, start, goal = random_grid(seed)
    maps = []
    for metric in ('euclidean', 'manhattan'):
        planner = DistanceTransformPlanner(occupied, metric, connectivity=4)
        planner.plan(goal)
        maps.append(planner.distancemap)
        if np.isfinite(planner.distancemap[start[1], start[0]]):
            path = planner.query(start)
            assert (np.abs(np.diff(path, axis=0)).sum(axis=1) == 1).all()
            assert len(path) - 1 == planner.distancemap[start[1], start[0]]
    assert np.array_equal(*maps, equal_nan=True)


def test_the_manhattan_metric_goes_down_diagonally_unless_told_otherwise():
    path = DistanceTransformPlanner(np.zeros((4, 4)), 'manhattan').query((0, 0), (3, 3))
    assert path.tolist() == [[0, 0], [1, 1], [2, 2], [3, 3]]


def test_every_way_is_found_in_every_direction():
    planner = DistanceTransformPlanner(np.zeros((9, 9)), goal=(4, 4))
    planner.plan()
    for x in range(9):
        for y in range(9):
            assert len(planner.query((x, y))) == max(abs(x - 4), abs(y - 4)) + 1


def test_the_first_step_never_wraps_around_the_border():
    planner = DistanceTransformPlanner(np.zeros((8, 8)), goal=(7, 4))
    planner.plan()
    assert planner.next((0, 4)).tolist() == [1, 4]


def test_the_distance_map_is_nan_in_obstacles_and_inf_behind_them():
    planner = DistanceTransformPlanner([[0, 1, 0]], goal=(0, 0))
    assert planner.distancemap is None
    planner.plan()
    assert np.array_equal(planner.distancemap, [[0, np.nan, np.inf]], equal_nan=True)


def test_the_path_from_the_goal_is_one_point():
    assert DistanceTransformPlanner(np.zeros((3, 3))).query((1, 1), (1, 1)).tolist() == [[1, 1]]


def test_next_at_the_goal_is_none():
    planner = DistanceTransformPlanner(np.zeros((3, 3)), goal=(1, 1))
    planner.plan()
    assert planner.next((1, 1)) is None


def test_nothing_can_be_asked_before_a_plan():
    planner = DistanceTransformPlanner(np.zeros((3, 3)), goal=(1, 1))
    with pytest.raises(RuntimeError, match='plan()'):
        planner.next((0, 0))
    with pytest.raises(RuntimeError, match='plan()'):
        planner.query((0, 0))


def test_a_plan_does_not_serve_another_goal():
    planner = DistanceTransformPlanner(np.zeros((3, 3)), goal=(1, 1))
    planner.plan()
    planner.goal = (2, 2)
    with pytest.raises(RuntimeError, match='plan()'):
        planner.query((0, 0))
    assert planner.query((0, 0), goal=(0, 2))[-1].tolist() == [0, 2]


def test_a_plan_needs_a_grid_and_a_goal():
    with pytest.raises(NoMap):
        DistanceTransformPlanner(goal=(1, 1)).plan()
    with pytest.raises(InvalidInput, match='no goal'):
        DistanceTransformPlanner(np.zeros((3, 3))).plan()


def test_bad_ends_are_refused():
    planner = DistanceTransformPlanner([[0, 1, 0]])
    with pytest.raises(GoalOccupied):
        planner.plan((1, 0))
    planner.plan((0, 0))
    with pytest.raises(StartOccupied):
        planner.query((1, 0))
    with pytest.raises(StartOutside):
        planner.next((0, 1))
    with pytest.raises(NoPath):
        planner.query((2, 0))


def test_options_are_checked_and_an_unknown_one_is_a_type_error():
    with pytest.raises(InvalidInput, match='chebyshev'):
        DistanceTransformPlanner(np.zeros((3, 3)), 'chebyshev')
    with pytest.raises(InvalidInput, match='connectivity'):
        DistanceTransformPlanner(np.zeros((3, 3)), connectivity=6)
    with pytest.raises(TypeError):
        DistanceTransformPlanner(np.zeros((3, 3)), conectivity=4)


def test_distance_is_another_name_of_metric():
    assert DistanceTransformPlanner(distance='manhattan').metric == 'manhattan'


def test_a_cancelled_plan_leaves_the_one_before():
    planner = DistanceTransformPlanner(np.zeros((3, 3)), goal=(1, 1))
    planner.plan()
    before = planner.distancemap
    with pytest.raises(Cancelled):
        planner.plan((2, 2), stop=np.ones(1, np.uint8))
    assert planner.distancemap is before


def test_an_occupancy_grid_is_planned_on_in_cells():
    grid = OccupancyGrid(np.array([[0, 100, 0], [0, 0, 0]], np.int8), resolution=0.1, origin=(5, 5, 1))
    path = mobile_planning.DistanceTransformPlanner(grid, corner_cutting=False).query((0, 0), (2, 0))
    assert path.tolist() == [[0, 0], [0, 1], [1, 1], [2, 1], [2, 0]]


def test_the_plan_can_be_told_and_drawn(capsys, tmp_path):
    planner = DistanceTransformPlanner([[0, 1, 0], [0, 0, 0]], goal=(0, 0), verbose=True)
    planner.plan()
    assert 'reach the goal (0, 0)' in capsys.readouterr().out
    assert 'metric: euclidean' in str(planner) and '5 cells reach the goal' in str(planner)
    planner.plot(planner.query((2, 0))).figure.savefig(tmp_path / 'plan.png')
