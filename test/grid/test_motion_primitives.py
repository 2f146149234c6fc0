"""The motions of a lattice against their own curves, sampled finely."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.errors import InvalidInput
from mobile_planning.grid.motion_primitives import heading_vectors, motion_primitives, octile_length

HEADINGS = [4, 8, 16, 24, 32]
LATTICES = st.tuples(st.sampled_from(HEADINGS), st.floats(0.2, 12.0), st.booleans())


def angle_between(a, b):
    return np.abs(np.angle(np.exp(1j * (np.asarray(a) - b))))


def test_the_headings_go_once_around_in_order():
    for headings in HEADINGS:
        vectors = heading_vectors(headings)
        angles = np.unwrap(np.arctan2(vectors[:, 1], vectors[:, 0]))
        assert len(vectors) == headings and (np.gcd(*vectors.T) == 1).all()
        assert (np.diff(angles) > 0).all() and angles[-1] - angles[0] < 2 * np.pi


def test_four_headings_have_the_three_motions_of_the_document():
    for motion, end, turn in zip(motion_primitives(4)[:3], [(1, 0), (1, 1), (1, -1)], [0, np.pi / 2, -np.pi / 2]):
        assert motion.end == end and motion.turn == pytest.approx(turn)
    assert [motion.length for motion in motion_primitives(4)[:3]] == [1.0, np.pi / 2, np.pi / 2]
    # The arc crosses the cell straight ahead.
    assert [1, 0] in motion_primitives(4)[1].swept_cells().tolist()


@settings(max_examples=25)
@given(LATTICES)
def test_a_motion_ends_on_a_cell_centre_in_a_heading_of_the_lattice(lattice):
    headings, radius, reverse = lattice
    vectors = heading_vectors(headings)
    angles = np.arctan2(vectors[:, 1], vectors[:, 0])
    for motion in motion_primitives(headings, radius, reverse):
        begin, end = motion.pose_at([0.0, motion.length])
        assert np.allclose(begin, (0, 0, angles[motion.heading]), atol=1e-9)
        assert np.allclose(end[:2], motion.end, atol=1e-9)
        assert angle_between(end[2], angles[motion.end_heading]) < 1e-9


@settings(max_examples=25)
@given(LATTICES)
def test_a_motion_goes_where_it_heads_and_turns_no_tighter_than_allowed(lattice):
    headings, radius, reverse = lattice
    for motion in motion_primitives(headings, radius, reverse):
        poses = motion.pose_at(np.linspace(0.0, motion.length, 1000))
        steps = np.diff(poses, axis=0)
        lengths = np.hypot(*steps[:, :2].T)
        assert lengths.sum() == pytest.approx(motion.length, rel=1e-4)
        assert (np.abs(steps[:, 2]) <= lengths / radius * (1 + 1e-4) + 1e-12).all()
        course = np.arctan2(steps[:, 1], steps[:, 0]) + (np.pi if motion.is_reverse else 0.0)
        assert angle_between(course, poses[:-1, 2]).max() < 0.02


@settings(max_examples=25)
@given(LATTICES)
def test_the_swept_cells_are_those_of_the_curve(lattice):
    for motion in motion_primitives(*lattice):
        if motion.heading > lattice[0] // 8:
            continue  # the others mirror these
        points = motion.pose_at(np.linspace(0.0, motion.length, 4000))[:, :2]
        # Points very near to a border belong to either side.
        inside = (np.abs(points - np.rint(points)) < 0.499).all(axis=1)
        crossed = set(map(tuple, np.rint(points[inside]).astype(int).tolist()))
        swept = set(map(tuple, motion.swept_cells().tolist()))
        assert crossed <= swept
        for x, y in swept - crossed:  # so short a piece that no sample fell into it
            assert (np.abs(points - (x, y)).max(axis=1)).min() < 0.501
        assert swept <= set(map(tuple, motion.swept_cells(corner_cutting=False).tolist()))


def test_a_diagonal_touches_the_cells_beside_it_unless_corners_may_be_cut():
    diagonal = next(m for m in motion_primitives(8) if m.code == 'S' and m.end == (1, 1))
    assert diagonal.swept_cells().tolist() == [[0, 0], [1, 1]]
    assert len(diagonal.swept_cells(corner_cutting=False)) == 4


@pytest.mark.parametrize('headings', HEADINGS)
def test_left_mirrors_right_and_every_quarter_turn_is_the_same(headings):
    motions = motion_primitives(headings, 2.0, True)
    shapes = {(m.code, m.heading, m.end, m.end_heading, round(m.length, 9)) for m in motions}
    for code, heading, (x, y), end_heading, length in shapes:
        quarter = headings // 4
        turned = (heading + quarter) % headings, (-y, x), (end_heading + quarter) % headings
        assert (code, *turned, length) in shapes
        other = code.translate(str.maketrans('LRlr', 'RLrl'))
        assert (other, -heading % headings, (x, -y), -end_heading % headings, length) in shapes


@settings(max_examples=10)
@given(LATTICES)
def test_a_motion_driven_backwards_takes_one_driven_forwards_back(lattice):
    headings, radius, _ = lattice
    motions = motion_primitives(headings, radius, True)
    forwards = {(m.heading, m.end, m.end_heading): m for m in motions if not m.is_reverse}
    backwards = [m for m in motions if m.is_reverse]
    assert len(forwards) == len(backwards) == len(motions) / 2
    for motion in backwards:
        x, y = motion.end
        other = forwards[motion.end_heading, (-x, -y), motion.heading]
        there = other.pose_at(np.linspace(other.length, 0, 7)) + (x, y, 0)
        assert np.allclose(motion.pose_at(np.linspace(0, motion.length, 7))[:, :2], there[:, :2], atol=1e-9)


def test_a_sharp_radius_brings_sharp_turns_and_a_wide_one_fewer_motions():
    assert min(m.radius for m in motion_primitives(16, 1.0)) == pytest.approx(1.0)
    assert len(motion_primitives(16, 10.0)) < len(motion_primitives(16, 1.0))


def test_octile_steps_on_the_cells_of_a_motion():
    straight, left = motion_primitives(16)[:2]
    assert octile_length(straight, True) == 1.0
    assert octile_length(left, True) == pytest.approx(2 + np.sqrt(2)) and left.end == (3, 1)


@pytest.mark.parametrize('headings', [0, 3, 6, 12, 72, 4.5, True, None, '4'])
def test_other_numbers_of_headings_are_refused(headings):
    with pytest.raises(InvalidInput, match='headings'):
        motion_primitives(headings)


@pytest.mark.parametrize('radius', [0, -1, np.nan, np.inf, 1e6])
def test_a_radius_is_a_number_above_0(radius):
    with pytest.raises(InvalidInput, match='radius'):
        motion_primitives(4, radius)
