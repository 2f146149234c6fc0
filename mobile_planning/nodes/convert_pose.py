"""Poses of real bases and commands to them: messages to numbers and back."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from geometry_msgs.msg import Point, Pose, PoseWithCovarianceStamped, Transform, TwistStamped
from numpy.typing import ArrayLike, NDArray

from mobile_planning.nodes import wire
from mobile_planning.nodes.convert import check_frame, header, planar

#: Of a normal distribution in the plane, 99 % lies within so many standard deviations.
_SIGMAS = 3.03


def localised(message: PoseWithCovarianceStamped, frame: str) -> NDArray[np.float64]:
    """Return the pose (3,) [m, m, rad] in a message.

    Raises
    ------
    UnknownFrame
        It is not in ``frame``.
    InvalidInput
        A number is not finite, or the orientation is no unit quaternion.
    """
    check_frame(message.header.frame_id, frame, '~/pose')
    return np.array(planar(message.pose.pose, '~/pose'))


def localisation_error(covariance: Sequence[float]) -> float:
    """Return by how much [m] the place of a pose may be wrong, with 99 % certainty, by its covariance (36,).

    NaN where the covariance says nothing: all zero, or no covariance.

    Examples
    --------
    >>> round(localisation_error([0.0001] + [0.0] * 6 + [0.0004] + [0.0] * 28), 4)
    0.0606
    """
    part = np.array(covariance, float).reshape(6, 6)[:2, :2]
    if not np.isfinite(part).all() or not part.any():
        return float('nan')
    return _SIGMAS * float(np.sqrt(max(0.0, np.linalg.eigvalsh((part + part.T) / 2)[-1])))


def placed(transform: Transform, pose: Pose, name: str) -> NDArray[np.float64]:
    """Return ``pose``, seen from a frame that lies at ``transform`` on the map, as a pose (3,) on the map.

    Raises
    ------
    InvalidInput
        A number is not finite, or an orientation is no unit quaternion.
    """
    place = Pose(position=Point(x=transform.translation.x, y=transform.translation.y, z=transform.translation.z),
                 orientation=transform.rotation)
    return composed(planar(place, f'the transform of {name}'), planar(pose, name))


def composed(frame: ArrayLike, pose: ArrayLike) -> NDArray[np.float64]:
    """Return ``pose`` (3,) [m, m, rad], seen from a frame that lies at ``frame`` (3,), as seen from outside.

    Examples
    --------
    >>> composed((1, 2, np.pi / 2), (3, 0, np.pi)).round(6).tolist()
    [1.0, 5.0, -1.570796]
    """
    (x, y, turn), (ahead, aside, theta) = frame, pose
    cos, sin = np.cos(turn), np.sin(turn)
    heading = np.arctan2(np.sin(turn + theta), np.cos(turn + theta))
    return np.array([x + cos * ahead - sin * aside, y + sin * ahead + cos * aside, heading])


def command_message(command: ArrayLike, time: float, frame: str) -> TwistStamped:
    """Return the message of the speeds (v, omega) [m/s, rad/s] for a base whose frame is ``frame``."""
    message = TwistStamped(header=header(frame, wire.stamp(time)))
    message.twist.linear.x, message.twist.angular.z = map(float, command)
    return message
