"""The judge: what is wrong with the motion of a robot, forwards and backwards."""
from dataclasses import replace

import numpy as np
import pytest
from judged_drives import LENGTH, STEPS, TC, drive, is_caught, judged

from mobile_planning import Environment
from mobile_planning.fleet.bspline import Plan


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
