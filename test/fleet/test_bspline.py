"""Plans against scipy's B-splines, and the proofs of their limits against dense samples."""
import numpy as np
import pytest
from curves import curve, dense, turned_at_most, walks
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from scipy.interpolate import BPoly

from mobile_planning import InvalidInput
from mobile_planning.fleet.bspline import (
    MAX_POINTS, Plan, acceleration_bound, bezier, keeps_turn_rate, speed_bound, splice, split)
from mobile_planning.fleet.bspline_kernels import goes_on
from mobile_planning.geometry import wrap_angle

COORDINATES = st.floats(-100, 100)
POINTS = npst.arrays(float, st.tuples(st.integers(4, 12), st.just(2)), elements=COORDINATES)
STEPS = st.sampled_from([0.05, 0.1, 0.25, 1.0])


def ending_at_rest(points):
    return np.vstack([points, np.repeat(points[-1:], 2, axis=0)])


# Curves


@given(POINTS)
def test_bezier_points_draw_the_spline(points):
    knots = np.arange(len(points) - 2)
    t = np.linspace(0, knots[-1], 201)
    drawn = BPoly(np.moveaxis(bezier(points), 1, 0), knots)(t)
    assert drawn == pytest.approx(curve(points, 1.0)(t), abs=1e-9)


@given(POINTS, st.integers(1, 9))
def test_a_split_spline_is_the_same_curve(points, pieces):
    parts = split(bezier(points), pieces)
    t = np.linspace(0, len(points) - 3, 201)
    drawn = BPoly(np.moveaxis(parts, 1, 0), np.arange(len(parts) + 1) / pieces)(t)
    assert drawn == pytest.approx(curve(points, 1.0)(t), abs=1e-9)


def test_leading_axes_are_plans_of_their_own():
    points = np.random.default_rng(1).normal(size=(3, 2, 9, 2))
    assert (bezier(points)[1, 0] == bezier(points[1, 0])).all()
    assert split(bezier(points), 4)[2, 1] == pytest.approx(split(bezier(points[2, 1]), 4))
    assert speed_bound(points, 0.5).shape == acceleration_bound(points, 0.5).shape == (3, 2)


# Bounds


@given(POINTS, STEPS)
def test_speed_and_acceleration_never_exceed_their_bounds(points, step):
    spline, t = curve(points, step), dense(points, step, 50)
    for bound, order in ((speed_bound, 1), (acceleration_bound, 2)):
        values = np.linalg.norm(spline.derivative(order)(t), axis=1)
        assert values.max() <= bound(points, step) * (1 + 1e-9) + 1e-9


@given(POINTS, STEPS)
def test_the_acceleration_bound_is_reached_at_a_knot(points, step):
    at_knots = curve(points, step).derivative(2)(np.arange(len(points) - 2) * step)
    assert acceleration_bound(points, step) == pytest.approx(np.linalg.norm(at_knots, axis=1).max(), rel=1e-6, abs=1e-6)


@given(st.floats(0.01, 2), st.floats(-3.14, 3.14), STEPS)
def test_the_speed_bound_is_exact_on_an_even_straight_line(speed, heading, step):
    points = np.arange(8)[:, None] * speed * step * np.array([np.cos(heading), np.sin(heading)])
    assert speed_bound(points, step) == pytest.approx(speed)


# The turn rate


@settings(max_examples=300)
@given(walks(9, steepest=1.5), st.sampled_from([0.5, 2.0, 5.0]), STEPS)
def test_what_keeps_the_turn_rate_keeps_it_at_every_instant(points, omega_max, step):
    assume(keeps_turn_rate(points, step, omega_max))
    assert turned_at_most(points, step, omega_max)


@settings(max_examples=200)
@given(walks(6, steepest=3.14), STEPS)
def test_what_turns_too_fast_or_turns_back_is_never_passed(points, step):
    if not turned_at_most(points, step, 2.0):
        assert not keeps_turn_rate(points, step, 2.0)


@given(st.lists(st.floats(0.02, 0.4), min_size=1, max_size=10), st.floats(-3.14, 3.14), COORDINATES, COORDINATES,
       st.floats(0.1, 5))
def test_straight_from_rest_to_rest_keeps_any_turn_rate(lengths, heading, x, y, omega_max):
    along = np.cumsum([0, 0, 0, *lengths, 0, 0])
    points = np.array([x, y]) + along[:, None] * np.array([np.cos(heading), np.sin(heading)])
    assert keeps_turn_rate(points, 0.25, omega_max)


