"""What is missing among numbered messages counts as lost, what was only overtaken does not."""
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning.fleet.losses import Losses


def heard(messages, until, every=0.1):
    """Return when losses were seen, of ``messages`` (time, sender, epoch, number), looked for ``every`` so often.

    In the first second after the first message they are expected, which is left out.
    """
    losses, waiting, seen = Losses(), sorted(messages), []
    began = waiting[0][0]
    for now in np.arange(0.0, until, every):
        while waiting and waiting[0][0] <= now:
            time, sender, epoch, number = waiting.pop(0)
            losses.note(sender, epoch, number, time)
        if losses.are_any(now) and now > began + 1.0:
            seen.append(now)
    return seen


@given(st.lists(st.floats(0.0, 0.4), min_size=1, max_size=30), st.data())
def test_no_order_in_which_all_arrive_within_half_a_second_is_a_loss(delays, data):
    copies = data.draw(st.lists(st.integers(0, len(delays) - 1), max_size=5))
    said = [(0.05 * number + delays[number], 1, 1, number) for number in [*range(len(delays)), *copies]]
    assert not heard(said, 5.0)


@given(st.integers(1, 8), st.integers(1, 8))
def test_each_lost_message_counts_for_some_seconds(first, second):
    said = [(0.05 * number, 1, 1, number) for number in range(10) if number not in (first, second)]
    seen = heard(said, 10.0)
    assert 1.0 < seen[0] < 1.2 and 5.0 < seen[-1] < 6.2 and len(seen) > 40


def test_losses_are_expected_until_enough_was_heard_to_tell():
    losses = Losses()
    assert losses.are_any(0.0)
    for number in range(30):
        losses.note(1, 1, number, 5.0 + 0.1 * number)
        assert losses.are_any(5.0 + 0.1 * number) == (number < 10)


def test_a_new_process_counts_anew_and_senders_are_told_apart():
    said = [(0.1 * number, 1 + number % 2, 1, number // 2) for number in range(20)]
    said += [(2.0 + 0.1 * number, 1, 2, 100 + number) for number in range(10)]
    assert not heard(said, 10.0)


def test_a_number_from_far_ahead_costs_no_more_than_a_gap():
    losses = Losses()
    losses.note(1, 1, 0, 0.0)
    losses.note(1, 1, 2**32 - 1, 0.1)
    assert losses.are_any(1.0) and not losses.are_any(7.0)
