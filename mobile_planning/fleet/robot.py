"""Robot: one agent that plans its own trajectory among others, section by section.

A pure object: time is passed in, messages go in by ``receive`` and out of
``step`` and ``answers``. The same robot runs in logical time in ``WorldSim``
and in real time behind the ROS node.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import (
    GoalOccupied,
    GoalOutside,
    InvalidInput,
    PlanningError,
    StartOccupied,
    StartOutside,
)
from mobile_planning.fleet import fences
from mobile_planning.fleet.bspline import MAX_POINTS, Plan, bezier, splice
from mobile_planning.fleet.contracts import ROUNDING, Contract, build, room
from mobile_planning.fleet.coordination import Coordination
from mobile_planning.fleet.guidance import Guidance
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.joint_request import JointRequest
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.message import Contracts, Death, Mode, RobotMsg
from mobile_planning.fleet.neighbour import Neighbour
from mobile_planning.fleet.protocol import Protocol
from mobile_planning.fleet.roundabout import Roundabout, predict_crowd, updated
from mobile_planning.fleet.hold_up import HoldUp
from mobile_planning.fleet.horizon import Horizon, rest_index
from mobile_planning.fleet.section import Limits, SectionProblem, shorten
from mobile_planning.fleet.solution import Solution
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.convex_pieces import ConvexPieces
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

#: A robot has arrived within this of its goal [m] and of its final heading [rad].
GOAL_TOLERANCE = 0.02
HEADING_TOLERANCE = 0.02
#: Knots in one cycle: fine ones let a robot set out and stop sooner.
_KNOTS = 2
#: A new plan may follow so many knots of the one in force.
_SPLICED = 24
#: Less than this [rad] is no turn.
_TURNED = 1e-5
#: A commit this near to its first knot [s] comes too late.
_GUARD = 0.005
#: Slower than this [m/s] at its first knot, a section departs from rest.
_V_REST = 0.03
#: Headings closer than this [rad] are equal.
_SAME_HEADING = 1e-6
#: Cycles between two looks for a crowd.
_LOOK_AROUND = 3
#: A contract is renewed once a plan comes nearer to its line than what is driven in this time [s].
_AMPLE = 1.5
#: Joint plans may be made so long [s] before the start of a mission, when all have been heard.
_EARLY = 0.9
#: Getting nearer to the goal by this [m] is progress.
_PROGRESS = 0.05
#: Poses of a path from elsewhere; how far [m] from the robot it may begin.
MAX_PATH, _PATH_GAP = 10_000, 1.0
#: Cycles between two looks for a way where there was none.
_SEEK_AGAIN = 8


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


class Robot:
    """One robot of a fleet.

    Parameters
    ----------
    eyed : int
        Robot id; of two robots the one with the lower id draws the line between them.
    kine_model : UnicycleKineModel
        Start, goal and limits.
    obstacles : sequence of Obstacle
    phy_boundary : Boundary or None
    neigh : sequence of int
        Peers to stay in radio range of; every robot of the mission is avoided, named here or not.
    rho : float [m]
        Radius of the body.
    Tc : float [s]
        Between two calls of ``step``; knots are half of it apart. None for the method's own, 0.25 s.
    Tp : float [s]
        Length of a plan.
    grid : OccupancyGrid or None
        Its occupied and unknown cells are obstacles too.
    method : str
        ``'contracts'``.
    margin : float [m]
        Added to the radius for tracking, clock and numeric errors.
    epoch : int
        Grows with each start of the robot's process, from 1 on.
    start_time : float [s]
        When the robot is switched on, on the fleet's common clock.
    solver : str
        Of `QuadraticProgram`.
    sensor_range : float [m]
        Within which the robot sees other bodies; infinite for no such sensor.
    budget : float [s]
        Between the start of planning and the knot from which the plan may change.
    reverse : bool
        Whether it may drive backwards.

    Raises
    ------
    InvalidInput
        A parameter is out of its range.
    StartOutside, GoalOutside, StartOccupied, GoalOccupied
        The body does not fit there.
    NoPath
        No path for the body leads to the goal.
    """

    def __init__(self, eyed: int, kine_model: UnicycleKineModel, obstacles: Sequence[Obstacle] = (),
                 phy_boundary: Boundary | None = None, neigh: Sequence[int] = (), *, rho: float = 0.2,
                 Tc: float | None = None, Tp: float = 3.0, grid: OccupancyGrid | None = None,
                 method: str = 'contracts', margin: float = 0.005, epoch: int = 1, start_time: float = 0.0,
                 solver: str = 'active_set', sensor_range: float = np.inf, budget: float = 0.08,
                 reverse: bool = False):
        Tc = 0.25 if Tc is None else Tc
        if method != 'contracts':
            raise InvalidInput(f'method is {method!r}; known is contracts')
        if not (0 < rho <= 100 and 0 <= margin <= 10 and 0.01 <= Tc <= 10 and 4 * Tc <= Tp <= 50 * Tc):
            raise InvalidInput(f'rho {rho} m, margin {margin} m, Tc {Tc} s or Tp {Tp} s is out of range: '
                               '0 < rho <= 100, 0 <= margin <= 10, 0.01 <= Tc <= 10, 4 Tc <= Tp <= 50 Tc')
        if not (0 <= budget <= 10 * Tc and sensor_range > 0 and epoch >= 1):
            raise InvalidInput(f'budget {budget} s, sensor_range {sensor_range} m or epoch {epoch} is out of range: '
                               '0 <= budget <= 10 Tc, sensor_range > 0, epoch >= 1')
        if kine_model.u_init.any() or kine_model.u_final.any():
            raise InvalidInput(f'contracts go from rest to rest: u_init {kine_model.u_init} and u_final '
                               f'{kine_model.u_final} must be 0')
        self.eyed, self.k_mod, self.rho, self.neigh = int(eyed), kine_model, float(rho), tuple(neigh)
        self._made = dict(rho=rho, Tc=Tc, Tp=Tp, grid=grid, method=method, margin=margin, solver=solver,
                          sensor_range=sensor_range, budget=budget, reverse=reverse)
        self.environment = Environment(phy_boundary, obstacles, grid)
        self.Tc, self.sensor_range, self._step = float(Tc), float(sensor_range), float(Tc) / _KNOTS
        self._spans, self._budget, self._reverse = int(round(Tp / self._step)), float(budget), bool(reverse)
        v_max, omega_max = kine_model.u_max
        self.limits = Limits(v_max, kine_model.acc_max[0], omega_max, rho + margin)
        self._pieces = ConvexPieces(self.environment)
        self._require_room('start', kine_model.z_init, StartOutside, StartOccupied)
        self._require_room('goal', kine_model.z_final, GoalOutside, GoalOccupied)
        self._guidance = self._guidance_to(kine_model.z_final, kine_model.z_init)
        self._guidance.prepare()
        self._coordination = Coordination(self.eyed, self.environment, self.limits.radius, v_max, boot_epoch=int(epoch))
        self._coordination.prepare()
        self._problem = SectionProblem(self.limits, self._step, self._spans, solver)
        self._horizon = self._horizon_to(kine_model.z_final)
        first = Plan.at_rest(int(np.floor(start_time / self._step)), self._step, kine_model.q_init)
        self._plans, self._commits, self._section_times = [first], [np.nan], []
        self._in_force = _InForce(first, self.limits.radius, self._step)
        # In a gap between two observations two robots of this speed come nearer by no more than the margin.
        rest_time, gap = (self._spans + 3) * self._step, 2 * self.Tc
        margin, least = max(1.0, 2 * v_max * gap), 2 * (self.limits.radius + v_max * rest_time)
        if sensor_range < least:
            raise InvalidInput(f'sensor_range {sensor_range} m is below {least:.3f} m: two robots of this kind that '
                               'see each other at last must have room to come to rest')
        self.protocol = Protocol(self.eyed, int(epoch), self._in_force, rest_time=rest_time,
                                 sensor_range=sensor_range, margin=margin, gap=gap, born=start_time)
        self._mode, self._is_paused = Mode.WAITING, False
        self._mission_start, self._is_planning = np.inf, False
        self._least_left, self._progress_at, self._cycles = np.inf, 0.0, 0
        self._roundabout: Roundabout | None = None
        self._may_be_blocked, self._no_way, self._sought = False, '', 0
        self.broken: tuple[int, ...] = ()

    def _require_room(self, name, place, outside, occupied):
        x_min, y_min, x_max, y_max = self.environment.bounds
        said = f'{name} ({place[0]:.3f}, {place[1]:.3f}) of robot {self.eyed}'
        if not (x_min <= place[0] <= x_max and y_min <= place[1] <= y_max):
            raise outside(f'{said} lies outside the world, x in {x_min:g}..{x_max:g} m, y in {y_min:g}..{y_max:g} m')
        free, need = self._room_at(place), self.limits.radius
        if free < need - ROUNDING:
            raise occupied(f'{said} has {free:.3f} m of room, with its margin it needs {need:.3f} m')

    def _guidance_to(self, goal, place):
        """Return the guidance to ``goal`` (2,) [m], which a way joins to ``place`` (2,) [m]."""
        guidance = Guidance(self.environment, goal, self.limits.radius, self.limits.v_max)
        guidance.path(place)
        return guidance

    def _horizon_to(self, goal):
        return Horizon(self._problem, goal, self._pieces, reverse=self._reverse)

    def _room_at(self, place):
        """Return how far [m] a place (2,) is from the static world; what is farther than twice the radius counts so."""
        curve, reach = np.tile(place, (1, 4, 1)), 2 * self.limits.radius
        around = (fences.of_walls(self._pieces, 1, 0.0)
                  + fences.of_pieces(self._pieces, curve, 0.0, curve[:, 0] - reach, curve[:, 0] + reach))
        return float(min(reach, around.room(curve).min(initial=np.inf)))

    def restarted(self, epoch: int, now: float) -> Robot:
        """Return the robot that a new process makes where the body now rests; it knows nothing of the others."""
        state = self.state(now)
        model = self.k_mod
        moved = UnicycleKineModel(state[:3], model.q_final, u_max=model.u_max, a_max=model.acc_max)
        return Robot(self.eyed, moved, self.environment.obstacles, self.environment.boundary, self.neigh,
                     epoch=epoch, start_time=now, **self._made)

    # What a mission says

    def join(self, roster: Sequence[int], resting: Mapping[int, tuple[NDArray, float]] | None = None) -> None:
        """Listen to the robots of ``roster`` from now on.

        Parameters
        ----------
        roster : sequence of int
        resting : dict of int to ((2,) array_like [m], float [m])
            Places and radii of the robots among them that are not switched on yet.
        """
        self.protocol.join(list(roster), resting or {})

    def start(self, roster: Sequence[int], start_time: float,
              resting: Mapping[int, tuple[NDArray, float]] | None = None) -> None:
        """Drive from ``start_time`` [s] on, among the robots of ``roster``; see `join`."""
        self.join(roster, resting)
        self._mission_start = float(start_time)

    def stop(self) -> None:
        """Finish the plan in force, which ends at rest, and stay there."""
        self._mission_start = np.inf
        if not self.is_done:
            self._mode = Mode.STOPPED

    def set_goal(self, q_final: ArrayLike, now: float) -> None:
        """Drive to another goal from ``now`` [s] on, whether the last one was reached or not.

        The plan in force stands until the next commit, and so do all contracts: no other robot has to be asked. A joint
        plan that the robot takes part in ends for it, for it led to the old goal. A robot that waits, is paused or was
        stopped does so on, and drives to the new goal when it drives again. On a map this takes about as long as a
        section: the field of the way to the goal is computed, where the goal is not in plain sight.

        Parameters
        ----------
        q_final : (3,) array_like [m, m, rad]
        now : float [s]

        Raises
        ------
        InvalidInput
            It is not three finite numbers.
        GoalOutside, GoalOccupied, NoPath
            The body does not fit there, or nothing leads there. The old goal stands.

        Examples
        --------
        >>> room = Boundary((0, 8), (0, 6))
        >>> agent = Robot(1, UnicycleKineModel((1, 1, 0), (7, 1, 0)), [], room)
        >>> agent.set_goal((7, 5, 1.57), 0.0)
        >>> agent.goal.tolist()
        [7.0, 5.0, 1.57]
        """
        model, guidance = self._towards(q_final)
        self.k_mod, self._guidance, self._horizon = model, guidance, self._horizon_to(model.z_final)
        self._coordination.leave()
        self._roundabout, self._least_left, self._progress_at = None, np.inf, now
        if self.is_done:
            self._mode = Mode.STOPPED if self._mission_start == np.inf else Mode.DRIVING

    def follow_path(self, poses: ArrayLike, now: float) -> None:
        """Drive along a path from elsewhere to its end, from ``now`` [s] on, as the others let it; see `set_goal`.

        The path is guidance: corners are cut where that is in sight, and robots are passed beside it.

        Parameters
        ----------
        poses : (N, 3) array_like [m, m, rad]
            From near the robot on; of the headings the last counts.
        now : float [s]

        Raises
        ------
        InvalidInput
            It is no path, it begins far away, or the body does not fit along it.
        GoalOutside, GoalOccupied, NoPath
            The body does not fit at its end. The old goal and way stand.
        """
        poses = np.array(poses, float)
        if poses.ndim != 2 or poses.shape[1] != 3 or not 2 <= len(poses) <= MAX_PATH or not np.isfinite(poses).all():
            raise InvalidInput(f'a path has 2 to {MAX_PATH} finite poses (x, y, theta), not an array of {poses.shape}')
        points, here = poses[:, :2], self.state(now)[:2]
        gap = np.linalg.norm(points[0] - here)
        if gap > _PATH_GAP:
            raise InvalidInput(f'the path begins {gap:.3f} m away from robot {self.eyed}, farther than {_PATH_GAP} m')
        thirds = np.linspace(0.0, 1.0, 4)[:, None]
        legs = points[:-1, None] + thirds * np.diff(points, axis=0)[:, None]
        span, least = self._least_room(legs)
        if least < -ROUNDING:
            x, y = points[span]
            raise InvalidInput(f'the path leads from ({x:.3f}, {y:.3f}) on where robot {self.eyed} does not fit, by '
                               f'{-least:.3f} m')
        self.set_goal(poses[-1], now)
        self._guidance.lead(points)

    def require_goal(self, q_final: ArrayLike) -> None:
        """Raise what `set_goal` would raise for a goal."""
        self._towards(q_final)

    def _towards(self, q_final):
        """Return model and guidance that lead to a goal."""
        made = self.k_mod
        model = UnicycleKineModel(made.q_init, q_final, made.u_init, made.u_final, made.u_max, made.acc_max)
        self._require_room('goal', model.z_final, GoalOutside, GoalOccupied)
        return model, self._guidance_to(model.z_final, self.plan.end)

    def pause(self, now: float) -> None:
        """Come to rest from ``now`` [s] on, as soon as its contracts allow, and stay until `resume`.

        Where they do not, the plan in force is driven to its end. The robot speaks on, takes contracts and keeps them,
        so that its peers drive past it; to them it has stopped.
        """
        self._is_paused, self._progress_at = True, now
        self._coordination.leave()

    def resume(self, now: float) -> None:
        """Drive on from ``now`` [s] on, if the robot was paused."""
        self._is_paused, self._progress_at = False, now

    def enter(self, environment: Environment, now: float) -> None:
        """Go by another static world from ``now`` [s] on.

        The plan in force and all contracts stand. Where the plan leads into what is occupied by now the robot brakes
        as its contracts allow; where it would come too late by that, as hard as it can: a wall is sure to be hit, a
        robot is not. ``broken`` says with whom its contracts do not hold any more.

        Parameters
        ----------
        environment : Environment
        now : float [s]
        """
        self.environment, self._pieces = environment, ConvexPieces(environment)
        self._made['grid'] = environment.grid
        self._horizon = self._horizon_to(self.k_mod.z_final)
        self._coordination.enter(environment)
        self._roundabout, self._may_be_blocked, self._sought = None, True, 0
        self._seek_way(now)

    @property
    def world_trouble(self) -> str:
        """Why the robot does not drive on in the world as it is; empty for nothing."""
        said = f'its contracts with robots {list(self.broken)} do not hold any more' if self.broken else ''
        is_blocked = self._is_blocked(self._in_force.span)
        blocked = 'the plan in force leads into what is occupied by now' if is_blocked else ''
        return '; '.join(filter(None, (blocked, said, self._no_way)))

    def _seek_way(self, now):
        """Find a way in a world that has changed; without one the robot comes to rest."""
        try:
            self._require_room('goal', self.k_mod.z_final, GoalOutside, GoalOccupied)
            self._guidance = self._guidance_to(self.k_mod.z_final, self.state(now)[:2])
            self._no_way, self._least_left, self._progress_at = '', np.inf, now
        except PlanningError as error:
            self._no_way = str(error)

    def _is_blocked(self, span):
        """Whether the plan in force leads, from ``span`` on, into what is occupied by now."""
        return self._may_be_blocked and self._room_ahead(self.plan, span)[1] < -ROUNDING

    def _room_ahead(self, plan, span):
        """Return from which span on a plan touches the static world, and how much room [m] it has at the least."""
        count = max(plan.end_knot - span, 1)
        touched, least = self._least_room(bezier(plan.control(span, count + 3)))
        return span + touched, least

    def _least_room(self, curves):
        """Return the first of ``curves`` (S, 4, 2) that touches the static world, S for none, and the least room [m].
        """
        count, radius = len(curves), self.limits.radius
        around = (fences.of_walls(self._pieces, count, radius)
                  + fences.of_pieces(self._pieces, curves, radius, curves.min(axis=1), curves.max(axis=1)))
        room = around.room(curves).min(axis=1, initial=np.inf)
        touched = around.spans[room < -ROUNDING]
        return int(touched.min()) if len(touched) else count, float(room.min(initial=np.inf))

    # What goes in and out

    def receive(self, message: RobotMsg | Contracts | Death | JointPlan, now: float) -> bool:
        """Take in a peer's ``message`` at ``now`` [s]; return whether it was news."""
        self._in_force.now = now
        if isinstance(message, JointPlan):
            return self._coordination.hear(message, now)
        is_news = self.protocol.hear(message, now)
        if is_news and isinstance(message, RobotMsg):
            self._coordination.hear(message, now)
        return is_news

    def observe(self, seen: Mapping[int, tuple[NDArray, float]], now: float) -> None:
        """Take in what the presence sensor sees at ``now`` [s]: place (2,) [m] and speed [m/s] of each robot."""
        self._in_force.now = now
        self.protocol.observe(seen, now, self.state(now)[:2])

    def step(self, now: float) -> list[RobotMsg | Contracts | JointPlan]:
        """Plan and commit the next section at ``now`` [s], and a joint plan if one is due; return all messages."""
        messages = self.commit(self.plan_section(now), now)
        request = self.take_request()
        return messages if request is None else messages + self.propose(request.plan(), now)

    def take_request(self) -> JointRequest | None:
        """Return the request for a joint plan that has fallen due in `commit`, if any, once.

        ``request.plan()`` takes some ten milliseconds or more and touches nothing of the robot: it can be called in
        another thread, while the robot goes on. Its answer goes to `propose`; until then no other plan falls due.
        """
        return self._coordination.take_request()

    def propose(self, plan: JointPlan | None, now: float) -> list[JointPlan]:
        """Put in force at ``now`` [s] the joint ``plan`` that was requested; return what is to be sent.

        None says that none could be made. A plan that comes after a newer one is dropped.
        """
        return self._coordination.propose(plan, now)

    def plan_section(self, now: float) -> Section:
        """Return the next section as planned at ``now`` [s]; nothing changes until it is committed."""
        self._in_force.now, self._is_planning = now, True
        knot = self._knot(now)
        old = self.plan.control(knot, self._spans + 3)
        if self._stays(knot, old):
            return Section(knot, old)
        began = perf_counter()
        if self._no_way and self.plan.end_knot <= knot:
            # At rest it looks again now and then: somebody may clear the way.
            self._sought += 1
            if self._sought % _SEEK_AGAIN == 1:
                self._seek_way(now)
        heading = float(self._plan_at(knot).state(knot * self._step)[2])
        if self._is_blocked(self._in_force.span):
            return self._braking(knot, old, now, began)
        if self._is_at_goal(self.plan.end) and self.plan.end_knot <= knot and not self._coordination.calls:
            return self._turn_to_finish(knot, old, heading)
        if not self.protocol.may_move(now, self._is_slow(old)):
            return Section(knot, old)
        if self._is_paused and not np.ptp(old[:3], axis=0).any():
            return Section(knot, old, np.repeat(old[:1], len(old), axis=0), seconds=perf_counter() - began)
        new, final = self._horizon.plan(old, heading, self._reference(knot, old, now), self._peer_fences(knot, old))
        if new is not None and self._is_at_goal(new[-1]):
            final = self.k_mod.q_final[2]
        if self._is_paused and new is not None and rest_index(new) > rest_index(old):
            new = None
        return Section(knot, old, new, final, perf_counter() - began)

    def commit(self, section: Section, now: float) -> list[RobotMsg | Contracts | JointPlan]:
        """Put in force of ``section`` what is proved at ``now`` [s], and return the messages for all peers.

        A section that comes too late, or that the contracts bound by now forbid, is dropped.
        """
        self._in_force.now, self._is_planning = now, False
        if section.seconds:
            self._section_times.append(section.seconds)
        if section.new is not None and now <= section.first_knot * self._step - _GUARD:
            self._commit(section, now)
        self._update_mode(now)
        self._note_progress(now)
        self._note_broken()
        self._look_around(now)
        plans = self._coordinate(now)
        self.protocol.committed(now)
        message = self._message(now)
        self.protocol.sent(message.sequence, now)
        return [message, *plans, *self.answers(now)]

    @property
    def has_answers(self) -> bool:
        """Whether `answers` has something to send."""
        return self.protocol.has_due and not self._is_planning

    def answers(self, now: float) -> list[Contracts]:
        """Return the offers and answers that are due at ``now`` [s], in at most one message for all peers."""
        self._in_force.now = now
        # Offers from a plan that is about to change would be stale when they arrive.
        message = None if self._is_planning else self.protocol.due(now)
        return [] if message is None else [message]

    # What can be asked

    @property
    def mode(self) -> Mode:
        """What the robot is doing; while it is paused it has stopped."""
        return Mode.STOPPED if self._is_paused and self._mode is not Mode.WAITING else self._mode

    @property
    def is_done(self) -> bool:
        """Whether the robot is at its goal and at rest."""
        return self._mode is Mode.DONE

    @property
    def is_paused(self) -> bool:
        """Whether the robot comes to rest, or rests, until `resume`."""
        return self._is_paused

    @property
    def goal(self) -> NDArray[np.float64]:
        """The pose (3,) [m, m, rad] that the robot drives to."""
        return self.k_mod.q_final.copy()

    @property
    def plan(self) -> Plan:
        """The plan in force, from the knot of the last commit on."""
        return self._in_force.plan

    @property
    def held_up(self) -> HoldUp | None:
        """Why the robot does not go on and for whom, as of the last commit; None if it does, or is done."""
        return None if self.is_done else self._coordination.held_up

    @property
    def phase(self) -> float:
        """Where within ``Tc`` [s] a cycle starts best: just in time for a knot."""
        return (-self._budget - 2e-3) % self.Tc

    def until_cycle(self, now: float) -> float:
        """Return how long [s] after a cycle at ``now`` [s] the next one starts best, half of ``Tc`` at least."""
        wait = float((self.phase - now) % self.Tc)
        return wait if wait >= self.Tc / 2 else wait + self.Tc

    @property
    def sol(self) -> Solution:
        """What the robot has driven so far."""
        return Solution(self.eyed, tuple(self._plans), self.is_done, tuple(self._section_times),
                        commits=tuple(self._commits))

    @property
    def ctime(self) -> list[float]:
        """Time [s] to plan each section."""
        return list(self._section_times)

    def state(self, now: float) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (5,) at ``now`` [s] by the plan in force."""
        return self._plan_at(now / self._step).state(now)

    def heard(self) -> dict[int, RobotMsg]:
        """Return the newest message of each peer heard."""
        return dict(self.protocol.heard)

    @property
    def ignored(self) -> int:
        """Messages that were own, stale or of robots outside the mission."""
        return self.protocol.ignored

    # How it works

    def _knot(self, now):
        """Return the first knot from which a plan made at ``now`` may change, the start of the first plan at least."""
        return max(int(np.ceil((now + self._budget) / self._step - 1e-9)), self.plan.first_knot)

    def _plan_at(self, knot):
        """Return which of the plans drives at ``knot``: the last that has started, or the first."""
        return next((plan for plan in reversed(self._plans) if plan.first_knot <= knot), self._plans[0])

    def _stays(self, knot, old):
        """Whether the robot is to go on as by ``old``, its plan in force from ``knot`` on."""
        if knot * self._step < self._mission_start - 1e-9:
            return True
        if self._is_paused:
            return not np.ptp(old, axis=0).any()
        return self.is_done and not self._coordination.calls

    def _is_slow(self, old):
        """Whether a plan that goes on from ``old`` departs from rest."""
        return bool(np.linalg.norm(old[2] - old[0]) < 2 * self._step * _V_REST)

    def _is_at_goal(self, place):
        return bool(np.linalg.norm(place - self.k_mod.z_final) <= GOAL_TOLERANCE)

    def _turn_to_finish(self, knot, old, heading):
        """Return the section that turns to the final heading; that takes no new room, so nobody is asked."""
        final = self.k_mod.q_final[2]
        is_turned = abs(wrap_angle(final - heading)) <= HEADING_TOLERANCE
        return Section(knot, old, None if is_turned else np.repeat(old[:1], 4, axis=0), final)

    def _braking(self, knot, old, now, began):
        """Return the section that comes to rest before what the plan in force leads into."""
        new, fenced = np.repeat(old[:1], len(old), axis=0), self._peer_fences(knot, old)
        touched, _ = self._room_ahead(self.plan, self._in_force.span)
        if np.ptp(old[:3], axis=0).any():
            new = self._horizon.brake(old, self._brakes_to(old), fenced)
        speed = np.linalg.norm(old[2] - old[0]) / (2 * self._step)
        late = touched * self._step - now < 2 * speed / self.limits.a_max + 2 * self.Tc
        if late and (new is None or self._room_ahead(Plan(knot, self._step, new), knot)[1] < -ROUNDING):
            free = self._horizon.brake(old, self._brakes_to(old), fences.NONE)
            new = new if free is None else free
        return Section(knot, old, new, seconds=perf_counter() - began, is_forced=late)

    def _reference(self, knot, old, now):
        standing = (old[1:-2] + 4 * old[2:-1] + old[3:]) / 6
        if self._is_paused or self._no_way:
            return np.repeat([self._brakes_to(old)], len(standing), axis=0)
        way = self._coordination.way(standing[0])
        if way is not None:
            return self._guidance.follow(way, standing, self._step)
        velocity = (old[3] - old[1]) / (2 * self._step)
        return self._guidance.reference(standing, self._neighbours(knot + 1), self._step, now - self._progress_at,
                                        roundabout=self._roundabout, velocity=velocity)

    def _brakes_to(self, old):
        """Return where (2,) [m] the robot can come to rest that goes on from ``old``."""
        velocity = (old[2] - old[0]) / (2 * self._step)
        return (old[0] + 4 * old[1] + old[2]) / 6 + velocity * np.linalg.norm(velocity) / (2 * self.limits.a_max)

    def _neighbours(self, knot):
        """Return what is known of the others at ``knot``."""
        neighbours = []
        for message in self.protocol.heard.values():
            points = message.plan.control(max(knot, message.plan.first_knot), 3)
            position = (points[0] + 4 * points[1] + points[2]) / 6
            parked = message.mode in (Mode.DONE, Mode.STOPPED) and message.plan.end_knot <= knot
            velocity = (points[2] - points[0]) / (2 * message.plan.step)
            neighbours.append(Neighbour(position, message.plan.end, message.goal, message.radius, parked, velocity,
                                        message.v_max))
        for place, radius in self.protocol.discs():
            if not any(np.linalg.norm(neighbour.position - place) < radius for neighbour in neighbours):
                neighbours.append(Neighbour(place, place, place, radius, True))
        return neighbours

    def _peer_fences(self, knot, points):
        """Return the fences of all contracts and resting peers, to the end of everybody's plan and one span of rest."""
        bound = self.protocol.bound()
        last = max((contract.last_span for contract, _ in bound), default=knot)
        count = max(self._spans, len(points) - 3, last - knot + 1) + 1
        curves = bezier(np.concatenate([points, np.repeat(points[-1:], count + 3 - len(points), axis=0)]))
        radius = self.limits.radius
        return (fences.of_contracts(bound, knot, count, radius)
                + fences.of_discs(self.protocol.discs(), curves, radius))

    def _commit(self, section, now):
        """Put in force of the section what the contracts bound by now allow."""
        knot, old, new = section.first_knot, section.old, section.new
        if section.is_forced:
            new = self._forced(section)
            if new is old:
                return
        elif len(new) == len(old):
            if not self.protocol.may_move(now, self._is_slow(old)):
                return
            if any(contract.first_span > knot for contract, _ in self.protocol.bound()):
                return
            new = shorten(old, new, self._peer_fences(knot, old), self.limits, self._step)
            if new is old:
                return
        heading = float(self._plan_at(knot).state(knot * self._step)[2])
        plan = self._with_rest(knot, new, heading, section.final_heading)
        # Whatever the solver returned, it turns no faster than it can, and at once not at all.
        turned = wrap_angle(plan.state(knot * self._step)[2] - heading)
        if abs(turned) > _TURNED or plan.turn_in_place() > self.limits.omega_max * (1 + 1e-8):
            return
        self._plans.append(plan)
        self._commits.append(float(now))
        first = max(int(np.floor(now / self._step)), self.plan.first_knot)
        self._in_force.plan = splice([self.plan, plan], first)

    def _forced(self, section):
        """Return what of a section that brakes keeps to the contracts, if that is enough, or else all of it."""
        knot, old, new = section.first_knot, section.old, section.new
        fenced = self._peer_fences(knot, old)
        kept = shorten(old, new, fenced, self.limits, self._step)
        room_kept, room_all = (self._room_ahead(Plan(knot, self._step, points), knot)[1] for points in (kept, new))
        return kept if room_kept >= min(-ROUNDING, room_all) else new

    def _with_rest(self, knot, points, heading, final_heading):
        """Return the plan of ``points`` without idle spans at its end but those in which it turns."""
        points = points[:max(rest_index(points) + 3, 4)]
        plan = Plan(knot, self._step, points, heading, reverse=self._reverse)
        if np.isnan(final_heading) or not (self._is_at_goal(points[-1]) or rest_index(points) == 0):
            return plan
        arrival = float(plan.state(plan.end_knot * self._step)[2])
        turn, most = float(wrap_angle(final_heading - arrival)), self.limits.omega_max * self._step
        if abs(turn) <= 1e-9:
            return plan
        spans = min(int(np.ceil(abs(turn) / most + 1e-6)), MAX_POINTS - _SPLICED - len(points))
        final_heading = arrival + float(np.clip(turn, -spans * most, spans * most))
        points = np.concatenate([points, np.repeat(points[-1:], spans, axis=0)])
        return Plan(knot, self._step, points, heading, final_heading, self._reverse)

    def _note_broken(self):
        """Note with whom contracts do not hold any more, and whether the world is clear again."""
        if self._may_be_blocked:
            span = self._in_force.span
            self.broken = self.protocol.breaking(lambda contract, is_owner: room(
                contract, self.plan, span, is_owner, self.limits.radius) >= -ROUNDING)
            self._may_be_blocked = bool(self.broken) or self._is_blocked(span)

    def _update_mode(self, now):
        """Notice that the robot drives, or that its mission is done."""
        if now < self._mission_start or self.is_done and not self._coordination.calls:
            return
        self._mode = Mode.DRIVING
        if (self._is_at_goal(self.plan.end) and now >= self.plan.end_knot * self._step
                and not self._coordination.calls):
            turn = wrap_angle(self.k_mod.q_final[2] - self.state(now)[2])
            if abs(turn) <= HEADING_TOLERANCE:
                self._mode = Mode.DONE

    def _note_progress(self, now):
        left = self._guidance.length(self.state(now)[:2])
        if left < self._least_left - _PROGRESS or self.mode is not Mode.DRIVING or self._coordination.is_following:
            self._least_left, self._progress_at = left, now

    def _coordinate(self, now):
        """Take part in joint plans; return those to be said again."""
        if self._is_paused:
            # A plan that came before the others knew would count on this robot.
            self._coordination.leave()
        if self._is_paused or now < self._mission_start - _EARLY:
            return []
        return self._coordination.update(now, self.state(now)[:2], self.plan.end, self.k_mod.z_final, self.is_done,
                                         now - self._progress_at, self.protocol.discs())

    def _look_around(self, now):
        """Predict a crowd on the way from what was heard, now and then."""
        self._cycles += 1
        if self._cycles % _LOOK_AROUND != 1 or self.is_done or self._mission_start == np.inf:
            return
        position = self.state(now)[:2]
        moving = [other for other in self._neighbours(self._in_force.span) if not other.is_parked]
        places = np.array([position, *(other.position for other in moving)])
        goals = np.array([self.k_mod.z_final, *(other.goal for other in moving)])
        under_way = np.linalg.norm(goals - places, axis=1) > 1.5 * self.limits.radius
        crowd = None
        if under_way[0]:
            crowd = predict_crowd(places[under_way], goals[under_way], self.limits.radius, self.limits.v_max)
        self._roundabout = updated(self._roundabout, crowd, position, self.limits.radius)

    def _message(self, now):
        first = max(int(np.floor(now / self._step)), self.plan.first_knot)
        plan = splice([self.plan], first)
        path = plan.states(np.arange(plan.first_knot, plan.end_knot + 1) * self._step)
        return RobotMsg(
            self.is_done, path[:, 0], path[:, 1], self.state(now)[:2], robot_id=self.eyed,
            boot_epoch=self.protocol.epoch, sequence=self.protocol.next_sequence(), mode=self.mode, plan=plan,
            plan_seq=len(self._plans) - 1, radius=self.limits.radius, v_max=self.limits.v_max,
            omega_max=self.limits.omega_max, a_max=self.limits.a_max, goal=self.k_mod.z_final,
            links=self.protocol.links(now), joint=self._coordination.status)


