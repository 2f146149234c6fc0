"""Robot: one agent that plans its own trajectory among others, section by section.

A pure object: time is passed in, messages go in by ``receive`` and out of
``step``. The same robot runs in logical time in ``WorldSim`` and in real time
behind the ROS node.
"""
from __future__ import annotations

from collections.abc import Sequence
from time import perf_counter

import numpy as np

from mobile_planning.errors import GoalOccupied, InvalidInput, NoPath, StartOccupied
from mobile_planning.fleet.bspline import MAX_POINTS, Plan, acceleration_bound, keeps_turn_rate, speed_bound, splice
from mobile_planning.fleet.certificates import keeps_apart, keeps_clear
from mobile_planning.fleet.guidance import Guidance, Polyline
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.message import Mode, RobotMsg
from mobile_planning.fleet.protocol import Protocol
from mobile_planning.fleet.section import Limits, bearing, candidates, remaining
from mobile_planning.fleet.solution import Solution
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

#: A robot has arrived within this of its goal [m] and of its final heading [rad].
GOAL_TOLERANCE = 0.02
HEADING_TOLERANCE = 0.02
#: A commit this near to its first knot [s] comes too late.
_GUARD = 0.005
_MAX_LATENCY = 2.0
#: Room [m] to spare at start and goal, without which no drive from or to them can be proved clear.
_SPARE = 0.001


