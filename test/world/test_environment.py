"""The environment: its clearance against a brute force over every square, from above and from below."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from mobile_planning import Boundary, Environment, InvalidInput, OccupancyGrid, PolygonObstacle, RoundObstacle

SLACK = 0.9
OCCUPIED = npst.arrays(np.bool_, npst.array_shapes(min_dims=2, max_dims=2, max_side=12),
                       elements=st.sampled_from([False] * 5 + [True]))
ORIGINS = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1))


def distance_to_squares(grid, points):
    """Return the true distance from each point to the nearest occupied square, or to the outside."""
    x0, y0, yaw = grid.origin
    turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
    local = (np.asarray(points) - (x0, y0)) @ turn.T
    size = np.array(grid.data.shape[::-1]) * grid.resolution
    nearest = np.minimum(local, size - local).min(axis=-1)
    for row, column in np.argwhere(grid.data >= 65):
        low = np.array([column, row]) * grid.resolution
        gap = np.maximum(np.maximum(low - local, local - low - grid.resolution), 0)
        nearest = np.minimum(nearest, np.hypot(*gap.T))
    return nearest


@given(OCCUPIED, ORIGINS, st.floats(0.02, 3), st.integers(0, 2**32 - 1))
def test_clearance_of_a_grid_is_below_the_truth_by_less_than_a_cell(occupied, origin, resolution, seed):
    grid = OccupancyGrid(occupied, resolution, origin)
    rng = np.random.default_rng(seed)
    places = np.vstack([rng.uniform(0, grid.shape[::-1], (200, 2)),
                        rng.integers(0, 2 * np.array(grid.shape[::-1]) + 1, (100, 2)) / 2])
    points = grid.grid_to_world(places)
    clearance, truth = Environment(grid=grid).clearance(points), distance_to_squares(grid, points)
    assert (clearance <= np.maximum(truth, 0) + 1e-9).all()
    assert (clearance >= truth - SLACK * resolution - 1e-9).all()


def test_clearance_far_from_a_wall_is_nearly_exact():
    grid = OccupancyGrid(np.arange(400)[:, None] * np.ones(200) < 3, 0.05)
    clearance = Environment(grid=grid).clearance([(5.013, 2.171)])
    assert 2.02 < clearance <= 2.021


def test_an_occupied_cell_has_no_room_and_outside_has_less():
    environment = Environment(grid=OccupancyGrid([[0, 100]], 1.0))
    assert environment.clearance((1.5, 0.5)) == 0
    assert environment.clearance((-3, 5)) == -5
    assert environment.clearance((1e300, 0)) < -1e299


def test_a_grid_without_obstacles_leaves_room_to_its_edge():
    assert Environment(grid=OccupancyGrid(np.zeros((20, 10), int), 0.5)).clearance((2, 5)) == 2.0


def test_unknown_cells_are_obstacles_unless_told_otherwise():
    grid = OccupancyGrid([[-1, 0, 0, 0, 64]])
    assert Environment(grid=grid).clearance((0.5, 0.5)) == 0
    assert Environment(grid=grid, unknown_is_free=True).clearance((0.5, 0.5)) == 0.5
    assert Environment(grid=grid, occupied_from=50).clearance((4.5, 0.5)) == 0


def test_the_nearest_of_all_kinds_counts():
    shapes = [RoundObstacle((5, 5), 1), PolygonObstacle([(1, 8), (2, 8), (2, 9), (1, 9)])]
    grid = OccupancyGrid(np.zeros((10, 12), int))
    environment = Environment(Boundary((0, 10), (0, 10)), shapes, grid)
    assert environment.clearance([(5, 3), (2.5, 8.5), (9.5, 4), (5, 5), (11, 5)]).tolist() == [1, 0.5, 0.5, -1, -1]


def test_nothing_around_leaves_infinite_room():
    assert Environment().clearance([(1, 2), (3, 4)]).tolist() == [np.inf, np.inf]


def test_points_of_any_shape_have_clearance_of_that_shape():
    environment = Environment(Boundary((0, 1), (0, 1)), [RoundObstacle((9, 9), 1)], OccupancyGrid([[0, 1]]))
    assert environment.clearance((0.5, 0.5)).shape == ()
    assert environment.clearance(np.full((3, 4, 2), 0.5)).shape == (3, 4)
    assert environment.clearance(np.ones((0, 2))).shape == (0,)


@pytest.mark.parametrize('point', [(np.nan, 0), (0, np.inf), (1, 2, 3, 4)])
def test_what_is_no_point_has_no_clearance(point):
    with pytest.raises(InvalidInput):
        Environment(grid=OccupancyGrid([[0]])).clearance(point)


def test_a_boundary_is_measured_from_inside():
    boundary = Boundary((-1, 3), (0, 10))
    assert (boundary.x_min, boundary.x_max, boundary.y_min, boundary.y_max) == (-1.0, 3.0, 0.0, 10.0)
    assert boundary.distance([(1, 5), (0, 9.5), (-1, 5), (6, 14)]).tolist() == [2, 0.5, 0, -5]


@pytest.mark.parametrize('x', [(1, 1), (2, 1), (0, np.nan), (0, np.inf), (0, 1, 2), 5, None, ('a', 'b')])
def test_a_boundary_that_is_none_is_refused(x):
    with pytest.raises(InvalidInput, match='boundary'):
        Boundary(x, (0, 1))


def test_the_bounds_hold_all_that_is_free():
    grid = OccupancyGrid(np.zeros((4, 6), np.int8), 0.5, (1.0, 2.0, np.pi / 2))
    np.testing.assert_allclose(Environment(grid=grid).bounds, (-1.0, 2.0, 1.0, 5.0), atol=1e-12)
    both = Environment(Boundary((0.0, 9.0), (-9.0, 4.0)), grid=grid)
    np.testing.assert_allclose(both.bounds, (0.0, 2.0, 1.0, 4.0), atol=1e-12)


@pytest.mark.parametrize('grid', [None, OccupancyGrid(np.zeros((1, 1), np.int8))])
def test_a_world_without_extent_has_no_bounds(grid):
    boundary = None if grid is None else Boundary((5.0, 6.0), (5.0, 6.0))
    with pytest.raises(InvalidInput, match='no extent'):
        Environment(boundary, grid=grid).bounds
