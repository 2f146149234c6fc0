"""A body on its plan: with a good base, a bad one, late poses, none, and without a planner."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.base import BaseOptions, SimulatedBase
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.pilot import Pilot
from mobile_planning.fleet.scenarios import scene
from mobile_planning.fleet.tracking import Tracker, driven

RATE = 50
TRACKER = Tracker(1.2, 6.0, a_max=3.0, alpha_max=30.0)


@pytest.fixture(scope='module')
def solution():
    """Return what one robot of four drives that swap their places."""
    simulation = scene('swap', 1, robots=4).world_sim()
    assert simulation.run(seed=1).valid
    return simulation.solutions[1]


def drive(solution, base, *, until=None, delay=0.0, blind=(np.inf, np.inf)):
    """Let a pilot drive a solution, plan after plan as it was committed; return it and the errors [m] at each tick."""
    first = solution.plans[0]
    pilot = Pilot(TRACKER, first)
    begin, waiting, errors, pending = first.first_knot * first.step, list(solution.plans[1:]), [], []
    pilot.localise(base.measured(), begin - 1.0)
    until = solution.end if until is None else until
    times = np.arange(begin, solution.end + 1.0, 1 / RATE)
    for now in times:
        while waiting and waiting[0].first_knot * first.step - 0.1 <= now and now < until:
            pilot.follow(waiting.pop(0))
        if not blind[0] <= now < blind[1]:
            pending.append((base.measured(), now))
        while pending and pending[0][1] <= now - delay + 1e-9:
            pilot.localise(*pending.pop(0), 0.0)
        base.drive(pilot.command(now, 1 / RATE), 1 / RATE)
        errors.append(np.linalg.norm(base.pose[:2] - pilot.reference(now + 1 / RATE)[:2]))
    return pilot, np.array(errors)


def start_of(solution):
    """Return the pose at which a solution begins."""
    first = solution.plans[0]
    return first.state(first.first_knot * first.step)[:3]


def test_a_good_base_keeps_within_three_millimetres_of_the_plan(solution):
    pilot, errors = drive(solution, SimulatedBase(start_of(solution), BaseOptions(a_max=3.0, alpha_max=30.0)))
    assert errors.max() < 0.003 and pilot.status.is_tracking and pilot.status.tracking_error <= errors.max() + 1e-6


def test_a_base_that_slips_and_a_noisy_pose_stay_within_the_margin_of_the_proof(solution):
    base = SimulatedBase(start_of(solution), BaseOptions(3.0, 30.0, slip=0.1, pose_noise=0.002), seed=3)
    _, errors = drive(solution, base)
    assert 0.001 < errors.max() < 0.02


def test_poses_that_are_late_do_no_harm(solution):
    options = BaseOptions(a_max=3.0, alpha_max=30.0)
    assert drive(solution, SimulatedBase(start_of(solution), options), delay=0.2)[1].max() < 0.01


def test_an_error_at_the_start_is_measured_and_driven_off(solution):
    pose = start_of(solution) + (0.04, -0.03, 0.2)
    pilot = Pilot(Tracker(1.2, 6.0), solution.plans[0])
    pilot.localise(pose, 0.0)
    pilot.command(0.0, 0.02)
    assert pilot.status.tracking_error == pytest.approx(0.05, abs=1e-6)
    assert drive(solution, SimulatedBase(pose))[1][-RATE:].max() < 0.01


def test_without_a_planner_the_plan_in_force_is_driven_to_its_end(solution):
    death = solution.plans[len(solution.plans) // 2].first_knot * solution.plans[0].step
    pilot, errors = drive(solution, SimulatedBase(start_of(solution)), until=death)
    assert errors.max() < 0.003
    assert pilot.reference(1e9)[3] < 1e-9 and len(pilot._plans) <= 4


def test_without_a_pose_it_drives_on_by_its_commands_as_long_as_that_is_sure_enough(solution):
    middle = (solution.plans[0].first_knot * solution.plans[0].step + solution.end) / 2
    _, errors = drive(solution, SimulatedBase(start_of(solution)), blind=(middle, middle + 0.6))
    assert errors.max() < 0.003
    pilot, _ = drive(solution, SimulatedBase(start_of(solution)), blind=(middle, np.inf))
    assert not pilot.status.is_tracking and pilot.status.drift > 0.05 and pilot.status.pose_age > 1.0
    assert pilot.command(solution.end, 0.02).tolist() == [0.0, 0.0]


def test_before_the_first_pose_it_stands(solution):
    pilot = Pilot(Tracker(1.2, 6.0), solution.plans[-1])
    assert pilot.command(solution.end - 2.0, 0.02).tolist() == [0.0, 0.0] and not pilot.status.is_tracking


def test_a_clock_set_back_is_survived():
    plan = Plan.at_rest(0, 0.1, (1.0, 1.0, 0.0))
    pilot = Pilot(Tracker(1.2, 6.0), plan)
    pilot.localise((1.0, 1.0, 0.0), 100.0)
    pilot.command(100.0, 0.02)
    pilot.reset()
    pilot.localise((1.0, 1.0, 0.0), 5.0)
    assert pilot.command(5.0, 0.02) == pytest.approx([0.0, 0.0]) and pilot.status.is_tracking


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(-1, 1), st.floats(-3, 3), st.floats(0.01, 0.1)), min_size=1, max_size=20),
       st.floats(0.05, 10), st.floats(0.05, 30))
def test_a_base_changes_its_speeds_as_fast_as_it_can_at_every_instant(commands, a_max, alpha_max):
    base, pose, speeds = SimulatedBase((1, 2, 3), BaseOptions(a_max, alpha_max)), np.array([1.0, 2.0, 3.0]), np.zeros(2)
    for v, omega, duration in commands:
        base.drive((v, omega), duration)
        # The integral of the speeds as they are in the middles of steps too short to matter.
        steps = 2000
        times = (np.arange(steps) + 0.5)[:, None] * duration / steps
        most = np.array([a_max, alpha_max])
        course = speeds + np.clip(np.array([v, omega]) - speeds, -most * times, most * times)
        headings = pose[2] + (np.cumsum(course[:, 1]) - course[:, 1] / 2) * duration / steps
        pose = pose + np.append(course[:, 0] @ np.stack([np.cos(headings), np.sin(headings)], axis=1),
                                course[:, 1].sum()) * duration / steps
        speeds = speeds + np.clip(np.array([v, omega]) - speeds, -most * duration, most * duration)
        assert base.speeds == pytest.approx(speeds) and base.pose[:2] == pytest.approx(pose[:2], abs=1e-4)
        assert np.exp(1j * base.pose[2]) == pytest.approx(np.exp(1j * pose[2]), abs=1e-4)


def test_an_arc_without_limits_is_driven_exactly():
    base = SimulatedBase((1, 2, 3))
    base.drive((0.5, 2.0), 0.7)
    base.drive((0.5, 2.0), 0.0)
    assert base.pose == pytest.approx(driven((1, 2, 3), (0.5, 2.0), 0.7))


def test_one_seed_gives_one_run_to_the_byte():
    runs = []
    for _ in range(2):
        base = SimulatedBase((0, 0, 0), BaseOptions(slip=0.1, pose_noise=0.01), seed=7)
        runs.append([])
        for _ in range(50):
            base.drive((1.0, 0.3), 0.02)
            runs[-1].append(base.measured().tobytes())
    assert runs[0] == runs[1]


@pytest.mark.parametrize('make', [
    lambda: BaseOptions(a_max=0.0), lambda: BaseOptions(slip=-0.1), lambda: BaseOptions(pose_noise=np.nan),
    lambda: Pilot(Tracker(1, 1), Plan.at_rest(0, 0.1, (0, 0, 0)), drift_rate=0.0),
    lambda: Pilot(Tracker(1, 1), Plan.at_rest(0, 0.1, (0, 0, 0)), most_drift=np.inf)])
def test_impossible_numbers_are_refused(make):
    with pytest.raises(InvalidInput):
        make()