@given(st.floats(0.3, 4.0))
def test_a_steady_circle_passes_a_little_above_its_turn_rate_and_fails_below(omega):
    angle = np.arange(12) * omega * 0.1
    circle = np.column_stack([np.sin(angle), -np.cos(angle)])
    assert keeps_turn_rate(circle, 0.1, 1.1 * omega) and not keeps_turn_rate(circle, 0.1, 0.95 * omega)


@pytest.mark.parametrize('steps', [
    [1, 1, -1, -1], [1, 0, -1], [1, 0, 0, -1], [1, 0, 0, 0, -1], [0, 0, 1, 0, -1, 0, 0]])
def test_turning_back_on_the_spot_is_no_motion_of_a_unicycle(steps):
    points = np.cumsum([[0, 0], *([0.1 * step, 0] for step in steps)], axis=0)
    assert not keeps_turn_rate(points, 0.25, 5.0)


def test_a_halt_on_the_way_does_not_hide_a_corner():
    points = np.cumsum([[0, 0], [0.1, 0], [0.1, 0], [0, 0], [0, 0], [0, 0.1], [0, 0.1]], axis=0)
    assert not keeps_turn_rate(points, 0.25, 5.0)


def test_a_place_far_from_the_origin_changes_no_verdict():
    points = np.cumsum([[0, 0], [0, 0], [0, 0], [0.1, 0], [0.2, 0.01], [0.2, 0.03], [0.1, 0.02], [0, 0], [0, 0]], 0)
    assert keeps_turn_rate(points, 0.25, 5.0)
    assert keeps_turn_rate(points + (4e5, -9e5), 0.25, 5.0)


def is_one_move(points, rest):
    """Return whether what moves at all moves once, and no step of it points back: `goes_on` in other words."""
    steps = np.diff(points, axis=0)
    moves = [index for index, step in enumerate(steps) if np.linalg.norm(step) > rest]
    return all(after - before <= 2 and steps[before] @ steps[after] > 0 for before, after in zip(moves, moves[1:]))


@settings(max_examples=300)
@given(st.lists(st.sampled_from([(0, 0), (0, 0), (1, 0), (1, 1), (0.5, -0.1), (-1, 0), (0, 1), (1e-9, 0)]), min_size=3,
                max_size=9))
def test_the_kernel_that_looks_for_halts_and_turns_back_does_as_it_says(steps):
    points = np.cumsum([(0, 0), *steps], axis=0).astype(float)
    assert goes_on(points, 1e-6) == is_one_move(points, 1e-6)


@pytest.mark.parametrize('garbage', [np.nan, np.inf])
def test_what_is_not_finite_is_never_passed(garbage):
    for index in range(6):
        points = np.cumsum([0, 0, 0.1, 0.1, 0.1, 0.1])[:, None] * np.array([1.0, 0.5])
        assert keeps_turn_rate(points, 0.25, 5.0)
        points[index, 1] = garbage
        assert not keeps_turn_rate(points, 0.25, 5.0)


# Plans


GOOD = dict(first_knot=3, step=0.25, points=np.zeros((4, 2)), heading=0.0)


@pytest.mark.parametrize('changed, word', [
    ({'points': np.zeros((3, 2))}, 'points'), ({'points': np.zeros((MAX_POINTS + 1, 2))}, 'points'),
    ({'points': np.zeros((4, 3))}, 'points'), ({'points': np.zeros(8)}, 'points'),
    ({'points': np.full((4, 2), np.nan)}, 'finite'), ({'points': np.full((4, 2), np.inf)}, 'finite'),
    ({'points': np.full((4, 2), 2e6)}, '1e6'), ({'points': 'here'}, 'points'), ({'points': None}, 'points'),
    ({'points': [[0, 0], [1, 1], [2, 2], [3, 3]]}, 'rest'), ({'points': [[0, 0], [1, 1], [2, 2], [2, 2]]}, 'rest'),
    ({'step': 0.0}, 'step'), ({'step': -1.0}, 'step'), ({'step': np.nan}, 'step'), ({'step': 11.0}, 'step'),
    ({'heading': np.nan}, 'heading'), ({'heading': np.inf}, 'heading'), ({'final_heading': np.inf}, 'heading'),
    ({'first_knot': np.nan}, 'knot'), ({'first_knot': np.inf}, 'knot'), ({'first_knot': 2.5}, 'knot'),
    ({'first_knot': 2**62}, 'knot'), ({'first_knot': -2**70}, 'knot')])
