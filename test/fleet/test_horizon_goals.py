"""Robots that plan by the receding horizon while goals, the world and the mission's pace change under way."""
from dataclasses import replace

import numpy as np
import pytest
from missions import ROOM, exchange, mission, robot, stepped

from mobile_planning import InvalidInput, RoundObstacle
from mobile_planning.errors import GoalOccupied, GoalOutside
from mobile_planning.fleet import plan_pairs
from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.errands import GoalQueues
from mobile_planning.fleet.hold_up import Reason
from mobile_planning.fleet.itinerary import How
from mobile_planning.fleet.message import Death, Mode
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.fleet.verification import verify
from mobile_planning.fleet.world_sim import body_of
from mobile_planning.world.environment import Environment

HORIZON = {'method': 'receding_horizon', 'Tc': 0.5, 'Tp': 2.0}
CYCLE = 0.125


def alone(start=(1, 3, 0.0), goal=(6, 3, 0.0)):
    """Return a robot on its own, under way from 0 s on."""
    one = robot(1, start, goal, **HORIZON)
    one.start([1], 0.0)
    return one


def drive(one, begin, end):
    for now in np.arange(begin, end, CYCLE):
        one.step(now + 0.002)


def faults(one, goals, obstacles=()):
    """Return what the verifier finds wrong with all that ``one`` drove, by way of ``goals``."""
    body = replace(body_of(one), via=tuple(map(np.array, goals[:-1])), goal=np.array(goals[-1]))
    return verify({1: one.sol}, [body], Environment(ROOM, obstacles), 0.0).violations


@pytest.mark.parametrize('at', [1.3, 3.05, 30.0], ids=['under way', 'in its last section', 'once it has arrived'])
def test_another_goal_is_driven_to_from_wherever_the_robot_is(at):
    one, goal = alone(goal=(4, 3, 2.0)), (3.0, 5.0, -2.0)
    drive(one, 0.0, min(at, 8.0))
    assert one.is_done is (at > 8.0)
    one.set_goal(goal, at)
    assert not one.is_done and one.goal.tolist() == list(goal)
    drive(one, max(at, 0.0), at + 14.0)
    assert one.is_done and one.state(at + 14.0)[:3] == pytest.approx(goal, abs=0.021)
    assert faults(one, [goal]) == []


def test_what_is_kept_of_a_long_drive_has_a_bound_and_the_robot_drives_on():
    one = alone(goal=(4, 3, 0.0))
    for now in np.arange(0.0, 8.0, CYCLE):
        one.step(now + 0.002)
        one.forget(4)
        assert len(one.sol.plans) <= 4 and len(one.sections) == len(one.ctime) <= 4
    assert one.is_done and one.sol.plans[0].first_knot > 0 and one.sections


@pytest.mark.parametrize('goal, error', [((20, 3, 0), GoalOutside), ((0.1, 3, 0), GoalOccupied), ((1, 2), InvalidInput),
                                         ((np.nan, 1, 0), InvalidInput)])
def test_a_goal_that_cannot_be_is_refused_and_the_old_one_stands(goal, error):
    one = alone()
    drive(one, 0.0, 1.0)
    before, plans = one.goal, one.sol.plans
    for call in (one.require_goal, lambda goal: one.set_goal(goal, 1.0)):
        with pytest.raises(error):
            call(goal)
    assert np.array_equal(one.goal, before) and one.sol.plans == plans
    drive(one, 1.0, 9.0)
    assert one.is_done


def test_a_path_and_a_joint_plan_are_refused_with_a_sentence():
    one = alone()
    before = one.goal
    with pytest.raises(InvalidInput, match='takes goals only and no path'):
        one.follow_path([(1, 3, 0), (5, 3, 0)], 0.0)
    with pytest.raises(InvalidInput, match='no joint plans'):
        one.propose(object(), 0.0)
    assert np.array_equal(one.goal, before) and one.propose(None, 0.0) == [] and one.take_request() is None


def test_a_paused_robot_rests_where_its_section_ends_and_drives_on_when_it_may():
    one = alone()
    drive(one, 0.0, 1.6)
    one.pause(1.6)
    plans = one.sol.plans
    drive(one, 1.625, 6.0)
    assert one.is_paused and one.mode is Mode.STOPPED and one.sol.plans == plans
    assert one.state(6.0)[3] == pytest.approx(0.0, abs=1e-9) and one.held_up is None
    one.resume(6.0)
    drive(one, 6.0, 16.0)
    assert one.is_done and not one.is_paused and faults(one, [(6, 3, 0.0)]) == []


