"""HorizonRobot: a robot that plans by the receding horizon, section by section, at common times.

In the time Tc before a section begins, a robot plans it alone and says so; hears what the others intend; where that
conflicts, plans again among them; and drives it if all who count have granted it. Otherwise it goes on by the section
before, which ends at rest.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.exchange import Exchange
from mobile_planning.fleet.ground import Ground
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.horizon_motion import HorizonMotion
from mobile_planning.fleet.horizon_options import HorizonOptions
from mobile_planning.fleet.horizon_rounds import ROUNDS, Rounds
from mobile_planning.fleet.horizon_section import Kind
from mobile_planning.fleet.intention import Intention, SectionRecord
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.message import Contracts, Death, Mode, RobotMsg
from mobile_planning.fleet.plan_record import leave_out
from mobile_planning.fleet.proved_sections import ProvedSections
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.section import Limits
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

#: A robot at its goal is done within this of its final heading [rad].
HEADING_TOLERANCE = 0.02
#: Cycles start so long [s] after a round begins.
_PHASE = 2e-3


class HorizonRobot(Robot):
    """One robot of a fleet that plans by the receding horizon, ``Robot(..., method='receding_horizon')``.

    Parameters
    ----------
    eyed : int
        Robot id; of two the lower is the senior.
    kine_model : UnicycleKineModel
    obstacles : sequence of Obstacle
    phy_boundary : Boundary or None
    neigh : sequence of int
        Peers to stay within ``com_range`` of, from when they are in range on, as long as they live.
    N_s, n_knots, t_init, t_sup
        See `HorizonOptions`.
    Tc : float [s] or None
        Between two sections; None for the document's, 1.0 s.
    Tp, Td, detec_rho, com_range, def_epsilon, safe_epsilon, ls_time_opt_scale, dist_opt_offset, ls_min_dist
        See `HorizonOptions`.
    rho : float [m]
        Radius of the body.
    grid : OccupancyGrid or None
        Known from the start, unlike obstacles.
    margin : float [m]
        Added to the radius for tracking, clock and numeric errors.
    epoch : int
        Grows with each start of the robot's process, from 1 on.
    start_time : float [s]
        When the robot is switched on, on the fleet's common clock.
    solver : str
        See `HorizonOptions`.
    patience : float [s]
        A peer that is silent for longer counts as dead, so that robots which live but do not hear each other for so
        long may meet; infinite to wait for it for ever.
    acc, fs_maxit, maxit, ls_maxit
        See `HorizonOptions`; `set_option` sets them later.

    Attributes
    ----------
    sections : list of SectionRecord
        The newest; see `forget`.

    Raises
    ------
    InvalidInput
        A parameter is out of its range.
    StartOutside, GoalOutside, StartOccupied, GoalOccupied
        The body does not fit there.
    """

    method = 'receding_horizon'

    def __init__(self, eyed: int, kine_model: UnicycleKineModel, obstacles: Sequence[Obstacle] = (),
                 phy_boundary: Boundary | None = None, neigh: Sequence[int] = (), N_s: int = 20, n_knots: int = 6,
                 t_init: float = 0.0, t_sup: float = 1e10, Tc: float | None = None, Tp: float = 3.0,
                 Td: float | None = None, rho: float = 0.2, detec_rho: float = 3.0, com_range: float = 15.0,
                 def_epsilon: float = 0.5, safe_epsilon: float = 0.1, ls_time_opt_scale: float = 1.0,
                 dist_opt_offset: float = 100.0, ls_min_dist: float = 0.5, *, grid: OccupancyGrid | None = None,
                 method: str = 'receding_horizon', margin: float = 0.005, epoch: int = 1, start_time: float = 0.0,
                 solver: str = 'slsqp', patience: float = 10.0, acc: float = 1e-4, fs_maxit: int = 40,
                 maxit: int = 20, ls_maxit: int = 30):
        self.options = options = HorizonOptions(
            N_s=N_s, n_knots=n_knots, t_init=t_init, t_sup=t_sup, Tc=1.0 if Tc is None else Tc, Tp=Tp,
            Td=min(3.0, Tp) if Td is None else Td, detec_rho=detec_rho, com_range=com_range, def_epsilon=def_epsilon,
            safe_epsilon=safe_epsilon, ls_time_opt_scale=ls_time_opt_scale, dist_opt_offset=dist_opt_offset,
            ls_min_dist=ls_min_dist, solver=solver, acc=acc, fs_maxit=fs_maxit, maxit=maxit, ls_maxit=ls_maxit)
        if not (0 < rho <= 100 and 0 <= margin <= 10 and epoch >= 1 and patience > 0):
            raise InvalidInput(f'rho {rho} m, margin {margin} m, epoch {epoch} or patience {patience} s is out of '
                               'range: 0 < rho <= 100, 0 <= margin <= 10, epoch >= 1, patience > 0')
        v_max, omega_max = kine_model.u_max
        super().__init__(eyed, kine_model, neigh, rho, options.Tc,
                         Limits(v_max, kine_model.acc_max[0], omega_max, rho + margin))
        options.require_reach(self.limits)
        self._step, self._margin, self._patience = options.step, margin, patience
        self.environment = Environment(phy_boundary, obstacles, grid)
        self._ground = Ground(self.environment, self.limits.radius, self.eyed)
        self._ground.require_start(kine_model.z_init)
        self._ground.require_goal(kine_model.z_final)
        self.sections: list[SectionRecord] = []
        first = Plan.at_rest(int(np.floor(start_time / self._step)), self._step, kine_model.q_init)
        self._now, self._no_room = float(start_time), ''
        self._rounds = Rounds(options, self.limits, self.neigh)
        self.protocol = self._rounds.exchange = Exchange(
            self.eyed, int(epoch), first, self._rounds.are_clear, patience,
            options.Tp + 2 * self.Tc + 2 * np.pi / omega_max)
        self._motion = HorizonMotion(first, self.protocol, options, self.limits)
        self._renew_sections()
        self._round, self._has_news, self._joining = 0, False, []

    def _renew_sections(self):
        """Plan from now on to the goal, in the world, and by the options that the robot has."""
        self._rounds.sections = ProvedSections(self.k_mod, self.environment, self.limits, self.options)

    def restarted(self, epoch: int, now: float) -> HorizonRobot:
        world = self.environment
        return HorizonRobot(self.eyed, self._model_from(now), world.obstacles, world.boundary, self.neigh,
                            rho=self.rho, grid=world.grid, margin=self._margin, epoch=epoch, start_time=now,
                            patience=self._patience, **asdict(self.options))

    def set_option(self, name: str, value: float | None = None) -> None:
        """Set the accuracy ``acc`` or the iterations ``fs_maxit``, ``maxit``, ``ls_maxit`` of first, intermediate and
        last sections; None for the default.

        Raises
        ------
        InvalidInput
            There is no such option, or the value is out of its range.
        """
        self.options = self.options.with_option(name, value)
        self._rounds.options = self._rounds.sections.options = self.options

    # What a mission says

    def join(self, roster: Sequence[int], resting: Mapping[int, tuple[NDArray, float]] | None = None) -> None:
        self._joining.append((list(roster), dict(resting or {})))

    def stop(self) -> None:
        super().stop()
        self.protocol.drop()

    def set_goal(self, q_final: ArrayLike, now: float, course: None = None) -> None:
        """Drive to another goal from ``now`` [s] on, whether the last one was reached or not; see `Robot.set_goal`.

        The section in force stands, and the next one leads to the new goal.
        """
        self.k_mod = self._towards(q_final)
        self._now, self._motion.is_last, self._no_room = now, False, ''
        self._renew_sections()
        self.protocol.drop()
        self._orders.renew()

    def require_goal(self, q_final: ArrayLike) -> None:
        self._towards(q_final)

    def pause(self, now: float) -> None:
        """Drive the section in force to its end, where the robot rests, and stay until `resume`.

        It speaks on and grants what the others intend; to them it has stopped.
        """
        self._now, self._orders.is_paused = now, True
        self.protocol.drop()

    def resume(self, now: float) -> None:
        self._now, self._orders.is_paused = now, False

    def enter(self, environment: Environment, now: float) -> None:
        """Go by another static world from ``now`` [s] on.

        The section in force stands, and the next one is proved in the new world. Where the section in force leads into
        what is occupied by now, `world_trouble` says so, and from the next round on the robot brakes as hard as it can:
        a wall is sure to be hit, a robot is not. ``broken`` names those whose plans this is not clear of. The next
        section goes on from there.

        Parameters
        ----------
        environment : Environment
        now : float [s]
        """
        self._now, self.environment = now, environment
        self._ground = Ground(environment, self.limits.radius, self.eyed)
        self._renew_sections()
        self.protocol.drop()
        self._motion.enter(self._rounds.sections.is_free, now)
        try:
            self.require_goal(self.k_mod.q_final)
            self._no_room = ''
        except PlanningError as error:
            self._no_room = str(error)

    @property
    def world_trouble(self) -> str:
        blocked = 'the plan in force leads into what is occupied by now' if self._motion.is_blocked else ''
        return '; '.join(filter(None, (blocked, self._no_room)))

    def _towards(self, q_final):
        """Return the model that leads to a goal."""
        model = self._model_to(q_final)
        self._ground.require_goal(model.z_final)
        return model

    # What goes in and out

    def receive(self, message: RobotMsg | Contracts | Death | JointPlan, now: float) -> bool:
        """Take in a peer's ``message`` at ``now`` [s]; return whether it was news.

        Raises
        ------
        InvalidInput
            The peer plans by another method, or on other knots.
        """
        self._go_on(now)
        if isinstance(message, Death):
            return self.protocol.bury(message)
        if not isinstance(message, RobotMsg) or message.method != self.method:
            self.protocol.ignored += 1
            raise InvalidInput(f'robot {message.robot_id} does not plan by {self.method}, as this one does: all robots '
                               'of a mission plan by one method')
        if message.plan is None or message.plan.step != self._step:
            self.protocol.ignored += 1
            raise InvalidInput(f'robot {message.robot_id} has no plan with knots {self._step} s apart: robots share '
                               'their knots, so their Tc must be one')
        is_news = self.protocol.hear(message, now)
        self._has_news |= is_news
        return is_news

    def plan_section(self, now: float) -> Intention:
        """Return what the robot intends in the round at ``now`` [s]; nothing changes until it is committed."""
        self._go_on(now)
        first, number = self._rounds.due(now)
        if self._motion.must_brake:
            return Intention(first, number, brake=self._motion.braked(now))
        kind = self._kind(first)
        if kind is None or number == ROUNDS - 1:
            return Intention(first, number)
        start = self._motion.start(first, first * self._step - self._orders.mission_start)
        return self._rounds.intention(kind, start, self.state(now)[:2], first, number)

    def commit(self, intention: Intention, now: float) -> list[RobotMsg]:
        """Propose what is intended, put in force what is granted at ``now`` [s]; return the messages for all peers."""
        self._go_on(now)
        self._round = intention.round
        self._note(intention)
        if intention.brake is not None:
            self._motion.brake(intention.brake, self._rounds.sections.is_free, now)
        self._motion.drop_what_is_late(now)
        if self._motion.is_open(intention.first_knot, now) and self._orders.has_mission and not self.is_paused:
            if intention.new is not None:
                self.protocol.propose(intention.new)
            elif intention.withdraws:
                self.protocol.drop()
        self._settle(now)
        self._note_arrival(now)
        return [self._message(now)]

    @property
    def has_answers(self) -> bool:
        return self._has_news and self._may_grant

    def answers(self, now: float) -> list[RobotMsg]:
        """Return what is to be said at ``now`` [s] before the next step: grants, and that a section is driven."""
        self._go_on(now)
        candidate, in_force = self.protocol.candidate, self.protocol.in_force
        self._motion.drop_what_is_late(now)
        has_granted = self._settle(now)
        is_news = has_granted or (candidate, in_force) != (self.protocol.candidate, self.protocol.in_force)
        return [self._message(now)] if is_news else []

    def observe(self, seen: Mapping[int, tuple[NDArray, float]], now: float) -> None:
        """Take in what a presence sensor sees: nothing, this robot has none."""

    def forget(self, most: int) -> None:
        super().forget(most)
        leave_out(self.sections, most)

    # What can be asked

    @property
    def mode(self) -> Mode:
        """What the robot is doing; while it is paused, or when ``t_sup`` is over, it has stopped."""
        mode = self._orders.mode
        return Mode.STOPPED if mode is Mode.DRIVING and self._is_over else mode

    def distance_left(self, now: float) -> float:
        """Return how far [m] the goal is from where the robot is at ``now`` [s], in a straight line."""
        return float(np.linalg.norm(self.k_mod.z_final - self.state(now)[:2]))

    @property
    def held_up(self) -> HoldUp | None:
        """Since when a robot that is to drive stands, and who has not granted what it intends; None if it goes on."""
        begins = self._orders.mission_start + self.options.t_init + self.Tc
        since = max(self._motion.record.newest.end_knot * self._step, begins)
        if self.mode is not Mode.DRIVING or self._now <= since:
            return None
        return HoldUp(since, Reason.STALLED, tuple(sorted(self.protocol.forbidding(self._now, True))))

    @property
    def plan(self) -> Plan:
        return self._motion.plan(self._now)

    @property
    def broken(self) -> tuple[int, ...]:
        return self._motion.broken

    @property
    def cycle(self) -> float:
        # A round of the exchange.
        return self.Tc / ROUNDS

    @property
    def phase(self) -> float:
        return _PHASE

    # How a section is planned

    def _kind(self, first):
        """Return which section begins at the knot ``first``; None for none."""
        since = first * self._step - self._orders.mission_start
        if (since < self.options.t_init - 1e-9 or since > self.options.t_sup or self._motion.target == first
                or self.is_done or self._motion.is_last or self.is_paused):
            return None
        left = np.linalg.norm(self.k_mod.z_final - self._motion.start(first, since).motion(self._step)[0])
        if left < self.options.ls_min_dist + self.Tc * self.limits.v_max:
            return Kind.LAST
        return Kind.FIRST if len(self._motion.record) == 1 else Kind.INTERMEDIATE

    # How it is agreed upon

    def _go_on(self, now):
        """Take ``now`` [s] for the present; patience with those to be listened to begins when the robot itself runs."""
        self._now = self._rounds.now = now
        for roster, resting in self._joining:
            self.protocol.join(roster, resting, now)
        self._joining.clear()

    @property
    def _may_grant(self):
        """Whether the robot has said its own intention of this section, or has none."""
        return self._round > 0 or self._motion.is_last or self.mode is not Mode.DRIVING

    def _settle(self, now):
        """Grant what may be granted, and drive what all have granted; return whether anything was granted."""
        self._has_news = False
        has_granted = self._may_grant and self.protocol.grant()
        self._motion.settle(now)
        return has_granted

    def _note(self, intention):
        if intention.found is None:
            return
        if intention.round == 0 or not self.sections:
            self.sections.append(SectionRecord(intention.kind))
            self._motion.record.section_times.append(0.0)
        record = self.sections[-1]
        record.seconds += intention.seconds
        self._motion.record.section_times[-1] = record.seconds
        record.solves += intention.found.solves
        record.infeasible += intention.found.infeasible
        record.refused += intention.new is None

    def _note_arrival(self, now):
        """Notice that the robot drives, or that it is at its goal and at rest."""
        newest = self._motion.record.newest
        rests = now >= newest.end_knot * self._step and self._rounds.sections.is_at_goal(newest.end)
        turn = wrap_angle(self.k_mod.q_final[2] - self.state(now)[2])
        self._orders.note(now, self.is_done or rests and abs(turn) <= HEADING_TOLERANCE)

    @property
    def _is_over(self):
        return self._now - self._orders.mission_start > self.options.t_sup

    def _message(self, now):
        candidate = self.protocol.candidate
        plan = self._motion.plan(now, *([] if candidate is None else [candidate.plan]))
        path = plan.states(np.arange(plan.first_knot, plan.end_knot + 1) * self._step)
        number = self.protocol.in_force.number if candidate is None else candidate.number
        return RobotMsg(
            self.is_done, path[:, 0], path[:, 1], self.state(now)[:2], robot_id=self.eyed,
            boot_epoch=self.protocol.epoch, sequence=self.protocol.next_sequence(), mode=self.mode, plan=plan,
            plan_seq=number, radius=self.limits.radius, v_max=self.limits.v_max, omega_max=self.limits.omega_max,
            a_max=self.limits.a_max, goal=self.k_mod.z_final, links=self.protocol.links(now))
