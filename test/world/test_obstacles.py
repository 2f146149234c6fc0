"""Obstacles: signed distances against shapely, and the names of the seed."""
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure

from mobile_planning import InvalidInput, Obstacle, PolygonObstacle, RoundObstacle

COORDINATES = st.floats(-20, 20).map(lambda value: round(value, 3))
POINTS = st.tuples(COORDINATES, COORDINATES)
SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
U_SHAPE = [(0, 0), (6, 0), (6, 5), (4, 5), (4, 1), (2, 1), (2, 5), (0, 5)]


@st.composite
def star_polygons(draw):
    """Draw a simple polygon, mostly concave, whose vertices stand around a centre, either way round."""
    count = draw(st.integers(3, 12))
    angles = 2 * np.pi * (np.arange(count) + draw(st.floats(0, 1))) / count
    radii = np.array(draw(st.lists(st.floats(0.2, 10), min_size=count, max_size=count)))
    vertices = np.c_[np.cos(angles), np.sin(angles)] * radii[:, None] + draw(POINTS)
    return vertices[::-1] if draw(st.booleans()) else vertices


def signed_by_shapely(vertices, point):
    """Return the signed distance as an independent library has it."""
    polygon, point = shapely.Polygon(vertices), shapely.Point(point)
    return polygon.exterior.distance(point) * (-1 if polygon.contains(point) else 1)


def test_a_point_obstacle_is_where_it_stands():
    obstacle = Obstacle((1, 2))
    assert (obstacle.x, obstacle.y, obstacle.centroid.tolist()) == (1.0, 2.0, [1.0, 2.0])
    assert obstacle.pt_2_obst((4, 6), offset=1) == 4.0
    assert obstacle.detected_dist((4, 6)) == 5.0


def test_a_disc_is_measured_from_its_circle():
    disc = RoundObstacle((1, 2), 2)
    assert disc.pt_2_obst((4, 6)) == 3.0
    assert disc.pt_2_obst((4, 6), offset=0.5) == 2.5
    assert disc.pt_2_obst((1, 2)) == -2.0
    assert disc.detected_dist((1, 3)) == 1.0
    assert (disc.x, disc.y, disc.radius, disc.bounding_circle_radius) == (1.0, 2.0, 2.0, 2.0)


@pytest.mark.parametrize('position, radius', [
    ((0, 0), -1), ((0, 0), np.nan), ((0, 0), np.inf), ((0, np.nan), 1), ((0, 0, 0), 1), ([[0, 0]], 1), (None, 1)])
def test_a_disc_that_is_none_is_refused(position, radius):
    with pytest.raises(InvalidInput):
        RoundObstacle(position, radius)


@given(star_polygons(), st.lists(POINTS, min_size=1, max_size=30))
def test_distances_to_a_polygon_are_exact_inside_and_out(vertices, points):
    distances = PolygonObstacle(vertices).distance(points)
    for point, distance in zip(points, distances):
        assert distance == pytest.approx(signed_by_shapely(vertices, point), abs=1e-9)


@given(star_polygons(), st.integers(0, 11), st.floats(0, 1))
def test_the_border_of_a_polygon_is_at_distance_0(vertices, index, share):
    a, b = vertices[index % len(vertices)], vertices[(index + 1) % len(vertices)]
    assert PolygonObstacle(vertices).pt_2_obst(a + share * (b - a)) == pytest.approx(0, abs=1e-9)


@pytest.mark.parametrize('point, expected', [
    ((3, 3), 1), ((3, 0.5), -0.5), ((1, 4), -1), ((3, 7), np.hypot(1, 2)), ((-1, 1), 1), ((3, 1), 0)])
def test_the_hollow_of_a_concave_polygon_is_outside(point, expected):
    assert PolygonObstacle(U_SHAPE).pt_2_obst(point) == pytest.approx(expected)


def test_a_vertex_hardly_above_the_point_counts_once():
    triangle = PolygonObstacle([(1, 4e-45), (-0.5, 0.866), (-0.5, -0.866)])
    assert triangle.pt_2_obst((0, 0)) == pytest.approx(-0.5, abs=1e-4)


def test_many_points_agree_with_one_at_a_time():
    points = np.random.default_rng(1).uniform(-2, 8, (20_000, 2))
    obstacle = PolygonObstacle(U_SHAPE)
    assert obstacle.distance(points[::500]) == pytest.approx([obstacle.pt_2_obst(point) for point in points[::500]])
    assert np.array_equal(obstacle.distance(points)[::500], obstacle.distance(points[::500]))


@pytest.mark.parametrize('obstacle', [Obstacle((0, 0)), RoundObstacle((0, 0), 1), PolygonObstacle(SQUARE)])
def test_points_of_any_shape_have_distances_of_that_shape(obstacle):
    assert obstacle.distance((1, 2)).shape == ()
    assert obstacle.distance(np.ones((3, 4, 2))).shape == (3, 4)
    assert obstacle.distance(np.ones((0, 2))).shape == (0,)


