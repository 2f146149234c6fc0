"""Robot: one agent that plans its own trajectory among others, section by section.

A pure object: time is passed in, messages go in by ``receive`` and out of
``step`` and ``answers``. The same robot runs in logical time in ``WorldSim``
and in real time behind the ROS node. What it is told to do is in its `Orders`, where that leads in its `Course`, what
it drives in its `Motion`, what binds it in its `Protocol`, and whom it goes after in its `Coordination`.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from time import perf_counter
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan, splice
from mobile_planning.fleet.contract_options import ContractOptions
from mobile_planning.fleet.coordination import Coordination
from mobile_planning.fleet.course import Course
from mobile_planning.fleet.ground import Ground
from mobile_planning.fleet.hold_up import HoldUp
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.joint_request import JointRequest
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.message import Contracts, Death, Mode, RobotMsg
from mobile_planning.fleet.motion import Motion, Section
from mobile_planning.fleet.orders import Orders
from mobile_planning.fleet.plan_in_force import PlanInForce
from mobile_planning.fleet.protocol import Protocol
from mobile_planning.fleet.reference_path import reference_path
from mobile_planning.fleet.section import SectionProblem
from mobile_planning.fleet.solution import Solution
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

if TYPE_CHECKING:
    from mobile_planning.fleet.horizon_robot import HorizonRobot

#: Cycles between two looks for a crowd.
_LOOK_AROUND = 3
#: Joint plans may be made so long [s] before the start of a mission, when all have been heard.
_EARLY = 0.9


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
    grid : OccupancyGrid or None
        Its occupied and unknown cells are obstacles too.
    method : str
        ``'contracts'``, or ``'receding_horizon'``: then all is as `HorizonRobot` has it, other defaults and parameters
        too.
    epoch : int
        Grows with each start of the robot's process, from 1 on.
    start_time : float [s]
        When the robot is switched on, on the fleet's common clock.
    **options
        ``rho``, ``Tc``, ``Tp``, ``margin``, ``solver``, ``sensor_range``, ``budget``, ``reverse``: see
        `ContractOptions`.

    Raises
    ------
    InvalidInput
        A parameter is out of its range.
    StartOutside, GoalOutside, StartOccupied, GoalOccupied
        The body does not fit there.
    NoPath
        No path for the body leads to the goal.
    """

    #: By which it plans.
    method = 'contracts'

    def __new__(cls, *args: object, method: str = 'contracts', **options: object) -> Robot | HorizonRobot:
        """Return a robot that plans by ``method``."""
        if method != 'receding_horizon':
            return super().__new__(cls)
        from mobile_planning.fleet.horizon_robot import HorizonRobot
        return HorizonRobot(*args, **options)

    def __init__(self, eyed: int, kine_model: UnicycleKineModel, obstacles: Sequence[Obstacle] = (),
                 phy_boundary: Boundary | None = None, neigh: Sequence[int] = (), *,
                 grid: OccupancyGrid | None = None, method: str = 'contracts', epoch: int = 1,
                 start_time: float = 0.0, **options: object):
        if method != 'contracts':
            raise InvalidInput(f'method is {method!r}; known are contracts and receding_horizon')
        if kine_model.u_init.any() or kine_model.u_final.any():
            raise InvalidInput(f'contracts go from rest to rest: u_init {kine_model.u_init} and u_final '
                               f'{kine_model.u_final} must be 0')
        self.options = options = ContractOptions(**options)
        self.eyed, self.k_mod, self.neigh, self.rho = int(eyed), kine_model, tuple(neigh), float(options.rho)
        self.Tc, self.sensor_range = float(options.Tc), float(options.sensor_range)
        self.limits = options.limits(kine_model)
        radius, v_max, step = self.limits.radius, self.limits.v_max, options.step
        first = Plan.at_rest(int(np.floor(start_time / step)), step, kine_model.q_init)
        self._in_force = PlanInForce(first, radius)
        # In a gap between two observations two robots of this speed come nearer by no more than the margin.
        self.protocol = Protocol(
            self.eyed, int(epoch), self._in_force, rest_time=options.rest_time, sensor_range=options.sensor_range,
            margin=max(1.0, 2 * v_max * options.gap), gap=options.gap, born=start_time)
        self.environment = Environment(phy_boundary, obstacles, grid)
        self._ground = Ground(self.environment, radius, self.eyed)
        self._ground.require_start(kine_model.z_init)
        self._motion = Motion(self._in_force, self.protocol, self._ground, options, self.limits)
        self._problem = SectionProblem(self.limits, step, options.spans, options.solver)
        self._course = self._course_to(kine_model, 0.0)
        self._course.guidance.prepare()
        self._coordination = Coordination(self.eyed, self.environment, radius, v_max, boot_epoch=int(epoch))
        self._coordination.prepare()
        self._orders, self._is_planning, self._cycles = Orders(), False, 0
        self._told: RobotMsg | None = None

    def _course_to(self, model, now):
        return Course(model.q_final, self.plan.end, self._ground, self._problem, reverse=self.options.reverse, now=now)

    def restarted(self, epoch: int, now: float) -> Robot:
        """Return the robot that a new process makes where the body now rests; it knows nothing of the others."""
        model, world = self.k_mod, self.environment
        moved = UnicycleKineModel(self.state(now)[:3], model.q_final, u_max=model.u_max, a_max=model.acc_max)
        return Robot(self.eyed, moved, world.obstacles, world.boundary, self.neigh, grid=world.grid, epoch=epoch,
                     start_time=now, **asdict(self.options))

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
        self._orders.start(start_time)

    def stop(self) -> None:
        """Finish the plan in force, which ends at rest, and stay there."""
        self._orders.stop()

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
        self.k_mod, self._course = self._towards(q_final, now)
        self._coordination.leave()
        self._orders.renew()

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
        path = reference_path(poses, self.state(now)[:2], self._ground)
        self.set_goal(path[-1], now)
        self._course.guidance.lead(path[:, :2])

    def require_goal(self, q_final: ArrayLike) -> None:
        """Raise what `set_goal` would raise for a goal."""
        self._towards(q_final, 0.0)

    def _towards(self, q_final, now):
        """Return model and course that lead to a goal."""
        made = self.k_mod
        model = UnicycleKineModel(made.q_init, q_final, made.u_init, made.u_final, made.u_max, made.acc_max)
        return model, self._course_to(model, now)

    def pause(self, now: float) -> None:
        """Come to rest from ``now`` [s] on, as soon as its contracts allow, and stay until `resume`.

        Where they do not, the plan in force is driven to its end. The robot speaks on, takes contracts and keeps them,
        so that its peers drive past it; to them it has stopped.
        """
        self._orders.is_paused, self._course.progress_at = True, now
        self._coordination.leave()

    def resume(self, now: float) -> None:
        """Drive on from ``now`` [s] on, if the robot was paused."""
        self._orders.is_paused, self._course.progress_at = False, now

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
        self.environment, self._ground = environment, Ground(environment, self.limits.radius, self.eyed)
        self._motion.blockage.enter(self._ground)
        self._coordination.enter(environment)
        self._course.enter(self._ground, self.state(now)[:2], now)

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
        section, began = self._motion.ahead(now), perf_counter()
        if self._stays(section):
            return section
        if self.plan.end_knot <= section.first_knot:
            self._course.seek_again(self.state(now)[:2], now)
        if self._motion.blockage.is_ahead:
            section = self._motion.stopped_short(section, self._course, now)
            return replace(section, seconds=perf_counter() - began)
        if self._is_home(section.first_knot * self.options.step):
            return self._motion.turned(section, self._course)
        if not self.protocol.may_move(now, self._motion.is_slow(section)):
            return section
        return replace(self._planned(section, now), seconds=perf_counter() - began)

    def commit(self, section: Section, now: float) -> list[RobotMsg | Contracts | JointPlan]:
        """Put in force of ``section`` what is proved at ``now`` [s], and return the messages for all peers.

        A section that comes too late, or that the contracts bound by now forbid, is dropped.
        """
        self._in_force.now, self._is_planning = now, False
        if section.seconds:
            self._motion.record.section_times.append(section.seconds)
        self._motion.commit(section, self._course, now)
        self._note_arrival(now)
        self._note_progress(now)
        self._motion.blockage.note()
        self._look_around(now)
        plans = self._coordinate(now)
        self.protocol.committed(now)
        message = self._message(now)
        self.protocol.told(message.sequence, now)
        self._told = message
        return [message, *plans, *self.answers(now)]

    @property
    def has_answers(self) -> bool:
        """Whether `answers` has something to send, or may have in a moment."""
        return self.protocol.has_due and not self._is_planning

    def answers(self, now: float) -> list[RobotMsg | Contracts]:
        """Return what is to be said at ``now`` [s] between two cycles, and what seems lost once more.

        At most one message of offers and answers for all peers, and the newest plan.
        """
        self._in_force.now = now
        if self._is_planning:
            # Offers from a plan that is about to change would be stale when they arrive.
            return []
        told = [self._told] if self.protocol.tells_again(now) else []
        message = self.protocol.due(now)
        return told if message is None else [*told, message]

    # What can be asked

    @property
    def mode(self) -> Mode:
        """What the robot is doing; while it is paused it has stopped."""
        return self._orders.mode

    @property
    def is_done(self) -> bool:
        """Whether the robot is at its goal and at rest."""
        return self._orders.is_done

    @property
    def is_paused(self) -> bool:
        """Whether the robot comes to rest, or rests, until `resume`."""
        return self._orders.is_paused

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
    def cycle(self) -> float:
        """Time [s] between two calls of `step`."""
        return self.Tc

    @property
    def world_trouble(self) -> str:
        """Why the robot does not drive on in the world as it is; empty for nothing."""
        return '; '.join(filter(None, (self._motion.blockage.trouble, self._course.trouble)))

    @property
    def broken(self) -> tuple[int, ...]:
        """The robots with whom contracts do not hold any more, since the world has changed."""
        return self._motion.blockage.broken

    @property
    def phase(self) -> float:
        """Where within ``Tc`` [s] a cycle starts best: just in time for a knot."""
        return (-self.options.budget - 2e-3) % self.Tc

    def until_cycle(self, now: float) -> float:
        """Return how long [s] after a cycle at ``now`` [s] the next one starts best, half of ``Tc`` at least."""
        wait = float((self.phase - now) % self.Tc)
        return wait if wait >= self.Tc / 2 else wait + self.Tc

    @property
    def sol(self) -> Solution:
        """What the robot has driven so far."""
        return self._motion.record.solution(self.eyed, self.is_done)

    @property
    def ctime(self) -> list[float]:
        """Time [s] to plan each section."""
        return list(self._motion.record.section_times)

    @property
    def sections_late(self) -> int:
        """Sections that were planned and came too late to be driven."""
        return self._motion.record.late

    def state(self, now: float) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (5,) at ``now`` [s] by the plan in force."""
        return self._motion.record.state(now)

    def heard(self) -> dict[int, RobotMsg]:
        """Return the newest message of each peer heard."""
        return dict(self.protocol.heard)

    @property
    def ignored(self) -> int:
        """Messages that were own, stale or of robots outside the mission."""
        return self.protocol.ignored

    # How it works

    def _stays(self, section):
        """Whether the robot is to go on as by the plan in force."""
        if section.first_knot * self.options.step < self._orders.mission_start - 1e-9:
            return True
        if self.is_paused:
            return section.stays
        return self.is_done and not self._coordination.calls

    def _is_home(self, time):
        """Whether the robot rests at its goal from ``time`` [s] on, and no joint plan calls it away."""
        rests = time >= self.plan.end_knot * self.options.step
        return rests and self._course.ends_at(self.plan.end) and not self._coordination.calls

    def _planned(self, section, now):
        """Return the section by which the robot brakes, follows a joint plan, or drives to its goal."""
        if self.is_paused:
            return self._motion.braked(section, self._course)
        if self._course.trouble:
            return self._motion.halted(section, self._course)
        way = self._coordination.way(section.knots[0])
        if way is not None:
            return self._motion.led(section, self._course, way)
        return self._motion.sent_on(section, self._course, now)

    def _note_arrival(self, now):
        """Notice that the robot drives, or that its mission is done."""
        is_home = self._is_home(now) and self._course.ends_towards(self.state(now)[2])
        self._orders.note(now, is_home or self.is_done and not self._coordination.calls)

    def _note_progress(self, now):
        here = self.state(now)[:2]
        if self.mode is Mode.DRIVING and not self._coordination.is_following:
            self._course.note_progress(here, now)
        else:
            self._course.count_anew(here, now)

    def _look_around(self, now):
        """Look for a crowd on the way, now and then."""
        self._cycles += 1
        if self._cycles % _LOOK_AROUND == 1 and self._orders.has_mission and not self.is_done:
            neighbours = self._motion.surroundings.neighbours(self._in_force.span)
            self._course.look_around(self.state(now)[:2], neighbours)

    def _coordinate(self, now):
        """Take part in joint plans; return those to be said again."""
        if self.is_paused:
            # A plan that came before the others knew would count on this robot.
            self._coordination.leave()
        if self.is_paused or now < self._orders.mission_start - _EARLY:
            return []
        return self._coordination.update(now, self.state(now)[:2], self.plan.end, self.k_mod.z_final, self.is_done,
                                         now - self._course.progress_at, self.protocol.discs())

    def _message(self, now):
        plan = splice([self.plan], self._in_force.span)
        path = (plan.points[:-2] + 4 * plan.points[1:-1] + plan.points[2:]) / 6
        return RobotMsg(
            self.is_done, path[:, 0], path[:, 1], self.state(now)[:2], robot_id=self.eyed,
            boot_epoch=self.protocol.epoch, sequence=self.protocol.next_sequence(), mode=self.mode, plan=plan,
            plan_seq=len(self._motion.record) - 1, radius=self.limits.radius, v_max=self.limits.v_max,
            omega_max=self.limits.omega_max, a_max=self.limits.a_max, goal=self.k_mod.z_final,
            links=self.protocol.links(now), joint=self._coordination.status)
