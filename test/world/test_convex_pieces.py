"""The convex pieces against shapely: they are the world, no more and no less, and no line separates them better."""
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from mobile_planning import Boundary, Environment, InvalidInput, OccupancyGrid, PolygonObstacle, RoundObstacle
from mobile_planning.world.convex_pieces import ConvexPieces, convex_parts
from mobile_planning.world.obstacles import Obstacle

SEEDS = st.integers(0, 2**32 - 1)
OCCUPIED = npst.arrays(np.bool_, npst.array_shapes(min_dims=2, max_dims=2, max_side=14))
ORIGINS = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3.1, 3.1))
STAR = [(0, 0), (4, 0), (4, 3), (3, 3), (3, 1), (1, 1), (1, 3), (0, 3)]
COMB = [(0, 0), (9, 0), (9, 3), (8, 3), (8, 1), (6, 1), (6, 3), (5, 3), (5, 1), (3, 1), (3, 3), (2, 3), (2, 1), (0, 1)]


def star_shaped(seed, count):
    """Return a simple polygon with ``count`` corners, about the origin, mostly not convex."""
    rng = np.random.default_rng(seed)
    angle = (np.arange(count) + rng.uniform(0.1, 0.9, count)) * 2 * np.pi / count
    return rng.uniform(0.3, 3.0, (count, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])


def hulls(pieces):
    """Return each piece's hull of vertices as a shape."""
    return [shapely.MultiPoint(vertices).convex_hull for vertices in pieces.vertices]


def random_world(rng):
    """Return an environment with obstacles of all kinds."""
    round_ones = [RoundObstacle(rng.uniform(-5, 5, 2), rng.uniform(0, 1)) for _ in range(rng.integers(0, 4))]
    polygons = [PolygonObstacle(star_shaped(rng.integers(2**32), rng.integers(3, 9)) + rng.uniform(-5, 5, 2))
                for _ in range(rng.integers(0, 3))]
    grid = OccupancyGrid(rng.random((8, 9)) < 0.3, rng.uniform(0.2, 2), (*rng.uniform(-9, 0, 2), rng.uniform(-3, 3)))
    return Environment(obstacles=[Obstacle(rng.uniform(-5, 5, 2)), *round_ones, *polygons], grid=grid)


# What they are made of


@given(OCCUPIED)
def test_rectangles_cover_each_occupied_cell_once_and_no_other(occupied):
    pieces = ConvexPieces(Environment(grid=OccupancyGrid(occupied)))
    covered = np.zeros(occupied.shape, int)
    for low, high in zip(pieces.vertices.min(axis=1).astype(int), pieces.vertices.max(axis=1).astype(int)):
        covered[low[1]:high[1], low[0]:high[0]] += 1
    assert (covered == occupied).all()


@given(OCCUPIED, ORIGINS, st.floats(0.02, 3))
def test_rectangles_of_a_turned_grid_are_its_cells(occupied, origin, resolution):
    grid = OccupancyGrid(occupied, resolution, origin)
    shapes = hulls(ConvexPieces(Environment(grid=grid)))
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    for y, x in np.ndindex(occupied.shape):
        # Without its rim: of shapes that touch in turned edges GEOS may find the whole cell in common.
        cell = shapely.Polygon(grid.grid_to_world((x + 0.001, y + 0.001) + 0.998 * corners))
        covered = sum(cell.intersection(shape).area for shape in shapes)
        assert covered == pytest.approx(occupied[y, x] * cell.area, rel=1e-6, abs=1e-9)


def test_a_block_of_cells_is_one_piece_whichever_way_it_is_long():
    occupied = np.zeros((40, 40), bool)
    occupied[3:30, 5:8] = True
    occupied[35:38, 2:39] = True
    assert len(ConvexPieces(Environment(grid=OccupancyGrid(occupied)))) == 2


def test_unknown_and_doubtful_cells_are_pieces_where_the_environment_says_so():
    grid = OccupancyGrid([[-1, 0, 50, 0, 100]])
    assert len(ConvexPieces(Environment(grid=grid))) == 2
    assert len(ConvexPieces(Environment(grid=grid, occupied_from=40, unknown_is_free=True))) == 2
    assert len(ConvexPieces(Environment(grid=grid, occupied_from=40))) == 3


