"""A mission as the world sim sees it: gathering, start, end, and what is refused."""
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.message import Link, Mode, RobotMsg
from mobile_planning.fleet.mission import LEAD, PATIENCE, Mission
from mobile_planning.fleet.postscript import Postscript
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.fleet.solution import Solution
from mobile_planning.world.environment import Boundary

IDS = (1, 2, 3)
#: The common clock when the steady one shows 0 [s].
EPOCH = 1000.0


def said(robot_id, epoch=7, sequence=1, hears=IDS, mode=Mode.WAITING, peer_epoch=7, step=0.25):
    """Return what a robot says that hears these robots in this epoch."""
    return RobotMsg(False, [0.0], [0.0], [0.0, 0.0], robot_id=robot_id, boot_epoch=epoch, sequence=sequence, mode=mode,
                    plan=Plan.at_rest(0, step, (0, 0, 0)),
                    links={peer: Link(peer_epoch, 1, 0) for peer in hears if peer != robot_id})


def driven(robot_id, done=True, knot=int(EPOCH) * 4):
    """Return the solution of a robot that stood."""
    return Solution(robot_id, (Plan.at_rest(knot, 0.25, (0, 0, 0)),), done)


def gathered(now=0.0, **options):
    """Return a mission whose robots all say that they are there."""
    mission = Mission('m', IDS, 60.0, 10.0, **options)
    for robot_id in IDS:
        mission.hear(said(robot_id), now)
    return mission


def started():
    """Return a mission that has started."""
    mission = gathered()
    mission.step(0.0, EPOCH)
    assert mission.state is State.STARTED
    return mission


def test_it_starts_for_all_at_one_time_when_everybody_hears_everybody():
    mission = gathered()
    assert mission.announcement == Announcement('m', State.WAITING, IDS)
    mission.step(0.0, EPOCH)
    assert mission.announcement == Announcement('m', State.STARTED, IDS, EPOCH + LEAD)
    assert not mission.is_over(0.0)


@pytest.mark.parametrize('message, words', [
    (None, r'robots \[3\] are not there'),
    (said(3, hears=(1,)), r'robot 3 does not hear robots \[2\]'),
    (said(3, epoch=8), r'robot 1 does not hear robots \[3\]'),
    (said(3, peer_epoch=6), r'robot 3 does not hear robots \[1, 2\]'),
    (said(3, mode=Mode.DONE), r'robots \[3\] have had their mission')])
def test_what_keeps_it_from_starting_is_said_and_fails_it_in_the_end(message, words):
    mission = Mission('m', IDS, 60.0, 10.0)
    for now in range(10):
        for robot_id in 1, 2:
            mission.hear(said(robot_id, sequence=now), now)
        if message is not None:
            mission.hear(message, now)
            message = RobotMsg(**{**vars(message), 'sequence': message.sequence + 1})
        mission.step(now, EPOCH + now)
        assert mission.state is State.WAITING and not mission.is_over(now)
    assert re.search(words, mission.lack(9.0))
    mission.step(10.1, EPOCH)
    assert mission.is_over(10.1) and mission.why.startswith('after 10 s robot')
    assert mission.announcement.state is State.WAITING, 'nobody is told to stop whom it never started'


def test_a_robot_that_fell_silent_is_not_there_any_more():
    mission = gathered()
    mission.hear(said(1, sequence=2), 2.5)
    mission.hear(said(2, sequence=2), 2.5)
    assert mission.silent(2.5) == [3]
    mission.step(2.5, EPOCH)
    assert mission.state is State.WAITING
    mission.hear(said(3, sequence=2), 2.6)
    mission.step(2.6, EPOCH)
    assert mission.state is State.STARTED


def test_a_slow_cycle_is_not_silence():
    mission = Mission('m', (1,), 60.0)
    mission.hear(said(1, step=5.0), 0.0)
    assert mission.silent(19.0) == [] and mission.silent(21.0) == [1]


def test_without_autostart_it_waits_for_the_wish_and_only_then_for_the_robots():
    mission = gathered(autostart=False)
    mission.step(0.0, EPOCH)
    mission.step(1000.0, EPOCH)
    assert mission.state is State.WAITING and not mission.why
    mission.start(1000.0)
    mission.step(1009.0, EPOCH)
    assert not mission.why
    mission.step(1010.1, EPOCH)
    assert 'not there' in mission.why


