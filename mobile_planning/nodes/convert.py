"""What all messages are made of, into numbers and back: frames, headers, poses, paths, times and values with names.

What comes in is checked and refused with a code and a sentence. What goes out is cast, every number of it: without
field checks an int in a float64 field is sent as another number, and nobody says so.
"""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import atan2, cos, isfinite, sin

import numpy as np
from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import Pose, PoseStamped, Quaternion
from nav_msgs.msg import Path
from numpy.typing import ArrayLike, NDArray
from std_msgs.msg import Header

from mobile_planning.errors import InvalidInput, UnknownFrame

# How far the square of a quaternion's length may be from 1, as in Nav2.
UNIT_TOLERANCE = 1e-4


def header(frame: str, stamp: Time | None = None) -> Header:
    """Return a header in a frame, at a time (default: zero)."""
    return Header(frame_id=str(frame), stamp=Time() if stamp is None else stamp)


def configuration(message: PoseStamped, frame: str, name: str = 'pose') -> tuple[float, float, float]:
    """Return the (x, y, yaw) of a pose.

    Parameters
    ----------
    message : geometry_msgs/PoseStamped
        Roll, pitch and height are left out.
    frame : str
        The frame it must be in.
    name : str
        What the pose is, for messages.

    Returns
    -------
    (3,) tuple of float [m, m, rad]

    Raises
    ------
    UnknownFrame
        If it is in another frame.
    InvalidInput
        If a number is not finite, or the orientation is no unit quaternion.
    """
    check_frame(message.header.frame_id, frame, name)
    return planar(message.pose, name)


def planar(pose: Pose, name: str) -> tuple[float, float, float]:
    """Return the (x, y, yaw) [m, m, rad] of a pose, called ``name`` in messages.

    Raises
    ------
    InvalidInput
        If a number is not finite, or the orientation is no unit quaternion.
    """
    position, turn = pose.position, pose.orientation
    if not all(map(isfinite, (position.x, position.y, position.z))):
        raise InvalidInput(f'{name} has a position that is not finite: ({position.x}, {position.y}, {position.z})')
    quaternion = (turn.x, turn.y, turn.z, turn.w)
    if not any(quaternion):
        raise InvalidInput(f'{name} has an orientation that is all zero: without a turn it is x=0, y=0, z=0, w=1')
    if not abs(sum(part * part for part in quaternion) - 1) <= UNIT_TOLERANCE:
        raise InvalidInput(f'{name} has an orientation {quaternion} that is no unit quaternion')
    return position.x, position.y, _yaw(turn)


def check_frame(given: str, frame: str, name: str) -> None:
    """Refuse what is not in ``frame``; there are no transforms here, since every message is in the map's frame."""
    if given == frame:
        return
    if not given:
        raise UnknownFrame(f'{name} names no frame: its frame_id is empty and must be {frame!r}')
    shown = repr(given if len(given) <= 60 else given[:57] + '...')
    slash = ' (frames have no leading slash)' if given == '/' + frame else ''
    raise UnknownFrame(f'{name} is in frame {shown} and must be in {frame!r}{slash}')


def pose_message(pose: Iterable[float]) -> Pose:
    """Return the message of a pose (x, y, yaw) [m, m, rad]."""
    x, y, yaw = pose
    message = Pose(orientation=Quaternion(z=float(sin(yaw / 2)), w=float(cos(yaw / 2))))
    message.position.x, message.position.y = float(x), float(y)
    return message


def pose_stamped(pose: Iterable[float], frame: str, stamp: Time | None = None) -> PoseStamped:
    """Return the message of a pose (x, y, yaw) [m, m, rad] in a frame."""
    return PoseStamped(header=header(frame, stamp), pose=pose_message(pose))


def path_message(poses: ArrayLike, frame: str, stamp: Time, reuse: list[PoseStamped] | None = None) -> Path:
    """Return the message of a path.

    Parameters
    ----------
    poses : (N, 3) array_like [m, m, rad]
    frame : str
    stamp : builtin_interfaces/Time
    reuse : list of geometry_msgs/PoseStamped, optional
        The pose messages of an earlier path, which are written again; grows as needed. Making 500 pose messages takes
        2 ms, writing them 0.2 ms; but whoever still has the earlier message sees it change.

    Returns
    -------
    nav_msgs/Path
        All poses share one header.
    """
    poses = np.asarray(poses, dtype=float).reshape(-1, 3)
    stamped = [] if reuse is None else reuse
    stamped.extend(PoseStamped() for _ in range(len(poses) - len(stamped)))
    shared, halves = header(frame, stamp), poses[:, 2] / 2
    # tolist makes Python floats of all numbers at once.
    numbers = np.column_stack([poses[:, :2], np.sin(halves), np.cos(halves)]).tolist()
    for message, (x, y, z, w) in zip(stamped, numbers):
        message.header = shared
        position, orientation = message.pose.position, message.pose.orientation
        position.x, position.y, orientation.z, orientation.w = x, y, z, w
    return Path(header=shared, poses=stamped[:len(poses)])


def path_poses(message: Path) -> NDArray[np.float64]:
    """Return the poses of a path message, (N, 3) ndarray [m, m, rad]."""
    poses = [(p.pose.position.x, p.pose.position.y, _yaw(p.pose.orientation)) for p in message.poses]
    return np.array(poses, dtype=float).reshape(-1, 3)


def seconds(message: Duration | Time) -> float:
    """Return a duration or a time in seconds."""
    return message.sec + message.nanosec * 1e-9


def duration_message(duration: float) -> Duration:
    """Return the message of a duration of at least 0 [s]."""
    sec, rest = divmod(round(float(duration) * 1e9), 1_000_000_000)
    return Duration(sec=int(sec), nanosec=int(rest))


def key_values(facts: Mapping[str, object]) -> list[KeyValue]:
    """Return names and values as messages, both as strings."""
    return [KeyValue(key=str(key), value=str(value)) for key, value in facts.items()]


def _yaw(turn: Quaternion) -> float:
    """Return the rotation about z of a unit quaternion, in (-pi, pi]."""
    return atan2(2 * (turn.w * turn.z + turn.x * turn.y), 1 - 2 * (turn.y * turn.y + turn.z * turn.z))
