"""A robot and its part in a mission, whatever comes first."""
import threading
from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest
from joint_plans import WAYS, joint_plan
from missions import stepped

from mobile_planning.errors import GoalOccupied, InvalidInput, PlanningError, StartOccupied
from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.goal_request import GoalRequest
from mobile_planning.fleet.itinerary import How
from mobile_planning.fleet.logbook import Logbook
from mobile_planning.fleet.message import Contracts, Mode
from mobile_planning.fleet.report import Body
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.fleet.verification import verify
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

FREE = OccupancyGrid(np.zeros((40, 40), np.int8), 0.1)
WALL = OccupancyGrid(np.full((40, 40), 100, np.int8), 0.1)
WAITING, STARTED, STOPPED, PAUSED = (Announcement('m', state, (1, 2), 1.0) for state in State)


def scene(on_map=True):
    """Return two robots that pass each other."""
    specs = RobotSpec(1, (1, 1, 0), (2, 1, 0)), RobotSpec(2, (2, 3, 0), (1, 3, 0))
    return Scene('m', specs, boundary=None if on_map else Boundary((0, 4), (0, 4)), on_map=on_map)


def agent(robot_id=1, on_map=True, epoch=5):
    """Return an agent switched on at 0 s."""
    return Agent(scene(on_map), robot_id, epoch, 0.0)


def drive(agents, begin, end):
    """Let the agents talk for a while, in logical time [s]; what falls due in between is said at once."""
    for now in np.arange(begin, end, 0.25):
        for sender in agents:
            messages = stepped(sender, now)
            while messages:
                for message in messages:
                    for each in agents:
                        each.receive(message, now)
                messages = [message for each in agents if each.has_answers for message in each.answers(now)]


def test_without_a_map_in_its_scene_it_exists_at_once():
    assert agent(on_map=False).robot is not None and agent(on_map=False).trouble == ''


def test_on_a_map_it_waits_for_it_and_is_silent():
    waiting = agent()
    assert waiting.robot is None and 'map' in waiting.trouble and waiting.step(lambda: 0.0) == []
    waiting.take_map(FREE, 0.0)
    assert waiting.trouble == '' and len(waiting.step(lambda: 0.0)) == 1


@pytest.mark.parametrize('order', list(permutations(['map', 'waiting', 'started'])))
def test_the_order_of_map_and_mission_does_not_matter(order):
    agents = agent(1), agent(2)
    if order.index('waiting') > order.index('started'):
        order = [what for what in order if what != 'waiting']
    for what in order:
        for one in agents:
            if what == 'map':
                one.take_map(FREE, 0.0)
            else:
                one.follow({'waiting': WAITING, 'started': STARTED}[what], 0.0)
    drive(agents, 0.0, 0.9)
    assert all(one.robot.mode is Mode.WAITING for one in agents)
    drive(agents, 1.0, 20.0)
    assert all(one.is_finished and one.robot.is_done for one in agents)


def test_a_place_in_a_wall_is_said_and_another_map_mends_it():
    unlucky = agent()
    with pytest.raises(StartOccupied):
        unlucky.take_map(WALL, 0.0)
    assert unlucky.robot is None and 'robot 1' in unlucky.trouble
    unlucky.take_map(FREE, 1.0)
    assert unlucky.robot is not None and unlucky.trouble == ''


def test_the_same_map_once_more_changes_nothing():
    one = agent()
    one.take_map(FREE, 0.0)
    robot = one.robot
    one.take_map(OccupancyGrid(FREE.data, 0.1), 5.0)
    assert one.robot is robot and one.epoch == 5


def test_another_map_before_the_mission_makes_another_robot_that_its_peers_believe():
    one, peer = agent(1), agent(2)
    for each in one, peer:
        each.take_map(FREE, 0.0)
        each.follow(WAITING, 0.0)
    drive([one, peer], 0.0, 5.0)
    one.take_map(OccupancyGrid(np.zeros((50, 40), np.int8), 0.1), 5.0)
    drive([one, peer], 5.0, 5.5)
    assert peer.robot.heard()[1].boot_epoch == one.epoch == 6


