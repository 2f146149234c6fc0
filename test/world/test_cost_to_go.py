"""The cost-to-go field and its paths, against Dijkstra on a graph built here, and against the MovingAI lengths."""
import threading
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

from benchmark import movingai_rows as movingai
from mobile_planning.errors import (
    Cancelled, GoalOccupied, GoalOutside, InvalidInput, NoPath, StartOccupied, StartOutside)
from mobile_planning.world.cost_to_go import cost_to_go, descend, line_of_sight, shortcut, warm_up

RULES = tuple(product(('euclidean', 'manhattan'), (True, False)))
rules = st.sampled_from(RULES)


@st.composite
def grids_with_goal(draw, side=14):
    """Draw the occupied cells of a small grid, from empty to crowded, and a free goal."""
    shape = draw(st.tuples(st.integers(1, side), st.integers(1, side)))
    crowd = draw(st.integers(0, 6))
    occupied = draw(arrays(np.int8, shape, elements=st.integers(0, 9), fill=st.nothing())) < crowd
    goal = draw(st.integers(0, shape[1] - 1)), draw(st.integers(0, shape[0] - 1))
    occupied[goal[1], goal[0]] = False
    return occupied, goal


def neighbours(occupied, x, y, diagonals, corner_cutting):
    """Yield each cell that may be entered from (x, y), with the length of the step."""
    height, width = occupied.shape
    for dx, dy in product((-1, 0, 1), repeat=2):
        to_x, to_y = x + dx, y + dy
        if (dx, dy) == (0, 0) or not (0 <= to_x < width and 0 <= to_y < height) or occupied[to_y, to_x]:
            continue
        if dx and dy and (not diagonals or not corner_cutting and (occupied[y, to_x] or occupied[to_y, x])):
            continue
        yield to_x, to_y, np.hypot(dx, dy)


def dijkstra_field(occupied, goal, metric, corner_cutting):
    """Return the field from scipy's Dijkstra on the graph of all steps."""
    height, width = occupied.shape
    edges = [(y * width + x, to_y * width + to_x, length)
             for y, x in np.argwhere(~occupied)
             for to_x, to_y, length in neighbours(occupied, x, y, metric == 'euclidean', corner_cutting)]
    rows, columns, lengths = np.array(edges or np.empty((0, 3))).T
    graph = coo_array((lengths, (rows.astype(int), columns.astype(int))), shape=(occupied.size,) * 2).tocsr()
    field = dijkstra(graph, indices=goal[1] * width + goal[0]).reshape(occupied.shape)
    field[occupied] = np.nan
    return field


def length_of(path):
    return np.hypot(*np.diff(path, axis=0).T).sum()


@given(grids_with_goal(), rules)
def test_the_field_equals_dijkstra_cell_by_cell(grid, rule):
    occupied, goal = grid
    metric, corner_cutting = rule
    field = cost_to_go(occupied, goal, metric=metric, corner_cutting=corner_cutting)
    np.testing.assert_allclose(field, dijkstra_field(occupied, goal, metric, corner_cutting), rtol=0, atol=1e-9)


@pytest.mark.parametrize('metric, corner_cutting', RULES)
@pytest.mark.parametrize('shape, crowd', [
    ((1, 1), 0), ((1, 200), 0), ((200, 1), 0), ((90, 130), 0.2), ((128, 70), 0.4)])
def test_a_larger_field_equals_dijkstra(shape, crowd, metric, corner_cutting):
    occupied = np.random.default_rng(5).random(shape) < crowd
    goal = (0, shape[0] - 1)
    occupied[goal[1], goal[0]] = False
    field = cost_to_go(occupied, goal, metric=metric, corner_cutting=corner_cutting)
    np.testing.assert_allclose(field, dijkstra_field(occupied, goal, metric, corner_cutting), rtol=0, atol=1e-9)


def test_equal_steps_in_another_order_give_the_same_number():
    field = cost_to_go(np.zeros((60, 90), bool), (0, 0))
    y, x = np.indices(field.shape)
    diagonal = np.minimum(x, y)
    assert np.array_equal(field, abs(x - y) + diagonal * np.sqrt(2))


def test_a_front_of_thousands_of_cells_is_exact():
    field = cost_to_go(np.zeros((1401, 1601), bool), (800, 700))
    y, x = np.abs(np.indices(field.shape) - np.array([700, 800])[:, None, None])
    assert np.array_equal(field, abs(x - y) + np.minimum(x, y) * np.sqrt(2))


