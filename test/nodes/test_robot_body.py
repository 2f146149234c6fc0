"""The robot's simulated body, with a planner that hangs or fails, worlds that change, processes that restart."""
import threading

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from mobile_planning_msgs.msg import ObstacleArray, RobotStatus
from mobile_planning_msgs.srv import SetGoal
from nav_msgs.msg import Odometry, Path
from rcl_interfaces.srv import DescribeParameters
from robot_fleet import Fleet
from std_srvs.srv import Trigger

from mobile_planning.errors import GoalOutside, InvalidInput, UnknownFrame
from mobile_planning.fleet.announcement import State
from mobile_planning.nodes import convert_obstacles, qos, wire
from mobile_planning.nodes.convert import path_message, path_poses, pose_stamped
from mobile_planning.world.obstacles import PolygonObstacle

#: Two metres ahead.
LONG = {'start': [1.0, 1.0, 0.0], 'goal': [3.0, 1.0, 0.0]}


@pytest.fixture
def fleet(ros):
    """Return the `Fleet` of this test."""
    return Fleet(ros)


def is_still(odometry):
    """Return whether the body stands."""
    return odometry and abs(odometry[-1].twist.twist.linear.x) < 1e-3


def where(odometry):
    """Return where the body is."""
    return odometry[-1].pose.pose.position.x, odometry[-1].pose.pose.position.y


@pytest.fixture
def hanging():
    """Return a function that never comes back before the test is over."""
    over = threading.Event()
    yield lambda *_: over.wait(60.0) and []
    over.set()


def test_a_planner_that_hangs_leaves_the_executor_free_and_the_body_on_its_plan(ros, fleet, hanging, monkeypatch):
    monkeypatch.setattr('mobile_planning.nodes.robot_health._HUNG', 0.5)
    node = fleet.robot(**LONG)
    odometry = ros.listen(Odometry, '/robot_1/odom', qos.live())
    plans = ros.listen(Path, '/robot_1/plan', qos.PATH)
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: odometry and where(odometry)[0] > 1.3)
    node._agent.step = hanging
    status, facts = fleet.diagnosis(lambda status: 'planner has not answered' in status.message)
    assert status.level == DiagnosticStatus.ERROR and int(facts['cycles missed']) > 1
    answer = ros.call(DescribeParameters, '/robot_1/describe_parameters', DescribeParameters.Request(names=['Tc']))
    assert answer.descriptors
    ros.until(lambda: is_still(odometry))
    assert where(odometry) == pytest.approx(path_poses(plans[-1])[-1][:2], abs=0.005)
    assert where(odometry)[0] < 2.9


def test_a_planner_that_fails_is_counted_and_tried_again(ros, fleet, monkeypatch):
    node = fleet.robot(**LONG)
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    fleet.hear(lambda message: message.plan_seq)
    with monkeypatch.context() as broken:
        broken.setattr(node._agent, 'step', lambda clock: 1 / 0)
        ros.until(lambda: node._guard.faults > 2)
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done


def test_pause_and_resume_hold_the_robot_and_let_it_go(ros, fleet):
    fleet.robot(**LONG)
    odometry = ros.listen(Odometry, '/robot_1/odom', qos.live())
    statuses = ros.listen(RobotStatus, '/robot_1/status', qos.live(1))
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: odometry and where(odometry)[0] > 1.2)
    assert ros.call(Trigger, '/robot_1/pause').success
    ros.until(lambda: is_still(odometry))
    ros.until(lambda: any(status.trouble == 'paused by ~/pause' for status in statuses))
    assert 1.2 < where(odometry)[0] < 2.5
    assert ros.call(Trigger, '/robot_1/resume').message == 'the robot drives on'
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done and statuses[-1].tracking_error < 0.015


def goal_request(*places, how=SetGoal.Request.REPLACE, frame='map'):
    """Return the request to drive to places in turn."""
    return SetGoal.Request(how=how, goals=[pose_stamped((*place, 0.0), frame) for place in places])


