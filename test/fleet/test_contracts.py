"""Moving-line contracts, judged by dense samples and by shapely."""
import numpy as np
import pytest
import shapely
from curves import curve, walks
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mobile_planning import InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import MAX_SPANS, ROUNDING, Contract, build, room

STEP = 0.25
plans = st.builds(lambda points, knot, x, y: Plan(knot, STEP, points + (x, y)), walks(8), st.integers(-3, 4),
                  st.floats(-2, 2), st.floats(-2, 2))
radii = st.floats(0.05, 0.6)


def places(plan, times):
    """Return where scipy says that a plan is at ``times`` [s], from its first knot on for ever."""
    end = plan.end_knot * STEP
    return curve(plan.points, STEP, plan.first_knot)(np.clip(times, plan.first_knot * STEP, end - 1e-12))


def instants(first_span, *ends):
    """Return a hundred times [s] of each span from ``first_span`` to one span after all have ended."""
    last = max(*ends, first_span) + 1
    return np.linspace(first_span, last, 100 * (last - first_span) + 1) * STEP


def hulls_apart(one, other, first_span, last_span):
    """Return the least distance [m] over all spans of the relative Bezier hull from the origin, by shapely."""
    least = np.inf
    for span in range(first_span, last_span + 1):
        # Shapely knows no distance of a segment that is shorter than any number's square.
        relative = np.round(bezier_points(one, span) - bezier_points(other, span), 12)
        least = min(least, shapely.MultiPoint(relative).convex_hull.distance(shapely.Point(0, 0)))
    return least


def bezier_points(plan, span):
    """Return the Bezier points (4, 2) of one span, by scipy's values and slopes at its two ends."""
    if span >= plan.end_knot:
        return np.tile(plan.points[-1], (4, 1))
    spline = curve(plan.points, STEP, plan.first_knot)
    ends = np.array([span * STEP, (span + 1) * STEP - 1e-12])
    (a, b), (da, db) = spline(ends), spline(ends, nu=1)
    return np.array([a, a + da * STEP / 3, b - db * STEP / 3, b])


def a_contract(spans=3):
    return Contract(1, 4, np.tile([0.6, 0.8], (spans, 1)), np.arange(4.0 * spans).reshape(spans, 4))


@given(plans, plans, radii, radii, st.integers(0, 6))
def test_a_contract_exists_just_where_the_hulls_of_the_relative_motion_leave_the_room(one, other, r_one, r_other, wait):
    first = max(one.first_knot, other.first_knot) + wait
    last = max(one.end_knot, other.end_knot, first + 1) - 1
    apart = hulls_apart(one, other, first, last)
    assume(abs(apart - r_one - r_other) > 1e-6)
    contract = build(3, one, other, first, r_one, r_other)
    assert (contract is not None) == (apart > r_one + r_other)
    if contract is not None:
        assert (contract.id, contract.first_span, contract.last_span) == (3, first, last)
        rooms = [room(contract, one, first, True, r_one), room(contract, other, first, False, r_other)]
        # What is left over is shared: where it is least, both have half of it.
        np.testing.assert_allclose(rooms, (apart - r_one - r_other) / 2, atol=1e-6)


@settings(deadline=None)
@given(plans, plans, plans, radii, st.integers(0, 12))
def test_two_plans_that_satisfy_one_contract_never_come_too_close(one, other, third, radius, late):
    first = max(one.first_knot, other.first_knot)
    contract = build(1, one, other, first, radius, radius)
    assume(contract is not None)
    start = max(first, third.first_knot) + late
    r_third = radius + room(contract, third, start, True, radius)
    assume(r_third > 0)
    times = instants(start, third.end_knot, other.end_knot, contract.last_span)
    distance = np.linalg.norm(places(third, times) - places(other, times), axis=1).min()
    assert distance >= r_third + radius - 1e-9


@given(plans, plans, radii, st.booleans(), st.integers(0, 20))
def test_the_room_is_the_least_over_all_bezier_points_and_stays_so_for_ever(one, other, radius, is_owner, late):
    first = max(one.first_knot, other.first_knot)
    contract = build(1, one, other, first, radius, radius)
    assume(contract is not None)
    plan, start = (one if is_owner else other), first + late
    count = max(plan.end_knot, contract.last_span + 1, start) - start + 5
    normals, offsets = contract.lines(start, count)
    sign = 1 if is_owner else -1
    beyond = [sign * (bezier_points(plan, start + k) @ normals[k] - offsets[k]) for k in range(count)]
    assert room(contract, plan, start, is_owner, radius) == pytest.approx(np.min(beyond) - radius, abs=1e-9)
    assert room(contract, plan, start + 50, is_owner, radius) >= room(contract, plan, start, is_owner, radius)


