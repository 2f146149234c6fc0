"""Dubins paths: against their geometry, against a search over all three-segment curves, and against themselves."""
import itertools

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mobile_planning import DubinsPath, InvalidInput, NoPath, dubins_lengths, dubins_options, dubins_shortest
from mobile_planning.sampling.dubins import WORDS

COORDINATES, HEADINGS = st.floats(-30, 30), st.floats(-7, 7)
POSES = st.tuples(COORDINATES, COORDINATES, HEADINGS)
# Poses where formulas meet their edges: on lines, on circles, at right angles.
GRID = st.tuples(*[st.integers(-4, 4).map(float)] * 2, st.integers(-4, 4).map(lambda k: k * np.pi / 2))
ANY = POSES | GRID
RADII = st.floats(0.5, 8)


def wrapped(angle):
    return np.angle(np.exp(1j * np.asarray(angle)))


def integrated(path, steps=2000):
    """Return the end of a path by its definition: heading is the integral of curvature, place that of direction."""
    x, y, heading = path.start
    for kind, length in path.segments:
        bend = {'L': 1, 'S': 0, 'R': -1}[kind] / path.radius
        s = (np.arange(steps) + 0.5) * length / steps
        angles = heading + bend * s
        # The mean of a cosine over a step is that of its middle times sinc of half the turn.
        chord = np.sinc(bend * length / steps / 2 / np.pi) * length / steps
        x, y, heading = x + np.cos(angles).sum() * chord, y + np.sin(angles).sum() * chord, heading + bend * length
    return np.array([x, y, heading])


@given(ANY, ANY, RADII)
def test_every_word_ends_at_the_goal(start, goal, radius):
    for path in dubins_options(start, goal, radius):
        error = integrated(path) - goal
        assert max(abs(error[0]), abs(error[1])) <= 1e-9 * max(1, radius, path.length / 10)
        assert abs(wrapped(error[2])) <= 1e-9
        assert np.allclose(path.pose_at(path.length)[:2], goal[:2], rtol=0, atol=1e-8)


@given(ANY, ANY, RADII)
def test_length_is_bounded_from_below_by_line_and_turn(start, goal, radius):
    length = dubins_shortest(start, goal, radius).length
    assert length >= np.hypot(goal[0] - start[0], goal[1] - start[1]) - 1e-9
    assert length >= radius * abs(wrapped(goal[2] - start[2])) - 1e-9


@given(POSES, st.floats(0, 50), RADII)
def test_collinear_poses_are_joined_by_the_line(start, distance, radius):
    x, y, heading = start
    goal = (x + distance * np.cos(heading), y + distance * np.sin(heading), heading)
    assert dubins_shortest(start, goal, radius).length == pytest.approx(distance, abs=1e-8)


@given(ANY, RADII)
def test_equal_poses_are_joined_by_nothing(pose, radius):
    assert dubins_shortest(pose, pose, radius).length <= 1e-8
    assert dubins_shortest(pose, (pose[0], pose[1], pose[2] + 2 * np.pi), radius).length <= 1e-8


@given(ANY, ANY, RADII, st.sets(st.sampled_from(WORDS), min_size=1))
def test_fewer_words_are_never_shorter(start, goal, radius, words):
    shortest = dubins_shortest(start, goal, radius).length
    assert dubins_lengths(start, goal, radius, words)[0] >= shortest - 1e-9


@given(ANY, ANY, RADII)
def test_the_way_back_is_as_long(start, goal, radius):
    def turned(pose):
        return pose[0], pose[1], pose[2] + np.pi
    assert dubins_shortest(turned(goal), turned(start), radius).length == pytest.approx(
        dubins_shortest(start, goal, radius).length, abs=1e-7)