def test_goals_are_taken_refused_with_a_code_and_counted(ros, fleet):
    fleet.robot(goal=[1.5, 1.0, 0.0])
    statuses = ros.listen(RobotStatus, '/robot_1/status', qos.live(1))
    assert ros.call(SetGoal, '/robot_1/set_goal', goal_request((2.0, 2.0))).error_code == InvalidInput.code
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    fleet.hear(lambda message: message.plan_seq)
    for request, code in ((goal_request((9.0, 9.0)), GoalOutside.code), (goal_request(), InvalidInput.code),
                          (goal_request((2.0, 2.0), frame='odom'), UnknownFrame.code),
                          (goal_request((2.0, 2.0), how=9), InvalidInput.code)):
        answer = ros.call(SetGoal, '/robot_1/set_goal', request)
        assert answer.error_code == code and answer.error_msg
    assert ros.call(SetGoal, '/robot_1/set_goal', goal_request((1.5, 1.5), (1.0, 1.5))).error_code == 0
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[-1].done
    ros.until(lambda: statuses[-1].goals_reached == 2 and statuses[-1].goals_left == 0)
    assert fleet.hear().latest_z == pytest.approx([1.0, 1.5], abs=0.03) and fleet.messages[-1].goals_reached == 2


def test_a_chosen_robot_drives_to_what_is_clicked(ros, fleet):
    fleet.robot(takes_goal_pose=True)
    clicks = ros.node.create_publisher(PoseStamped, '/goal_pose', qos.live(1))
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    fleet.hear(lambda message: message.plan_seq)
    ros.until(clicks.get_subscription_count)
    clicks.publish(pose_stamped((1.0, 1.6, 0.0), 'map'))
    fleet.hear(lambda message: message.done_planning and message.latest_z[1] > 1.57)


def test_a_way_from_elsewhere_is_driven_along_or_refused(ros, fleet):
    node = fleet.robot(goal=[1.5, 1.0, 0.0])
    ways = ros.node.create_publisher(Path, '/robot_1/reference_path', qos.live(1))
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    fleet.hear(lambda message: message.plan_seq)
    ros.until(ways.get_subscription_count)
    good = [(1.4, 1.0, 0.0), (1.5, 2.0, 0.0), (2.0, 2.5, 0.0)]
    for count, (frame, poses) in enumerate([('odom', good), ('map', [(3.5, 3.5, 0.0), (3.5, 3.0, 0.0)]),
                                            ('map', [(1.4, 1.0, 0.0), (9.0, 1.0, 0.0)]), ('map', [])], 1):
        ways.publish(path_message(np.array(poses), frame, wire.stamp(fleet.now)))
        ros.until(lambda count=count: node._guard.rejected.total() == count)
    ways.publish(path_message(good, 'map', wire.stamp(fleet.now)))
    fleet.hear(lambda message: message.done_planning and message.latest_z[1] > 2.4)


def test_a_base_that_turns_too_slowly_for_its_plans_is_an_error_from_the_start(fleet):
    fleet.robot(base_alpha_max=20.0, goal=[1.5, 1.0, 0.0])
    fleet.map()
    status, _ = fleet.diagnosis(lambda status: 'turns in place bring the body' in status.message)
    assert status.level == DiagnosticStatus.ERROR and 'base_alpha_max 20 rad/s2' in status.message


