"""Motion: one robot's plan in force, the next section of it, and the proof by which that replaces it.

Whatever a section leads to, and wherever it came from: it is put in force only as far as it keeps to all that binds
the robot at that instant.
"""
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet import fences
from mobile_planning.fleet.blockage import Blockage
from mobile_planning.fleet.bspline import MAX_POINTS, Plan, splice
from mobile_planning.fleet.contract_options import KNOTS, ContractOptions
from mobile_planning.fleet.contracts import ROUNDING
from mobile_planning.fleet.course import Course
from mobile_planning.fleet.ground import Ground
from mobile_planning.fleet.horizon import rest_index
from mobile_planning.fleet.link import V_REST
from mobile_planning.fleet.plan_in_force import PlanInForce
from mobile_planning.fleet.plan_record import PlanRecord
from mobile_planning.fleet.protocol import Protocol
from mobile_planning.fleet.section import Limits, shorten
from mobile_planning.fleet.surroundings import Surroundings
from mobile_planning.geometry import wrap_angle

#: A new plan may follow so many knots of the one in force.
_SPLICED = 24
#: Less than this [rad] is no turn.
_TURNED = 1e-5
#: A commit this near to its first knot [s] comes too late.
_GUARD = 0.005


@dataclass(frozen=True, eq=False)
class Section:
    """What a robot has planned and not yet committed.

    Attributes
    ----------
    first_knot : int
        From which the plan would change.
    old : (n, 2) ndarray [m]
        Control points of the plan in force from there on.
    new : (n, 2) ndarray [m] or None
        To replace them; None to keep them.
    final_heading : float [rad]
        To turn to at the end, NaN for none.
    seconds : float [s]
        To plan it, 0 where nothing was to be planned.
    is_forced : bool
        It is put in force even where contracts forbid it, if else the plan leads into what is occupied.
    """

    first_knot: int
    old: NDArray[np.float64]
    new: NDArray[np.float64] | None = None
    final_heading: float = np.nan
    seconds: float = 0.0
    is_forced: bool = False

    @property
    def is_turn(self) -> bool:
        """Whether it only turns on the spot, which takes no new room: so nobody is asked."""
        return self.new is not None and len(self.new) != len(self.old)

    @property
    def stands(self) -> bool:
        """Whether the robot stands at the first knot."""
        return not np.ptp(self.old[:3], axis=0).any()

    @property
    def knots(self) -> NDArray[np.float64]:
        """Where the plan in force is at the knots after the first, (n - 3, 2) [m]."""
        return (self.old[1:-2] + 4 * self.old[2:-1] + self.old[3:]) / 6

    @property
    def stays(self) -> bool:
        """Whether the robot stands from the first knot on, by the plan in force."""
        return not np.ptp(self.old, axis=0).any()


