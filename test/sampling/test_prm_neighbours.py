"""The three neighbour searches find the same pairs, those that a comparison of all with all finds."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning.sampling.neighbour_search import NeighborSearchStrategy, neighbour_pairs

WAYS = [(NeighborSearchStrategy.BRUTE_FORCE, 4), (NeighborSearchStrategy.KDTREE, 4),
        *((NeighborSearchStrategy.PARTIAL_INDEX_TABLE, dimensions) for dimensions in (1, 2, 3, 4, 6))]


@st.composite
def clouds(draw):
    """Draw points in 1 to 6 dimensions, some of them on a lattice, on top of each other or in one plane."""
    count, dimensions = draw(st.integers(0, 60)), draw(st.integers(1, 6))
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    points = random.uniform(-3, 5, (count, dimensions))
    if draw(st.booleans()):
        points = np.round(points)
    if draw(st.booleans()):
        points[:, draw(st.integers(0, dimensions - 1))] = 1.0
    return points


@given(clouds(), st.sampled_from((1e-3, 0.5, 1.0, 2.0, 3.7, 100.0)), st.floats(0, 1))
def test_every_search_finds_each_pair_within_the_radius_once(points, radius, share):
    first = int(share * len(points))
    distances = np.linalg.norm(points[:, None] - points, axis=-1)
    later, earlier = np.nonzero(np.tril(distances <= radius, -1))
    # Not where rounding decides.
    unclear = np.abs(distances - radius) < 1e-9
    expected = {(i, j) for i, j in zip(earlier.tolist(), later.tolist()) if j >= first and not unclear[i, j]}
    for strategy, dimensions in WAYS:
        pairs = list(map(tuple, neighbour_pairs(points, radius, strategy, dimensions, first).tolist()))
        assert pairs == sorted(set(pairs), key=lambda pair: pair[::-1])
        assert {pair for pair in pairs if not unclear[pair]} == expected


@pytest.mark.parametrize('strategy, dimensions', WAYS)
def test_no_points_have_no_neighbours(strategy, dimensions):
    for count in (0, 1):
        assert neighbour_pairs(np.zeros((count, 2)), 1.0, strategy, dimensions).shape == (0, 2)


def test_points_on_the_upper_border_are_in_the_table():
    points = np.array([(x, y) for x in range(6) for y in range(6)], float)
    pairs = neighbour_pairs(points, 1.0 + 1e-9, NeighborSearchStrategy.PARTIAL_INDEX_TABLE)
    assert len(pairs) == 2 * 6 * 5
