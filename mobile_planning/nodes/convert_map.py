"""Maps and the costs to a goal from every cell of one: messages to grids and back."""
from __future__ import annotations

from array import array
from collections.abc import Iterable

import numpy as np
from builtin_interfaces.msg import Time
from mobile_planning_msgs.msg import CostToGo
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput, UnknownFrame
from mobile_planning.nodes.convert import UNIT_TOLERANCE, header, planar, pose_message
from mobile_planning.world.occupancy_grid import OccupancyGrid, check_size


def occupancy_grid(message: OccupancyGridMessage) -> OccupancyGrid:
    """Return the grid of a map message.

    Parameters
    ----------
    message : nav_msgs/OccupancyGrid

    Returns
    -------
    OccupancyGrid
        With its own copy of the cells.

    Raises
    ------
    UnknownFrame
        If the header names no frame.
    InvalidInput
        If the cells are not as many as width times height or outside -1..100, the resolution is below 1e-6 m, or the
        origin is not finite, not a rotation, or tilted.
    LimitExceeded
        If the map is too large.
    """
    info = message.info
    if not message.header.frame_id:
        raise UnknownFrame('the map names no frame: its frame_id is empty')
    check_size(info.width, info.height)
    if len(message.data) != info.width * info.height:
        raise InvalidInput(f'the map has {len(message.data)} cells, not {info.width} x {info.height}')
    x, y, yaw = planar(info.origin, 'origin of the map')
    tilt = abs(info.origin.orientation.x) + abs(info.origin.orientation.y)
    if tilt > UNIT_TOLERANCE:
        raise InvalidInput(f'the origin of the map is tilted: orientation x or y is {tilt:g}, not 0')
    cells = np.frombuffer(message.data, np.int8).reshape(info.height, info.width)
    # The wire has 32 bits for the resolution: the shortest number among those it may stand for is what was meant.
    return OccupancyGrid(cells, float(str(np.float32(info.resolution))), (x, y, yaw))


def map_message(grid: OccupancyGrid, frame: str, stamp: Time) -> OccupancyGridMessage:
    """Return the message of a map.

    Parameters
    ----------
    grid : OccupancyGrid
    frame : str
    stamp : builtin_interfaces/Time
        When it was loaded.

    Returns
    -------
    nav_msgs/OccupancyGrid
    """
    message = OccupancyGridMessage(header=header(frame, stamp), info=_map_info(grid, stamp))
    # An array of bytes is taken as it is; anything else is converted element by element, 50 times slower.
    message.data = array('b', grid.data.tobytes())
    return message


def cost_to_go_message(grid: OccupancyGrid, field: NDArray[np.float64], goal: Iterable[float], planner: str,
                       frame: str, stamp: Time) -> CostToGo:
    """Return the message of the costs from every cell of a map to a goal.

    Parameters
    ----------
    grid : OccupancyGrid
    field : (h, w) ndarray [m]
        NaN if occupied, inf if the goal cannot be reached.
    goal : (3,) iterable of float [m, m, rad]
    planner : str
    frame : str
    stamp : builtin_interfaces/Time

    Returns
    -------
    CostToGo
    """
    return CostToGo(header=header(frame, stamp), info=_map_info(grid, stamp), goal=pose_message(goal),
                    planner=str(planner), cells=array('f', field.astype(np.float32).tobytes()))


def _map_info(grid: OccupancyGrid, stamp: Time) -> MapMetaData:
    """Return the size and the place of a map."""
    return MapMetaData(map_load_time=stamp, resolution=float(grid.resolution), width=int(grid.width),
                       height=int(grid.height), origin=pose_message(grid.origin))
