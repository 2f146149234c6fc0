"""One section: the next plan as a small quadratic program, and the test that lets only what is proved be committed.

The plan in force and the program's answer are mixed: as much of the answer as
keeps to every fence and limit. All of these sets are convex and hold the plan
in force, so the mixture is safe whatever the solver returned; the turn rate,
whose set is not convex, is proved for the mixture itself.

Source: the moving-line contracts of this project; the proof between samples is
the convex hull property of Bezier curves.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.bspline import acceleration_bound, bezier, keeps_turn_rate, speed_bound
from mobile_planning.fleet.contracts import ROUNDING
from mobile_planning.fleet.fences import Fences
from mobile_planning.fleet.qp import QuadraticProgram

#: Weights of acceleration and jerk beside the distances to the reference [s^4, s^6].
_ACCELERATION, _JERK = 1e-3, 2e-4
#: Sides of the polygons inscribed in the discs of velocity and acceleration.
_SPEED_SIDES, _ACCELERATION_SIDES = 24, 12
#: Shares of the limits that the program uses, and room [m] it keeps to fences: rounding must not freeze the mixture.
_SPEED_SHARE, _ACCELERATION_SHARE, _MARGIN = 0.997, 0.98, 0.004
_TURN_SHARE = 0.9
#: Steps of each solver for every variable.
_STEPS = {'active_set': 5, 'osqp': 100}
#: Fences in one program.
_FENCES = 160
#: A departure's first step [m], at least, if it can accelerate so.
_LEAVES = 1e-3
#: Points this near to the end [m] are at the end: of an answer, and of a plan.
_CREEPS, _SETTLED = 2e-3, 1e-6
#: What is farther [m] than this is no answer.
_FARTHEST = 1e6
#: Slower than this [m/s] a plan has no direction of its own.
_SLOW = 0.05


@dataclass(frozen=True)
class Limits:
    """What the body can do: speed [m/s], acceleration [m/s^2], turn rate [rad/s], radius with margin [m]."""

    v_max: float
    a_max: float
    omega_max: float
    radius: float


@dataclass(frozen=True, eq=False)
class Departure:
    """How a robot at rest sets out.

    Attributes
    ----------
    direction : (2,) ndarray
        Along which it leaves, a unit vector.
    hold : int
        Spans that it stands before, to turn.
    heading : float [rad]
        That it turns to.
    is_straight : bool
        It goes on along ``direction`` to the end.
    """

    direction: NDArray[np.float64]
    hold: int
    heading: float = np.nan
    is_straight: bool = False


class SectionProblem:
    """The quadratic program of one robot's sections: the same matrices every time, new bounds and fences.

    Parameters
    ----------
    limits : Limits
    step : float [s]
        Between knots.
    spans : int
        Length M of a section, in which the control points 3 to M are free.
    solver : str
        Of `QuadraticProgram`.
    """

    def __init__(self, limits: Limits, step: float, spans: int, solver: str = 'active_set'):
        self.limits, self.step, self.spans = limits, step, spans
        count, self._free = spans + 3, spans - 2
        spread = np.zeros((count, self._free))                      # control points from the free ones
        spread[3:spans + 1] = np.eye(self._free)
        spread[spans + 1:, -1] = 1.0
        acceleration, jerk = (np.diff(np.eye(count), n=order, axis=0) / step**order for order in (2, 3))
        knot = bezier(np.eye(count))[:, 3]                          # positions at knots 1 to M
        weights = np.linspace(0.3, 1.0, spans) ** 2
        weights[-1] = 3.0
        # The gradient comes from the reference and from the given points.
        self._pull = 2 * spread.T @ knot.T * weights
        smooth = 2 * spread.T @ (_JERK * jerk.T @ jerk + _ACCELERATION * acceleration.T @ acceleration)
        self._from_given = (self._pull @ knot + smooth)[:, :3]
        hessian = (self._pull @ knot + smooth) @ spread
        self._program = QuadraticProgram(np.kron((hessian + hessian.T) / 2, np.eye(2)), solver,
                                         limit=_STEPS.get(solver, 1) * 2 * self._free)
        #: Of the speed and of the acceleration: how it comes from control points, from which on, polygon, bound.
        self._bounded = (
            (np.array([-1.0, 1.0, 0.0, 0.0]) / step, 2, _polygon(_SPEED_SIDES), _SPEED_SHARE * limits.v_max),
            (np.array([1.0, -2.0, 1.0, 0.0]) / step**2, 1, _polygon(_ACCELERATION_SIDES),
             _ACCELERATION_SHARE * limits.a_max))
        #: How far a Bezier point of each span can get from the plan in force [m].
        late = step * np.arange(1, spans + 1)
        self.reach = np.minimum(2 * limits.v_max * late, limits.a_max * late**2)
        # Room for the rows of any program; each call of `solve` writes what it needs.
        most = 5 * self._free + (_SPEED_SIDES + _ACCELERATION_SIDES + 3) * spans + 4 * _FENCES
        self._rows, self._bounds = np.empty((most, 2 * self._free)), np.empty(most)

    @property
    def longest_hold(self) -> int:
        """Spans that a departure can stand before it leaves, so that it still gets somewhere."""
        return self.spans // 2

    def solve(self, old: NDArray, reference: NDArray, fences: Fences,
              departure: Departure | None = None,
              arrival: tuple[int, NDArray] | None = None) -> NDArray[np.float64] | None:
        """Return the best plan (M + 3, 2) [m] that a convex program finds, None if it finds none.

        Parameters
        ----------
        old : (M + 3, 2) ndarray [m]
            Control points of the plan in force from the first knot on; the first three stay.
        reference : (M, 2) ndarray [m]
            Where to be at knots 1 to M.
        fences : Fences
            That ``old`` keeps to; those of spans from M on are left to `shorten`.
        departure : Departure, optional
            For a robot at rest.
        arrival : (int, (2,) ndarray [m]), optional
            The control point, 3 to M, from which all stand at a place.
        """
        gradient = (self._from_given @ old[:3] - self._pull @ reference).ravel()
        equalities = self._write_equalities(old, departure, arrival)
        end = self._write_limits(old, reference[-1] - old[2], equalities)
        end = self._write_fences(old, fences, end)
        end = self._write_departure(old, departure, end)
        answer, along, active = None, old, ()
        for _ in range(3):
            last = self._write_turns(along, old, reference, departure, end)
            result = self._program.solve(gradient, self._rows[:last], self._bounds[:last], equalities, active)
            active = result.active
            if result.x is None or not np.abs(result.x).max() <= _FARTHEST:
                break
            answer = self._plan_of(result.x, old, departure, arrival)
            if keeps_turn_rate(answer, self.step, self.limits.omega_max):
                break
            along = answer
        return answer

    def _plan_of(self, x, old, departure, arrival):
        """Return the control points (M + 3, 2) with the free ones of ``x``."""
        from mobile_planning.fleet import section_kernels as kernels

        points = np.empty_like(old)
        points[:3], points[3:self.spans + 1] = old[:3], x.reshape(-1, 2)
        points[self.spans + 1:] = points[self.spans]
        # What rests is exactly at rest, which rounding would spoil.
        if departure is not None:
            points[3:3 + departure.hold] = old[2]
            on_line = slice(3 + departure.hold, None if departure.is_straight else 4 + departure.hold)
            points[on_line] = old[2] + np.outer((points[on_line] - old[2]) @ departure.direction, departure.direction)
        if arrival is not None:
            points[arrival[0]:] = arrival[1]
        # Nor does it creep at its end, where rounding would choose where it points to.
        return kernels.settled(points, min(_CREEPS, 0.06 * self.limits.a_max * self.step**2))

    # The rows: each of these writes some, from a given one on, and returns the row after

    def _write_equalities(self, old, departure, arrival):
        """Points in the hold stay, the next is on the line of departure, the last at a goal."""
        places, on_line, row = {}, [], 0
        if departure is not None:
            places |= dict.fromkeys(range(min(departure.hold, self._free - 1)), old[2])
            on_line = list(range(departure.hold, self._free)) if departure.is_straight else [departure.hold]
        if arrival is not None:
            places |= dict.fromkeys(range(arrival[0] - 3, self._free), arrival[1])
        for point, place in places.items():
            self._rows[row:row + 2] = 0.0
            self._rows[row, 2 * point] = self._rows[row + 1, 2 * point + 1] = 1.0
            self._bounds[row:row + 2] = place
            row += 2
        for point in on_line:
            across = np.array([-departure.direction[1], departure.direction[0]])
            self._rows[row] = 0.0
            self._rows[row, 2 * point:2 * point + 2] = across
            self._bounds[row] = across @ old[2]
            row += 1
        return row

    def _write_limits(self, old, ahead, row):
        """Speed and acceleration keep to polygons in the discs of their limits, with a corner along ``ahead`` (2,)."""
        from mobile_planning.fleet import section_kernels as kernels

        angle = np.arctan2(ahead[1], ahead[0])
        cos, sin = np.cos(angle), np.sin(angle)
        for stencil, first, polygon, most in self._bounded:
            row = kernels.write_limits(old, stencil, first, self.spans, polygon @ [[cos, sin], [-sin, cos]],
                                       most * np.cos(np.pi / len(polygon)), self._rows, self._bounds, row)
        return row

    def _write_fences(self, old, fences, row):
        """Of the fences that may come into play the tightest count, if they are too many."""
        from mobile_planning.fleet import section_kernels as kernels

        inside = fences.on(fences.spans < self.spans)
        room = inside.room(bezier(old)).min(axis=1)
        chosen = np.flatnonzero(room < self.reach[inside.spans])
        if len(chosen) > _FENCES:
            chosen = chosen[np.argsort(room[chosen], kind='stable')[:_FENCES]]
        near = inside.on(chosen)
        return kernels.write_fences(old, near.spans, near.normals, near.bounds, _MARGIN, self._rows,
                                    self._bounds, row)

    def _write_departure(self, old, departure, row):
        """The robot does leave: else a later point would choose another direction."""
        if departure is None:
            return row
        first, last = departure.hold, self._free if departure.is_straight else departure.hold + 1
        self._rows[row:row + last - first] = 0.0
        for point in range(first, last):
            self._rows[row, 2 * point:2 * point + 2] = departure.direction
            if point > first:
                self._rows[row, 2 * point - 2:2 * point] = -departure.direction
            self._bounds[row] = 0.0
            row += 1
        self._bounds[row - last + first] = (departure.direction @ old[2]
                                            + min(_LEAVES, 0.5 * self.limits.a_max * self.step**2))
        return row

    def _write_turns(self, along, old, reference, departure, row):
        """Turn rates at the knots are bounded about the directions of the plan ``along``."""
        from mobile_planning.fleet import section_kernels as kernels

        if departure is not None:
            direction = departure.direction
        else:
            ahead = reference[-1] - along[0]
            direction = ahead / max(np.linalg.norm(ahead), 1e-9)
        return kernels.write_turns(old, along, direction, self.step, _TURN_SHARE * self.limits.omega_max, _SLOW,
                                   self._rows, self._bounds, row)


def _polygon(sides):
    """Return the outward normals (sides, 2) of a regular polygon with a corner at angle 0."""
    angles = 2 * np.pi * (np.arange(sides) + 0.5) / sides
    return np.column_stack([np.cos(angles), np.sin(angles)])


def shorten(old: NDArray, new: NDArray, fences: Fences, limits: Limits, step: float) -> NDArray[np.float64]:
    """Return the plan from ``old`` towards ``new`` (n, 2) [m] that goes as far as is proved, at worst ``old`` itself.

    Parameters
    ----------
    old : (n, 2) ndarray [m]
        Control points of the plan in force, which keeps to all of the following.
    new : (n, 2) ndarray [m]
        Whatever a solver returned, with the same first three points, ending at rest.
    fences : Fences
        Their spans may lie beyond the plans' ends: both have come to rest then.
    limits : Limits
    step : float [s]
    """
    from mobile_planning.fleet import section_kernels as kernels

    change = new - old
    # Written so that a number that is not finite fails too.
    if not _SETTLED < np.abs(change).max() <= _FARTHEST or change[:3].any() or (new[-3:-1] != new[-1]).any():
        return old
    # Where there is no room, rounding must not stop the robot; the proof allows twice as much.
    share = min(kernels.share_in_disc(old, change, 1, limits.v_max * step),
                kernels.share_in_disc(old, change, 2, limits.a_max * step**2),
                kernels.share_in_fences(old, change, fences.spans, fences.normals, fences.bounds, ROUNDING / 4))
    if share < 1.0:
        share *= 0.999
    for _ in range(8):
        if share < 1e-3:
            break
        mixed = kernels.settled(new if share == 1.0 else old + share * change, _SETTLED)
        if _is_proved(mixed, fences, limits, step):
            return mixed
        share *= 0.6
    return old


def _is_proved(points, fences, limits, step):
    """Return whether a plan keeps to all fences and limits, but for rounding."""
    from mobile_planning.fleet import section_kernels as kernels

    return bool(kernels.least_room(points, fences.spans, fences.normals, fences.bounds) >= -ROUNDING / 2
                and speed_bound(points, step) <= limits.v_max * (1 + 1e-9)
                and acceleration_bound(points, step) <= limits.a_max * (1 + 1e-9)
                and keeps_turn_rate(points, step, limits.omega_max))