def test_a_plan_that_makes_no_sense_is_refused(changed, word):
    with pytest.raises(InvalidInput, match=word):
        Plan(**{**GOOD, **changed})


def test_a_plan_cannot_be_changed_through_an_array():
    points = np.zeros((5, 2))
    plan = Plan(0, 0.25, points)
    points[0] = 1
    assert not plan.points.any()
    with pytest.raises(ValueError):
        plan.points[0] = 1


@given(walks(8), STEPS, st.sampled_from([0, -7, 12345]))
def test_states_are_the_spline_and_its_derivative(points, step, first_knot):
    plan = Plan(first_knot, step, points)
    t = first_knot * step + dense(points, step, 30)
    spline, states = curve(points, step, first_knot), plan.states(t)
    assert states[:, :2] == pytest.approx(spline(t), abs=1e-9)
    velocity = spline.derivative(1)(t)
    assert states[:, 3] == pytest.approx(np.linalg.norm(velocity, axis=1), abs=1e-8)
    moving = states[:, 3] > 1e-5
    assert states[moving, 3] * np.cos(states[moving, 2]) == pytest.approx(velocity[moving, 0], abs=1e-8)
    assert states[moving, 3] * np.sin(states[moving, 2]) == pytest.approx(velocity[moving, 1], abs=1e-8)


@given(walks(8), st.floats(-3, 3), st.one_of(st.just(np.nan), st.floats(-3, 3)))
def test_a_plan_ends_at_rest_for_ever_and_stands_before_it_begins(points, heading, final):
    plan = Plan(10, 0.25, points, heading, final)
    late = plan.states(plan.end_knot * 0.25 + np.array([0, 1e-9, 0.1, 10, 1e6]))
    assert (late[:, :2] == plan.end).all() or late[:, :2] == pytest.approx(np.tile(plan.end, (5, 1)), abs=1e-12)
    assert late[:, 3] == pytest.approx(0, abs=1e-12) and (late[:, 4] == 0).all()
    assert np.ptp(late[:, 2]) == 0
    early = plan.states(np.array([-100.0, 2.5]))
    assert (early[0] == early[1]).all()


@given(walks(8), st.integers(0, 30), st.integers(1, 20))
def test_control_points_go_on_with_the_last_one(points, later, count):
    plan = Plan(-4, 0.25, points)
    expected = np.vstack([points, np.tile(points[-1], (60, 1))])[later:later + count]
    assert (plan.control(-4 + later, count) == expected).all()


def test_control_points_before_the_plan_are_refused():
    with pytest.raises(ValueError, match='knot 4'):
        Plan(5, 0.25, np.zeros((4, 2))).control(4, 3)


# Turning in place


def headings_around(plan, knot, h=1e-7):
    t = knot * plan.step
    return plan.state(t - h)[2], plan.state(t)[2], plan.state(t + h)[2]


