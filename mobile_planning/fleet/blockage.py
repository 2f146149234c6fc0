"""Blockage: whether a robot's plan in force leads into a static world that has changed, and what became of its word."""
from __future__ import annotations

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import ROUNDING, room
from mobile_planning.fleet.ground import Ground
from mobile_planning.fleet.plan_in_force import PlanInForce
from mobile_planning.fleet.protocol import Protocol


class Blockage:
    """What the world, after a change, takes from one robot's plan in force.

    A plan is put in force where the world leaves room for it, so before the first change there is nothing to look for.

    Parameters
    ----------
    in_force : PlanInForce
    protocol : Protocol
        What binds the robot.
    ground : Ground

    Attributes
    ----------
    broken : tuple of int
        The robots with whom its contracts do not hold any more, as of the last `note`.
    """

    def __init__(self, in_force: PlanInForce, protocol: Protocol, ground: Ground):
        self.broken: tuple[int, ...] = ()
        self._in_force, self._protocol, self._ground = in_force, protocol, ground
        self._is_due = False

    def enter(self, ground: Ground) -> None:
        """Go by another static world from now on."""
        self._ground, self._is_due = ground, True

    @property
    def is_ahead(self) -> bool:
        """Whether the plan in force leads into what is occupied by now."""
        return self._is_due and not self.is_clear(self._in_force.plan, self._in_force.span)

    @property
    def begins_at(self) -> float:
        """When [s] the plan in force is at its first span without room; when it ends, if there is none."""
        plan, span = self._in_force.plan, self._in_force.span
        return (span + self._ground.along(plan.curves(span))[0]) * plan.step

    @property
    def trouble(self) -> str:
        """What is wrong with the plan in force, and with the contracts; empty for nothing."""
        ahead = 'the plan in force leads into what is occupied by now' if self.is_ahead else ''
        broken = f'its contracts with robots {list(self.broken)} do not hold any more' if self.broken else ''
        return '; '.join(filter(None, (ahead, broken)))

    def room(self, plan: Plan, span: int) -> float:
        """Return the least room [m] that ``plan`` has in the world from ``span`` on."""
        return self._ground.along(plan.curves(span))[1]

    def is_clear(self, plan: Plan, span: int) -> bool:
        """Return whether ``plan`` has room in the world from ``span`` on."""
        return self.room(plan, span) >= -ROUNDING

    def note(self) -> None:
        """Notice with whom contracts do not hold any more, and whether there is nothing to look for any longer."""
        if self._is_due:
            self.broken = self._protocol.breaking(self._keeps)
            self._is_due = bool(self.broken) or self.is_ahead

    def _keeps(self, contract, is_owner):
        plan, span = self._in_force.plan, self._in_force.span
        return room(contract, plan, span, is_owner, self._ground.radius) >= -ROUNDING
