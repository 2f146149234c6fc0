"""The action ``~/navigate_to_pose``, as Nav2's navigator has it: drive there, tell how far it is, be called back."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from math import isfinite

import mobile_planning_msgs.action
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node
from rclpy.task import Future

from mobile_planning.errors import Cancelled, PlanningError
from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.itinerary import How
from mobile_planning.nodes import wire
from mobile_planning.nodes.convert import configuration, duration_message, pose_stamped
from mobile_planning.nodes.guard import Guard, tell_code

#: Between two messages of feedback, and two looks whether it is over [s].
PERIOD = 0.2


@dataclass(frozen=True)
class Errand:
    """A goal that is driven to.

    Attributes
    ----------
    handle : rclpy.action.server.ServerGoalHandle
    order : int
        Of the agent.
    began : float [s]
    end : rclpy.task.Future
        Done when it is over.
    """

    handle: ServerGoalHandle
    order: int
    began: float
    end: Future


def action_type() -> type:
    """Return Nav2's action where it is installed, else ours, which has the same fields."""
    try:
        return import_module('nav2_msgs.action').NavigateToPose
    except ImportError:
        return mobile_planning_msgs.action.NavigateToPose


class NavigateAction:
    """Serves the action for one robot.

    A goal takes the place of all that the robot has; one that is given another goal meanwhile, in whatever way, is
    aborted. A goal that is withdrawn is cancelled once the robot rests.

    Parameters
    ----------
    node : rclpy.node.Node
    guard : Guard
    agent : Agent
    frame : str
        Of all poses.
    now : callable
        Returns the common time [s].
    submit : callable
        Lets the worker do something, and returns the future of its result.
    """

    def __init__(self, node: Node, guard: Guard, agent: Agent, frame: str, now: Callable[[], float],
                 submit: Callable[..., Future]):
        self._guard, self._agent, self._frame, self._now, self._submit = guard, agent, frame, now, submit
        self._type, self._errands, aside = action_type(), [], ReentrantCallbackGroup()
        self._server = ActionServer(node, self._type, '~/navigate_to_pose', self._execute, callback_group=aside,
                                    cancel_callback=lambda handle: CancelResponse.ACCEPT)
        node.create_timer(PERIOD, guard.callback(self._look), callback_group=aside,
                          clock=Clock(clock_type=ClockType.STEADY_TIME))

    def close(self) -> None:
        """End the action, which its node would not do: it would be seen in the graph as long as its action lives."""
        self._server.destroy()

    async def _execute(self, handle):
        """Drive to one goal and return its result."""
        result, errand = self._type.Result(), None
        try:
            goal = configuration(handle.request.pose, self._frame, 'the goal')
            order = await self._submit(self._agent.set_goals, [goal], How.REPLACE, self._now())
            errand = Errand(handle, order, self._now(), Future())
            self._errands.append(errand)
            await errand.end
            handle.succeed()
        except Cancelled:
            handle.canceled()
        except Exception as error:
            self._guard.note(error, 'navigate_to_pose')
            if hasattr(result, 'error_code'):
                # Humble's has none.
                tell_code(result, error)
            handle.abort()
        finally:
            if errand is not None:
                self._errands.remove(errand)
        return result

    async def _look(self):
        """End what is over, and tell how far it is for what is not."""
        for errand in list(self._errands):
            now = self._now()
            if errand.handle.is_cancel_requested:
                await self._submit(self._agent.withdraw, errand.order, now)
            end = self._end_of(errand, now)
            if end is None:
                await self._feed_back(errand, now)
            elif not errand.end.done():
                (errand.end.set_exception if isinstance(end, Exception) else errand.end.set_result)(end)

    def _end_of(self, errand, now):
        """Return how an errand has ended: true, or an exception; None as long as it has not."""
        agent = self._agent
        if agent.journey.orders != errand.order:
            return PlanningError('the robot was given another goal')
        if errand.handle.is_cancel_requested:
            return Cancelled('the goal was withdrawn') if agent.is_at_rest(now) else None
        if agent.is_stopped:
            return PlanningError('the mission was stopped')
        return True if agent.is_finished else None

    async def _feed_back(self, errand, now):
        if not errand.handle.is_active:
            return
        left = await self._submit(self._agent.distance_left, now)
        robot = self._agent.robot
        remaining = left / robot.limits.v_max if isfinite(left) else 0.0
        errand.handle.publish_feedback(self._type.Feedback(
            current_pose=pose_stamped(robot.state(now)[:3], self._frame, wire.stamp(now)),
            navigation_time=duration_message(now - errand.began),
            estimated_time_remaining=duration_message(remaining), distance_remaining=float(left)))