class Robot:
    """One robot of a fleet.

    Parameters
    ----------
    eyed : int
        Robot id; of two clashing proposals the lower id's stands.
    kine_model : UnicycleKineModel
        Start, goal and limits.
    obstacles : sequence of Obstacle
    phy_boundary : Boundary or None
    neigh : sequence of int
        Peers to stay in radio range of; every robot of the mission is avoided, named here or not.
    rho : float [m]
        Radius of the body.
    Tc : float [s]
        Between two calls of ``step``, and between knots.
    Tp : float [s]
        Length of a plan.
    grid : OccupancyGrid or None
        Its occupied and unknown cells are obstacles too.
    margin : float [m]
        Added to the radius for tracking, clock and numeric errors.
    epoch : int
        Grows with each start of the robot's process.
    start_time : float [s]
        When the robot is switched on, on the fleet's common clock.

    Raises
    ------
    InvalidInput
        A parameter is out of its range.
    StartOccupied, GoalOccupied
        The body does not fit there.
    NoPath
        No path for the body leads to the goal.
    """

    def __init__(self, eyed: int, kine_model: UnicycleKineModel, obstacles: Sequence[Obstacle] = (),
                 phy_boundary: Boundary | None = None, neigh: Sequence[int] = (), *, rho: float = 0.2,
                 Tc: float = 0.25, Tp: float = 3.0, grid: OccupancyGrid | None = None, margin: float = 0.005,
                 epoch: int = 0, start_time: float = 0.0):
        if not (0 < rho <= 100 and 0 <= margin <= 10 and 0.01 <= Tc <= 10 and 4 * Tc <= Tp <= 100 * Tc):
            raise InvalidInput(f'rho {rho} m, margin {margin} m, Tc {Tc} s or Tp {Tp} s is out of range: '
                               '0 < rho <= 100, 0 <= margin <= 10, 0.01 <= Tc <= 10, 4 Tc <= Tp <= 100 Tc')
        self.eyed, self.k_mod, self.rho, self.neigh = int(eyed), kine_model, float(rho), tuple(neigh)
        self.environment = Environment(phy_boundary, obstacles, grid)
        self.mode = Mode.WAITING
        self.Tc, self._spans, self._latency = float(Tc), int(round(Tp / Tc)), 1.5 * Tc
        # What is in force, up to the end of a section that starts so late, must fit into one message.
        self._max_latency = min(_MAX_LATENCY, (MAX_POINTS - 5 - self._spans) * self.Tc)
        v_max, omega_max = kine_model.u_max
        self.limits = Limits(v_max, kine_model.acc_max[0], omega_max, rho + margin)
        self._require_room()
        self._guidance = Guidance(self.environment, kine_model.z_final, self.limits.radius)
        self._guidance.path(kine_model.z_init)
        first = Plan.at_rest(int(np.floor(start_time / Tc)), self.Tc, kine_model.q_init)
        self._plans, self._section_times = [first], []
        self._protocol = Protocol(self.eyed, int(epoch), first)
        self._sequence = 0
        self._mission_start = np.inf

    def _require_room(self):
        places, need = np.array([self.k_mod.z_init, self.k_mod.z_final]), self.limits.radius + _SPARE
        for place, room, error, name in zip(places, self.environment.clearance(places),
                                            (StartOccupied, GoalOccupied), ('start', 'goal')):
            if room < need:
                raise error(f'{name} ({place[0]:.3f}, {place[1]:.3f}) of robot {self.eyed} has {room:.3f} m of room, '
                            f'with its margin it needs {need:.3f} m')

    # What a mission says

    def join(self, roster: Sequence[int]) -> None:
        """Listen to the robots of ``roster`` from now on."""
        self._protocol.join(list(roster))

    def start(self, roster: Sequence[int], start_time: float) -> None:
        """Drive from ``start_time`` [s] on, among the robots of ``roster``."""
        self.join(roster)
        self._mission_start = float(start_time)

    def stop(self) -> None:
        """Finish the plan in force, which ends at rest, and stay there."""
        self._protocol.withdraw()
        self._mission_start = np.inf
        if not self.is_done:
            self.mode = Mode.STOPPED

    # What goes in and out

    def receive(self, message: RobotMsg, now: float) -> bool:
        """Take in a peer's ``message`` at ``now`` [s]; return whether it was news."""
        news = self._protocol.hear(message, self._keeps_apart_from, epoch_is_bound=now >= self._mission_start)
        self._settle(now)
        return news

    def step(self, now: float) -> list[RobotMsg]:
        """Plan the next section at ``now`` [s], if it is time for one, and return the messages for all peers."""
        self._settle(now)
        if now >= self._mission_start:
            self._drive(now)
        self._sequence += 1
        return [self._message(now)]

    # What can be asked

    @property
    def is_done(self) -> bool:
        """Whether the robot is at its goal and at rest."""
        return self.mode is Mode.DONE

    @property
    def plan(self) -> Plan:
        """The plan in force."""
        return self._protocol.plan

    @property
    def sol(self) -> Solution:
        """What the robot has driven so far."""
        return Solution(self.eyed, tuple(self._plans), self.is_done, tuple(self._section_times))

    @property
    def ctime(self) -> list[float]:
        """Time [s] to plan each section."""
        return list(self._section_times)

    def state(self, now: float) -> np.ndarray:
        """Return x, y, theta, v, omega (5,) at ``now`` [s] by the plan in force."""
        return self._plan_at(now / self.Tc).state(now)

    def heard(self) -> dict[int, RobotMsg]:
        """Return the newest message of each peer heard."""
        return {peer_id: peer.message for peer_id, peer in self._protocol.peers.items() if peer.message is not None}

    @property
    def ignored(self) -> int:
        """Messages that were own, stale or of robots outside the mission."""
        return self._protocol.ignored

    # How it works

    def _index_at(self, knot):
        """Return which of the plans is in force at ``knot``: the last that has started, or the first."""
        return next((index for index in reversed(range(len(self._plans)))
                     if self._plans[index].first_knot <= knot), 0)

    def _plan_at(self, knot):
        return self._plans[self._index_at(knot)]

    def _settle(self, now):
        """Commit the open proposal if all have promised, withdraw it if its time has come."""
        proposal = self._protocol.proposal
        if proposal is None:
            return
        if now > proposal.first_knot * self.Tc - _GUARD:
            self._protocol.withdraw()
            self._latency = min(1.5 * self._latency, self._max_latency)
        elif self._protocol.is_promised():
            self._commit(proposal, now)
            self._latency = max(0.97 * self._latency, 1.5 * self.Tc)

    def _commit(self, plan, now):
        self._plans.append(plan)
        self._protocol.commit(self._in_force(now))

    def _in_force(self, now):
        """Return all that is committed as one plan, from the current knot on."""
        knot = max(int(np.floor(now / self.Tc)), self._plans[0].first_knot)
        return splice(self._plans[self._index_at(knot):], knot)

    def _drive(self, now):
        """Propose the next section, turn in place, or notice that the mission is done."""
        self._protocol.plan = self._in_force(now)
        arrived = np.linalg.norm(self.plan.end - self.k_mod.z_final) <= GOAL_TOLERANCE
        stands = now >= self._plans[-1].end_knot * self.Tc
        if arrived and stands:
            self._finish(now)
        elif self._protocol.proposal is None and not arrived:
            self.mode = Mode.DRIVING
            began = perf_counter()
            proposal = self._next_section(now)
            self._section_times.append(perf_counter() - began)
            if proposal is not None:
                self._protocol.propose(proposal)
                self._settle(now)
            elif stands:
                self._face_the_way(now)

    def _finish(self, now):
        """Turn to the final heading; then the mission is done."""
        final = self.k_mod.q_final[2]
        if abs(wrap_angle(final - self.state(now)[2])) <= HEADING_TOLERANCE:
            self.mode = Mode.DONE
        else:
            self._turn_in_place(final, now)

    def _face_the_way(self, now):
        """Turn towards the path, where that takes too long to be part of a section."""
        try:
            wanted = bearing(self.plan.end, self._path(self.plan.end_knot, self.plan.end))
        except NoPath:
            return
        if abs(wrap_angle(wanted - self.state(now)[2])) > 0.5 * self._spans * self.Tc * self.limits.omega_max:
            self._turn_in_place(wanted, now)

    def _turn_in_place(self, wanted, now):
        """Turn towards a heading for at most one plan; that takes no new room, so nobody is asked."""
        heading, most = self.state(now)[2], 0.97 * self.limits.omega_max * self.Tc
        turn = np.clip(wrap_angle(wanted - heading), -most * self._spans, most * self._spans)
        points = np.tile(self.plan.end, (max(1, int(np.ceil(abs(turn) / most))) + 3, 1))
        self._commit(Plan(int(np.floor(now / self.Tc)) + 1, self.Tc, points, heading,
                          float(wrap_angle(heading + turn))), now)

    def _next_section(self, now):
        """Return the best candidate that is proved clear, None if standing by the old plan is as good."""
        knot = max(int(np.ceil((now + self._latency) / self.Tc)), self._plans[-1].first_knot)
        start = self.plan.control(knot, 3)
        heading = float(self._plan_at(knot).state(knot * self.Tc)[2])
        try:
            path = self._path(knot, start[2])
        except NoPath:
            return None
        points = candidates(start, heading, path, self.limits, self.Tc, self._spans)
        costs = self._costs(points, path)
        standing = self._costs(self.plan.control(knot, self._spans + 3)[None], path)[0]
        worth = np.flatnonzero(costs < standing - 0.02)
        best = worth[np.argsort(costs[worth], kind='stable')]
        plans = (Plan(knot, self.Tc, good, heading) for good in points[best[self._is_proved(points[best], knot)]])
        # Rounding: a turn may fill its spans to the last digit.
        return next((plan for plan in plans if plan.turn_in_place() <= self.limits.omega_max * (1 + 1e-8)), None)

    def _path(self, knot, position):
        """Return the way to the goal from ``position`` (2,) [m], around whoever stands still at ``knot``."""
        return Polyline(self._guidance.path(position, *self._parked(knot)))

    @staticmethod
    def _costs(points, path):
        """Return what is left to drive [m]: at the end of each plan (K,), and on its way there."""
        left = remaining(points, path)
        return left[:, -1] + 0.5 * left.mean(axis=1)

    def _is_proved(self, points, knot):
        """Return which plans (K, n, 2) keep all limits, the static world's room and the peers' at every instant."""
        proved = ((speed_bound(points, self.Tc) <= self.limits.v_max)
                  & (acceleration_bound(points, self.Tc) <= self.limits.a_max)
                  & keeps_turn_rate(points, self.Tc, self.limits.omega_max))
        for peer in self._protocol.peers.values():
            for plan in peer.plans():
                proved[proved] = self._keep_apart(points[proved], knot, plan, peer.message.radius + 1e-6)
        proved[proved] = keeps_clear(points[proved], self.limits.radius, self.environment)
        return proved

    def _keep_apart(self, points, knot, other, radius):
        """Return which plans (K, n, 2) from ``knot`` on keep apart from another's, for ever."""
        first = max(knot, other.first_knot)
        count = max(knot + points.shape[1] - 3, other.end_knot, first + 1) - first + 3
        index = np.minimum(np.arange(count) + first - knot, points.shape[1] - 1)
        return keeps_apart(points[:, index], other.control(first, count), self.limits.radius + radius)

    def _keeps_apart_from(self, own, other, radius):
        return bool(self._keep_apart(own.points[None], own.first_knot, other, radius)[0])

    def _parked(self, knot):
        """Return where peers stand still (P, 2) [m], and how far to keep from them [m]."""
        standing = [peer.message for peer in self._protocol.peers.values()
                    if peer.message is not None and peer.message.proposal is None
                    and peer.message.plan.end_knot <= knot]
        room = max((message.radius for message in standing), default=0.0)
        return np.array([message.plan.end for message in standing]).reshape(-1, 2), self.limits.radius + room

    def _message(self, now):
        in_force = self._in_force(now)
        path = in_force.states(np.arange(in_force.first_knot, in_force.end_knot + 1) * self.Tc)
        protocol = self._protocol
        return RobotMsg(
            self.is_done, path[:, 0], path[:, 1], self.state(now)[:2], robot_id=self.eyed,
            boot_epoch=protocol.epoch, sequence=self._sequence, mode=self.mode,
            plan=in_force, plan_seq=protocol.plan_seq, proposal=protocol.proposal,
            proposal_seq=0 if protocol.proposal is None else protocol.proposal_seq,
            radius=self.limits.radius, v_max=self.limits.v_max, omega_max=self.limits.omega_max,
            a_max=self.limits.a_max, goal=self.k_mod.z_final, links=protocol.links())
