"""One section: what the quadratic program is asked for, and that only what is proved is let through."""
import numpy as np
import pytest
from curves import curve, dense, turned_at_most, walks
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mobile_planning.fleet.bspline import acceleration_bound, bezier, keeps_turn_rate, speed_bound
from mobile_planning.fleet.fences import NONE, Fences
from mobile_planning.fleet.section import Departure, Limits, SectionProblem, shorten

LIMITS, STEP, SPANS = Limits(1.0, 2.0, 5.0, 0.2), 0.125, 24
PROBLEM = SectionProblem(LIMITS, STEP, SPANS)
REST = np.zeros((SPANS + 3, 2))
ANGLES = st.floats(-3.1, 3.1)


def unit(angle):
    return np.array([np.cos(angle), np.sin(angle)])


def going_to(goal):
    """Return the reference that is at ``goal`` all the time."""
    return np.tile(np.asarray(goal, float), (SPANS, 1))


def wall(normal, bound, spans=range(SPANS)):
    """Return the fence ``normal . b >= bound`` on some spans."""
    count = len(spans)
    return Fences(np.array(spans, np.intp), np.tile(np.asarray(normal, float), (count, 1)), np.full((count, 4), bound))


def keeps_limits(points, limits, step):
    """Return whether the curve, as scipy draws it, keeps the limits at dense samples."""
    spline, t = curve(points, step), dense(points, step, 40)
    most = [np.linalg.norm(spline.derivative(order)(t), axis=1).max() for order in (1, 2)]
    return (most[0] <= limits.v_max * (1 + 1e-6) and most[1] <= limits.a_max * (1 + 1e-6)
            and turned_at_most(points, step, limits.omega_max))


def keeps_fences(points, fences):
    """Return whether the curve, as scipy draws it, keeps to each fence at dense samples of the fence's span."""
    if not len(fences):
        return True
    points = np.vstack([points, np.repeat(points[-1:], max(0, fences.spans.max() + 4 - len(points)), axis=0)])
    u = np.linspace(0, 1, 33)
    weights = np.column_stack([(1 - u)**3, 3 * u * (1 - u)**2, 3 * u**2 * (1 - u), u**3])
    spline = curve(points, 1.0)
    return all((spline(span + u) @ normal - weights @ bounds).min() >= -2e-9 * (1 + np.abs(points).max())
               for span, normal, bounds in zip(fences.spans, fences.normals, fences.bounds))


# The quadratic program


@given(ANGLES, st.floats(0.3, 6.0), st.integers(0, 6))
def test_a_departure_stands_exactly_until_it_leaves_exactly_along_its_direction(angle, distance, hold):
    points = PROBLEM.solve(REST, going_to(distance * unit(angle + 0.6)), NONE, Departure(unit(angle), hold))
    assert not points[:3 + hold].any()
    way = points[3 + hold]
    assert way @ unit(angle) > 0 and abs(way @ unit(angle + np.pi / 2)) < 1e-9
    assert keeps_turn_rate(points, STEP, LIMITS.omega_max) and keeps_limits(points, LIMITS, STEP)


@given(ANGLES, st.floats(-1.5, 1.5), st.integers(0, 6))
def test_a_straight_departure_stays_on_its_line_and_never_turns_back(angle, aside, hold):
    departure = Departure(unit(angle), hold, is_straight=True)
    points = PROBLEM.solve(REST, going_to(3 * unit(angle + aside)), NONE, departure)
    assert not points[:3 + hold].any()
    assert points @ unit(angle + np.pi / 2) == pytest.approx(0, abs=1e-12)
    assert np.diff(points @ unit(angle)).min() >= -1e-9
    assert keeps_turn_rate(points, STEP, 0.01)


@given(ANGLES, st.floats(0.3, 1.5))
def test_with_an_arrival_it_stands_exactly_at_the_goal_from_then_on(angle, distance):
    goal = distance * unit(angle)
    points = PROBLEM.solve(REST, going_to(goal), NONE, Departure(unit(angle), 0), arrival=(SPANS, goal))
    assert (points[SPANS:] == goal).all() and keeps_limits(points, LIMITS, STEP)


def test_an_arrival_that_would_take_more_than_the_limits_allow_is_none():
    assert PROBLEM.solve(REST, going_to((2.0, 0)), NONE, arrival=(8, np.array([2.0, 0]))) is None


