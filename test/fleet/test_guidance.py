"""Guidance: free paths near the optimum, around parked robots; and arc lengths against brute force."""
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from mobile_planning import Boundary, Environment, NoPath, OccupancyGrid, PolygonObstacle, RoundObstacle
from mobile_planning.fleet.guidance import Guidance, Polyline

ROOM = Boundary((0, 10), (0, 6))
PLACES = st.tuples(st.floats(0.4, 9.6), st.floats(0.4, 5.6))
PATHS = npst.arrays(float, st.tuples(st.integers(1, 6), st.just(2)), elements=st.floats(-5, 5, width=16))


def length(path):
    return np.linalg.norm(np.diff(path, axis=0), axis=1).sum()


def along(path, step=0.02):
    """Return points every ``step`` of a path."""
    return np.concatenate([a + np.linspace(0, 1, max(2, int(np.linalg.norm(b - a) / step)))[:, None] * (b - a)
                           for a, b in zip(path, path[1:])])


@settings(max_examples=40)
@given(PLACES, PLACES)
def test_in_an_empty_room_the_path_is_nearly_the_straight_line(start, goal):
    path = Guidance(Environment(ROOM), goal, 0.2).path(start)
    assert path[0] == pytest.approx(start) and path[-1] == pytest.approx(goal)
    # Beside the straight line by no more than the room asked for at the walls, and by two cells.
    assert length(path) <= np.linalg.norm(np.subtract(goal, start)) + 0.25


@settings(max_examples=40)
@given(PLACES, PLACES)
def test_the_path_keeps_off_what_stands_in_the_way(start, goal):
    world = Environment(ROOM, [RoundObstacle((5, 3), 1.0), PolygonObstacle([(2, 1), (3, 1), (3, 4), (2, 4)])])
    assume(world.clearance([start, goal]).min() >= 0.45)
    path = Guidance(world, goal, 0.2).path(start)
    # A cell's diagonal is lost between cell centres.
    assert world.clearance(along(path)).min() >= 0.2


def test_the_way_round_a_wall_is_nearly_the_shortest():
    world = Environment(ROOM, [PolygonObstacle([(4.9, 0), (5.1, 0), (5.1, 4), (4.9, 4)])])
    path = Guidance(world, (8, 1), 0.2).path((2, 1))
    # Taut around the two corners, kept 0.35 m away.
    least = 2 * np.hypot(2.9, 3) + 0.2
    assert least <= length(path) <= least + 1.0


def test_the_path_avoids_parked_robots():
    guidance = Guidance(Environment(ROOM), (9, 3), 0.2)
    parked = [(4, 3), (6, 2.5)]
    path = guidance.path((1, 3), parked, 0.41)
    distance = np.linalg.norm(along(path)[:, None] - parked, axis=-1)
    assert distance.min() >= 0.41
    assert length(path) < 9.0


def test_parked_robots_that_close_every_way_are_left_out():
    guidance = Guidance(Environment(Boundary((0, 10), (0, 1))), (9, 0.5), 0.2)
    assert length(guidance.path((1, 0.5), [(5, 0.5)], 0.41)) == pytest.approx(8.0, abs=0.1)


def test_a_narrow_door_is_taken_where_there_is_no_wider_one():
    for gap in (0.7, 0.5):
        world = Environment(ROOM, [PolygonObstacle([(4.9, 0), (5.1, 0), (5.1, 3), (4.9, 3)]),
                                   PolygonObstacle([(4.9, 3 + gap), (5.1, 3 + gap), (5.1, 6), (4.9, 6)])])
        path = Guidance(world, (9, 3.3), 0.2, resolution=0.05).path((1, 3.3))
        assert world.clearance(along(path)).min() >= 0.2


def test_no_path_is_an_error_of_its_own():
    wall = PolygonObstacle([(4.9, -1), (5.1, -1), (5.1, 7), (4.9, 7)])
    guidance = Guidance(Environment(ROOM, [wall]), (9, 3), 0.2)
    with pytest.raises(NoPath, match='0.2 m'):
        guidance.path((1, 3))


