"""Maps, there and back over the wire."""
from array import array
from math import inf, nan, pi

import numpy as np
import pytest
from builtin_interfaces.msg import Time
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from over_the_wire import sent

from mobile_planning.errors import InvalidInput, LimitExceeded, UnknownFrame
from mobile_planning.nodes import convert_map
from mobile_planning.world.occupancy_grid import OccupancyGrid

COORDINATE = st.floats(-1e6, 1e6)
ANGLE = st.floats(-pi, pi, exclude_min=True)


@given(cells=arrays(np.int8, array_shapes(min_dims=2, max_dims=2, max_side=6), elements=st.integers(-1, 100)),
       resolution=st.sampled_from([0.05, 0.1, 0.3, 1.0, 2.5]), x=COORDINATE, y=COORDINATE, yaw=ANGLE)
def test_a_map_arrives_as_it_was(cells, resolution, x, y, yaw):
    grid = OccupancyGrid(cells, resolution, (x, y, yaw))
    arrived = convert_map.occupancy_grid(sent(convert_map.map_message(grid, 'map', Time(sec=5))))
    assert np.array_equal(arrived.data, grid.data) and arrived.resolution == resolution
    assert arrived.origin[:2] == (x, y)
    assert abs(np.exp(1j * arrived.origin[2]) - np.exp(1j * yaw)) < 1e-9


def test_a_map_is_stamped_and_framed(grid):
    message = convert_map.map_message(grid, 'floor', Time(sec=5, nanosec=7))
    assert message.header.frame_id == 'floor'
    assert message.header.stamp == message.info.map_load_time == Time(sec=5, nanosec=7)
    assert (message.info.width, message.info.height) == (10, 6)


def test_a_received_map_does_not_share_its_cells_with_the_message(grid):
    message = convert_map.map_message(grid, 'map', Time())
    arrived = convert_map.occupancy_grid(message)
    message.data[0] = 55
    assert arrived == grid


def damaged(grid, **fields):
    """Return the message of a map with some fields of its info or header replaced."""
    message = convert_map.map_message(grid, 'map', Time())
    for name, value in fields.items():
        *path, last = name.split('__')
        owner = message
        for part in path:
            owner = getattr(owner, part)
        setattr(owner, last, value)
    return message


@pytest.mark.parametrize('fields, kind, words', [
    ({'header__frame_id': ''}, UnknownFrame, 'frame_id is empty'),
    ({'data': array('b', [0] * 59)}, InvalidInput, '59 cells, not 10 x 6'),
    ({'data': array('b', [101] * 60)}, InvalidInput, '101'),
    ({'data': array('b', [-2] * 60)}, InvalidInput, '-2'),
    ({'info__width': 0}, InvalidInput, '0 x 6'),
    ({'info__width': 40000}, LimitExceeded, '40000'),
    ({'info__width': 30000, 'info__height': 30000}, LimitExceeded, '900000000'),
    ({'info__resolution': 0.0}, InvalidInput, 'resolution'),
    ({'info__resolution': nan}, InvalidInput, 'resolution'),
    ({'info__resolution': -0.05}, InvalidInput, '-0.05'),
    ({'info__origin__position__x': nan}, InvalidInput, 'not finite'),
    ({'info__origin__position__z': inf}, InvalidInput, 'not finite'),
    ({'info__origin__orientation__w': 0.0, 'info__origin__orientation__z': 0.0}, InvalidInput, 'all zero'),
    ({'info__origin__orientation__w': 0.9}, InvalidInput, 'no unit quaternion'),
    ({'info__origin__orientation__w': nan}, InvalidInput, 'no unit quaternion'),
    ({'info__origin__orientation__x': 1.0, 'info__origin__orientation__w': 0.0, 'info__origin__orientation__z': 0.0},
     InvalidInput, 'tilted'),
])
def test_a_bad_map_is_refused_with_its_value(grid, fields, kind, words):
    with pytest.raises(kind, match=words):
        convert_map.occupancy_grid(damaged(grid, **fields))


def test_the_cells_of_a_map_message_go_row_by_row_from_the_lowest_y():
    grid = OccupancyGrid(np.arange(6).reshape(2, 3))
    message = convert_map.map_message(grid, 'map', Time())
    assert isinstance(message, OccupancyGridMessage) and list(message.data) == [0, 1, 2, 3, 4, 5]
