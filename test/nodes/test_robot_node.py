"""The robot, in process among messages of others, and as a process."""
import signal
import time
from pathlib import Path as FilePath

import numpy as np
import pytest
import yaml
from conftest import Ros
from diagnostic_msgs.msg import DiagnosticStatus
from mobile_planning_msgs.msg import Contracts as ContractsMessage
from mobile_planning_msgs.msg import JointPlan as JointPlanMessage
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from nav_msgs.msg import Odometry, Path
from rcl_interfaces.srv import DescribeParameters
from robot_fleet import WALL, Fleet
from rosgraph_msgs.msg import Clock

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.fleet.announcement import State
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import Contracts, Link, Mode, Offer, RobotMsg
from mobile_planning.nodes import (
    convert, convert_contracts, convert_mission, convert_robot, fleet_bus, qos, wire)
from mobile_planning.nodes.convert import path_poses, seconds
from mobile_planning.nodes.robot import RobotOptions


@pytest.fixture
def fleet(ros):
    """Return the `Fleet` of this test."""
    return Fleet(ros)


def test_a_robot_waits_for_the_map_then_for_the_mission_drives_and_hands_in_its_solution(ros, fleet):
    fleet.robot()
    plans = ros.listen(Path, '/robot_1/plan', qos.PATH)
    odometry = ros.listen(Odometry, '/robot_1/odom', qos.live())
    status, _ = fleet.diagnosis()
    assert status.level == DiagnosticStatus.WARN and 'map' in status.message and not fleet.messages
    fleet.map()
    message = fleet.hear()
    assert (message.robot_id, message.mode) == (1, RobotMessage.WAITING)
    assert message.latest_z == pytest.approx([1.0, 1.0])
    ros.until(lambda: plans and odometry)
    assert path_poses(plans[0])[0] == pytest.approx([1.0, 1.0, 0.0])
    assert odometry[-1].header.frame_id == 'map' and odometry[-1].child_frame_id == 'robot_1/base_link'
    fleet.announce(State.WAITING)
    start = fleet.now + 0.5
    fleet.announce(State.STARTED, start=start)
    (solution,) = ros.until(lambda: fleet.solutions)
    assert solution.done and solution.robot_id == 1 and solution.boot_epoch == message.boot_epoch
    driven = convert_mission.solution(solution, 'map')
    assert driven.plans[1].first_knot * driven.plans[1].step >= start - 1e-6
    assert driven.states(np.array([start, driven.end]))[:, :2] == pytest.approx(np.array([[1, 1], [1.5, 1]]), abs=0.03)
    end = fleet.hear()
    assert end.done_planning and end.mode == RobotMessage.DONE and len(plans) > 2
    at_goal = odometry[-1].pose.pose.position.x
    assert at_goal == pytest.approx(1.5, abs=0.03)
    status, facts = fleet.diagnosis()
    assert (status.message, status.level, facts['rejected']) == ('done', DiagnosticStatus.OK, '0')
    stamps = [seconds(said.header.stamp) for said in fleet.messages]
    assert stamps == sorted(stamps) and [said.sequence for said in fleet.messages] == list(range(
        fleet.messages[0].sequence, fleet.messages[-1].sequence + 1))


def test_a_latched_mission_and_map_from_before_the_robot_was_started_are_followed(ros, fleet):
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    fleet.robot()
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done


def test_two_robots_hear_each_other_and_a_stop_ends_their_drive(ros, fleet):
    fleet.robot(1, start=[1.0, 1.0, 0.0], goal=[3.0, 1.0, 0.0])
    fleet.robot(2, start=[3.0, 2.0, 3.0], goal=[1.0, 2.0, 3.0])
    fleet.map()
    fleet.announce(State.WAITING, ids=(1, 2))
    fleet.hear(lambda message: message.robot_id == 1 and list(message.peer) == [2])
    fleet.hear(lambda message: message.robot_id == 2 and list(message.peer) == [1])
    fleet.announce(State.STARTED, ids=(1, 2), start=fleet.now)
    fleet.hear(lambda message: message.robot_id == 1 and message.plan_seq)
    fleet.announce(State.STOPPED, ids=(1, 2))
    ros.until(lambda: len(fleet.solutions) == 2)
    assert not any(solution.done for solution in fleet.solutions)
    fleet.hear(lambda message: message.mode == RobotMessage.STOPPED)


