"""FleetBus: the topics that all robots share, for the robots of one process.

Each message is made an object once, however many robots of the process it is for, and only when it is to be listened
to: what is to be turned away, and contracts between others, are told by how they begin.
"""
from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from functools import partial
from math import nan
from time import monotonic
from typing import Any

from mobile_planning_msgs.msg import Contracts as ContractsMessage
from mobile_planning_msgs.msg import Deaths, ObstacleArray
from mobile_planning_msgs.msg import JointPlan as JointPlanMessage
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from nav_msgs.msg import OccupancyGrid
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.losses import Losses
from mobile_planning.fleet.message import Contracts, RobotMsg
from mobile_planning.fleet.peers import PeerTable
from mobile_planning.fleet.postscript import Postscript
from mobile_planning.fleet.solution import Solution
from mobile_planning.nodes import (
    convert, convert_contracts, convert_joint_plan, convert_mission, convert_robot, qos, skim, wire)
from mobile_planning.nodes.convert_map import occupancy_grid
from mobile_planning.nodes.guard import Guard

#: Messages of so many robots fit between two turns of the executor.
_MOST_ROBOTS = 64
#: Bytes of a publisher's id that name its process: Fast DDS's prefix of a GUID.
_PROCESS = 12


class FleetBus:
    """What the robots of one process say to the fleet and hear of it.

    Parameters
    ----------
    node : rclpy.node.Node
        That has the topics.
    guard : Guard
    frame : str
        Of everything.

    Attributes
    ----------
    peers : PeerTable
    losses : Losses
        Of what the robots of other processes say.
    """

    def __init__(self, node: Node, guard: Guard, frame: str):
        self.peers, self.losses = PeerTable(), Losses()
        self._node, self._frame, self._guard = node, frame, guard
        self._robots: dict[int, Any] = {}
        self._publishers = {}
        # Most links and contracts are between others.
        kinds = ((RobotMsg, RobotMessage, '/robot_msgs', partial(convert_robot.robot_msg, to=self._robots)),
                 (Contracts, ContractsMessage, '/contracts', partial(convert_contracts.contracts, to=self._robots)),
                 (JointPlan, JointPlanMessage, '/joint_plans', convert_joint_plan.joint_plan))
        for kind, message, topic, to_core in kinds:
            self._publishers[kind] = node.create_publisher(message, topic, qos.robot_messages())
            node.create_subscription(message, topic, guard.callback(self._hearing(message, to_core)),
                                     qos.robot_messages(4 * _MOST_ROBOTS), raw=True)
        self._solutions = node.create_publisher(SolutionMessage, '/solutions', qos.latched(_MOST_ROBOTS))
        self._listen(MissionMessage, '/mission', qos.MISSION, convert_mission.announcement, 'on_mission')
        self._listen(ObstacleArray, '/obstacles', qos.latched(),
                     partial(convert_mission.obstacles, frame=frame), 'on_obstacles')
        self._listen(Deaths, '/deaths', qos.latched(), partial(convert_mission.deaths, frame=frame), 'on_deaths')
        self._has_map = False

    def add(self, robot) -> None:
        """Tell a robot of this process what is heard from now on.

        Parameters
        ----------
        robot : RobotNode
        """
        self._robots[robot.robot_id] = robot
        if robot.needs_map and not self._has_map:
            self._has_map = True
            self._listen(OccupancyGrid, '/map', qos.MAP, self._grid, 'on_map')

    def now(self) -> float:
        """Return the common time of the fleet [s]."""
        return self._node.get_clock().now().nanoseconds * 1e-9

    def say(self, messages: Iterable[RobotMsg | Contracts | JointPlan], postscript: Postscript,
            roster: Iterable[int]) -> None:
        """Publish what a robot says; each message is stamped with the time at which it goes out.

        Parameters
        ----------
        messages : iterable of RobotMsg, Contracts, JointPlan
        postscript : Postscript
            But for the lags, which are known here.
        roster : iterable of int
            To whom they are told.
        """
        for message in messages:
            if isinstance(message, RobotMsg):
                lags = {other: self.peers.lag(other) for other in roster}
                content = convert_robot.robot_message(message, self.now(), self._frame, replace(postscript, lags=lags))
            elif isinstance(message, Contracts):
                content = convert_contracts.contracts_message(message, self.now(), self._frame)
            else:
                content = convert_joint_plan.joint_plan_message(message, self.now(), self._frame)
            self._publishers[type(message)].publish(content)

    def hand_in(self, solution: Solution, epoch: int) -> None:
        """Publish what a robot has driven."""
        self._solutions.publish(convert_mission.solution_message(solution, epoch, self.now(), self._frame))

    def _listen(self, kind, topic, profile, to_core, name):
        """Subscribe to what concerns every robot of this process."""
        def tell(message):
            content = to_core(message)
            for robot in self._robots.values():
                getattr(robot, name)(content)
        tell.__name__ = name
        self._node.create_subscription(kind, topic, self._guard.callback(tell), profile)

    def _grid(self, message):
        convert.check_frame(message.header.frame_id, self._frame, 'the map')
        return occupancy_grid(message)

    def _hearing(self, kind: type, to_core: Callable) -> Callable:
        """Return the callback of what robots say to each other, serialised."""
        def hear(content, info):
            head = skim.head(content)
            own = self._robots.get(head.robot_id)
            is_own = own is not None and own.epoch == head.boot_epoch
            if is_own and len(self._robots) == 1:
                return
            now, time = monotonic(), self.now()
            if own is None:
                self.peers.admit(head.robot_id, head.boot_epoch, process_of(info), stamp=head.stamp, time=time, now=now)
                if kind is not JointPlanMessage:
                    # Joint plans are numbered apart.
                    self.losses.note(head.robot_id, head.boot_epoch, head.sequence, now)
                if kind is ContractsMessage and not self._concerns(content, head):
                    return
            message = _deserialised(content, kind)
            told = to_core(message, self._frame)
            if own is None and kind is RobotMessage:
                self._note_lag(message, time, now)
            for robot_id, robot in self._robots.items():
                if robot_id != head.robot_id or not is_own:
                    robot.hear(told, time)
        return hear

    def _concerns(self, content, head):
        """Whether Contracts is to be looked at: it is for a robot of this process, or to be refused."""
        is_sound = head.frame == self._frame and head.version == wire.layout(ContractsMessage)
        return not is_sound or skim.concerns(content, head.size, self._robots)

    def _note_lag(self, message, time, now):
        told = convert_robot.postscript(message).lags
        self.peers.note(message.robot_id, time - convert.seconds(message.header.stamp),
                        next((told[robot_id] for robot_id in self._robots if robot_id in told), nan), now)


def _deserialised(content, kind):
    """Return a message of ``kind`` as an object."""
    try:
        return deserialize_message(content, kind)
    except RuntimeError as error:
        raise InvalidInput(f'a {kind.__name__} of {len(content)} bytes cannot be read: {error}') from None


def process_of(info: Mapping) -> bytes | None:
    """Return what names the process that a message comes from; None where the middleware does not tell."""
    gid = info.get('publisher_gid')
    return bytes(gid['data'][:_PROCESS]) if gid else None
