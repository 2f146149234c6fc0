"""Errands: several goals one after the other, given in advance or drawn at each arrival."""
from dataclasses import replace

import numpy as np
import pytest
from missions import ROOM, SWAP, mission, robot
from mobile_planning import Boundary, InvalidInput, RoundObstacle
from mobile_planning.fleet.errands import EndlessErrands, GoalQueues
from mobile_planning.fleet.faults import Faults, Kill
from mobile_planning.fleet.makespan import lower_bound
from mobile_planning.fleet.verification import verify
from mobile_planning.world.environment import Environment

PILLAR = RoundObstacle((5, 3), 0.5)
#: Robot 1 drives around the room, robot 2 there and back.
ROUNDS = {1: [(9, 1, 1.5), (9, 5, -3.0), (1, 3, 0.5)], 2: [(9, 3, 0.0)]}


def rounds(goals=ROUNDS, **run):
    simulation = mission([robot(index + 1, *poses, obstacles=[PILLAR]) for index, poses in enumerate(SWAP)], [PILLAR])
    return simulation, simulation.run(errands=GoalQueues(goals), timeout=90.0, **run)


def endless(seed, until=25.0):
    robots = [robot(index + 1, *poses, obstacles=[PILLAR]) for index, poses in enumerate(SWAP)]
    simulation = mission(robots, [PILLAR])
    radii = {each.eyed: each.limits.radius for each in robots}
    return simulation, simulation.run(seed, errands=EndlessErrands(simulation.environment, radii, until, seed),
                                      timeout=90.0)


def test_robots_drive_to_all_their_goals_in_order():
    simulation, report = rounds()
    assert report.valid and report.arrived == 2 and report.goals == report.arrivals == 6, report.table()
    assert [[goal.tolist() for goal in body.goals] for body in simulation.bodies] == [
        [[9, 3, 0], *map(list, ROUNDS[1])], [[1, 3, pytest.approx(np.pi)], [9, 3, 0]]]
    # Each goal is a place where the robot stands for a while, by samples of what it drove.
    for body in simulation.bodies:
        solution, since = simulation.solutions[body.eyed], 0
        states = solution.states(solution.t)
        for x, y, theta in body.goals:
            turn = np.abs((states[:, 2] - theta + np.pi) % (2 * np.pi) - np.pi)
            near = np.hypot(states[:, 0] - x, states[:, 1] - y) < 0.05
            there = near & (turn < 0.05) & (np.abs(states[:, 3]) < 1e-6)
            assert there[since:].any()
            since += int(there[since:].argmax())
    assert report.throughput == pytest.approx(60 * 6 / report.mission_time, rel=0.05)
    assert 'goals                   6 of 6 reached' in report.table()


def judged(simulation, eyed, **changes):
    bodies = [replace(body, **changes) if body.eyed == eyed else body for body in simulation.bodies]
    return verify(simulation.solutions, bodies, simulation.environment)


def test_the_judge_counts_a_goal_only_when_it_was_reached_after_those_before_it():
    simulation, report = rounds()
    first, second, third, last = simulation.bodies[0].goals
    assert judged(simulation, 1).arrivals == report.arrivals == 6
    for via, arrivals in (((second, first, third), 3), ((first, third, second), 4),
                          ((first, second, third, np.array([5.0, 5.0, 0.0])), 5),
                          # It drives past the pillar there, and does not stop.
                          ((np.array([5.0, 1.0, 0.0]),), 2), ((first + (0, 0, 0.2), second, third), 2),
                          ((first + (0.1, 0, 0), second, third), 2)):
        wrong = judged(simulation, 1, via=via)
        assert wrong.arrivals == arrivals and wrong.violations == []
        assert not wrong.valid and wrong.arrived == 1
    assert judged(simulation, 1, via=(third,)).valid and judged(simulation, 1, via=(third,)).arrivals == 4
    # A goal that was reached in time, and left for another one that was not, is no arrival in the end.
    assert judged(simulation, 1, via=(first,), goal=second).arrived == 1


def test_what_a_robot_leaves_undone_is_told():
    simulation, report = rounds(faults=Faults(kills=(Kill(1, 12.0, is_certified=True),)))
    assert not report.valid and report.violations == [] and report.arrived == 1 and report.dead == 1
    assert report.arrivals < report.goals


def test_a_goal_that_is_refused_is_told_and_the_robot_stays():
    simulation, report = rounds({1: [(5, 3, 0.0), (9, 1, 0.0)]})
    assert not report.valid and any('goal (5.000, 3.000) of robot 1' in said for said in report.violations)
    assert report.arrived == 1


def test_the_lower_bound_adds_up_the_legs():
    body = mission([robot(1, *SWAP[0])]).bodies[0]
    there_and_back = replace(body, via=(body.goal,), goal=body.start)
    assert lower_bound([there_and_back], Environment(ROOM)) == pytest.approx(2 * lower_bound([body], Environment(ROOM)))


@pytest.fixture(scope='module')
def third():
    """Return the endless mission of seed 3 and its report, to look at."""
    return endless(3)


def test_an_endless_mission_gives_new_goals_until_its_time_is_over_and_all_arrive(third):
    simulation, report = third
    assert report.valid and report.goals == report.arrivals > 4, report.table()
    assert report.mission_time > 25.0 and report.throughput > 10.0
    for body in simulation.bodies:
        assert simulation.environment.clearance([goal[:2] for goal in body.goals]).min() >= 0.2
        trips = np.linalg.norm(np.diff([goal[:2] for goal in body.goals[1:]], axis=0), axis=1)
        assert trips.min(initial=4.0) >= 4.0 - 1e-9


def test_one_seed_gives_one_endless_mission_and_another_seed_another(third):
    goals = [[goal.tolist() for body in simulation.bodies for goal in body.goals]
             for simulation, _ in (third, endless(3), endless(2))]
    assert goals[0] == goals[1] != goals[2]


def test_a_drawn_goal_is_away_from_all_that_is_taken():
    errands = EndlessErrands(Environment(ROOM, [PILLAR]), {1: 0.205, 2: 0.205}, 100.0, seed=4)
    taken = [((2.0, 2.0), 0.205), ((8.0, 4.0), 0.4)]
    goals = np.array([errands.next_goal(1, float(now), taken) for now in range(100)])
    for place, radius in taken:
        assert np.linalg.norm(goals[:, :2] - place, axis=1).min() >= 0.205 + radius + 0.3
    assert np.linalg.norm(np.diff(goals[:, :2], axis=0), axis=1).min() >= 4.0
    assert errands.next_goal(1, 100.0, []) is None


def test_where_all_is_taken_nobody_is_sent_on():
    errands = EndlessErrands(Environment(Boundary((0, 1), (0, 1))), {1: 0.2}, 100.0)
    assert errands.next_goal(1, 0.0, [((0.5, 0.5), 1.0)]) is None and errands.next_goal(1, 0.0, []) is not None


@pytest.mark.parametrize('options', [{'until': -1.0}, {'until': np.inf}, {'until': np.nan}, {'seed': -1},
                                     {'trip': np.nan}, {'trip': -1.0}, {'radii': {1: 3.0}}])
def test_errands_out_of_their_range_are_refused(options):
    with pytest.raises(InvalidInput):
        EndlessErrands(Environment(ROOM), **{'radii': {1: 0.2}, 'until': 10.0, **options})
