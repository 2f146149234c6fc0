"""Mission: who drives, from when, and when it is over; the world sim's side of it.

No ROS, no clock: times are passed in. ``now`` [s] is a clock that nobody sets, for waiting; ``time`` [s] is the common
clock of the robots, on which the mission starts.
"""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.hold_up import Reason
from mobile_planning.fleet.message import Death, RobotMsg
from mobile_planning.fleet.mission_account import Account
from mobile_planning.fleet.postscript import Postscript
from mobile_planning.fleet.report import Body, Report
from mobile_planning.fleet.roll_call import RollCall
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.succession import SAME_PLACE
from mobile_planning.world.environment import Environment

#: The mission starts this long after its announcement [s]; solutions are waited for so long after its end [s].
LEAD, PATIENCE = 0.5, 3.0
#: A plan may reach so far beyond the timeout [s].
_LONGEST_PLAN = 100.0
#: Nobody is declared dead who has spoken so lately [s]: its body may move as long as a plan lasts.
_QUIET = 5.0


class Mission:
    """Gathers the robots, starts them together, collects what they drove, and knows when it is over.

    Robots may die on their way and start anew: the mission goes on. So may its own process: it finds the robots on
    their way and takes the mission up again.

    Parameters
    ----------
    name : str
    robot_ids : sequence of int
    timeout : float [s]
        The mission ends so long after its start at the latest.
    discovery_timeout : float [s]
        It fails when the robots are not ready so long after the start was wanted.
    autostart : bool
        The start is wanted from the beginning; else from `start` on.
    now : float [s]

    Attributes
    ----------
    state : State
    start_time : float [s]
        On the common clock; 0 before the mission is started.
    why : str
        Why it ended; empty before.
    solutions : dict of int to Solution
    deaths : dict of int to Death
        Certificates, by robot id.
    """

    def __init__(self, name: str, robot_ids: Sequence[int], timeout: float, discovery_timeout: float = 60.0, *,
                 autostart: bool = True, now: float = 0.0):
        self.name, self.robot_ids = str(name), tuple(robot_ids)
        self.state, self.start_time, self.why = State.WAITING, 0.0, ''
        self.solutions: dict[int, Solution] = {}
        self._timeout, self._discovery_timeout = timeout, discovery_timeout
        self._wanted_since = now if autostart else None
        self._ended: float | None = None
        self._roll = RollCall(self.robot_ids)
        self._last: list[tuple[RobotMsg, Postscript]] = []
        self._epochs: dict[int, set[int]] = {}
        self.deaths: dict[int, Death] = {}
        self._left_out: dict[int, str] = {}

    @property
    def announcement(self) -> Announcement:
        """What the robots are to be told."""
        return Announcement(self.name, self.state, self.robot_ids, self.start_time,
                            tuple(sorted(self._left_out)))

    @property
    def heard(self) -> dict[int, RobotMsg]:
        """The newest message of each robot."""
        return self._roll.heard

    @property
    def is_complete(self) -> bool:
        """Whether all robots say that they are at their goals."""
        return self._have_arrived(self.robot_ids)

    def _have_arrived(self, robot_ids):
        return all(robot_id in self.solutions and self.solutions[robot_id].done for robot_id in robot_ids)

    # What goes in

    def hear(self, message: RobotMsg, now: float, postscript: Postscript = Postscript()) -> None:
        """Take in what a robot says, and tells beside it.

        A robot that was started anew takes part again, if its body is where its last plan has led it: the last that
        was heard of it, or one that it has written down and nobody has heard. Else the mission goes on without it.
        """
        robot_id = message.robot_id
        known = self.heard.get(robot_id)
        if not self._roll.hear(message, postscript, now):
            return
        if self.state is State.WAITING:
            hears_all = set(message.links) | {robot_id} == set(self.robot_ids)
            if postscript.mission_start > 0.0 and hears_all and not self.why:
                self._take_up(postscript.mission_start)
        elif not self.why and message.boot_epoch not in self._epochs.setdefault(robot_id, set()):
            is_new = bool(self._epochs[robot_id])
            self._epochs[robot_id].add(message.boot_epoch)
            self.deaths.pop(robot_id, None)
            self.solutions.pop(robot_id, None)
            if is_new and known is not None and not postscript.is_where_left:
                self._note_place(robot_id, known.plan.end, message.plan.points[0])
        elif not self.why and postscript.held_up is not None and postscript.held_up.reason is Reason.LEFT_OUT:
            # By the process that this one succeeds.
            self._left_out.setdefault(robot_id, f'robot {robot_id} was started anew elsewhere than its last plan has '
                                                'led it: it was left out')
            self.solutions.pop(robot_id, None)

    def _note_place(self, robot_id, left, found):
        """Leave a robot out whose body was not found where its last plan has left it."""
        if np.linalg.norm(found - left) > SAME_PLACE:
            self._left_out[robot_id] = (f'robot {robot_id} was started anew at ({found[0]:.2f}, {found[1]:.2f}), its '
                                        f'last plan ended at ({left[0]:.2f}, {left[1]:.2f}): it was left out')

    def _take_up(self, start):
        """Go on with a mission that another process has started."""
        self.state, self.start_time = State.STARTED, start
        self._epochs = {robot_id: {message.boot_epoch} for robot_id, message in self.heard.items()}

    def collect(self, solution: Solution, epoch: int) -> None:
        """Take in what a robot has driven; what it drove in another mission is passed over.

        Raises
        ------
        InvalidInput
            The robot moved before the start, or moves long after the end of the mission.
        """
        if solution.eyed in self._left_out:
            return
        if epoch not in self._epochs.get(solution.eyed, ()) or solution.eyed in self.heard and (
                epoch < self.heard[solution.eyed].boot_epoch):
            return
        latest = self.start_time + self._timeout + _LONGEST_PLAN
        end = max(plan.end_knot * plan.step for plan in solution.plans)
        if end > latest:
            raise InvalidInput(f'robot {solution.eyed} says that it drives until {end:.1f} s, '
                               f'the mission ends before {latest:.1f} s')
        self.solutions[solution.eyed] = self._since_start(solution)

    def start(self, now: float) -> None:
        """Want the start, which comes when every robot hears every other.

        Raises
        ------
        InvalidInput
            The mission has started, or is over.
        """
        if self.state is not State.WAITING or self.why:
            raise InvalidInput(f'mission {self.name} has been started already')
        self._wanted_since = now

    def stop(self, why: str, now: float) -> None:
        """End the mission.

        Raises
        ------
        InvalidInput
            The mission is over.
        """
        if self.why:
            raise InvalidInput(f'mission {self.name} is over: {self.why}')
        self._end(why, now)

    def pause(self) -> None:
        """Let all robots come to rest and wait.

        Raises
        ------
        InvalidInput
            They do not drive.
        """
        self._require(State.STARTED)
        self.state = State.PAUSED

    def resume(self) -> None:
        """Let all robots drive on.

        Raises
        ------
        InvalidInput
            They are not paused.
        """
        self._require(State.PAUSED)
        self.state = State.STARTED

    def _require(self, state):
        if self.state is not state:
            raise InvalidInput(f'mission {self.name} is {self.state.name.lower()}, not {state.name.lower()}')

    def declare_dead(self, robot_id: int, place: ArrayLike | None, now: float, time: float) -> Death:
        """Vouch that no process of a robot lives and that its body rests, and return the certificate.

        Parameters
        ----------
        robot_id : int
        place : (2,) array_like [m] or None
            Of its body; None for where the last plan ends that was heard of it. A plan that nobody heard leads
            elsewhere: who does not see the body should be sure that there was none.
        now, time : float [s]

        Raises
        ------
        InvalidInput
            The robot is not of this mission, was never heard, or speaks.
        """
        heard = self.heard
        if robot_id not in heard:
            raise InvalidInput(f'robot {robot_id} was never heard: heard are {sorted(heard)}')
        message, age = heard[robot_id], self._roll.age(robot_id, now)
        if age < _QUIET:
            raise InvalidInput(f'robot {robot_id} has spoken {age:.1f} s ago: its body may move for {_QUIET:g} s')
        place = message.plan.end if place is None else np.asarray(place, float)
        self.deaths[robot_id] = Death(robot_id, message.boot_epoch, place, time, message.radius)
        return self.deaths[robot_id]

    def step(self, now: float, time: float) -> None:
        """Start the mission or end it, if it is time to."""
        if self.why:
            return
        if self.state is State.WAITING:
            self._gather(now, time)
        elif self.is_complete:
            self._end('all robots are at their goals', now)
        elif (gone := set(self.deaths) | set(self._left_out)) and self._have_arrived(set(self.robot_ids) - gone):
            those = ' and '.join(f'those that {what}, {sorted(which)}' for what, which in (
                ('died', self.deaths), ('were left out', self._left_out)) if which)
            self._end(f'all robots are at their goals but {those}', now)
        elif time > self.start_time + self._timeout:
            self._end(f'it was not finished within {self._timeout:g} s', now)

    # What can be asked

    def is_over(self, now: float) -> bool:
        """Whether the mission has ended, and no solution is worth waiting for any more."""
        return self._ended is not None and (
            not self._epochs or len(self.solutions) == len(self.robot_ids) or now > self._ended + PATIENCE)

    def silent(self, now: float) -> list[int]:
        """Return the robots that are not heard, or not any more."""
        return self._roll.silent(now)

    def lack(self, now: float) -> str:
        """Return what keeps the mission from starting, empty for nothing."""
        return self._roll.lack(now)

    def report(self, bodies: Sequence[Body], environment: Environment) -> Report:
        """Return what the mission came to; why it ended is a violation too, unless it is complete."""
        account = Account(
            name=self.name, start_time=self.start_time, why=self.why, is_complete=self.is_complete,
            was_started=bool(self._epochs), heard=self.heard, silent=self.silent(self._ended or 0.0), last=self._last,
            solutions=self.solutions, deaths=self.deaths, left_out=list(self._left_out.values()))
        return account.report(bodies, environment)

    # How it works

    def _gather(self, now, time):
        if self._wanted_since is None:
            return
        lack = self.lack(now)
        if not lack:
            self.state, self.start_time = State.STARTED, time + LEAD
            self._epochs = {robot_id: {message.boot_epoch} for robot_id, message in self.heard.items()}
        elif now > self._wanted_since + self._discovery_timeout:
            # It never was these robots' mission: nobody is told to stop.
            self.why, self._ended = f'after {self._discovery_timeout:g} s {lack}', now

    def _since_start(self, solution):
        """Return the solution without what came before the start: the robot may have stood and waited for days."""
        solution = replace(solution, start_time=self.start_time)
        first, *later = solution.plans
        knot = int(np.floor(self.start_time / first.step))
        if first.first_knot >= knot:
            return solution
        if first.end_knot > knot or any(plan.first_knot < knot for plan in later):
            raise InvalidInput(f'robot {solution.eyed} says that it moved before the mission started')
        heading = first.state(knot * first.step)[2]
        return replace(solution, plans=(Plan.at_rest(knot, first.step, (*first.end, heading)), *later))

    def _end(self, why, now):
        self.state, self.why, self._ended = State.STOPPED, why, now
        # What they say once they are told to stop is another thing.
        self._last = [(message, postscript) for message, postscript in self._roll.present(now)
                      if message.robot_id not in self.deaths and not message.dp]
