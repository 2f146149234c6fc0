"""How far a body comes off its plans, tried before a mission, is what it does in one."""
import pytest

from mobile_planning.fleet.scenarios import scene
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.fleet.tracking_budget import _set_out, lag, worst_lag


@pytest.fixture(scope='module')
def solutions():
    """Return what four robots drive that swap their places."""
    simulation = scene('swap', 1, robots=4).world_sim()
    assert simulation.run(seed=1).valid
    return simulation.solutions.values()


@pytest.mark.parametrize('alpha_max', [15.0, 20.0, 30.0, 60.0])
def test_a_mission_s_body_comes_no_further_off_its_plans_than_was_tried(solutions, alpha_max):
    tracker = Tracker(1.2, 6.0, a_max=3.0, alpha_max=alpha_max)
    tried = worst_lag(tracker, (1.0, 5.0), (2.0, 10.0), 0.25, 0.05)
    assert max(lag(solution, tracker, 0.05) for solution in solutions) < 1.5 * tried + 1e-3


@pytest.mark.parametrize('alpha_max', [30.0, 60.0])
def test_the_shipped_margin_holds_however_often_and_whenever_commands_come(alpha_max):
    tracker = Tracker(1.2, 6.0, a_max=3.0, alpha_max=alpha_max)
    (solution,) = _set_out([1.8], (1.0, 5.0), (2.0, 10.0), 0.25)
    found = [lag(solution, tracker, period, phase) for period in (0.05, 0.02, 0.005) for phase in (0.0, 0.4, 0.8)]
    assert 1e-4 < max(found) < 0.015


def test_a_slower_turning_robot_needs_less_of_its_base():
    tracker = Tracker(1.2, 2.4, a_max=3.0, alpha_max=10.0)
    slow, fast = (worst_lag(tracker, (1.0, omega), (2.0, 10.0), 0.25, 0.05) for omega in (1.5, 5.0))
    assert slow < 0.015 < fast