def test_an_emergency_stop_of_the_mission_holds_all_until_it_goes_on(ros, fleet):
    fleet.robot(1, start=[1.0, 1.0, 0.0], goal=[3.0, 1.0, 0.0])
    fleet.robot(2, start=[1.0, 2.0, 0.0], goal=[3.0, 2.0, 0.0])
    bodies = [ros.listen(Odometry, f'/robot_{eyed}/odom', qos.live()) for eyed in (1, 2)]
    fleet.map()
    start = fleet.now + 0.5
    fleet.announce(State.STARTED, ids=(1, 2), start=start)
    ros.until(lambda: all(body and where(body)[0] > 1.1 for body in bodies))
    fleet.announce(State.PAUSED, ids=(1, 2), start=start)
    ros.until(lambda: all(map(is_still, bodies)))
    assert all(where(body)[0] < 2.6 for body in bodies)
    fleet.announce(State.STARTED, ids=(1, 2), start=start)
    ros.until(lambda: len(fleet.solutions) == 2)
    assert all(solution.done for solution in fleet.solutions)


def test_a_robot_that_is_killed_and_started_again_drives_on_from_where_its_body_stands(ros, fleet, tmp_path):
    book = {'logbook': str(tmp_path / 'robot_{id}.json'), **LONG}
    node = fleet.robot(**book)
    odometry = ros.listen(Odometry, '/robot_1/odom', qos.live())
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: odometry and where(odometry)[0] > 1.4)
    (first,) = {message.boot_epoch for message in fleet.messages}
    ros.remove(node)
    fleet.messages.clear()
    fleet.robot(**book)
    message = ros.until(lambda: next((message for message in fleet.messages if message.boot_epoch > first), None))
    rest = np.array(message.latest_z)
    assert message.boot_epoch > first and 1.4 < rest[0] < 3.01
    assert np.allclose(message.control_points[:6], np.tile(rest, 3))
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done and fleet.solutions[0].boot_epoch > first
    assert where(odometry)[0] == pytest.approx(3.0, abs=0.03)


def test_one_that_is_started_anew_without_a_logbook_and_left_out_stands_and_says_what_it_lacks(ros, fleet):
    fleet.robot(**LONG)
    odometry = ros.listen(Odometry, '/robot_1/odom', qos.live())
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: odometry and where(odometry)[0] > 1.1)
    fleet.announce(State.STARTED, start=fleet.now, left_out=(1,))
    status, _ = fleet.diagnosis(lambda status: 'parameter logbook' in status.message)
    assert status.level == DiagnosticStatus.ERROR and 'goes on without it' in status.message
    ros.until(lambda: is_still(odometry))
    assert where(odometry)[0] < 2.9 and not fleet.solutions


def test_an_obstacle_that_appears_on_the_way_is_braked_for_and_said_until_it_is_gone(ros, fleet):
    fleet.robot(**LONG)
    odometry = ros.listen(Odometry, '/robot_1/odom', qos.live())
    statuses = ros.listen(RobotStatus, '/robot_1/status', qos.live(1))
    obstacles = ros.node.create_publisher(ObstacleArray, '/obstacles', qos.latched())
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: odometry and where(odometry)[0] > 1.2)
    wall = PolygonObstacle([(2.6, 0.0), (2.7, 0.0), (2.7, 4.0), (2.6, 4.0)])
    obstacles.publish(convert_obstacles.obstacles_message([wall], fleet.now, 'map'))
    ros.until(lambda: any('no path' in status.trouble for status in statuses) and is_still(odometry))
    assert 1.2 < where(odometry)[0] < 2.4
    obstacles.publish(convert_obstacles.obstacles_message([], fleet.now, 'map'))
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done


@pytest.mark.parametrize('parameters, words', [
    ({'margin': 0.02}, 'need 0.0250 m'), ({'u_max': [2.0, 5.0]}, r'clock_margin 0.005 s at 2.0 m/s'),
    ({'localisation': 'gps'}, 'not pose or tf'), ({'robots': [1, 1]}, 'each once'),
    ({'simulate': False, 'localisation': 'tf'}, 'tf2_ros is not installed')])
def test_margins_that_do_not_add_up_and_other_impossible_parameters_are_refused(fleet, parameters, words):
    with pytest.raises(InvalidInput, match=words):
        fleet.robot(**parameters)