@given(grids_with_goal(), rules)
def test_the_descent_takes_legal_steps_and_is_as_long_as_the_field_says(grid, rule):
    occupied, goal = grid
    metric, corner_cutting = rule
    diagonals = metric == 'euclidean'
    field = cost_to_go(occupied, goal, metric=metric, corner_cutting=corner_cutting)
    for y, x in np.argwhere(np.isfinite(field))[:40]:
        path = descend(field, (x, y), goal, corner_cutting=corner_cutting, connectivity=8 if diagonals else 4)
        assert tuple(path[0]) == (x, y) and tuple(path[-1]) == goal
        for (a, b), (c, d) in zip(path[:-1], path[1:]):
            assert (c, d) in [cell[:2] for cell in neighbours(occupied, a, b, diagonals, corner_cutting)]
        assert length_of(path) == pytest.approx(field[y, x], abs=1e-9)


def test_ties_of_the_descent_break_the_same_way_straight_first():
    field = cost_to_go(np.zeros((5, 8), bool), (7, 4))
    path = descend(field, (0, 0), (7, 4))
    assert path.tolist() == [[0, 0], [1, 0], [2, 0], [3, 0], [4, 1], [5, 2], [6, 3], [7, 4]]
    assert np.array_equal(path, descend(field, (0, 0), (7, 4)))


def test_the_path_from_the_goal_is_the_goal():
    assert descend(cost_to_go([[0]], (0, 0)), (0, 0), (0, 0)).tolist() == [[0, 0]]


def test_a_path_never_wraps_around_the_border():
    occupied = np.zeros((4, 9), bool)
    occupied[:, 4] = True
    field = cost_to_go(occupied, (8, 3))
    assert np.isinf(field[:, :4]).all()
    with pytest.raises(NoPath):
        descend(field, (0, 0), (8, 3))


def test_a_path_that_needs_diagonals_is_not_found_without_them():
    field = cost_to_go([[0, 1], [1, 0]], (0, 0))
    assert len(descend(field, (1, 1), (0, 0))) == 2
    for moves in ({'connectivity': 4}, {'corner_cutting': False}):
        with pytest.raises(NoPath):
            descend(field, (1, 1), (0, 0), **moves)


def test_the_ends_of_a_query_are_told_apart():
    occupied = np.array([[0, 0, 1]])
    for goal in ((3, 0), (-1, 0), (0, 1)):
        with pytest.raises(GoalOutside):
            cost_to_go(occupied, goal)
    with pytest.raises(GoalOccupied):
        cost_to_go(occupied, (2, 0))
    field = cost_to_go(occupied, (0, 0))
    with pytest.raises(StartOutside):
        descend(field, (-1, 0), (0, 0))
    with pytest.raises(StartOccupied):
        descend(field, (2, 0), (0, 0))
    with pytest.raises(InvalidInput, match='leads elsewhere'):
        descend(field, (1, 0), (1, 0))


@pytest.mark.parametrize('occupied, goal, options', [
    ([0, 0], (0, 0), {}), (np.zeros((0, 3)), (0, 0), {}), ([[0]], (0.5, 0), {}), ([[0]], (np.nan, 0), {}),
    ([[0]], (0, 0, 0), {}), ([[0]], 'xy', {}), ([[0]], (0, 0), {'metric': 'chebyshev'})])
def test_nonsense_is_invalid_input(occupied, goal, options):
    with pytest.raises(InvalidInput):
        cost_to_go(occupied, goal, **options)


@pytest.mark.parametrize('dtype', [bool, np.int8, np.uint16, float])
def test_any_array_is_read_and_none_is_written(dtype):
    expected = cost_to_go(np.eye(6, 9, 2, dtype=bool), (0, 0))
    for order in 'CF':
        occupied = np.array(np.eye(6, 9, 2), dtype, order=order)
        occupied.flags.writeable = False
        field = cost_to_go(occupied, (0, 0))
        assert np.array_equal(field, expected, equal_nan=True)
        field.flags.writeable = False
        path = descend(field, (0, 5), (0, 0))
        path.flags.writeable = False
        assert len(shortcut(occupied, path)) == 2
        assert line_of_sight(occupied, (0, 5), (0, 0))


def test_a_set_stop_flag_cancels_the_field():
    with pytest.raises(Cancelled):
        cost_to_go(np.zeros((9, 9), bool), (0, 0), stop=np.ones(1, np.uint8))