def test_a_gap_narrower_than_the_body_is_no_path():
    walls = [PolygonObstacle([(4.9, -1), (5.1, -1), (5.1, 2.85), (4.9, 2.85)]),
             PolygonObstacle([(4.9, 3.15), (5.1, 3.15), (5.1, 7), (4.9, 7)])]
    with pytest.raises(NoPath):
        Guidance(Environment(ROOM, walls), (9, 3), 0.2).path((1, 3))
    assert len(Guidance(Environment(ROOM, walls), (9, 3), 0.1, resolution=0.05).path((1, 3))) >= 2


@pytest.mark.parametrize('goal', [(0.2, 3), (9.8, 5.8), (0.2, 0.2), (5, 5.799)])
def test_a_goal_with_no_room_beyond_the_body_is_reached(goal):
    path = Guidance(Environment(ROOM), goal, 0.2).path((5, 3))
    assert path[-1] == pytest.approx(goal)
    assert length(path) <= 1.2 * np.linalg.norm(np.subtract(goal, (5, 3)))


def test_a_start_with_no_room_beyond_the_body_is_left():
    path = Guidance(Environment(ROOM), (9, 3), 0.2).path((0.2, 0.2))
    assert path[0] == pytest.approx((0.2, 0.2)) and len(path) >= 2


def test_a_turned_map_is_walked_in_the_frame_of_the_world():
    data = np.zeros((60, 100), int)
    data[:40, 50] = 100
    grid = OccupancyGrid(data, 0.1, (3.0, -2.0, 0.6))
    world = Environment(grid=grid)
    start, goal = grid.cell_to_world([(10, 10), (90, 10)])
    path = Guidance(world, goal, 0.2).path(start)
    assert world.clearance(along(path)).min() >= 0.15
    assert 9.5 < length(path) < 11.5


def test_at_the_goal_the_path_is_a_point():
    path = Guidance(Environment(ROOM), (5, 3), 0.2).path((5, 3))
    assert length(path) == pytest.approx(0)


# Polylines


def at_arc(points, arc):
    """Return the point of a polyline at an arc length, by walking along it."""
    for a, b in zip(points, points[1:]):
        piece = np.linalg.norm(b - a)
        if arc <= piece and piece > 0:
            return a + (b - a) * arc / piece
        arc -= piece
    return points[-1]


@given(PATHS, npst.arrays(float, (3, 2), elements=st.floats(-6, 6, width=16)))
def test_the_projection_is_the_nearest_point(points, positions):
    path = Polyline(points)
    arc, distance = path.project(positions)
    samples = points[:1] if len(points) < 2 else np.vstack([along(points, 0.01), points])
    brute = np.linalg.norm(positions[:, None] - samples, axis=-1).min(axis=1)
    assert (distance <= brute + 1e-9).all() and (distance >= brute - 0.011).all()
    for s, far, position in zip(arc, distance, positions):
        assert np.linalg.norm(at_arc(points, s) - position) == pytest.approx(far, abs=1e-6)


@given(PATHS)
def test_the_length_is_the_sum_of_the_segments(points):
    assert Polyline(points).length == pytest.approx(length(points), abs=1e-6)


@given(PATHS, st.floats(0, 1), st.floats(-1, 1))
def test_beside_the_path_is_square_to_it(points, share, offset):
    path = Polyline(points)
    arc = np.array([share * path.length])
    on, beside = path.beside(arc, np.zeros(1))[0], path.beside(arc, np.array([offset]))[0]
    assert on == pytest.approx(at_arc(points, arc[0]), abs=1e-6)
    if path.length > 0:
        assert np.linalg.norm(beside - on) == pytest.approx(abs(offset))


def test_left_of_the_path_is_positive():
    path = Polyline(np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]]))
    assert path.beside(np.array([1.0, 3.0]), np.array([0.5, -0.5])).tolist() == [[1.0, 0.5], [2.5, 1.0]]
