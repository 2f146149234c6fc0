"""The node ``robot``: one agent of a fleet, its plans and its simulated base."""
from __future__ import annotations

from dataclasses import dataclass
from time import time

import numpy as np
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from nav_msgs.msg import OccupancyGrid, Odometry, Path
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.scenarios import MAX_ROBOTS, RobotSpec, Scene, load_scene
from mobile_planning.nodes import convert, fleet_convert, qos
from mobile_planning.nodes.diagnostics import Diagnostics, Level
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.parameters import Parameters, option

# Messages of so many robots fit between two turns of the executor.
_MOST_ROBOTS = 64


@dataclass(frozen=True)
class RobotOptions:
    """Parameters of the node."""

    robot_id: int = option(0, 'id of this robot, its place in the right of way', low=0, high=2**32 - 1,
                           read_only=True)
    scene: str = option('', 'YAML file of the scene that names this robot; empty: the parameters below', read_only=True)
    scene_robots: int = option(0, 'robots the scene is to have, 0 for as many as it says', low=0, high=MAX_ROBOTS,
                               read_only=True)
    start: tuple = option((0.0, 0.0, 0.0), 'start pose x, y, theta [m, m, rad]', read_only=True)
    goal: tuple = option((0.0, 0.0, 0.0), 'goal pose x, y, theta [m, m, rad]', read_only=True)
    radius: float = option(0.2, 'of the body [m]', low=0.01, high=100.0, read_only=True)
    u_max: tuple = option((1.0, 5.0), 'greatest speed and turn rate [m/s, rad/s]', read_only=True)
    a_max: tuple = option((2.0, 10.0), 'greatest acceleration and turn acceleration [m/s^2, rad/s^2]', read_only=True)
    margin: float = option(0.025, 'added to the radius for tracking, clock and numeric errors [m]', low=0.0, high=1.0,
                           read_only=True)
    Tc: float = option(0.25, 'between two sections, and between knots [s]', low=0.05, high=5.0, read_only=True)
    Tp: float = option(3.0, 'length of a plan, 4 to 100 Tc [s]', low=0.2, high=60.0, read_only=True)
    frame_id: str = option('map', 'frame of all poses', read_only=True)
    odom_rate: float = option(10.0, 'of ~/odom [Hz]', low=0.1, high=100.0, read_only=True)

    def __post_init__(self):
        if not 4 * self.Tc <= self.Tp <= 100 * self.Tc:
            raise InvalidInput(f'Tp is {self.Tp} s, not within 4 to 100 Tc, which are {4 * self.Tc} to '
                               f'{100 * self.Tc} s')

    def load_scene(self) -> Scene:
        """Return the scene that is named, or one of this robot alone on the map."""
        if self.scene:
            return load_scene(self.scene, self.scene_robots or None)
        return Scene('parameters', (RobotSpec(self.robot_id, self.start, self.goal, self.radius, self.u_max,
                                              self.a_max),), on_map=True)


class RobotNode(Node):
    """Wires an `Agent` to the fleet's topics and to the clock."""

    def __init__(self, **kwargs):
        super().__init__('robot', enable_rosout=False, **kwargs)
        options = Parameters(self, RobotOptions).values
        scene = options.load_scene()
        self._frame, self._guard = options.frame_id, Guard(self)
        # The epoch is the system's time: simulated time begins anew with every simulation.
        self._agent = Agent(scene, options.robot_id, int(time()), self._now(), Tc=options.Tc, Tp=options.Tp,
                            margin=options.margin)
        self._shown, self._has_reported = None, False
        self._messages = self.create_publisher(RobotMessage, '/robot_msgs', qos.robot_messages())
        self._solutions = self.create_publisher(SolutionMessage, '/solutions', qos.SOLUTION_WRITER)
        self._plans = self.create_publisher(Path, '~/plan', qos.PATH)
        self._odometry = self.create_publisher(Odometry, '~/odom', qos.live(1))
        guarded = self._guard.callback
        self.create_subscription(RobotMessage, '/robot_msgs', guarded(self._on_robot_message),
                                 qos.robot_messages(4 * _MOST_ROBOTS))
        self.create_subscription(MissionMessage, '/mission', guarded(self._on_mission), qos.MISSION)
        if scene.on_map:
            self.create_subscription(OccupancyGrid, '/map', guarded(self._on_map), qos.MAP)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(options.Tc, guarded(self._on_cycle), clock=steady)
        self.create_timer(1.0 / options.odom_rate, guarded(self._on_odometry), clock=steady)
        Diagnostics(self, self._guard, self._diagnosis)

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _on_map(self, message):
        convert.check_frame(message.header.frame_id, self._frame, 'the map')
        self._agent.take_map(convert.occupancy_grid(message), self._now())
        self.get_logger().info(f'map of {message.info.width} x {message.info.height} cells received')

    def _on_mission(self, message):
        announcement = fleet_convert.announcement(message)
        self._agent.follow(announcement)
        self.get_logger().info(f'mission {announcement.name[:80]}: {announcement.state.name.lower()}')
        self._report()

    def _on_robot_message(self, message):
        self._agent.receive(fleet_convert.robot_msg(message, self._frame), self._now())

    def _on_cycle(self):
        now = self._now()
        for message in self._agent.step(now):
            self._messages.publish(fleet_convert.robot_message(message, now, self._frame))
            self._show(message, now)
        self._report()

    def _show(self, message, now):
        """Publish the plan in force where it is new."""
        key = message.boot_epoch, message.plan_seq
        if key != self._shown:
            self._shown = key
            poses = np.column_stack([message.ip_z1, message.ip_z2, np.zeros(len(message.ip_z1))])
            self._plans.publish(convert.path_message(poses, self._frame, fleet_convert.stamp(now)))

    def _report(self):
        """Publish what was driven, once that is all."""
        if not self._agent.is_finished or self._has_reported:
            return
        self._solutions.publish(fleet_convert.solution_message(
            self._agent.robot.sol, self._agent.epoch, self._now(), self._frame))
        self._has_reported = True
        self.get_logger().info('at the goal' if self._agent.robot.is_done else 'stopped on the way')

    def _on_odometry(self):
        if self._agent.robot is not None:
            now = self._now()
            self._odometry.publish(fleet_convert.odometry(
                self._agent.robot.state(now), now, self._frame, f'{self.get_name()}/base_link'))

    def _diagnosis(self):
        robot = self._agent.robot
        if robot is None:
            return Level.WARN, self._agent.trouble, {}
        return Level.OK, robot.mode.name.lower(), {
            'peers heard': len(robot.heard()), 'plans': len(robot.sol.plans), 'messages ignored': robot.ignored,
            'longest section [ms]': f'{1e3 * max(robot.ctime[-100:], default=0.0):.1f}'}
