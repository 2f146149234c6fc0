"""The tracking law, held against its proof and against steps so small that nothing is left to be clever about."""
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.tracking import Tracker, driven, seen_from

coordinates = st.floats(-5, 5)
poses = st.tuples(coordinates, coordinates, st.floats(-3.1, 3.1))
speeds = st.tuples(st.floats(-2, 2), st.floats(-6, 6))


@given(poses, speeds, st.floats(0.01, 0.5))
def test_an_arc_is_what_small_steps_come_to(pose, command, duration):
    steps, theta = 4000, pose[2]
    headings = theta + command[1] * duration * (np.arange(steps) + 0.5) / steps
    along = np.array([np.cos(headings), np.sin(headings)]).sum(axis=1)
    place = np.array(pose[:2]) + command[0] * duration / steps * along
    arrived = driven(pose, command, duration)
    assert arrived[:2] == pytest.approx(place, abs=1e-6)
    assert np.exp(1j * arrived[2]) == pytest.approx(np.exp(1j * (theta + command[1] * duration)), abs=1e-9)


@given(poses, poses)
def test_a_pose_seen_from_another_leads_back_to_it(pose, other):
    e1, e2, e3 = seen_from(pose, other)
    turn = np.exp(1j * pose[2])
    assert complex(*pose[:2]) + turn * complex(e1, e2) == pytest.approx(complex(*other[:2]), abs=1e-9)
    assert turn * np.exp(1j * e3) == pytest.approx(np.exp(1j * other[2]), abs=1e-9)


@given(poses, poses, st.tuples(st.floats(-50, 50), st.floats(-50, 50)))
def test_no_command_is_beyond_the_drive_and_its_arc_is_the_wanted_one(pose, other, speed):
    weak, strong = Tracker(1.0, 3.0), Tracker(1e6, 1e6)
    v, omega = weak.command((*other, *speed), pose)
    assert abs(v) <= 1.0 + 1e-12 and abs(omega) <= 3.0 + 1e-12
    wanted = strong.command((*other, *speed), pose)
    assert v * wanted[1] == pytest.approx(omega * wanted[0], abs=1e-6 * (1 + np.abs(wanted).max()))


@given(st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-1, 1)), speeds)
def test_the_error_s_energy_never_grows(error, speed):
    assume(abs(speed[1]) < 3)
    tracker = Tracker(1e3, 1e3)
    dt, pose = 1e-3, np.array(error)
    reference = np.zeros(3)

    def energy():
        e1, e2, e3 = seen_from(pose, reference)
        return tracker.across * (e1**2 + e2**2) / 2 + e3**2 / 2

    before = energy()
    for _ in range(200):
        pose = driven(pose, tracker.command((*reference, *speed), pose), dt)
        reference = driven(reference, speed, dt)
        now = energy()
        # A step of 1 ms is not the limit of none.
        assert now <= before * (1 + 1e-3) + 1e-9
        before = now


@pytest.mark.parametrize('v', [1.0, -1.0])
def test_on_the_move_any_small_error_is_gone_in_two_seconds(v):
    tracker, dt = Tracker(1.5, 6.0), 0.02
    pose, reference = np.array([-0.05, 0.08, 0.3]), np.zeros(3)
    for _ in range(100):
        pose = driven(pose, tracker.command((*reference, v, 0.5), pose), dt)
        reference = driven(reference, (v, 0.5), dt)
    assert np.abs(seen_from(pose, reference)).max() < 2e-3


@pytest.mark.parametrize('field', ['v_max', 'omega_max', 'along', 'across', 'turn'])
@pytest.mark.parametrize('value', [0.0, -1.0, float('nan'), float('inf')])
def test_an_impossible_gain_or_limit_is_refused(field, value):
    with pytest.raises(InvalidInput, match=field):
        Tracker(**{'v_max': 1.0, 'omega_max': 1.0, field: value})
