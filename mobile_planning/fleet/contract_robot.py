"""ContractRobot: a robot that keeps apart from others by contracts, and plans each section when it likes.

What it is told to do is in its `Orders`, where that leads in its `Course`, what it drives in its `Motion`, what binds
it in its `Protocol`, and whom it goes after in its `Coordination`.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, fields, replace
from functools import partial
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet.bspline import Plan, splice
from mobile_planning.fleet.company import Company
from mobile_planning.fleet.contract_options import ContractOptions
from mobile_planning.fleet.coordination import Coordination
from mobile_planning.fleet.course import Course
from mobile_planning.fleet.ground import Ground
from mobile_planning.fleet.hold_up import HoldUp
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.joint_request import GroundRequest, JointRequest
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.message import Contracts, Death, Mode, RobotMsg
from mobile_planning.fleet.motion import Motion, Section
from mobile_planning.fleet.plan_in_force import PlanInForce
from mobile_planning.fleet.protocol import Protocol
from mobile_planning.fleet.reference_path import reference_path
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.section import SectionProblem
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

#: Cycles between two looks for a crowd.
_LOOK_AROUND = 3
#: Joint plans may be made so long [s] before the start of a mission, when all have been heard.
_EARLY = 0.9


class ContractRobot(Robot):
    """One robot of a fleet that plans by contracts, ``Robot(...)``.

    Parameters
    ----------
    eyed : int
        Robot id; of two robots the one with the lower id draws the line between them.
    kine_model, obstacles, phy_boundary, neigh
        See `Robot`.
    grid : OccupancyGrid or None
        Its occupied and unknown cells are obstacles too.
    epoch : int
        Grows with each start of the robot's process, from 1 on.
    start_time : float [s]
        When the robot is switched on, on the fleet's common clock.
    **options
        ``rho``, ``Tc``, ``Tp``, ``margin``, ``solver``, ``sensor_range``, ``budget``, ``reverse``, ``com_range``: see
        `ContractOptions`.
    """

    method = 'contracts'

    def __init__(self, eyed: int, kine_model: UnicycleKineModel, obstacles: Sequence[Obstacle] = (),
                 phy_boundary: Boundary | None = None, neigh: Sequence[int] = (), *,
                 grid: OccupancyGrid | None = None, method: str = 'contracts', epoch: int = 1,
                 start_time: float = 0.0, **options: object):
        unknown = sorted(options.keys() - {each.name for each in fields(ContractOptions)})
        if unknown:
            raise TypeError(f'robots that plan by contracts have no option {", ".join(unknown)}; those of planning_sim '
                            "go with method='receding_horizon'")
        self.options = options = ContractOptions(**options)
        super().__init__(eyed, kine_model, neigh, options.rho, options.Tc, options.limits(kine_model))
        self.sensor_range = float(options.sensor_range)
        radius, v_max, step = self.limits.radius, self.limits.v_max, options.step
        first = Plan.at_rest(int(np.floor(start_time / step)), step, kine_model.q_init)
        self._in_force = PlanInForce(first, radius)
        ranges = dict.fromkeys(self.neigh, options.com_range) if options.com_range < np.inf else {}
        # In a gap between two observations two robots of this speed come nearer by no more than the margin.
        self.protocol = Protocol(
            self.eyed, int(epoch), self._in_force, rest_time=options.rest_time, sensor_range=options.sensor_range,
            margin=max(1.0, 2 * v_max * options.gap), gap=options.gap, born=start_time,
            ranges=ranges)
        self._company = Company(self.eyed, ranges)
        self.environment = Environment(phy_boundary, obstacles, grid)
        self._ground = Ground(self.environment, radius, self.eyed)
        self._ground.require_start(kine_model.z_init)
        self._motion = Motion(self._in_force, self.protocol, self._ground, options, self.limits)
        self._problem = SectionProblem(self.limits, step, options.spans, options.solver)
        self._course = self._making_course(kine_model, 0.0)()
        self._course.guidance.prepare()
        self._coordination = Coordination(self.eyed, self.environment, radius, v_max, boot_epoch=int(epoch))
        self._coordination.prepare()
        self._is_planning, self._cycles = False, 0
        self._told: RobotMsg | None = None

    def _making_course(self, model, now):
        """Return the function that makes the way on which a model leads."""
        return partial(Course, model.q_final, self.plan.end, self._ground, self._problem, reverse=self.options.reverse,
                       now=now)

    def restarted(self, epoch: int, now: float) -> ContractRobot:
        world = self.environment
        return ContractRobot(self.eyed, self._model_from(now), world.obstacles, world.boundary, self.neigh,
                             grid=world.grid, epoch=epoch, start_time=now, **asdict(self.options))

    # What a mission says

    def join(self, roster: Sequence[int], resting: Mapping[int, tuple[NDArray, float]] | None = None) -> None:
        self.protocol.join(list(roster), resting or {})

    def looking_ahead(self, q_final: ArrayLike) -> Callable[[], Course]:
        making = self._making_course(self._model_to(q_final), self._in_force.now)

        def make():
            course = making()
            course.guidance.prepare()
            return course
        return make

    def set_goal(self, q_final: ArrayLike, now: float, course: Course | None = None) -> None:
        """Drive to another goal from ``now`` [s] on, whether the last one was reached or not; see `Robot.set_goal`.

        The plan in force stands until the next commit, and so do all contracts. A joint plan that the robot takes part
        in ends for it, for it led to the old goal. On a map this takes about as long as a section: the field of the way
        to the goal is computed, where the goal is not in plain sight, unless `looking_ahead` has done so.
        """
        model = self._model_to(q_final)
        if course is None or not course.leads(model.q_final, self._ground):
            course = self._making_course(model, now)()
        self.k_mod, self._course, course.progress_at = model, course, now
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
        self._making_course(self._model_to(q_final), 0.0)()

    def pause(self, now: float) -> None:
        """Come to rest from ``now`` [s] on, as soon as its contracts allow, and stay until `resume`.

        Where they do not, the plan in force is driven to its end. The robot speaks on, takes contracts and keeps them,
        so that its peers drive past it; to them it has stopped.
        """
        self._orders.is_paused, self._course.progress_at = True, now
        self._coordination.leave()

    def resume(self, now: float) -> None:
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
        self._in_force.now = now
        if isinstance(message, JointPlan):
            return self._coordination.hear(message, now)
        is_news = self.protocol.hear(message, now)
        if is_news and isinstance(message, RobotMsg):
            self._coordination.hear(message, now)
        return is_news

    def expect_losses(self, are_any: bool) -> None:
        self.protocol.expect_losses(are_any)

    def observe(self, seen: Mapping[int, tuple[NDArray, float]], now: float) -> None:
        self._in_force.now = now
        self.protocol.observe(seen, now, self.state(now)[:2])

    def take_request(self) -> JointRequest | GroundRequest | None:
        return self._coordination.take_request()

    def propose(self, plan: JointPlan | None, now: float) -> list[JointPlan]:
        return self._coordination.propose(plan, now)

    def plan_section(self, now: float) -> Section:
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
    def plan(self) -> Plan:
        return self._in_force.plan

    @property
    def held_up(self) -> HoldUp | None:
        return None if self.is_done else self._coordination.held_up

    @property
    def cycle(self) -> float:
        # Each section moves the lines between two who pass each other closely: the sooner the next one, the sooner
        # the one behind may follow.
        return self.options.short_cycle if self._coordination.calls and not self.is_pressed else self.Tc

    @property
    def world_trouble(self) -> str:
        return '; '.join(filter(None, (self._motion.blockage.trouble, self._course.trouble)))

    @property
    def broken(self) -> tuple[int, ...]:
        return self._motion.blockage.broken

    @property
    def phase(self) -> float:
        # Just in time for a knot.
        return -self.options.lead % self.cycle

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
        back = self._company.seeks(self.plan, self.k_mod.z_final, self.protocol.heard, now)
        if back is not None:
            return self._motion.led(section, self._course, np.array([section.knots[0], back]))
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