def test_it_makes_good_use_of_its_time():
    points = PROBLEM.solve(REST, going_to((20.0, 0)), NONE, Departure(np.array([1.0, 0]), 0))
    # Half a second each to start and to stop at 1 m/s and 2 m/s^2 leave 2.5 m of the 3 s.
    assert points[-1, 0] > 2.1


@given(ANGLES, st.floats(0.05, 1.0))
def test_a_fence_is_kept_with_a_margin_where_there_is_room_for_one(angle, distance):
    fence = wall(-unit(angle), -distance)
    points = PROBLEM.solve(REST, going_to(5 * unit(angle)), fence, Departure(unit(angle), 0))
    room = fence.room(bezier(points))
    assert 0.003 <= room.min() < 0.02, 'the margin, and no more: the goal lies behind the fence'


def test_a_fence_without_room_for_a_margin_is_kept_as_it_is():
    fence = wall((0, 1), 0.0)
    points = PROBLEM.solve(REST, going_to((5, -1)), fence, Departure(np.array([1.0, 0]), 0))
    assert fence.room(bezier(points)).min() >= -1e-9 and points[-1, 0] > 1.5


def test_of_too_many_fences_the_tightest_count():
    far = [wall(unit(angle), -1.9) for angle in np.linspace(-3, 3, 20)]
    fences = sum(far, wall((-1, 0), -0.5))
    points = PROBLEM.solve(REST, going_to((5, 0)), fences, Departure(np.array([1.0, 0]), 0))
    assert fences.room(bezier(points)).min() >= 0


@settings(max_examples=50)
@given(st.lists(st.tuples(st.floats(0, 4), ANGLES), min_size=2, max_size=6))
def test_section_after_section_goes_on_within_the_limits(goals):
    old = REST
    for distance, angle in goals:
        departure = None if np.ptp(old[:3], axis=0).any() else Departure(unit(angle), 0)
        new = PROBLEM.solve(old, going_to(old[2] + distance * unit(angle)), NONE, departure)
        old = old if new is None else shorten(old, new, NONE, LIMITS, STEP)
        assert keeps_limits(old, LIMITS, STEP)
        old = np.vstack([old[2:], old[-1:], old[-1:]])


# What is let through


@st.composite
def driven(draw):
    """Draw limits, the time between knots and a plan that keeps the limits."""
    limits = Limits(draw(st.floats(0.2, 2.0)), draw(st.floats(0.3, 3.0)), draw(st.sampled_from([0.5, 5.0, 1e6])), 0.2)
    step, points = draw(st.sampled_from([0.1, 0.125, 0.5])), draw(walks(12))
    points *= min(1.0, 0.999 * limits.v_max / max(speed_bound(points, step), 1e-9),
                  0.999 * limits.a_max / max(acceleration_bound(points, step), 1e-9))
    assume(keeps_turn_rate(points, step, limits.omega_max))
    return limits, step, points


@st.composite
def fences_of(draw, points):
    """Draw fences that ``points`` keep to, most of them tightly, some on spans after the end."""
    count = draw(st.integers(0, 30))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    spans = rng.integers(0, len(points) + 5, count)
    angles = rng.uniform(-np.pi, np.pi, count)
    normals = np.column_stack([np.cos(angles), np.sin(angles)])
    rest = np.repeat(points[-1:], 10, axis=0)
    places = np.einsum('qd,qkd->qk', normals, bezier(np.vstack([points, rest]))[spans])
    room = draw(st.sampled_from([0.0, 1e-12, 1e-3, 0.3])) * rng.uniform(size=(count, 4))
    return Fences(spans, normals, places - room)


@st.composite
def others(draw, points, sizes=(1e-9, 0.01, 1.0, 1e200)):
    """Draw another plan with the same first three points that ends at rest: near or far, smooth or wild."""
    rng, size = np.random.default_rng(draw(st.integers(0, 2**32 - 1))), draw(st.sampled_from(sizes))
    new = points.copy()
    if draw(st.booleans()):
        change = np.linspace(0, 1, len(points))[:, None] * rng.normal(size=2) * size
    else:
        change = rng.normal(size=points.shape) * size
    new[3:] += change[3:]
    new[-3:] = new[-1] if len(points) > 5 else points[2]
    return new


