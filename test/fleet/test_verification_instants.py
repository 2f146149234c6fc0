"""The judge, to the last digit: a limit a hair above what dense samples say is kept, one a hair below is not."""
import numpy as np
import pytest
from curves import curve, walks
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from judged_drives import ALONG, HALL, LENGTH, TC, drive, is_caught, judged

from mobile_planning import Environment, OccupancyGrid, PolygonObstacle, RoundObstacle, verify
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body


def densely(plan, order):
    """Return samples (N, 2) of a derivative of the position by scipy, at rest after the end."""
    spline = curve(plan.points, plan.step, plan.first_knot)
    t = np.linspace(plan.first_knot, plan.end_knot, 4000 * (len(plan.points) - 3) + 1) * plan.step
    return (spline if order == 0 else spline.derivative(order))(t)


def alone(points, **limits):
    """Return what is found wrong with the motion of one robot."""
    plan = Plan(0, TC, points)
    return judged((1, (0, 0, 0), (0, 0, 0), plan), world=Environment(), **limits).violations


@settings(max_examples=40)
@given(walks(6))
def test_speed_and_acceleration_are_judged_at_every_instant(points):
    plan = Plan(0, TC, points)
    for order, name, what in (1, 'v_max', 'speed exceeds'), (2, 'a_max', 'acceleration exceeds'):
        most = np.linalg.norm(densely(plan, order), axis=1).max()
        assume(most > 1e-3)
        huge = {'v_max': 1e9, 'a_max': 1e9, 'omega_max': 1e9}
        assert any(what in sentence for sentence in alone(points, **{**huge, name: most * (1 - 1e-6)}))
        assert not any(what in sentence for sentence in alone(points, **{**huge, name: most * (1 + 1e-6)}))


@settings(max_examples=40)
@given(st.lists(st.tuples(st.floats(0.05, 0.4), st.floats(-0.7, 0.7)), min_size=2, max_size=8))
def test_the_turn_rate_is_judged_at_every_instant(moves):
    headings = np.cumsum([turn for _, turn in moves])
    steps = np.array([length for length, _ in moves])[:, None] * np.column_stack([np.cos(headings), np.sin(headings)])
    points = np.cumsum(np.vstack([np.zeros((3, 2)), steps, np.zeros((2, 2))]), axis=0)
    plan = Plan(0, TC, points)
    velocity, acceleration = densely(plan, 1), densely(plan, 2)
    moving = np.linalg.norm(velocity, axis=1) > 1e-4
    cross = velocity[:, 0] * acceleration[:, 1] - velocity[:, 1] * acceleration[:, 0]
    most = np.abs(cross[moving] / (velocity[moving]**2).sum(axis=1)).max()
    assume(most > 1e-3)
    huge = {'v_max': 1e9, 'a_max': 1e9}
    assert any('turn rate' in sentence for sentence in alone(points, **huge, omega_max=most * (1 - 1e-4)))
    assert not any('turn rate' in sentence for sentence in alone(points, **huge, omega_max=most * (1 + 1e-4)))


@settings(max_examples=40)
@given(walks(6), walks(6), st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_a_pair_is_judged_at_every_instant(one, two, shift):
    plans = Plan(0, TC, one), Plan(0, TC, two + shift)
    last = max(plan.end_knot for plan in plans)
    t = np.linspace(0, last, 20000 * last + 1) * TC
    places = [curve(plan.points, TC)(np.clip(t, 0, plan.end_knot * TC)) for plan in plans]
    least = np.linalg.norm(places[0] - places[1], axis=1).min()
    assume(least > 0.01)
    for radius, is_hit in (least / 2 * (1 - 1e-4), False), (least / 2 * (1 + 1e-4), True):
        bodies = [Body(i, radius, plan.state(0.0)[:3], np.array([*plan.end, 0]), 1e9, 1e9, 1e9)
                  for i, plan in enumerate(plans)]
        report = verify({i: Solution(i, (plan,)) for i, plan in enumerate(plans)}, bodies, Environment())
        assert any('come closer' in sentence for sentence in report.violations) == is_hit


@settings(max_examples=40)
@given(walks(6), st.tuples(st.floats(-1, 1), st.floats(-1, 1)), st.sampled_from(['round', 'polygon', 'cells']))
@example(np.array([[0, 0.0]] * 4), (0.3, 0.0), 'cells')
def test_the_static_world_is_judged_at_every_instant(points, place, kind):
    low, high = np.array(place) - 0.05, np.array(place) + 0.05
    world = {'round': lambda: Environment(obstacles=[RoundObstacle(place, 0.05)]),
             'polygon': lambda: Environment(obstacles=[PolygonObstacle(
                 [low, (high[0], low[1]), high, (low[0], high[1])])]),
             'cells': lambda: Environment(grid=OccupancyGrid(
                 np.pad([[100]], 80), 0.1, (*(low - 8.0), 0.0)))}[kind]()
    paths = densely(Plan(0, TC, points), 0)
    gap = np.maximum(np.maximum(low - paths, paths - high), 0.0)
    least = np.linalg.norm(paths - place, axis=1).min() - 0.05 if kind == 'round' else np.linalg.norm(gap, axis=1).min()
    assume(least > 0.01)
    for radius, is_hit in (least * (1 - 1e-4), False), (least * (1 + 1e-4), True):
        plan = Plan(0, TC, points)
        bodies = [Body(1, radius, plan.state(0.0)[:3], np.zeros(3), 1e9, 1e9, 1e9)]
        report = verify({1: Solution(1, (plan,))}, bodies, world)
        assert any('static world is touched' in sentence for sentence in report.violations) == is_hit


def test_a_limit_exceeded_for_a_millisecond_is_caught():
    # The speed peaks between two samples; 1e-5 of it is exceeded for about a millisecond.
    plan = drive((0, 0), 0.0, (0.1, 0.2, 0.25, 0.2, 0.1))
    peak = np.linalg.norm(densely(plan, 1), axis=1).max()
    report = judged((1, (0, 0, 0), (*plan.end, 0), plan), v_max=peak - 2e-6)
    assert is_caught(report, 'speed') and judged((1, (0, 0, 0), (*plan.end, 0), plan), v_max=peak + 2e-6).valid


def test_a_wall_thinner_than_a_step_between_samples_is_caught():
    wall = PolygonObstacle([(3.0001, -1), (3.0002, -1), (3.0002, 1), (3.0001, 1)])
    small = Body(1, 1e-4, np.zeros(3), np.array([LENGTH, 0, 0]), 1.0, 5.0, 2.0)
    report = verify({1: Solution(1, (ALONG[3],))}, [small], Environment(HALL, [wall]))
    assert is_caught(report, 'static world is touched')


def test_driving_along_a_wall_that_is_touched_but_not_entered_passes():
    wall = PolygonObstacle([(-5, 0.2), (10, 0.2), (10, 1), (-5, 1)])
    report = judged(ALONG, world=Environment(obstacles=[wall]))
    assert report.valid and report.min_obstacle_clearance == pytest.approx(0.0, abs=1e-12)
