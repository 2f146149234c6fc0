"""Obstacles beside the map, messages to the library's objects and back; and edges of a tree into markers."""
from __future__ import annotations

from array import array
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from mobile_planning_msgs.msg import ObstacleArray
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from mobile_planning.errors import InvalidInput, LimitExceeded
from mobile_planning.nodes import wire
from mobile_planning.nodes.convert import check_frame, header, seconds
from mobile_planning.world.moving_obstacle import MovingObstacle
from mobile_planning.world.obstacles import Obstacle, PolygonObstacle, RoundObstacle

MOST_OBSTACLES = 10_000
# Of a tree that is drawn; more stop a viewer.
MOST_EDGES = 50_000


class Obstacles(NamedTuple):
    """What stands in the way, in the frame of the map.

    Attributes
    ----------
    fixed : tuple of Obstacle
    moving : tuple of MovingObstacle
    since : float [s]
        When the moving ones were where their shapes are; 0 if the message does not say.
    """

    fixed: tuple[Obstacle, ...] = ()
    moving: tuple[MovingObstacle, ...] = ()
    since: float = 0.0


def obstacles_message(obstacles: Iterable[Obstacle], time: float, frame: str) -> ObstacleArray:
    """Return the message of discs and polygons."""
    obstacles = list(obstacles)
    discs = [each for each in obstacles if isinstance(each, RoundObstacle)]
    polygons = [each.vertices for each in obstacles if isinstance(each, PolygonObstacle)]
    return ObstacleArray(
        header=header(frame, wire.stamp(time)), discs=wire.floats([(*disc.centroid, disc.radius) for disc in discs]),
        corners=array('H', map(len, polygons)), polygons=wire.floats(np.concatenate([np.empty((0, 2)), *polygons])))


def obstacles(message: ObstacleArray, frame: str) -> Obstacles:
    """Return the obstacles of a message; those without a velocity, or one of 0, are fixed.

    Raises
    ------
    UnknownFrame
        If they are in another frame.
    InvalidInput
        If there are not as many numbers as there must be, or they make no obstacle.
    LimitExceeded
        If there are more than `MOST_OBSTACLES`.
    """
    check_frame(message.header.frame_id, frame, 'the obstacle array')
    sizes = np.array(message.corners, np.int64)
    if len(message.discs) % 3 or len(message.polygons) != 2 * sizes.sum():
        raise InvalidInput(f'the obstacle array has {len(message.discs)} numbers for discs, 3 each, and '
                           f'{len(message.polygons)} for {sizes.sum()} corners, 2 each')
    count = len(message.discs) // 3 + len(sizes)
    if count > MOST_OBSTACLES:
        raise LimitExceeded(f'{count} obstacles are more than {MOST_OBSTACLES}')
    if len(message.velocities) not in (0, 2 * count):
        raise InvalidInput(f'the obstacle array has {len(message.velocities)} numbers for the velocities of {count} '
                           'obstacles, not 2 each or none')
    corners = np.split(np.array(message.polygons).reshape(-1, 2), np.cumsum(sizes)[:-1]) if len(sizes) else []
    shapes = [*(RoundObstacle(disc[:2], float(disc[2])) for disc in np.array(message.discs).reshape(-1, 3)),
              *map(PolygonObstacle, corners)]
    velocities = np.array(message.velocities).reshape(-1, 2) if len(message.velocities) else np.zeros((count, 2))
    moves = [bool(velocity.any()) for velocity in velocities]
    return Obstacles(
        tuple(shape for shape, moving in zip(shapes, moves) if not moving),
        tuple(MovingObstacle(shape, tuple(velocity.tolist()))
              for shape, velocity, moving in zip(shapes, velocities, moves) if moving),
        seconds(message.header.stamp))


def graph_markers(edges: NDArray[np.float64], frame: str, stamp: Time) -> MarkerArray:
    """Return the edges of a tree or a roadmap as one marker of thin lines, at most `MOST_EDGES` of them.

    Parameters
    ----------
    edges : (n, 2, 2) ndarray [m]
    frame : str
    stamp : builtin_interfaces/Time
    """
    marker = Marker(header=header(frame, stamp), ns='graph', type=Marker.LINE_LIST,
                    action=Marker.ADD if len(edges) else Marker.DELETE, color=ColorRGBA(r=0.2, g=0.4, b=0.8, a=0.5))
    marker.pose.orientation.w, marker.scale.x = 1.0, 0.01
    marker.points = [Point(x=x, y=y) for x, y in edges[:MOST_EDGES].reshape(-1, 2).tolist()]
    return MarkerArray(markers=[marker])
