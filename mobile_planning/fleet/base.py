"""SimulatedBase: a unicycle's drive and wheels, for robots that have none."""
from __future__ import annotations

from dataclasses import dataclass
from math import ceil, copysign

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.tracking import driven

#: While its speeds change the base drives on arcs of so long [s] at most.
_FINE = 0.005


@dataclass(frozen=True)
class BaseOptions:
    """What a simulated base does to its commands.

    Attributes
    ----------
    a_max, alpha_max : float [m/s^2, rad/s^2]
        Greatest change of its speeds.
    slip : float
        Standard deviation of the share by which it drives more or less than it should, anew in each step.
    pose_noise : float [m]
        Standard deviation of each coordinate of a measured pose; of the heading [rad] as much.

    Raises
    ------
    InvalidInput
        A number is out of its range.
    """

    a_max: float = np.inf
    alpha_max: float = np.inf
    slip: float = 0.0
    pose_noise: float = 0.0

    def __post_init__(self):
        if not (self.a_max > 0 and self.alpha_max > 0 and 0 <= self.slip < 1 and 0 <= self.pose_noise < np.inf):
            raise InvalidInput(f'{self} is out of range: a_max > 0, alpha_max > 0, 0 <= slip < 1, pose_noise >= 0')


class SimulatedBase:
    """One base.

    Parameters
    ----------
    pose : (3,) array_like [m, m, rad]
    options : BaseOptions
    seed : int
        Of slip and noise.

    Attributes
    ----------
    pose : (3,) ndarray [m, m, rad]
    speeds : (2,) ndarray [m/s, rad/s]

    Examples
    --------
    >>> base = SimulatedBase((0, 0, 0), BaseOptions(a_max=2.0))
    >>> base.drive((1.0, 0.0), 0.25)
    >>> base.speeds.round(6).tolist(), base.pose.round(6).tolist()
    ([0.5, 0.0], [0.0625, 0.0, 0.0])
    """

    def __init__(self, pose: ArrayLike, options: BaseOptions = BaseOptions(), seed: int = 0):
        self.pose, self.speeds = np.array(pose, float), np.zeros(2)
        self._options, self._rng = options, np.random.default_rng(seed)

    def drive(self, command: ArrayLike, duration: float) -> None:
        """Drive for ``duration`` [s], at speeds that go to the ``command`` (v, omega) as fast as they may change."""
        if not duration > 0.0:
            return
        options, grips = self._options, (1.0, 1.0)
        if options.slip:
            grips = (1.0 + options.slip * self._rng.standard_normal(2)).tolist()
        v_wanted, omega_wanted = (float(speed) for speed in command)
        pose, (v, omega) = self.pose.tolist(), self.speeds.tolist()
        is_steady = options.a_max == options.alpha_max == np.inf or (v, omega) == (v_wanted, omega_wanted)
        parts = 1 if is_steady else ceil(duration / _FINE)
        part = duration / parts
        for _ in range(parts):
            v, v_mean = _changed(v, v_wanted, options.a_max, part)
            omega, omega_mean = _changed(omega, omega_wanted, options.alpha_max, part)
            pose = driven(pose, (grips[0] * v_mean, grips[1] * omega_mean), part)
        self.pose, self.speeds = np.array(pose), np.array([v, omega])

    def measured(self) -> NDArray[np.float64]:
        """Return the pose (3,) [m, m, rad] as a localisation would give it."""
        if not self._options.pose_noise:
            return self.pose.copy()
        return self.pose + self._options.pose_noise * self._rng.standard_normal(3)


def _changed(speed, wanted, rate, duration):
    """Return a speed that changes at ``rate`` for ``duration`` [s] at most, and its mean meanwhile."""
    missing, most = wanted - speed, rate * duration
    # It ends at the wanted one itself, not beside it by rounding.
    after = wanted if abs(missing) <= most else speed + copysign(most, missing)
    change = after - speed
    return after, after - change * (abs(change) / rate) / (2 * duration)
