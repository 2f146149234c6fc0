"""A real base: driven by its commands, with poses that end, a planner that dies or freezes, and a pilot that dies."""
import signal
import sys

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from geometry_msgs.msg import PoseWithCovarianceStamped, TransformStamped, TwistStamped
from mobile_planning_msgs.msg import MissionReport, RobotStatus
from nav_msgs.msg import Odometry
from robot_fleet import Fleet

from mobile_planning.fleet.announcement import State
from mobile_planning.fleet.base import SimulatedBase
from mobile_planning.fleet.logbook import Logbook
from mobile_planning.nodes import qos, wire
from mobile_planning.nodes.convert import header, pose_message, seconds
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.odometry import MapOdometry
from mobile_planning.nodes.world_sim import WorldSimNode

#: Two metres ahead.
LONG = {'start': [1.0, 1.0, 0.0], 'goal': [3.0, 1.0, 0.0]}


@pytest.fixture
def fleet(ros):
    """Return the `Fleet` of this test."""
    return Fleet(ros)


@pytest.fixture
def real(ros, fleet):
    """Return a function that starts robots with a real base; their pilots are seen to end after the test."""
    nodes = []

    def real(**parameters):
        nodes.append(fleet.robot(simulate=False, **{**LONG, **parameters}))
        return nodes[-1]

    yield real
    for node in nodes:
        if node in ros.executor.get_nodes():
            ros.remove(node)
    ros.until(lambda: all(node._body.pilot.poll() is not None for node in nodes))


class RealBase:
    """A base with a localisation, as the robot sees them from outside; without commands for 0.5 s it stops."""

    def __init__(self, ros, pose, covariance=1e-7):
        self._ros, self.base, self._covariance, self.is_localised = ros, SimulatedBase(pose), covariance, True
        self._poses = ros.node.create_publisher(PoseWithCovarianceStamped, '/robot_1/pose', qos.live(1))
        self.commands = ros.listen(TwistStamped, '/robot_1/cmd_vel', qos.live(1))
        self._seen = None
        ros.node.create_timer(0.02, self._tick)

    def _tick(self):
        now = self._ros.node.get_clock().now().nanoseconds * 1e-9
        command = self.commands[-1] if self.commands else TwistStamped()
        if self._seen is not None:
            is_fresh = now - seconds(command.header.stamp) < 0.5
            speeds = (command.twist.linear.x, command.twist.angular.z) if is_fresh else (0.0, 0.0)
            self.base.drive(speeds, now - self._seen)
        self._seen = now
        if self.is_localised:
            message = PoseWithCovarianceStamped(header=header('map', wire.stamp(now)))
            message.pose.pose = pose_message(self.base.pose)
            message.pose.covariance[0] = message.pose.covariance[7] = self._covariance
            self._poses.publish(message)


def test_a_real_base_is_driven_by_its_commands_from_where_its_localisation_says(ros, fleet, real):
    base = RealBase(ros, (1.05, 1.02, 0.1))
    real()
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    assert fleet.hear().latest_z == pytest.approx([1.05, 1.02], abs=1e-6)
    ros.until(lambda: fleet.solutions)
    assert base.commands[-1].header.frame_id == 'robot_1/base_link'
    ros.until(lambda: abs(base.commands[-1].twist.linear.x) < 0.01)
    assert base.base.pose[:2] == pytest.approx([3.0, 1.0], abs=0.03)


def test_a_real_base_that_loses_its_localisation_comes_to_rest_and_drives_on_when_it_is_back(ros, fleet, real):
    base = RealBase(ros, (1.0, 1.0, 0.0))
    real()
    statuses = ros.listen(RobotStatus, '/robot_1/status', qos.live(1))
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: base.base.pose[0] > 1.2)
    base.is_localised = False
    ros.until(lambda: statuses and 'no pose for more than 0.5 s' in statuses[-1].trouble
              and abs(base.commands[-1].twist.linear.x) < 1e-3)
    assert base.base.pose[0] < 2.8 and statuses[-1].pose_age > 0.5
    base.is_localised = True
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done


def test_a_pose_that_is_worse_than_the_margin_allows_is_an_error(ros, fleet, real):
    RealBase(ros, (1.0, 1.0, 0.0), covariance=1e-4)
    real()
    fleet.map()
    status, facts = fleet.diagnosis(lambda status: 'the pose may be wrong by 0.0303 m' in status.message)
    assert status.level == DiagnosticStatus.ERROR and facts['localisation error [mm]'] == '30.3'


def test_poses_that_make_no_sense_are_counted_and_passed_over(ros, fleet, real):
    node = real()
    poses = ros.node.create_publisher(PoseWithCovarianceStamped, '/robot_1/pose', qos.live(10))
    fleet.map()
    ros.until(poses.get_subscription_count)
    for count, (frame, x) in enumerate([('odom', 1.0), ('', 1.0), ('map', float('nan'))], 1):
        message = PoseWithCovarianceStamped(header=header(frame))
        message.pose.pose.position.x = x
        poses.publish(message)
        ros.until(lambda: node._guard.rejected.total() == count)
    status, _ = fleet.diagnosis()
    assert status.message == 'waiting for the pose' and not fleet.messages


def rests_at_the_end_of_its_plan(ros, base, book):
    """Wait until the base stands where the newest plan of a logbook ends, before the goal, and its pilot is gone."""
    ros.until(lambda: not ros.node.count_publishers('/robot_1/cmd_vel'))
    end = Logbook(book).read()[-1].plan.end
    assert base.base.pose[:2] == pytest.approx(end, abs=0.02) and end[0] < 2.9
    return end


