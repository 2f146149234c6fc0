"""Reeds-Shepp paths: where they end, that they are a distance, and that no Dubins path or other word is shorter."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning import (
    InvalidInput, ReedsSheppPath, dubins_shortest, reeds_shepp_lengths, reeds_shepp_options, reeds_shepp_shortest)

POSES = st.tuples(st.floats(-12, 12), st.floats(-12, 12), st.floats(-7, 7))
RADII = st.floats(0.5, 5)


def turned(pose, by):
    return pose[0], pose[1], pose[2] + by


@given(POSES, POSES, RADII)
def test_every_word_ends_at_the_goal(start, goal, radius):
    for path in reeds_shepp_options(start, goal, radius):
        x, y, heading = path.start
        for kind, length in path.segments:
            bend = {'L': 1, 'S': 0, 'R': -1}[kind] / radius
            turn = bend * length
            chord = length * np.sinc(turn / 2 / np.pi)
            x, y = x + chord * np.cos(heading + turn / 2), y + chord * np.sin(heading + turn / 2)
            heading += turn
        assert (x, y) == pytest.approx(goal[:2], abs=1e-6)
        assert abs(np.angle(np.exp(1j * (heading - goal[2])))) < 1e-6
        assert path.end[:2] == pytest.approx(goal[:2], abs=1e-6)


@given(POSES, POSES, RADII)
def test_to_be_allowed_to_reverse_never_costs(start, goal, radius):
    length = reeds_shepp_shortest(start, goal, radius).length
    assert length <= dubins_shortest(start, goal, radius).length + 1e-7
    assert length <= dubins_shortest(turned(start, np.pi), turned(goal, np.pi), radius).length + 1e-7
    assert length >= np.hypot(goal[0] - start[0], goal[1] - start[1]) - 1e-9


@given(POSES, POSES, RADII)
def test_the_way_back_is_as_long(start, goal, radius):
    there = reeds_shepp_shortest(start, goal, radius).length
    assert there == pytest.approx(reeds_shepp_shortest(goal, start, radius).length, abs=1e-6)


@given(POSES, POSES, POSES, RADII)
def test_triangle_inequality(a, b, c, radius):
    via = reeds_shepp_shortest(a, b, radius).length + reeds_shepp_shortest(b, c, radius).length
    assert reeds_shepp_shortest(a, c, radius).length <= via + 1e-6


@given(POSES, POSES, RADII, st.floats(0, 1))
def test_both_parts_of_a_split_are_shortest(start, goal, radius, share):
    path = reeds_shepp_shortest(start, goal, radius)
    for part in path.split(share * path.length):
        assert reeds_shepp_shortest(part.start, part.end, radius).length == pytest.approx(part.length, abs=1e-6)


def test_known_paths():
    quarter = np.pi / 2
    assert reeds_shepp_shortest((0, 0, 0), (1, 1, quarter), 1).length == pytest.approx(quarter)
    assert reeds_shepp_shortest((0, 0, 0), (-5, 0, 0), 1).segments == (('S', -5.0),)
    # Turning on the spot takes three arcs of 60 degrees.
    assert reeds_shepp_shortest((0, 0, 0), (0, 0, np.pi), 2).length == pytest.approx(2 * np.pi)


def test_a_batch_equals_one_by_one():
    rng = np.random.default_rng(1)
    starts, goals = rng.uniform(-9, 9, (2, 50, 3))
    one_by_one = [reeds_shepp_shortest(a, b, 1.5).length for a, b in zip(starts, goals)]
    assert reeds_shepp_lengths(starts, goals, 1.5) == pytest.approx(one_by_one, abs=1e-9)


def test_samples_go_through_each_cusp():
    path = reeds_shepp_shortest((0, 0, 0), (0, 0, np.pi), 1)
    poses = path.sample(0.1)
    assert np.hypot(*np.diff(poses[:, :2], axis=0).T).max() <= 0.1
    cusp = path.pose_at(abs(path.lengths[0]))
    assert np.hypot(*(poses[:, :2] - cusp[:2]).T).min() < 1e-12


def test_equal_poses_are_joined_by_nothing():
    path = reeds_shepp_shortest((1, 2, 3), (1, 2, 3), 1)
    assert isinstance(path, ReedsSheppPath) and path.length < 1e-9


@pytest.mark.parametrize('radius', [0, -1, np.nan, 'wide'])
def test_what_is_no_radius_is_refused(radius):
    with pytest.raises(InvalidInput):
        reeds_shepp_shortest((0, 0, 0), (1, 1, 1), radius)
