"""Collisions: where bodies are, against scipy, and where they overlap."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from staged import STEP, drive, plan_through, rest, vehicle

from mobile_planning.fleet.collisions import collisions, positions

coordinates = st.floats(-5, 5)


@given(st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=6), st.integers(-3, 3))
def test_positions_are_scipy_s(places, first_knot):
    plan = plan_through((0, 0), *places, first_knot=first_knot)
    times = np.linspace(first_knot * STEP, plan.end_knot * STEP, 50)
    spline = BSpline(np.arange(len(plan.points) + 4) - 3.0, plan.points, 3)
    # A plan of Bezier points is the same curve.
    assert positions([plan], times) == pytest.approx(spline(times / STEP - first_knot), abs=1e-9)


def test_a_body_drives_each_plan_until_the_next_one_begins():
    plans = [drive((0, 0), (4, 0)), rest((7, 7), first_knot=4), rest((9, 9), first_knot=6)]
    driven = positions(plans, np.array([0.0, 0.99, 1.0, 1.49, 1.5, 99.0]))
    assert driven[0] == pytest.approx((0, 0)) and 0 < driven[1, 0] < 2
    assert driven[2:].tolist() == [[7, 7], [7, 7], [9, 9], [9, 9]]


def test_bodies_that_overlap_are_named_with_the_first_time():
    pair = vehicle(1, drive((0, 0), (4, 0), 16)), vehicle(2, drive((4, 0), (0, 0), 16))
    least, (breach,) = collisions(pair, 6.0)
    assert least < 0.1 and breach.robots == (1, 2) and breach.what.startswith('they collide')
    apart = np.hypot(*(positions([pair[0].robot.plan], np.array([breach.time]))
                       - positions([pair[1].robot.plan], np.array([breach.time])))[0])
    assert 0.3 < apart < 0.39


def test_clocks_that_are_off_make_a_collision_of_plans_that_miss():
    follower = vehicle(2, drive((-1, 0), (3, 0), 16))
    ahead = vehicle(1, drive((0, 0), (4, 0), 16))
    assert not collisions((ahead, follower), 9.0)[1]
    follower.clock = lambda now: now + 2.0
    assert collisions((ahead, follower), 9.0)[1]


def test_a_robot_alone_is_far_from_everybody():
    assert collisions((vehicle(1, rest((0, 0))),), 1.0) == (np.inf, [])
