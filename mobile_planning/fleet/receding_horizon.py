"""Sections of the receding horizon: the program of one section, composed from blocks, solved, refined and proved.

An intermediate section ends as near to the goal point as it can; the last one ends at the goal as soon as it can. Each
may be planned alone, or again among others. Every section ends at rest, so that a robot that finds no next one, or is
not allowed it, stays on a proved way.

Source: M. Defoort and others, Robotics and Autonomous Systems 57, 2009; J. M. Mendes Filho and E. Lucet, Acta
Polytechnica 56, 2016; planning_sim's document.
"""
from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet import clamped_spline, nonlinear
from mobile_planning.fleet.horizon_blocks import (Acceleration, Block, Communication, Obstacles, Samples, Speed,
                                                  TurnRate)
from mobile_planning.fleet.horizon_options import LATER, MAX_SPANS, HorizonOptions
from mobile_planning.fleet.horizon_section import Found, Kind, Start
from mobile_planning.fleet.section import Limits
from mobile_planning.fleet.section_shape import SectionShape
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.convex_pieces import ConvexPieces

#: A robot at rest that would set out within this [rad] of its heading sets out along its heading.
_AHEAD = 0.35
#: A robot at rest that has less room than this [m] does not set out towards what is so near.
_TIGHT = 0.025
#: No section is worth less way than this [m].
_WORTH = 0.01
#: Beside the cost, so much of the roughness: of equally good sections the smoothest.
_SMOOTH = 1e-2
#: What breaks a constraint by more than this [m] or [m/s] is infeasible.
_FEASIBLE = 0.02
#: First guesses reach so far, as a share of the way at full speed, and are bent so far to the right [m]: if two bend to
#: the right, each passes the other on the same side.
_GUESSES = ((0.7, 0.0), (0.5, 0.6), (0.1, 0.0), (0.5, -0.6))
#: Distances that a first guess keeps by more than this [m] come in when they are broken, in at most so many goes.
_NEAR, _ROWS_ADDED = 0.5, 2
#: Programs in one round: who finds nothing by then waits for the next.
_SOLVES = 5
#: Longest durations of the last section, tried one after the other, as multiples of its duration straight ahead.
_LONGEST = np.array([1.3, 2.0, 4.0])


@dataclass(frozen=True)
class Refinement:
    """How finely a section is sampled, and what it keeps in hand for what lies between its samples.

    Attributes
    ----------
    samples : int
        Times as many as asked for.
    share : float
        Of the limits.
    spare : float [m]
        Added to the radius.
    """

    samples: int
    share: float
    spare: float


_REFINEMENTS = (Refinement(1, 0.99, 0.004), Refinement(2, 0.97, 0.012), Refinement(4, 0.94, 0.025))


def goal_point(place: NDArray, goal: NDArray, horizon: float, farthest: float) -> NDArray[np.float64]:
    """Return where an intermediate section is to end (2,) [m].

    Half as far again as the ``horizon`` [m] reaches, straight ahead, or ``farthest`` [m] if that is nearer; the goal
    itself where it is nearer still. The document's program would run past a goal within the horizon.

    Examples
    --------
    >>> goal_point(np.zeros(2), np.array([9.0, 0.0]), 2.0, 100.0).tolist()
    [3.0, 0.0]
    >>> goal_point(np.zeros(2), np.array([1.0, 0.0]), 2.0, 100.0).tolist()
    [1.0, 0.0]
    """
    way = goal - place
    left = float(np.linalg.norm(way))
    ahead = min(1.5 * horizon, farthest)
    return goal.copy() if left <= ahead else place + way / left * ahead