def test_on_simulated_time_it_speaks_while_the_clock_stands_and_drives_while_it_runs(ros, fleet):
    clock, now = ros.node.create_publisher(Clock, '/clock', 10), [0.0]

    def tick():
        now[0] += 0.02
        clock.publish(Clock(clock=wire.stamp(now[0])))

    fleet.map()
    fleet.announce(State.STARTED, start=0.5)
    node = fleet.robot(use_sim_time=True)
    first = fleet.hear()
    assert fleet.hear(lambda message: message.sequence > first.sequence + 3).mode == RobotMessage.WAITING
    assert first.boot_epoch > 10**9, 'simulated time begins anew with every simulation'
    ros.node.create_timer(0.02, tick)
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done and node._guard.faults == 0
    assert convert_mission.solution(fleet.solutions[0], 'map').end <= now[0]


def peer_message(robot_id=2, **fields):
    """Return a good message of a robot that stands far away."""
    plan = Plan.at_rest(0, 0.1, (3.5, 3.5, 0.0))
    return RobotMsg(False, [3.5], [3.5], [3.5, 3.5], **{
        'robot_id': robot_id, 'boot_epoch': 1, 'sequence': 1, 'plan': plan, 'links': {1: Link()}, **fields})


def test_garbage_from_the_network_is_counted_and_the_robot_drives_on(ros, fleet):
    fleet.map()
    node = fleet.robot()
    fleet.announce(State.STARTED, start=fleet.now)
    fleet.hear()
    ros.until(lambda: fleet.peers.get_subscription_count() == 2)
    spoilt = [('version', 9), ('mode', 77), ('step', float('nan')), ('control_points', [1.0] * 7),
              ('control_points', [float('inf')] * 8), ('control_points', [0.0] * 200_000), ('first_knot', 2**63 - 1),
              ('peer', list(range(5))), ('link_mode', [9])]
    for count, (field, value) in enumerate(spoilt, 1):
        message = convert_robot.robot_message(peer_message(), fleet.now, 'map')
        setattr(message, field, value)
        fleet.peers.publish(message)
        ros.until(lambda: node._guard.rejected.total() == count)
    foreign = convert_robot.robot_message(peer_message(), fleet.now, 'odom')
    fleet.peers.publish(foreign)
    _, facts = fleet.diagnosis(lambda status: any(value.key == 'rejected 202 UnknownFrame' for value in status.values))
    assert facts['rejected 251 InvalidInput'] == str(len(spoilt)) and facts['faults'] == '0'
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done


def test_garbage_among_contracts_is_counted_and_the_robot_drives_on(ros, fleet):
    fleet.map()
    node = fleet.robot()
    contracts = ros.node.create_publisher(ContractsMessage, '/contracts', qos.robot_messages())
    fleet.announce(State.STARTED, start=fleet.now)
    fleet.hear()
    ros.until(lambda: contracts.get_subscription_count() == 1)
    good = Contracts(0, 1, 1, (Offer(1, 1, 1, Contract(1, 0, [[1.0, 0.0]], np.zeros((1, 4)))),), {1: Link()})
    spoilt = [('version', 7), ('normals', [float('nan')] * 2), ('normals', [0.0] * 200_000), ('offsets', [1.0] * 3),
              ('spans', [65535]), ('peer', []), ('answer_mode', [77]), ('first_span', [2**63 - 1])]
    for count, (field, value) in enumerate(spoilt, 1):
        message = convert_contracts.contracts_message(good, fleet.now, 'map')
        setattr(message, field, value)
        contracts.publish(message)
        ros.until(lambda: node._guard.rejected.total() == count)
    joint = ros.node.create_publisher(JointPlanMessage, '/joint_plans', qos.robot_messages())
    ros.until(lambda: joint.get_subscription_count() == 1)
    header = convert.header('map', wire.stamp(fleet.now))
    for message in (JointPlanMessage(header=header, version=9), JointPlanMessage(header=header, version=1)):
        spoilt.append('joint plan')
        joint.publish(message)
        ros.until(lambda: node._guard.rejected.total() == len(spoilt))
    contracts.publish(convert_contracts.contracts_message(good, fleet.now, 'odom'))
    # Of a robot outside the mission.
    contracts.publish(convert_contracts.contracts_message(good, fleet.now, 'map'))
    _, facts = fleet.diagnosis(lambda status: any(value.key == 'rejected 202 UnknownFrame' for value in status.values))
    assert facts['rejected 251 InvalidInput'] == str(len(spoilt)) and facts['faults'] == '0'
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done and node._agent.robot.ignored


