"""What a node says about itself on /diagnostics, once a second."""
from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import Enum

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import key_values
from mobile_planning.nodes.guard import Guard

PERIOD = 1.0  # [s]


class Level(Enum):
    """How a node is, in the levels of ``diagnostic_msgs``."""

    OK = DiagnosticStatus.OK
    WARN = DiagnosticStatus.WARN
    ERROR = DiagnosticStatus.ERROR


class Diagnostics:
    """Publishes the state of a node, with the failures its guard has met.

    Where the node itself is well, the level shows what happened since the message before: WARN for a rejected map or
    request, ERROR for a fault.

    Parameters
    ----------
    node : rclpy.node.Node
    guard : Guard
    report : callable
        Returns the node's own level, message and facts (a mapping of names to values).
    """

    def __init__(self, node: Node, guard: Guard,
                 report: Callable[[], tuple[Level, str, Mapping[str, object]]]):
        self._node, self._guard, self._report = node, guard, report
        self._seen = (0, 0)
        self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', qos.DIAGNOSTICS)
        # A node is diagnosed at the same pace when simulated time stands still.
        node.create_timer(PERIOD, guard.callback(self.publish), clock=Clock(clock_type=ClockType.STEADY_TIME))

    def publish(self) -> None:
        """Publish the state now."""
        level, message, facts = self._report()
        rejected, faults = self._guard.rejected.total(), self._guard.faults
        if level is Level.OK and (rejected, faults) != self._seen:
            level, message = Level.WARN if faults == self._seen[1] else Level.ERROR, self._guard.newest
        self._seen = rejected, faults
        counts = {f'rejected {kind}': count for kind, count in sorted(self._guard.rejected.items())}
        status = DiagnosticStatus(
            level=level.value, name=self._node.get_fully_qualified_name().lstrip('/'), message=message,
            values=key_values({**facts, 'rejected': rejected, 'faults': faults, **counts}))
        self._publisher.publish(DiagnosticArray(header=self._header(), status=[status]))

    def _header(self):
        """Return a header of now, without a frame."""
        header = DiagnosticArray().header
        header.stamp = self._node.get_clock().now().to_msg()
        return header
