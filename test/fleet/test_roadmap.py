"""Roadmap: what it joins, what keeps clear, and which passages are lanes."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import label
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components

from mobile_planning import Boundary, Environment, PolygonObstacle, RoundObstacle
from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.roadmap import LONG_REACH, SPACING, TIGHT, Roadmap, distances
from mobile_planning.geometry import point_to_segment

RADIUS = 0.205


def box(x_min, y_min, x_max, y_max):
    return PolygonObstacle([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


def wall_with_doors(*doors, width=0.65):
    """Return a room of 8 m x 6 m with a wall at x = 0 that has doors at the given y."""
    ends = [-3.0, *(y + side * width / 2 for y in sorted(doors) for side in (-1, 1)), 3.0]
    walls = [box(-0.1, low, 0.1, high) for low, high in zip(ends[::2], ends[1::2])]
    return Environment(Boundary((-4, 4), (-3, 3)), walls)


def joins(roadmap, a, b):
    """Whether edges lead from a place near a to one near b, by a search of our own."""
    near = [int(np.linalg.norm(roadmap.places - place, axis=1).argmin()) for place in (a, b)]
    reached, front = {near[0]}, [near[0]]
    while front:
        here = front.pop()
        for u, v in roadmap.edges.tolist():
            other = v if u == here else u if v == here else None
            if other is not None and other not in reached:
                reached.add(other)
                front.append(other)
    return near[1] in reached


@pytest.mark.parametrize('y', np.linspace(-1.03, 1.04, 5))
def test_a_door_of_three_radii_is_found_wherever_it_lies(y):
    assert joins(Roadmap(wall_with_doors(y), RADIUS), (-2, 0), (2, 0))


@settings(max_examples=25, deadline=None)
@given(st.floats(-0.06, 0.06), st.floats(-0.06, 0.06), st.floats(-0.15, 0.15))
def test_a_door_of_three_radii_is_found_and_is_a_lane_however_it_lies_to_the_cells(x, y, angle):
    along = np.array([(np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))])
    corners = np.array([(-0.1, 0.3), (0.1, 0.3), (0.1, 6.0), (-0.1, 6.0)])
    walls = [PolygonObstacle(each @ along + (x, y)) for each in (corners, -corners)]
    roadmap = Roadmap(Environment(Boundary((-4, 4), (-3, 3)), walls), 0.2)
    assert joins(roadmap, (-2, 0), (2, 0)) and roadmap.has_lanes


def parts(roadmap):
    """Return which part of the roadmap each place belongs to."""
    graph = csr_matrix((np.ones(len(roadmap.edges)), roadmap.edges.T), shape=(len(roadmap.places),) * 2)
    return connected_components(graph, directed=False)[1]


def turned(corners, angle, middle):
    """Return a polygon turned about the origin and moved."""
    cos, sin = np.cos(angle), np.sin(angle)
    return PolygonObstacle(np.asarray(corners) @ np.array([(cos, sin), (-sin, cos)]) + middle)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 4), st.floats(0, 4), st.floats(0, np.pi), st.floats(0.3, 2.5),
                          st.floats(0.02, 0.4)), min_size=2, max_size=7),
       st.lists(st.tuples(st.floats(0, 4), st.floats(0, 4), st.floats(0.1, 0.6)), max_size=3))
def test_whatever_a_body_can_drive_between_is_joined(walls, circles):
    turns = [turned([(-length, -thick), (length, -thick), (length, thick), (-length, thick)], angle, (x, y))
             for x, y, angle, length, thick in walls]
    world = Environment(Boundary((0, 4), (0, 4)), [*turns, *(RoundObstacle((x, y), size) for x, y, size in circles)])
    roadmap = Roadmap(world, RADIUS)
    # What is eroded by a little more than edges need, at 16 mm: neighbours are joined by ways with room.
    low, cell = 0.0, 0.016
    at = np.arange(low, 4.0, cell)
    pieces, _ = label(world.clearance(np.stack(np.meshgrid(at, at), axis=-1)) >= RADIUS + TIGHT + 0.009)
    columns, rows = np.rint(roadmap.places / cell).astype(int).clip(max=len(at) - 1).T
    piece, part = pieces[rows, columns], parts(roadmap)
    for number in np.unique(piece[piece > 0]):
        assert len(np.unique(part[piece == number])) == 1


@settings(max_examples=20, deadline=None)
@given(st.floats(-0.3, 0.3), st.floats(-0.6, 0.6), st.floats(0.46, 0.65), st.floats(0.46, 0.65), st.floats(0.01, 0.4),
       st.floats(1.2, 2.5))
def test_each_of_two_doors_has_an_edge_through_it(x, angle, width, other, thick, apart):
    ends = [-9.0, -apart / 2 - width, -apart / 2, apart / 2, apart / 2 + other, 9.0]
    walls = [turned([(-thick, low), (thick, low), (thick, high), (-thick, high)], angle, (x, 0.0))
             for low, high in zip(ends[::2], ends[1::2])]
    roadmap = Roadmap(Environment(Boundary((-4, 4), (-3, 3)), walls), RADIUS)
    ends = (roadmap.places[roadmap.edges] - (x, 0.0)) @ np.array([(np.cos(angle), -np.sin(angle)),
                                                                 (np.sin(angle), np.cos(angle))])
    crosses = (ends[:, 0, 0] > 0) != (ends[:, 1, 0] > 0)
    (x_a, y_a), (x_b, y_b) = ends[crosses].transpose(1, 2, 0)
    at = y_a - x_a * (y_b - y_a) / (x_b - x_a)
    for low, high in ((-apart / 2 - width, -apart / 2), (apart / 2, apart / 2 + other)):
        assert ((at > low) & (at < high)).any()


def test_a_door_that_is_too_narrow_joins_nothing():
    assert not joins(Roadmap(wall_with_doors(0.0, width=0.4), RADIUS), (-2, 0), (2, 0))


def test_a_single_door_is_a_lane_and_one_of_two_near_each_other_is_not():
    assert Roadmap(wall_with_doors(0.0), RADIUS).lane_at([(0, 0)]) > 0
    assert Roadmap(wall_with_doors(-0.6, 0.6), RADIUS).lane_at([(0, -0.6), (0, 0.6)]).tolist() == [0, 0]


def test_both_of_two_doors_far_apart_are_lanes():
    lanes = Roadmap(wall_with_doors(-2.5, 2.5), RADIUS).lane_at([(0, -2.5), (0, 2.5), (1, 0)]).tolist()
    assert lanes[0] > 0 and lanes[1] > 0 and lanes[0] != lanes[1] and lanes[2] == 0


def test_a_door_wide_enough_for_two_is_no_lane():
    assert not Roadmap(wall_with_doors(0.0, width=1.2), RADIUS).has_lanes


def test_what_is_narrow_for_the_widest_is_a_lane_for_all():
    world = wall_with_doors(0.0, width=1.2)
    assert Roadmap(world, RADIUS, widest=0.4).has_lanes


@settings(max_examples=10, deadline=None)
@given(st.lists(st.tuples(st.floats(0, 6), st.floats(0, 6), st.floats(0.2, 1)), max_size=6))
def test_edges_keep_their_distance_and_places_are_apart(circles):
    world = Environment(Boundary((0, 6), (0, 6)), [RoundObstacle((x, y), radius) for x, y, radius in circles])
    roadmap = Roadmap(world, RADIUS)
    ends = roadmap.places[roadmap.edges]
    for share in np.linspace(0, 1, 50):
        room = world.clearance(ends[:, 0] + share * (ends[:, 1] - ends[:, 0]))
        # Between its samples an edge may be nearer by less than a millimetre or two.
        assert (room >= roadmap.rooms - 0.002).all() and (room >= RADIUS + TIGHT - 0.002).all()
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    is_spread = (roadmap.edges < roadmap.spread).all(axis=1)
    assert (lengths[is_spread] >= SPACING - 1e-6).all() and (lengths <= LONG_REACH + 1e-6).all()


def test_every_free_place_is_near_a_place_of_the_roadmap():
    world = wall_with_doors(0.3)
    roadmap = Roadmap(world, RADIUS)
    points = np.random.default_rng(0).uniform((-4, -3), (4, 3), (500, 2))
    free = points[world.clearance(points) >= RADIUS + 0.05]
    assert np.linalg.norm(free[:, None] - roadmap.places, axis=2).min(axis=1).max() < SPACING + 0.1


def test_conflicts_are_those_of_the_geometry():
    roadmap = Roadmap(wall_with_doors(0.0), RADIUS)
    close, swept = roadmap.conflicts(0.445)
    gaps = np.linalg.norm(roadmap.places[:, None] - roadmap.places, axis=2)
    assert sorted(map(tuple, close.T)) == list(map(tuple, np.argwhere(gaps < 0.445)))
    for edge in range(0, len(roadmap.edges), 7):
        expected = point_to_segment(roadmap.places, *roadmap.places[roadmap.edges[edge]]) < 0.445
        assert sorted(swept[1, swept[0] == edge]) == list(np.flatnonzero(expected))


def test_distances_to_segments_agree_with_one_at_a_time():
    rng = np.random.default_rng(1)
    a, b, points = rng.normal(size=(5, 2)), rng.normal(size=(5, 2)), rng.normal(size=(7, 2))
    assert np.allclose(distances(a, b, points), [point_to_segment(points, *ends) for ends in zip(a, b)])


def test_a_segment_has_room_where_all_its_places_have_it():
    roadmap = Roadmap(wall_with_doors(0.0), RADIUS)
    rng = np.random.default_rng(2)
    a = rng.uniform((-3.5, -2.5), (3.5, 2.5), (400, 2))
    b = a + rng.uniform(-0.7, 0.7, a.shape)
    along = a + np.linspace(0.0, 1.0, 200)[:, None, None] * (b - a)
    rooms = roadmap.environment.clearance(along)
    # As much as there is at the start is enough.
    lacking = np.minimum(RADIUS, rooms[0]) - rooms.min(axis=0)
    has_room = roadmap.has_room(a, b, RADIUS)
    assert has_room.sum() > 30 < (~has_room).sum()
    # A corner between two samples may be missed by less than this.
    assert (has_room == (lacking <= 1e-9))[np.abs(lacking) > 2e-3].all() and (lacking[has_room] < 2e-3).all()


def test_places_beside_a_body_keep_the_gap_to_it_and_what_is_far_from_walls_needs_none():
    roadmap = Roadmap(wall_with_doors(0.0), RADIUS)
    assert len(roadmap.beside([((2.0, 0.0), RADIUS)], 0.035).places) == len(roadmap.places)
    beside = roadmap.beside([((0.7, 0.2), RADIUS)], 0.035)
    new, count = beside.places[len(roadmap.places):], len(roadmap.edges)
    assert 0 < len(new) <= 20 and (np.linalg.norm(new - (0.7, 0.2), axis=1) >= 2 * RADIUS + 0.035).all()
    assert np.array_equal(beside.edges[:count], roadmap.edges) and (beside.rooms >= RADIUS + TIGHT).all()
    assert (beside.edges[count:].max(axis=1) >= len(roadmap.places)).all()
    assert roadmap.conflicts(0.4)[0].max() == len(roadmap.places) - 1


def test_a_world_without_extent_has_no_roadmap():
    with pytest.raises(InvalidInput, match='extent'):
        Roadmap(Environment(), RADIUS)
