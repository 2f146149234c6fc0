"""Where a real base is on the map: from ``~/pose``, or from its odometry and TF."""
from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time

from mobile_planning.errors import InvalidInput, UnknownFrame
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import seconds
from mobile_planning.nodes.convert_pose import localisation_error, localised, placed
from mobile_planning.nodes.guard import Guard

#: Takes the pose (3,) [m, m, rad], the time [s] and the error [m].
Localise = Callable[[np.ndarray, float, float], None]


def require_tf() -> None:
    """Raise InvalidInput where tf2_ros is not installed."""
    if find_spec('tf2_ros') is None:
        raise InvalidInput('localisation is tf, but tf2_ros is not installed: publish the pose on ~/pose and set '
                           'localisation to pose')


class MapPose:
    """Hands on the pose of ``~/pose``.

    Parameters
    ----------
    node : rclpy.node.Node
    guard : Guard
    frame : str
        Of the map.
    localise : callable
    """

    def __init__(self, node: Node, guard: Guard, frame: str, localise: Localise):
        self._frame, self._localise = frame, localise
        node.create_subscription(PoseWithCovarianceStamped, '~/pose', guard.callback(self._on_pose), qos.live(1))

    def _on_pose(self, message):
        self._localise(localised(message, self._frame), seconds(message.header.stamp),
                       localisation_error(message.pose.covariance))


class MapOdometry:
    """Hands on the pose of ``~/odom`` in the frame of the map; TF says where the frame of the odometry is.

    Parameters
    ----------
    node : rclpy.node.Node
    guard : Guard
    frame : str
        Of the map.
    localise : callable
    """

    def __init__(self, node: Node, guard: Guard, frame: str, localise: Localise):
        import tf2_ros

        self._frame, self._localise, self._failure = frame, localise, tf2_ros.TransformException
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer, node)
        node.create_subscription(Odometry, '~/odom', guard.callback(self._on_odometry), qos.live(1))

    def _on_odometry(self, message):
        source = message.header.frame_id
        try:
            found = self._buffer.lookup_transform(self._frame, source, Time(), Duration())
        except self._failure as error:
            raise UnknownFrame(f'TF does not say where {source!r} is in {self._frame!r}: {error}') from None
        pose = placed(found.transform, message.pose.pose, '~/odom')
        self._localise(pose, seconds(message.header.stamp), localisation_error(message.pose.covariance))