@given(st.permutations([*IDS, *IDS]), st.lists(st.integers(1, 3), max_size=4))
def test_the_order_in_which_the_robots_come_does_not_matter(order, silent_first):
    mission = Mission('m', IDS, 60.0)
    for count, robot_id in enumerate([*silent_first, *order]):
        mission.hear(said(robot_id, sequence=count), 0.0)
    mission.step(0.0, EPOCH)
    assert mission.state is State.STARTED


def test_a_robot_restarted_before_the_start_takes_part_as_soon_as_it_is_heard():
    mission = gathered()
    mission.hear(said(3, epoch=8, sequence=1), 0.1)
    mission.hear(said(3, epoch=7, sequence=9), 0.2)
    mission.step(0.2, EPOCH)
    assert mission.state is State.WAITING
    for robot_id in 1, 2:
        message = said(robot_id, sequence=2)
        message.links[3] = Link(8, 1, 0)
        mission.hear(message, 0.3)
    mission.step(0.3, EPOCH)
    assert mission.state is State.STARTED


def test_a_robot_restarted_on_its_way_where_its_body_stands_takes_part_again():
    mission = started()
    mission.collect(driven(2), 7)
    mission.hear(said(2, epoch=8), 5.0)
    assert mission.state is State.STARTED and 2 not in mission.solutions
    mission.collect(driven(2), 7)
    assert 2 not in mission.solutions
    for robot_id, epoch in (1, 7), (2, 8), (3, 7):
        mission.collect(driven(robot_id), epoch)
    mission.step(6.0, EPOCH + 6)
    assert mission.is_complete and mission.is_over(6.0)


def test_a_robot_restarted_elsewhere_is_left_out_and_the_others_go_on():
    mission = started()
    message = said(2, epoch=8)
    mission.hear(replace(message, plan=Plan.at_rest(0, 0.25, (0.1, 0, 0))), 5.0)
    told = mission.announcement
    assert (told.state, told.robot_ids, told.left_out) == (State.STARTED, IDS, (2,))
    mission.collect(driven(2), 8)
    mission.collect(driven(1), 7)
    mission.step(6.0, EPOCH + 6)
    assert mission.state is State.STARTED and 2 not in mission.solutions
    mission.collect(driven(3), 7)
    mission.step(6.0, EPOCH + 6)
    assert mission.why == 'all robots are at their goals but those that were left out, [2]'
    scene = Scene('m', tuple(RobotSpec(robot_id, (0, 2 * robot_id, 0), (0, 2 * robot_id, 0)) for robot_id in IDS),
                  boundary=Boundary((-9, 9), (-9, 9)))
    report = mission.report(scene.bodies(), scene.environment())
    assert not report.valid and any('robot 2 was started anew at (0.10, 0.00), its last plan ended at (0.00, 0.00)'
                                    in sentence for sentence in report.violations)


def test_a_robot_restarted_where_its_last_plan_leads_takes_part_though_nobody_had_heard_of_that_plan():
    mission = started()
    message = replace(said(2, epoch=8), plan=Plan.at_rest(0, 0.25, (0.4, 0, 0)))
    mission.hear(message, 5.0, Postscript(is_where_left=True))
    assert mission.announcement.left_out == ()


def test_a_mission_whose_own_process_died_is_taken_up_where_its_robots_are():
    mission = Mission('m', IDS, 60.0, 10.0, now=30.0)
    for robot_id in IDS:
        mission.hear(said(robot_id, mode=Mode.DRIVING), 30.0, Postscript(EPOCH - 20.0))
        mission.step(30.0, EPOCH)
    assert mission.announcement == Announcement('m', State.STARTED, IDS, EPOCH - 20.0)
    for robot_id in IDS:
        mission.collect(driven(robot_id), 7)
    mission.step(31.0, EPOCH + 1)
    assert mission.is_complete


