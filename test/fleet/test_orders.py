"""Orders: which mode follows from what a robot is told and where it has come to."""
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning.fleet.message import Mode
from mobile_planning.fleet.orders import Orders


def told(*events):
    """Return the orders after ``events``: numbers are times at which nothing has arrived, words are methods."""
    orders = Orders()
    for event in events:
        if event == 'arrive':
            orders.note(100.0, True)
        elif event == 'start':
            orders.start(5.0)
        elif event in ('pause', 'resume'):
            orders.is_paused = event == 'pause'
        elif isinstance(event, str):
            getattr(orders, event)()
        else:
            orders.note(event, False)
    return orders


@pytest.mark.parametrize('events, mode', [
    ([], Mode.WAITING), (['start'], Mode.WAITING), (['start', 4.9], Mode.WAITING), (['start', 5.0], Mode.DRIVING),
    ([9.0], Mode.WAITING), (['start', 6.0, 'stop'], Mode.STOPPED), (['start', 6.0, 'stop', 7.0], Mode.STOPPED),
    (['stop'], Mode.STOPPED), (['start', 'arrive'], Mode.DONE), (['start', 'arrive', 'stop'], Mode.DONE),
    (['start', 'arrive', 'renew'], Mode.DRIVING), (['start', 'arrive', 'stop', 'renew'], Mode.STOPPED),
    (['start', 'arrive', 101.0], Mode.DRIVING), (['renew'], Mode.WAITING), (['start', 6.0, 'renew'], Mode.DRIVING),
    (['pause', 'start', 4.0], Mode.WAITING), (['start', 6.0, 'pause'], Mode.STOPPED),
    (['start', 6.0, 'pause', 'resume'], Mode.DRIVING), (['start', 'arrive', 'pause'], Mode.STOPPED),
    (['start', 'arrive', 'pause', 'resume'], Mode.DONE)])
def test_the_mode_follows_from_what_was_told(events, mode):
    assert told(*events).mode is mode


EVENTS = st.lists(st.sampled_from(['start', 'stop', 'renew', 'pause', 'resume', 'arrive', 4.0, 6.0]), max_size=12)


@given(EVENTS)
def test_a_pause_hides_what_the_robot_did_and_changes_nothing(events):
    orders, never = told(*events), told(*(event for event in events if event != 'pause'))
    assert orders.is_done == never.is_done and orders.mission_start == never.mission_start
    orders.is_paused = False
    assert orders.mode is never.mode


@given(EVENTS)
def test_nobody_drives_who_was_stopped(events):
    orders = told(*events, 'stop', 50.0, 'renew', 60.0)
    assert orders.mode is Mode.STOPPED and not orders.has_mission