@pytest.mark.parametrize('obstacle', [Obstacle((0, 0)), RoundObstacle((0, 0), 1), PolygonObstacle(SQUARE)])
@pytest.mark.parametrize('point', [(np.nan, 0), (np.inf, 1), (1, 2, 3), [(1, 2), (3, 4)], [(1, 2)]])
def test_what_is_no_point_has_no_distance(obstacle, point):
    with pytest.raises(InvalidInput):
        obstacle.pt_2_obst(point)
    with pytest.raises(InvalidInput):
        obstacle.detected_dist(point)
    with pytest.raises(InvalidInput, match='offset'):
        obstacle.pt_2_obst((3, 4), np.nan)


@pytest.mark.parametrize('vertices', [
    [], [(0, 0)], [(0, 0), (1, 1)], [(0, 0), (1, 1), (0, 0)], [(0, 0), (1, 1), (2, 2)],
    [(0, 0), (2, 2), (2, 0), (0, 2)], [(0, 0), (4, 0), (2, 0), (2, 2)], [(0, 0), (1, 0), (np.nan, 1)],
    [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 0), (1, 0), (0.5, 1e-13)], (0, 0), None])
def test_a_polygon_that_is_none_is_refused(vertices):
    with pytest.raises(InvalidInput):
        PolygonObstacle(vertices)


def test_a_closed_ring_and_repeated_vertices_change_nothing():
    plain, ring = PolygonObstacle(SQUARE), PolygonObstacle([*SQUARE[:2], SQUARE[1], *SQUARE[2:], SQUARE[0]])
    assert np.array_equal(plain.vertices, ring.vertices)


@given(star_polygons())
def test_area_and_centroid_are_those_of_shapely(vertices):
    polygon = shapely.Polygon(vertices)
    closed = np.vstack([vertices, vertices[:1]])
    area = polygon.area if polygon.exterior.is_ccw else -polygon.area
    for form in (vertices, closed):
        assert PolygonObstacle._calculate_polygon_area(form, signed=True) == pytest.approx(area)
        assert PolygonObstacle._calculate_polygon_area(form) == pytest.approx(polygon.area)
        assert PolygonObstacle._calculate_polygon_centroid(form) == pytest.approx(polygon.centroid.coords[0], abs=1e-7)


def test_a_centroid_far_from_the_origin_is_still_exact():
    far = np.array(SQUARE) + (5e6, -3e6)
    assert PolygonObstacle(far).centroid.tolist() == [5e6 + 2, -3e6 + 2]


@given(star_polygons())
def test_the_bounding_circle_holds_every_vertex_and_touches_one(vertices):
    obstacle = PolygonObstacle(vertices)
    reach = np.hypot(*(obstacle.vertices - (obstacle.x, obstacle.y)).T)
    assert obstacle.bounding_circle_radius == pytest.approx(reach.max())


@given(star_polygons(), st.floats(0.05, 3))
def test_the_grown_outline_runs_at_the_offset(vertices, offset):
    obstacle = PolygonObstacle(vertices)
    assert obstacle.distance(obstacle._create_aug_vertices(offset)) == pytest.approx(offset, rel=1e-2)


def test_an_outline_grown_by_nothing_is_the_polygon():
    assert np.array_equal(PolygonObstacle(SQUARE)._create_aug_vertices(0), SQUARE)


@pytest.mark.parametrize('offset', [-1, np.nan, np.inf])
def test_an_outline_does_not_shrink(offset):
    with pytest.raises(InvalidInput, match='offset'):
        PolygonObstacle(SQUARE)._create_aug_vertices(offset)


def test_a_disc_is_drawn_grey_with_a_dashed_circle_around():
    fig = Figure()
    ax = fig.add_subplot()
    RoundObstacle((1, 2), 2).plot(fig, offset=0.5)
    disc, around = ax.patches
    assert (disc.radius, disc.get_fill(), disc.center) == (2.0, True, (1.0, 2.0))
    assert (around.radius, around.get_fill(), around.get_linestyle()) == (2.5, False, 'dashed')


def test_a_polygon_is_drawn_grey_with_a_dashed_outline_around():
    fig = Figure()
    ax = fig.add_subplot()
    PolygonObstacle(SQUARE).plot(fig, offset=1)
    polygon, around = ax.patches
    assert polygon.get_fill() and polygon.get_extents().width < around.get_extents().width
    assert (around.get_fill(), around.get_linestyle()) == (False, 'dashed')


def test_the_circle_of_a_disc_is_as_asked():
    patch = RoundObstacle((1, 2), 2)._plt_circle(color='r', linestyle='dashed', filled=True, alpha=0.5, offset=1)
    assert (patch.radius, patch.get_linestyle(), patch.get_fill(), patch.get_alpha()) == (3.0, 'dashed', True, 0.5)


@given(star_polygons())
def test_the_smallest_bounding_circle_holds_the_polygon_and_is_no_larger_than_need_be(vertices):
    polygon = PolygonObstacle(vertices)
    centre, radius = polygon.smallest_bounding_circle
    away = np.linalg.norm(polygon.vertices - centre, axis=1)
    assert away.max() == pytest.approx(radius, rel=1e-6)
    assert radius <= polygon.bounding_circle_radius * (1 + 1e-9)
    # It is the smallest: wherever its centre is moved to, some vertex gets farther away.
    for angle in np.linspace(0, 2 * np.pi, 16):
        moved = centre + 1e-3 * radius * np.array([np.cos(angle), np.sin(angle)])
        assert np.linalg.norm(polygon.vertices - moved, axis=1).max() >= radius * (1 - 1e-6)
