"""Fences: whoever keeps to them keeps to the contracts, off the resting peers and off the static world."""
import numpy as np
import pytest
from curves import curve, walks
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import LineString, Point
from shapely.geometry import Polygon

from mobile_planning.fleet.bspline import Plan, bezier
from mobile_planning.fleet.contracts import build, room
from mobile_planning.fleet.fences import NONE, Fences, of_contracts, of_discs, of_pieces, of_walls
from mobile_planning.world.convex_pieces import ConvexPieces
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

RADIUS = 0.2
places = st.tuples(st.floats(-5, 5), st.floats(-5, 5))


def rested(points, count):
    """Return the Bezier points of ``count`` spans of a plan that rests at its end."""
    return bezier(np.vstack([points, np.repeat(points[-1:], max(0, count + 3 - len(points)), axis=0)]))[:count]


def places_of(points, count):
    """Return dense places (N, 2) of the first ``count`` spans, by scipy."""
    points = np.vstack([points, np.repeat(points[-1:], max(0, count + 3 - len(points)), axis=0)])
    return curve(points, 1.0)(np.linspace(0, count, 40 * count + 1))


def perturbed(points, seed, size):
    """Return another plan nearby."""
    new = points + np.random.default_rng(seed).normal(size=points.shape) * size
    new[-3:] = new[-1]
    return new


def test_without_anything_near_there_are_no_fences():
    curves = np.zeros((3, 4, 2))
    assert len(NONE) == len(of_contracts([], 0, 3, RADIUS)) == len(of_discs([], curves, RADIUS)) == 0
    pieces = ConvexPieces(Environment(obstacles=[RoundObstacle((50, 50), 1)]))
    assert len(of_pieces(pieces, curves, RADIUS, *around(curves, 1.0))) == len(of_walls(pieces, 3, RADIUS)) == 0


def test_fences_add_up():
    one, two = (Fences(np.array([k]), np.eye(2)[k:k + 1], np.full((1, 4), k)) for k in (0, 1))
    both = one + two
    assert len(both) == 2 and both.spans.tolist() == [0, 1] and (both.bounds[1] == 1).all()
    curves = np.full((2, 4, 2), 3.0)
    assert both.room(curves).tolist() == [[3.0] * 4, [2.0] * 4]


@settings(max_examples=100)
@given(walks(8), walks(8), places, st.integers(0, 2**31), st.sampled_from([0.0, 0.02, 0.5]), st.integers(0, 12))
def test_who_keeps_to_the_fences_of_a_contract_keeps_it(owner, peer, away, seed, size, later):
    plans = Plan(4, 0.25, owner), Plan(4, 0.25, peer + away)
    contract = build(1, *plans, 4, RADIUS, 0.3)
    assume(contract is not None)
    for plan, is_owner, radius in zip(plans, (True, False), (RADIUS, 0.3)):
        new = Plan(4, 0.25, perturbed(plan.points, seed, size))
        first = 4 + later
        count = max(contract.last_span, new.end_knot) - first + 2
        if count < 1:
            continue
        control = new.control(first, count + 3)
        least = of_contracts([(contract, is_owner)], first, count, radius).room(bezier(control)).min()
        assert least == pytest.approx(room(contract, new, first, is_owner, radius), abs=1e-9)
        if size == 0.0:
            assert least >= -1e-8, 'it was drawn between these two plans'


def test_the_fences_of_several_contracts_stand_side_by_side():
    stands = Plan.at_rest(0, 0.25, (0, 0, 0))
    bound = [(build(1, stands, Plan.at_rest(0, 0.25, (2, 0, 0)), 0, RADIUS, RADIUS), True),
             (build(1, Plan.at_rest(0, 0.25, (0, 2, 0)), stands, 0, RADIUS, RADIUS), False)]
    fences = of_contracts(bound, 0, 3, RADIUS)
    assert fences.spans.tolist() == [0, 1, 2] * 2
    assert fences.normals[0] == pytest.approx([-1, 0]) and fences.normals[3] == pytest.approx([0, -1])
    # 2 m apart: 0.8 m of room for each of the two.
    assert fences.room(np.zeros((3, 4, 2))) == pytest.approx(np.full((6, 4), 0.8))


@settings(max_examples=60)
@given(st.lists(st.tuples(walks(8), places, st.booleans()), min_size=1, max_size=4), st.integers(0, 9),
       st.integers(1, 12))
def test_the_fences_of_many_contracts_are_those_of_each_in_turn(peers, later, count):
    own, bound = Plan.at_rest(0, 0.25, (0, 0, 0)), []
    for points, away, is_owner in peers:
        plans = (own, Plan(0, 0.25, points + away))[::1 if is_owner else -1]
        contract = build(1, *plans, 0, RADIUS, RADIUS)
        bound += [] if contract is None else [(contract, is_owner)]
    fences = of_contracts(bound, later, count, RADIUS)
    assert len(fences) == len(bound) * count
    for row, (contract, is_owner) in enumerate(bound):
        part, sign = fences.on(slice(row * count, (row + 1) * count)), 1.0 if is_owner else -1.0
        normals, offsets = contract.lines(later, count)
        assert part.spans.tolist() == list(range(count))
        assert (part.normals == sign * normals).all() and (part.bounds == sign * offsets + RADIUS).all()


