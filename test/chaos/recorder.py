"""Recorder: writes down what one host hears of the fleet, a line of JSON each; the robots of the host are never lost.

    python recorder.py FILE ROBOT_ID...        the robots whose bodies and status are written down too
"""
from __future__ import annotations

import json
import sys
from functools import partial
from math import nan
from time import time

import rclpy
from mobile_planning_msgs.msg import Mission, RobotMsg, RobotStatus, Solution
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

from mobile_planning.nodes import convert_mission, qos
from mobile_planning.nodes.convert import seconds


class Recorder(Node):
    """Subscribes, and writes each message as soon as it comes."""

    def __init__(self, file, robots):
        super().__init__('recorder')
        self._file = file
        self.create_subscription(RobotMsg, '/robot_msgs', self._on_robot, qos.robot_messages(256))
        self.create_subscription(Mission, '/mission', self._on_mission, qos.MISSION)
        self.create_subscription(Solution, '/solutions', self._on_solution, qos.SOLUTION_READER)
        for robot in robots:
            self.create_subscription(Odometry, f'/robot_{robot}/odom', partial(self._on_odometry, robot), qos.live(10))
            self.create_subscription(RobotStatus, f'/robot_{robot}/status', self._on_status, qos.live(10))

    def _write(self, kind, **fields):
        self._file.write(json.dumps({'kind': kind, 'heard': time(), **fields}) + '\n')
        self._file.flush()

    def _on_robot(self, message):
        self._write('robot', robot=message.robot_id, epoch=message.boot_epoch, sequence=message.sequence,
                    mode=message.mode, plan=message.plan_seq, step=message.step, first_knot=message.first_knot,
                    points=list(message.control_points), heading=message.heading,
                    final_heading=message.final_heading, reverse=message.reverse, done=message.done_planning)

    def _on_solution(self, message):
        plans = convert_mission.solution(message, message.header.frame_id).plans
        commits = [*message.commits, *[nan] * len(plans)]
        for number, (plan, commit) in enumerate(zip(plans, commits)):
            self._write('plan', robot=message.robot_id, epoch=message.boot_epoch, plan=number, commit=commit,
                        step=plan.step, first_knot=plan.first_knot, points=plan.points.ravel().tolist(),
                        heading=plan.heading, final_heading=plan.final_heading, reverse=plan.reverse)

    def _on_mission(self, message):
        self._write('mission', state=message.state, start=seconds(message.start))

    def _on_odometry(self, robot, message):
        place = message.pose.pose.position
        self._write('body', robot=robot, time=seconds(message.header.stamp), x=place.x, y=place.y)

    def _on_status(self, message):
        self._write('status', robot=message.robot_id, mode=message.mode, trouble=message.trouble,
                    silent=list(message.silent), tracking_error=message.tracking_error)


def main():
    """Record until a signal."""
    with open(sys.argv[1], 'a', encoding='utf-8') as file:
        rclpy.init()
        try:
            rclpy.spin(Recorder(file, [int(each) for each in sys.argv[2:]]))
        except (KeyboardInterrupt, ExternalShutdownException):
            return


if __name__ == '__main__':
    main()