def test_two_robots_agree_on_contracts_between_their_cycles(ros, fleet):
    said = ros.listen(ContractsMessage, '/contracts', qos.robot_messages(100))
    fleet.robot(1, start=[1.0, 1.0, 0.0], goal=[2.0, 1.0, 0.0])
    fleet.robot(2, start=[3.0, 2.0, 3.0], goal=[2.0, 2.0, 3.0])
    fleet.map()
    fleet.announce(State.STARTED, ids=(1, 2), start=fleet.now + 0.5)
    ros.until(lambda: len(fleet.solutions) == 2)
    offers = [message for message in said if message.robot_id == 1]
    answers = [message for message in said if message.robot_id == 2]
    assert all(list(message.peer) == [2] for message in offers) and all(not message.peer for message in answers)
    assert any(list(message.answer_peer) == [1] and message.answer_contract[0] for message in answers)


def test_cycles_begin_at_the_robot_s_phase(ros, fleet):
    fleet.map()
    node = fleet.robot(Tc=0.5, Tp=2.0)
    fleet.hear()
    robot, lateness = node._agent.robot, []
    commit = robot.plan_section
    robot.plan_section = lambda now: (lateness.append((now - robot.phase) % 0.5), commit(now))[1]
    ros.until(lambda: len(lateness) == 4)
    assert min(lateness) < 0.1, 'a busy machine may be late now and then'


def test_an_impossible_mission_is_refused_and_a_good_one_followed(ros, fleet):
    fleet.map()
    node = fleet.robot()
    mission = ros.node.create_publisher(MissionMessage, '/mission', qos.MISSION)
    fleet.hear()
    for count, fields in enumerate([{'state': 9, 'robot_ids': [1]}, {'robot_ids': []}, {'robot_ids': [1, 1]}], 1):
        mission.publish(MissionMessage(name='x', **fields))
        ros.until(lambda: node._guard.rejected.total() == count)
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: fleet.solutions)


def test_a_map_in_another_frame_is_refused_and_the_right_one_taken(fleet):
    fleet.robot()
    fleet.map(frame='odom')
    status, facts = fleet.diagnosis(lambda status: any('202' in value.key for value in status.values))
    assert facts['rejected 202 UnknownFrame'] == '1' and not fleet.messages
    fleet.map()
    fleet.hear()


def test_a_start_in_a_wall_is_said_in_the_diagnostics_and_another_map_mends_it(fleet):
    fleet.robot()
    fleet.map(WALL)
    status, facts = fleet.diagnosis(lambda status: 'start (1.000, 1.000) of robot 1' in status.message)
    assert status.level == DiagnosticStatus.WARN and facts['rejected 205 StartOccupied'] == '1'
    fleet.map()
    fleet.hear()


def test_a_second_robot_with_the_same_id_is_noticed(fleet):
    fleet.map()
    fleet.robot()
    mine = fleet.hear()
    fleet.say(peer_message(1, boot_epoch=mine.boot_epoch + 1))
    status, _ = fleet.diagnosis(lambda status: 'second time' in status.message)
    assert status.level == DiagnosticStatus.WARN


@pytest.fixture
def stranger():
    """Return another process, as far as the middleware can tell, with a node."""
    other = Ros()
    yield other
    other.close()