class Motion:
    """What one robot drives by, and how that changes.

    Parameters
    ----------
    in_force : PlanInForce
        With the plan with which the robot is switched on.
    protocol : Protocol
        What binds it.
    ground : Ground
    options : ContractOptions
    limits : Limits

    Attributes
    ----------
    record : PlanRecord
    surroundings : Surroundings
    blockage : Blockage
        What a change of the world takes from the plan in force.
    """

    def __init__(self, in_force: PlanInForce, protocol: Protocol, ground: Ground, options: ContractOptions,
                 limits: Limits):
        self.record, self.surroundings = PlanRecord(in_force.plan), Surroundings(protocol, limits.radius)
        self.blockage = Blockage(in_force, protocol, ground)
        self._in_force, self._protocol, self._limits = in_force, protocol, limits
        self._step, self._spans, self._budget, self._reverse = (
            options.step, options.spans, options.budget, options.reverse)

    # What comes next

    def ahead(self, now: float) -> Section:
        """Return what the robot drives if nothing changes, from the first knot on from which it may at ``now`` [s]."""
        plan = self._in_force.plan
        knot = max(int(np.ceil((now + self._budget) / self._step - 1e-9)), plan.first_knot)
        return Section(knot, plan.control(knot, self._spans + 3))

    def is_slow(self, section: Section) -> bool:
        """Return whether a section departs from rest: slower than `V_REST` at its first knot."""
        return bool(np.linalg.norm(section.old[2] - section.old[0]) < 2 * self._step * V_REST)

    def turned(self, section: Section, course: Course) -> Section:
        """Return the section, at the goal, that turns to the final heading if the robot does not look there."""
        if course.ends_towards(self.record.heading(section.first_knot)):
            return section
        return replace(section, new=np.repeat(section.old[:1], 4, axis=0), final_heading=course.final_heading)

    def braked(self, section: Section, course: Course) -> Section:
        """Return the section that comes to rest, if that is sooner than by the plan in force."""
        old = section.old
        if section.stands:
            return replace(section, new=np.repeat(old[:1], len(old), axis=0))
        braked = self.halted(section, course)
        is_late = braked.new is not None and rest_index(braked.new) > rest_index(old)
        return section if is_late else braked

    def halted(self, section: Section, course: Course) -> Section:
        """Return the section that is drawn to where the robot can come to rest."""
        return self._drawn(section, course, np.repeat([self._stop(section)], self._spans, axis=0))

    def stopped_short(self, section: Section, course: Course, now: float) -> Section:
        """Return the section that comes to rest before what the plan in force leads into.

        Where that comes too late as the contracts are, the section brakes as hard as it can, and is forced: a wall is
        sure to be hit, a robot is not.
        """
        old, stop, brake = section.old, self._stop(section), course.horizon.brake
        new = np.repeat(old[:1], len(old), axis=0) if section.stands else brake(old, stop, self._fences(section))
        time_to_rest = 2 * np.linalg.norm(self._velocity(section)) / self._limits.a_max
        is_late = self.blockage.begins_at - now < time_to_rest + 2 * KNOTS * self._step
        if is_late and (new is None or self._room(section, new) < -ROUNDING):
            free = brake(old, stop, fences.NONE)
            new = new if free is None else free
        return replace(section, new=new, is_forced=is_late)

    def led(self, section: Section, course: Course, way: NDArray) -> Section:
        """Return the section along ``way`` (W, 2) [m]."""
        standing = self.surroundings.standing()
        for part in (way, way[:2]):
            reference = course.guidance.follow(part, section.knots, self._step, standing)
            found = self._drawn(section, course, reference)
            # A way that bends may be drawn against somebody beside it; its first move is free by the joint plan.
            if found.new is not None or not section.stands or len(way) <= 2:
                break
        return found

    def sent_on(self, section: Section, course: Course, now: float) -> Section:
        """Return the section towards the goal among all others."""
        velocity = (section.old[3] - section.old[1]) / (2 * self._step)
        neighbours = self.surroundings.neighbours(section.first_knot + 1)
        return self._drawn(section, course, course.reference(section.knots, velocity, neighbours, self._step, now))

    def _velocity(self, section):
        """Return the velocity (2,) [m/s] at the first knot."""
        return (section.old[2] - section.old[0]) / (2 * self._step)

    def _stop(self, section):
        """Return the place (2,) [m] where the robot comes to rest if it brakes from the first knot on."""
        old, velocity = section.old, self._velocity(section)
        return ((old[0] + 4 * old[1] + old[2]) / 6
                + velocity * np.linalg.norm(velocity) / (2 * self._limits.a_max))

    def _drawn(self, section, course, reference):
        """Return the section that is drawn to ``reference`` (n - 3, 2) [m] at the knots after the first."""
        heading = self.record.heading(section.first_knot)
        new, final = course.horizon.plan(section.old, heading, reference, self._fences(section))
        if new is not None and course.ends_at(new[-1]):
            final = course.final_heading
        return replace(section, new=new, final_heading=final)

    # What is put in force

    def commit(self, section: Section, course: Course, now: float) -> None:
        """Put in force at ``now`` [s] of the section what is proved; nothing where it comes too late."""
        knot = section.first_knot
        if section.new is None:
            return
        if now > knot * self._step - _GUARD:
            self.record.late += 1
            return
        points = self._forced(section) if section.is_forced else self._kept(section, now)
        if points is section.old:
            return
        heading = self.record.heading(knot)
        plan = self._with_rest(knot, points, heading, section.final_heading, course)
        # Whatever the solver returned, it turns no faster than it can, and at once not at all.
        turned = wrap_angle(plan.state(knot * self._step)[2] - heading)
        if abs(turned) > _TURNED or plan.turn_in_place() > self._limits.omega_max * (1 + 1e-8):
            return
        self.record.add(plan, now)
        self._in_force.plan = splice([self._in_force.plan, plan], self._in_force.span)

    def _kept(self, section, now):
        """Return what of the section keeps to the contracts bound by now; the very ``old`` if nothing does."""
        knot, old = section.first_knot, section.old
        if section.is_turn:
            return section.new
        if not self._protocol.may_move(now, self.is_slow(section)):
            return old
        if any(contract.first_span > knot for contract, _ in self._protocol.bound()):
            return old
        return shorten(old, section.new, self._fences(section), self._limits, self._step)

    def _forced(self, section):
        """Return what of the section keeps to the contracts, if that is enough, or else all of it."""
        kept = shorten(section.old, section.new, self._fences(section), self._limits, self._step)
        is_enough = self._room(section, kept) >= min(-ROUNDING, self._room(section, section.new))
        return kept if is_enough else section.new

    def _room(self, section, points):
        """Return the room [m] in the world of ``points`` (n, 2) [m] in the place of those in force."""
        return self.blockage.room(Plan(section.first_knot, self._step, points), section.first_knot)

    def _fences(self, section):
        return self.surroundings.fences(section.first_knot, section.old, self._spans)

    def _with_rest(self, knot, points, heading, final_heading, course):
        """Return the plan of ``points`` without idle spans at its end but those in which it turns."""
        points = points[:max(rest_index(points) + 3, 4)]
        plan = Plan(knot, self._step, points, heading, reverse=self._reverse)
        if np.isnan(final_heading) or not (course.ends_at(points[-1]) or rest_index(points) == 0):
            return plan
        arrival = float(plan.state(plan.end_knot * self._step)[2])
        turn, most = float(wrap_angle(final_heading - arrival)), self._limits.omega_max * self._step
        if abs(turn) <= 1e-9:
            return plan
        spans = min(int(np.ceil(abs(turn) / most + 1e-6)), MAX_POINTS - _SPLICED - len(points))
        final_heading = arrival + float(np.clip(turn, -spans * most, spans * most))
        points = np.concatenate([points, np.repeat(points[-1:], spans, axis=0)])
        return Plan(knot, self._step, points, heading, final_heading, self._reverse)
