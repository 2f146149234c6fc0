"""Candidate plans: each goes on from what is given, keeps the limits at every instant and ends at rest."""
import numpy as np
import pytest
from curves import curve, dense
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from mobile_planning.fleet.bspline import Plan, keeps_turn_rate
from mobile_planning.fleet.guidance import Polyline
from mobile_planning.fleet.section import Limits, bearing, candidates, remaining

LIMITS = st.builds(Limits, st.floats(0.2, 2.0), st.floats(0.3, 3.0), st.floats(0.5, 6.0), st.just(0.2))
PATHS = st.lists(st.tuples(st.floats(-6, 6), st.floats(-6, 6)), min_size=1, max_size=4).map(
    lambda points: Polyline(np.array([(0.0, 0.0), *points])))
STEPS = st.sampled_from([0.1, 0.25, 0.5])
SPANS = 12


@st.composite
def starts(draw, limits, step):
    """Return three control points of a motion within the limits from which twelve spans suffice to stop."""
    most = min(0.9 * limits.v_max, 0.9 * (SPANS - 3) * limits.a_max * step)
    speed, heading = draw(st.floats(0, most)), draw(st.floats(-3.1, 3.1))
    gain, turn = draw(st.floats(-0.5, 0.5)), draw(st.floats(-0.2, 0.2))
    slower = max(0.0, speed + gain * limits.a_max * step)
    assume(slower <= most)
    steps = [speed * np.array([np.cos(heading), np.sin(heading)]),
             slower * np.array([np.cos(heading + turn), np.sin(heading + turn)])]
    assume(np.linalg.norm(steps[1] - steps[0]) <= 0.97 * limits.a_max * step)
    return np.cumsum([np.zeros(2), *steps], axis=0) * step


@settings(max_examples=150)
@given(st.data(), LIMITS, PATHS, STEPS, st.floats(-3.1, 3.1))
def test_every_candidate_keeps_the_limits_and_ends_at_rest(data, limits, path, step, heading):
    start = data.draw(st.one_of(st.just(np.zeros((3, 2))), starts(limits, step)))
    points = candidates(start, heading, path, limits, step, SPANS)
    assert points.shape[1:] == (SPANS + 3, 2)
    assert (points[:, :3] == start).all()
    assert (points[:, -1] == points[:, -2]).all() and (points[:, -2] == points[:, -3]).all()
    for plan in points[::7]:
        spline, t = curve(plan, step), dense(plan, step, 20)
        assert np.linalg.norm(spline.derivative(1)(t), axis=1).max() <= limits.v_max * (1 + 1e-9)
        assert np.linalg.norm(spline.derivative(2)(t), axis=1).max() <= limits.a_max * (1 + 1e-9)


@settings(max_examples=100)
@given(LIMITS, PATHS, STEPS, st.floats(-3.1, 3.1))
def test_from_rest_a_robot_turns_in_place_within_its_turn_rate_before_it_departs(limits, path, step, heading):
    for points in candidates(np.zeros((3, 2)), heading, path, limits, step, SPANS):
        assert Plan(0, step, points, heading).turn_in_place() <= limits.omega_max * (1 + 1e-6)


@settings(max_examples=60)
@given(st.floats(0.05, 0.9), st.floats(-3.1, 3.1))
def test_a_goal_within_reach_is_reached_exactly(distance, heading):
    goal = distance * np.array([np.cos(heading), np.sin(heading)])
    points = candidates(np.zeros((3, 2)), heading, Polyline(np.array([[0, 0], goal])),
                        Limits(1.0, 2.0, 5.0, 0.2), 0.25, SPANS)
    ends = np.linalg.norm(points[:, -1] - goal, axis=1)
    assert ends[0] == pytest.approx(0, abs=1e-6)
    assert keeps_turn_rate(points[0], 0.25, 5.0)


def test_a_goal_is_reached_exactly_from_speed_too():
    # 0.25 m a step is 1 m/s; 3 m ahead is far enough to brake.
    start = np.array([[-0.5, 0], [-0.25, 0], [0, 0]])
    points = candidates(start, 0.0, Polyline(np.array([[0, 0], [1.5, 0]])), Limits(1.0, 2.0, 5.0, 0.2), 0.25, SPANS)
    assert points[0, -1] == pytest.approx([1.5, 0], abs=1e-6)


def test_the_fastest_candidate_makes_good_use_of_its_time():
    points = candidates(np.zeros((3, 2)), 0.0, Polyline(np.array([[0, 0], [20.0, 0]])),
                        Limits(1.0, 2.0, 5.0, 0.2), 0.25, SPANS)
    # Two thirds of a second each to start and to stop leave over 2 m of the 3 s.
    assert points[0, -1, 0] > 1.9


def test_candidates_pass_an_obstacle_on_either_side():
    points = candidates(np.zeros((3, 2)), 0.0, Polyline(np.array([[0, 0], [8.0, 0]])),
                        Limits(1.0, 2.0, 5.0, 0.2), 0.25, 16)
    assert points[:, :, 1].min() < -0.6 and points[:, :, 1].max() > 0.6


def test_a_robot_that_cannot_turn_in_time_does_not_depart():
    points = candidates(np.zeros((3, 2)), np.pi, Polyline(np.array([[0, 0], [8.0, 0]])),
                        Limits(1.0, 2.0, 0.5, 0.2), 0.25, SPANS)
    assert not points[0].any()


@given(st.floats(-3.1, 3.1))
def test_the_bearing_is_the_direction_in_which_a_robot_at_rest_sets_out(direction):
    path = Polyline(np.array([[0, 0], [3 * np.cos(direction), 3 * np.sin(direction)], [9.0, 0]]))
    assert bearing(np.zeros(2), path) == pytest.approx(direction, abs=1e-6)
    points = candidates(np.zeros((3, 2)), direction, path, Limits(1.0, 2.0, 5.0, 0.2), 0.25, SPANS)
    assert np.arctan2(*points[0, 4, ::-1]) == pytest.approx(direction, abs=1e-6)


def test_what_remains_is_measured_along_the_path():
    path = Polyline(np.array([[0.0, 0], [2, 0], [2, 2]]))
    assert remaining(np.array([[[0.0, 0], [2, 0], [2, 2], [1, 0.4]]]), path) == pytest.approx(
        np.array([[4, 2, 0, 3.2]]))
