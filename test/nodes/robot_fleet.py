"""What tests of robots say to them and hear of them."""
from functools import partial

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage

from mobile_planning.fleet.announcement import Announcement
from mobile_planning.nodes import convert_mission, convert_robot, qos
from mobile_planning.nodes.convert_map import map_message
from mobile_planning.nodes.robot import RobotNode
from mobile_planning.world.occupancy_grid import OccupancyGrid

FREE = OccupancyGrid(np.zeros((40, 40), np.int8), 0.1)
WALL = OccupancyGrid(np.full((40, 40), 100, np.int8), 0.1)
#: Half a metre ahead, in quick sections, which a base that turns sharply keeps to.
QUICK = {'start': [1.0, 1.0, 0.0], 'goal': [1.5, 1.0, 0.0], 'Tc': 0.1, 'Tp': 1.0,
         'base_alpha_max': 60.0}


class Fleet:
    """What the tests say to robots, and what they hear of them."""

    def __init__(self, ros):
        self._ros = ros
        publish = ros.node.create_publisher
        self._maps = publish(OccupancyGridMessage, '/map', qos.MAP)
        self._missions = publish(MissionMessage, '/mission', qos.MISSION)
        self.peers = publish(RobotMessage, '/robot_msgs', qos.robot_messages())
        self.messages = ros.listen(RobotMessage, '/robot_msgs', qos.robot_messages(100))
        self.solutions = ros.listen(SolutionMessage, '/solutions', qos.SOLUTION_READER)
        self.diagnostics = ros.listen(DiagnosticArray, '/diagnostics', qos.DIAGNOSTICS)

    @property
    def now(self):
        """The robots' clock [s]."""
        return self._ros.node.get_clock().now().nanoseconds * 1e-9

    def robot(self, robot_id=1, **parameters):
        """Start a robot."""
        named = partial(RobotNode, cli_args=['--ros-args', '-r', f'__node:=robot_{abs(robot_id)}'])
        return self._ros.add(named, robot_id=robot_id, **{**QUICK, **parameters})

    def map(self, grid=FREE, frame='map'):
        """Publish a map."""
        self._maps.publish(map_message(grid, frame, self._ros.node.get_clock().now().to_msg()))

    def announce(self, state, ids=(1,), start=0.0, name='m', left_out=()):
        """Announce a mission."""
        announcement = Announcement(name, state, tuple(ids), start, tuple(left_out))
        self._missions.publish(convert_mission.mission_message(announcement, self.now))

    def say(self, message):
        """Publish what a peer says."""
        self.peers.publish(convert_robot.robot_message(message, self.now, 'map'))

    def hear(self, condition=lambda message: True):
        """Return a robot's next message that meets the condition."""
        self.messages.clear()
        return self._ros.until(lambda: next(filter(condition, self.messages), None))

    def diagnosis(self, condition=lambda status: True):
        """Return a robot's next status that meets the condition, and its facts."""
        self.diagnostics.clear()
        status = self._ros.until(lambda: next(
            (array.status[0] for array in self.diagnostics if condition(array.status[0])), None))
        return status, {entry.key: entry.value for entry in status.values}
