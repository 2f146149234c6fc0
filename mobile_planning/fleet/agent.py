"""Agent: a robot that exists once its map and its place are known, and its part in a mission.

Its robot plans in one thread and hears in another. Whoever finds it busy does not wait: what is said to it then is
taken in before it plans the next time.
"""
from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.fleet.announcement import Announcement
from mobile_planning.fleet.enlistment import Enlistment
from mobile_planning.fleet.goal_request import GoalRequest, Outlook
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.itinerary import How
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.joint_request import GroundRequest, JointRequest
from mobile_planning.fleet.journey import Journey
from mobile_planning.fleet.logbook import Entry, Logbook
from mobile_planning.fleet.message import Contracts, Mode, RobotMsg
from mobile_planning.fleet.postscript import Postscript
from mobile_planning.fleet.premises import Premises
from mobile_planning.fleet.reception import Message, Reception
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.scene import Scene
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.succession import Succession
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

#: Between two looks for a robot [s], as long as there is none.
_UNKNOWN = 0.1
#: Robots of one fleet begin their cycles so long after each other [s], as far as there is room for it.
_APART = 0.012
#: Sections that come later than by this share of a cycle leave no time for more than one.
_PRESSED = 0.25


class Agent:
    """One robot of a scene, made when the map comes, that takes part in the first mission that starts.

    A mission that has started binds the robot: its peers know where it is and go by its contracts. So missions that
    come later are refused.

    `receive`, `has_answers` and `answers` never wait; all other methods may, for as long as a section takes.

    Parameters
    ----------
    scene : Scene
    robot_id : int
    epoch : int
        Grows with each start of the robot's process.
    now : float [s]
        On the common clock of the robots.
    drive : callable, optional
        Called with each plan that is put in force, before anybody is told of it.
    book : Logbook, optional
        Of the robot; what the processes before have written into it is gone on from.
    is_placed : bool
        Whether the body is where the scene says; else the robot waits for `place`.
    plans_kept : int
        So many of its newest plans are there for the judge: at four a second those of half an hour.
    **options
        For `Robot`.

    Attributes
    ----------
    robot : Robot or None
        None while the map or the place is unknown, or not fit.
    epoch : int
        Of the robot; grows with each robot that is made for another map.
    journey : Journey
        Its goals, and what has become of them.
    postscript : Postscript
        As of the last step: what is to be told beside what the robot says.

    Raises
    ------
    PlanningError
        The scene has no such robot, or no map and no room for it.
    """

    def __init__(self, scene: Scene, robot_id: int, epoch: int, now: float, *,
                 drive: Callable[[Entry], None] = lambda entry: None, book: Logbook = Logbook(),
                 is_placed: bool = True, plans_kept: int = 8000, **options):
        self._premises = Premises(scene, robot_id, is_placed, **options)
        self.robot: Robot | None = None
        self.epoch, self._id = int(epoch), robot_id
        self.journey, self.postscript = Journey(robot_id, scene.errands()), Postscript()
        self._succession, self._enlistment = Succession(book, drive, plans_kept), Enlistment(robot_id)
        self._reception, self._turn = Reception(robot_id), threading.RLock()
        self._problem = self._world_trouble = ''
        self._make(now)

    # What can be asked

    @property
    def robot_id(self) -> int:
        """The robot's id."""
        return self._id

    @property
    def method(self) -> str:
        """By which it plans."""
        return self._premises.method

    @property
    def trouble(self) -> str:
        """Why the robot does not drive on; empty if nothing keeps it."""
        if self.robot is None:
            return self._problem or self._premises.lacking
        return '; '.join([*self._enlistment.reasons, *filter(None, [self.journey.trouble, self._world_trouble])])

    @property
    def is_finished(self) -> bool:
        """Whether the robot has driven its mission: it is done, or was stopped."""
        return self.robot is not None and (self.journey.is_over or self.is_stopped)

    @property
    def is_left_out(self) -> bool:
        """Whether the mission goes on without it, for nobody knows where its body is."""
        return self._enlistment.is_left_out

    @property
    def is_stopped(self) -> bool:
        """Whether its mission was stopped."""
        return self._enlistment.is_stopped

    @property
    def solution(self) -> Solution:
        """What the body has driven under all processes, and the goals that it was given; there must be a robot."""
        return self._succession.solution(self.journey, self.robot, self.mission_start)

    @property
    def mission_start(self) -> float:
        """When the mission began that the robot drives [s]; 0 for none."""
        return self._enlistment.start if self._has_started else 0.0

    @property
    def roster(self) -> tuple[int, ...]:
        """Everybody who takes part in the mission, as far as one is known."""
        return self._enlistment.roster

    @property
    def has_answers(self) -> bool:
        """Whether `answers` has something to send, as far as can be told without waiting."""
        if self.robot is None or not self._turn.acquire(blocking=False):
            return False
        try:
            return self.robot.has_answers
        finally:
            self._turn.release()

    def is_at_rest(self, now: float) -> bool:
        """Whether the plan in force has been driven to its end at ``now`` [s]."""
        return self.robot is None or now >= self.robot.plan.end_knot * self.robot.plan.step

    def distance_left(self, now: float) -> float:
        """Return how far [m] it is to the goal at hand at ``now`` [s]; 0 without one."""
        with self._turn:
            return 0.0 if self.robot is None else self.robot.distance_left(now)

    def note_pace(self, seconds: float) -> None:
        """Take in how long [s] after it was due the last section came: who can hardly keep up plans once a cycle."""
        if self.robot is not None:
            self.robot.is_pressed = seconds > _PRESSED * self.robot.Tc

    def until_cycle(self, now: float) -> float:
        """Return how long [s] after `step` at ``now`` [s] the next one is best.

        That is just in time for a knot, earlier by what this robot's place in the roster says: robots that share a
        processor do not all plan at one instant.
        """
        if self.robot is None:
            return _UNKNOWN
        # By turns for the knots of a cycle, and for each of them one after the other.
        roster, period = self.roster or (self._id,), self.robot.Tc / 2
        knots = 1 if self.robot.cycle == period else 2
        rank = sorted(roster).index(self._id) if self._id in roster else 0
        apart = min(_APART, period / (len(roster) // knots + 1))
        return self.robot.until_cycle(now + rank % knots * period + rank // knots * apart)

    # What is told

    def place(self, pose: ArrayLike, now: float) -> None:
        """Take the body to rest at ``pose`` (3,) [m, m, rad], wherever the scene says that it starts.

        Raises
        ------
        InvalidInput
            The robot exists, or the pose is none.
        PlanningError
            It has no room there, or no way to its goal.
        """
        with self._turn:
            if self.robot is not None:
                raise InvalidInput(f'robot {self._id} has a place already')
            self._premises.place(pose)
            self._make(now)

    def take_map(self, grid: OccupancyGrid, now: float) -> None:
        """Drive on the map ``grid`` from ``now`` [s] on.

        Before the mission has started that is a new robot. On the way the plan in force and the contracts stand; where
        the plan leads into cells that are occupied by now the robot brakes, see `Robot.enter`.

        Raises
        ------
        PlanningError
            There is no robot yet, and there it has no room, or no way to its goal.
        """
        with self._turn:
            if grid == self._premises.grid:
                return
            self._premises.grid = grid
            if self._has_started:
                self._enter(now)
                return
            if self.robot is not None:
                # Peers take messages that count from one again for old ones, unless the epoch is new.
                self.epoch += 1
            self._make(now)

    def take_obstacles(self, obstacles: Sequence[Obstacle], now: float) -> None:
        """Drive among ``obstacles``, beside those of the scene and the map, from ``now`` [s] on; see `take_map`."""
        with self._turn:
            self._premises.obstacles = tuple(obstacles)
            if self.robot is not None:
                self._enter(now)

    def follow(self, announcement: Announcement, now: float) -> None:
        """Do what is announced.

        Raises
        ------
        InvalidInput
            It is of another mission than the one that has started.
        """
        with self._turn:
            if self._enlistment.follow(announcement, self.robot, now):
                self._succession.resume(self.journey, self.robot, self.mission_start, now)

    def hold(self, reason: str, sentence: str, now: float) -> None:
        """Let the robot come to rest, and stay until `release` of every ``reason``."""
        with self._turn:
            self._enlistment.hold(reason, sentence, self.robot, now)

    def release(self, reason: str, now: float) -> None:
        """Let the robot drive on, if nothing else holds it."""
        with self._turn:
            self._enlistment.release(reason, self.robot, now)

    def set_goals(self, goals: Sequence[ArrayLike], how: How, now: float) -> int:
        """Drive to ``goals``, (3,) [m, m, rad] each, and return the number of this order; see `Journey.set_goals`.

        A robot that was told to `withdraw` its last goal drives again.

        Raises
        ------
        InvalidInput
            There is no robot yet.
        """
        with self._turn:
            if self.robot is None:
                raise InvalidInput(f'robot {self._id} takes no goal yet: {self.trouble}')
            self.journey.set_goals(self.robot, goals, how, now)
            self._note_stage()
            self.release('goal withdrawn', now)
            return self.journey.orders

    def follow_path(self, poses: ArrayLike, now: float) -> None:
        """Drive along a path (N, 3) [m, m, rad] from elsewhere to its end; see `Journey.follow_path`.

        Raises
        ------
        InvalidInput
            There is no robot yet.
        """
        with self._turn:
            if self.robot is None:
                raise InvalidInput(f'robot {self._id} takes no path yet: {self.trouble}')
            self.journey.follow_path(self.robot, poses, now)
            self._note_stage()
            self.release('goal withdrawn', now)

    def withdraw(self, order: int, now: float) -> None:
        """Come to rest if the goal of that order is still driven to, and stay until the next order."""
        with self._turn:
            if order == self.journey.orders:
                self.hold('goal withdrawn', 'its goal was withdrawn', now)

    def receive(self, message: Message, now: float) -> None:
        """Take in what a robot, or somebody who vouches for its death, says.

        Raises
        ------
        InvalidInput
            It comes from another process of this robot, or from a robot that plans by another method.
        """
        if not self._reception.admits(message, self.robot, self.epoch, now):
            return
        if not self._turn.acquire(blocking=False):
            self._reception.keep(message, now)
            return
        try:
            self._reception.hand_on(self.robot)
            self.robot.receive(message, now)
        finally:
            self._turn.release()

    def expect_losses(self, are_any: bool) -> None:
        """Take in whether messages get lost on their way; see `Robot.expect_losses`."""
        with self._turn:
            if self.robot is not None:
                self.robot.expect_losses(are_any)

    def answers(self, now: float) -> list[Contracts]:
        """Return what to tell the others at ``now`` [s] before the next step; nothing while the robot is busy."""
        if self.robot is None or not self._turn.acquire(blocking=False):
            return []
        try:
            messages = self.robot.answers(now)
            # A section is put in force, by the receding horizon, as soon as the last grant is heard.
            self._succession.hand_over(self.robot, self.epoch)
            return messages
        finally:
            self._turn.release()

    def step(self, clock: Callable[[], float]) -> list[RobotMsg | Contracts | JointPlan]:
        """Return what to tell the others, having planned where that is due.

        Parameters
        ----------
        clock : callable
            Returns the common time [s]; read again after planning, for a section may come too late.
        """
        with self._turn:
            if self.robot is None:
                return []
            self._reception.hand_on(self.robot)
            section, now = self.robot.plan_section(clock()), clock()
            if self._reception.has_elder_twin(now):
                section = replace(section, new=None)
            messages = self.robot.commit(section, now)
            self._succession.hand_over(self.robot, self.epoch)
            self.journey.go_on(self.robot, now, self.mission_start)
            self._note_stage()
            self._world_trouble = self.robot.world_trouble
            self.postscript = self._postscript(now)
            return messages

    def take_request(self) -> GoalRequest | JointRequest | GroundRequest | None:
        """Return the request for the way to the next goal or for a joint plan that has fallen due, if any, once.

        ``request.plan()`` may be called in any thread, while the agent goes on; its answer goes to `propose`.
        """
        with self._turn:
            if self.robot is None:
                return None
            return self.journey.take_request(self.robot) or self.robot.take_request()

    def propose(self, plan: Outlook | JointPlan | None, now: float) -> list[JointPlan]:
        """Put in force at ``now`` [s] the answer to a request; return what is to be sent."""
        with self._turn:
            if self.robot is None:
                return []
            if isinstance(plan, Outlook):
                self.journey.set_out(self.robot, plan, now)
                self._note_stage()
                return []
            return self.robot.propose(plan, now)

    # How it works

    def _note_stage(self):
        """Write down how far the robot is with its goals, if that is new."""
        # Where it drives next is not settled between two goals: another process begins at the one it has reached.
        if self._has_started and not self.journey.is_between_goals:
            self._succession.note(self.journey, self.robot, self.mission_start)

    def _postscript(self, now):
        robot = self.robot
        has_set_out = robot.mode is not Mode.STOPPED and now >= self.mission_start > 0.0 and not robot.is_done
        lacking = tuple(robot.protocol.forbidding(now, True)) if has_set_out else ()
        held_up = HoldUp(self.mission_start, Reason.LEFT_OUT) if self.is_left_out else robot.held_up
        return Postscript(self.mission_start, self.journey.itinerary.reached, without_word_of=lacking,
                          held_up=held_up, is_where_left=self._succession.is_where_left)

    @property
    def _has_started(self):
        """Whether a mission with this robot was started."""
        return self.robot is not None and self._enlistment.has_started

    def _enter(self, now):
        """Let the robot go by the world as it is by now."""
        self.robot.enter(self._premises.environment, now)
        self._world_trouble = self.robot.world_trouble

    def _make(self, now):
        """Make the robot, if all is known that it takes."""
        if self._premises.lacking:
            return
        try:
            self.robot = self._premises.robot(self.epoch, now)
        except PlanningError as error:
            self.robot, self._problem = None, str(error)
            raise
        self._problem = ''
        self._succession.hand_over(self.robot, self.epoch)
        if self._enlistment.enter(self.robot, now):
            self._succession.resume(self.journey, self.robot, self.mission_start, now)