@given(POSES, POSES, RADII)
def test_a_mirror_swaps_left_and_right(start, goal, radius):
    def mirrored(pose):
        return pose[0], -pose[1], -pose[2]
    there = {path.word: path.length for path in dubins_options(start, goal, radius)}
    mirror = {path.word.translate(str.maketrans('LR', 'RL')): path.length
              for path in dubins_options(mirrored(start), mirrored(goal), radius)}
    assert there.keys() == mirror.keys()
    assert min(there.values()) == pytest.approx(min(mirror.values()), abs=1e-8)
    for word, length in there.items():
        # Of a word that is not the shortest, rounding may make an arc of nothing a circle.
        circles = (length - mirror[word]) / (2 * np.pi * radius)
        assert circles == pytest.approx(round(circles), abs=1e-6)


@given(POSES, POSES, RADII, st.floats(0.1, 10), POSES)
def test_scale_and_rigid_motion(start, goal, radius, scale, motion):
    cos, sin = np.cos(motion[2]), np.sin(motion[2])

    def moved(pose):
        x, y = scale * pose[0], scale * pose[1]
        return cos * x - sin * y + motion[0], sin * x + cos * y + motion[1], pose[2] + motion[2]
    assert dubins_shortest(moved(start), moved(goal), scale * radius).length == pytest.approx(
        scale * dubins_shortest(start, goal, radius).length, rel=1e-7, abs=1e-6)


@given(ANY, ANY, ANY, RADII)
def test_triangle_inequality(a, b, c, radius):
    direct = dubins_shortest(a, c, radius).length
    assert direct <= dubins_shortest(a, b, radius).length + dubins_shortest(b, c, radius).length + 1e-8


@given(ANY, ANY, RADII, st.floats(0, 1))
def test_both_parts_of_a_split_are_shortest(start, goal, radius, share):
    path = dubins_shortest(start, goal, radius)
    first, second = path.split(share * path.length)
    assert first.length + second.length == pytest.approx(path.length, abs=1e-9)
    for part in (first, second):
        assert dubins_shortest(part.start, part.end, radius).length == pytest.approx(part.length, abs=2e-8)


@pytest.mark.parametrize('junction', [0, 1, 2])
def test_a_split_where_two_segments_meet_adds_no_circle(junction):
    rng = np.random.default_rng(3)
    for start, goal in zip(rng.uniform(-20, 20, (200, 3)), rng.uniform(-20, 20, (200, 3))):
        path = dubins_shortest(start, goal, 3.0)
        place = sum(path.lengths[:junction])
        total = sum(dubins_shortest(part.start, part.end, 3.0).length for part in path.split(place))
        assert total == pytest.approx(path.length, abs=1e-8)


@given(ANY, ANY, RADII)
def test_headings_may_be_given_in_any_turn(start, goal, radius):
    shifted = (goal[0], goal[1], goal[2] - 4 * np.pi)
    assert dubins_shortest(start, shifted, radius).length == pytest.approx(
        dubins_shortest(start, goal, radius).length, abs=1e-8)


@given(POSES, POSES, RADII, st.floats(0.05, 2))
def test_samples_are_close_and_headed_along_the_path(start, goal, radius, step):
    # From half a circle on a chord does not tell which way round the arc went.
    assume(step < 3 * radius)
    path = dubins_shortest(start, goal, radius)
    poses = path.sample(step)
    moves = np.diff(poses[:, :2], axis=0)
    chords = np.hypot(*moves.T)
    assert (chords <= step + 1e-9).all()
    assert poses[0, :2] == pytest.approx(start[:2]) and poses[-1, :2] == pytest.approx(goal[:2], abs=1e-8)
    turns = wrapped(np.diff(poses[:, 2]))
    # A chord points half way between the headings at its ends, and a bend is 0 or 1 / radius.
    long = chords > 1e-3
    directions = np.arctan2(moves[:, 1], moves[:, 0])
    assert np.abs(wrapped(directions - poses[:-1, 2] - turns / 2))[long].max(initial=0) < 1e-6
    arcs = 2 * radius * np.arcsin(np.minimum(chords / 2 / radius, 1))
    bends = np.abs(turns[long]) * radius / arcs[long]
    assert ((bends < 1e-6) | (np.abs(bends - 1) < 1e-6)).all()