class _InForce:
    """The plan in force as the protocol sees it: what it satisfies, and what can be offered from it."""

    def __init__(self, plan: Plan, radius: float, step: float):
        self.plan, self.now = plan, plan.first_knot * step
        self._radius, self._step = radius, step

    @property
    def span(self):
        """The span that is being driven."""
        return max(int(np.floor(self.now / self._step)), self.plan.first_knot)

    def accepts(self, contract: Contract, is_owner: bool) -> bool:
        # One that begins later than clocks may differ would forbid every commit until then.
        is_begun = contract.first_span <= self.span + _KNOTS
        return is_begun and room(contract, self.plan, self.span, is_owner, self._radius) >= -ROUNDING

    def clear_of(self, place: NDArray, radius: float) -> bool:
        count = max(self.plan.end_knot - self.span, 1) + 3
        curves = bezier(self.plan.control(self.span, count))
        fence = fences.of_discs([(np.asarray(place, float), radius)], curves, self._radius)
        return bool(fence.room(curves).min() >= -ROUNDING)

    def is_ample(self, contract: Contract, heard: RobotMsg) -> bool:
        enough = _AMPLE * heard.v_max
        if contract.first_span > self.span or room(contract, self.plan, self.span, True, self._radius) < enough:
            return False
        return room(contract, heard.plan, max(self.span, heard.plan.first_knot), False, heard.radius) >= enough

    def offer(self, contract_id: int, heard: RobotMsg) -> Contract | None:
        if heard.plan is None or heard.plan.step != self._step:
            return None
        contract = build(contract_id, self.plan, heard.plan, max(self.span, heard.plan.first_knot),
                         self._radius, heard.radius)
        return contract if contract is not None and self.accepts(contract, True) else None
