"""What is only shown, never planned by: odometry, status and markers."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from geometry_msgs.msg import Point
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray

from mobile_planning.fleet.message import RobotMsg
from mobile_planning.nodes import wire
from mobile_planning.nodes.convert import header, pose_message

if TYPE_CHECKING:
    from mobile_planning.fleet.verification import Body


def odometry(state: NDArray, time: float, frame: str, child_frame: str) -> Odometry:
    """Return the state x, y, theta, v, omega (5,) as odometry."""
    message = Odometry(header=header(frame, wire.stamp(time)), child_frame_id=str(child_frame))
    message.pose.pose = pose_message(state[:3])
    message.twist.twist.linear.x, message.twist.twist.angular.z = float(state[3]), float(state[4])
    return message


def fleet_markers(bodies: Sequence[Body], messages: Mapping[int, RobotMsg], colours: Sequence[str], time: float,
                  frame: str) -> MarkerArray:
    """Return one disc, one intended path and one goal for each robot heard."""
    markers = []
    for index, body in enumerate(bodies):
        heard = messages.get(body.eyed)
        if heard is None:
            continue
        red, green, blue = (int(colours[index % len(colours)][at:at + 2], 16) / 255 for at in (1, 3, 5))
        path = [Point(x=float(x), y=float(y), z=0.0) for x, y in zip(heard.ip_z1, heard.ip_z2)]
        for kind, pose, scale, points in (
                ('robots', pose_message((*heard.lz, heard.plan.heading)), (2 * body.radius, 2 * body.radius, 0.2), []),
                ('intents', pose_message((0, 0, 0)), (0.04, 0.0, 0.0), path),
                ('goals', pose_message(body.goal), (body.radius, 0.05, 0.05), [])):
            marker = Marker(header=header(frame, wire.stamp(time)), ns=kind, id=int(body.eyed), pose=pose,
                            points=points)
            marker.type = {'robots': Marker.CYLINDER, 'intents': Marker.LINE_STRIP, 'goals': Marker.ARROW}[kind]
            marker.scale.x, marker.scale.y, marker.scale.z = map(float, scale)
            marker.color.r, marker.color.g, marker.color.b, marker.color.a = red, green, blue, 0.9
            marker.lifetime.sec = 2
            markers.append(marker)
    return MarkerArray(markers=markers)
