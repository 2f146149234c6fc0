"""HoldUp: what is said of a robot that waits."""
import pytest

from mobile_planning.fleet.hold_up import HoldUp, Reason


@pytest.mark.parametrize('held, said', [
    (HoldUp(1.5, Reason.TURN, (2, 7)), 'turn for 2, 7 since 1.50 s'),
    (HoldUp(0.0, Reason.STALLED), 'stalled since 0.00 s'),
    (HoldUp(12.25, Reason.BLOCKED, (3,)), 'blocked for 3 since 12.25 s')])
def test_a_robot_that_waits_says_why_for_whom_and_since_when(held, said):
    assert str(held) == said