@settings(max_examples=200)
@given(SEEDS, st.integers(3, 40))
def test_the_parts_of_a_polygon_are_convex_and_are_the_polygon(seed, count):
    vertices = star_shaped(seed, count)
    parts, whole = convex_parts(vertices), shapely.Polygon(vertices)
    shapes = [shapely.Polygon(part) for part in parts]
    for shape in shapes:
        assert shape.convex_hull.area == pytest.approx(shape.area, rel=1e-9)
    assert sum(shape.area for shape in shapes) == pytest.approx(whole.area, rel=1e-9)
    union = shapely.union_all([shape.convex_hull for shape in shapes])
    assert union.symmetric_difference(whole).area <= 1e-9 * whole.area
    assert union.buffer(1e-9).covers(whole)
    assert {vertex for part in parts for vertex in part} <= {tuple(vertex) for vertex in vertices.tolist()}


@pytest.mark.parametrize('outline, fewest', [(STAR, 3), (COMB, 4)], ids=['u', 'comb'])
def test_a_polygon_has_few_parts(outline, fewest):
    assert fewest <= len(convex_parts(PolygonObstacle(outline).vertices)) <= 2 * fewest


def test_a_convex_polygon_is_one_piece_even_with_corners_on_a_straight_edge():
    turned = np.array([(0, 0), (1, 0), (2, 0), (2, 2), (0, 2), (0, 1)]) @ [[0.8, 0.6], [-0.6, 0.8]] + 0.1
    assert len(convex_parts(PolygonObstacle(turned).vertices)) == 1


def test_a_large_polygon_is_cut_up_quickly_and_exactly():
    vertices = star_shaped(1, 3000)
    assert sum(shapely.Polygon(part).area for part in convex_parts(vertices)) == pytest.approx(
        shapely.Polygon(vertices).area)


def test_points_and_discs_are_one_vertex_with_a_radius():
    pieces = ConvexPieces(Environment(obstacles=[Obstacle((1, 2)), RoundObstacle((3, 4), 0.5), PolygonObstacle(STAR)]))
    assert pieces.vertices[:2, 0].tolist() == [[1, 2], [3, 4]] and pieces.radii[:3].tolist() == [0, 0.5, 0]
    assert pieces.counts[:2].tolist() == [1, 1] and (pieces.vertices[0] == (1, 2)).all()
    assert len(pieces) == len(pieces.counts) == len(pieces.radii) == len(pieces.vertices)


def test_an_obstacle_of_an_unknown_kind_is_refused_not_forgotten():
    class Cloud(Obstacle):
        """Something of which we know the place only."""

    with pytest.raises(InvalidInput, match='neither'):
        ConvexPieces(Environment(obstacles=[Cloud((0, 0))]))


# Walls


@settings(max_examples=50)
@given(SEEDS, st.booleans(), st.booleans())
def test_walls_are_the_edges_of_boundary_and_map(seed, has_boundary, has_grid):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-5, 0, 2)
    boundary = Boundary(*np.column_stack([low, low + rng.uniform(1, 10, 2)])) if has_boundary else None
    grid = OccupancyGrid(np.zeros((6, 8), int), 1.0, (*rng.uniform(-5, 0, 2), rng.uniform(-3, 3))) if has_grid else None
    environment = Environment(boundary, grid=grid)
    pieces = ConvexPieces(environment)
    points = rng.uniform(-12, 12, (500, 2))
    inside = (points @ pieces.wall_normals.T >= pieces.wall_offsets).all(axis=1)
    assert (inside == (environment.clearance(points) >= 0)).all()
    assert np.linalg.norm(pieces.wall_normals, axis=1) == pytest.approx(1.0)
    room = (points @ pieces.wall_normals.T - pieces.wall_offsets).min(axis=1, initial=np.inf)
    assert room[inside] == pytest.approx(environment.clearance(points)[inside])


@pytest.mark.parametrize('boundary, walls', [
    (Boundary((0, 8), (0, 6)), 4), (Boundary((-1, 9), (-1, 7)), 4), (Boundary((1, 7), (1, 5)), 4),
    (Boundary((1, 9), (-1, 5)), 4), (None, 4)])
