"""Where one robot drives, goal after goal, through all its processes."""
from itertools import product

import numpy as np
import pytest
from agents import FREE, agent, drive, restarted, scene
from missions import stepped

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.goal_request import GoalRequest
from mobile_planning.fleet.itinerary import How
from mobile_planning.fleet.logbook import Logbook
from mobile_planning.fleet.report import Body
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.fleet.verification import verify
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import RoundObstacle


def test_goals_before_there_is_a_robot_are_refused():
    one = agent(1)
    with pytest.raises(InvalidInput, match='waiting for the map'):
        one.set_goals([(2, 2, 0)], How.REPLACE, 0.0)
    one.take_map(FREE, 0.0)
    one.set_goals([(2, 2, 0)], How.REPLACE, 0.0)
    assert one.robot.goal.tolist() == [2, 2, 0]


def at_the_first_of_two_goals():
    """Return an agent that has just asked for the way to its second goal, the request, and the time."""
    one = agent(1, False)
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    one.set_goals([(2, 2, 0), (3, 2, 0)], How.REPLACE, 0.0)
    for now in np.arange(0.0, 30.0, 0.25):
        one.step(lambda: now)
        request = one.take_request()
        if isinstance(request, GoalRequest):
            return one, request, now
    raise AssertionError('it never asked')


def test_while_the_way_to_the_next_goal_is_made_the_robot_goes_on_and_is_not_finished():
    one, request, now = at_the_first_of_two_goals()
    assert one.take_request() is None and not one.is_finished and one.journey.itinerary.reached == 1
    assert len(one.step(lambda: now + 0.25)) == 1 and one.robot.goal[:2].tolist() == [2, 2]
    one.propose(request.plan(), now + 0.5)
    assert one.robot.goal[:2].tolist() == [3, 2] and one.distance_left(now + 0.5) == pytest.approx(1.0, abs=0.03)
    for later in np.arange(now + 0.5, now + 10.0, 0.25):
        stepped(one, later)
    assert one.is_finished and one.journey.itinerary.reached == 2


def test_a_goal_given_meanwhile_is_driven_to_and_the_way_to_the_other_is_forgotten():
    one, request, now = at_the_first_of_two_goals()
    one.set_goals([(1, 3, 0)], How.REPLACE, now)
    one.propose(request.plan(), now + 0.25)
    assert one.robot.goal[:2].tolist() == [1, 3] and one.take_request() is None


@pytest.mark.parametrize('is_made_before', [True, False])
def test_a_goal_that_is_occupied_by_the_time_its_way_is_made_is_left_out(is_made_before):
    one, request, now = at_the_first_of_two_goals()
    answer = request.plan() if is_made_before else None
    one.take_obstacles([RoundObstacle((3, 2), 0.3)], now)
    one.propose(answer or request.plan(), now + 0.25)
    assert one.robot.goal[:2].tolist() == [2, 2] and 'a goal is left out: goal (3.000, 2.000)' in one.trouble
    one.step(lambda: now + 0.5)
    assert one.is_finished


def test_whoever_gets_no_answer_asks_for_the_way_again_and_the_first_answer_counts():
    one, first, now = at_the_first_of_two_goals()
    asked = [(later, request) for later in np.arange(now + 0.25, now + 12.0, 0.25)
             if one.step(lambda: later) and (request := one.take_request()) is not None]
    assert len(asked) == 2 and all(request.goal is first.goal for _, request in asked)
    assert asked[1][0] - asked[0][0] > 3.0
    one.propose(first.plan(), now + 12.0)
    one.propose(asked[0][1].plan(), now + 12.0)
    drive([one], now + 12.0, now + 22.0)
    assert one.is_finished and one.journey.itinerary.reached == 2 and not one.trouble


def test_goals_are_driven_to_one_after_the_other_and_more_may_come():
    one = agent(1, False)
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    one.set_goals([(2, 2, 0), (3, 2, 0)], How.REPLACE, 0.0)
    one.set_goals([(3, 3, 0)], How.APPEND, 0.0)
    stops = []
    for now in np.arange(0.0, 30.0, 0.25):
        stepped(one, now)
        stops.append(tuple(one.robot.goal[:2].tolist()))
    assert list(dict.fromkeys(stops)) == [(2, 2), (3, 2), (3, 3)]
    assert one.is_finished and one.journey.itinerary.reached == 3
    one.set_goals([(1, 1, 0)], How.APPEND, 30.0)
    assert not one.is_finished
    drive([one], 30.0, 45.0)
    assert one.is_finished and one.journey.itinerary.reached == 4
    assert one.robot.state(45.0)[:2] == pytest.approx((1, 1), abs=0.03)


def test_goals_may_be_driven_to_over_and_over_while_the_oldest_plans_are_left_out():
    driven = []
    one = Agent(scene(False), 1, 5, 0.0, drive=lambda entry: driven.append(entry.plan), plans_kept=20)
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    one.set_goals([(1.5, 1, 0), (1, 1, 0)], How.REPEAT, 0.0)
    drive([one], 0.0, 40.0)
    assert one.journey.itinerary.reached > 5 and not one.is_finished
    # Each was driven once, and what is kept is the newest.
    kept = one.solution.plans
    assert 10 <= len(kept) <= 20 < 40 < len(driven) == len({id(plan) for plan in driven})
    assert all(old is new for old, new in zip(kept, driven[-len(kept):])) and one.step(lambda: 40.0)[0].plan_seq > 40
    goals, before = one.solution.goals, one.solution.reached_before
    assert 0 < before < one.journey.itinerary.reached == len(goals) - 1
    assert all(np.allclose(goal[:2], (1.5, 1) if index % 2 == 0 else (1, 1)) for index, goal in enumerate(goals))
    one.set_goals([(1.5, 1.5, 0)], How.REPLACE, 40.0)
    drive([one], 40.0, 50.0)
    assert one.is_finished


