"""How far the planning under way is: counted by the thread that plans, published by the executor's.

The planners count in an array, which costs them nothing. A timer of the executor looks at it, and only while somebody
waits for an answer.
"""
from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from mobile_planning_msgs.msg import PlanProgress
from numpy.typing import NDArray
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.lifecycle import LifecycleNode

from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import duration_message, header, pose_message
from mobile_planning.nodes.guard import Guard

# Between two messages, and what takes less than this has none [s].
PERIOD, PATIENCE = 0.1, 0.3


@dataclass(frozen=True, eq=False)
class UnderWay:
    """Planning that has begun and is not over.

    Attributes
    ----------
    planner : str
    goal : (3,) tuple of float [m, m, rad]
    frame : str
    done : (2,) ndarray of int64
        What is done, and of how much; 0 of 0 where the planner cannot tell.
    began : float [s]
        On the monotonic clock.
    """

    planner: str
    goal: tuple[float, float, float]
    frame: str
    done: NDArray[np.int64] = field(default_factory=lambda: np.zeros(2, np.int64))
    began: float = field(default_factory=time.monotonic)

    @property
    def elapsed(self) -> float:
        """Time since it began [s]."""
        return time.monotonic() - self.began

    @property
    def share(self) -> float:
        """Share of the work that is done, from 0 to 1, or NaN."""
        done, whole = self.done.tolist()
        return min(1.0, done / whole) if whole else float('nan')


class ProgressPublisher:
    """Publishes on ``~/progress`` while a plan takes long.

    Parameters
    ----------
    node : rclpy.lifecycle.LifecycleNode
    guard : Guard
    look : callable
        Returns what is under way, or None.
    """

    def __init__(self, node: LifecycleNode, guard: Guard, look: Callable[[], UnderWay | None]):
        self._node, self._look, self._watchers = node, look, 0
        self._publisher = node.create_lifecycle_publisher(PlanProgress, '~/progress', qos.PROGRESS)
        self._timer = node.create_timer(PERIOD, guard.callback(self._publish),
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._timer.cancel()

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Publish, if it takes long, until the ``with`` block is over."""
        self._watchers += 1
        if self._timer.is_canceled():
            self._timer.reset()
        try:
            yield
        finally:
            # The timer ends by itself: it may be destroyed by now.
            self._watchers -= 1

    def destroy(self) -> None:
        """Give back the publisher and the timer."""
        self._node.destroy_timer(self._timer)
        self._node.destroy_lifecycle_publisher(self._publisher)

    def _publish(self):
        """Publish how far the planning under way is, if it takes long, and stop when nobody waits for it."""
        if self._watchers == 0:
            self._timer.cancel()
        under_way = self._look()
        if under_way is not None and under_way.elapsed >= PATIENCE:
            self._publisher.publish(PlanProgress(
                header=header(under_way.frame, self._node.get_clock().now().to_msg()), planner=under_way.planner,
                goal=pose_message(under_way.goal), elapsed=duration_message(under_way.elapsed),
                share=under_way.share))