def straight(direction, rest_before=3, rest_after=3, lengths=(0.1, 0.2, 0.1)):
    """Return control points of a straight drive with spans at rest before and after it."""
    along = np.cumsum([0] * (3 + rest_before) + list(lengths) + [0] * (2 + rest_after))
    return along[:, None] * np.array([np.cos(direction), np.sin(direction)])


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_a_robot_at_rest_turns_evenly_to_where_it_departs_and_to_its_final_heading(heading, direction, final):
    plan = Plan(8, 0.25, straight(direction), heading, final)
    start, departure, arrival, end = (8 * 0.25, 11 * 0.25, (plan.end_knot - 3) * 0.25, plan.end_knot * 0.25)
    assert plan.state(start)[2] == pytest.approx(heading)
    for time, angle in ((departure, direction), (arrival, direction), (end, final)):
        assert wrap_angle(plan.state(time)[2] - angle) == pytest.approx(0, abs=1e-6)
    for low, high, turn in ((start, departure, wrap_angle(direction - heading)),
                            (arrival, end, wrap_angle(final - direction))):
        t = np.linspace(low, high, 50, endpoint=False)
        states = plan.states(t)
        assert states[:, 4] == pytest.approx(turn / (high - low), abs=1e-6)
        assert wrap_angle(np.diff(states[:, 2])) == pytest.approx(turn / (high - low) * (t[1] - t[0]), abs=1e-6)
    assert plan.turn_in_place() == pytest.approx(
        max(abs(wrap_angle(direction - heading)), abs(wrap_angle(final - direction))) / 0.75)


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_the_heading_is_continuous_at_departure_and_arrival(heading, final):
    plan = Plan(0, 0.25, straight(0.7), heading, final)
    for knot in (1, 2, 3, 6, plan.end_knot - 3, plan.end_knot):
        before, at, after = headings_around(plan, knot)
        assert wrap_angle(before - at) == pytest.approx(0, abs=1e-5)
        assert wrap_angle(after - at) == pytest.approx(0, abs=1e-5)


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.floats(-0.5, 3.0), st.booleans())
def test_the_state_at_one_time_is_that_among_many(heading, direction, time, reverse):
    points = np.vstack([straight(direction), straight(direction)[-1] + straight(2.0)])
    plan = Plan(0, 0.25, points, heading, 0.3, reverse)
    knots = 0.25 * np.arange(plan.first_knot - 1, plan.end_knot + 2)
    for each in (time, *knots.tolist()):
        assert np.array_equal(plan.state(each), plan.states(np.array([time, each, 0.1]))[1])


def test_a_halt_on_the_way_turns_in_place_too():
    first, second = straight(0.0, 0, 2), straight(2.0, 0, 0)
    plan = Plan(0, 0.25, np.vstack([first, first[-1] + second[3:]]))
    t = np.linspace(0, plan.end_knot * 0.25, 2001)
    assert np.abs(wrap_angle(np.diff(plan.states(t)[:, 2]))).max() < 0.02
    assert plan.turn_in_place() == pytest.approx(2.0 / 0.5)


def test_a_robot_that_does_not_drive_turns_all_the_time_it_has():
    plan = Plan(4, 0.25, np.zeros((7, 2)), 1.0, -1.0)
    assert plan.states(np.array([1.0, 1.5, 2.0, 9.0]))[:, 2] == pytest.approx([1.0, 0.0, -1.0, -1.0])
    assert plan.turn_in_place() == pytest.approx(2.0)


def test_a_plan_at_rest_stands_at_its_pose():
    plan = Plan.at_rest(7, 0.25, (1.0, 2.0, 3.0))
    assert plan.states(np.array([0, 1.75, 1.9, 99])) == pytest.approx(np.tile([1, 2, 3, 0, 0], (4, 1)), abs=1e-12)
    assert plan.turn_in_place() == 0


# Backwards


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_a_robot_that_may_reverse_sets_out_as_takes_the_smaller_turn(heading, direction, final):
    assume(abs(abs(wrap_angle(direction - heading)) - np.pi / 2) > 1e-6)
    plan = Plan(8, 0.25, straight(direction), heading, final, True)
    is_behind = abs(wrap_angle(direction - heading)) > np.pi / 2
    ways = np.linspace(11, plan.end_knot - 3, 22)[1:-1] * 0.25
    states = plan.states(ways)
    forward = Plan(8, 0.25, straight(direction), heading, final).states(ways)
    assert states[:, :2] == pytest.approx(forward[:, :2])
    assert states[:, 3] == pytest.approx(-forward[:, 3] if is_behind else forward[:, 3], abs=1e-9)
    facing = direction + np.pi * is_behind
    assert wrap_angle(states[:, 2] - facing) == pytest.approx(0, abs=1e-6)
    turns = abs(wrap_angle(facing - heading)), abs(wrap_angle(final - facing))
    assert turns[0] <= np.pi / 2 + 1e-9 and plan.turn_in_place() == pytest.approx(max(turns) / 0.75)
    assert wrap_angle(plan.state(plan.end_knot * 0.25)[2] - final) == pytest.approx(0, abs=1e-6)


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_the_heading_is_continuous_backwards_too(heading, final):
    plan = Plan(0, 0.25, straight(0.7), heading, final, True)
    for knot in (1, 2, 3, 6, plan.end_knot - 3, plan.end_knot):
        before, at, after = headings_around(plan, knot)
        assert wrap_angle(np.array([before, after]) - at) == pytest.approx(0, abs=1e-5)


