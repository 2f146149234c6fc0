"""The channel loses, delays and doubles what it is told to, and nothing passes where it is cut."""
import numpy as np
import pytest
from mobile_planning import InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.channel import Burst, Channel, Cut, Partition, wire_size
from mobile_planning.fleet.message import Link, LinkMode, RobotMsg


def times(channel, count=2000, sender=1, receiver=2, now=0.0, seed=0):
    rng = np.random.default_rng(seed)
    return channel.travel_times(rng, sender, [receiver] * count, now)


def test_the_share_of_lost_messages_is_the_one_asked_for():
    assert np.mean([not copies for copies in times(Channel(loss=0.3))]) == pytest.approx(0.3, abs=0.04)
    assert all(copies for copies in times(Channel())) and not any(times(Channel(loss=1.0)))


def test_every_message_takes_at_least_the_least_time_and_at_most_the_delay_more():
    taken = np.concatenate(times(Channel(delay=0.5, least=0.01)))
    assert taken.min() >= 0.01 and taken.max() <= 0.51 and np.ptp(taken) > 0.45


def test_a_doubled_message_arrives_at_two_times():
    copies = times(Channel(delay=0.5, duplicates=0.2))
    assert np.mean([len(each) == 2 for each in copies]) == pytest.approx(0.2, abs=0.04)
    assert all(len(set(each)) == len(each) for each in copies)


def test_a_cut_stops_one_direction_for_its_time_only():
    channel = Channel(interruptions=(Cut(1, 2, 3.0, 5.0),))

    def passes(sender, receiver, now):
        return bool(times(channel, 1, sender, receiver, now)[0])
    assert not passes(1, 2, 3.0) and not passes(1, 2, 4.99) and passes(1, 2, 2.99) and passes(1, 2, 5.0)
    assert passes(2, 1, 4.0) and passes(1, 3, 4.0) and passes(None, 2, 4.0)


def test_a_partition_stops_everything_between_its_two_groups():
    channel = Channel(interruptions=(Partition({1, 2}, 0.0, 5.0),))
    passing = {(a, b) for a in range(1, 5) for b in range(1, 5) if a != b and times(channel, 1, a, b, 1.0)[0]}
    assert passing == {(1, 2), (2, 1), (3, 4), (4, 3)}
    assert times(channel, 1, None, 1, 1.0)[0] and times(channel, 1, 1, 3, 5.0)[0]
    at_once = channel.travel_times(np.random.default_rng(0), 1, [2, 3, 4], 1.0)
    assert [bool(copies) for copies in at_once] == [True, False, False]


def test_a_burst_silences_one_radio_both_ways():
    channel = Channel(interruptions=(Burst(2, 3.0, 5.0),))
    passing = {(a, b) for a in range(1, 4) for b in range(1, 4) if a != b and times(channel, 1, a, b, 3.0)[0]}
    assert passing == {(1, 3), (3, 1)}
    assert times(channel, 1, 1, 2, 2.99)[0] and times(channel, 1, 2, 1, 5.0)[0] and times(channel, 1, None, 1, 4.0)[0]


def test_what_becomes_of_one_message_does_not_change_the_next_one():
    free, cut = Channel(delay=1.0), Channel(delay=1.0, interruptions=(Cut(1, 2, 0.0, 1.0),))
    for now in (0.5, 2.0):
        streams = [np.random.default_rng(3) for _ in range(2)]
        for channel, rng in zip((free, cut), streams):
            channel.travel_times(rng, 1, [2], now)
        assert streams[0].random() == streams[1].random()


@pytest.mark.parametrize('options', [{'loss': -0.1}, {'loss': 1.1}, {'loss': np.nan}, {'delay': -1.0},
                                     {'delay': np.inf}, {'least': -1.0}, {'duplicates': 2.0}])
def test_a_channel_out_of_its_range_is_refused(options):
    with pytest.raises(InvalidInput):
        Channel(**options)


@pytest.mark.parametrize('since, until', [(3.0, 3.0), (3.0, 2.0), (-1.0, 2.0), (0.0, np.inf), (np.nan, 2.0)])
def test_an_interruption_without_a_span_is_refused(since, until):
    with pytest.raises(InvalidInput):
        Cut(1, 2, since, until)
    with pytest.raises(InvalidInput):
        Partition({1}, since, until)


def test_a_message_grows_by_what_is_put_in():
    plan = Plan(0, 0.25, np.zeros((15, 2)))
    alone = RobotMsg(False, np.zeros(13), np.zeros(13), np.zeros(2), plan=plan)
    linked = RobotMsg(False, np.zeros(13), np.zeros(13), np.zeros(2), plan=plan,
                      links={2: Link(1, LinkMode.CON, 7, 7, 3), 3: Link()})
    # A peer's id, and the five numbers of its link.
    assert wire_size(linked) - wire_size(alone) == 2 * 6 * 4
    assert 2 * 8 * 15 + 2 * 8 * 13 < wire_size(alone) < 2 * 8 * 15 + 2 * 8 * 13 + 200
