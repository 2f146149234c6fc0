"""HorizonRobot: a robot that plans by the receding horizon, section by section, at common times.

In the time Tc before a section begins, a robot plans it alone and says so; hears what the others intend; where that
conflicts, plans again among them; and drives it if all who count have granted it. Otherwise it goes on by the section
before, which ends at rest.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields
from time import thread_time

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import GoalOccupied, GoalOutside, InvalidInput, PlanningError, StartOccupied, StartOutside
from mobile_planning.fleet import plan_pairs
from mobile_planning.fleet.bspline import MAX_POINTS, Plan, splice
from mobile_planning.fleet.exchange import Exchange, Peer, gap
from mobile_planning.fleet.horizon_blocks import Collision, Communication
from mobile_planning.fleet.horizon_options import MAX_SPANS, HorizonOptions
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.intention import Intention, SectionRecord
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.joint_request import JointRequest
from mobile_planning.fleet.message import Contracts, Death, Mode, RobotMsg
from mobile_planning.fleet.proved_sections import ProvedSections, path_of
from mobile_planning.fleet.receding_horizon import LATER, Kind, Start
from mobile_planning.fleet.section import Limits
from mobile_planning.fleet.solution import Solution
from mobile_planning.geometry import wrap_angle
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

#: A robot at its goal is done within this of its final heading [rad].
HEADING_TOLERANCE = 0.02
#: Rounds of the exchange in the time of one section: alone, among all, among seniors, and the last word.
_ROUNDS = 4
#: A commit this near to its first knot [s] comes too late.
_GUARD = 0.005
#: Cycles start so long [s] after a round begins.
_PHASE = 2e-3
#: Rooms are short by rounding by no more than this [m].
_ROUNDING = 1e-9


class HorizonRobot:
    """One robot of a fleet that plans by the receding horizon, ``Robot(..., method='receding_horizon')``.

    Parameters
    ----------
    eyed : int
        Robot id; of two the lower is the senior.
    kine_model : UnicycleKineModel
    obstacles : sequence of Obstacle
    phy_boundary : Boundary or None
    neigh : sequence of int
        Peers to stay within ``com_range`` of.
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

    Attributes
    ----------
    eyed, k_mod, rho, neigh
        As given.
    planning_process : None
        The process that plans is the caller's: the simulation's, or that of the node ``robot``.
    sections : list of SectionRecord
    sections_late : int
        Sections that were planned and came too late.

    Raises
    ------
    InvalidInput
        A parameter is out of its range.
    StartOutside, GoalOutside, StartOccupied, GoalOccupied
        The body does not fit there.
    """

    method = 'receding_horizon'
    planning_process = None
    #: It has no sensor for other bodies.
    sensor_range = np.inf
    #: It has no contracts that could break.
    broken: tuple[int, ...] = ()

    def __init__(self, eyed: int, kine_model: UnicycleKineModel, obstacles: Sequence[Obstacle] = (),
                 phy_boundary: Boundary | None = None, neigh: Sequence[int] = (), N_s: int = 20, n_knots: int = 6,
                 t_init: float = 0.0, t_sup: float = 1e10, Tc: float | None = None, Tp: float = 3.0,
                 Td: float | None = None, rho: float = 0.2, detec_rho: float = 3.0, com_range: float = 15.0,
                 def_epsilon: float = 0.5, safe_epsilon: float = 0.1, ls_time_opt_scale: float = 1.0,
                 dist_opt_offset: float = 100.0, ls_min_dist: float = 0.5, *, grid: OccupancyGrid | None = None,
                 margin: float = 0.005, epoch: int = 1, start_time: float = 0.0, solver: str = 'slsqp',
                 patience: float = 10.0):
        self.options = HorizonOptions(
            N_s=N_s, n_knots=n_knots, t_init=t_init, t_sup=t_sup, Tc=1.0 if Tc is None else Tc, Tp=Tp,
            Td=min(3.0, Tp) if Td is None else Td, detec_rho=detec_rho, com_range=com_range, def_epsilon=def_epsilon,
            safe_epsilon=safe_epsilon, ls_time_opt_scale=ls_time_opt_scale, dist_opt_offset=dist_opt_offset,
            ls_min_dist=ls_min_dist, solver=solver)
        if not (0 < rho <= 100 and 0 <= margin <= 10 and epoch >= 1 and patience > 0):
            raise InvalidInput(f'rho {rho} m, margin {margin} m, epoch {epoch} or patience {patience} s is out of '
                               'range: 0 < rho <= 100, 0 <= margin <= 10, epoch >= 1, patience > 0')
        if kine_model.u_init.any() or kine_model.u_final.any():
            raise InvalidInput(f'missions go from rest to rest: u_init {kine_model.u_init} and u_final '
                               f'{kine_model.u_final} must be 0')
        self.eyed, self.k_mod, self.rho, self.neigh = int(eyed), kine_model, float(rho), tuple(neigh)
        self.Tc, self._step, self._knots = self.options.Tc, self.options.step, self.options.knots
        v_max, omega_max = kine_model.u_max
        self.limits = Limits(v_max, kine_model.acc_max[0], omega_max, rho + margin)
        self._margin, self._patience = margin, patience
        _require_reach(self.options, self.limits, self._far)
        self.environment = Environment(phy_boundary, obstacles, grid)
        for name, place, outside, occupied in (('start', kine_model.z_init, StartOutside, StartOccupied),
                                               ('goal', kine_model.z_final, GoalOutside, GoalOccupied)):
            self._require_room(name, place, outside, occupied)
        self._sections = ProvedSections(kine_model, self.environment, self.limits, self.options)
        self._mode, self._is_paused, self.sections, self.sections_late = Mode.WAITING, False, [], 0
        first = Plan.at_rest(int(np.floor(start_time / self._step)), self._step, kine_model.q_init)
        self._plans, self._commits, self._now, self._mission_start = [first], [np.nan], float(start_time), np.inf
        self._is_blocked, self._no_room = False, ''
        self.protocol = Exchange(self.eyed, int(epoch), first, self._are_clear, patience,
                                 self.options.Tp + 2 * self.Tc + 2 * np.pi / omega_max)
        self._target, self._round, self._is_last, self._has_news, self._joining = None, 0, False, False, []

    @property
    def _far(self):
        """Farther than this [m], two robots of this kind cannot meet by plans made now."""
        return 2 * (self.limits.v_max * (self.options.Tp + 2 * self.Tc) + self.limits.radius)

    def restarted(self, epoch: int, now: float) -> HorizonRobot:
        """Return the robot that a new process makes where the body now rests; it knows nothing of the others."""
        model, options = self.k_mod, self.options
        moved = UnicycleKineModel(self.state(now)[:3], model.q_final, u_max=model.u_max, a_max=model.acc_max)
        said = {each.name: getattr(options, each.name) for each in fields(options)}
        settable = {name: said.pop(name) for name in ('acc', 'fs_maxit', 'maxit', 'ls_maxit')}
        robot = HorizonRobot(self.eyed, moved, self.environment.obstacles, self.environment.boundary, self.neigh,
                             rho=self.rho, grid=self.environment.grid, margin=self._margin, epoch=epoch, start_time=now,
                             patience=self._patience, **said)
        for name, value in settable.items():
            robot.set_option(name, value)
        return robot

    def set_option(self, name: str, value: float | None = None) -> None:
        """Set the accuracy ``acc`` or the iterations ``fs_maxit``, ``maxit``, ``ls_maxit`` of first, intermediate and
        last sections; None for the default.

        Raises
        ------
        InvalidInput
            There is no such option, or the value is out of its range.
        """
        self.options = self.options.with_option(name, value)
        self._sections.options = self.options

    # What a mission says

    def join(self, roster: Sequence[int], resting: Mapping[int, tuple[NDArray, float]] | None = None) -> None:
        """Listen to the robots of ``roster``; of those in ``resting`` place and radius are known, see `Robot.join`."""
        self._joining.append((list(roster), dict(resting or {})))

    def start(self, roster: Sequence[int], start_time: float,
              resting: Mapping[int, tuple[NDArray, float]] | None = None) -> None:
        """Drive from ``t_init`` after ``start_time`` [s] on, among the robots of ``roster``."""
        self.join(roster, resting)
        self._mission_start = float(start_time)

    def stop(self) -> None:
        """Finish the plan in force, which ends at rest, and stay there."""
        self._mission_start = np.inf
        self.protocol.drop()
        if not self.is_done:
            self._mode = Mode.STOPPED

    def set_goal(self, q_final: ArrayLike, now: float) -> None:
        """Drive to another goal from ``now`` [s] on, whether the last one was reached or not.

        The section in force stands, and the next one leads to the new goal. A robot that waits, is paused or was
        stopped does so on, and drives to the new goal when it drives again.

        Parameters
        ----------
        q_final : (3,) array_like [m, m, rad]
        now : float [s]

        Raises
        ------
        InvalidInput
            It is not three finite numbers.
        GoalOutside, GoalOccupied
            The body does not fit there. The old goal stands.
        """
        self.k_mod = self._towards(q_final)
        self._now, self._is_last, self._no_room = now, False, ''
        self._sections = ProvedSections(self.k_mod, self.environment, self.limits, self.options)
        self.protocol.drop()
        if self.is_done:
            self._mode = Mode.STOPPED if self._mission_start == np.inf else Mode.DRIVING

    def require_goal(self, q_final: ArrayLike) -> None:
        """Raise what `set_goal` would raise for a goal."""
        self._towards(q_final)

    def follow_path(self, poses: ArrayLike, now: float) -> None:
        """Raise InvalidInput: a section is planned straight to the goal, without a way that could be given."""
        raise InvalidInput(f'robot {self.eyed} plans by {self.method}, which takes goals only and no path; robots that '
                           'plan by contracts take paths')

    def pause(self, now: float) -> None:
        """Drive the section in force to its end, where the robot rests, and stay until `resume`.

        It speaks on and grants what the others intend; to them it has stopped.
        """
        self._now, self._is_paused = now, True
        self.protocol.drop()

    def resume(self, now: float) -> None:
        """Drive on from ``now`` [s] on, if the robot was paused."""
        self._now, self._is_paused = now, False

    def enter(self, environment: Environment, now: float) -> None:
        """Go by another static world from ``now`` [s] on.

        The section in force stands, and the next one is proved in the new world. Where the section in force leads into
        what is occupied by now, `world_trouble` says so; it is driven until the next section begins, which leads
        around or comes to rest, if one can still be proved.

        Parameters
        ----------
        environment : Environment
        now : float [s]
        """
        self._now, self.environment = now, environment
        self._sections = ProvedSections(self.k_mod, environment, self.limits, self.options)
        self.protocol.drop()
        self._is_blocked = not self._sections.is_free(self.plan)
        self._is_last &= not self._is_blocked
        try:
            self.require_goal(self.k_mod.q_final)
            self._no_room = ''
        except PlanningError as error:
            self._no_room = str(error)

    @property
    def world_trouble(self) -> str:
        """Why the robot does not drive on in the world as it is; empty for nothing."""
        blocked = 'the plan in force leads into what is occupied by now' if self._is_blocked else ''
        return '; '.join(filter(None, (blocked, self._no_room)))

    def _towards(self, q_final):
        """Return the model that leads to a goal."""
        made = self.k_mod
        model = UnicycleKineModel(made.q_init, q_final, made.u_init, made.u_final, made.u_max, made.acc_max)
        self._require_room('goal', model.z_final, GoalOutside, GoalOccupied)
        return model

    def _require_room(self, name, place, outside, occupied):
        """Raise an error where the body does not fit at ``place`` (2,) [m]."""
        x_min, y_min, x_max, y_max = self.environment.bounds
        said, need = f'{name} ({place[0]:.3f}, {place[1]:.3f}) of robot {self.eyed}', self.limits.radius
        if not (x_min <= place[0] <= x_max and y_min <= place[1] <= y_max):
            raise outside(f'{said} lies outside the world, x in {x_min:g}..{x_max:g} m, y in {y_min:g}..{y_max:g} m')
        free = float(self.environment.clearance(place[None])[0])
        if free < need - _ROUNDING:
            raise occupied(f'{said} has {free:.3f} m of room, with its margin it needs {need:.3f} m')

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

    def step(self, now: float) -> list[RobotMsg]:
        """Plan and commit what is due at ``now`` [s] and return the messages for all peers."""
        return self.commit(self.plan_section(now), now)

    def take_request(self) -> JointRequest | None:
        """Return None: this method has no joint plans."""

    def propose(self, plan: JointPlan | None, now: float) -> list[JointPlan]:
        """Return nothing to be sent for None; a joint plan raises InvalidInput."""
        if plan is not None:
            raise InvalidInput(f'robot {self.eyed} plans by {self.method}, which has no joint plans')
        return []

    def plan_section(self, now: float) -> Intention:
        """Return what the robot intends in the round at ``now`` [s]; nothing changes until it is committed."""
        self._go_on(now)
        first, number = self._due(now)
        kind = self._kind(first)
        if kind is None or number == _ROUNDS - 1:
            return Intention(first, number)
        began = thread_time()
        found, plan, withdraws = self._planned(kind, first, number)
        return Intention(first, number, plan, withdraws, kind, thread_time() - began, found)

    def commit(self, intention: Intention, now: float) -> list[RobotMsg]:
        """Propose what is intended, put in force what is granted at ``now`` [s]; return the messages for all peers."""
        self._go_on(now)
        self._round = intention.round
        self._note(intention)
        self._drop_what_is_late(now)
        is_open = self._target != intention.first_knot and self._is_in_time(intention.first_knot)
        if is_open and self._mission_start < np.inf and not self._is_paused:
            if intention.new is not None:
                self.protocol.propose(intention.new)
            elif intention.withdraws:
                self.protocol.drop()
        self._settle(now)
        self._update_mode(now)
        return [self._message(now)]

    @property
    def has_answers(self) -> bool:
        """Whether `answers` may have something to send."""
        return self._has_news and self._may_grant

    def answers(self, now: float) -> list[RobotMsg]:
        """Return what is to be said at ``now`` [s] before the next step: grants, and that a section is driven."""
        self._go_on(now)
        candidate, in_force = self.protocol.candidate, self.protocol.in_force
        self._drop_what_is_late(now)
        has_granted = self._settle(now)
        is_news = has_granted or (candidate, in_force) != (self.protocol.candidate, self.protocol.in_force)
        return [self._message(now)] if is_news else []

    def observe(self, seen: Mapping[int, tuple[NDArray, float]], now: float) -> None:
        """Take in what a presence sensor sees: nothing, this robot has none."""

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
        return self.k_mod.q_final

    @property
    def held_up(self) -> HoldUp | None:
        """Since when a robot that is to drive stands, and who has not granted what it intends; None if it goes on."""
        since = max(self._plans[-1].end_knot * self._step, self._mission_start + self.options.t_init + self.Tc)
        if self.mode is not Mode.DRIVING or self._now <= since:
            return None
        return HoldUp(since, Reason.STALLED, tuple(sorted(self.protocol.forbidding(self._now, True))))

    @property
    def plan(self) -> Plan:
        """The plan in force, from the knot that is being driven on."""
        return splice(self._plans[-2:], max(self._knot, self._plans[-2:][0].first_knot))

    @property
    def cycle(self) -> float:
        """Time [s] between two calls of `step`: a round of the exchange."""
        return self.Tc / _ROUNDS

    @property
    def phase(self) -> float:
        """Where within Tc [s] a cycle starts best."""
        return _PHASE

    def until_cycle(self, now: float) -> float:
        """Return how long [s] after a cycle at ``now`` [s] the next one starts best, half a cycle at least."""
        wait = float((_PHASE - now) % self.cycle)
        return wait if wait >= self.cycle / 2 else wait + self.cycle

    @property
    def sol(self) -> Solution:
        """What was driven so far: the plans, and samples ``t``, ``x``, ``y``, ``theta``, ``v``, ``omega`` (N,)."""
        return Solution(self.eyed, tuple(self._plans), self.is_done, tuple(self.ctime), commits=tuple(self._commits))

    @property
    def rtime(self) -> NDArray[np.float64]:
        """Sample times (N,) [s] of `sol` from the first knot on, never more than 0.01 s apart."""
        return self.sol.t

    @property
    def ctime(self) -> list[float]:
        """Time [s] to plan each section, in all rounds."""
        return [record.seconds for record in self.sections]

    def state(self, now: float) -> NDArray[np.float64]:
        """Return x, y, theta, v, omega (5,) at ``now`` [s] by the plan in force."""
        return self._plan_at(now / self._step).state(now)

    def heard(self) -> dict[int, RobotMsg]:
        """Return the newest message of each peer heard."""
        return self.protocol.heard

    @property
    def ignored(self) -> int:
        """Messages that were own, stale or of robots outside the mission."""
        return self.protocol.ignored

    # How a section is planned

    def _due(self, now):
        """Return the first knot of the next section, and the round of its exchange."""
        passed = now / self.Tc + 1e-9
        section = int(np.floor(passed))
        return (section + 1) * self._knots, min(int((passed - section) * _ROUNDS), _ROUNDS - 1)

    def _kind(self, first):
        """Return which section begins at the knot ``first``; None for none."""
        since = first * self._step - self._mission_start
        if (since < self.options.t_init - 1e-9 or since > self.options.t_sup or self._target == first or self.is_done
                or self._is_last or self._is_paused):
            return None
        left = np.linalg.norm(self.k_mod.z_final - self._start(first).motion(self._step)[0])
        if left < self.options.ls_min_dist + self.Tc * self.limits.v_max:
            return Kind.LAST
        return Kind.FIRST if len(self._plans) == 1 else Kind.INTERMEDIATE

    def _planned(self, kind, first, number):
        """Return outcome, plan and whether to withdraw the candidate, in the round ``number``."""
        candidate, options = self.protocol.candidate, self.options
        if candidate is not None and candidate.plan.first_knot != first:
            candidate = None                                        # of a section that was missed

        def find(blocks, duration, heeded):
            return self._sections.find(kind, first, self._start(first), self.state(self._now)[:2], blocks, duration,
                                       lambda plan: self._is_clear(plan, heeded))
        if number == 0 or candidate is None and number == 1:
            return *find([], options.Tp, ()), True
        allowed = list(self.protocol.allowed())
        heeded = allowed + [(other, plan) for other, plan in self.protocol.requests()
                            if number == 1 or self.protocol.is_senior(other)]
        if candidate is not None and self._is_clear(candidate.plan, heeded):
            return None, None, False
        blocks = self._blocks(first, heeded)
        if number == 1:
            # What others intend they may plan again, so that only what they may drive already must be clear.
            blocks.append(Communication(path_of(candidate.plan, first * self._step), options.def_epsilon))
            return *find(blocks, options.Td, allowed), False
        return *find(blocks, options.Td, heeded), True

    def _start(self, first):
        plan = self._plan_at(first)
        knot = max(first, plan.first_knot)
        return Start(plan.control(knot, 3), float(plan.state(first * self._step)[2]),
                     max(0.0, first * self._step - self._mission_start))

    def _blocks(self, first, heeded):
        """Return the blocks of collision and communication for the plans ``heeded``, as far as they may matter."""
        here, blocks, options = self._start(first).points[1], [], self.options
        for other, plan in heeded:
            path = path_of(plan, first * self._step)
            away = float(np.linalg.norm(path(np.zeros(1))[0][0] - here))
            need, moves = self._need(other), np.ptp(plan.points, axis=0).any()
            if away <= need + (2 if moves else 1) * self.limits.v_max * options.Tp:
                blocks.append(Collision(path, min(need + options.safe_epsilon, max(need, away - 1e-3))))
            if other in self.neigh and away + 2 * self.limits.v_max * options.Tp >= options.com_range:
                blocks.append(Communication(path, options.com_range - options.safe_epsilon))
        return blocks

    # How it is agreed upon

    def _go_on(self, now):
        """Take ``now`` [s] for the present; patience with those to be listened to begins when the robot itself runs."""
        self._now = now
        for roster, resting in self._joining:
            self.protocol.join(roster, resting, now)
        self._joining.clear()

    def _need(self, other):
        return self.limits.radius + self.protocol.peers[other].radius

    def _is_clear(self, plan, others):
        return all(self._are_clear(plan, other, theirs) for other, theirs in others)

    def _are_clear(self, own, other, theirs):
        knot = self._knot
        if not plan_pairs.stay_apart(own, theirs, knot, self._need(other)):
            return False
        return other not in self.neigh or plan_pairs.stay_within(own, theirs, knot, self.options.com_range)

    @property
    def _may_grant(self):
        """Whether the robot has said its own intention of this section, or has none."""
        return self._round > 0 or self._is_last or self.mode is not Mode.DRIVING

    def _settle(self, now):
        """Grant what may be granted, and drive what all have granted; return whether anything was granted."""
        self._has_news = False
        has_granted = self._may_grant and self.protocol.grant()
        candidate = self.protocol.candidate
        if candidate is not None and self._is_in_time(candidate.plan.first_knot):
            plan = self.protocol.take(now, self._is_far)
            if plan is not None:
                self._plans.append(plan)
                self._commits.append(float(now))
                self._is_blocked = False
                self._target, self._is_last = plan.first_knot, bool(np.isfinite(plan.final_heading))
        return has_granted

    def _is_far(self, peer: Peer) -> bool:
        return gap(self.state(self._now)[:2], peer, self._now) > self._far

    def _is_in_time(self, first):
        return self._now <= first * self._step - _GUARD

    def _drop_what_is_late(self, now):
        candidate = self.protocol.candidate
        if candidate is not None and not self._is_in_time(candidate.plan.first_knot):
            self.sections_late += 1
            self.protocol.drop()

    def _note(self, intention):
        if intention.found is None:
            return
        if intention.round == 0 or not self.sections:
            self.sections.append(SectionRecord(intention.kind))
        record = self.sections[-1]
        record.seconds += intention.seconds
        record.solves += intention.found.solves
        record.infeasible += intention.found.infeasible
        record.refused += intention.new is None

    def _update_mode(self, now):
        since = now - self._mission_start
        if since < 0 or self.is_done:
            return
        self._mode = Mode.DRIVING if since <= self.options.t_sup else Mode.STOPPED
        if self._sections.is_at_goal(self._plans[-1].end) and now >= self._plans[-1].end_knot * self._step:
            turn = wrap_angle(self.k_mod.q_final[2] - self.state(now)[2])
            if abs(turn) <= HEADING_TOLERANCE:
                self._mode = Mode.DONE

    @property
    def _knot(self):
        return int(np.floor(self._now / self._step + 1e-9))

    def _plan_at(self, knot):
        """Return which of the plans drives at ``knot``: the last that has started, or the first."""
        return next((plan for plan in reversed(self._plans) if plan.first_knot <= knot), self._plans[0])

    def _message(self, now):
        candidate, plans = self.protocol.candidate, self._plans[-2:]
        if candidate is not None:
            plans = [*plans, candidate.plan]
        plan = splice(plans, max(self._knot, plans[0].first_knot))
        path = plan.states(np.arange(plan.first_knot, plan.end_knot + 1) * self._step)
        number = self.protocol.in_force.number if candidate is None else candidate.number
        return RobotMsg(
            self.is_done, path[:, 0], path[:, 1], self.state(now)[:2], robot_id=self.eyed,
            boot_epoch=self.protocol.epoch, sequence=self.protocol.next_sequence(), mode=self.mode, plan=plan,
            plan_seq=number, radius=self.limits.radius, v_max=self.limits.v_max, omega_max=self.limits.omega_max,
            a_max=self.limits.a_max, goal=self.k_mod.z_final, links=self.protocol.links(now))


def _require_reach(options, limits, far):
    """Raise InvalidInput where the robot could be surprised by what it does not see or hear in time."""
    stopping = limits.v_max * 2 * options.Tc + limits.v_max**2 / (2 * limits.a_max) + limits.radius
    if options.detec_rho < stopping:
        raise InvalidInput(f'detec_rho {options.detec_rho} m is below {stopping:.3f} m, which the robot drives in '
                           '2 Tc and needs to stop')
    # A turn before a section leaves it time, and what is said of it fits into a message.
    turn = int(np.ceil(np.pi / (limits.omega_max * options.step))) + 1
    spare = min(options.spans(options.Td) - options.n_knots, (MAX_POINTS - MAX_SPANS - LATER - options.knots - 5) // 2)
    if turn > spare:
        raise InvalidInput(f'omega_max {limits.omega_max} rad/s needs {turn * options.step:.2f} s to turn about; '
                           f'with Tc {options.Tc} s and Td {options.Td} s there are {spare * options.step:.2f} s')
    if options.com_range < far:
        raise InvalidInput(f'com_range {options.com_range} m is below {far:.3f} m, within which two robots of this '
                           'kind can meet before they hear each other again')
