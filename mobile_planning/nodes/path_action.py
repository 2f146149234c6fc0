"""The action ``~/compute_path``: planning that can be watched and withdrawn."""
from __future__ import annotations

import time
from collections.abc import Awaitable, Callable

import numpy as np
from mobile_planning_msgs.action import ComputePath
from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from rclpy.callback_groups import CallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleNode
from rclpy.task import Future

from mobile_planning.errors import Cancelled
from mobile_planning.nodes.convert import duration_message
from mobile_planning.nodes.guard import Guard, tell_code
from mobile_planning.sampling_server import Progress

# Between two messages of feedback [s].
PERIOD = 0.1


class UnderWay:
    """One goal that is waited for.

    Attributes
    ----------
    stop : (1,) ndarray of uint8
        What its planning looks at.
    progress : Progress
    future : rclpy.task.Future or None
        Of its answer, once somebody works on it.
    """

    def __init__(self):
        self.stop, self.progress = np.zeros(1, np.uint8), Progress()
        self.future: Future | None = None

    def withdraw(self) -> None:
        """End it: whoever waits is told at once, and the planning stops as soon as it looks."""
        self.stop[0] = 1
        if self.future is not None and not self.future.done():
            self.future.set_exception(Cancelled('the goal was withdrawn'))


class PathAction:
    """Serves the action, any number of goals at a time.

    Parameters
    ----------
    node : rclpy.lifecycle.LifecycleNode
    guard : Guard
    answer : coroutine function (request, under_way) -> ComputePath.Result
        Plans for one goal; sets ``under_way.future`` to what it waits for.
    group : rclpy.callback_groups.CallbackGroup
        Reentrant.
    """

    def __init__(self, node: LifecycleNode, guard: Guard,
                 answer: Callable[[ComputePath.Goal, UnderWay], Awaitable[ComputePath.Result]], group: CallbackGroup):
        self._guard, self._answer = guard, answer
        self._under_way: dict[bytes, tuple[ServerGoalHandle, UnderWay]] = {}
        self._server = ActionServer(node, ComputePath, '~/compute_path', self._execute, callback_group=group,
                                    cancel_callback=self._on_cancel)
        self._timer = node.create_timer(PERIOD, guard.callback(self._feed_back),
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._node = node

    def close(self) -> None:
        """Withdraw all goals and end the action."""
        for _, under_way in list(self._under_way.values()):
            under_way.withdraw()
        self._node.destroy_timer(self._timer)
        self._server.destroy()

    async def _execute(self, handle):
        """Plan for one goal and return its result."""
        key, under_way = bytes(handle.goal_id.uuid), UnderWay()
        self._under_way[key] = handle, under_way
        if handle.is_cancel_requested:
            under_way.withdraw()
        try:
            result = await self._answer(handle.request, under_way)
            handle.succeed()
            return result
        except Exception as error:
            self._guard.note(error, 'compute_path')
            result = ComputePath.Result()
            tell_code(result, error)
            if handle.is_cancel_requested:
                handle.canceled()
            else:
                handle.abort()
            return result
        finally:
            del self._under_way[key]

    def _on_cancel(self, handle):
        """Withdraw one goal."""
        under_way = self._under_way.get(bytes(handle.goal_id.uuid))
        if under_way is not None:
            under_way[1].withdraw()
        return CancelResponse.ACCEPT

    def _feed_back(self):
        """Tell those who wait how far their goals are."""
        for handle, under_way in self._under_way.values():
            progress = under_way.progress
            if progress.began is not None and handle.is_active:
                handle.publish_feedback(ComputePath.Feedback(
                    best_cost=float(progress.best_cost), nodes=int(progress.nodes),
                    elapsed=duration_message(time.monotonic() - progress.began)))
