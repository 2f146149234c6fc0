"""Publishing each path once the answer is out, for which somebody waits."""
from __future__ import annotations

from nav_msgs.msg import Path
from numpy.typing import ArrayLike
from rclpy.lifecycle import LifecycleNode

from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import path_message
from mobile_planning.nodes.guard import Guard

MOST_POSES_KEPT = 10_000


class PathPublisher:
    """Writes every path into the same messages, and publishes it before the next one is written.

    Parameters
    ----------
    node : rclpy.lifecycle.LifecycleNode
    guard : Guard
    """

    def __init__(self, node: LifecycleNode, guard: Guard):
        self._node = node
        self._publish_soon = guard.callback(self._publish)
        self._publisher = node.create_lifecycle_publisher(Path, '~/path', qos.PATH)
        # The newest path until it is published, and the poses that all paths are written into.
        self._path, self._poses = None, []

    def message(self, poses: ArrayLike, frame: str) -> Path:
        """Return the message of a path, to be published when the executor comes to it.

        Parameters
        ----------
        poses : (N, 3) array_like [m, m, rad]
        frame : str
        """
        self._publish()
        self._path = path_message(poses, frame, self._node.get_clock().now().to_msg(), self._poses)
        del self._poses[MOST_POSES_KEPT:]
        self._node.executor.create_task(self._publish_soon)
        return self._path

    def destroy(self) -> None:
        """Give back the publisher; paths are still written, for requests that came before, but not published."""
        self._node.destroy_lifecycle_publisher(self._publisher)
        self._publisher = None

    def _publish(self):
        """Publish the newest path, if that is still to be done."""
        if self._path is not None and self._publisher is not None:
            self._publisher.publish(self._path)
        self._path = None
