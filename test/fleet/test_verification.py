"""The judge: passes what is right and catches every kind of wrong, broken by hand."""
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from curves import curve, walks
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from mobile_planning import Boundary, Environment, OccupancyGrid, PolygonObstacle, Report, RoundObstacle, verify
from mobile_planning.fleet import scenarios
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.faults import Faults, Join, Kill
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body

HALL = Boundary((-1, 21), (-5, 5))
WORLD = Environment(HALL)
TC = 0.25
#: Steps [m] that start and stop within 2 m/s^2, and keep 1 m/s in between.
STEPS = (0.1, 0.2, *[0.25] * 20, 0.2, 0.1)


def body(eyed, start, goal, **limits):
    return Body(eyed, 0.2, np.array(start, float), np.array(goal, float),
                **{'v_max': 1.0, 'omega_max': 5.0, 'a_max': 2.0, **limits})


def drive(start, direction, steps=STEPS, first_knot=0, rest=0, **options):
    """Return a plan along a straight line, after ``rest`` spans at rest."""
    along = np.cumsum([0] * (3 + rest) + list(steps) + [0, 0])
    points = np.asarray(start, float) + along[:, None] * np.array([np.cos(direction), np.sin(direction)])
    return Plan(first_knot, TC, points, **{'heading': direction, **options})


def braking(old, knot, count):
    """Return a plan that goes on with ``count`` control points of ``old`` from ``knot`` on and then brakes."""
    given = old.control(knot, count)
    return Plan(knot, old.step, np.vstack([given, given[-1] + [(0.2, 0), (0.3, 0), (0.3, 0), (0.3, 0)]]), 0.0)


def judged(*runs, world=WORLD, start_time=0.0, **limits):
    """Return the report on (eyed, start pose, goal pose, plan, plan, ...) each."""
    bodies = [body(run[0], run[1], run[2], **limits) for run in runs]
    solutions = {run[0]: Solution(run[0], tuple(run[3:]), True) for run in runs if len(run) > 3}
    return verify(solutions, bodies, world, start_time)


LENGTH = sum(STEPS)
ALONG = (1, (0, 0, 0), (LENGTH, 0, 0), drive((0, 0), 0.0))


def is_caught(report, *words):
    return not report.valid and len(report.violations) > 0 and all(
        any(word in sentence for sentence in report.violations) for word in words)


# What is right


def test_a_mission_that_is_right_passes_with_its_measures():
    report = judged(ALONG, (2, (0, 1, 0), (LENGTH, 1, 0), drive((0, 1), 0.0)))
    assert report.valid and report.violations == [] and report.arrived == report.robots == 2
    assert report.min_separation == pytest.approx(1.0)
    # The first robot leaves from 1 m before the left wall.
    assert report.min_obstacle_clearance == pytest.approx(0.8)
    assert report.mission_time == pytest.approx(ALONG[3].end_knot * TC)
    assert report.closest['robots'] == [1, 2]
    assert np.linalg.norm(np.subtract(*report.closest['places'])) == pytest.approx(1.0)


def test_one_robot_is_infinitely_far_from_the_others():
    report = judged(ALONG)
    assert report.valid and report.min_separation == np.inf and report.closest is None
    assert report.as_dict()['min_separation'] is None


def test_a_turn_in_place_before_and_after_the_drive_passes():
    plan = drive((0, 0), 0.0, rest=2, heading=2.0)
    stay = Plan(plan.end_knot, TC, np.tile(plan.end, (6, 1)), 0.0, -2.0)
    assert judged((1, (0, 0, 2.0), (LENGTH, 0, -2.0), plan, stay)).valid


def test_a_change_of_plan_on_the_way_passes():
    old = drive((0, 0), 0.0)
    new = braking(old, 6, 8)
    report = judged((1, (0, 0, 0), (*new.end, 0), old, new))
    assert report.valid, report.violations
    assert report.mission_time == pytest.approx(new.end_knot * TC)


def test_a_robot_that_has_nothing_to_do_passes():
    assert judged((1, (0, 0, 1.0), (0, 0, 1.0), Plan.at_rest(0, TC, (0, 0, 1.0)))).valid