def test_another_thread_can_stop_a_field_under_way():
    stop, began = np.zeros(1, np.uint8), threading.Event()

    def stop_it():
        began.wait(10)
        stop[0] = 1

    other = threading.Thread(target=stop_it)
    other.start()
    occupied = np.zeros((8, 8), bool)
    with pytest.raises(Cancelled):
        # Fields of growing size, until one lasts long enough for the other thread to come in between.
        while occupied.size <= 1 << 26:
            began.set()
            cost_to_go(occupied, (0, 0), stop=stop)
            occupied = np.zeros((2 * len(occupied),) * 2, bool)
    other.join()


def touches(occupied, a, b):
    """Return whether the segment comes within rounding of an occupied cell's square, by clipping it to the square."""
    a, b = np.array(a, float), np.array(b, float)
    for y, x in np.argwhere(occupied):
        low, high = 0.0, 1.0
        for start, end, centre in zip(a, b, (x, y)):
            if start == end:
                low = low if abs(start - centre) <= 0.5 else 2.0
                continue
            crossings = sorted(((centre - 0.5 - start) / (end - start), (centre + 0.5 - start) / (end - start)))
            low, high = max(low, crossings[0]), min(high, crossings[1])
        if low <= high + 1e-12:
            return True
    return False


@given(grids_with_goal(), st.data())
def test_a_line_of_sight_touches_no_occupied_square(grid, data):
    occupied, a = grid
    b = data.draw(st.integers(0, occupied.shape[1] - 1)), data.draw(st.integers(0, occupied.shape[0] - 1))
    assert line_of_sight(occupied, a, b) == (not touches(occupied, a, b))
    assert line_of_sight(occupied, a, b) == line_of_sight(occupied, b, a)


def test_nothing_outside_the_grid_is_in_sight():
    for end in ((3, 0), (-1, 0), (0, 10 ** 30)):
        assert not line_of_sight(np.zeros((2, 3)), (0, 0), end)


@given(grids_with_goal())
def test_a_shortcut_keeps_its_ends_sees_from_point_to_point_and_is_never_longer(grid):
    occupied, goal = grid
    field = cost_to_go(occupied, goal, corner_cutting=False)
    for y, x in np.argwhere(np.isfinite(field))[::7]:
        path = descend(field, (x, y), goal, corner_cutting=False)
        points = shortcut(occupied, path)
        assert np.array_equal(points[0], path[0]) and np.array_equal(points[-1], path[-1])
        assert all(line_of_sight(occupied, a, b) for a, b in zip(points[:-1], points[1:]))
        assert length_of(points) <= length_of(path) + 1e-9


def test_a_shortcut_across_open_ground_is_one_straight_line():
    field = cost_to_go(np.zeros((20, 50), bool), (49, 19))
    assert shortcut(np.zeros((20, 50)), descend(field, (0, 0), (49, 19))).tolist() == [[0, 0], [49, 19]]


def test_a_shortcut_of_a_path_that_cuts_corners_keeps_them():
    field = cost_to_go([[0, 1], [1, 0]], (0, 0))
    assert shortcut([[0, 1], [1, 0]], descend(field, (1, 1), (0, 0))).tolist() == [[1, 1], [0, 0]]


def test_an_empty_path_has_no_shortcut():
    assert shortcut([[0]], np.empty((0, 2))).shape == (0, 2)


def test_the_kernels_warm_up():
    warm_up()


def sampled(path, count):
    """Return rows of the scenario of a map, drawn with a fixed seed."""
    rows = movingai.read_rows(path)
    return [rows[i] for i in np.random.default_rng(2).choice(len(rows), min(count, len(rows)), replace=False)]


@pytest.mark.parametrize('path', movingai.map_files(movingai.SHIPPED), ids=lambda path: path.name)
def test_paths_without_corner_cutting_are_as_long_as_the_scenarios_say(path):
    assert movingai.misfits(movingai.read_map(path), sampled(path, 40)) == []


def test_paths_on_the_further_maps_are_as_long_as_the_scenarios_say(data_folder):
    paths = movingai.map_files(data_folder / 'maps' / 'movingai')
    if not paths:
        pytest.skip(f'{data_folder} has no maps/movingai')
    for path in paths:
        assert movingai.misfits(movingai.read_map(path), sampled(path, 15)) == [], path
