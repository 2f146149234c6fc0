"""The judge: plans bind from their commit on, whether they are driven or not."""
from dataclasses import replace

import numpy as np
import pytest
from judged_drives import ALONG, HALL, LENGTH, TC, WORLD, body, braking, drive, is_caught, judged

from mobile_planning import Environment, PolygonObstacle, verify
from mobile_planning.fleet import scenarios
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution


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