def test_another_process_does_not_speak_for_a_robot_that_speaks_itself(ros, fleet, stranger):
    fleet.map()
    node = fleet.robot()
    fleet.announce(State.WAITING, ids=(1, 2))
    fleet.hear()
    impostor = Fleet(stranger)
    ros.until(lambda: fleet.peers.get_subscription_count() == 3 and impostor.peers.get_subscription_count() == 3)
    fleet.say(peer_message(sequence=1))
    ros.until(lambda: 2 in node._agent.robot.heard())

    def heard_as(sequence):
        fleet.say(peer_message(sequence=sequence))
        impostor.say(peer_message(sequence=999, boot_epoch=7))
        return node.host.bus.peers.refused['spoofed']

    for sequence in range(2, 9):
        before = node.host.bus.peers.refused['spoofed']
        heard_as(sequence)
        ros.until(lambda before=before: node.host.bus.peers.refused['spoofed'] > before)
    assert node._agent.robot.heard()[2].boot_epoch == 1
    _, facts = fleet.diagnosis(lambda status: any(value.key == 'spoofed messages' for value in status.values))
    assert int(facts['spoofed messages']) >= 7
    # The robot falls silent: who says to be its next process is believed.
    ros.until(lambda: (impostor.say(peer_message(sequence=1000, boot_epoch=7)),
                       node._agent.robot.heard()[2].boot_epoch == 7)[1])


def test_old_messages_and_floods_are_turned_away_and_counted_by_kind(ros, fleet, monkeypatch):
    fleet.map()
    node = fleet.robot()
    fleet.hear()
    ros.until(lambda: fleet.peers.get_subscription_count() == 2)
    refused = node.host.bus.peers.refused
    fleet.peers.publish(convert_robot.robot_message(peer_message(), fleet.now - 60.0, 'map'))
    ros.until(lambda: refused['stale'] == 1)
    began = time.monotonic()
    fleet.say(peer_message(boot_epoch=5))
    ros.until(lambda: not node.host.bus.peers.is_silent(2, began))
    fleet.say(peer_message(boot_epoch=4))
    ros.until(lambda: refused['replayed'] == 1)
    flood = ros.node.create_publisher(RobotMessage, '/robot_msgs', qos.robot_messages(1000))
    ros.until(lambda: flood.get_subscription_count() == 2)
    # All at one time, however many a second this machine can hear.
    now = time.monotonic()
    monkeypatch.setattr(fleet_bus, 'monotonic', lambda: now)
    for number in range(300):
        flood.publish(convert_robot.robot_message(peer_message(3, sequence=number), fleet.now, 'map'))
    ros.until(lambda: refused['flooding'])
    assert node._guard.faults == 0


def test_who_falls_silent_is_noticed_in_one_and_a_half_seconds(ros, fleet):
    fleet.map()
    node = fleet.robot()
    fleet.announce(State.WAITING, ids=(1, 2))
    fleet.hear(lambda message: 2 in message.peer)
    ros.until(lambda: fleet.peers.get_subscription_count() == 2)
    fleet.say(peer_message())
    ros.until(lambda: 2 not in node._health._silent)
    since = time.monotonic()
    ros.until(lambda: 2 in node._health._silent)
    # A busy machine may notice late; by its own clock 1.1 s after the last word is when it does.
    assert node.host.bus.peers.silent((2,), since + 1.1) == [2] and not node.host.bus.peers.silent((2,), since)
    fleet.say(peer_message(sequence=2))
    ros.until(lambda: 2 not in node._health._silent)


def test_a_fault_of_ours_is_counted_and_the_node_lives_on(ros, fleet, monkeypatch):
    fleet.map()
    node = fleet.robot()
    fleet.hear()
    with monkeypatch.context() as broken:
        broken.setattr(node._agent, 'step', lambda now: 1 / 0)
        status, _ = fleet.diagnosis(lambda status: status.level == DiagnosticStatus.ERROR)
        assert 'on_cycle failed with ZeroDivisionError' in status.message
    fleet.hear()