def test_walls_that_nothing_reaches_are_left_out(boundary, walls):
    grid = OccupancyGrid(np.zeros((6, 8), int), 1.0)
    assert len(ConvexPieces(Environment(boundary, grid=grid)).wall_offsets) == walls


def test_an_empty_world_has_no_pieces_and_no_walls():
    pieces = ConvexPieces(Environment())
    starts, found = pieces.near([(0, 0), (-np.inf, 5)], [(1, 1), (np.inf, 5)])
    assert len(pieces) == len(pieces.vertices) == len(pieces.wall_offsets) == len(found) == 0
    assert starts.tolist() == [0, 0, 0]
    assert len(pieces.lines(np.zeros((1, 4, 2)), [], [])[2]) == 0


# What is near


@settings(max_examples=100)
@given(SEEDS)
def test_near_finds_each_piece_whose_box_touches_once(seed):
    rng = np.random.default_rng(seed)
    pieces = ConvexPieces(random_world(rng))
    low = rng.uniform(-12, 12, (20, 2))
    high = low + rng.exponential(3, (20, 2)) * (rng.random((20, 1)) < 0.8)
    low[0], high[0], high[1] = -np.inf, np.inf, 1e300
    starts, found = pieces.near(low, high)
    piece_low = pieces.vertices.min(axis=1) - pieces.radii[:, None]
    piece_high = pieces.vertices.max(axis=1) + pieces.radii[:, None]
    for box in range(20):
        touching = ((piece_low <= high[box]) & (piece_high >= low[box])).all(axis=1)
        assert sorted(found[starts[box]:starts[box + 1]]) == np.flatnonzero(touching).tolist()


def test_a_box_that_only_touches_counts():
    pieces = ConvexPieces(Environment(obstacles=[RoundObstacle((0, 0), 1)]))
    for low, high, count in (((1, 0), (2, 0), 1), ((1.01, 0), (2, 0), 0), ((-3, -1), (-1, -1), 1), ((0, 0), (0, 0), 1)):
        assert len(pieces.near([low], [high])[1]) == count


def test_a_cluttered_map_stays_small():
    rng = np.random.default_rng(3)
    pieces = ConvexPieces(Environment(grid=OccupancyGrid(rng.random((512, 512)) < 0.2, 0.05)))
    starts, found = pieces.near([(12, 12)], [(12.5, 12.5)])
    assert 10 < len(found) < 100
    assert len(pieces) < 0.2 * 512**2 and sum(a.nbytes for a in pieces._buckets if np.ndim(a)) < 4e6


@pytest.mark.parametrize('low, high', [([(0, np.nan)], [(1, 1)]), ([(0, 0)], [(1, 1), (2, 2)]), ([0, 0], [1, 1])])
def test_boxes_that_are_none_are_refused(low, high):
    with pytest.raises(InvalidInput):
        ConvexPieces(Environment(obstacles=[Obstacle((0, 0))])).near(low, high)


# Lines


def pairs(rng, pieces, count=60):
    """Return curves, some of them at rest or straight, and pairs with pieces."""
    curves = rng.uniform(-8, 8, (12, 1, 2)) + rng.exponential(1, (12, 1, 1)) * rng.normal(size=(12, 4, 2))
    curves[0] = curves[0, 0]
    curves[1, 1:3] = curves[1, 0]
    curves[2] = pieces.vertices[0, 0] + (1, 0) + np.linspace(0, 1, 4)[:, None] * (0, 1)
    return curves, rng.integers(0, 12, count), rng.integers(0, len(pieces), count)


@settings(max_examples=150)
@given(SEEDS)
def test_a_line_has_the_piece_on_one_side_and_the_curve_as_far_on_the_other_as_can_be(seed):
    rng = np.random.default_rng(seed)
    pieces = ConvexPieces(random_world(rng))
    curves, spans, chosen = pairs(rng, pieces)
    normals, offsets, distances = pieces.lines(curves, spans, chosen)
    shapes = hulls(pieces)
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0)
    for normal, offset, distance, span, piece in zip(normals, offsets, distances, spans, chosen):
        radius = pieces.radii[piece]
        assert (pieces.vertices[piece] @ normal).max() + radius == pytest.approx(offset, abs=1e-12)
        assert (curves[span] @ normal).min() - offset == pytest.approx(distance, abs=1e-12)
        apart = shapely.MultiPoint(curves[span]).convex_hull.distance(shapes[piece])
        if apart > 0:
            assert distance == pytest.approx(apart - radius, abs=1e-9)
        else:
            assert distance <= -radius + 1e-9


