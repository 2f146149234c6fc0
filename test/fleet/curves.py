"""Control points for the tests of the fleet, drawn by hypothesis, and curves evaluated by scipy alone."""
import numpy as np
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from mobile_planning.geometry import wrap_angle


def curve(points, step, first_knot=0):
    """Return the uniform cubic B-spline of ``points`` as scipy has it, a function of absolute time."""
    points = np.asarray(points, float)
    return BSpline((np.arange(len(points) + 4) - 3.0 + first_knot) * step, points, 3)


def dense(points, step, per_span=400):
    """Return times from 0 to the last knot, all knots among them."""
    spans = len(points) - 3
    return np.linspace(0, spans * step, spans * per_span + 1)


def turned_at_most(points, step, omega_max):
    """Return whether the direction of motion, densely sampled, turns no faster than ``omega_max``, and never jumps."""
    spline, t = curve(points, step), dense(points, step)
    velocity, acceleration = spline.derivative(1)(t), spline.derivative(2)(t)
    moving = np.linalg.norm(velocity, axis=1) > 1e-4
    t, velocity, acceleration = t[moving], velocity[moving], acceleration[moving]
    rate = np.abs(velocity[:, 0] * acceleration[:, 1] - velocity[:, 1] * acceleration[:, 0]) / (velocity**2).sum(axis=1)
    heading = np.arctan2(velocity[:, 1], velocity[:, 0])
    change = np.abs(wrap_angle(np.diff(heading)))
    return rate.max(initial=0) <= omega_max * (1 + 1e-4) and (change <= omega_max * np.diff(t) * 1.001 + 1e-4).all()


def walks(moves, steepest=1.0, size=0.4):
    """Return a strategy of control points (n, 2) that end at rest: random walks with bounded turns and halts."""
    move = st.tuples(st.floats(0, size), st.floats(-steepest, steepest), st.booleans())

    def build(drawn):
        heading, steps = 0.0, []
        for length, turn, is_halt in drawn:
            heading += turn
            steps.append((0.0, 0.0) if is_halt and length < size / 4
                         else (length * np.cos(heading), length * np.sin(heading)))
        return np.vstack([[0, 0], np.cumsum([*steps, (0, 0), (0, 0)], axis=0)])
    return st.lists(move, min_size=2, max_size=moves).map(build)
