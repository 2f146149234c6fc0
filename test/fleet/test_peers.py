"""Who is listened to: nobody takes the place of one who speaks, nobody drowns the others, no clock is trusted."""
from math import isnan, nan

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.peers import MAX_PEERS, PeerTable


def admits(table, *args, now, stamp=100.0, time=100.0):
    """Return whether a message is let in."""
    try:
        table.admit(*args, stamp=stamp, time=time, now=now)
    except InvalidInput:
        return False
    return True


def test_another_process_is_not_listened_to_while_the_first_one_speaks():
    table = PeerTable()
    for tenth in range(30):
        assert admits(table, 1, 5, b'a', now=tenth / 10)
        assert not admits(table, 1, 9, b'b', now=tenth / 10)
    assert table.refused == {'spoofed': 30}


def test_a_robot_that_is_started_anew_is_heard_once_its_old_process_is_silent():
    table = PeerTable(silent_after=1.0)
    assert admits(table, 1, 5, b'a', now=0.0)
    assert not admits(table, 1, 6, b'b', now=0.9)
    assert admits(table, 1, 6, b'b', now=1.1) and not admits(table, 1, 5, b'a', now=1.2)


def test_an_older_life_never_comes_back_however_long_the_silence():
    table = PeerTable()
    assert admits(table, 1, 5, b'a', now=0.0)
    assert not admits(table, 1, 5, b'b', now=100.0) and not admits(table, 1, 4, b'b', now=100.0)
    assert not admits(table, 1, 4, b'a', now=100.0) and admits(table, 1, 6, b'a', now=100.0)
    assert table.refused == {'spoofed': 2, 'replayed': 1}


def test_without_word_of_the_process_the_epoch_alone_decides():
    table = PeerTable()
    assert admits(table, 1, 5, None, now=0.0) and admits(table, 1, 6, None, now=0.1)
    assert not admits(table, 1, 5, None, now=0.2)


@pytest.mark.parametrize('stamp', [97.9, 102.1, 0.0, float('inf'), nan])
def test_what_was_said_long_ago_or_comes_from_the_future_is_stale(stamp):
    table = PeerTable(most_age=2.0)
    assert not admits(table, 1, 5, b'a', now=0.0, stamp=stamp) and table.refused == {'stale': 1}


def test_a_flood_is_cut_down_to_the_rate_and_drowns_nobody_else():
    table = PeerTable(rate=50.0, burst=10)
    through = sum(admits(table, 1, 5, b'a', now=thousandth / 1000) for thousandth in range(2000))
    assert 100 <= through <= 111
    assert all(admits(table, 2, 5, b'b', now=2.0 + tenth / 10) for tenth in range(20))


def test_a_flood_in_the_name_of_another_costs_it_nothing():
    table = PeerTable(rate=50.0, burst=10)
    assert admits(table, 1, 5, b'a', now=0.0)
    assert not any(admits(table, 1, 5, b'b', now=0.1) for _ in range(1000))
    assert admits(table, 1, 5, b'a', now=0.2)


def test_the_table_does_not_grow_beyond_its_bound():
    table = PeerTable(silent_after=1.0)
    assert all(admits(table, eyed, 1, b'a', now=0.0) for eyed in range(MAX_PEERS))
    assert not admits(table, MAX_PEERS, 1, b'a', now=0.5) and table.refused == {'crowded out': 1}
    assert admits(table, MAX_PEERS, 1, b'a', now=2.0) and len(table._peers) == MAX_PEERS


def test_who_falls_silent_is_named_within_the_time():
    table = PeerTable(silent_after=1.0)
    for eyed in 1, 2:
        assert admits(table, eyed, 5, bytes([eyed]), now=0.0)
        table.note(eyed, 0.0, nan, 0.0)
    assert admits(table, 1, 5, b'\1', now=1.0)
    table.note(1, 0.0, nan, 1.0)
    assert table.silent((1, 2, 3), 1.1) == [2, 3] and table.is_silent(2, 1.1) and not table.is_silent(1, 1.1)


delays = st.lists(st.floats(0.0, 0.5), min_size=1, max_size=10)


@given(delays, delays, st.floats(-1.0, 1.0))
def test_the_clock_error_is_never_more_than_the_truth_and_all_of_it_without_delay(there, back, ahead):
    mine, theirs = PeerTable(), PeerTable()
    mine.admit(2, 1, b'b', stamp=0.0, time=0.0, now=0.0)
    theirs.admit(1, 1, b'a', stamp=0.0, time=0.0, now=0.0)
    for delay in there:
        theirs.note(1, delay + ahead, nan, 0.0)
    for delay in back:
        mine.note(2, delay - ahead, theirs.lag(1), 0.0)
    assert mine.clock_error(2) <= abs(ahead) + 1e-12
    if min(there) == min(back) == 0.0:
        assert mine.clock_error(2) == pytest.approx(abs(ahead))


def test_an_old_least_lag_is_forgotten():
    table = PeerTable()
    table.admit(1, 1, b'a', stamp=0.0, time=0.0, now=0.0)
    assert isnan(table.lag(1)) and isnan(table.lag(9)) and table.clock_error(9) == 0.0
    table.note(1, 0.001, nan, 0.0)
    for second in range(1, 31):
        table.note(1, 0.2, nan, float(second))
    assert table.lag(1) == 0.2


@pytest.mark.parametrize('options', [{'silent_after': 0.0}, {'most_age': -1.0}, {'rate': nan}, {'burst': 0}])
def test_impossible_numbers_are_refused(options):
    with pytest.raises(InvalidInput):
        PeerTable(**options)
