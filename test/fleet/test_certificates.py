"""Proofs between samples, against dense samples by scipy: never wrong, and not needlessly strict."""
import numpy as np
import pytest
from curves import curve, dense, walks
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mobile_planning import Boundary, Environment, OccupancyGrid, PolygonObstacle, RoundObstacle
from mobile_planning.fleet.certificates import keeps_apart, keeps_clear

SHIFT = st.tuples(st.floats(-1.5, 1.5), st.floats(-1.5, 1.5))


def padded(points, count):
    return np.vstack([points, np.repeat(points[-1:], count - len(points), axis=0)])


def line(start, end, spans=10):
    """Return control points (n, 2) of an even drive from rest to rest."""
    share = np.concatenate([[0, 0], np.linspace(0, 1, spans), [1, 1]])
    return np.asarray(start) + share[:, None] * (np.asarray(end, float) - start)


def squares(grid):
    """Return the lower left and upper right corners of the occupied cells (K, 2), (K, 2) [m], of an upright grid."""
    low = np.argwhere(grid.data >= 65)[:, ::-1] * grid.resolution + grid.origin[:2]
    return low, low + grid.resolution


def distance_to_squares(grid, points):
    low, high = squares(grid)
    gap = np.maximum(np.maximum(low - points[:, None], points[:, None] - high), 0)
    return np.linalg.norm(gap, axis=-1).min(axis=1)


WALLED = OccupancyGrid(np.array([[0, 0, 0, 0, 0, 100, 0, 0]] * 3 + [[0] * 8] * 4 + [[100, 100, 0, 0, 0, 0, 0, 0]]),
                       0.5, (-2.0, -2.0, 0.0))
SHAPES = Environment(Boundary((-2, 2), (-2, 2)),
                     [RoundObstacle((0.8, 0.5), 0.3), PolygonObstacle([(-1.5, -1), (-0.5, -1), (-1, 0)])])


@settings(max_examples=300)
@given(walks(8), SHIFT, st.floats(0.02, 0.5))
def test_what_keeps_clear_of_shapes_is_clear_at_every_instant(points, shift, radius):
    points = points + shift
    assume(keeps_clear(points, radius, SHAPES))
    places = curve(points, 1.0)(dense(points, 1.0, 100))
    assert np.linalg.norm(places - (0.8, 0.5), axis=1).min() >= 0.3 + radius - 1e-9
    assert (np.abs(places) <= 2 - radius + 1e-9).all()
    assert min(obstacle.distance(places).min() for obstacle in SHAPES.obstacles) >= radius - 1e-9


@settings(max_examples=300)
@given(walks(8), SHIFT, st.floats(0.02, 0.5))
def test_what_keeps_clear_of_a_grid_touches_no_occupied_square(points, shift, radius):
    points = points + shift
    assume(keeps_clear(points, radius, Environment(grid=WALLED)))
    places = curve(points, 1.0)(dense(points, 1.0, 100))
    assert distance_to_squares(WALLED, places).min() >= radius - 1e-9


@pytest.mark.parametrize('passing, is_clear', [(0.515, True), (0.53, True), (0.49, False), (0.0, False)])
def test_a_drive_past_an_obstacle_is_judged_within_two_centimetres(passing, is_clear):
    world = Environment(Boundary((-10, 10), (-10, 10)), [RoundObstacle((0, 0), 0.3)])
    assert keeps_clear(line((-2, passing), (2, passing), 40), 0.2, world) == is_clear


def test_a_robot_at_rest_is_judged_exactly():
    world = Environment(Boundary((0, 10), (0, 10)))
    at = np.tile([0.25, 5.0], (4, 1))
    assert keeps_clear(at, 0.249999, world) and not keeps_clear(at, 0.250001, world)


def test_an_obstacle_between_two_knots_is_seen():
    world = Environment(Boundary((-10, 10), (-10, 10)), [RoundObstacle((0, 0), 0.01)])
    assert not keeps_clear(np.arange(-4.5, 5.0)[:, None] * (1.0, 0.0), 0.01, world)


@settings(max_examples=400)
@given(walks(8), walks(8), SHIFT, st.floats(0.05, 1.0))
def test_what_keeps_apart_is_apart_at_every_instant(points, others, shift, distance):
    count = max(len(points), len(others))
    points, others = padded(points, count), padded(others + shift, count)
    assume(keeps_apart(points, others, distance))
    t = dense(points, 1.0, 100)
    assert np.linalg.norm(curve(points, 1.0)(t) - curve(others, 1.0)(t), axis=1).min() >= distance - 1e-9


@settings(max_examples=200)
@given(walks(8), walks(8), SHIFT, st.floats(0.05, 1.0))
def test_two_plans_keep_apart_whoever_asks(points, others, shift, distance):
    count = max(len(points), len(others))
    points, others = padded(points, count), padded(others + shift, count)
    assert keeps_apart(points, others, distance) == keeps_apart(others, points, distance)


@pytest.mark.parametrize('passing, is_apart', [(0.45, True), (0.41, True), (0.39, False), (0.0, False)])
def test_robots_that_pass_each_other_are_judged_within_a_centimetre(passing, is_apart):
    there, back = line((0, 0), (4, 0), 16), line((4, passing), (0, passing), 16)
    assert keeps_apart(there, back, 0.4) == is_apart


def test_robots_that_swap_places_between_two_knots_are_seen():
    there = np.arange(8.0)[:, None] * (1.0, 0.0)
    assert not keeps_apart(there, there[::-1], 0.1)


def test_crossing_one_after_the_other_keeps_apart():
    first, second = line((-2, 0), (2, 0), 16), line((0, -2), (0, 2), 16)
    late = np.vstack([np.tile(second[:1], (10, 1)), second])
    assert keeps_apart(padded(first, len(late)), late, 0.4)
    assert not keeps_apart(first, second, 0.4)


def test_candidates_are_judged_one_by_one():
    plans = np.stack([line((0, y), (4, y)) for y in (0.0, 0.5, 1.0)])
    other = line((4, 0), (0, 0))
    assert keeps_apart(plans, other, 0.6).tolist() == [False, False, True]
    assert keeps_apart(plans, other, np.array([0.0, 0.4, 2.0])).tolist()[1:] == [True, False]
    world = Environment(Boundary((-1, 5), (-1, 1.1)))
    assert keeps_clear(plans, 0.2, world).tolist() == [True, True, False]
