"""Tracking: the speeds at which a unicycle keeps to its plan.

Source: the nonlinear tracking law of C. Samson and K. Ait-Abderrahim (1991), as in B. Siciliano, L. Sciavicco, L.
Villani, G. Oriolo, "Robotics: Modelling, Planning and Control" (2009), section 11.5.1, there with the other sign:

    v = v_r cos e3 + k1 e1        omega = omega_r + k2 v_r (sin e3 / e3) e2 + k3 e3

where (e1, e2, e3) is the reference pose seen from the body. V = k2 (e1^2 + e2^2) / 2 + e3^2 / 2 never grows, forwards
and backwards: V' = -k1 k2 e1^2 - k3 e3^2. Close to the plan, at speed v, the error across it is damped by
k3 / (2 |v| sqrt(k2)).
"""
from __future__ import annotations

from dataclasses import dataclass, fields
from math import cos, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import wrap_number


@dataclass(frozen=True)
class Tracker:
    """The tracking law with its gains and what the drive can do.

    Attributes
    ----------
    v_max, omega_max : float [m/s, rad/s]
        Greatest speeds. They should exceed those of the plans: who is behind must be able to catch up.
    along : float [1/s]
        k1, for the error along the body.
    across : float [1/m^2]
        k2, for the error across it.
    turn : float [1/s]
        k3, for the error of the heading.
    a_max, alpha_max : float [m/s^2, rad/s^2]
        Greatest change of the commanded speeds.

    Raises
    ------
    InvalidInput
        A number is not positive; only changes may be infinite.

    Examples
    --------
    >>> behind = Tracker(1.2, 5.0).command(reference=(1.0, 0.0, 0.0, 0.5, 0.0), pose=(0.9, 0.0, 0.0))
    >>> behind.round(6).tolist()
    [0.9, 0.0]
    """

    v_max: float
    omega_max: float
    along: float = 4.0
    across: float = 20.0
    turn: float = 8.0
    a_max: float = np.inf
    alpha_max: float = np.inf

    def __post_init__(self):
        for name in (entry.name for entry in fields(self)):
            value = getattr(self, name)
            if not (value > 0.0 and (value < np.inf or name in ('a_max', 'alpha_max'))):
                raise InvalidInput(f'{name} of the tracking law is {value}, not positive and finite')

    @property
    def window(self) -> float:
        """Time [s] that the drive takes for a jump of the turn rate, as far as a heading tells how far it turned."""
        return min(self.omega_max / self.alpha_max, 2.0 / self.omega_max)

    def command(self, reference: ArrayLike, pose: ArrayLike) -> NDArray[np.float64]:
        """Return the speeds (v, omega) [m/s, rad/s] to drive at.

        Where one of them is beyond what the drive can do, both are lowered by one factor: the body stays on its arc.

        Parameters
        ----------
        reference : (5,) array_like
            x, y, theta, v, omega by the plan; v < 0 backwards.
        pose : (3,) array_like [m, m, rad]
            Of the body.
        """
        x, y, theta, v, omega = (float(value) for value in reference)
        e1, e2, e3 = seen_from(pose, (x, y, theta)).tolist()
        forward = v * cos(e3) + self.along * e1
        turn = omega + self.across * v * _sinc(e3) * e2 + self.turn * e3
        return np.array([forward, turn]) / max(1.0, abs(forward) / self.v_max, abs(turn) / self.omega_max)

    def eased(self, command: ArrayLike, before: ArrayLike, period: float) -> NDArray[np.float64]:
        """Return the speeds (2,) nearest to ``command`` that the drive can reach from ``before`` in ``period`` [s]."""
        most = np.array([self.a_max, self.alpha_max]) * period
        return np.asarray(before, float) + np.clip(np.asarray(command, float) - before, -most, most)


def seen_from(pose: ArrayLike, other: ArrayLike) -> NDArray[np.float64]:
    """Return the pose ``other`` (3,) [m, m, rad] in the frame of the body at ``pose`` (3,).

    Examples
    --------
    >>> seen_from((1, 1, np.pi / 2), (1, 3, np.pi)).round(6).tolist()
    [2.0, 0.0, 1.570796]
    """
    (x, y, theta), (x_other, y_other, theta_other) = map(float, pose), map(float, other)
    dx, dy, cosine, sine = x_other - x, y_other - y, cos(theta), sin(theta)
    return np.array([cosine * dx + sine * dy, cosine * dy - sine * dx, wrap_number(theta_other - theta)])


def driven(pose: ArrayLike, command: ArrayLike, duration: float) -> tuple[float, float, float]:
    """Return the pose [m, m, rad] after driving at (v, omega) for ``duration`` [s]: exactly, on an arc.

    Of numbers, not of arrays: a body is moved thousands of times a second.

    Examples
    --------
    >>> [round(value, 6) for value in driven((0, 0, 0), (np.pi, np.pi), 0.5)]
    [1.0, 1.0, 1.570796]
    """
    x, y, theta = pose
    v, omega = command
    turned = omega * duration
    # The chord of the arc, at half of its angle.
    chord, along = v * duration * _sinc(turned / 2), theta + turned / 2
    return x + chord * cos(along), y + chord * sin(along), wrap_number(theta + turned)


def _sinc(angle):
    return sin(angle) / angle if angle else 1.0
