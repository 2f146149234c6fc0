"""The action ``~/navigate_to_pose``: driven to its end, replaced, withdrawn, refused; with Nav2's type where it is."""
import sys
from types import SimpleNamespace

import pytest
from action_msgs.msg import GoalStatus
from mobile_planning_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from robot_fleet import Fleet

from mobile_planning.errors import GoalOutside, UnknownFrame
from mobile_planning.fleet.announcement import State
from mobile_planning.nodes.convert import pose_stamped
from mobile_planning.nodes.navigate_action import action_type


class Navigator:
    """A client, of a robot that drives."""

    def __init__(self, ros):
        self._ros, self.fleet, self.feedback = ros, Fleet(ros), []
        self.fleet.robot(navigate_to_pose=True)
        self.fleet.map()
        self.fleet.announce(State.STARTED, start=self.fleet.now)
        self.fleet.hear(lambda message: message.plan_seq)
        self._client = ActionClient(ros.node, NavigateToPose, '/robot_1/navigate_to_pose')
        ros.until(self._client.server_is_ready)

    def send(self, x, y, frame='map'):
        """Return the handle of a goal."""
        goal = NavigateToPose.Goal(pose=pose_stamped((x, y, 0.0), frame))
        future = self._client.send_goal_async(goal, lambda message: self.feedback.append(message.feedback))
        self._ros.until(future.done)
        return future.result()

    def outcome(self, handle):
        """Return status and result of a goal."""
        future = handle.get_result_async()
        self._ros.until(future.done)
        return future.result().status, future.result().result


@pytest.fixture
def navigator(ros):
    """Return a `Navigator`."""
    return Navigator(ros)


def test_a_goal_is_driven_to_and_told_of_on_the_way(navigator):
    status, result = navigator.outcome(navigator.send(2.0, 1.5))
    assert (status, result.error_code) == (GoalStatus.STATUS_SUCCEEDED, 0)
    assert navigator.fleet.hear().latest_z == pytest.approx([2.0, 1.5], abs=0.03)
    left = [each.distance_remaining for each in navigator.feedback]
    assert left[0] > left[-1] and len(left) > 2 and 0.0 < navigator.feedback[0].estimated_time_remaining.sec < 5
    place = navigator.feedback[0].current_pose
    assert place.header.frame_id == 'map' and place.pose.position.x < 2.0


def test_another_goal_takes_the_place_of_the_first_which_is_aborted(navigator):
    first = navigator.send(3.0, 3.0)
    second = navigator.send(1.8, 1.0)
    status, result = navigator.outcome(first)
    assert status == GoalStatus.STATUS_ABORTED and 'another goal' in result.error_msg
    assert navigator.outcome(second)[0] == GoalStatus.STATUS_SUCCEEDED


def test_a_goal_that_is_withdrawn_is_cancelled_once_the_robot_rests_and_the_next_one_is_driven_to(ros, navigator):
    handle = navigator.send(3.0, 3.0)
    ros.until(lambda: navigator.feedback and navigator.feedback[-1].distance_remaining < 2.5)
    ros.until(handle.cancel_goal_async().done)
    assert navigator.outcome(handle)[0] == GoalStatus.STATUS_CANCELED
    points = navigator.fleet.hear().control_points
    assert len(points) == 8 and points[0] < 2.9, 'the robot has not come to rest on its way'
    assert navigator.outcome(navigator.send(2.0, 1.5))[0] == GoalStatus.STATUS_SUCCEEDED


@pytest.mark.parametrize('x, frame, code', [(9.0, 'map', GoalOutside.code), (2.0, 'odom', UnknownFrame.code)])
def test_an_impossible_goal_is_aborted_with_a_code_and_the_old_one_stands(navigator, x, frame, code):
    first = navigator.send(2.0, 2.0)
    status, result = navigator.outcome(navigator.send(x, 1.0, frame))
    assert (status, result.error_code) == (GoalStatus.STATUS_ABORTED, code) and result.error_msg
    assert navigator.outcome(first)[0] == GoalStatus.STATUS_SUCCEEDED


def test_a_stop_of_the_mission_aborts_it(navigator):
    handle = navigator.send(3.0, 3.0)
    navigator.fleet.announce(State.STOPPED)
    status, result = navigator.outcome(handle)
    assert status == GoalStatus.STATUS_ABORTED and 'stopped' in result.error_msg


def test_it_is_nav2_s_action_where_that_is_installed_and_has_the_same_fields_else(monkeypatch):
    assert action_type() is NavigateToPose
    monkeypatch.setitem(sys.modules, 'nav2_msgs.action', SimpleNamespace(NavigateToPose='of Nav2'))
    monkeypatch.setitem(sys.modules, 'nav2_msgs', SimpleNamespace())
    assert action_type() == 'of Nav2'
    # As of Kilted.
    assert list(NavigateToPose.Goal.get_fields_and_field_types()) == ['pose', 'behavior_tree']
    assert list(NavigateToPose.Result.get_fields_and_field_types()) == ['error_code', 'error_msg']
    assert NavigateToPose.Feedback.get_fields_and_field_types() == {
        'current_pose': 'geometry_msgs/PoseStamped', 'navigation_time': 'builtin_interfaces/Duration',
        'estimated_time_remaining': 'builtin_interfaces/Duration', 'number_of_recoveries': 'int16',
        'distance_remaining': 'float'}
