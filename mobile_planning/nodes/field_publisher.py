"""Publishing the costs from every cell of a map to a goal."""
from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from mobile_planning_msgs.msg import CostToGo
from numpy.typing import NDArray
from rclpy.lifecycle import LifecycleNode

from mobile_planning.nodes import qos
from mobile_planning.nodes.convert_map import cost_to_go_message
from mobile_planning.world.occupancy_grid import OccupancyGrid


class FieldPublisher:
    """Publishes on ``~/cost_to_go``.

    Parameters
    ----------
    node : rclpy.lifecycle.LifecycleNode
    """

    def __init__(self, node: LifecycleNode):
        self._node = node
        self._publisher = node.create_lifecycle_publisher(CostToGo, '~/cost_to_go', qos.PATH)

    def publish(self, grid: OccupancyGrid, frame: str, goal: Iterable[float], planner: str,
                field: NDArray[np.float64]) -> None:
        """Publish a field (h, w) [m] of a planner to a goal (3,) [m, m, rad]; see `convert_map.cost_to_go_message`."""
        stamp = self._node.get_clock().now().to_msg()
        self._publisher.publish(cost_to_go_message(grid, field, goal, planner, frame, stamp))

    def destroy(self) -> None:
        """Give back the publisher."""
        self._node.destroy_lifecycle_publisher(self._publisher)
