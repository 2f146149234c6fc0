"""Options of the receding horizon, by the names of planning_sim's document."""
from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, inf, pi
from numbers import Integral, Real

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import MAX_POINTS
from mobile_planning.fleet.nonlinear import SOLVERS
from mobile_planning.fleet.section import Limits

#: Knots of published plans are so far apart at most [s].
_STEP = 0.125
#: Spans of a section at most; turns before and after it come on top.
MAX_SPANS = 64
#: The last section's free duration is rounded up to the grid, or to one of the next so many knots.
LATER = 3
#: Solvers misbehave where costs exceed 1e6, says the document; the cost is the square of a distance.
_FARTHEST = 1e3
#: What may be set after a robot was made.
SETTABLE = ('acc', 'fs_maxit', 'maxit', 'ls_maxit')


@dataclass(frozen=True)
class HorizonOptions:
    """How a robot plans its sections.

    Attributes
    ----------
    N_s : int
        Sample times of a section, at which its constraints hold; between them a section is proved afterwards.
    n_knots : int
        Knot intervals of a section, which has three control points more.
    t_init : float [s]
        Later than the start of the mission, at which the robot sets out.
    t_sup : float [s]
        From the start of the mission; later no section is planned, and the robot stays where the last one ends.
    Tc : float [s]
        Between two sections: what is driven of each before the next begins.
    Tp, Td : float [s]
        Length of a section planned alone, and of one planned again among others.
    detec_rho : float [m]
        Obstacles farther away than this are not seen.
    com_range : float [m]
        Of the radio.
    def_epsilon : float [m]
        How far a section planned again may deviate from what was announced.
    safe_epsilon : float [m]
        Added to the distance to others, and taken from the range of the radio, at the sample times.
    ls_time_opt_scale : float
        Factor of the last section's cost, the square of the whole time.
    dist_opt_offset : float [m]
        The goal point is no farther away than this, which bounds the other sections' cost by its square.
    ls_min_dist : float [m]
        The last section begins where the goal is nearer than this and what is driven in Tc.
    solver : str
        ``'slsqp'`` (scipy), or sequential quadratic programs by ``'osqp'`` or ``'active_set'``, which is the quickest.
    acc : float
        The solver stops where the cost changes by less, and no constraint is broken by more.
    fs_maxit, maxit, ls_maxit : int
        Iterations of the first, of an intermediate, and of the last section.

    Raises
    ------
    InvalidInput
        A value is out of its range.
    """

    N_s: int = 20
    n_knots: int = 6
    t_init: float = 0.0
    t_sup: float = 1e10
    Tc: float = 1.0
    Tp: float = 3.0
    Td: float = 3.0
    detec_rho: float = 3.0
    com_range: float = 15.0
    def_epsilon: float = 0.5
    safe_epsilon: float = 0.1
    ls_time_opt_scale: float = 1.0
    dist_opt_offset: float = 100.0
    ls_min_dist: float = 0.5
    solver: str = 'slsqp'
    acc: float = 1e-4
    fs_maxit: int = 40
    maxit: int = 20
    ls_maxit: int = 30

    def __post_init__(self):
        for name, least, most in (('N_s', 4, 400), ('n_knots', 4, 40), ('fs_maxit', 1, 10_000), ('maxit', 1, 10_000),
                                  ('ls_maxit', 1, 10_000)):
            value = getattr(self, name)
            if not isinstance(value, Integral) or isinstance(value, bool) or not least <= value <= most:
                raise InvalidInput(f'{name} is {value!r}, not a whole number in {least}..{most}')
        for name, least, most in (('t_init', 0.0, 86400.0), ('t_sup', 0.0, inf), ('Tc', 0.05, 10.0),
                                  ('Td', 4 * _STEP, 60.0), ('Tp', 4 * _STEP, 60.0),
                                  ('detec_rho', 1e-3, _FARTHEST), ('com_range', 1e-3, 1e6),
                                  ('def_epsilon', 1e-3, _FARTHEST), ('safe_epsilon', 0.0, 10.0),
                                  ('ls_time_opt_scale', 1e-6, 1e6), ('dist_opt_offset', 1e-3, _FARTHEST),
                                  ('ls_min_dist', 0.0, _FARTHEST), ('acc', 1e-12, 1.0)):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, Real) or not least <= value <= most:
                raise InvalidInput(f'{name} is {value!r}, not in {least:g}..{most:g}')
        if not self.t_sup > self.t_init:
            raise InvalidInput(f't_sup is {self.t_sup} s, not later than t_init, {self.t_init} s')
        if not self.Tc < self.Td <= self.Tp:
            raise InvalidInput(f'Tc {self.Tc} s, Td {self.Td} s, Tp {self.Tp} s: they must be in this order, '
                               'Tc < Td <= Tp')
        if max(self.spans(self.Tp), self.n_knots) > MAX_SPANS or self.spans(self.Td) < self.n_knots:
            raise InvalidInput(f'n_knots is {self.n_knots}, and Tp has {self.spans(self.Tp)} steps of {self.step:.3f} '
                               f's and Td {self.spans(self.Td)}: not n_knots <= Td, Tp <= {MAX_SPANS}')
        if self.solver not in SOLVERS:
            raise InvalidInput(f'solver {self.solver!r} is not one of {", ".join(SOLVERS)}')

    @property
    def step(self) -> float:
        """Time [s] between the knots of published plans: an even part of Tc."""
        return self.Tc / self.knots

    @property
    def knots(self) -> int:
        """Knots in Tc."""
        return ceil(self.Tc / _STEP - 1e-9)

    def spans(self, duration: float) -> int:
        """Return how many whole spans a section of ``duration`` [s] has."""
        return int(duration / self.step + 1e-9)

    def far(self, limits: Limits) -> float:
        """Return the distance [m] beyond which two robots of this kind cannot meet by plans made now."""
        return 2 * (limits.v_max * (self.Tp + 2 * self.Tc) + limits.radius)

    def require_reach(self, limits: Limits) -> None:
        """Require that a robot with ``limits`` cannot be surprised by what it does not see or hear in time.

        Raises
        ------
        InvalidInput
            It could, or a turn about takes longer than a section has time for.
        """
        stopping = limits.v_max * 2 * self.Tc + limits.v_max**2 / (2 * limits.a_max) + limits.radius
        if self.detec_rho < stopping:
            raise InvalidInput(f'detec_rho {self.detec_rho} m is below {stopping:.3f} m, which the robot drives in '
                               '2 Tc and needs to stop')
        # A turn before a section leaves it time, and what is said of it fits into a message.
        turn = ceil(pi / (limits.omega_max * self.step)) + 1
        spare = min(self.spans(self.Td) - self.n_knots, (MAX_POINTS - MAX_SPANS - LATER - self.knots - 5) // 2)
        if turn > spare:
            raise InvalidInput(f'omega_max {limits.omega_max} rad/s needs {turn * self.step:.2f} s to turn about; '
                               f'with Tc {self.Tc} s and Td {self.Td} s there are {spare * self.step:.2f} s')
        if self.com_range < self.far(limits):
            raise InvalidInput(f'com_range {self.com_range} m is below {self.far(limits):.3f} m, within which two '
                               'robots of this kind can meet before they hear each other again')

    def with_option(self, name: str, value: float | None) -> HorizonOptions:
        """Return the options with another accuracy or limit on iterations; None for the default.

        Raises
        ------
        InvalidInput
            There is no such option to set, or the value is out of its range.
        """
        if name not in SETTABLE:
            raise InvalidInput(f'option {name!r} is not one of {", ".join(SETTABLE)}')
        return replace(self, **{name: getattr(HorizonOptions, name) if value is None else value})