@pytest.mark.parametrize('moved, is_where_left', [(0.0, True), (0.04, True), (0.06, False)])
def test_it_tells_whether_its_body_is_where_the_process_before_has_left_it(tmp_path, moved, is_where_left):
    book = tmp_path / 'book'
    one = Agent(scene(False), 1, 5, 0.0, book=Logbook(book))
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    drive([one], 0.0, 1.0)
    assert not one.postscript.is_where_left
    two, now = restarted(book, 0.0, moved=moved)
    two.step(lambda: now)
    assert two.postscript.is_where_left is is_where_left


@pytest.mark.parametrize('is_of_scene', [True, False])
def test_a_list_of_goals_goes_on_at_the_goal_that_the_process_before_was_at(tmp_path, is_of_scene):
    stops, room = ((1.5, 1, 0), (1.5, 4.5, 0), (1, 4.5, 0)), Boundary((0, 5), (0, 5))
    spec = RobotSpec(1, (1, 1, 0), stops[-1], via=stops[:-1]) if is_of_scene else RobotSpec(1, (1, 1, 0), (3, 3, 0))
    listed, book = Scene('m', (spec,), boundary=room, on_map=False), tmp_path / 'book'
    one = Agent(listed, 1, 5, 0.0, book=Logbook(book))
    one.follow(Announcement('m', State.STARTED, (1,), 1.0), 0.0)
    if not is_of_scene:
        one.set_goals(stops, How.REPLACE, 0.0)
    now = 1.0
    while one.journey.itinerary.reached == 0 or one.robot.state(now)[3] == 0.0:
        drive([one], now, now + 0.25)
        now += 0.25
    with book.open('a') as file:
        file.write('{"stage": {"mission_start": 1.0, "goal": [')
    for epoch in 6, 7:
        two, now = restarted(book, 1.0, epoch, listed)
        assert two.robot.goal.tolist() == list(stops[1]) and two.journey.itinerary.reached == 1
        drive([two], now, now + 0.75)
    drive([two], now + 0.75, now + 30.0)
    told = two.solution
    assert two.is_finished and two.robot.is_done and two.journey.itinerary.reached == 3 and told.reached_before == 0
    assert told.goals == () if is_of_scene else np.array_equal(told.goals, stops)
    assert told.plans[0].points[0].tolist() == [1, 1]
    body = Body(1, 0.2, np.array([1.0, 1, 0]), np.array(stops[2], float), 1, 5, 2, tuple(map(np.array, stops[:2])))
    report = verify({1: told}, [body], Environment(room), 1.0)
    assert report.valid and report.arrivals == 3, report.table()
    # A process that ends once it has arrived leaves nothing to drive to.
    three, now = restarted(book, 1.0, 8, listed)
    drive([three], now, now + 1.0)
    assert three.is_finished and three.robot.is_done and three.journey.itinerary.reached == 3
    # In another mission the goals are the scene's, from the first one on, and what was driven before is none of it.
    four, now = restarted(book, now + 50.0, 9, listed)
    assert four.robot.goal.tolist() == list((*spec.via, spec.goal)[0]) and four.journey.itinerary.reached == 0
    drive([four], now, now + 1.0)
    assert four.solution.plans[0].points[0] == pytest.approx(stops[2][:2], abs=0.03)


@pytest.mark.parametrize('how, goals', [
    *product(How, ([], [(2, 2, 0), (9, 9, 0)], [(2, 2)], [(np.nan, 2, 0)])), (How.REPLACE, [(2, 2, 0)] * 1002),
    (How.APPEND, [(2, 2, 0)] * 1001), (How.REPEAT, [(2, 2, 0)] * 1001)])
def test_goals_that_make_no_sense_leave_everything_as_it_was(how, goals):
    one = agent(1, False)
    with pytest.raises(PlanningError):
        one.set_goals(goals, how, 0.0)
    assert one.robot.goal.tolist() == [2, 1, 0] and one.journey.itinerary.left == 0 and one.journey.orders == 0


def test_a_goal_that_was_left_out_keeps_nobody_from_driving_on_after_a_pause():
    one = agent(1, False)
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    one.set_goals([(1.5, 1, 0), (3, 3, 0)], How.REPLACE, 0.0)
    one.take_obstacles([RoundObstacle((3, 3), 0.3)], 0.0)
    drive([one], 0.0, 5.0)
    assert 'a goal is left out' in one.trouble
    one.hold('service', 'paused by ~/pause', 5.0)
    one.release('service', 5.0)
    one.set_goals([(1, 1, 0)], How.REPLACE, 5.0)
    assert not one.robot.is_paused and one.trouble == ''
    drive([one], 5.0, 10.0)
    assert one.is_finished


def test_the_goals_of_a_scene_are_driven_to_in_turn():
    spec = RobotSpec(1, (1, 1, 0), (3, 1, 0), via=((2, 1, 0),))
    one = Agent(Scene('m', (spec,), boundary=Boundary((0, 4), (0, 4))), 1, 5, 0.0)
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    drive([one], 0.0, 12.0)
    assert one.is_finished and one.journey.itinerary.reached == 2
    assert one.robot.state(12.0)[:2] == pytest.approx((3, 1), abs=0.03)
