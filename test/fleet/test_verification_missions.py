"""The judge: whole missions, as they were and broken by hand."""
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from judged_drives import drive, is_caught

from mobile_planning import verify
from mobile_planning.fleet import scenarios
from mobile_planning.fleet.faults import Faults, Join, Kill
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body


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