def test_a_contract_that_has_not_begun_has_no_fences():
    stands, far = (Plan.at_rest(5, 0.25, (x, 0, 0)) for x in (0, 2))
    with pytest.raises(ValueError, match='span 4 lies before'):
        of_contracts([(build(1, stands, far, 5, RADIUS, RADIUS), True)], 4, 3, RADIUS)


@given(walks(8), st.integers(0, 2**31))
def test_fences_within_reach_are_those_that_a_bezier_point_comes_near(points, seed):
    rng = np.random.default_rng(seed)
    angles, spans = rng.uniform(-3, 3, 20), rng.integers(0, 20, 20)
    fences = Fences(spans, np.column_stack([np.cos(angles), np.sin(angles)]), rng.uniform(-9, 1, (20, 4)))
    reach = rng.uniform(0, 6, len(points) - 3)
    near = fences.room(rested(points, 20)).min(axis=1) < reach[np.minimum(spans, len(reach) - 1)]
    assert (fences.within(points, reach).bounds == fences.bounds[near]).all()


@settings(max_examples=100)
@given(walks(8), st.lists(st.tuples(places, st.floats(0.05, 1.0)), min_size=1, max_size=3), st.integers(0, 2**31),
       st.sampled_from([0.02, 0.5]))
def test_who_keeps_to_the_fences_of_resting_discs_stays_off_them(points, discs, seed, size):
    discs = [(np.array(place), radius) for place, radius in discs]
    count = len(points)
    curves, way = rested(points, count), LineString(places_of(points, count))
    fences = of_discs(discs, curves, RADIUS)
    if fences.room(curves).min() < 0:
        # Its hulls come too near; so far it may be that the curve itself does not.
        assert min(way.distance(Point(place)) - radius for place, radius in discs) < RADIUS + 0.5
    new = perturbed(points, seed, size)
    if fences.room(rested(new, count)).min() >= 0:
        for place, radius in discs:
            assert np.linalg.norm(places_of(new, count) - place, axis=1).min() >= RADIUS + radius - 1e-9


@st.composite
def worlds(draw):
    """Draw a room with obstacles, and the same as shapely sees it: all that is not free."""
    obstacles, shapes = [], []
    for place, size in draw(st.lists(st.tuples(places, st.floats(0.1, 1.5)), max_size=4)):
        if draw(st.booleans()):
            obstacles.append(RoundObstacle(place, size))
            shapes.append(Point(place).buffer(size, 64))
        else:
            # A notch makes it concave.
            corners = np.array([(0, 0), (2, 0), (2, 2), (1, 0.5), (0, 2)]) * size + place
            obstacles.append(PolygonObstacle(corners))
            shapes.append(Polygon(corners))
    return Environment(Boundary((-6, 6), (-6, 6)), obstacles), shapes


def around(curves, reach):
    """Return the corners of the boxes within which a point is no further than ``reach`` from a curve along each axis.
    """
    return curves.min(axis=1) - reach, curves.max(axis=1) + reach


@settings(max_examples=60)
@given(worlds(), walks(8), st.integers(0, 2**31), st.sampled_from([0.02, 0.3]))
def test_who_keeps_to_the_fences_of_the_world_does_not_touch_it(world, points, seed, size):
    environment, shapes = world
    pieces, curves = ConvexPieces(environment), bezier(points)
    new = perturbed(points, seed, size)
    ahead = bezier(new)
    swept = np.concatenate([curves, ahead], axis=1)
    fences = of_walls(pieces, len(curves), RADIUS) + of_pieces(pieces, curves, RADIUS, *around(swept, 0.0))
    if fences.room(ahead).min(initial=0.0) >= 0:
        way = places_of(new, len(curves))
        assert all(LineString(way).distance(shape) >= RADIUS - 2e-3 for shape in shapes), 'a chord for 1/40 span'
        assert np.abs(way).max() <= 6 - RADIUS + 1e-9


def test_the_nearest_pieces_are_taken_where_there_are_too_many():
    pieces = ConvexPieces(Environment(obstacles=[RoundObstacle((x, 1), 0.1) for x in (0.0, 0.5, 1.0, 1.5)]))
    curves = np.zeros((2, 4, 2))
    curves[1] += (1.5, 0.0)
    fences = of_pieces(pieces, curves, RADIUS, *around(curves, 5.0), cap=1)
    assert fences.spans.tolist() == [0, 1]
    assert fences.normals == pytest.approx(np.tile([0.0, -1.0], (2, 1)))
    assert fences.room(curves) == pytest.approx(np.full((2, 4), 0.7))


def test_the_cells_of_a_map_and_its_edge_are_fences_too():
    data = np.zeros((20, 20), int)
    data[10, 10] = 100
    pieces = ConvexPieces(Environment(grid=OccupancyGrid(data, 0.1)))
    curves = np.tile((0.5, 1.05), (1, 4, 1))
    fences = of_pieces(pieces, curves, RADIUS, *around(curves, 1.0)) + of_walls(pieces, 1, RADIUS)
    assert fences.room(curves).min() == pytest.approx(0.3), 'both the cell and the edge are 0.5 m away'
    assert len(fences) == 5