@settings(max_examples=400)
@given(st.data())
def test_whatever_the_new_plan_is_the_result_keeps_to_all_that_the_old_one_keeps_to(data):
    limits, step, old = data.draw(driven())
    fences, new = data.draw(fences_of(old)), data.draw(others(old))
    result = shorten(old, new, fences, limits, step)
    assert (result[:3] == old[:3]).all() and (result[-3:] == result[-1]).all()
    assert result is old or keeps_limits(result, limits, step) and keeps_fences(result, fences)


@settings(max_examples=300)
@given(st.data())
def test_fences_that_the_limits_keep_out_of_reach_change_nothing(data):
    limits, step, old = data.draw(driven())
    fences, new = data.draw(fences_of(old)), data.draw(others(old))
    spans = len(old) - 3
    reach = SectionProblem(limits, step, max(spans, 4)).reach[:spans] + 1e-6
    assert (shorten(old, new, fences, limits, step)
            == shorten(old, new, fences.within(old, reach), limits, step)).all()


@settings(max_examples=100)
@given(st.data(), st.sampled_from([np.nan, np.inf, -np.inf]))
def test_what_is_no_plan_changes_nothing(data, garbage):
    limits, step, old = data.draw(driven())
    new, fences = data.draw(others(old)), data.draw(fences_of(old))
    at = data.draw(st.integers(0, len(old) - 1))
    broken = new.copy()
    broken[at, data.draw(st.integers(0, 1))] = garbage
    assert shorten(old, broken, fences, limits, step) is old
    for index in (0, 1, 2, -1):
        broken = new.copy()
        broken[index] += 0.01
        assert shorten(old, broken, fences, limits, step) is old


@settings(max_examples=200)
@given(st.data(), ANGLES, st.lists(st.tuples(st.floats(0, 0.2), st.floats(0.01, 0.5)), min_size=2, max_size=12))
def test_it_goes_as_far_as_fences_speed_and_acceleration_let_it(data, angle, lengths):
    # Straight on, so that every mixture keeps every turn rate.
    before, more = np.array(lengths).T
    old, change = (np.cumsum([0, 0, 0, *each, 0, 0])[:, None] * unit(angle) for each in (before, more))
    limits = Limits(1.01 * speed_bound(old, STEP) + 0.1, 1.01 * acceleration_bound(old, STEP) + 0.1, 0.1, 0.2)
    fences = data.draw(fences_of(old))

    def is_within(share):
        mixed = old + share * change
        beyond = np.vstack([mixed, np.repeat(mixed[-1:], 10, axis=0)])
        return (speed_bound(mixed, STEP) <= limits.v_max and acceleration_bound(mixed, STEP) <= limits.a_max
                and fences.room(bezier(beyond)).min(initial=0.0) >= -1e-12)

    low, high = 0.0, 1.0
    for _ in range(60):
        low, high = ((low + high) / 2, high) if is_within((low + high) / 2) else (low, (low + high) / 2)
    result = shorten(old, old + change, fences, limits, STEP)
    possible = 1.0 if is_within(1.0) else 0.999 * low
    # A thousandth of the way is not worth a new plan, and what is nearer to the end than 1e-6 m is the end.
    assert possible < 2e-3 or np.abs(result - old - possible * change).max() <= 3e-6 + 1e-3 * np.abs(change).max()


def test_what_may_be_driven_as_it_is_is_the_result():
    new = PROBLEM.solve(REST, going_to((2, 1)), NONE, Departure(unit(0.4), 2))
    assert (shorten(REST, new, NONE, LIMITS, STEP) == new).all()


def test_rounding_at_a_fence_without_room_does_not_stop_a_robot():
    fence = wall((0, 1), 0.0)
    new = PROBLEM.solve(REST, going_to((5, 0)), NONE, Departure(np.array([1.0, 0]), 0))
    for rounding in (-1e-16, -1e-12, 0.0, 1e-16):
        wanted = new.copy()
        wanted[3:, 1] += rounding
        assert shorten(REST, wanted, fence, LIMITS, STEP)[-1, 0] > 1.5
        assert shorten(REST, wanted, wall((0, 1), 1e-16), LIMITS, STEP)[-1, 0] > 1.5


def test_a_fence_after_the_end_of_the_plans_holds_where_they_rest():
    new = PROBLEM.solve(REST, going_to((5, 0)), NONE, Departure(np.array([1.0, 0]), 0))
    result = shorten(REST, new, wall((-1, 0), -0.5, [SPANS + 40]), LIMITS, STEP)
    assert 0.49 < result[-1, 0] <= 0.5
