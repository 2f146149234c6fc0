"""Plans and robots on a stage: what they are bound to is as a test says."""
from types import SimpleNamespace

import numpy as np

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.collisions import positions
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.link import Terms
from mobile_planning.fleet.message import Link
from mobile_planning.fleet.solution import Solution

#: Time between the knots of all plans [s].
STEP = 0.25
#: Range of everybody's presence sensor [m].
SIGHT = 7.0


def plan_through(*places, first_knot=0):
    """Return a plan with the control points ``places`` that rests at the last."""
    return Plan(first_knot, STEP, np.array([*places, *[places[-1]] * 3], float))


def drive(start, end, spans=8, first_knot=0):
    """Return a plan that rests at ``start`` for a moment, and goes straight to ``end``."""
    way = np.linspace(start, end, spans)
    return plan_through(start, start, *way, first_knot=first_knot)


def rest(place, first_knot=0):
    return Plan.at_rest(first_knot, STEP, np.array([*place, 0.0]))


class Protocol:
    """What a robot says that it is bound to."""

    def __init__(self, bound=(), links=(), is_free=True):
        self.contracts, self._links, self.is_free = list(bound), dict(links), is_free
        self.terms = Terms(sensor_range=SIGHT)

    @property
    def sides(self):
        side = SimpleNamespace(bound=lambda: tuple(self.contracts))
        return {peer: side for peer in (1, 2)}

    def links(self, now):
        return {peer: Link(1, mode) for peer, mode in self._links.items()}

    def may_move(self, now, at_rest):
        return self.is_free


def vehicle(eyed, plan, bound=(), links=(), is_free=True, is_alive=True):
    robot = SimpleNamespace(eyed=eyed, plan=plan, sensor_range=SIGHT, rho=0.195, limits=SimpleNamespace(radius=0.2),
                            protocol=Protocol(bound, links, is_free))
    return SimpleNamespace(eyed=eyed, robot=robot, is_alive=is_alive, clock=lambda now: now,
                           place=lambda now: positions([plan], np.array([now]))[0], solution=Solution(eyed, (plan,)))


def wall(height, contract_id=1, first_span=0, spans=12):
    """Return the contract whose owner stays above ``height`` [m], and its peer below."""
    return Contract(contract_id, first_span, np.tile([0.0, 1.0], (spans, 1)), np.full((spans, 4), float(height)))