@settings(max_examples=50)
@given(SEEDS)
def test_where_curve_and_piece_overlap_the_line_is_the_shortest_way_out(seed):
    rng = np.random.default_rng(seed)
    pieces = ConvexPieces(Environment(obstacles=[PolygonObstacle(star_shaped(seed, 3))]))
    curve = rng.normal(0, 0.3, (1, 4, 2))
    normals, _, distances = pieces.lines(curve, [0], [0])
    angle = np.linspace(-np.pi, np.pi, 2001)
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    gaps = (curve[0] @ directions.T).min(axis=0) - (pieces.vertices[0] @ directions.T).max(axis=0)
    assert gaps.max() <= distances[0] + 1e-12 and distances[0] <= gaps.max() + 0.02


@settings(max_examples=50)
@given(SEEDS)
def test_what_keeps_to_the_lines_of_all_pieces_is_in_free_space(seed):
    rng = np.random.default_rng(seed)
    environment = random_world(rng)
    pieces = ConvexPieces(environment)
    points = rng.uniform(-12, 12, (200, 2))
    every = np.arange(len(pieces))
    _, _, distances = pieces.lines(points[:, None], np.repeat(np.arange(200), len(every)), np.tile(every, 200))
    walls = (points @ pieces.wall_normals.T - pieces.wall_offsets).min(axis=1)
    room, clearance = np.minimum(distances.reshape(200, -1).min(axis=1), walls), environment.clearance(points)
    assert (clearance <= np.maximum(room, 0) + 1e-9).all()
    assert (room[clearance > 0] > 0).all()


def test_a_curve_that_touches_a_piece_is_at_distance_zero_and_the_normal_is_that_of_the_edge():
    pieces = ConvexPieces(Environment(grid=OccupancyGrid([[100, 0]], 1.0)))
    for x in (1.0, 1.0 + 1e-13, 1.0 - 1e-13):
        normals, offsets, distances = pieces.lines([[(x, 0.2), (1.2, 0.3), (1.4, 0.3), (1.5, 0.5)]], [0], [0])
        assert normals[0] == pytest.approx([1, 0]) and distances[0] == pytest.approx(x - 1, abs=1e-15)


def test_a_curve_on_the_very_centre_of_a_disc_has_a_line_as_well():
    pieces = ConvexPieces(Environment(obstacles=[RoundObstacle((1, 1), 0.5)]))
    normals, offsets, distances = pieces.lines(np.ones((1, 4, 2)), [0], [0])
    assert np.linalg.norm(normals) == 1 and distances[0] == -0.5


def test_far_from_the_origin_lines_are_nearly_as_exact():
    far = np.array([8e5, -7e5])
    pieces = ConvexPieces(Environment(obstacles=[PolygonObstacle(np.array(STAR) + far)]))
    curve = np.array([[(6, 1), (6, 2), (7, 2), (8, 2)]]) + far
    distances = pieces.lines(curve, np.zeros(len(pieces), int), np.arange(len(pieces)))[2]
    assert distances.min() == pytest.approx(2, abs=1e-8)


@pytest.mark.parametrize('spans, found', [([1], [0]), ([-1], [0]), ([0], [1]), ([0], [-1])])
def test_a_pair_that_does_not_exist_is_an_error(spans, found):
    with pytest.raises(IndexError):
        ConvexPieces(Environment(obstacles=[Obstacle((0, 0))])).lines(np.ones((1, 4, 2)), spans, found)


@pytest.mark.parametrize('curves, spans, found', [
    (np.full((1, 4, 2), np.nan), [0], [0]), (np.ones((4, 2)), [0], [0]), (np.ones((1, 4, 2)), [0, 0], [0])])
def test_curves_that_are_none_are_refused(curves, spans, found):
    with pytest.raises(InvalidInput):
        ConvexPieces(Environment(obstacles=[Obstacle((0, 0))])).lines(curves, spans, found)
