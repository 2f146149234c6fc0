"""Poses, paths and times, there and back over the wire."""
from math import inf, nan, pi

import numpy as np
import pytest
from builtin_interfaces.msg import Duration, Time
from geometry_msgs.msg import Pose, PoseStamped
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from nav_msgs.msg import Path
from over_the_wire import sent

from mobile_planning.errors import InvalidInput, UnknownFrame
from mobile_planning.nodes import convert, convert_map
from mobile_planning.world.occupancy_grid import OccupancyGrid

COORDINATE = st.floats(-1e6, 1e6)
ANGLE = st.floats(-pi, pi, exclude_min=True)


@given(COORDINATE, COORDINATE, ANGLE)
def test_a_pose_arrives_as_it_was(x, y, yaw):
    pose = convert.configuration(sent(convert.pose_stamped((x, y, yaw), 'map')), 'map')
    assert pose[:2] == (x, y)
    assert abs(np.exp(1j * pose[2]) - np.exp(1j * yaw)) < 1e-9


def test_integers_arrive_as_the_same_numbers():
    arrived = sent(convert.path_message(np.array([[3, 4, 0], [5, -6, 0]]), 'map', Time()))
    assert [(p.pose.position.x, p.pose.position.y) for p in arrived.poses] == [(3.0, 4.0), (5.0, -6.0)]
    assert convert.configuration(sent(convert.pose_stamped((3, 4, 0), 'map')), 'map') == (3.0, 4.0, 0.0)
    grid = OccupancyGrid(np.zeros((1, 1), int), 1, (np.int64(2), 3, 0))
    assert convert_map.occupancy_grid(sent(convert_map.map_message(grid, 'map', Time()))) == grid
    assert convert.key_values({'n': np.int64(3)})[0].value == '3'


def test_numpy_scalars_arrive_as_the_same_numbers():
    pose = convert.pose_stamped(np.array([1.5, 2.5, 0.0], np.float32), 'map')
    assert convert.configuration(sent(pose), 'map') == (1.5, 2.5, 0.0)


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
    message = sent(convert.path_message(poses, 'map', Time(sec=9)))
    assert isinstance(message, Path) and message.header.frame_id == 'map'
    assert all(pose.header == message.header for pose in message.poses)
    assert np.allclose(convert.path_poses(message), poses, atol=1e-12)


def test_a_path_may_be_written_into_the_messages_of_another():
    reuse = []
    for length in 5, 2, 7:
        poses = np.random.default_rng(length).uniform(-3, 3, (length, 3))
        message = convert.path_message(poses, 'map', Time(sec=length), reuse)
        assert sent(message) == sent(convert.path_message(poses, 'map', Time(sec=length)))
    assert len(reuse) == 7


@given(st.floats(0, 1e6))
def test_a_duration_arrives_to_the_nanosecond(duration):
    assert abs(convert.seconds(convert.duration_message(duration)) - duration) <= 1e-9


def test_a_negative_duration_is_read_as_it_is():
    assert convert.seconds(Duration(sec=-1, nanosec=500_000_000)) == -0.5