@pytest.mark.parametrize('has_book', [True, False])
def test_a_planner_that_is_gone_leaves_the_base_on_its_plan_and_the_next_one_drives_on_from_there(
        ros, fleet, real, tmp_path, has_book):
    base, book, scene = RealBase(ros, (1.03, 1.01, 0.02)), str(tmp_path / 'book'), tmp_path / 'scene.yaml'
    scene.write_text('boundary: {x: [0, 4], y: [0, 4]}\nrobots: [{id: 1, start: [1, 1, 0], goal: [3, 1, 0]}]')
    reports = ros.listen(MissionReport, '/world_sim/report', qos.latched())
    first = real(scene=str(scene), logbook=book)
    judge = ros.add(WorldSimNode, scene=str(scene))
    ros.until(lambda: base.base.pose[0] > 1.3)
    gone_at = base.base.pose[0]
    # What it has committed is told: else world_sim takes the body for moved.
    first._agent.step = lambda clock: []
    ros.until(lambda: np.isinf(first._asked_at) and base.base.pose[0] > gone_at + 0.02)
    ros.remove(first)
    # Started while the pilot of the first still drives: it waits for its turn.
    second = real(scene=str(scene), logbook=book if has_book else '')
    message = fleet.hear(lambda message: message.boot_epoch == second.epoch)
    end = [entry.plan.end for entry in Logbook(book).read() if entry.epoch != second.epoch][-1]
    assert gone_at + 0.1 < end[0] < 2.9 and message.latest_z == pytest.approx(end, abs=0.02)
    with pytest.raises(SystemExit) as over:
        ros.until(lambda: False)
    ros.remove(judge)
    assert base.base.pose[:2] == pytest.approx([3.0, 1.0], abs=0.03)
    # Without a logbook it is judged from when on all is known.
    report = ros.until(lambda: reports)[-1]
    assert over.value.code == 0 and report.valid and report.goals_reached == report.goals == 1


@pytest.mark.parametrize('number', [signal.SIGKILL, signal.SIGSTOP])
def test_a_process_that_is_killed_or_frozen_leaves_the_base_on_its_plan(ros, fleet, start, tmp_path, number):
    base, book = RealBase(ros, (1.0, 1.0, 0.0)), str(tmp_path / 'book')
    arguments = {'robot_id': 1, 'simulate': 'false', 'start': [1.0, 1.0, 0.0], 'goal': [3.0, 1.0, 0.0], 'Tc': 0.1,
                 'Tp': 1.0, 'logbook': book}
    process = start('robot', '--ros-args', '-r', '__node:=robot_1',
                    *(part for name, value in arguments.items() for part in ('-p', f'{name}:={value}')))
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: base.base.pose[0] > 1.3)
    gone_at = base.base.pose[0]
    process.signal(number)
    plan = Logbook(book).read()[-1].plan
    ros.until(lambda: fleet.now > plan.end_knot * plan.step + 0.5)
    assert base.base.pose[0] > gone_at + 0.1
    process.kill()
    rests_at_the_end_of_its_plan(ros, base, book)


def test_a_pilot_that_dies_is_an_error_and_another_one_drives_on(ros, fleet, real):
    base = RealBase(ros, (1.0, 1.0, 0.0))
    node = real()
    fleet.map()
    fleet.announce(State.STARTED, start=fleet.now)
    ros.until(lambda: base.base.pose[0] > 1.3)
    node._body.pilot.kill()
    status, _ = fleet.diagnosis(lambda status: 'the pilot of the base' in status.message)
    assert status.level == DiagnosticStatus.ERROR
    ros.until(lambda: fleet.solutions)
    assert fleet.solutions[0].done and base.base.pose[:2] == pytest.approx([3.0, 1.0], abs=0.03)


class StandInTf:
    """As much of tf2_ros as is asked for: one transform, from the frame ``odom`` of the odometry to the map."""

    class TransformException(Exception):
        """As tf2_ros has it."""

    class Buffer:
        """Knows where ``odom`` is."""

        def lookup_transform(self, target, source, time, timeout):
            """Return the transform."""
            if (target, source) != ('map', 'odom'):
                raise StandInTf.TransformException(f'{source} is unknown')
            found = TransformStamped(header=header(target), child_frame_id=source)
            found.transform.translation.x, found.transform.translation.y = 1.0, 2.0
            found.transform.rotation.w = found.transform.rotation.z = np.sqrt(0.5)
            return found

    @staticmethod
    def TransformListener(buffer, node):
        """Return nothing: the buffer knows all."""


def test_odometry_is_placed_on_the_map_by_tf_or_counted_where_tf_does_not_know(ros, monkeypatch):
    monkeypatch.setitem(sys.modules, 'tf2_ros', StandInTf)
    guard, poses = Guard(ros.node), []
    MapOdometry(ros.node, guard, 'map', lambda *pose: poses.append(pose))
    odometry = ros.node.create_publisher(Odometry, '~/odom', qos.live(1))
    ros.until(odometry.get_subscription_count)
    message = Odometry(header=header('nowhere', wire.stamp(5.0)))
    message.pose.pose = pose_message((3.0, 0.5, 0.3))
    odometry.publish(message)
    ros.until(lambda: guard.rejected['202 UnknownFrame'])
    message.header.frame_id, message.pose.covariance[0], message.pose.covariance[7] = 'odom', 1e-4, 1e-4
    odometry.publish(message)
    ((pose, time, error),) = ros.until(lambda: poses)
    assert pose == pytest.approx([0.5, 5.0, 0.3 + np.pi / 2]) and time == 5.0
    assert error == pytest.approx(0.0303, abs=1e-4)
