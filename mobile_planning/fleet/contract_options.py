"""Options of a robot that keeps apart by contracts."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.section import Limits

#: Knots in one cycle: fine ones let a robot set out and stop sooner.
KNOTS = 2
#: Between two sections [s], where nothing else is said.
_CYCLE = 0.25
#: A cycle begins so long [s] before the last instant from which its section is in time for a knot.
_EARLY = 2e-3


@dataclass(frozen=True)
class ContractOptions:
    """How a robot plans and what it can sense.

    Attributes
    ----------
    rho : float [m]
        Radius of the body.
    Tc : float [s] or None
        Between two calls of ``step``, at most; knots are half of it apart. None for 0.25 s.
    Tp : float [s]
        Length of a plan.
    margin : float [m]
        Added to the radius for tracking, clock and numeric errors.
    solver : str
        Of `QuadraticProgram`.
    sensor_range : float [m]
        Within which the robot sees other bodies; infinite for no such sensor.
    budget : float [s]
        Between the start of planning and the knot from which the plan may change.
    reverse : bool
        Whether it may drive backwards.
    com_range : float [m]
        How far away its neighbours may be, see `tether`; infinite for as far as they like.

    Raises
    ------
    InvalidInput
        A value is out of its range.

    Examples
    --------
    >>> options = ContractOptions(Tc=0.5)
    >>> options.step, options.spans
    (0.25, 12)
    >>> ContractOptions(budget=0.08).short_cycle, ContractOptions(budget=0.13).short_cycle
    (0.125, 0.25)
    """

    rho: float = 0.2
    Tc: float | None = None
    Tp: float = 3.0
    margin: float = 0.005
    solver: str = 'active_set'
    sensor_range: float = np.inf
    budget: float = 0.08
    reverse: bool = False
    com_range: float = np.inf

    def __post_init__(self):
        if self.Tc is None:
            object.__setattr__(self, 'Tc', _CYCLE)
        if not (0 < self.rho <= 100 and 0 <= self.margin <= 10 and 0.01 <= self.Tc <= 10
                and 4 * self.Tc <= self.Tp <= 50 * self.Tc):
            raise InvalidInput(f'rho {self.rho} m, margin {self.margin} m, Tc {self.Tc} s or Tp {self.Tp} s is out of '
                               'range: 0 < rho <= 100, 0 <= margin <= 10, 0.01 <= Tc <= 10, 4 Tc <= Tp <= 50 Tc')
        if not (0 <= self.budget <= 10 * self.Tc and self.sensor_range > 0):
            raise InvalidInput(f'budget {self.budget} s or sensor_range {self.sensor_range} m is out of range: '
                               '0 <= budget <= 10 Tc, sensor_range > 0')

        if not 2 * (self.rho + self.margin) < self.com_range or self.sensor_range < self.com_range < np.inf:
            raise InvalidInput(f'com_range {self.com_range} m is out of range: farther than two robots are at least '
                               f'apart, {2 * (self.rho + self.margin)} m, and no farther than they see each other, '
                               f'{self.sensor_range} m')

    @property
    def step(self) -> float:
        """Time [s] between knots."""
        return float(self.Tc) / KNOTS

    @property
    def spans(self) -> int:
        """Spans between knots in a plan."""
        return int(round(self.Tp / self.step))

    @property
    def lead(self) -> float:
        """How long [s] before a knot a cycle begins whose section is to be driven from there on."""
        return self.budget + _EARLY

    @property
    def short_cycle(self) -> float:
        """Time [s] between two calls of ``step`` where robots take turns: from knot to knot, if the budget allows."""
        return self.step if self.lead < self.step else float(self.Tc)

    @property
    def rest_time(self) -> float:
        """Every plan has ended this long [s] after its commit."""
        return (self.spans + 3) * self.step

    @property
    def gap(self) -> float:
        """The longest time [s] between two looks of the presence sensor that count as one after the other."""
        return 2 * float(self.Tc)

    def limits(self, model: UnicycleKineModel) -> Limits:
        """Return what the body with ``model`` can do.

        Raises
        ------
        InvalidInput
            It could not come to rest in time for what comes into sight.
        """
        v_max, omega_max = model.u_max
        limits = Limits(v_max, model.acc_max[0], omega_max, self.rho + self.margin)
        least = 2 * (limits.radius + v_max * self.rest_time)
        if self.sensor_range < least:
            raise InvalidInput(f'sensor_range {self.sensor_range} m is below {least:.3f} m: two robots of this kind '
                               'that see each other at last must have room to come to rest')
        return limits