def test_who_was_left_out_says_so_to_a_process_that_takes_the_mission_up():
    mission = Mission('m', IDS, 60.0, 10.0)
    mission.hear(said(1, mode=Mode.DRIVING), 0.0, Postscript(EPOCH))
    left_out = Postscript(EPOCH, held_up=HoldUp(EPOCH, Reason.LEFT_OUT))
    for sequence in 1, 2:
        mission.hear(said(2, sequence=sequence), 0.0)
        mission.hear(said(3, epoch=8, sequence=sequence), 0.0, left_out)
        mission.collect(driven(3), 8)
    assert mission.announcement == Announcement('m', State.STARTED, IDS, EPOCH, (3,))
    for robot_id in 1, 2:
        mission.collect(driven(robot_id), 7)
    mission.step(1.0, EPOCH + 1)
    assert mission.state is State.STOPPED and 'those that were left out, [3]' in mission.why
    assert 3 not in mission.solutions


def test_robots_of_another_mission_are_not_taken_for_its_own():
    mission = Mission('m', IDS, 60.0, 10.0)
    mission.hear(said(1, hears=(1, 2), mode=Mode.DRIVING), 0.0, Postscript(EPOCH))
    assert mission.state is State.WAITING


def test_a_pause_is_told_to_all_and_only_those_who_drive_can_pause():
    mission = gathered()
    with pytest.raises(InvalidInput, match='waiting, not started'):
        mission.pause()
    mission.step(0.0, EPOCH)
    with pytest.raises(InvalidInput, match='started, not paused'):
        mission.resume()
    mission.pause()
    assert mission.announcement == Announcement('m', State.PAUSED, IDS, EPOCH + LEAD)
    mission.resume()
    assert mission.announcement.state is State.STARTED


def test_only_who_is_silent_long_enough_is_declared_dead_and_the_others_end_the_mission():
    mission = started()
    for robot_id, words in ((9, 'never heard'), (3, 'has spoken 4.0 s ago')):
        with pytest.raises(InvalidInput, match=words):
            mission.declare_dead(robot_id, None, 4.0, EPOCH + 4)
    death = mission.declare_dead(3, (1.0, 2.0), 6.0, EPOCH + 6)
    assert (death.boot_epoch, death.place.tolist(), death.issued) == (7, [1.0, 2.0], EPOCH + 6)
    assert mission.declare_dead(3, None, 7.0, EPOCH + 7).place.tolist() == [0.0, 0.0]
    for robot_id in 1, 2:
        mission.collect(driven(robot_id), 7)
    mission.step(8.0, EPOCH + 8)
    assert mission.state is State.STOPPED and not mission.is_complete and 'those that died, [3]' in mission.why


def test_a_robot_that_is_heard_again_is_dead_no_more():
    mission = started()
    mission.declare_dead(3, None, 6.0, EPOCH + 6)
    mission.hear(said(3, epoch=8), 7.0)
    assert not mission.deaths and mission.state is State.STARTED


def test_of_a_robot_that_died_on_its_way_the_report_says_so_and_blames_nobody_for_its_place():
    scene = Scene('m', tuple(RobotSpec(i, (i, 1, 0), (i, 3, 0)) for i in IDS), boundary=Boundary((0, 4), (0, 4)))
    simulation = scene.world_sim()
    simulation.run(start_time=EPOCH + LEAD)
    mission = started()
    for robot_id in 1, 2:
        mission.collect(simulation.solutions[robot_id], 7)
    mission.hear(replace(said(3, sequence=5), plan_seq=4), 1.0)
    mission.declare_dead(3, None, 7.0, EPOCH + 7)
    mission.step(7.0, EPOCH + 7)
    report = mission.report(scene.bodies(), scene.environment())
    assert not report.valid and (report.robots, report.arrived, report.dead) == (3, 2, 1)
    assert len(report.violations) == 2 and 'robot 3 has driven and never said what' in report.violations


def test_it_ends_when_all_are_at_their_goals():
    mission = started()
    for robot_id in IDS:
        mission.step(5.0, EPOCH + 5)
        assert mission.state is State.STARTED
        mission.collect(driven(robot_id), 7)
    mission.step(5.0, EPOCH + 5)
    assert mission.state is State.STOPPED and mission.is_over(5.0) and mission.is_complete


def test_it_ends_at_the_timeout_and_waits_a_little_for_the_solutions():
    mission = started()
    mission.collect(driven(1), 7)
    mission.step(60.0, EPOCH + 60)
    assert mission.state is State.STARTED
    mission.step(61.0, EPOCH + 61)
    assert mission.state is State.STOPPED and 'within 60 s' in mission.why and not mission.is_over(61.0)
    mission.collect(driven(2, done=False), 7)
    assert not mission.is_over(61.0) and mission.is_over(61.1 + PATIENCE)
    mission.collect(driven(3), 7)
    assert mission.is_over(61.0) and not mission.is_complete


