"""Obstacles grow to every cell within the radius, also when only what changed is looked at."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.distance import cdist

from mobile_planning.errors import Cancelled
from mobile_planning.world import row_blocks
from mobile_planning.world.inflation import grown, regrown


@pytest.fixture(scope='module', autouse=True)
def small_pieces():
    """Let the work be done in pieces of a few rows, of which even the small maps here have several."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(row_blocks, '_CELLS', 60)
        yield


def within(cells, radius):
    """Return which cells lie within the radius of a given one, each compared with all of them."""
    every, given_ones = np.argwhere(np.ones_like(cells)), np.argwhere(cells)
    if len(given_ones) == 0:
        return np.zeros_like(cells)
    return (cdist(every, given_ones).min(axis=1) <= radius + 1e-9).reshape(cells.shape)


RADII = st.sampled_from([0.0, 0.5, 1.0, 2 ** 0.5, 3.0, 5.5, 30.0])


@given(st.integers(0, 2 ** 30), RADII)
def test_cells_grow_by_the_radius_between_centres(seed, radius):
    random = np.random.default_rng(seed)
    cells = random.random(random.integers(1, 30, 2)) < random.choice([0.0, 0.02, 0.5])
    before = cells.copy()
    result = grown(cells, radius)
    assert np.array_equal(result, within(cells, radius)) and np.array_equal(cells, before)


def test_a_radius_of_whole_cells_reaches_them_in_spite_of_rounding():
    assert 0.3 / 0.1 < 3 and grown(np.array([[True, False, False, False]]), 0.3 / 0.1).all()


@given(st.integers(0, 2 ** 30), st.sampled_from([0.0, 1.0, 2 ** 0.5, 3.7, 20.0]))
def test_growing_what_changed_gives_what_growing_all_gives(seed, radius):
    random = np.random.default_rng(seed)
    # Several squares, the last of them cut off by the edge.
    cells = random.random(random.integers(1, 200, 2)) < 0.003
    before = grown(cells, radius)
    kept = before.copy()
    changed = random.integers((0, 0), cells.shape[::-1], (random.integers(0, 20), 2))
    cells[tuple(changed.T[::-1])] = random.random() < 0.5
    after, differing = regrown(before, cells, radius, changed)
    assert np.array_equal(after, grown(cells, radius)) and np.array_equal(before, kept)
    assert set(map(tuple, np.argwhere(after != before)[:, ::-1])) <= set(map(tuple, differing))


@pytest.mark.parametrize('radius', [0.0, 2.0])
def test_nothing_that_changed_changes_nothing(radius):
    before = grown(np.eye(5, dtype=bool), radius)
    after, differing = regrown(before, np.eye(5, dtype=bool), radius, np.empty((0, 2), int))
    assert np.array_equal(after, before) and len(differing) == 0


def test_growing_a_large_map_can_be_stopped():
    with pytest.raises(Cancelled):
        grown(np.eye(200, dtype=bool), 2.0, np.ones(1, np.uint8))
