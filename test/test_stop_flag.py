"""The flag that deadlines and callers set and kernels poll."""
import threading

import numpy as np
import pytest

from mobile_planning.errors import Cancelled, PlanningTimeout
from mobile_planning.stop_flag import StopFlag


def wait_until_set(flag):
    """Do what a kernel does: look at the flag until it is set, then give up."""
    for _ in range(10 ** 9):
        if flag.array[0]:
            raise Cancelled('stopped')


def test_a_deadline_stops_the_work_and_is_a_timeout():
    with pytest.raises(PlanningTimeout, match='0.02 s'):
        with StopFlag(0.02) as flag:
            wait_until_set(flag)


def test_the_callers_flag_stops_the_work_and_is_a_cancellation():
    cancelled, working = np.zeros(1, np.uint8), threading.Event()

    def cancel():
        working.wait(10)
        cancelled[0] = 1

    other = threading.Thread(target=cancel)
    other.start()
    with pytest.raises(Cancelled, match='withdrawn'):
        with StopFlag(60.0, cancelled) as flag:
            working.set()
            wait_until_set(flag)
    other.join()


def test_nothing_begins_after_the_deadline():
    with pytest.raises(PlanningTimeout):
        with StopFlag(1e-9):
            pytest.fail('the block ran')


def test_work_that_is_done_in_time_ends_as_it_did():
    for flag in (StopFlag(), StopFlag(60.0), StopFlag(None, np.zeros(1, np.uint8))):
        for _ in range(2):
            with flag as entered:
                assert entered.array[0] == 0
        with pytest.raises(KeyError):
            with flag:
                raise KeyError('of the work')
        flag.check()


def test_no_watcher_outlives_its_block():
    before = threading.active_count()
    for _ in range(5):
        with StopFlag(60.0):
            pass
    assert threading.active_count() == before
