"""Distances of plans, against other people's geometry and dense samples."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import MultiPoint, Point
from staged import STEP, drive, plan_through, rest, wall

from mobile_planning.fleet.collisions import positions
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.plan_distances import (
    contract_room, curves, distance_of_plans, distance_of_point, hull_distance, rest_knot)

# To the micrometre: shapely takes no length squared that underflows.
coordinates = st.floats(-5, 5).map(lambda value: round(value, 6))
four_points = st.lists(st.tuples(coordinates, coordinates), min_size=4, max_size=4).map(np.array)


@given(four_points)
def test_the_distance_of_a_hull_is_shapely_s(points):
    assert hull_distance(points) == pytest.approx(MultiPoint(points).convex_hull.distance(Point(0, 0)), abs=1e-9)


def test_a_hull_around_the_origin_has_no_distance():
    square = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)], float)
    for order in ([0, 1, 2, 3], [0, 2, 1, 3], [3, 0, 2, 1]):
        assert hull_distance(square[order]) == 0.0


def test_before_its_first_knot_a_plan_stands_and_after_its_end_too():
    plan = drive((0, 0), (4, 0), first_knot=3)
    assert not curves(plan, 0, 3).any()
    assert (curves(plan, plan.end_knot, 2) == (4, 0)).all()


def test_a_plan_rests_from_the_knot_on_from_which_no_point_differs():
    assert rest_knot(rest((1, 2), 5)) == -np.inf
    plan = drive((0, 0), (4, 0), first_knot=2)
    times = np.linspace(0, 9, 901)
    still = positions([plan], times) == plan.end
    first = times[np.flatnonzero(~still.all(axis=1))[-1] + 1]
    assert rest_knot(plan) * STEP == pytest.approx(first, abs=0.02)


@given(st.integers(0, 2**32 - 1))
def test_distances_are_never_above_what_dense_samples_find(seed):
    rng = np.random.default_rng(seed)
    a, b = (plan_through(*np.cumsum(rng.normal(0, 0.5, (6, 2)), axis=0), first_knot=int(rng.integers(-2, 1)))
            for _ in range(2))
    times = np.linspace(0, 6, 601)
    apart = np.hypot(*(positions([a], times) - positions([b], times)).T)
    assert distance_of_plans(a, b, 0) <= apart.min() + 1e-9
    assert distance_of_point(a, b.end, 0) <= np.hypot(*(positions([a], times) - b.end).T).min() + 1e-9


def test_the_room_to_a_contract_is_what_is_left_beside_it():
    plan, line = drive((0, 1), (4, 1)), wall(0.5)
    assert contract_room(line, plan, 0, True, 0.2) == pytest.approx(0.3)
    assert contract_room(line, plan, 0, False, 0.2) == pytest.approx(-0.7)


def test_the_rest_counts_against_a_line_that_still_moves_and_against_the_last_one_for_ever():
    rising = Contract(1, 0, np.tile([0.0, 1.0], (20, 1)), np.repeat(np.arange(20.0), 4).reshape(20, 4))
    assert contract_room(rising, rest((0, 10)), 0, True, 0.0) == pytest.approx(-9.0)
    assert contract_room(rising, rest((0, 10)), 99, True, 0.0) == pytest.approx(-9.0)
    jump = Contract(1, 0, np.array([[0.0, 1.0]]), np.array([[0.0, 0.0, 0.0, 2.0]]))
    assert contract_room(jump, rest((0, 1)), 5, True, 0.0) == pytest.approx(-1.0)


def test_spans_that_are_past_and_those_before_a_contract_do_not_count():
    falling = Contract(1, 0, np.tile([0.0, 1.0], (5, 1)), np.repeat([9.0, 9, 0, 0, 0], 4).reshape(5, 4))
    assert contract_room(falling, rest((0, 1)), 2, True, 0.0) == pytest.approx(1.0)
    assert contract_room(falling, rest((0, 1)), 1, True, 0.0) == pytest.approx(-8.0)
    dive = plan_through((0, 5), (0, 5), (0, 5), (0, 5), (0, -5), (0, 5))
    assert contract_room(wall(0), dive, 0, True, 0.0) < 0 < contract_room(wall(0, first_span=8), dive, 0, True, 0.0)