@given(plans, plans, radii)
def test_robots_that_touch_may_agree_anew_for_ever(one, other, radius):
    first = max(one.first_knot, other.first_knot)
    last = max(one.end_knot, other.end_knot, first + 1) - 1
    apart = hulls_apart(one, other, first, last)
    assume(apart > 0.1)
    for _ in range(3):
        contract = build(1, one, other, first, apart / 2 - ROUNDING / 2, apart / 2 - ROUNDING / 2)
        assert contract is not None
        assert room(contract, one, first, True, apart / 2 - ROUNDING / 2) >= -ROUNDING


def test_after_its_last_span_a_line_stands_still_where_it_is():
    contract = a_contract()
    normals, offsets = contract.lines(5, 4)
    assert normals.tolist() == [[0.6, 0.8]] * 4
    assert offsets.tolist() == [[4, 5, 6, 7], [8, 9, 10, 11], [11] * 4, [11] * 4]
    assert contract.lines(10**9, 1)[1].tolist() == [[11] * 4]
    with pytest.raises(ValueError, match='span 3'):
        contract.lines(3, 1)


def test_a_contract_that_begins_later_says_nothing_before():
    plan = Plan(0, STEP, np.array([[-9.0, 0], [-9, 0], [0, 0], [9, 9], [9, 9], [9, 9], [9, 9]]))
    line = Contract(1, 4, [[1.0, 0.0]], [[0.0] * 4])
    assert room(line, plan, 0, True, 0.5) == 8.5
    assert room(Contract(1, 0, [[1.0, 0.0]], [[0.0] * 4]), plan, 0, True, 0.5) < 0


def test_the_rest_after_the_own_plan_is_judged_against_a_line_that_moves_on():
    rests = Plan(0, STEP, np.zeros((4, 2)))
    moving = Contract(1, 0, np.tile([1.0, 0.0], (6, 1)), np.linspace(-2, 1, 24).reshape(6, 4))
    assert room(moving, rests, 0, True, 0.2) == pytest.approx(-1.2)


def test_no_contract_is_built_between_plans_that_overlap_or_do_not_fit():
    one, two = Plan.at_rest(0, STEP, (0, 0, 0)), Plan.at_rest(0, STEP, (0.3, 0, 0))
    assert build(1, one, two, 0, 0.2, 0.2) is None
    assert build(1, one, one, 0, 0.2, 0.2) is None
    assert build(1, one, Plan.at_rest(0, 0.5, (9, 0, 0)), 0, 0.2, 0.2) is None
    assert build(1, one, Plan.at_rest(10**15, STEP, (9, 0, 0)), 10**15, 0.2, 0.2) is not None
    far = Plan(MAX_SPANS, STEP, np.tile([9.0, 0], (8, 1)))
    assert build(1, one, Plan(-10**17, STEP, far.points), 0, 0.2, 0.2) is not None
    with pytest.raises(ValueError, match='lies before the first of the plan'):
        build(1, one, far, 3, 0.2, 0.2)


@pytest.mark.parametrize('changed', [
    {'id': 0}, {'id': 1.5}, {'id': 2**70}, {'first_span': None}, {'first_span': -2**70}, {'normals': []},
    {'normals': [[1.0, 0.0], [0.0, 1.0]]}, {'normals': [[1.0, 1e-4]]}, {'normals': [[np.nan, 1.0]]},
    {'normals': [1.0, 0.0]}, {'normals': 'line'}, {'offsets': [[0.0, 0.0, 0.0]]},
    {'offsets': [[0.0, 0.0, np.inf, 0.0]]},
    {'offsets': [[np.nan] * 4]}, {'offsets': [[1e9] * 4]},
    {'normals': np.tile([1.0, 0.0], (MAX_SPANS + 1, 1)), 'offsets': np.zeros((MAX_SPANS + 1, 4))}])
def test_a_contract_that_makes_no_sense_is_refused(changed):
    with pytest.raises(InvalidInput):
        Contract(**{'id': 1, 'first_span': 0, 'normals': [[1.0, 0.0]], 'offsets': [[0.0] * 4], **changed})


def test_nobody_can_change_a_contract_afterwards():
    normals = np.array([[1.0, 0.0]])
    contract = Contract(1, 0, normals, [[0.0] * 4])
    normals[0] = 0, 1
    assert contract.normals.tolist() == [[1, 0]]
    with pytest.raises(ValueError):
        contract.offsets[0] = 1.0
