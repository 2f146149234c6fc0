"""The occupancy grid: what it accepts, where its cells lie, and how obstacles grow."""
import cmath

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from mobile_planning import InvalidInput, LimitExceeded, OccupancyGrid

CELLS = npst.arrays(np.int8, npst.array_shapes(min_dims=2, max_dims=2, max_side=9),
                    elements=st.sampled_from([-1, 0, 30, 64, 65, 100]))
ORIGINS = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-np.pi, np.pi))
RESOLUTIONS = st.floats(0.01, 5)


def test_the_grid_keeps_a_copy_that_nobody_can_change():
    data = np.zeros((2, 3), np.int8)
    grid = OccupancyGrid(data)
    data[0, 0] = 100
    assert grid.data[0, 0] == 0
    with pytest.raises(ValueError):
        grid.data[0, 0] = 1


def test_shape_is_rows_by_columns():
    grid = OccupancyGrid(np.zeros((2, 3), int))
    assert (grid.width, grid.height, grid.shape) == (3, 2, (2, 3))


@pytest.mark.parametrize('dtype', [np.int8, np.uint8, np.int64, '>i4'])
def test_any_integers_are_cells(dtype):
    assert OccupancyGrid(np.array([[0, 7, 100]], dtype)).data.tolist() == [[0, 7, 100]]


def test_true_is_occupied():
    assert OccupancyGrid([[True, False]]).data.tolist() == [[100, 0]]


@pytest.mark.parametrize('data, words', [
    ([[101]], '101 is outside -1..100'), ([[-2]], '-2 is outside'), (np.array([[-128]], np.int8), '-128'),
    ([[0.5]], 'float64'), ([0, 1], 'shape'), ([[]], 'empty'), (np.zeros((0, 3), int), 'empty'),
    ([[1], [1, 2]], 'different lengths'), ([['a']], 'type')])
def test_data_that_are_no_cells_are_refused(data, words):
    with pytest.raises(InvalidInput, match=words):
        OccupancyGrid(data)


@pytest.mark.parametrize('shape', [(1, 32768), (32768, 1), (10_001, 10_000)])
def test_a_grid_above_the_limits_is_refused(shape):
    with pytest.raises(LimitExceeded, match='limit of (32767|100000000)'):
        OccupancyGrid(np.broadcast_to(np.int8(0), shape))


@pytest.mark.parametrize('resolution', [0, -1, 9e-7, np.nan, np.inf, 'wide', None])
def test_a_resolution_that_is_no_length_is_refused(resolution):
    with pytest.raises(InvalidInput, match='resolution'):
        OccupancyGrid([[0]], resolution)


@pytest.mark.parametrize('origin', [(0, 0), (0, 0, np.nan), (np.inf, 0, 0), (0, -1e10, 0), 'abc', None, [[0, 0, 0]]])
def test_an_origin_that_is_no_pose_is_refused(origin):
    with pytest.raises(InvalidInput, match='origin'):
        OccupancyGrid([[0]], 1.0, origin)


def test_yaw_is_brought_into_range():
    assert OccupancyGrid([[0]], 1.0, (0, 0, 3 * np.pi)).origin[2] == pytest.approx(np.pi)


@given(ORIGINS, RESOLUTIONS, st.integers(-40, 40), st.integers(-40, 40))
def test_the_origin_is_the_corner_of_the_first_cell(origin, resolution, x, y):
    grid = OccupancyGrid([[0]], resolution, origin)
    centre = complex(*origin[:2]) + resolution * complex(x + 0.5, y + 0.5) * cmath.exp(1j * origin[2])
    assert grid.cell_to_world((x, y)) == pytest.approx([centre.real, centre.imag], abs=1e-9)


@given(ORIGINS, RESOLUTIONS, st.integers(-10**6, 10**6), st.integers(-10**6, 10**6),
       st.floats(0.01, 0.99), st.floats(0.01, 0.99))
def test_every_place_in_a_cell_belongs_to_it(origin, resolution, x, y, share_x, share_y):
    grid = OccupancyGrid([[0]], resolution, origin)
    assert grid.world_to_cell(grid.grid_to_world((x + share_x, y + share_y))).tolist() == [x, y]


