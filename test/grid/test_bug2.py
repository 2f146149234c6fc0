"""Bug2 against a flood fill, and the rules that it keeps."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label

from mobile_planning.errors import (
    Cancelled, GoalOccupied, GoalOutside, InvalidInput, NoPath, StartOccupied, StartOutside)
from mobile_planning.grid.bug2 import Bug2, _m_line


def random_grid(seed):
    """Return the occupied cells, from scattered to caves, and two free ones that may be the same."""
    random = np.random.default_rng(seed)
    occupied = random.random(random.integers(1, 20, 2)) < random.choice([0.1, 0.3, 0.4, 0.5])
    occupied.flat[random.integers(occupied.size)] = False
    free = np.argwhere(~occupied)[:, ::-1]
    return occupied, *free[random.integers(len(free), size=2)]


def is_joined(occupied, start, goal, corner_cutting):
    """Return whether a flood from the start reaches the goal: without cutting corners diagonals join nothing new."""
    rooms, _ = label(~occupied, np.ones((3, 3)) if corner_cutting else None)
    return rooms[start[1], start[0]] == rooms[goal[1], goal[0]]


@settings(max_examples=400)
@given(st.integers(0, 2 ** 30), st.booleans(), st.sampled_from(['right', 'left']))
def test_it_arrives_exactly_where_a_flood_does(seed, corner_cutting, wall_on):
    occupied, start, goal = random_grid(seed)
    robot = Bug2(occupied, corner_cutting=corner_cutting, wall_on=wall_on)
    if not is_joined(occupied, start, goal, corner_cutting):
        with pytest.raises(NoPath):
            robot.run(start, goal)
        return
    path = robot.run(start, goal)
    assert np.array_equal(path[0], start) and np.array_equal(path[-1], goal)
    assert not occupied[path[:, 1], path[:, 0]].any()
    assert (np.abs(np.diff(path, axis=0)).max(axis=1, initial=0) == 1).all()
    if not corner_cutting:
        assert not occupied[path[:-1, 1], path[1:, 0]].any() and not occupied[path[1:, 1], path[:-1, 0]].any()


@settings(max_examples=100)
@given(st.integers(0, 2 ** 30), st.booleans(), st.sampled_from(['right', 'left']))
def test_it_keeps_its_hand_on_the_wall_and_makes_progress_with_every_hit(seed, corner_cutting, wall_on):
    occupied, start, goal = random_grid(seed)
    if not is_joined(occupied, start, goal, corner_cutting):
        return
    robot = Bug2(occupied, corner_cutting=corner_cutting, wall_on=wall_on)
    steps = list(robot.steps(start, goal))
    height, width = occupied.shape
    for step in steps:
        if step.wall is not None:
            x, y = step.wall
            assert abs(x - step.cell[0]) + abs(y - step.cell[1]) == 1
            assert not (0 <= x < width and 0 <= y < height) or occupied[y, x]
    order = {cell: i for i, cell in enumerate(_m_line(tuple(start.tolist()), tuple(goal.tolist()))[0])}
    places = [order[hit] for hit in robot.hits]
    assert all(a < b for a, b in zip(places, places[1:]))
    # What it leaves the wall for is a cell of the m-line beyond the hit, and the first such.
    for step, following in zip(steps, steps[1:]):
        if step.hit is not None:
            beyond = order.get(step.cell, -1) > order[step.hit]
            assert beyond == (following.hit != step.hit or following.cell == step.cell and following.wall is None)


@given(st.integers(-9, 9), st.integers(-9, 9))
def test_nothing_in_the_way_is_a_straight_line(x, y):
    path = Bug2().run((0, 0), (x, y))
    assert len(path) == max(abs(x), abs(y)) + 1
    off = np.abs(path[:, 0] * y - path[:, 1] * x) / max(1.0, np.hypot(x, y))
    assert off.max() <= 0.5 + 1e-9


def test_the_walls_side_decides_the_way():
    occupied = np.zeros((7, 7))
    occupied[1:6, 3] = 1
    right, left = (Bug2(occupied, wall_on=side).run((0, 3), (6, 3)) for side in ('right', 'left'))
    assert right[:, 1].max() == 6 and left[:, 1].min() == 0 and len(right) == len(left)


def test_the_border_of_the_map_is_a_wall_like_any_other():
    occupied = np.zeros((4, 5))
    occupied[0:3, 2] = 1
    path = Bug2(occupied, wall_on='left').run((0, 1), (4, 1))
    assert path[-1].tolist() == [4, 1] and path[:, 1].max() == 3


def test_a_goal_that_is_walled_in_is_given_up_on():
    occupied = np.zeros((9, 9))
    occupied[2:7, 2:7] = 1
    occupied[4, 4] = 0
    with pytest.raises(NoPath, match='went around'):
        Bug2(occupied).run((0, 4), (4, 4))
    with pytest.raises(NoPath):
        Bug2(occupied).run((4, 4), (0, 4))


def test_a_gap_between_corners_is_one_only_if_corners_may_be_cut():
    occupied = [[0, 1], [1, 0]]
    assert Bug2(occupied).run((0, 0), (1, 1)).tolist() == [[0, 0], [1, 1]]
    with pytest.raises(NoPath):
        Bug2(occupied, corner_cutting=False).run((0, 0), (1, 1))


def test_it_stays_where_it_is_when_it_is_there():
    robot = Bug2([[0]])
    assert robot.run((0, 0), (0, 0)).tolist() == [[0, 0]] and robot.m_line is None


def test_every_step_is_told_and_the_robot_can_be_stopped():
    occupied = np.zeros((5, 5))
    occupied[1:4, 2] = 1
    seen, stop = [], np.zeros(1, np.uint8)
    path = Bug2(occupied).run((0, 2), (4, 2), on_step=seen.append)
    assert [step.cell for step in seen if step.wall is None][0] == (0, 2) and seen[-1].cell == (4, 2)
    assert {step.cell for step in seen} == set(map(tuple, path.tolist()))
    assert any(step.wall == (2, 1) for step in seen)

    def one_step_only(step):
        stop[0] = 1

    with pytest.raises(Cancelled):
        Bug2(occupied).run((0, 2), (4, 2), on_step=one_step_only, stop=stop)


def test_it_knows_no_cell_that_it_did_not_touch():
    class Touched(np.ndarray):
        """Cells that remember which of them were read."""

        def __getitem__(self, key):
            if isinstance(key, tuple) and len(key) == 2 and all(isinstance(i, (int, np.integer)) for i in key):
                read.add(key[::-1])
            return super().__getitem__(key)

    read = set()
    occupied = np.zeros((9, 9), bool)
    occupied[2:7, 4] = True
    robot = Bug2(occupied)
    robot._occupied = occupied.view(Touched)
    path = robot.run((0, 4), (8, 4))
    near = {(x + dx, y + dy) for x, y in path.tolist() for dx in (-1, 0, 1) for dy in (-1, 0, 1)}
    assert read <= near


def test_the_m_line_and_the_hits_of_the_last_run_are_kept():
    occupied = np.zeros((5, 5))
    occupied[1:4, 2] = 1
    robot = Bug2(occupied)
    assert robot.m_line is None
    robot.run((0, 2), (4, 2))
    assert np.allclose(robot.m_line @ [[0, 4], [2, 2], [1, 1]], 0) and robot.hits == [(1, 2)]


def test_ends_are_checked_and_a_query_is_a_run():
    robot = Bug2([[0, 1, 0], [0, 0, 0]])
    for ends, kind in ((((1, 0), (0, 0)), StartOccupied), (((0, 0), (1, 0)), GoalOccupied),
                       (((-1, 0), (0, 0)), StartOutside), (((0, 0), (0, 2)), GoalOutside)):
        with pytest.raises(kind):
            robot.run(*ends)
    with pytest.raises(InvalidInput, match='no goal'):
        Bug2([[0, 0]]).run((0, 0))
    with pytest.raises(InvalidInput, match='no start'):
        Bug2([[0, 0]], goal=(0, 0)).run()
    with pytest.raises(InvalidInput, match='wall_on'):
        Bug2(wall_on='both')
    assert np.array_equal(robot.query((0, 0), (2, 0)), robot.run((0, 0), (2, 0)))


def test_a_run_is_filmed_and_drawn_with_its_m_line(tmp_path):
    robot = Bug2([[0, 1, 0], [0, 0, 0]])
    path = robot.run((0, 0), (2, 0), movie=tmp_path / 'run.gif')
    assert (tmp_path / 'run.gif').read_bytes().startswith(b'GIF')
    assert 'm-line' in [line.get_label() for line in robot.plot(path).lines]
