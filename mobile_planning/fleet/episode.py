"""Episode: one simulated mission as a heap of events in logical time.

No two robots share a cycle: each has its own phase, its own clock, and takes
its own time to plan; messages arrive when they arrive. Everything random comes
from one seed, so an episode can be had again to the byte.
"""
from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence
from itertools import count

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.fleet.channel import Channel, wire_size
from mobile_planning.fleet.collisions import collisions
from mobile_planning.fleet.errands import Errands
from mobile_planning.fleet.faults import Faults, Kill
from mobile_planning.fleet.invariant import Breach, Invariant
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.message import Death
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.vehicle import Vehicle

#: What is due between two cycles is collected so long after it fell due [s]: several answers go in one message.
ANSWER_DELAY = 0.03
#: Robots are switched on so long before the mission starts [s], but for those that join it late.
_LEAD = 1.0
#: A certificate is said again so often [s].
_CERTIFICATE_EVERY = 1.0
#: A joint plan is thought about for so long [s] a member, evenly drawn between these.
_THOUGHT = (0.004, 0.0125)


class Episode:
    """One mission of some robots; what it came to is in its attributes.

    Parameters
    ----------
    robots : sequence of Robot
        As they are before their mission.
    seed : int
    channel : Channel
    faults : Faults
    start_time : float [s]
        Of the mission, on the fleet's clock; all times here count from it.
    errands : Errands or None
        Asked for a next goal when a robot has arrived.
    is_watched : bool
        The invariant is checked after every event, where robots plan by contracts.

    Attributes
    ----------
    vehicles : dict of int to Vehicle
    refused : list of str
        Goals that a robot could not take, one sentence each.
    breaches : list of Breach
        Of the invariant, and of the truth.
    least_distance : float [m]
        Between two centres, sampled on the fleet's clock.
    ended : float [s]
        When the last event was.
    events, messages, message_bytes, deliveries, checks : int
        ``messages`` counts what was said, ``deliveries`` what was heard; ``checks`` pairs looked at.

    Raises
    ------
    InvalidInput
        A fault befalls an unknown robot, or clocks are off by more than the margin of a robot allows for.
    """

    def __init__(self, robots: Sequence[Robot], seed: int, channel: Channel, faults: Faults, start_time: float,
                 *, errands: Errands | None = None, is_watched: bool = True):
        faults.require_known([robot.eyed for robot in robots])
        _require_margins(robots, faults.skew)
        # Each purpose has its own numbers: one more message does not change how long a section takes.
        phases, self._solve_rng, self._channel_rng, self._thought_rng = np.random.default_rng(seed).spawn(4)
        self._channel, self._faults, self._errands = channel, faults, errands
        self._given = {robot.eyed: [robot.goal] for robot in robots}
        self.refused: list[str] = []
        self._heap: list = []
        self._ticket = count()
        skews = faults.skew * phases.integers(-1, 2, len(robots))
        self.vehicles = {robot.eyed: Vehicle(robot, start_time, float(skew)) for robot, skew in zip(robots, skews)}
        self._start_time = start_time
        shares = phases.random(len(robots)).tolist()
        self._phases = {robot.eyed: share * robot.cycle for robot, share in zip(robots, shares)}
        # The receding horizon has no contracts; that plans in force keep apart, the verifier proves afterwards.
        is_watched = is_watched and all(robot.method == 'contracts' for robot in robots)
        self._invariant = Invariant(list(self.vehicles.values())) if is_watched else None
        self.breaches: list[Breach] = []
        self.least_distance, self.ended = np.inf, 0.0
        self._versions: set[tuple[int, int]] = set()
        self.events = self.messages = self.message_bytes = self.deliveries = 0

    @property
    def checks(self) -> int:
        """Pairs that the invariant has looked at."""
        return 0 if self._invariant is None else self._invariant.checks

    @property
    def dead(self) -> list[int]:
        """Robots whose process does not run now."""
        return [vehicle.eyed for vehicle in self.vehicles.values() if vehicle.is_dead]

    def run(self, timeout: float) -> None:
        """Drive until all who live have arrived, for ``timeout`` [s] at most."""
        late = {join.robot: join.time for join in self._faults.joins}
        for vehicle in self.vehicles.values():
            self._push(late.get(vehicle.eyed, -_LEAD), self._boot, vehicle)
        returning = {}
        for kill in self._faults.kills:
            self._push(kill.time, self._kill, self.vehicles[kill.robot], kill)
            returning[kill.robot] = kill.restart_after < np.inf
        now = 0.0
        while self._heap and self._heap[0][0] <= timeout:
            now, _, action, vehicle, life, content = heapq.heappop(self._heap)
            if life is not None and life != vehicle.life:
                continue
            self.events += 1
            action(now, vehicle, *content)
            if self._invariant is not None:
                self._invariant.check(vehicle, now)
            if all(vehicle.robot.is_done or vehicle.is_dead and not returning[vehicle.eyed]
                   for vehicle in self.vehicles.values()):
                break
        self._judge(now)

    @property
    def goals(self) -> dict[int, tuple[NDArray, ...]]:
        """All goals (3,) [m, m, rad] that each robot was given or is to be given, by id."""
        return {eyed: (*given, *(self._errands.left(eyed) if self._errands is not None else ()))
                for eyed, given in self._given.items()}

    @property
    def joint_plans(self) -> int:
        """Joint plans that were told."""
        return len(self._versions)

    def _judge(self, now):
        self.ended = now
        until = max(now, *(vehicle.rests_from() for vehicle in self.vehicles.values()))
        self.least_distance, hits = collisions(list(self.vehicles.values()), until)
        broken = [] if self._invariant is None else self._invariant.breaches
        self.breaches = sorted([*broken, *hits], key=lambda breach: breach.time)

    def _push(self, time, action: Callable, vehicle, *content, life=None):
        """Let ``action`` befall ``vehicle`` at ``time`` [s], if it still lives the same ``life`` then."""
        # The ticket keeps the heap from comparing actions, and settles ties.
        heapq.heappush(self._heap, (time, next(self._ticket), action, vehicle, life, content))

    # Life and death

    def _boot(self, now, vehicle):
        if vehicle.is_alive:
            return
        if vehicle.has_joined and now < vehicle.rests_from():
            self._push(vehicle.rests_from(), self._boot, vehicle)
            return
        # Who starts with the mission knows who is switched on later; who comes later knows nothing.
        docks = {other.eyed: (other.place(now), other.robot.limits.radius) for other in self.vehicles.values()
                 if other.eyed in {join.robot for join in self._faults.joins}} if now < 0.0 else {}
        vehicle.boot(now)
        vehicle.robot.start(list(self.vehicles), self._start_time, docks)
        self._push(now + self._wait(now, vehicle), self._cycle, vehicle, life=vehicle.life)

    def _wait(self, now, vehicle):
        """Return how long after its boot [s] the first cycle of ``vehicle`` begins."""
        if not self._faults.any_phase:
            return float((vehicle.robot.phase - vehicle.clock(now)) % vehicle.robot.cycle)
        return self._phases[vehicle.eyed]

    def _kill(self, now, vehicle, kill: Kill):
        if not vehicle.is_alive:
            return
        vehicle.kill()
        if kill.is_certified:
            self._push(now + vehicle.robot.protocol.rest_time, self._certify, vehicle, life=vehicle.life)
        if kill.restart_after < np.inf:
            self._push(now + kill.restart_after, self._boot, vehicle)

    def _certify(self, now, vehicle):
        """A supervisor, who has seen the process end, tells the others; its own clock is as wrong as any."""
        if vehicle.is_alive:
            return
        issued = vehicle.clock(now) - vehicle.skew - self._faults.skew
        robot = vehicle.robot
        death = Death(vehicle.eyed, robot.protocol.epoch, robot.plan.end, issued, robot.limits.radius)
        self._say(now, vehicle, [death], sender=None)
        self._push(now + _CERTIFICATE_EVERY, self._certify, vehicle, life=vehicle.life)

    # What a process does

    def _cycle(self, now, vehicle):
        self._push(now + vehicle.robot.cycle, self._cycle, vehicle, life=vehicle.life)
        if vehicle.is_solving:
            return
        self._look_around(now, vehicle)
        vehicle.expect_losses(now)
        section = vehicle.robot.plan_section(vehicle.clock(now))
        vehicle.is_solving = True
        self._push(now + self._faults.solve.draw(self._solve_rng), self._commit, vehicle, section, life=vehicle.life)

    def _commit(self, now, vehicle, section):
        self._look_around(now, vehicle)
        vehicle.is_solving = False
        self._say(now, vehicle, vehicle.robot.commit(section, vehicle.clock(now)), sender=vehicle.eyed)
        request = vehicle.robot.take_request()
        if request is not None:
            thought = len(request.ids) * self._thought_rng.uniform(*_THOUGHT)
            self._push(now + thought, self._propose, vehicle, request, life=vehicle.life)
        waiting, vehicle.inbox = vehicle.inbox, []
        for message in waiting:
            vehicle.hear(message, now)
        self._plan_answers(now, vehicle)
        if self._errands is not None and vehicle.robot.is_done:
            self._send_on(now, vehicle)

    def _send_on(self, now, vehicle):
        """Give a robot that has arrived its next goal, if there is one."""
        taken = [(other.robot.goal[:2] if other.is_alive or not other.has_joined else other.robot.plan.end,
                  other.robot.limits.radius) for other in self.vehicles.values() if other is not vehicle]
        goal = self._errands.next_goal(vehicle.eyed, now, taken)
        if goal is None:
            return
        self._given[vehicle.eyed].append(goal)
        try:
            vehicle.robot.set_goal(goal, vehicle.clock(now))
        except PlanningError as error:
            self.refused.append(f'{error}')

    def _propose(self, now, vehicle, request):
        """Beside the cycle, another thread has made a joint plan."""
        plans = vehicle.robot.propose(request.plan(), vehicle.clock(now))
        self._say(now, vehicle, plans, sender=vehicle.eyed)

    def _hear(self, now, vehicle, message):
        if not vehicle.is_alive:
            return
        self.deliveries += 1
        if vehicle.is_solving and not self._faults.is_threaded:
            vehicle.inbox.append(message)
            return
        if vehicle.hear(message, now):
            self._plan_answers(now, vehicle)

    def _plan_answers(self, now, vehicle):
        if not vehicle.has_answers_due and vehicle.robot.has_answers:
            vehicle.has_answers_due = True
            self._push(now + ANSWER_DELAY, self._answer, vehicle, life=vehicle.life)

    def _answer(self, now, vehicle):
        vehicle.has_answers_due = False
        # A process with one thread comes to it after the section.
        if not (vehicle.is_solving and not self._faults.is_threaded):
            self._say(now, vehicle, vehicle.robot.answers(vehicle.clock(now)), sender=vehicle.eyed)
            self._plan_answers(now, vehicle)

    def _say(self, now, vehicle, messages, *, sender):
        """Send ``messages`` of or about ``vehicle`` to everybody else."""
        for message in messages:
            self.messages += 1
            if isinstance(message, JointPlan):
                self._versions.add(message.version)
            self.message_bytes += wire_size(message)
            others = [other for other in self.vehicles.values() if other is not vehicle]
            times = self._channel.travel_times(self._channel_rng, sender, [other.eyed for other in others], now)
            for other, travels in zip(others, times):
                for travel in travels if self._is_in_range(now, vehicle, other) else ():
                    self._push(now + travel, self._hear, other, message)

    def _is_in_range(self, now, vehicle, other):
        reach = self._faults.radio_range
        return reach == np.inf or np.linalg.norm(vehicle.place(now) - other.place(now)) <= reach

    def _look_around(self, now, vehicle):
        """Tell ``vehicle`` what its presence sensor sees, if it has one: bodies, with or without a process."""
        if vehicle.robot.sensor_range == np.inf:
            return
        # Beyond its range it still sees somebody leave, so that contracts may lapse.
        reach = vehicle.robot.sensor_range + 2 * vehicle.robot.protocol.terms.margin
        place, seen = vehicle.place(now), {}
        for other in self.vehicles.values():
            at, speed = other.motion(now)
            if other is not vehicle and np.linalg.norm(at - place) <= reach:
                seen[other.eyed] = at, speed
        vehicle.robot.observe(seen, vehicle.clock(now))


def _require_margins(robots, skew):
    """Raise InvalidInput unless all radii allow for clocks that are off by ``skew`` [s], and all knots agree."""
    if len({robot.plan.step for robot in robots}) > 1:
        raise InvalidInput(f'robots share their knots, so their Tc must be one, not {[r.Tc for r in robots]} s')
    for robot in robots:
        margin, need = robot.limits.radius - robot.rho, robot.limits.v_max * skew
        if margin < need - 1e-12:
            raise InvalidInput(f'the margin of robot {robot.eyed} is {margin:.4f} m; a clock that is off by {skew} s '
                               f'needs {need:.4f} m')
