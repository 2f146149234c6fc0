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
        self._spread = spread
        identity = np.eye(count)
        self._velocity = np.diff(identity, axis=0) / step
        self._acceleration = np.diff(self._velocity, axis=0) / step
        jerk = np.diff(self._acceleration, axis=0) / step
        self._bezier = np.stack([bezier(np.column_stack([column, column]))[..., 0] for column in identity], axis=-1)
        self._knot = self._bezier[:, 3]                             # positions at knots 1 to M
        # Velocity and acceleration at knots 1 to M - 1.
        self._knot_velocity = (self._velocity[1:-1] + self._velocity[2:])[:spans - 1] / 2
        self._knot_acceleration = self._acceleration[1:spans]
        weights = np.linspace(0.3, 1.0, spans) ** 2
        weights[-1] = 3.0
        self._pull = 2 * spread.T @ self._knot.T * weights
        self._smooth = 2 * spread.T @ (_JERK * jerk.T @ jerk
                                       + _ACCELERATION * self._acceleration.T @ self._acceleration)
        hessian = self._pull @ self._knot @ spread + self._smooth @ spread
        self._program = QuadraticProgram(np.kron(np.eye(2), (hessian + hessian.T) / 2), solver,
                                         limit=_STEPS.get(solver, 1) * 2 * self._free)
        #: Of the speed and of the acceleration: derivatives of the control points that are bounded, and the bounds.
        self._bounded = ((self._velocity[2:spans], _SPEED_SIDES, _SPEED_SHARE * limits.v_max),
                         (self._acceleration[1:spans + 1], _ACCELERATION_SIDES, _ACCELERATION_SHARE * limits.a_max))
        self._bezier_free = self._bezier @ spread                   # (M, 4, F)
        self._velocity_free = self._knot_velocity @ spread
        self._acceleration_free = self._knot_acceleration @ spread
        self._moves = np.abs(self._bezier_free).max(axis=-1) > 0
        #: How far a Bezier point of each span can get from the plan in force [m].
        late = step * np.arange(1, spans + 1)
        self.reach = np.minimum(2 * limits.v_max * late, limits.a_max * late**2)

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
        fixed = np.zeros_like(old)
        fixed[:3] = old[:3]
        gradient = (self._pull @ (self._knot @ fixed - reference) + self._smooth @ fixed).T.ravel()
        equal_rows, equal_bounds = self._equalities(old, departure, arrival)
        fence_rows, fence_bounds = self._fence_rows(old, fixed, fences)
        limit_rows, limit_bounds = self._limit_rows(old, fixed, reference[-1] - old[2])
        rows, bounds = [equal_rows, limit_rows, fence_rows], [equal_bounds, limit_bounds, fence_bounds]
        if departure is not None:
            # It does leave: else a later point would choose another direction.
            rows.append(np.zeros((1, 2 * self._free)))
            rows[-1][0, [departure.hold, self._free + departure.hold]] = departure.direction
            leaves = min(_LEAVES, 0.5 * self.limits.a_max * self.step**2)
            bounds.append(np.array([departure.direction @ old[2] + leaves]))
            if departure.is_straight:
                onward = np.diff(np.eye(self._free), axis=0)
                rows.append(np.hstack([departure.direction[0] * onward, departure.direction[1] * onward]))
                bounds.append(np.zeros(len(onward)))
        answer, along, active = None, old, ()
        for _ in range(3):
            turn_rows, turn_bounds = self._turn_rows(along, old, fixed, reference, departure)
            result = self._program.solve(gradient, np.concatenate([*rows, turn_rows]),
                                         np.concatenate([*bounds, turn_bounds]), len(equal_rows), active)
            active = result.active
            if result.x is None or not np.abs(result.x).max() <= _FARTHEST:
                break
            answer = fixed + self._spread @ result.x.reshape(2, -1).T
            # What rests is exactly at rest, which rounding would spoil.
            if departure is not None:
                answer[3:3 + departure.hold] = old[2]
                on_line = slice(3 + departure.hold, None if departure.is_straight else 4 + departure.hold)
                answer[on_line] = old[2] + np.outer((answer[on_line] - old[2]) @ departure.direction,
                                                    departure.direction)
            if arrival is not None:
                answer[arrival[0]:] = arrival[1]
            answer = _settled(answer, min(_CREEPS, 0.06 * self.limits.a_max * self.step**2))
            if keeps_turn_rate(answer, self.step, self.limits.omega_max):
                break
            along = answer
        return answer

    def _equalities(self, old, departure, arrival):
        """Return rows and bounds: points in the hold stay, the next is on the line of departure, the last at a goal."""
        places = {}
        if departure is not None:
            places |= dict.fromkeys(range(min(departure.hold, self._free - 1)), old[2])
        if arrival is not None:
            places |= dict.fromkeys(range(arrival[0] - 3, self._free), arrival[1])
        on_line = []
        if departure is not None:
            on_line = list(range(departure.hold, self._free)) if departure.is_straight else [departure.hold]
        rows, bounds = np.zeros((2 * len(places) + len(on_line), 2 * self._free)), []
        for row, (point, place) in enumerate(places.items()):
            rows[2 * row, point] = rows[2 * row + 1, self._free + point] = 1.0
            bounds += [*place]
        for row, point in enumerate(on_line, 2 * len(places)):
            across = np.array([-departure.direction[1], departure.direction[0]])
            rows[row, [point, self._free + point]] = across
            bounds.append(across @ old[2])
        return rows, np.array(bounds)

    def _limit_rows(self, old, fixed, ahead):
        """Return rows and bounds of speed and acceleration, which the plan in force always keeps to.

        They keep to polygons inscribed in the discs of the limits, with a corner along the way ``ahead`` (2,).
        """
        rows, bounds = [], []
        for derivative, sides, most in self._bounded:
            angles = np.arctan2(ahead[1], ahead[0]) + 2 * np.pi * (np.arange(sides) + 0.5) / sides
            normals = np.column_stack([np.cos(angles), np.sin(angles)])
            now, given = (normals @ (derivative @ points).T for points in (old, fixed))
            free = derivative @ self._spread
            rows.append((-normals[:, None, :, None] * free[:, None]).reshape(-1, 2 * self._free))
            bounds.append((given - np.maximum(most * np.cos(np.pi / sides), now)).ravel())
        return np.concatenate(rows), np.concatenate(bounds)

    def _fence_rows(self, old, fixed, fences):
        """Return the rows and bounds of the fences that may come into play; the tightest, if they are too many."""
        inside = np.flatnonzero(fences.spans < self.spans)
        spans, normals, bounds = fences.spans[inside], fences.normals[inside], fences.bounds[inside]
        curves = self._bezier @ old
        room = np.einsum('qd,qkd->qk', normals, curves[spans]) - bounds
        least = room.min(axis=1)
        chosen = np.flatnonzero(least < self.reach[spans])
        if len(chosen) > _FENCES:
            chosen = chosen[np.argsort(least[chosen], kind='stable')[:_FENCES]]
        spans, normals, bounds = spans[chosen], normals[chosen], bounds[chosen]
        bounds = bounds + np.clip(room[chosen], 0.0, _MARGIN)
        free = self._bezier_free[spans]                             # (K, 4, F)
        rows = np.empty((len(spans), 4, 2 * self._free))
        np.multiply(normals[:, None, :1], free, out=rows[..., :self._free])
        np.multiply(normals[:, None, 1:], free, out=rows[..., self._free:])
        bounds = bounds - np.einsum('qd,qkd->qk', normals, (self._bezier @ fixed)[spans])
        moves = self._moves[spans]
        return rows[moves], bounds[moves]

    def _turn_rows(self, along, old, fixed, reference, departure):
        """Return rows that bound the turn rate at the knots, about the directions of the plan ``along``."""
        velocity = self._knot_velocity @ along
        speed = np.linalg.norm(velocity, axis=1)
        if departure is not None:
            direction = departure.direction
        else:
            ahead = reference[-1] - along[0]
            direction = ahead / max(np.linalg.norm(ahead), 1e-9)
        directions = np.empty_like(velocity)
        for knot, moves in enumerate(speed > _SLOW):
            if moves:
                direction = velocity[knot] / speed[knot]
            directions[knot] = direction
        across = np.column_stack([-directions[:, 1], directions[:, 0]])
        most = _TURN_SHARE * self.limits.omega_max
        ahead = np.hstack([most * directions[:, axis, None] * self._velocity_free for axis in (0, 1)])
        aside = np.hstack([across[:, axis, None] * self._acceleration_free for axis in (0, 1)])
        (along_old, aside_old), (along_fixed, aside_fixed) = (
            (most * (directions * (self._knot_velocity @ points)).sum(axis=1),
             (across * (self._knot_acceleration @ points)).sum(axis=1)) for points in (old, fixed))
        bounds = [np.minimum(along_old - side * aside_old, 0.0) - (along_fixed - side * aside_fixed)
                  for side in (1.0, -1.0)]
        # No step goes back: the end of a plan must not swing.
        steps, forward = self._velocity[2:self.spans], directions[1:self.spans - 1]
        onward = np.hstack([forward[:, axis, None] * (steps @ self._spread) for axis in (0, 1)])
        step_old, step_fixed = ((forward * (steps @ points)).sum(axis=1) for points in (old, fixed))
        bounds.append(np.minimum(step_old, 0.0) - step_fixed)
        return np.concatenate([ahead - aside, ahead + aside, onward]), np.concatenate(bounds)


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
    change = new - old
    # Written so that a number that is not finite fails too.
    if not _SETTLED < np.abs(change).max() <= _FARTHEST or change[:3].any() or np.ptp(new[-3:], axis=0).any():
        return old
    share = min(1.0, *(_share_in_disc(np.diff(old, n=order, axis=0), np.diff(change, n=order, axis=0),
                                      most * step**order) for order, most in ((1, limits.v_max), (2, limits.a_max))))
    if len(fences):
        beyond = max(0, int(fences.spans.max()) + 4 - len(old))
        curves = [bezier(np.concatenate([points, np.repeat(points[-1:], beyond, axis=0)])) for points in (old, change)]
        # Where there is no room, rounding must not stop the robot; the proof allows twice as much.
        room = fences.room(curves[0]) + ROUNDING / 4
        gain = np.einsum('qd,qkd->qk', fences.normals, curves[1][fences.spans])
        tight = (room + gain < 0.0) & (gain < 0.0)
        if tight.any():
            share = min(share, (np.maximum(room[tight], 0.0) / -gain[tight]).min())
    if share < 1.0:
        share *= 0.999
    for _ in range(8):
        if share < 1e-3:
            break
        mixed = _settled(new if share == 1.0 else old + share * change, _SETTLED)
        if _is_proved(mixed, fences, limits, step):
            return mixed
        share *= 0.6
    return old