def test_each_plan_has_its_commit_in_time_for_its_first_knot():
    one = alone()
    drive(one, 0.0, 8.0)
    solution = one.sol
    assert len(solution.commits) == len(solution.plans) > 3 and np.isnan(solution.commits[0])
    for plan, commit in zip(solution.plans[1:], solution.commits[1:]):
        assert plan.first_knot * plan.step - HORIZON['Tc'] <= commit < plan.first_knot * plan.step


def test_in_a_world_that_is_as_it_was_nothing_troubles_a_robot():
    one = alone()
    for now in np.arange(0.0, 8.0, CYCLE):
        one.enter(one.environment, now)
        one.step(now + 0.002)
        assert one.world_trouble == ''
    assert one.is_done


def test_what_comes_to_stand_ahead_is_driven_around():
    one, obstacle = alone(goal=(8, 3, 0.0)), RoundObstacle((6.0, 3.05), 0.4)
    drive(one, 0.0, 2.0)
    one.enter(Environment(ROOM, [obstacle]), 2.0)
    assert one.world_trouble == ''
    drive(one, 2.0, 20.0)
    assert one.is_done and faults(one, [(8, 3, 0.0)], [obstacle]) == []


def test_what_comes_to_stand_on_its_section_is_said():
    one = alone(goal=(8, 3, 0.0))
    drive(one, 0.0, 2.0)
    obstacle = RoundObstacle(one.plan.end + (0.0, 0.05), 0.2)
    one.enter(Environment(ROOM, [obstacle]), 2.0)
    assert one.world_trouble == 'the plan in force leads into what is occupied by now'
    one.enter(Environment(ROOM), 2.0)
    assert one.world_trouble == ''


@pytest.mark.parametrize('when, ahead', [(2.6, 0.8), (3.1, 1.1)])
def test_who_is_to_run_into_something_brakes_before_it_and_then_drives_around_it(when, ahead):
    one = alone(goal=(8, 3, 0.0))
    drive(one, 0.0, when)
    here = one.state(when)[:2]
    obstacle = RoundObstacle(here + (ahead + 0.1, 0.02), 0.1)
    one.enter(Environment(ROOM, [obstacle]), when)
    is_said, slowest = one.world_trouble != '', 1.0
    for now in np.arange(when, 20.0, CYCLE):
        one.step(now + 0.002)
        states = np.array([one.state(time) for time in np.linspace(now, now + CYCLE, 12)])
        assert min(obstacle.pt_2_obst(state[:2], one.rho) for state in states) >= 0.0
        slowest = min(slowest, states[0, 3])
    assert is_said and slowest < 0.5 and one.is_done and one.world_trouble == '' and one.broken == ()


def test_who_comes_too_late_brakes_as_hard_as_it_can_and_says_so():
    one = alone(goal=(8, 3, 0.0))
    drive(one, 0.0, 3.0)
    obstacle = RoundObstacle(one.state(3.0)[:2] + (0.35, 0.0), 0.1)
    one.enter(Environment(ROOM, [obstacle]), 3.0)
    (message,) = one.step(3.002)
    plan = one.sol.plans[-1]
    assert plan.first_knot * plan.step < 3.0 + HORIZON['Tc'] and message.plan_seq == one.protocol.in_force.number
    assert np.linalg.norm(plan.end - one.state(plan.first_knot * plan.step)[:2]) < 0.4
    assert one.world_trouble == 'the plan in force leads into what is occupied by now'
    assert [fault for fault in faults(one, [(8, 3, 0.0)]) if 'arrive' not in fault] == []


