"""The unicycle's flat output, against finite differences along a curve that is known in closed form."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning import InvalidInput, UnicycleKineModel
from mobile_planning.geometry import wrap_angle

MODEL = UnicycleKineModel((1, 2, 0.5), (8, 6, -1.0))
TIMES = st.floats(0.0, 6.0)


def derivatives(t):
    """Return z and its first three derivatives (2, 4) of a loop with changing speed, never at rest."""
    x = (2 * np.cos(t), -2 * np.sin(t), -2 * np.cos(t), 2 * np.sin(t))
    y = (3 * np.sin(0.7 * t) + t, 2.1 * np.cos(0.7 * t) + 1, -1.47 * np.sin(0.7 * t), -1.029 * np.cos(0.7 * t))
    return np.array([x, y])


def slope(function, t, h=1e-5):
    return (np.asarray(function(t + h)) - np.asarray(function(t - h))) / (2 * h)


@given(TIMES)
def test_the_pose_is_the_position_and_the_direction_of_its_motion(t):
    q = MODEL.phi_1(derivatives(t)[:, :2])
    velocity = slope(lambda s: derivatives(s)[:, 0], t)
    assert q[:2] == pytest.approx(derivatives(t)[:, 0])
    assert velocity == pytest.approx(np.hypot(*velocity) * np.array([np.cos(q[2]), np.sin(q[2])]), abs=1e-6)


@given(TIMES)
def test_the_inputs_move_the_pose(t):
    v, omega = MODEL.phi_2(derivatives(t)[:, :3])
    q = MODEL.phi_1(derivatives(t))
    h = 1e-5
    before, after = (MODEL.phi_1(derivatives(s)) for s in (t - h, t + h))
    assert (after - before)[:2] / (2 * h) == pytest.approx([v * np.cos(q[2]), v * np.sin(q[2])], abs=1e-6)
    assert wrap_angle(after[2] - before[2]) / (2 * h) == pytest.approx(omega, abs=1e-5)


@given(TIMES)
def test_the_inputs_derivatives_are_those_of_the_inputs(t):
    assert MODEL.phi_3(derivatives(t)) == pytest.approx(slope(lambda s: MODEL.phi_2(derivatives(s)), t), abs=1e-5)


@pytest.mark.parametrize('speed', [0.5, 2.0])
def test_the_derivative_of_the_speed_divides_by_the_speed_itself(speed):
    # Straight on, with an acceleration of 3 m/s^2: at any speed but 1 m/s a higher power shows.
    assert MODEL.phi_3([[0, speed, 3, 0], [0, 0, 0, 0]]) == pytest.approx([3.0, 0.0])


def test_at_rest_the_turn_rate_is_not_a_number():
    at_rest = np.zeros((2, 4))
    assert MODEL.phi_2(at_rest)[0] == 0 and np.isnan(MODEL.phi_2(at_rest)[1])
    assert np.isnan(MODEL.phi_3(at_rest)).all()


def test_the_model_holds_the_mission_in_flat_outputs():
    assert MODEL.phi_0(MODEL.q_init) == pytest.approx([1, 2])
    assert (MODEL.z_init == (1, 2)).all() and (MODEL.z_final == (8, 6)).all()
    assert (MODEL.l, MODEL.q_dim, MODEL.u_dim, MODEL.z_dim) == (2, 3, 2, 2)


@pytest.mark.parametrize('changed', [
    {'q_init': (0, 0)}, {'q_init': (0, 0, np.nan)}, {'q_final': 'there'}, {'q_final': (0, np.inf, 0)},
    {'q_final': None}, {'u_init': (0, 0, 0)}, {'u_final': [[0, 0]]}, {'u_max': (1, 0)}, {'u_max': (-1, 5)},
    {'u_max': (1, np.nan)}, {'a_max': (0, 10)}, {'a_max': 2}])
def test_a_bad_number_is_refused_by_name(changed):
    with pytest.raises(InvalidInput, match=next(iter(changed))):
        UnicycleKineModel(**{'q_init': (0, 0, 0), 'q_final': (1, 1, 0), **changed})


def test_the_model_keeps_its_own_copy_of_the_caller_s_arrays():
    start = np.zeros(3)
    model = UnicycleKineModel(start, (1, 1, 0))
    start[0] = 7
    assert model.q_init[0] == 0 and model.z_init[0] == 0


@given(st.floats(-50, 50))
def test_an_unsigned_angle_is_the_same_direction_within_one_turn(angle):
    unsigned = UnicycleKineModel._unsigned_angle(angle)
    assert 0 <= unsigned < 2 * np.pi
    assert wrap_angle(unsigned - angle) == pytest.approx(0.0, abs=1e-9)
