"""RobotServices: what people and programs may ask of one robot."""
from __future__ import annotations

from collections.abc import Callable

from geometry_msgs.msg import PoseStamped
from mobile_planning_msgs.srv import SetGoal
from nav_msgs.msg import Path
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from mobile_planning.errors import InvalidInput, LimitExceeded
from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.itinerary import How
from mobile_planning.fleet.reference_path import MAX_PATH
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import check_frame, configuration, planar
from mobile_planning.nodes.guard import Guard, tell_code, tell_sentence
from mobile_planning.nodes.navigate_action import NavigateAction
from mobile_planning.nodes.robot_options import RobotOptions


class RobotServices:
    """``~/set_goal``, ``~/pause``, ``~/resume``, ``~/reference_path``, and what it is asked to have beside them.

    That is ``/goal_pose`` and the action ``~/navigate_to_pose``.

    Parameters
    ----------
    node : rclpy.node.Node
        That has them.
    guard : Guard
    options : RobotOptions
    agent : Agent
    now : callable
        Returns the common time [s].
    submit : callable
        Lets the worker do something, and returns the future of its result.
    """

    def __init__(self, node: Node, guard: Guard, options: RobotOptions, agent: Agent, now: Callable[[], float],
                 submit: Callable[..., Future]):
        self._agent, self._frame, self._now, self._submit = agent, options.frame_id, now, submit
        aside = ReentrantCallbackGroup()
        for kind, name, act, fail in ((SetGoal, '~/set_goal', self._on_set_goal, tell_code),
                                      (Trigger, '~/pause', self._on_pause, tell_sentence),
                                      (Trigger, '~/resume', self._on_resume, tell_sentence)):
            node.create_service(kind, name, guard.service(act, fail), callback_group=aside)
        node.create_subscription(Path, '~/reference_path', guard.callback(self._on_reference_path), qos.live(1),
                                 callback_group=aside)
        self._navigate = None
        if options.navigate_to_pose:
            self._navigate = NavigateAction(node, guard, agent, options.frame_id, now, submit)
        if options.takes_goal_pose:
            node.create_subscription(PoseStamped, '/goal_pose', guard.callback(self._on_goal_pose), qos.live(1),
                                     callback_group=aside)

    def close(self) -> None:
        """End what its node would not end by itself."""
        if self._navigate is not None:
            self._navigate.close()

    async def _on_set_goal(self, request, response):
        if request.how not in list(How):
            raise InvalidInput(f'how is {request.how}, not 0 to {max(How)}')
        goals = [configuration(goal, self._frame, f'goal {index}') for index, goal in enumerate(request.goals)]
        await self._submit(self._agent.set_goals, goals, How(request.how), self._now())
        return response

    async def _on_goal_pose(self, message):
        goal = configuration(message, self._frame, '/goal_pose')
        await self._submit(self._agent.set_goals, [goal], How.REPLACE, self._now())

    async def _on_reference_path(self, message):
        check_frame(message.header.frame_id, self._frame, '~/reference_path')
        if len(message.poses) > MAX_PATH:
            raise LimitExceeded(f'~/reference_path has {len(message.poses)} poses, the limit is {MAX_PATH}')
        poses = [planar(pose.pose, f'pose {index} of ~/reference_path') for index, pose in enumerate(message.poses)]
        await self._submit(self._agent.follow_path, poses, self._now())

    async def _on_pause(self, _request, response):
        await self._submit(self._agent.hold, 'service', 'paused by ~/pause', self._now())
        response.success, response.message = True, 'the robot comes to rest'
        return response

    async def _on_resume(self, _request, response):
        await self._submit(self._agent.release, 'service', self._now())
        response.success, response.message = True, self._agent.trouble or 'the robot drives on'
        return response
