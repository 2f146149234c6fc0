"""The judge: passes what is right and catches what is wrong between robots, with their plans and with the mission."""
from types import SimpleNamespace

import numpy as np
import pytest
from curves import curve, walks
from hypothesis import given, settings
from hypothesis import strategies as st
from judged_drives import ALONG, HALL, LENGTH, TC, WORLD, body, braking, drive, is_caught, judged

from mobile_planning import Environment, Report, RoundObstacle, verify
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution


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


def test_the_proof_and_the_samples_agree_on_what_is_hit():
    report = judged(ALONG, (2, (3, 0.1, 0), (3, 4, 0)))
    assert len(report.violations) == 2 and is_caught(report, 'come closer', 'apart at')


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


# What it says


def test_the_table_says_it_all():
    report = judged(ALONG, (2, (3, 0.1, 0), (3, 4, 0)))
    table = report.table()
    assert 'NO' in table and '1 of 2' in table and report.violations[0] in table
    assert isinstance(report, Report) and 'yes' in judged(ALONG).table()