def test_a_map_that_changes_on_the_way_is_gone_by_and_so_are_obstacles():
    one = agent(1)
    one.take_map(FREE, 0.0)
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    robot = one.robot
    one.take_map(WALL, 0.5)
    drive([one], 0.5, 3.0)
    assert one.robot is robot and one.epoch == 5 and len(robot.sol.plans) == 1
    assert 'goal (2.000, 1.000)' in one.trouble
    one.take_map(FREE, 3.0)
    wall = PolygonObstacle([(1.5, 0.0), (1.6, 0.0), (1.6, 4.0), (1.5, 4.0)])
    one.take_obstacles([wall], 3.0)
    drive([one], 3.0, 6.0)
    assert not one.robot.is_done and 'no path' in one.trouble and wall.distance(one.robot.state(6.0)[:2]) > 0.2
    one.take_obstacles([], 6.0)
    drive([one], 6.0, 15.0)
    assert one.is_finished and one.trouble == ''


def test_obstacles_from_before_the_map_count():
    one = agent(1)
    one.take_obstacles([RoundObstacle((2, 1), 0.3)], 0.0)
    with pytest.raises(GoalOccupied):
        one.take_map(FREE, 0.0)


@pytest.mark.parametrize('announcement', [
    Announcement('m', State.WAITING, (1,)), Announcement('other', State.STARTED, (1,)),
    Announcement('other', State.STOPPED, (1, 2))])
def test_what_another_world_sim_announces_during_the_mission_is_refused(announcement):
    agents = agent(1, False), agent(2, False)
    for one in agents:
        one.follow(STARTED, 0.0)
    drive(agents, 1.0, 2.0)
    with pytest.raises(InvalidInput, match='mission m has started'):
        agents[0].follow(announcement, 0.0)
    drive(agents, 2.0, 20.0)
    assert agents[0].robot.is_done and 2 in agents[0].robot.heard()


def test_a_stop_between_the_announcement_and_the_start_holds():
    one = agent(1, False)
    one.follow(Announcement('m', State.STARTED, (1,), 1.0), 0.0)
    one.follow(Announcement('m', State.STOPPED, (1,), 1.0), 0.0)
    drive([one], 0.0, 5.0)
    assert one.is_finished and len(one.robot.sol.plans) == 1 and one.robot.mode is Mode.STOPPED


def test_a_stop_on_the_way_lets_it_come_to_rest():
    one = agent(1, False)
    one.follow(Announcement('m', State.STARTED, (1,), 1.0), 0.0)
    drive([one], 0.0, 1.6)
    one.follow(Announcement('m', State.STOPPED, (1,), 1.0), 0.0)
    plans = one.robot.sol.plans
    drive([one], 1.75, 10.0)
    assert one.is_finished and len(plans) > 1 and one.robot.sol.plans == plans
    assert one.robot.state(10.0)[3] == pytest.approx(0.0, abs=1e-9)


def test_a_mission_that_was_stopped_before_it_started_leaves_the_robot_free_for_another():
    one = agent(1, False)
    one.follow(Announcement('m', State.WAITING, (1,)), 0.0)
    one.follow(Announcement('m', State.STOPPED, (1,)), 0.0)
    assert not one.is_finished
    one.follow(Announcement('next', State.STARTED, (1,), 1.0), 0.0)
    drive([one], 1.0, 10.0)
    assert one.robot.is_done


def test_a_stop_that_came_before_the_map_is_not_forgotten():
    one = agent(1)
    one.follow(Announcement('m', State.STARTED, (1,), 1.0), 0.0)
    one.follow(Announcement('m', State.STOPPED, (1,), 1.0), 0.0)
    one.take_map(FREE, 2.0)
    drive([one], 2.0, 5.0)
    assert len(one.robot.sol.plans) == 1


def test_a_mission_of_others_is_not_driven():
    one = agent(1, False)
    one.follow(Announcement('m', State.STARTED, (2, 3), 0.0), 0.0)
    drive([one], 0.0, 5.0)
    assert one.robot.mode is Mode.WAITING and not one.is_finished


def test_of_two_processes_of_one_robot_the_younger_does_not_move_while_the_elder_speaks():
    elder, younger = agent(1, False, epoch=5), agent(1, False, epoch=6)
    for one in elder, younger:
        one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    for now in np.arange(0.0, 3.0, 0.25):
        for message in elder.step(lambda: now):
            elder.receive(message, now)
            with pytest.raises(InvalidInput, match='the older process speaks'):
                younger.receive(message, now)
        for message in younger.step(lambda: now):
            with pytest.raises(InvalidInput, match='the younger process is not to move'):
                elder.receive(message, now)
    assert len(younger.robot.sol.plans) == 1 and elder.robot.is_done
    drive([younger], 3.0, 10.0)
    assert younger.robot.is_done


