"""Robot: one agent that plans its own trajectory among others, section by section; what it promises by any method.

A pure object: time is passed in, messages go in by ``receive`` and out of
``step`` and ``answers``. The same robot runs in logical time in ``WorldSim``
and in real time behind the ROS node.
"""
from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.hold_up import HoldUp
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.joint_request import GroundRequest, JointRequest
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.message import Contracts, Death, Mode, RobotMsg
from mobile_planning.fleet.orders import Orders
from mobile_planning.fleet.section import Limits
from mobile_planning.fleet.solution import Solution
from mobile_planning.world.environment import Environment

#: What robots say.
Message = RobotMsg | Contracts | JointPlan


class Robot(ABC):
    """One robot of a fleet.

    Parameters
    ----------
    eyed : int
        Robot id; of two robots the lower goes before.
    kine_model : UnicycleKineModel
        Start, goal and limits.
    obstacles : sequence of Obstacle
    phy_boundary : Boundary or None
    neigh : sequence of int
        Peers to stay within ``com_range`` of; every robot of the mission is avoided, named here or not.
    method : str
        ``'contracts'``: the robot is a `ContractRobot`; or ``'receding_horizon'``: a `HorizonRobot`. Each has options
        of its own.
    **options
        What the class of the method takes besides.

    Attributes
    ----------
    eyed, k_mod, neigh, rho, Tc
        As given.
    limits : Limits
        What the body can do, its radius with the margin.
    environment : Environment
    protocol : Protocol or Exchange
        What binds the robot to others.
    planning_process : None
        The process that plans is the caller's: the simulation's, or that of the node ``robot``.

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
    method: str
    #: Within which [m] it sees other bodies.
    sensor_range = np.inf
    #: Whether sections come so late that `cycle` should be ``Tc``.
    is_pressed = False
    environment: Environment
    protocol: Any
    planning_process = None

    def __new__(cls, *args: object, method: str = '', **options: object) -> Robot:
        """Return a robot of the class that plans by ``method``."""
        return super().__new__(_kind(method or 'contracts') if cls is Robot else cls)

    def __init__(self, eyed: int, kine_model: UnicycleKineModel, neigh: Sequence[int], rho: float, Tc: float,
                 limits: Limits):
        if kine_model.u_init.any() or kine_model.u_final.any():
            raise InvalidInput(f'robot {eyed} goes from rest to rest: u_init {kine_model.u_init} and u_final '
                               f'{kine_model.u_final} must be 0. Who drives before it has heard the others could meet '
                               'them, and where a plan ends nobody knows who comes by')
        self.eyed, self.k_mod, self.neigh, self.rho = int(eyed), kine_model, tuple(neigh), float(rho)
        if self.eyed in self.neigh or not all(isinstance(each, Integral) for each in self.neigh):
            raise InvalidInput(f'neigh of robot {eyed} is {list(self.neigh)}: they must be ids of other robots')
        self.Tc, self.limits, self._orders = float(Tc), limits, Orders()

    @abstractmethod
    def restarted(self, epoch: int, now: float) -> Robot:
        """Return the robot that a new process makes where the body now rests; it knows nothing of the others."""

    # What a mission says

    @abstractmethod
    def join(self, roster: Sequence[int], resting: Mapping[int, tuple[NDArray, float]] | None = None) -> None:
        """Listen to the robots of ``roster`` from now on.

        Parameters
        ----------
        roster : sequence of int
        resting : dict of int to ((2,) array_like [m], float [m])
            Places and radii of the robots among them that are not switched on yet.
        """

    def start(self, roster: Sequence[int], start_time: float,
              resting: Mapping[int, tuple[NDArray, float]] | None = None) -> None:
        """Drive from ``start_time`` [s] on, among the robots of ``roster``; see `join`."""
        self.join(roster, resting)
        self._orders.start(start_time)

    def stop(self) -> None:
        """Finish the plan in force, which ends at rest, and stay there."""
        self._orders.stop()

    def looking_ahead(self, q_final: ArrayLike) -> Callable[[], Any]:
        """Return a function that makes what `set_goal` takes for another goal, and touches nothing of the robot.

        So it can be called in another thread, while the robot goes on. It raises what `set_goal` would raise.
        """
        return lambda: None

    @abstractmethod
    def set_goal(self, q_final: ArrayLike, now: float, course: Any = None) -> None:
        """Drive to another goal from ``now`` [s] on, whether the last one was reached or not.

        What is in force stands, and so does all that was agreed: no other robot has to be asked. A robot that waits, is
        paused or was stopped does so on, and drives to the new goal when it drives again.

        Parameters
        ----------
        q_final : (3,) array_like [m, m, rad]
        now : float [s]
        course : object
            What `looking_ahead` has made for this goal, if it has.

        Raises
        ------
        InvalidInput
            It is not three finite numbers.
        GoalOutside, GoalOccupied, NoPath
            The body does not fit there, or nothing leads there. The old goal stands.

        Examples
        --------
        >>> from mobile_planning import Boundary
        >>> agent = Robot(1, UnicycleKineModel((1, 1, 0), (7, 1, 0)), [], Boundary((0, 8), (0, 6)))
        >>> agent.set_goal((7, 5, 1.57), 0.0)
        >>> agent.goal.tolist()
        [7.0, 5.0, 1.57]
        """

    @abstractmethod
    def require_goal(self, q_final: ArrayLike) -> None:
        """Raise what `set_goal` would raise for a goal."""

    def _model_to(self, q_final: ArrayLike) -> UnicycleKineModel:
        """Return the model that leads to another goal."""
        made = self.k_mod
        return UnicycleKineModel(made.q_init, q_final, made.u_init, made.u_final, made.u_max, made.acc_max)

    def _model_from(self, now: float) -> UnicycleKineModel:
        """Return the model that leads from where the body is at ``now`` [s]."""
        made = self.k_mod
        return UnicycleKineModel(self.state(now)[:3], made.q_final, u_max=made.u_max, a_max=made.acc_max)

    def follow_path(self, poses: ArrayLike, now: float) -> None:
        """Drive along a path (N, 3) [m, m, rad] from elsewhere to its end, from ``now`` [s] on.

        Raises
        ------
        InvalidInput
            This method takes no paths, or it is none for this robot.
        """
        raise InvalidInput(f'robot {self.eyed} plans by {self.method}, which takes goals only and no path; robots that '
                           'plan by contracts take paths')

    @abstractmethod
    def pause(self, now: float) -> None:
        """Come to rest from ``now`` [s] on, and stay until `resume`; to its peers it has stopped."""

    @abstractmethod
    def resume(self, now: float) -> None:
        """Drive on from ``now`` [s] on, if the robot was paused."""

    @abstractmethod
    def enter(self, environment: Environment, now: float) -> None:
        """Go by another static world from ``now`` [s] on.

        What was agreed stands. Where the plan in force leads into what is occupied by now the robot brakes, and
        `world_trouble` says so.
        """

    # What goes in and out

    @abstractmethod
    def receive(self, message: Message | Death, now: float) -> bool:
        """Take in a peer's ``message`` at ``now`` [s]; return whether it was news."""

    def expect_losses(self, are_any: bool) -> None:
        """Take in whether messages get lost on their way: what is sure to arrive needs to be said only once."""

    @abstractmethod
    def observe(self, seen: Mapping[int, tuple[NDArray, float]], now: float) -> None:
        """Take in what the presence sensor sees at ``now`` [s]: place (2,) [m] and speed [m/s] of each robot."""

    def step(self, now: float) -> list[Message]:
        """Plan and commit what is due at ``now`` [s]; return the messages for all peers."""
        messages = self.commit(self.plan_section(now), now)
        request = self.take_request()
        return messages if request is None else messages + self.propose(request.plan(), now)

    @abstractmethod
    def plan_section(self, now: float) -> Any:
        """Return what the robot would drive next, as planned at ``now`` [s]; nothing changes until it is committed."""

    @abstractmethod
    def commit(self, section: Any, now: float) -> list[Message]:
        """Put in force at ``now`` [s] what may be of a planned section; return the messages for all peers."""

    def take_request(self) -> JointRequest | GroundRequest | None:
        """Return the request for a joint plan that has fallen due in `commit`, or for the roadmap that it takes, once.

        None if there is none.
        ``request.plan()`` takes some ten milliseconds or more and touches nothing of the robot: it can be called in
        another thread, while the robot goes on. Its answer goes to `propose`; until then no other plan falls due.
        """

    def propose(self, plan: JointPlan | None, now: float) -> list[JointPlan]:
        """Put in force at ``now`` [s] the joint ``plan`` that was requested; return what is to be sent.

        None says that none could be made. A plan that comes after a newer one is dropped.

        Raises
        ------
        InvalidInput
            This method has no joint plans.
        """
        if plan is not None:
            raise InvalidInput(f'robot {self.eyed} plans by {self.method}, which has no joint plans')
        return []

    @property
    @abstractmethod
    def has_answers(self) -> bool:
        """Whether `answers` has something to send, or may have in a moment."""

    @abstractmethod
    def answers(self, now: float) -> list[Message]:
        """Return what is to be said at ``now`` [s] between two cycles."""

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

    def forget(self, most: int) -> None:
        """Leave out of ``sol`` the oldest of more than ``most`` plans and sections, as the robot drives for hours."""
        self._motion.record.forget(most)

    def distance_left(self, now: float) -> float:
        """Return how long [m] the way is that leads to the goal from where the robot is at ``now`` [s]."""
        return self._course.guidance.length(self.state(now)[:2])

    @property
    @abstractmethod
    def plan(self) -> Plan:
        """The plan in force, from the knot that is being driven, or of the last commit, on."""

    @property
    @abstractmethod
    def held_up(self) -> HoldUp | None:
        """Why the robot does not go on and for whom; None if it does, or is done."""

    @property
    @abstractmethod
    def world_trouble(self) -> str:
        """Why the robot does not drive on in the world as it is; empty for nothing."""

    @property
    @abstractmethod
    def broken(self) -> tuple[int, ...]:
        """The robots with whom what was agreed does not hold any more, since the world has changed."""

    @property
    @abstractmethod
    def cycle(self) -> float:
        """Time [s] between two calls of `step`, by what the robot does now; ``Tc`` at most."""

    @property
    @abstractmethod
    def phase(self) -> float:
        """Where within `cycle` [s] one starts best."""

    def until_cycle(self, now: float) -> float:
        """Return how long [s] after a cycle at ``now`` [s] the next one starts best, half a cycle at least."""
        wait = float((self.phase - now) % self.cycle)
        return wait if wait >= self.cycle / 2 else wait + self.cycle

    @property
    def sol(self) -> Solution:
        """What was driven so far: the plans, and samples ``t``, ``x``, ``y``, ``theta``, ``v``, ``omega`` (N,)."""
        return self._motion.record.solution(self.eyed, self.is_done)

    @property
    def rtime(self) -> NDArray[np.float64]:
        """Sample times (N,) [s] of `sol` from the first knot on, never more than 0.01 s apart."""
        return self.sol.t

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


def _kind(method):
    """Return the class of the robots that plan by ``method``."""
    # Imported here: each is a robot, and the solvers of the second cost memory.
    if method == 'contracts':
        from mobile_planning.fleet.contract_robot import ContractRobot
        return ContractRobot
    if method == 'receding_horizon':
        from mobile_planning.fleet.horizon_robot import HorizonRobot
        return HorizonRobot
    raise InvalidInput(f'method is {method!r}; known are contracts and receding_horizon')