def test_no_curve_of_three_segments_is_shorter():
    """Against a search: all turns and a fine grid of first and last arcs, the middle fitted to end at the goal."""
    rng = np.random.default_rng(0)
    for _ in range(20):
        goal = np.array([*rng.uniform(-5, 5, 2), rng.uniform(-np.pi, np.pi)])
        best = dubins_shortest((0, 0, 0), goal, 1.0).length
        for first, last in itertools.product((1, -1), repeat=2):
            t = np.linspace(0, 2 * np.pi, 4001)
            q = np.mod(last * (goal[2] - first * t), 2 * np.pi)
            # After the first arc, and before the last one: a straight of heading first * t must join the two places.
            ax, ay = first * np.sin(first * t), first * (1 - np.cos(first * t))
            bx = goal[0] - last * (np.sin(goal[2]) - np.sin(first * t))
            by = goal[1] + last * (np.cos(goal[2]) - np.cos(first * t))
            along = (bx - ax) * np.cos(first * t) + (by - ay) * np.sin(first * t)
            across = (by - ay) * np.cos(first * t) - (bx - ax) * np.sin(first * t)
            fits = (np.abs(across) < 2e-4) & (along >= 0)
            assert (t + q + along)[fits].min(initial=np.inf) >= best - 1e-2


def test_options_are_sorted_and_the_first_is_the_shortest():
    options = dubins_options((0, 0, 0), (1, 1, 3), 2)
    assert [path.length for path in options] == sorted(path.length for path in options)
    assert options[0] == dubins_shortest((0, 0, 0), (1, 1, 3), 2)


def test_a_batch_equals_one_by_one():
    rng = np.random.default_rng(1)
    starts, goals = rng.uniform(-9, 9, (2, 50, 3))
    one_by_one = [dubins_shortest(a, b, 1.5).length for a, b in zip(starts, goals)]
    assert dubins_lengths(starts, goals, 1.5) == pytest.approx(one_by_one, abs=1e-12)
    assert dubins_lengths(starts[0], goals, 1.5)[7] == pytest.approx(
        dubins_shortest(starts[0], goals[7], 1.5).length, abs=1e-12)
    assert dubins_lengths(np.empty((0, 3)), np.empty((0, 3)), 1).shape == (0,)


@pytest.mark.parametrize('arguments', [
    ((0, 0), (1, 1, 0), 1), ((0, 0, np.nan), (1, 1, 0), 1), ((0, 0, 0), (1, np.inf, 0), 1), ((0, 0, 0), (1, 1, 0), 0),
    ((0, 0, 0), (1, 1, 0), -1), ((0, 0, 0), (1, 1, 0), np.nan), ((0, 0, 0), (1, 1, 0), 1, ['LLL']),
    ((0, 0, 0), (1, 1, 0), 1, [])])
def test_what_is_no_pose_radius_or_word_is_refused(arguments):
    with pytest.raises(InvalidInput):
        dubins_shortest(*arguments)


def test_a_word_that_does_not_reach_says_so():
    with pytest.raises(NoPath, match='RLR'):
        dubins_shortest((0, 0, 0), (100, 0, 0), 1, ['RLR'])


def test_a_path_refuses_what_it_cannot_be():
    for word, lengths in (('LSS', (1, 1, 1)), ('LSL', (1, 1)), ('LSL', (1, -1, 1)), ('LSL', (1, np.nan, 1))):
        with pytest.raises(InvalidInput):
            DubinsPath((0, 0, 0), word, lengths, 1.0)
    path = dubins_shortest((0, 0, 0), (5, 0, 0), 1)
    for call in (lambda: path.pose_at(6), lambda: path.pose_at(-1), lambda: path.sample(0), lambda: path.sample(1e-12)):
        with pytest.raises(InvalidInput):
            call()