def test_what_is_said_while_it_plans_is_heard_before_it_plans_again():
    one, peer = agent(1, False), agent(2, False)
    for each in one, peer:
        each.follow(WAITING, 0.0)
    (message,) = peer.step(lambda: 0.0)
    planning, heard = threading.Event(), threading.Event()

    def clock():
        planning.set()
        assert heard.wait(10.0)
        return 0.0

    planner = threading.Thread(target=one.step, args=(clock,))
    planner.start()
    assert planning.wait(10.0)
    one.receive(message, 0.0)
    assert not one.has_answers and one.answers(0.0) == [] and not one.robot.heard()
    heard.set()
    planner.join(10.0)
    one.step(lambda: 0.25)
    assert list(one.robot.heard()) == [2]


def test_messages_for_a_robot_that_plans_for_ever_do_not_pile_up_for_ever():
    one = agent(1, False)
    one.follow(WAITING, 0.0)
    (message,) = agent(2, False).step(lambda: 0.0)
    with one._turn:
        reader = threading.Thread(target=lambda: [one.receive(message, 0.0) for _ in range(10_000)])
        reader.start()
        reader.join(30.0)
        assert not reader.is_alive() and len(one._reception) < 5000


def test_each_plan_is_handed_over_to_be_driven_before_it_is_told():
    driven = []
    one = Agent(scene(False), 1, 5, 0.0, drive=lambda entry: driven.append(entry.plan))
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    for now in np.arange(0.0, 5.0, 0.25):
        (message,) = one.step(lambda: now)
        assert driven == list(one.robot.sol.plans) and message.plan.end == pytest.approx(driven[-1].end)
    assert one.robot.is_done


def test_a_pause_of_the_mission_holds_and_its_start_lets_go():
    one = agent(1, False)
    started, paused = (Announcement('m', state, (1,), 0.0) for state in (State.STARTED, State.PAUSED))
    one.follow(started, 0.0)
    drive([one], 0.0, 0.6)
    one.follow(paused, 0.6)
    drive([one], 0.75, 3.0)
    assert abs(one.robot.state(3.0)[3]) < 1e-6 and not one.robot.is_done and 'paused' in one.trouble
    assert not one.is_finished
    one.follow(started, 3.0)
    drive([one], 3.0, 10.0)
    assert one.robot.is_done and one.trouble == ''


def test_who_is_left_out_comes_to_rest_and_stays():
    both = agent(1, False), agent(2, False)
    for each in both:
        each.follow(STARTED, 0.0)
    drive(both, 0.0, 2.0)
    for each in both:
        each.follow(replace(STARTED, left_out=(1,)), 2.0)
    drive(both, 2.0, 8.0)
    stays = both[0].robot.state(8.0)
    for each in both:
        each.follow(replace(PAUSED, left_out=(1,)), 8.0)
        each.follow(replace(STARTED, left_out=(1,)), 8.0)
    drive(both, 8.0, 12.0)
    assert both[0].is_left_out and 'goes on without it' in both[0].trouble and not both[0].is_finished
    assert both[0].robot.state(12.0).tolist() == stays.tolist() and both[1].is_finished
    # A process that is started once more hears it with the mission.
    late = agent(1, False)
    late.follow(replace(STARTED, left_out=(1,)), 12.0)
    assert late.is_left_out


def test_a_robot_that_joins_a_paused_mission_waits_for_it_to_go_on():
    one = agent(1, False)
    one.follow(Announcement('m', State.PAUSED, (1,), 0.0), 0.0)
    drive([one], 0.0, 2.0)
    assert len(one.robot.sol.plans) == 1
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 2.0)
    drive([one], 2.0, 10.0)
    assert one.robot.is_done


def test_only_when_nothing_holds_it_any_more_it_drives_on():
    one = agent(1, False)
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    one.hold('pose', 'its pose is lost', 0.0)
    one.hold('service', 'paused by ~/pause', 0.0)
    one.release('pose', 0.0)
    one.release('nothing', 0.0)
    drive([one], 0.0, 3.0)
    assert len(one.robot.sol.plans) == 1 and one.trouble == 'paused by ~/pause'
    one.release('service', 3.0)
    drive([one], 3.0, 10.0)
    assert one.robot.is_done


