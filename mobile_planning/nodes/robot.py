"""The node ``robot``: one agent of a fleet, its plans and its simulated base."""
from __future__ import annotations

from functools import partial
from time import time

import numpy as np
from mobile_planning_msgs.msg import Contracts as ContractsMessage
from mobile_planning_msgs.msg import JointPlan as JointPlanMessage
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.message import Contracts, RobotMsg
from mobile_planning.nodes import (
    convert,
    convert_contracts,
    convert_joint_plan,
    convert_mission,
    convert_robot,
    convert_views,
    qos,
    wire,
)
from mobile_planning.nodes.diagnostics import Diagnostics, Level
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.parameters import Parameters
from mobile_planning.nodes.robot_options import RobotOptions

# Messages of so many robots fit between two turns of the executor.
_MOST_ROBOTS = 64
# What falls due within this time [s] goes out in one message.
_ANSWER_AFTER = 0.03


class RobotNode(Node):
    """Wires an `Agent` to the fleet's topics and to the clock."""

    def __init__(self, **kwargs):
        super().__init__('robot', enable_rosout=False, **kwargs)
        options = Parameters(self, RobotOptions).values
        scene = options.load_scene()
        self._frame, self._guard = options.frame_id, Guard(self)
        # The epoch is the system's time: simulated time begins anew with every simulation.
        self._agent = Agent(scene, options.robot_id, int(time()), self._now(), Tc=options.Tc, Tp=options.Tp,
                            margin=options.margin, budget=options.budget)
        self._shown, self._has_reported = None, False
        guarded, to_miss_nobody = self._guard.callback, qos.robot_messages(4 * _MOST_ROBOTS)
        self._outlets = {}
        for kind, message_type, topic, to_message, to_core in (
                (RobotMsg, RobotMessage, '/robot_msgs', convert_robot.robot_message, convert_robot.robot_msg),
                (Contracts, ContractsMessage, '/contracts', convert_contracts.contracts_message,
                 convert_contracts.contracts),
                (JointPlan, JointPlanMessage, '/joint_plans', convert_joint_plan.joint_plan_message,
                 convert_joint_plan.joint_plan)):
            self._outlets[kind] = self.create_publisher(message_type, topic, qos.robot_messages()), to_message
            self.create_subscription(message_type, topic, guarded(partial(self._receive, to_core)), to_miss_nobody)
        self._solutions = self.create_publisher(SolutionMessage, '/solutions', qos.SOLUTION_WRITER)
        self._plans = self.create_publisher(Path, '~/plan', qos.PATH)
        self._odometry = self.create_publisher(Odometry, '~/odom', qos.live(1))
        self.create_subscription(MissionMessage, '/mission', guarded(self._on_mission), qos.MISSION)
        if scene.on_map:
            self.create_subscription(OccupancyGrid, '/map', guarded(self._on_map), qos.MAP)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._cycle = self.create_timer(options.Tc, guarded(self._on_cycle), clock=steady)
        self._answering = self.create_timer(_ANSWER_AFTER, guarded(self._on_answers), clock=steady)
        self._answering.cancel()
        self.create_timer(1.0 / options.odom_rate, guarded(self._on_odometry), clock=steady)
        Diagnostics(self, self._guard, self._diagnosis)

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _on_map(self, message):
        convert.check_frame(message.header.frame_id, self._frame, 'the map')
        self._agent.take_map(convert.occupancy_grid(message), self._now())
        self.get_logger().info(f'map of {message.info.width} x {message.info.height} cells received')

    def _on_mission(self, message):
        announcement = convert_mission.announcement(message)
        self._agent.follow(announcement)
        self.get_logger().info(f'mission {announcement.name[:80]}: {announcement.state.name.lower()}')
        self._report()

    def _receive(self, to_core, message):
        self._agent.receive(to_core(message, self._frame), self._now())
        if self._agent.has_answers and self._answering.is_canceled():
            self._answering.reset()

    def _on_answers(self):
        self._answering.cancel()
        now = self._now()
        self._send(self._agent.answers(now), now)

    def _on_cycle(self):
        # The period is set anew each time: the steady clock knows nothing of the phase of the common one.
        self._cycle.timer_period_ns = int(1e9 * self._agent.until_cycle(self._now()))
        self._cycle.reset()
        messages = self._agent.step(self._now)
        self._send(messages, self._now())
        self._report()

    def _send(self, messages, now):
        for message in messages:
            publisher, to_message = self._outlets[type(message)]
            publisher.publish(to_message(message, now, self._frame))
            if isinstance(message, RobotMsg):
                self._show(message, now)

    def _show(self, message, now):
        """Publish the plan in force where it is new."""
        key = message.boot_epoch, message.plan_seq
        if key != self._shown:
            self._shown = key
            poses = np.column_stack([message.ip_z1, message.ip_z2, np.zeros(len(message.ip_z1))])
            self._plans.publish(convert.path_message(poses, self._frame, wire.stamp(now)))

    def _report(self):
        """Publish what was driven, once that is all."""
        if not self._agent.is_finished or self._has_reported:
            return
        self._solutions.publish(convert_mission.solution_message(
            self._agent.robot.sol, self._agent.epoch, self._now(), self._frame))
        self._has_reported = True
        self.get_logger().info('at the goal' if self._agent.robot.is_done else 'stopped on the way')

    def _on_odometry(self):
        if self._agent.robot is not None:
            now = self._now()
            self._odometry.publish(convert_views.odometry(
                self._agent.robot.state(now), now, self._frame, f'{self.get_name()}/base_link'))

    def _diagnosis(self):
        robot = self._agent.robot
        if robot is None:
            return Level.WARN, self._agent.trouble, {}
        return Level.OK, robot.mode.name.lower(), {
            'peers heard': len(robot.heard()), 'plans': len(robot.sol.plans), 'messages ignored': robot.ignored,
            'longest section [ms]': f'{1e3 * max(robot.ctime[-100:], default=0.0):.1f}'}