def _settled(points, within):
    """Return the plan without creeping at its end: rounding would choose where it points to."""
    end = points[2] if np.abs(points[2] - points[-1]).max() <= within else points[-1]
    moves = np.flatnonzero(np.abs(points - end).max(axis=1) > within)
    result = points.copy()
    result[max(3, moves[-1] + 1 if len(moves) else 0):] = end
    return result


def _is_proved(points, fences, limits, step):
    """Return whether a plan keeps to all fences and limits, but for rounding."""
    beyond = max(0, int(fences.spans.max()) + 4 - len(points)) if len(fences) else 0
    curves = bezier(np.concatenate([points, np.repeat(points[-1:], beyond, axis=0)]))
    return bool((not len(fences) or fences.room(curves).min() >= -ROUNDING / 2)
                and speed_bound(points, step) <= limits.v_max * (1 + 1e-9)
                and acceleration_bound(points, step) <= limits.a_max * (1 + 1e-9)
                and keeps_turn_rate(points, step, limits.omega_max))


def _share_in_disc(old, change, radius):
    """Return the greatest share of ``change`` (n, 2) that keeps ``old + share * change`` within ``radius``."""
    over = ((old + change)**2).sum(axis=1) > radius**2
    if not over.any():
        return 1.0
    old, change = old[over], change[over]
    a, b = (change**2).sum(axis=1), (old * change).sum(axis=1)
    c = np.minimum((old**2).sum(axis=1) - radius**2, 0.0)
    return float(((-b + np.sqrt(b**2 - a * c)) / a).min())
