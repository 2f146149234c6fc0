"""Waiting for one message without holding up the executor."""
from __future__ import annotations

from typing import TypeVar

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.exceptions import NameValidationException
from rclpy.node import Node

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.nodes import qos

Message = TypeVar('Message')


async def latched_message(node: Node, kind: type[Message], topic: str, timeout: float) -> Message:
    """Return the first message of a latched topic.

    To be awaited in a coroutine callback of ``node`` in a ReentrantCallbackGroup: the default group would wait with it.

    Parameters
    ----------
    node : rclpy.node.Node
    kind : type
        Of the message.
    topic : str
    timeout : float [s]
        Of the wall's clock, whatever simulated time does.

    Raises
    ------
    InvalidInput
        If no topic can have that name.
    PlanningError
        If no message comes in time.
    """
    arrived = node.executor.create_future()

    def finish(message=None):
        if not arrived.done():
            arrived.set_result(message)

    try:
        subscription = node.create_subscription(kind, topic, lambda message: finish(message), qos.latched())
    except NameValidationException:
        raise InvalidInput(f'{topic!r} is no name of a topic') from None
    timer = node.create_timer(timeout, lambda: finish(), clock=Clock(clock_type=ClockType.STEADY_TIME))
    try:
        message = await arrived
    finally:
        node.destroy_subscription(subscription)
        node.destroy_timer(timer)
    if message is None:
        raise PlanningError(f'no message came on {topic!r} within {timeout:g} s')
    return message
