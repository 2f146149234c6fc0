"""A robot and its part in a mission, whatever comes first."""
import threading
from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from agents import FREE, agent, drive, scene
from joint_plans import WAYS, joint_plan

from mobile_planning.errors import GoalOccupied, InvalidInput, StartOccupied
from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.message import Contracts, Mode
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.world.environment import Boundary
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

WALL = OccupancyGrid(np.full((40, 40), 100, np.int8), 0.1)
WAITING, STARTED, STOPPED, PAUSED = (Announcement('m', state, (1, 2), 1.0) for state in State)


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
    # Who can hardly keep up plans once a cycle all the same.
    for took, period in ((0.1, 0.25), (0.01, cycle)):
        eight[0].note_pace(took)
        assert eight[0].robot.cycle == period


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
