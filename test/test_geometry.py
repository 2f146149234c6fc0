"""Angles, segments and boxes in the plane."""
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import depth_in_box, finite_points, point_to_segment, wrap_angle, wrap_number

NUMBERS = st.floats(-20, 20).map(lambda value: round(value, 3))
POINTS = st.tuples(NUMBERS, NUMBERS)


@pytest.mark.parametrize('wrap', [wrap_angle, wrap_number])
@given(angle=st.floats(-1e3, 1e3))
def test_a_wrapped_angle_points_the_same_way_and_is_in_range(wrap, angle):
    wrapped = wrap(angle)
    assert -np.pi < wrapped <= np.pi
    assert (np.cos(wrapped), np.sin(wrapped)) == pytest.approx((np.cos(angle), np.sin(angle)), abs=1e-9)


@pytest.mark.parametrize('wrap', [wrap_angle, wrap_number])
@given(half_turns=st.integers(-9, 9), steps=st.integers(-4, 4))
def test_an_angle_next_to_a_half_turn_is_in_range(wrap, half_turns, steps):
    angle = half_turns * np.pi
    assert -np.pi < wrap(angle + steps * np.spacing(angle)) <= np.pi


@given(POINTS, POINTS, POINTS)
def test_the_distance_to_a_segment_is_that_of_shapely(point, a, b):
    assert point_to_segment(point, a, b) == pytest.approx(shapely.LineString([a, b]).distance(shapely.Point(point)),
                                                          abs=1e-9)


@given(POINTS, POINTS, st.floats(0.1, 9), st.floats(0.1, 9))
def test_the_depth_in_a_box_is_the_distance_to_its_border(point, low, width, height):
    box = shapely.box(*low, low[0] + width, low[1] + height)
    distance = box.exterior.distance(shapely.Point(point))
    expected = distance if box.intersects(shapely.Point(point)) else -distance
    assert depth_in_box(point, low, (low[0] + width, low[1] + height)) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize('points, words', [
    ((np.nan, 1), r'point \(nan, 1.0\)'), ([(0, 0), (1, np.inf)], r'\(1.0, inf\)'), ((1, 2, 3), 'shape'), (1, 'shape'),
    ('ab', 'not an array'), ([(1, 2), (3,)], 'not an array')])
def test_what_is_no_point_is_named(points, words):
    with pytest.raises(InvalidInput, match=words):
        finite_points(points)