def test_a_body_that_stands_elsewhere_is_driven_from_there():
    one = Agent(scene(), 1, 5, 0.0, is_placed=False)
    one.take_map(FREE, 0.0)
    assert one.robot is None and one.trouble == 'waiting for the pose'
    one.place((3.0, 3.0, 1.0), 0.0)
    assert one.robot.state(0.0)[:3] == pytest.approx((3.0, 3.0, 1.0))
    with pytest.raises(InvalidInput, match='has a place already'):
        one.place((1.0, 1.0, 0.0), 0.0)


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


def restarted(book, start, epoch=6, listed=scene(False), moved=0.0):
    """Return robot 1 started anew, when its body rests, in the mission of ``start``, and when that is.

    Somebody has ``moved`` it [m] meanwhile.
    """
    left = Logbook(book).read()[-1].plan
    now = left.end_knot * left.step + 1.0
    one = Agent(listed, 1, epoch, now, book=Logbook(book), is_placed=False)
    one.place(left.state(now)[:3] + np.array([moved, 0, 0]), now)
    one.follow(Announcement('m', State.STARTED, (1,), start), now)
    return one, now


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


@pytest.mark.parametrize('by_joint_plan, cycle, most', [(False, 0.25, 4), (True, 0.125, 8)])
def test_robots_of_one_fleet_do_not_all_plan_at_one_instant(by_joint_plan, cycle, most):
    ids = tuple(range(1, 9))
    specs = tuple(RobotSpec(eyed, (eyed, 1, 0), (eyed, 2, 0)) for eyed in ids)
    eight = [Agent(Scene('m', specs, boundary=Boundary((0, 9), (0, 4))), eyed, 5, 0.0) for eyed in ids]
    for each in eight:
        each.follow(Announcement('m', State.WAITING, ids), 0.0)
        if by_joint_plan:
            own = each.robot.eyed
            each.robot.propose(joint_plan(members=(own,), ways=WAYS[:1], needs=(((),),), proposer=own), 0.0)
    begins = sorted((10.0 + each.until_cycle(10.0)) % cycle for each in eight)
    assert min(np.diff([*begins, begins[0] + cycle])) >= 0.0119
    # And each of them just in time, or a little earlier, for a knot.
    late = [(each.robot.phase - 10.0 - each.until_cycle(10.0)) % 0.125 for each in eight]
    assert max(late) <= most * 0.012 + 1e-9


def test_a_section_that_was_planned_for_too_long_is_dropped():
    one = agent(1, False)
    one.follow(Announcement('m', State.STARTED, (1,), 0.0), 0.0)
    times = iter([1.0, 1.5])
    (message,) = one.step(lambda: next(times))
    assert len(one.robot.sol.plans) == 1 and message.plan.end == pytest.approx((1, 1))
    one.step(lambda: 1.5)
    assert len(one.robot.sol.plans) == 2


@pytest.mark.parametrize('now', [0.0, 0.1, 0.166, 0.169, 0.2, 1.8e9 + 0.17])
def test_the_next_cycle_is_at_the_preferred_phase_and_neither_at_once_nor_late(now):
    one = agent(1, False)
    wait = one.until_cycle(now)
    assert 0.125 <= wait < 0.375
    assert (now + wait - one.robot.phase + 0.1) % 0.25 == pytest.approx(0.1, abs=1e-5)


def test_what_is_agreed_between_two_steps_passes_through():
    agents = agent(1, False), agent(2, False)
    for one in agents:
        one.follow(Announcement('m', State.STARTED, (1, 2), 0.0), 0.0)
    owner, peer = agents
    for message in peer.step(lambda: 0.0):
        owner.receive(message, 0.0)
    assert owner.has_answers
    (offers,) = owner.answers(0.0)
    assert isinstance(offers, Contracts) and offers.offers[0].peer_id == 2
    # The peer believes no offer of somebody whom it has not heard.
    for message in *owner.step(lambda: 0.01), offers:
        peer.receive(message, 0.01)
    assert peer.has_answers and peer.answers(0.01)[0].answers[1].contract
    assert agent().answers(0.0) == [] and not agent().has_answers


def test_a_robot_that_the_scene_does_not_have_is_refused():
    with pytest.raises(InvalidInput, match='has the robots'):
        agent(9)
