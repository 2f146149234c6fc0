"""The unicycle and its flat output: z = (x, y) and its derivatives give pose and inputs.

Source: planning_sim's document, section 1.2; its ``phi_3`` divides by the third
power of the speed, where the derivative of the speed has the first.
"""
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput


class UnicycleKineModel:
    """A unicycle with its mission: from rest or speed at one pose to another.

    Parameters
    ----------
    q_init, q_final : (3,) array_like [m, m, rad]
        First and last pose (x, y, theta).
    u_init, u_final : (2,) array_like [m/s, rad/s]
        First and last input (v, omega).
    u_max : (2,) array_like [m/s, rad/s]
        Greatest absolute inputs.
    a_max : (2,) array_like [m/s^2, rad/s^2]
        Greatest absolute derivatives of the inputs; the first bounds the
        acceleration of the flat output as a vector. The second is not
        certified: a turn in place starts and stops at once.

    Raises
    ------
    InvalidInput
        A number is not finite, or a limit is not positive.
    """

    l = 2  # noqa: E741 - the document's name: derivatives of z that pose and inputs need
    q_dim = 3
    u_dim = 2
    z_dim = 2

    def __init__(self, q_init: ArrayLike, q_final: ArrayLike, u_init: ArrayLike = (0.0, 0.0),
                 u_final: ArrayLike = (0.0, 0.0), u_max: ArrayLike = (1.0, 5.0), a_max: ArrayLike = (2.0, 10.0)):
        self.q_init = _vector('q_init', q_init, self.q_dim)
        self.q_final = _vector('q_final', q_final, self.q_dim)
        self.u_init = _vector('u_init', u_init, self.u_dim)
        self.u_final = _vector('u_final', u_final, self.u_dim)
        self.u_max = _vector('u_max', u_max, self.u_dim, positive=True)
        self.acc_max = _vector('a_max', a_max, self.u_dim, positive=True)
        self.z_init = self.phi_0(self.q_init)
        self.z_final = self.phi_0(self.q_final)

    @staticmethod
    def _unsigned_angle(angle: float) -> float:
        """Return ``angle`` [rad] in [0, 2 pi).

        Examples
        --------
        >>> UnicycleKineModel._unsigned_angle(-np.pi / 2) == 1.5 * np.pi
        True
        """
        # One remainder of a tiny negative number is 2 pi itself, by rounding; the second makes it 0.
        return float(np.mod(np.mod(angle, 2 * np.pi), 2 * np.pi))

    def phi_0(self, q: ArrayLike) -> NDArray[np.float64]:
        """Return z (2,) [m] of the pose ``q`` (3,)."""
        return np.asarray(q, float)[:2].copy()

    def phi_1(self, zl: ArrayLike) -> NDArray[np.float64]:
        """Return the pose (3,) [m, m, rad] of ``zl`` (2, >= 2), a column for each derivative from z on."""
        zl = np.asarray(zl, float)
        return np.array([zl[0, 0], zl[1, 0], np.arctan2(zl[1, 1], zl[0, 1])])

    def phi_2(self, zl: ArrayLike) -> NDArray[np.float64]:
        """Return the inputs (v, omega) [m/s, rad/s] of ``zl`` (2, >= 3); omega is NaN where v is 0."""
        _, dz, ddz = np.asarray(zl, float).T[:3]
        speed2 = dz @ dz
        return np.array([np.sqrt(speed2), _cross(dz, ddz) / speed2 if speed2 > 0 else np.nan])

    def phi_3(self, zl: ArrayLike) -> NDArray[np.float64]:
        """Return the inputs' derivatives [m/s^2, rad/s^2] of ``zl`` (2, >= 4); NaN where v is 0."""
        _, dz, ddz, dddz = np.asarray(zl, float).T[:4]
        speed2 = dz @ dz
        if speed2 == 0:
            return np.full(2, np.nan)
        along = dz @ ddz
        return np.array([along / np.sqrt(speed2),
                         (_cross(dz, dddz) * speed2 - 2.0 * _cross(dz, ddz) * along) / speed2**2])


def _cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


def _vector(name, value, size, positive=False):
    """Return ``value`` as a float vector of ``size``, or say what is wrong with it."""
    try:
        vector = np.array(value, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f'{name} must be {size} numbers, not {value!r}') from error
    if vector.shape != (size,) or not np.isfinite(vector).all():
        raise InvalidInput(f'{name} must be {size} finite numbers, not {value!r}')
    if positive and (vector <= 0).any():
        raise InvalidInput(f'{name} must be positive, not {value!r}')
    return vector