def test_it_can_be_stopped_once():
    mission = started()
    mission.stop('enough', 3.0)
    assert mission.announcement.state is State.STOPPED and not mission.is_over(3.0)
    with pytest.raises(InvalidInput, match='over: enough'):
        mission.stop('again', 4.0)
    with pytest.raises(InvalidInput, match='started already'):
        mission.start(4.0)
    mission.step(1000.0, EPOCH + 1000)
    assert mission.why == 'enough'


def test_stopped_before_its_start_it_tells_the_robots_and_waits_for_nobody():
    mission = gathered()
    mission.stop('enough', 0.0)
    assert mission.announcement.state is State.STOPPED and mission.is_over(0.0)


def test_it_starts_only_once():
    with pytest.raises(InvalidInput, match='started already'):
        started().start(1.0)


def test_solutions_of_others_of_earlier_missions_and_of_restarted_robots_are_passed_over():
    mission = gathered()
    mission.collect(driven(1), 7)
    mission.step(0.0, EPOCH)
    mission.collect(driven(1), 6)
    mission.collect(driven(9), 7)
    assert not mission.solutions


def test_a_solution_without_an_end_is_refused():
    mission = started()
    with pytest.raises(InvalidInput, match='robot 1 says that it drives until'):
        mission.collect(driven(1, knot=2**40), 7)
    assert not mission.solutions


def test_the_days_that_a_robot_stood_and_waited_are_no_part_of_its_solution():
    mission = started()
    waited = Plan.at_rest(0, 0.25, (1.0, 2.0, 0.5))
    way = Plan(4010, 0.25, [[1, 2], [1, 2], [1, 2], [1.2, 2], [1.4, 2], [1.4, 2], [1.4, 2]], 0.5)
    mission.collect(Solution(1, (waited, way)), 7)
    kept = mission.solutions[1]
    assert kept.t[0] == 0 and kept.start_time == EPOCH + LEAD and len(kept.t) < 1000
    assert kept.states(np.array([EPOCH + LEAD]))[0] == pytest.approx([1, 2, 0.5, 0, 0])
    assert kept.plans[1:] == (way,)


@pytest.mark.parametrize('plans', [
    (Plan.at_rest(0, 0.25, (1, 2, 0)), Plan.at_rest(10, 0.25, (1, 2, 0))),
    (Plan(3950, 0.25, [[1, 2]] * 100),)])
def test_a_solution_that_moves_before_the_start_is_refused(plans):
    mission = started()
    with pytest.raises(InvalidInput, match='before the mission started'):
        mission.collect(Solution(1, plans), 7)


def test_robots_of_other_missions_are_not_its_business():
    mission = gathered()
    mission.hear(said(9), 0.0)
    assert set(mission.heard) == set(IDS)


def test_why_it_ended_is_in_its_report_unless_all_arrived():
    scene = Scene('m', tuple(RobotSpec(i, (i, 1, 0), (i, 3, 0)) for i in IDS), boundary=Boundary((0, 4), (0, 4)))
    mission = gathered()
    mission.stop('enough', 0.0)
    report = mission.report(scene.bodies(), scene.environment())
    assert not report.valid and report.arrived == 0 and report.violations == ['the mission ended: enough']
    simulation = scene.world_sim()
    simulation.run(start_time=EPOCH + LEAD)
    mission = started()
    for solution in simulation.solutions.values():
        mission.collect(solution, 7)
    mission.step(5.0, EPOCH + 5)
    report = mission.report(scene.bodies(), scene.environment())
    assert report.valid and report.arrived == 3 and not report.violations


@pytest.mark.parametrize('fields', [
    {'state': 4}, {'state': -1}, {'robot_ids': ()}, {'robot_ids': range(257)}, {'robot_ids': (1, 1)},
    {'start': float('nan')}, {'start': float('inf')}])
def test_an_impossible_announcement_is_refused(fields):
    with pytest.raises(InvalidInput):
        Announcement(**{'name': 'm', 'state': 0, 'robot_ids': IDS, **fields})