@pytest.mark.parametrize('step', [0.25, 0.1, 1 / 3])
def test_a_mission_in_seconds_since_1970_is_judged_like_one_at_zero(step):
    first_knot = int(1.8e9 / step)
    # Changes of plan while the acceleration changes, at knots whose times are rounded.
    plans = [drive((0, 0), 0.0, rest=3, heading=1.0)]
    plans += [Plan(knot, TC, plans[0].control(knot, 40), 0.0) for knot in (5, 6, 7)]
    plans = [Plan(first_knot + plan.first_knot, step, plan.points, plan.heading) for plan in plans]
    limits = {'v_max': 3.0, 'a_max': 20.0, 'omega_max': 20.0}
    report = judged((1, (0, 0, 1.0), (*plans[-1].end, 0.0), *plans), start_time=first_knot * step, **limits)
    assert report.valid, report.violations
    assert report.mission_time == pytest.approx((plans[0].end_knot - first_knot) * step, abs=1e-6)


@settings(max_examples=60)
@given(walks(6), walks(6), st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_separation_and_clearance_are_those_of_dense_samples(one, two, shift):
    obstacle = RoundObstacle((1.0, 1.0), 0.3)
    two = two + shift
    plans = [Plan(0, TC, one), Plan(3, TC, two)]
    report = judged(*((i, plan.state(plan.first_knot * TC)[:3], (*plan.end, 0), plan) for i, plan in enumerate(plans)),
                    world=Environment(HALL, [obstacle]))
    t = np.linspace(0, 15 * TC, 20001)
    places = [curve(plan.points, TC, plan.first_knot)(np.clip(t, plan.first_knot * TC, plan.end_knot * TC))
              for plan in plans]
    assert report.min_separation == pytest.approx(np.linalg.norm(places[0] - places[1], axis=1).min(), abs=2e-3)
    clearance = min(np.linalg.norm(place - (1, 1), axis=1).min() for place in places) - 0.5
    to_wall = min(0.8 + place[:, 0].min() for place in places)
    assert report.min_obstacle_clearance == pytest.approx(min(clearance, to_wall), abs=2e-3)


# What is wrong between robots


def test_an_overlap_of_two_robots_is_caught():
    report = judged(ALONG, (2, (LENGTH, 0.3, np.pi), (0, 0.3, np.pi), drive((LENGTH, 0.3), np.pi)))
    assert is_caught(report, 'robots 1 and 2')
    assert report.min_separation == pytest.approx(0.3, abs=1e-3)


def test_an_overlap_with_a_robot_that_never_answered_is_caught():
    assert is_caught(judged(ALONG, (2, (3, 0.1, 0), (3, 4, 0))), 'robots 1 and 2')


@pytest.mark.parametrize('shift', np.arange(0, 0.02, 0.0025))
def test_an_overlap_between_two_samples_is_caught(shift):
    # Apart at every sample of 5 ms; for less than 3 ms the bodies overlap by a hundredth of a millimetre.
    passing = 0.4 - 1e-5
    report = judged(ALONG, (2, (LENGTH + shift, passing, np.pi), (shift, passing, np.pi),
                            drive((LENGTH + shift, passing), np.pi)))
    assert is_caught(report, 'robots 1 and 2')


def test_a_near_miss_is_none():
    passing = 0.4 + 1e-5
    report = judged(ALONG, (2, (LENGTH, passing, np.pi), (0, passing, np.pi), drive((LENGTH, passing), np.pi)))
    assert report.valid and report.min_separation == pytest.approx(passing, abs=1e-7)


def test_a_robot_that_stands_in_the_way_after_its_arrival_is_caught():
    short = drive((3, -2), np.pi / 2, (0.1, 0.2, *[0.25] * 5, 0.2, 0.1))
    report = judged(ALONG, (2, (3, -2, np.pi / 2), (*short.end, np.pi / 2), short), v_max=1.0)
    assert is_caught(report, 'robots 1 and 2')


# What is wrong with the world


@pytest.mark.parametrize('obstacle', [
    RoundObstacle((3, 0.5), 0.31), RoundObstacle((3, 0), 0.01), PolygonObstacle([(3, -0.19), (4, -0.19), (3.5, -1)]),
    PolygonObstacle([(2, -1), (4, -1), (4, 1), (2, 1)])])
def test_an_obstacle_that_is_hit_is_caught(obstacle):
    assert is_caught(judged(ALONG, world=Environment(HALL, [obstacle])), 'static world')


def test_an_obstacle_touched_between_two_samples_is_caught():
    # The tip of a needle, 10 um deep in the body's edge for some milliseconds.
    for tip in np.arange(3.0, 3.005, 0.0007):
        needle = PolygonObstacle([(tip, 0.2 - 1e-5), (tip - 0.01, 1), (tip + 0.01, 1)])
        assert is_caught(judged(ALONG, world=Environment(HALL, [needle])), 'static world')


@pytest.mark.parametrize('boundary', [Boundary((-0.1, 21), (-5, 5)), Boundary((-1, 5.7), (-5, 5)),
                                      Boundary((-1, 21), (-5, 0.19)), Boundary((10, 21), (-5, 5))])
def test_a_drive_out_of_the_boundary_is_caught(boundary):
    assert is_caught(judged(ALONG, world=Environment(boundary)), 'static world')


@pytest.mark.parametrize('yaw', [0.0, 0.4])
@pytest.mark.parametrize('cell, is_hit', [((30, 20), True), ((30, 23), True), ((30, 24), False), ((70, 20), False)])
def test_an_occupied_cell_that_is_hit_is_caught(cell, is_hit, yaw):
    # The drive is along the middle of row 20; its body reaches 0.15 m into the rows above and below.
    data = np.zeros((41, 80), int)
    data[cell[1], cell[0]] = 100
    grid = OccupancyGrid(data, 0.1, (2.0, 1.0, yaw))
    (start, towards) = grid.cell_to_world([(5, 20), (65, 20)])
    heading = np.arctan2(*(towards - start)[::-1])
    plan = drive(start, heading, (0.1, 0.2, *[0.25] * 16, 0.2, 0.1))
    # A hair nearer to the cell of row 23, whose edge is 0.25 m away; to that of row 22 the bodies touch.
    report = judged((1, (*start, heading), (*plan.end, heading), plan), world=Environment(grid=grid))
    expected = is_hit if cell[1] != 23 else False
    assert is_caught(report, 'static world') == expected and report.valid != expected


def test_the_clearance_to_occupied_cells_is_that_to_their_squares():
    rng = np.random.default_rng(3)
    data = np.where(rng.random((40, 60)) < 0.03, 100, 0)
    data[15:25, 5:55] = 0
    grid = OccupancyGrid(data, 0.1)
    plan = drive((1.0, 2.0), 0.0, (0.1, 0.2, *[0.25] * 12, 0.2, 0.1))
    report = judged((1, (1, 2, 0), (*plan.end, 0), plan), world=Environment(grid=grid))
    places = plan.states(np.linspace(0, plan.end_knot * TC, 5001))[:, :2]
    low = np.argwhere(data == 100)[:, ::-1] * 0.1
    gap = np.maximum(np.maximum(low - places[:, None], places[:, None] - low - 0.1), 0)
    least = min(np.linalg.norm(gap, axis=-1).min(), 1.0)
    assert report.min_obstacle_clearance == pytest.approx(least - 0.2, abs=1e-4)


def test_cells_on_an_arc_around_the_robot_are_all_looked_at():
    # More squares than a dozen lie as near as the nearest centre; the nearest square is none of the nearest centres.
    y, x = np.indices((101, 101)) - 50
    ring = (np.hypot(x, y) > 40) & (np.hypot(x, y) < 44)
    grid = OccupancyGrid(np.where(ring, 100, 0), 0.1)
    centre = np.array([5.05, 5.05])
    report = judged((1, (*centre, 0), (*centre, 0), Plan.at_rest(0, TC, (*centre, 0))), world=Environment(grid=grid))
    low = np.argwhere(ring)[:, ::-1] * 0.1
    gap = np.maximum(np.maximum(low - centre, centre - low - 0.1), 0)
    assert report.min_obstacle_clearance == pytest.approx(np.linalg.norm(gap, axis=1).min() - 0.2, abs=1e-9)


def test_a_drive_out_of_the_map_is_caught():
    grid = OccupancyGrid(np.zeros((40, 40), int), 0.1, (-1.0, -2.0, 0.0))
    assert is_caught(judged(ALONG, world=Environment(grid=grid)), 'static world')


# What is wrong with the motion


def test_a_speed_beyond_the_limit_is_caught():
    plan = drive((0, 0), 0.0, (0.1, 0.2, *[0.2501] * 20, 0.2, 0.1))
    assert is_caught(judged((1, (0, 0, 0), (*plan.end, 0), plan)), 'speed')


def test_an_acceleration_beyond_the_limit_is_caught():
    plan = drive((0, 0), 0.0, (0.126, 0.25, *[0.25] * 20, 0.2, 0.1))
    report = judged((1, (0, 0, 0), (*plan.end, 0), plan))
    assert is_caught(report, 'acceleration') and len(report.violations) == 1


def bend(angle, steps=(0.05,) * 10):
    """Return a plan that drives on at ``angle`` to its first direction."""
    first = np.cumsum([0, 0, 0, *steps])[:, None] * np.array([1.0, 0.0])
    second = first[-1] + np.cumsum([*steps, 0, 0])[:, None] * np.array([np.cos(angle), np.sin(angle)])
    return Plan(0, TC, np.vstack([first, second]), 0.0)


@pytest.mark.parametrize('angle', [1.0, 2.0, -3.0, 3.14159])
def test_a_turn_rate_beyond_the_limit_is_caught(angle):
    plan = bend(angle)
    assert is_caught(judged((1, (0, 0, 0), (*plan.end, angle), plan), omega_max=1.0), 'turn rate')
    if abs(angle) == 1.0:
        assert judged((1, (0, 0, 0), (*plan.end, angle), plan)).valid


def test_turning_back_on_the_spot_is_caught():
    plan = bend(np.pi)
    assert is_caught(judged((1, (0, 0, 0), (*plan.end, np.pi), plan)), 'turn rate')


def test_a_corner_at_a_halt_without_time_to_turn_is_caught():
    first, second = (np.cumsum([0, 0, 0.1, 0.1, 0, 0]),) * 2
    points = np.vstack([first[:, None] * (1.0, 0.0), (first[-1], 0) + second[2:, None] * (0.0, 1.0)])
    plan = Plan(0, TC, np.vstack([points[:1], points]), 0.0)
    assert is_caught(judged((1, (0, 0, 0), (*plan.end, np.pi / 2), plan)), 'heading jumps')


@pytest.mark.parametrize('rest, turn, is_fast', [(1, 1.3, True), (1, 1.2, False), (2, -2.6, True), (2, -2.4, False)])
def test_a_turn_in_place_beyond_the_limit_is_caught(rest, turn, is_fast):
    before = drive((0, 0), 0.0, rest=rest, heading=turn)
    assert is_caught(judged((1, (0, 0, turn), (LENGTH, 0, 0), before)), 'in place') == is_fast
    after = drive((0, 0), 0.0, (*STEPS, *[0] * rest), final_heading=turn)
    assert is_caught(judged((1, (0, 0, 0), (LENGTH, 0, turn), after)), 'in place') == is_fast
    still = Plan(0, TC, np.zeros((3 + rest, 2)), 0.0, turn)
    assert is_caught(judged((1, (0, 0, 0), (0, 0, turn), still)), 'in place') == is_fast


def shifted(order):
    """Return two plans, of which the second goes on with a jump of the first derivative ``order`` of the position."""
    old = drive((0, 0), 0.0)
    start = old.control(8, 3) + {0: [(0, 1e-4)] * 3, 1: [(-1e-4, 0), (0, 0), (1e-4, 0)],
                                 2: [(1e-4, 0), (-5e-5, 0), (1e-4, 0)]}[order]
    points = np.vstack([start, start[-1] + [(0.25, 0), (0.45, 0), (0.55, 0), (0.55, 0), (0.55, 0)]])
    return old, Plan(8, TC, points, 0.0)


@pytest.mark.parametrize('order, what', list(enumerate(['position', 'velocity', 'acceleration'])))
def test_a_jump_at_a_change_of_plan_is_caught(order, what):
    plans = shifted(order)
    assert is_caught(judged((1, (0, 0, 0), (*plans[1].end, 0), *plans), a_max=3.0), f'{what} jumps')


def test_a_jump_of_the_heading_at_rest_is_caught():
    stay, go = Plan.at_rest(0, TC, (0, 0, 1.0)), drive((0, 0), 0.0, first_knot=4)
    assert is_caught(judged((1, (0, 0, 1.0), (LENGTH, 0, 0), stay, go)), 'heading jumps')
    turned = drive((0, 0), 0.0, first_knot=4, rest=3, heading=0.5)
    assert is_caught(judged((1, (0, 0, 1.0), (LENGTH, 0, 0), stay, turned)), 'heading jumps')
    assert judged((1, (0, 0, 1.0), (LENGTH, 0, 0), stay, replace(turned, heading=1.0))).valid


def test_plans_out_of_order_are_caught():
    late, early = Plan.at_rest(9, TC, (0, 0, 0)), drive((0, 0), 0.0)
    assert is_caught(judged((1, (0, 0, 0), (LENGTH, 0, 0), late, early)), 'follow each other')


# What is wrong with the mission


def test_a_wrong_start_is_caught():
    assert is_caught(judged((1, (0, 0.001, 0), (LENGTH, 0, 0), ALONG[3])), 'position jumps')
    assert is_caught(judged((1, (0, 0, 0.01), (LENGTH, 0, 0), ALONG[3])), 'heading jumps')


@pytest.mark.parametrize('gap, turned, commit, is_right', [
    (0.03, 0.03, np.nan, True), (0.1, 0.0, np.nan, False), (0.0, 0.1, np.nan, False), (0.03, 0.03, 8.0, False)])
def test_only_a_process_that_is_started_anew_finds_its_body_a_little_elsewhere(gap, turned, commit, is_right):
    found = Plan.at_rest(40, TC, (LENGTH + gap, 0, turned))
    solution = Solution(1, (Plan.at_rest(0, TC, (0, 0, 0)), ALONG[3], found), True, commits=(np.nan, 0.0, commit))
    report = verify({1: solution}, [body(1, (0, 0, 0), found.state(99.0)[:3])], WORLD)
    assert report.valid if is_right else is_caught(report, 'jumps')


@pytest.mark.parametrize('goal', [(LENGTH + 0.06, 0, 0), (LENGTH, 0, 0.06), (LENGTH, 0, np.pi), (0, 0, 0)])
def test_a_robot_that_is_not_at_its_goal_has_not_arrived(goal):
    report = judged((1, (0, 0, 0), goal, ALONG[3]))
    assert not report.valid and report.arrived == 0 and report.violations == [] and report.mission_time == 0


def test_a_goal_that_was_only_passed_is_not_reached():
    assert not judged((1, (0, 0, 0), (LENGTH / 2, 0, 0), ALONG[3])).valid


def test_a_robot_without_a_solution_has_not_arrived():
    report = judged(ALONG, (2, (0, 2, 0), (5, 2, 0)))
    assert not report.valid and (report.arrived, report.robots) == (1, 2) and report.violations == []
    assert report.min_separation == pytest.approx(2.0)


def test_a_detour_by_a_superseded_plan_does_not_delay_the_arrival():
    old = drive((0, 0), 0.0)
    new = braking(old, 4, 3)
    report = judged((1, (0, 0, 0), (*new.end, 0), old, new))
    assert report.valid and report.mission_time == pytest.approx(new.end_knot * TC)


# To the last digit: a limit a hair above what dense samples say is kept, one a hair below is not


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


# What was never driven


def test_futures_that_would_collide_are_caught_although_nobody_ever_drove_them():
    # Head-on, both brake in time; until they did, their plans went through each other.
    old = drive((0, 0), 0.0), drive((LENGTH, 0), np.pi)
    turn = np.diag([-1.0, -1.0])
    given = old[0].control(4, 3)
    short = Plan(4, TC, np.vstack([given, given[-1] + [(0.2, 0), (0.3, 0), (0.3, 0), (0.3, 0)]]), 0.0)
    others = Plan(4, TC, short.points @ turn + (LENGTH, 0), np.pi)
    report = judged((1, (0, 0, 0), (*short.end, 0), old[0], short),
                    (2, (LENGTH, 0, np.pi), (*others.end, np.pi), old[1], others))
    assert is_caught(report, 'come closer') and report.min_separation > 1.0 and len(report.violations) == 1


def test_a_future_through_the_static_world_is_caught_although_it_was_never_driven():
    old = drive((0, 0), 0.0)
    new = braking(old, 4, 3)
    wall = PolygonObstacle([(4, -1), (5, -1), (5, 1), (4, 1)])
    report = judged((1, (0, 0, 0), (*new.end, 0), old, new), world=Environment(HALL, [wall]))
    assert is_caught(report, 'static world is touched') and report.min_obstacle_clearance > 0.5
    assert len(report.violations) == 1


def test_a_place_is_taken_before_its_robot_is_switched_on():
    late = Plan.at_rest(100, TC, (3, 0.1, 0))
    assert is_caught(judged(ALONG, (2, (3, 0.1, 0), (3, 0.1, 0), late)), 'robots 1 and 2')
    assert judged(ALONG, (2, (3, 0.5, 0), (3, 0.5, 0), replace(late, points=late.points + (0, 0.4)))).valid


def test_whole_plans_are_judged_for_speed_and_turns_too():
    old = drive((0, 0), 0.0, (0.1, 0.2, *[0.25] * 10, 0.2501, *[0.25] * 10, 0.2, 0.1))
    new = braking(old, 4, 3)
    assert is_caught(judged((1, (0, 0, 0), (*new.end, 0), old, new)), 'speed')


# What is no plan


def broken(plan, **fields):
    """Return what only looks like a plan."""
    names = 'first_knot', 'step', 'points', 'heading', 'final_heading', 'reverse'
    return SimpleNamespace(**{**{name: getattr(plan, name) for name in names}, 'end_knot': plan.end_knot, **fields})


@pytest.mark.parametrize('fields', [
    {'points': np.where(np.arange(64)[:27, None] == 9, np.nan, ALONG[3].points[:27])}, {'points': ALONG[3].points[:9]},
    {'points': np.full((27, 2), np.inf)}, {'points': np.full((27, 2), 1e200)}, {'points': ALONG[3].points[:3]},
    {'points': ALONG[3].points[:, 0]}, {'heading': np.nan}, {'heading': np.inf}, {'final_heading': np.inf}])
def test_what_is_no_plan_is_caught(fields):
    report = judged((*ALONG[:3], broken(ALONG[3], **fields)), (2, (0, 2, 0), (LENGTH, 2, 0), drive((0, 2), 0.0)))
    assert is_caught(report, 'no plan') and report.arrived == 1


def test_robots_that_do_not_share_their_knots_are_caught():
    other = Plan(0, 0.2, drive((0, 2), 0.0, [0.1] * 10).points)
    assert is_caught(judged(ALONG, (2, (0, 2, 0), (*other.end, 0), other)), 'no plan')


# Backwards


def test_a_drive_backwards_passes_where_it_may():
    plan = drive((0, 0), np.pi, rest=1, reverse=True, heading=0.0)
    assert plan.state(3.0)[3] < 0
    assert judged((1, (0, 0, 0), (-LENGTH, 0, 0), plan), world=Environment()).valid
    report = judged((1, (0, 0, 0), (-LENGTH, 0, 0), replace(plan, reverse=False)), world=Environment())
    assert is_caught(report, 'in place') and report.arrived == 0


def test_the_smaller_turn_is_judged_and_headings_continue_backwards():
    first = drive((0, 0), 2.5, rest=2, reverse=True, heading=0.0)
    knot = 12
    later = Plan(knot, TC, first.control(knot, 40), first.state(knot * TC)[2], reverse=True)
    goal, rate, free = (*later.end, 2.5 - np.pi), (np.pi - 2.5) / 0.5, Environment()
    assert judged((1, (0, 0, 0), goal, first, later), world=free, omega_max=rate + 1e-6).valid
    assert is_caught(judged((1, (0, 0, 0), goal, first, later), world=free, omega_max=rate - 1e-3), 'in place')
    forward = replace(later, heading=2.5)
    assert is_caught(judged((1, (0, 0, 0), goal, first, forward), world=Environment()), 'heading jumps')


# Whole missions, as they were and broken by hand


@cache
def mission(name, faults=Faults(), **parameters):
    """Return a simulation that has been run, with its report."""
    scene = scenarios.scene(name, seed=1, **parameters)
    simulation = scene.world_sim(margin=0.01)
    return simulation, simulation.run(1, 0.1, 0.1, scene.timeout, faults=faults)


def judge_again(simulation, solutions):
    bodies = [Body(r.eyed, r.rho, r.k_mod.q_init, r.k_mod.q_final, *r.k_mod.u_max, r.k_mod.acc_max[0])
              for r in simulation.robots.values()]
    return verify(solutions, bodies, simulation.environment)


@pytest.mark.parametrize('name, parameters', [('swap', {'robots': 4}), ('forest', {'robots': 3}), ('heritage', {}),
                                              ('doorway', {'robots': 2}), ('warehouse', {'robots': 2})])
def test_missions_as_they_were_driven_pass(name, parameters):
    simulation, report = mission(name, **parameters)
    assert report.violations == [] and judge_again(simulation, simulation.solutions).violations == []
    assert report.lower_bound > 0 and report.messages > 0 and report.message_bytes > 0
    assert report.ratio is None or report.ratio > 0.9


@pytest.mark.parametrize('faults', [Faults(kills=(Kill(2, 3.0),)), Faults(kills=(Kill(2, 3.0, restart_after=3.0),)),
                                    Faults(joins=(Join(2, 4.0),))], ids=['death', 'restart', 'join'])
def test_missions_with_a_death_a_restart_or_a_late_robot_pass(faults):
    simulation, report = mission('swap', faults, robots=4)
    assert judge_again(simulation, simulation.solutions).violations == []
    assert report.dead == len(simulation.episode.dead)


def test_robots_that_are_exchanged_are_caught():
    simulation, _ = mission('swap', robots=4)
    one, two, *rest = simulation.solutions.values()
    exchanged = {1: replace(one, plans=two.plans), 2: replace(two, plans=one.plans)}
    assert is_caught(judge_again(simulation, {**simulation.solutions, **exchanged}), 'robot 1: position jumps')


@pytest.mark.parametrize('shift', [(0.01, 0.0), (0.0, -1e-6)])
def test_one_plan_that_is_moved_is_caught(shift):
    simulation, _ = mission('swap', robots=4)
    plans = list(simulation.solutions[3].plans)
    plans[len(plans) // 2] = replace(plans[len(plans) // 2], points=plans[len(plans) // 2].points + shift)
    solution = replace(simulation.solutions[3], plans=tuple(plans))
    assert is_caught(judge_again(simulation, {**simulation.solutions, 3: solution}), 'robot 3: position jumps')


def test_a_plan_that_comes_a_knot_late_is_caught():
    simulation, _ = mission('swap', robots=4)
    plans = list(simulation.solutions[3].plans)
    index = next(i for i, plan in enumerate(plans) if i and np.ptp(plan.points[:3], axis=0).any())
    plans[index] = replace(plans[index], first_knot=plans[index].first_knot + 1)
    solution = replace(simulation.solutions[3], plans=tuple(plans))
    assert is_caught(judge_again(simulation, {**simulation.solutions, 3: solution}), 'robot 3: ', 'jumps')


def test_robots_that_take_no_notice_of_each_other_are_caught():
    # Each alone in the world goes straight through the middle.
    simulation, _ = mission('swap', robots=4)
    solutions = {}
    for robot in simulation.robots.values():
        straight = robot.k_mod.q_final[:2] - robot.k_mod.q_init[:2]
        direction = np.arctan2(*straight[::-1])
        steps = np.concatenate([[0.05, 0.1], np.full(int(np.linalg.norm(straight) / 0.12), 0.12), [0.1, 0.05]])
        plan = drive(robot.k_mod.q_init[:2], direction, steps * np.linalg.norm(straight) / steps.sum(), rest=4,
                     heading=robot.k_mod.q_init[2])
        solutions[robot.eyed] = Solution(robot.eyed, (plan,))
    report = judge_again(simulation, solutions)
    assert is_caught(report, 'come closer', 'apart at') and report.min_separation < 0.3


def test_the_proof_and_the_samples_agree_on_what_is_hit():
    report = judged(ALONG, (2, (3, 0.1, 0), (3, 4, 0)))
    assert len(report.violations) == 2 and is_caught(report, 'come closer', 'apart at')


def test_the_table_says_it_all():
    report = judged(ALONG, (2, (3, 0.1, 0), (3, 4, 0)))
    table = report.table()
    assert 'NO' in table and '1 of 2' in table and report.violations[0] in table
    assert isinstance(report, Report) and 'yes' in judged(ALONG).table()


# From when on a plan binds

GOES_ON, CROSSES = drive((0, 0), 0.0), drive((4, -3), np.pi / 2, (0.1, 0.2, *[0.25] * 10, 0.2, 0.1))
#: Its first metres and a stop, before or after which it may still go on as GOES_ON.
STOPS = braking(GOES_ON, 0, 10)


def bound(ways, commits):
    """Return the report on robots 1 and 2 with plans that were committed at the given times [s], None for unknown."""
    bodies = [body(eyed, (*plans[0].points[0], plans[0].heading), (*plans[-1].end, plans[-1].heading))
              for eyed, plans in ways.items()]
    return verify({eyed: Solution(eyed, tuple(plans), commits=() if commits is None else commits[eyed])
                   for eyed, plans in ways.items()}, bodies, WORLD)


def test_a_plan_given_up_by_a_commit_before_the_others_is_not_held_against_it():
    stops = Plan(6, TC, np.vstack([GOES_ON.control(6, 4), STOPS.points[10:]]))
    ways = {1: [GOES_ON, stops], 2: [Plan.at_rest(0, TC, (4, -3, np.pi / 2)), replace(CROSSES, first_knot=4)]}
    assert bound(ways, {1: (0.0, 0.6), 2: (0.0, 0.9)}).valid
    assert is_caught(bound(ways, {1: (0.0, 0.95), 2: (0.0, 0.9)}), 'robots 1 and 2: by the plans bound at 0.900 s')
    assert is_caught(bound(ways, None), 'robots 1 and 2: by the plans bound at 1.000 s')


def test_a_commit_against_what_still_binds_another_robot_is_caught_although_neither_is_driven():
    given = CROSSES.control(4, 3)
    gives_way = Plan(4, TC, np.vstack([given, given[-1] + [(0, 0.2), (0, 0.3), (0, 0.3), (0, 0.3)]]), np.pi / 2)
    ways = {1: [STOPS, Plan(6, TC, GOES_ON.control(6, 25))], 2: [CROSSES, gives_way]}
    assert is_caught(bound(ways, {1: (0.0, 0.6), 2: (0.0, 0.9)}), 'robots 1 and 2: by the plans bound at 0.600 s')
    assert bound(ways, {1: (0.0, 0.95), 2: (0.0, 0.9)}).valid


@pytest.mark.parametrize('commits', [(0.0, 7.0), (0.0, np.nan), (0.0,), (9.0, 9.0), (-np.inf, -1e300)])
def test_a_plan_binds_when_it_is_driven_at_the_latest(commits):
    stands = Plan.at_rest(0, TC, (4, 0, 0))
    ways = {1: [STOPS, Plan(6, TC, GOES_ON.control(6, 25))], 2: [stands]}
    assert is_caught(bound(ways, {1: commits, 2: (0.0,)}), 'robots 1 and 2')


def test_the_solutions_of_a_mission_say_when_each_plan_was_committed_in_good_time():
    simulation = scenarios.make('swap', robots=2)
    simulation.run(0, delay=0.05)
    for solution in simulation.solutions.values():
        starts = np.array([plan.first_knot * plan.step for plan in solution.plans])
        commits = np.array(solution.commits)
        assert len(commits) == len(starts) > 3 and (np.diff(commits[1:]) > 0).all()
        assert np.isnan(commits[0]) and (commits < starts)[1:].all() and np.nanmax(starts - commits) < 0.6
