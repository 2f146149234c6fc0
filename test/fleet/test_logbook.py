"""What one process wrote is what the next one reads, or a sentence."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.logbook import Entry, Logbook
from mobile_planning.fleet.stage import Stage

FIRST = Entry(Plan.at_rest(0, 0.1, (0, 0, 0)), np.nan, 7)


@settings(max_examples=20)
@given(st.integers(-2**48, 2**48), st.integers(1, 100), st.floats(-3, 3), st.floats(-3, 3) | st.just(np.nan),
       st.booleans(), st.floats(0, 1e10))
def test_plans_are_read_as_they_were_written(tmp_path_factory, first_knot, count, heading, final, reverse, commit):
    points = np.random.default_rng(count).uniform(-1e3, 1e3, (count, 2))
    plan = Plan(first_knot, 0.125, np.concatenate([points, *3 * [points[-1:]]]), heading, final, reverse)
    path = tmp_path_factory.getbasetemp() / 'book'
    path.unlink(missing_ok=True)
    Logbook(path).write(FIRST)
    Logbook(path).write(Entry(plan, commit, 8))
    first, last = Logbook(path).read()
    assert np.isnan(first.commit) and first.epoch == 7 and np.array_equal(first.plan.points, FIRST.plan.points)
    read = last.plan
    assert np.array_equal(read.points, plan.points) and read.first_knot == first_knot and read.step == 0.125
    assert (read.heading, read.reverse, last.commit, last.epoch) == (heading, reverse, commit, 8)
    assert np.array_equal(read.final_heading, final, equal_nan=True)


def test_no_file_is_no_plan(tmp_path):
    assert Logbook(tmp_path / 'nothing').read() == ()


def test_a_process_that_is_killed_while_it_writes_leaves_what_was_written_before(tmp_path):
    book = Logbook(tmp_path / 'book')
    book.write(FIRST)
    whole = (tmp_path / 'book').read_text()
    for cut in range(len(whole)):
        (tmp_path / 'book').write_text(whole + whole[:cut])
        assert len(book.read()) == 1
        # The next process goes on after what is whole.
        Logbook(tmp_path / 'book').write(FIRST)
        assert len(book.read()) == 2


def test_stages_are_kept_among_plans_and_the_newest_outlives_all_plans(tmp_path, monkeypatch):
    monkeypatch.setattr('mobile_planning.fleet.logbook._LARGEST', 5000)
    book, stages = Logbook(tmp_path / 'book'), [Stage(1.0, (x, 2.0, 0.0), False) for x in (3.0, 4.0)]
    for stage in stages:
        book.note(stage)
    assert book.stages() == tuple(stages) and book.read() == ()
    for count in range(100):
        book.write(Entry(Plan.at_rest(count, 0.1, (0, 0, 0)), np.nan, 7))
    assert book.stages() == (stages[1],) and book.read()[-1].plan.first_knot == 99


def test_a_file_that_cannot_be_written_is_given_up_once(tmp_path):
    told = []
    book = Logbook(tmp_path / 'no folder' / 'book', told.append)
    for _ in range(3):
        book.write(FIRST)
    assert len(told) == 1 and isinstance(told[0], OSError)
    nothing = Logbook()
    nothing.write(FIRST)
    assert nothing.read() == nothing.stages() == ()


@pytest.mark.parametrize('text', ['{', '[]', '{}', '{"stage": 7}', '7', '{"first_knot": 1}', '[' * 100_000, '\0',
                                  '{"first_knot": 0, "step": 0, "points": [], "heading": 0, "final_heading": null, '
                                  '"reverse": false, "commit": 0, "epoch": 1}'])
def test_a_file_that_is_no_logbook_is_refused_with_a_sentence(tmp_path, text):
    (tmp_path / 'book').write_text(text + '\n')
    with pytest.raises(InvalidInput, match='cannot be read'):
        Logbook(tmp_path / 'book').read() + Logbook(tmp_path / 'book').stages()


def test_a_folder_is_no_logbook(tmp_path):
    with pytest.raises(InvalidInput, match='cannot be read'):
        Logbook(tmp_path).read()


def test_of_a_large_logbook_the_older_half_is_left_out_again_and_again(tmp_path, monkeypatch):
    monkeypatch.setattr('mobile_planning.fleet.logbook._LARGEST', 5000)
    book = Logbook(tmp_path / 'book')
    for count in range(200):
        book.write(Entry(Plan.at_rest(count, 0.1, (0, 0, 0)), np.nan, 7))
        assert (tmp_path / 'book').stat().st_size < 5500
    knots = [entry.plan.first_knot for entry in book.read()]
    assert 10 < len(knots) < 50 and knots == list(range(200 - len(knots), 200))
    assert [path.name for path in tmp_path.iterdir()] == ['book']