@pytest.mark.parametrize('parameters, words', [
    ({'robot_id': -1}, 'within 0 to'), ({'start': [1.0, 2.0]}, 'start must be 3 numbers'),
    ({'goal': [float('nan'), 0.0, 0.0]}, 'finite'), ({'u_max': [0.0, 1.0]}, 'u_max'),
    ({'a_max': [1.0]}, 'a_max must be 2 numbers'), ({'radius': 0.0}, 'within 0.01 to'), ({'Tp': 0.3}, 'Tc'),
    ({'Tc': 5.0, 'Tp': 10.0}, 'Tc'), ({'speed': 1.0}, 'no parameter speed'),
    ({'com_range': 3.0}, 'go together'), ({'neighbours': [2, 3]}, 'go together'),
    ({'scene': 'nowhere.yaml'}, 'nowhere.yaml'), ({'start': 'here'}, 'must be a tuple')])
def test_an_impossible_parameter_is_refused_with_a_sentence(fleet, parameters, words):
    with pytest.raises(InvalidInput, match=words):
        fleet.robot(**parameters)


@pytest.fixture
def scene(tmp_path):
    """Return the YAML file of a scene without a map."""
    path = tmp_path / 'two robots.yaml'
    path.write_text('boundary: {x: [0, 4], y: [0, 4]}\nobstacles: [{position: [3, 3], radius: 0.5}]\nrobots:\n'
                    '  - {id: 1, start: [1, 1, 0], goal: [2, 1, 0]}\n  - {id: 2, start: [3, 3, 0], goal: [1, 3, 0]}\n')
    return path


@pytest.mark.parametrize('parameters, words', [
    ({'robot_id': 7}, 'not 7'), ({'robot_id': 2}, r'start \(3.000, 3.000\) of robot 2'),
    ({'robot_id': 2, 'scene_robots': 1}, 'not 2'), ({'scene_robots': 3}, '3 robots are asked for')])
def test_a_robot_that_its_scene_does_not_have_or_has_no_room_for_is_refused(fleet, scene, parameters, words):
    with pytest.raises(PlanningError, match=words):
        fleet.robot(scene=str(scene), **parameters)


def test_a_scene_without_a_map_needs_none(fleet, scene):
    fleet.robot(scene=str(scene))
    assert fleet.hear().mode == Mode.WAITING


def test_every_parameter_has_a_description_and_every_number_a_range(ros, fleet):
    fleet.robot()
    names = list(RobotOptions.__dataclass_fields__)
    answer = ros.call(DescribeParameters, '/robot_1/describe_parameters', DescribeParameters.Request(names=names))
    assert all(entry.description and entry.read_only for entry in answer.descriptors)
    numbers = [entry for entry in answer.descriptors if entry.type in (2, 3)]
    assert len(numbers) == 19 and all(entry.integer_range or entry.floating_point_range for entry in numbers)


def test_the_shipped_parameter_file_holds_the_defaults():
    path = FilePath(__file__).parents[2] / 'config' / 'robot.yaml'
    given = yaml.safe_load(path.read_text())['robot']['ros__parameters']
    options = RobotOptions()
    assert given == {name: list(value) if isinstance(value, tuple) else value
                     for name, value in vars(options).items()}


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_as_a_process_it_stops_on_a_signal(fleet, start, scene, number):
    process = start('robot', '--ros-args', '-p', f"scene:='{scene}'", '-p', 'robot_id:=1')
    fleet.hear()
    process.signal(number)
    code, out, err = process.result()
    assert (code, out) == (0, '') and 'Traceback' not in err


@pytest.mark.parametrize('arguments, words', [
    (['-p', 'robo_id:=1'], 'did you mean robot_id'), (['-p', 'scene:=nowhere.yaml'], 'nowhere.yaml'),
    (['-p', 'robot_id:=one'], 'must be a int')])
def test_as_a_process_it_ends_with_2_and_a_sentence_for_bad_parameters(start, arguments, words):
    code, out, err = start('robot', '--ros-args', *arguments).result()
    assert (code, out) == (2, '') and err.startswith('robot: ') and words in err and 'Traceback' not in err
