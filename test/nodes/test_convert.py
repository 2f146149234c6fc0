"""Messages and the library's objects, there and back over the wire."""
from array import array
from math import inf, nan, pi

import numpy as np
import pytest
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Pose, PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path
from rclpy.serialization import deserialize_message, serialize_message

from mobile_planning.errors import InvalidInput, LimitExceeded, UnknownFrame
from mobile_planning.nodes import convert
from mobile_planning.world.occupancy_grid import OccupancyGrid

COORDINATE = st.floats(-1e6, 1e6)
ANGLE = st.floats(-pi, pi, exclude_min=True)


def over_the_wire(message):
    """Return the message as the other side gets it."""
    return deserialize_message(serialize_message(message), type(message))


@given(cells=arrays(np.int8, array_shapes(min_dims=2, max_dims=2, max_side=6), elements=st.integers(-1, 100)),
       resolution=st.sampled_from([0.05, 0.1, 0.3, 1.0, 2.5]), x=COORDINATE, y=COORDINATE, yaw=ANGLE)
def test_a_map_arrives_as_it_was(cells, resolution, x, y, yaw):
    grid = OccupancyGrid(cells, resolution, (x, y, yaw))
    arrived = convert.occupancy_grid(over_the_wire(convert.map_message(grid, 'map', Time(sec=5))))
    assert np.array_equal(arrived.data, grid.data) and arrived.resolution == resolution
    assert arrived.origin[:2] == (x, y)
    assert abs(np.exp(1j * arrived.origin[2]) - np.exp(1j * yaw)) < 1e-9


def test_a_map_is_stamped_and_framed(grid):
    message = convert.map_message(grid, 'floor', Time(sec=5, nanosec=7))
    assert message.header.frame_id == 'floor'
    assert message.header.stamp == message.info.map_load_time == Time(sec=5, nanosec=7)
    assert (message.info.width, message.info.height) == (10, 6)


def test_a_received_map_does_not_share_its_cells_with_the_message(grid):
    message = convert.map_message(grid, 'map', Time())
    arrived = convert.occupancy_grid(message)
    message.data[0] = 55
    assert arrived == grid


def damaged(grid, **fields):
    """Return the message of a map with some fields of its info or header replaced."""
    message = convert.map_message(grid, 'map', Time())
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
        convert.occupancy_grid(damaged(grid, **fields))


@given(COORDINATE, COORDINATE, ANGLE)
def test_a_pose_arrives_as_it_was(x, y, yaw):
    pose = convert.configuration(over_the_wire(convert.pose_stamped((x, y, yaw), 'map')), 'map')
    assert pose[:2] == (x, y)
    assert abs(np.exp(1j * pose[2]) - np.exp(1j * yaw)) < 1e-9


def test_integers_arrive_as_the_same_numbers():
    arrived = over_the_wire(convert.path_message(np.array([[3, 4, 0], [5, -6, 0]]), 'map', Time()))
    assert [(p.pose.position.x, p.pose.position.y) for p in arrived.poses] == [(3.0, 4.0), (5.0, -6.0)]
    assert convert.configuration(over_the_wire(convert.pose_stamped((3, 4, 0), 'map')), 'map') == (3.0, 4.0, 0.0)
    grid = OccupancyGrid(np.zeros((1, 1), int), 1, (np.int64(2), 3, 0))
    assert convert.occupancy_grid(over_the_wire(convert.map_message(grid, 'map', Time()))) == grid
    assert convert.key_values({'n': np.int64(3)})[0].value == '3'


def test_numpy_scalars_arrive_as_the_same_numbers():
    pose = convert.pose_stamped(np.array([1.5, 2.5, 0.0], np.float32), 'map')
    assert convert.configuration(over_the_wire(pose), 'map') == (1.5, 2.5, 0.0)


def test_the_field_checks_are_on_in_the_tests():
    with pytest.raises(AssertionError):
        Pose().position.x = 3


def bad_pose(**fields):
    """Return a pose in frame map with some fields of its pose replaced."""
    message = PoseStamped()
    message.header.frame_id = fields.pop('frame', 'map')
    for name, value in fields.items():
        owner, last = name.split('_')
        setattr(getattr(message.pose, owner), last, value)
    return message


@pytest.mark.parametrize('fields, kind, words', [
    ({'position_x': nan}, InvalidInput, 'not finite'),
    ({'position_y': -inf}, InvalidInput, 'not finite'),
    ({'orientation_w': 0.0}, InvalidInput, 'goal has an orientation that is all zero'),
    ({'orientation_w': 1.1}, InvalidInput, 'no unit quaternion'),
    ({'orientation_z': nan}, InvalidInput, 'no unit quaternion'),
    ({'orientation_z': 1e200}, InvalidInput, 'no unit quaternion'),
    ({'frame': ''}, UnknownFrame, 'frame_id is empty'),
    ({'frame': 'odom'}, UnknownFrame, "'odom' and must be in 'map'"),
    ({'frame': '/map'}, UnknownFrame, 'leading slash'),
    ({'frame': 'x' * 10000}, UnknownFrame, r'x\.\.\.'),
])
def test_a_bad_pose_is_refused_with_its_value(fields, kind, words):
    with pytest.raises(kind, match=words) as refused:
        convert.configuration(bad_pose(**fields), 'map', 'goal')
    assert len(str(refused.value)) < 300


@given(arrays(float, st.tuples(st.integers(0, 5), st.just(3)), elements=st.floats(-3.1, 3.1)))
def test_a_path_arrives_as_it_was(poses):
    message = over_the_wire(convert.path_message(poses, 'map', Time(sec=9)))
    assert isinstance(message, Path) and message.header.frame_id == 'map'
    assert all(pose.header == message.header for pose in message.poses)
    assert np.allclose(convert.path_poses(message), poses, atol=1e-12)


def test_a_path_may_be_written_into_the_messages_of_another():
    reuse = []
    for length in 5, 2, 7:
        poses = np.random.default_rng(length).uniform(-3, 3, (length, 3))
        message = convert.path_message(poses, 'map', Time(sec=length), reuse)
        assert over_the_wire(message) == over_the_wire(convert.path_message(poses, 'map', Time(sec=length)))
    assert len(reuse) == 7


@given(st.floats(0, 1e6))
def test_a_duration_arrives_to_the_nanosecond(duration):
    assert abs(convert.seconds(convert.duration_message(duration)) - duration) <= 1e-9


def test_a_negative_duration_is_read_as_it_is():
    assert convert.seconds(Duration(sec=-1, nanosec=500_000_000)) == -0.5


def test_the_cells_of_a_map_message_go_row_by_row_from_the_lowest_y():
    grid = OccupancyGrid(np.arange(6).reshape(2, 3))
    message = convert.map_message(grid, 'map', Time())
    assert isinstance(message, OccupancyGridMessage) and list(message.data) == [0, 1, 2, 3, 4, 5]