class SectionPlanner:
    """Plans the sections of one robot.

    Parameters
    ----------
    options : HorizonOptions
    limits : Limits
    goal : (2,) ndarray [m]
    """

    def __init__(self, options: HorizonOptions, limits: Limits, goal: NDArray):
        self.options = options
        self._limits, self._goal = limits, goal

    def plan(self, kind: Kind, start: Start, pieces: ConvexPieces, others: Sequence[Block], *, duration: float,
             prove: Callable[[NDArray], bool]) -> Found:
        """Return the first section that is proved, of the better ones first.

        Parameters
        ----------
        kind : Kind
        start : Start
        pieces : ConvexPieces
            What the robot sees.
        others : sequence of Block
            Constraints for other robots, and of deviation; none alone.
        duration : float [s]
            Of a section that is not the last.
        prove : callable
            Whether uniform control points from the first knot on are safe between samples too.
        """
        solves = infeasible = 0
        for points, violation in self._candidates(kind, start, pieces, others, duration):
            solves += 1
            infeasible += violation > _FEASIBLE
            if violation <= _FEASIBLE and points is not None and prove(points):
                return Found(points, solves, infeasible)
            if solves == _SOLVES:
                break
        return Found(None, solves, infeasible)

    def _candidates(self, kind, start, pieces, others, duration) -> Iterator[tuple[NDArray | None, float]]:
        """Yield control points and violation of one program after the other; no points where it is only a draft."""
        for guess in _GUESSES:
            departures = [(None, 0)]
            draft, violation, warm = self._solve(kind, start, pieces, others, duration, guess, _REFINEMENTS[0])
            if start.is_at_rest:
                yield None, violation
                departures = self._departures(start, draft, pieces)
            else:
                yield draft, violation
            for direction, hold in departures:
                for level in _REFINEMENTS[direction is None:]:
                    points, violation, warm = self._solve(
                        kind, start, pieces, others, duration, guess, level, direction, hold, warm)
                    yield points, violation
                    if violation > _FEASIBLE:
                        break

    def _departures(self, start, draft, pieces):
        """Return direction and spans of turning before it, for a robot at rest that would leave as in ``draft``.

        It sets out on a straight line, so along what it nearly touches, though the draft leads around that.
        """
        way = draft - start.points[2]
        left = np.linalg.norm(way, axis=1)
        if left.max() < _WORTH:
            return []
        direction = way[np.argmax(left > min(0.05, 0.5 * left.max()))]
        room, outwards = Obstacles.around(pieces, start.points[2], self._limits.radius + _TIGHT, 0.0, 0.0).room(
            start.points[2:])
        for outward in outwards[room < self._limits.radius + _TIGHT]:
            direction = direction - min(0.0, float(direction @ outward)) * outward
        if np.linalg.norm(direction) < 1e-6:
            return []
        direction = direction / np.linalg.norm(direction)
        turn = float(wrap_angle(np.arctan2(direction[1], direction[0]) - start.heading))
        hold = int(np.ceil(abs(turn) / (self._limits.omega_max * self.options.step) + 1e-6))
        ahead = np.array([np.cos(start.heading), np.sin(start.heading)])
        return [(ahead, 0)] * (abs(turn) <= _AHEAD) + [(direction, hold)] * (abs(turn) > 1e-6)

    def _solve(self, kind, start, pieces, others, duration, guess, level, direction=None, hold=0, warm=None):
        """Return uniform control points, the violation, and clamped control points for the next guess."""
        options, motion = self.options, start.motion(self.options.step)
        later = [_delayed(block, hold * options.step) for block in others] if hold else list(others)
        blocks = self._blocks(level, pieces, motion[0]) + later
        if kind is not Kind.LAST:
            spans = options.spans(duration) - hold
            if spans < options.n_knots:
                return None, np.inf, warm
            target = goal_point(motion[0], self._goal, duration * self._limits.v_max, options.dist_opt_offset)
            limit = options.fs_maxit if kind is Kind.FIRST else options.maxit
            shape, answer = self._on_grid(spans, motion, blocks, level, direction, None, target, guess, warm, limit)
            return self._uniform(shape, answer, spans, start, hold, shape.points(answer.x))
        return self._solve_last(start, motion, blocks, level, direction, hold, guess, warm)

    def _solve_last(self, start, motion, blocks, level, direction, hold, guess, warm):
        """Find the shortest duration, then the section of the next whole number of spans."""
        options, step = self.options, self.options.step
        left = float(np.linalg.norm(self._goal - motion[0]))
        full = min(1.0, left / (self._limits.v_max * options.Td))
        intervals = max(6, round(options.n_knots * full))
        samples = max(6, round(options.N_s * full))
        shape = SectionShape(np.linspace(0, 1, intervals + 1), motion, None, goal=self._goal, direction=direction,
                             samples=level.samples * samples)
        shortest = max(intervals * step, left / self._limits.v_max)
        first = max(shortest, left / self._limits.v_max + self._limits.v_max / self._limits.a_max)
        hessian, gradient = shape.roughness()
        hessian, gradient = _SMOOTH * hessian, _SMOOTH * gradient
        hessian[-1, -1] += 2 * options.ls_time_opt_scale
        gradient[-1] += 2 * options.ls_time_opt_scale * start.elapsed
        for longest in np.minimum(first * _LONGEST, MAX_SPANS * step):
            answer = self._run(shape, hessian, gradient, blocks, shape.guess(self._goal, first, guess[1]), shortest,
                               longest, options.ls_maxit)
            if answer.violation <= _FEASIBLE:
                break
        least = int(np.ceil(shape.duration(answer.x) / step - 1e-6))
        best = (None, np.inf, warm)
        for spans in range(least, least + LATER + 1):
            warm = shape.points(answer.x)
            fixed, result = self._on_grid(spans, motion, blocks, level, direction, self._goal, self._goal, guess, warm,
                                          options.ls_maxit, intervals)
            best = self._uniform(fixed, result, spans, start, hold, warm)
            if result.violation <= _FEASIBLE / 4:
                break
        return best

    def _on_grid(self, spans, motion, blocks, level, direction, goal, target, guess, warm, limit, intervals=None):
        """Solve for a section of ``spans`` spans whose knots are on the grid; return its shape and the answer."""
        intervals = intervals or self.options.n_knots
        duration, breaks = spans * self.options.step, clamped_spline.even_breaks(spans, intervals)
        shape = SectionShape(breaks / spans, motion, duration, goal=goal, direction=direction,
                             samples=level.samples * self.options.N_s)
        hessian, gradient = shape.roughness()
        hessian, gradient = _SMOOTH * hessian, _SMOOTH * gradient
        if goal is None:
            hessian[shape.end, shape.end] += 2 * np.eye(2)
            gradient[shape.end] -= 2 * (target - motion[0])
        first = shape.fit(warm, duration) if warm is not None else shape.guess(
            _towards(motion[0], target, guess[0] * duration * self._limits.v_max), duration, guess[1])
        return shape, self._run(shape, hessian, gradient, blocks, first, duration, duration, limit)

    def _run(self, shape, hessian, gradient, blocks, guess, shortest, longest, limit):
        def constraints(x):
            at: Samples = shape.samples(x)
            values, slopes = zip(*(block(at) for block in blocks))
            return np.concatenate(values), np.concatenate(slopes)

        reach = 2 * self._limits.v_max * longest + 1.0
        low, high = shape.bounds(reach, shortest, longest)
        x, values = guess, constraints(guess)[0]
        # The limits of the body, whose four rows at each time come first, always count.
        counts = (values < _NEAR) | (np.arange(len(values)) < 4 * len(shape.u))
        for _ in range(_ROWS_ADDED):
            program = nonlinear.Program(hessian, gradient, _rows(constraints, np.flatnonzero(counts)), low, high)
            answer = nonlinear.solve(program, x, self.options.solver, self.options.acc, limit)
            if not np.isfinite(answer.x).all():
                return nonlinear.Answer(guess, np.inf, answer.iterations)
            values = constraints(answer.x)[0]
            is_new = (values < 0) & ~counts
            if answer.violation > _FEASIBLE or not is_new.any():
                break
            x, counts = answer.x, counts | (values < _NEAR)
        return nonlinear.Answer(answer.x, max(answer.violation, -values.min()), answer.iterations)

    def _blocks(self, level, pieces, place):
        """Return the blocks that every section has; an obstacle that no section can reach is left out."""
        limits, options = self._limits, self.options
        reach = min(options.detec_rho, options.Tp * limits.v_max) + limits.radius + level.spare
        return [Speed(level.share * limits.v_max), Acceleration(level.share * limits.a_max),
                TurnRate(level.share * limits.omega_max),
                Obstacles.around(pieces, place, reach, limits.radius, level.spare)]

    def _uniform(self, shape, answer, spans, start, hold, warm):
        """Return uniform control points that go on exactly from the start, after a turn, and end exactly at rest."""
        intervals = len(warm) - clamped_spline.DEGREE
        points = clamped_spline.to_uniform(clamped_spline.even_breaks(spans, intervals)) @ shape.points(answer.x)
        points[:3], points[-3:] = start.points, points[-1]
        if shape.ends_at_goal:
            points[-3:] = self._goal
        return np.concatenate([np.repeat(start.points[:1], hold, axis=0), points]), answer.violation, warm


def _rows(constraints, rows):
    """Return ``constraints`` without all but some of its rows."""
    def some(x):
        values, slopes = constraints(x)
        return values[rows], slopes[rows]
    return some


def seen_region(place: NDArray, detec_rho: float, radius: float) -> Communication:
    """Return the block that keeps a body within what was seen from ``place`` (2,) [m]."""
    return Communication(lambda times: (np.tile(place, (len(times), 1)), np.zeros((len(times), 2))),
                         detec_rho - radius)


def _delayed(block, delay):
    """Return ``block`` for a section that begins ``delay`` [s] later than what the block's path counts from."""
    path = block.path
    return type(block)(lambda times: path(times + delay), *(getattr(block, name) for name in ('least', 'most')
                                                            if hasattr(block, name)))


def _towards(place, target, distance):
    way = target - place
    left = max(float(np.linalg.norm(way)), 1e-9)
    return place + way * min(1.0, distance / left)
