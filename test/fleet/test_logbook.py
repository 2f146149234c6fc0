"""What one process wrote last is what the next one reads, or a sentence."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.logbook import Logbook


@settings(max_examples=20)
@given(st.integers(-2**48, 2**48), st.integers(1, 100), st.floats(-3, 3), st.floats(-3, 3) | st.just(np.nan),
       st.booleans())
def test_a_plan_is_read_as_it_was_written(tmp_path_factory, first_knot, count, heading, final, reverse):
    points = np.random.default_rng(count).uniform(-1e3, 1e3, (count, 2))
    plan = Plan(first_knot, 0.125, np.concatenate([points, *3 * [points[-1:]]]), heading, final, reverse)
    book = Logbook(tmp_path_factory.getbasetemp() / 'book')
    book.write(Plan.at_rest(0, 0.1, (0, 0, 0)), 7)
    book.write(plan, 8)
    read, epoch = book.read()
    assert np.array_equal(read.points, plan.points) and read.first_knot == first_knot and read.step == 0.125
    assert (read.heading, read.reverse, epoch) == (heading, reverse, 8)
    assert np.array_equal(read.final_heading, final, equal_nan=True)


def test_no_file_is_no_plan(tmp_path):
    assert Logbook(tmp_path / 'nothing').read() is None


@pytest.mark.parametrize('text', ['', '{', '[]', '{}', '{"first_knot": 1}', '[' * 100_000, 'x' * 70_000, '\0',
                                  '{"first_knot": 0, "step": 0, "points": [], "heading": 0, "final_heading": null, '
                                  '"reverse": false}'])
def test_a_file_that_is_no_logbook_is_refused_with_a_sentence(tmp_path, text):
    (tmp_path / 'book').write_text(text)
    with pytest.raises(InvalidInput):
        Logbook(tmp_path / 'book').read()


def test_a_folder_is_no_logbook(tmp_path):
    with pytest.raises(InvalidInput, match='cannot be read'):
        Logbook(tmp_path).read()
