"""Asking a planner node, from a program that spins for nothing else."""
from __future__ import annotations

import os
import time
from collections.abc import Callable

from mobile_planning_msgs.msg import PlanProgress
from mobile_planning_msgs.srv import PlanPath
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from rclpy.exceptions import NameValidationException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from mobile_planning.errors import InvalidInput, NoMap, PlanningError
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import seconds
from mobile_planning.nodes.convert_map import occupancy_grid
from mobile_planning.nodes.spin import spin_until
from mobile_planning.nodes.stop_signals import StopSignals
from mobile_planning.world.occupancy_grid import OccupancyGrid


class Client:
    """Asks a planner node for paths, and waits no longer than it is told.

    Parameters
    ----------
    node : rclpy.node.Node
    stop : StopSignals
    """

    def __init__(self, node: Node, stop: StopSignals):
        self._node, self._stop = node, stop
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)

    def close(self) -> None:
        """Let go of the node."""
        self._executor.shutdown()

    def ask(self, name: str, request: PlanPath.Request, timeout: float,
            show: Callable[[PlanProgress], None] | None = None) -> PlanPath.Response:
        """Return the answer of the node ``name``; as long as it has no map yet, it is asked again.

        Parameters
        ----------
        name : str
        request : PlanPath.Request
        timeout : float [s]
            How long to wait for the node, and for its answer beyond the deadline.
        show : callable, optional
            Called with what the node tells meanwhile of plans that take long, be they for this request or another.

        Raises
        ------
        PlanningError
            If the node is not there or does not answer in time.
        """
        try:
            client = self._node.create_client(PlanPath, f'{name}/plan_path')
            if show is not None:
                self._node.create_subscription(PlanProgress, f'{name}/progress', show, qos.PROGRESS)
        except NameValidationException:
            raise InvalidInput(f'{name!r} is no name of a node') from None
        if not self._wait(client.service_is_ready, timeout):
            raise PlanningError(
                f'no service {client.service_name} came within {timeout:g} s in ROS_DOMAIN_ID '
                f'{os.environ.get("ROS_DOMAIN_ID") or 0}: start the node {name}, or name another with --node')
        end = time.monotonic() + timeout
        while True:
            future = client.call_async(request)
            if not self._wait(future.done, timeout + seconds(request.deadline)):
                raise PlanningError(f'{client.service_name} has not answered within {timeout:g} s beyond the deadline')
            if future.result().error_code != NoMap.code or time.monotonic() > end:
                return future.result()
            self._wait(lambda: False, 0.1)

    def map(self, topic: str, timeout: float) -> OccupancyGrid:
        """Return the latched map of a topic.

        Raises
        ------
        PlanningError
            If none comes in time.
        """
        messages = []
        self._node.create_subscription(OccupancyGridMessage, topic, messages.append, qos.MAP)
        if not self._wait(lambda: messages, timeout):
            raise PlanningError(f'no map came on {topic!r} within {timeout:g} s')
        return occupancy_grid(messages[0])

    def _wait(self, condition: Callable[[], object], timeout: float) -> bool:
        """Spin until the condition holds, and return whether it came to that in time."""
        def is_over():
            if condition():
                return True
            if self._stop.received:
                raise PlanningError('interrupted')
            return False
        return spin_until(self._executor, is_over, timeout, 0.05)