def test_who_brakes_names_those_that_its_brake_is_not_clear_of_and_they_hear_of_it():
    ahead, behind = robot(1, (3, 3, 0.0), (9, 3, 0.0), **HORIZON), robot(2, (2, 3, 0.0), (8, 3, 0.0), **HORIZON)
    for one in (ahead, behind):
        one.start([1, 2], 0.0)
    for now, one, _ in exchange([ahead, behind], 3.0, since=0.002, step=CYCLE):
        pass
    ahead.enter(Environment(ROOM, [RoundObstacle(ahead.plan.end + (0.0, 0.05), 0.2)]), 3.0)
    (message,) = ahead.step(3.01)
    behind.receive(message, 3.02)
    (theirs,) = behind.protocol.peers[1].plans.values()
    assert np.array_equal(theirs.end, ahead.plan.end)
    is_clear = plan_pairs.stay_apart(ahead.plan, behind.plan, 24, 2 * ahead.limits.radius)
    assert ahead.broken == (() if is_clear else (2,))


def test_a_goal_that_is_covered_is_said_until_it_is_free_again():
    one = alone()
    drive(one, 0.0, 1.0)
    one.enter(Environment(ROOM, [RoundObstacle((6.0, 3.0), 0.3)]), 1.0)
    assert 'goal (6.000, 3.000) of robot 1' in one.world_trouble
    drive(one, 1.0, 2.0)
    one.enter(Environment(ROOM), 2.0)
    assert one.world_trouble == ''
    drive(one, 2.0, 11.0)
    assert one.is_done


def test_who_does_not_answer_is_named_as_long_as_he_is_waited_for():
    one = robot(1, (1, 3, 0.0), (6, 3, 0.0), **HORIZON)
    one.start([1, 2], 0.0)
    drive(one, 0.0, 3.0)
    assert one.held_up.reason is Reason.STALLED and one.held_up.for_robots == (2,)
    one.receive(Death(2, 1, (9.0, 5.0), 3.0, 0.2), 3.0)
    drive(one, 3.0, 4.0)
    assert one.held_up is None


def test_a_mission_of_several_goals_is_driven_by_each_of_them_in_turn():
    starts = [((1, 1, 0.0), (4, 1, 0.0)), ((1, 4, 0.0), (4, 4, 0.0))]
    simulation = mission([robot(index + 1, *poses, **HORIZON) for index, poses in enumerate(starts)])
    report = simulation.run(timeout=40.0, errands=GoalQueues({1: [(4, 4.0, 1.57)], 2: [(1, 1, 0.0)]}))
    assert report.valid, report.table()
    assert [len(body.via) for body in simulation.bodies] == [1, 1]


def test_one_that_does_not_arrive_is_reported_with_the_rest():
    simulation = mission([robot(1, (1, 3, 0.0), (9, 3, 0.0), **HORIZON)])
    (waiting,) = simulation.run(timeout=2.0).waiting
    assert waiting.robot == 1 and waiting.mode == 'driving'


def test_an_agent_is_given_goals_paused_and_hands_over_each_section_before_it_is_told():
    specs = RobotSpec(1, (1, 1, 0), (4, 1, 0)), RobotSpec(2, (1, 3, 0), (4, 3, 0))
    scene = Scene('m', specs, boundary=ROOM, method='receding_horizon', horizon={'Tc': 0.5, 'Tp': 2.0, 'Td': 2.0})
    driven = {1: [], 2: []}
    agents = [Agent(scene, spec.id, 5, 0.0, drive=driven[spec.id].append) for spec in specs]
    for one in agents:
        one.follow(Announcement('m', State.STARTED, (1, 2), 1.0), 0.0)
    agents[0].set_goals([(3, 1, 0), (3, 2, 0)], How.REPLACE, 0.0)
    with pytest.raises(InvalidInput, match='no path'):
        agents[0].follow_path([(1, 1, 0), (3, 1, 0)], 0.0)
    agents[1].hold('test', 'held', 0.5)

    def say(messages, now):
        for message in messages:
            assert all(one.robot.sol.plans[-1] is driven[one.robot_id][-1].plan for one in agents
                       if one.robot_id == message.robot_id)
            for each in agents:
                each.receive(message, now)
    for now in np.arange(0.002, 24.0, CYCLE):
        for one in agents:
            say(stepped(one, now), now)
        for one in agents:
            say(one.answers(now) if one.has_answers else [], now)
        if now < 6.0:
            assert len(driven[2]) == 1
        elif agents[1].trouble:
            agents[1].release('test', now)
    assert all(one.is_finished for one in agents) and agents[0].journey.itinerary.reached == 2
    assert agents[0].robot.goal.tolist() == [3, 2, 0]
    assert [len(driven[one.robot_id]) for one in agents] == [len(one.robot.sol.plans) for one in agents]