@given(walks(8), st.floats(-3.1, 3.1))
def test_the_velocity_backwards_is_that_of_the_spline(points, heading):
    plan, t = Plan(0, 0.25, points, heading, reverse=True), dense(points, 0.25, 30)
    states, velocity = plan.states(t), curve(points, 0.25).derivative(1)(t)
    along = states[:, 3, None] * np.column_stack([np.cos(states[:, 2]), np.sin(states[:, 2])])
    moving = np.abs(states[:, 3]) > 1e-5
    assert along[moving] == pytest.approx(velocity[moving], abs=1e-8)


@given(st.floats(-3, 3), st.floats(-3, 3), st.integers(0, 12))
def test_a_splice_of_a_plan_that_reverses_is_the_same_motion(heading, final, first_knot):
    plan = Plan(0, 0.25, straight(1.0, 2, 4), heading, final, True)
    for turn in (wrap_angle(1.0 - heading), wrap_angle(final - 1.0)):
        assume(abs(abs(turn) - np.pi / 2) > 1e-6 and abs(abs(turn) - np.pi) > 1e-6 and abs(turn) > 1e-6)
    t = np.linspace(first_knot * 0.25, 8, 101)
    spliced, whole = splice([plan], first_knot).states(t), plan.states(t)
    assert wrap_angle(spliced[:, 2] - whole[:, 2]) == pytest.approx(0, abs=1e-6)
    assert spliced[:, [0, 1, 3]] == pytest.approx(whole[:, [0, 1, 3]], abs=1e-6)


# Splicing


def chain(seed):
    """Return plans that go on from one another, at knots that may coincide or lie beyond the end."""
    rng = np.random.default_rng(seed)
    plans, knot = [Plan.at_rest(0, 0.25, (0.0, 0.0, 0.5))], 0
    for _ in range(4):
        knot += int(rng.integers(0, 6))
        start, heading = plans[-1].control(knot, 3), plans[-1].state(knot * 0.25)[2]
        moves = rng.normal(size=(int(rng.integers(1, 6)), 2)) * 0.1
        points = np.vstack([start, start[-1] + np.cumsum(moves, axis=0)])
        plans.append(Plan(knot, 0.25, ending_at_rest(points), heading))
    return plans


def driven(plans, t):
    """Return x, y of the plan in force at each time."""
    at = np.searchsorted([plan.first_knot * 0.25 for plan in plans], t, side='right') - 1
    return np.vstack([curve(plans[i].points, 0.25, plans[i].first_knot)(min(time, plans[i].end_knot * 0.25))
                      for i, time in zip(at, t)])


@settings(max_examples=60)
@given(st.integers(0, 10**6), st.integers(0, 25))
def test_a_splice_is_the_same_motion_as_its_parts(seed, first_knot):
    plans = chain(seed)
    plan = splice(plans, first_knot)
    t = first_knot * 0.25 + np.linspace(0, 10, 401)
    assert plan.first_knot == first_knot
    assert plan.states(t)[:, :2] == pytest.approx(driven(plans, t), abs=1e-9)


@given(st.floats(-3, 3), st.floats(-3, 3), st.integers(0, 12))
def test_a_splice_goes_on_turning_in_place_as_its_part_did(heading, final, first_knot):
    plan = Plan(0, 0.25, straight(1.0, 2, 4), heading, final)
    t = np.linspace(first_knot * 0.25, 8, 101)
    assume(abs(abs(wrap_angle(final - 1.0)) - np.pi) > 1e-6 and abs(abs(wrap_angle(1.0 - heading)) - np.pi) > 1e-6)
    assert wrap_angle(splice([plan], first_knot).states(t)[:, 2] - plan.states(t)[:, 2]) == pytest.approx(0, abs=1e-6)


def test_a_splice_before_the_first_plan_is_refused():
    with pytest.raises(ValueError, match='knot 2'):
        splice([Plan(3, 0.25, np.zeros((4, 2)))], 2)


@example(7.2e9)
@given(st.sampled_from([1e9, 3.3e9, 7.2e9]))
def test_a_plan_at_a_time_since_1970_is_the_same_motion(offset):
    points = straight(0.4)
    t = dense(points, 0.25, 16)
    early, late = Plan(0, 0.25, points, 1.0, 2.0), Plan(int(offset), 0.25, points, 1.0, 2.0)
    assert late.states(t + offset * 0.25) == pytest.approx(early.states(t), abs=1e-6)