def test_points_of_any_shape_become_cells_of_that_shape():
    grid = OccupancyGrid([[0]], 0.5)
    assert grid.world_to_cell(np.zeros((4, 3, 2))).shape == (4, 3, 2)
    assert grid.world_to_cell((-0.1, 0.6)).tolist() == [-1, 1]
    assert grid.world_to_cell(np.zeros((0, 2))).shape == (0, 2)


def test_points_too_far_to_count_are_outside():
    grid = OccupancyGrid([[0]], 1e-6, (1e9, -1e9, 1.0))
    assert not grid.contains(grid.world_to_cell([(1e308, -1e308), (-1.7e308, 1.7e308)])).any()


@pytest.mark.parametrize('point', [(np.nan, 0), (0, np.inf), (1, 2, 3), 1.0, 'ab', None])
def test_what_is_no_point_has_no_cell(point):
    with pytest.raises(InvalidInput):
        OccupancyGrid([[0]]).world_to_cell(point)


def test_contains_asks_for_columns_then_rows():
    grid = OccupancyGrid(np.zeros((2, 3), int))
    assert grid.contains([(0, 0), (2, 1), (3, 1), (2, 2), (-1, 0)]).tolist() == [True, True, False, False, False]


def test_unknown_is_occupied_unless_told_otherwise():
    grid = OccupancyGrid([[-1, 0, 64, 65, 100]])
    assert grid.occupied().tolist() == [[True, False, False, True, True]]
    assert grid.occupied(unknown_is_free=True).tolist() == [[False, False, False, True, True]]
    assert grid.occupied(occupied_from=50).tolist() == [[True, False, True, True, True]]


@pytest.mark.parametrize('occupied_from', [0, -1, 101, np.nan])
def test_a_threshold_that_no_cell_or_every_cell_meets_is_refused(occupied_from):
    with pytest.raises(InvalidInput, match='occupied_from'):
        OccupancyGrid([[0]]).occupied(occupied_from)


@given(CELLS, st.floats(0, 6), RESOLUTIONS)
def test_inflation_covers_a_disc_around_each_occupied_centre(data, cells, resolution):
    grid = OccupancyGrid(data, resolution)
    rows, columns = np.mgrid[:grid.height, :grid.width]
    expected = data.copy()
    for row, column in np.argwhere(data >= 65):
        expected[np.hypot(rows - row, columns - column) <= cells * (1 + 1e-9)] = 100
    assert grid.inflate(cells * resolution) == OccupancyGrid(expected, resolution)
    assert grid == OccupancyGrid(data, resolution)


@pytest.mark.parametrize('cells', range(1, 30))
def test_a_radius_of_whole_cells_reaches_the_last_of_them(cells):
    grid = OccupancyGrid(np.arange(40)[None] == 0, 0.1)
    assert np.count_nonzero(grid.inflate(cells * 0.1).data) == cells + 1
    assert np.count_nonzero(grid.inflate(float(f'{cells / 10:.1f}')).data) == cells + 1


@pytest.mark.parametrize('radius', [-0.1, np.nan, np.inf])
def test_a_radius_that_is_no_length_is_refused(radius):
    with pytest.raises(InvalidInput, match='radius'):
        OccupancyGrid([[0]]).inflate(radius)


def test_grids_are_equal_if_cells_and_place_are():
    grid = OccupancyGrid([[0, 1]], 0.5, (1, 2, 0.3))
    assert grid == OccupancyGrid([[0, 1]], 0.5, (1, 2, 0.3))
    assert grid != OccupancyGrid([[0, 2]], 0.5, (1, 2, 0.3))
    assert grid != OccupancyGrid([[0, 1]], 0.6, (1, 2, 0.3))
    assert grid != OccupancyGrid([[0, 1]], 0.5, (1, 2, 0.4))
    assert grid != OccupancyGrid([[0], [1]], 0.5, (1, 2, 0.3))
    assert grid != 'a grid'
