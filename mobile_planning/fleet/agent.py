"""Agent: a robot that exists once its map is known, and its part in a mission."""
from __future__ import annotations

from collections.abc import Callable

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.message import Contracts, RobotMsg
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.scene import Scene
from mobile_planning.world.occupancy_grid import OccupancyGrid

#: Between two looks for a robot [s], as long as there is none.
_UNKNOWN = 0.1


class Agent:
    """One robot of a scene, made when the map comes, that takes part in the first mission that starts.

    A mission that has started binds the robot: its peers know where it is and go by its contracts. So maps and
    missions that come later are refused.

    Parameters
    ----------
    scene : Scene
    robot_id : int
    epoch : int
        Grows with each start of the robot's process.
    now : float [s]
        On the common clock of the robots.
    **options
        For `Robot`.

    Attributes
    ----------
    robot : Robot or None
        None while the map is unknown or not fit.
    trouble : str
        Why there is no robot; empty if there is one.
    epoch : int
        Of the robot; grows with each robot that is made for another map.

    Raises
    ------
    PlanningError
        The scene has no such robot, or no map and no room for it.
    """

    def __init__(self, scene: Scene, robot_id: int, epoch: int, now: float, **options):
        if robot_id not in [spec.id for spec in scene.robots]:
            raise InvalidInput(f'scene {scene.name} has the robots {[spec.id for spec in scene.robots]}, '
                               f'not {robot_id}')
        self.robot: Robot | None = None
        self.trouble, self.epoch = 'waiting for the map', int(epoch)
        self._scene, self._id, self._options = scene, robot_id, options
        self._grid: OccupancyGrid | None = None
        self._mission: Announcement | None = None
        self._is_stopped = False
        if not scene.on_map:
            self._make(None, now)

    @property
    def is_finished(self) -> bool:
        """Whether the robot has driven its mission: it is done, or was stopped."""
        return self.robot is not None and (self.robot.is_done or self._is_stopped)

    def take_map(self, grid: OccupancyGrid, now: float) -> None:
        """Make the robot on the map ``grid``.

        Raises
        ------
        InvalidInput
            Its mission has started.
        PlanningError
            The robot has no room there, or no way to its goal.
        """
        if grid == self._grid:
            return
        if self._has_started:
            raise InvalidInput('a map that comes when the mission has started is not used')
        if self.robot is not None:
            # Peers take messages that count from one again for old ones, unless the epoch is new.
            self.epoch += 1
        self._grid = grid
        self._make(grid, now)

    def follow(self, announcement: Announcement) -> None:
        """Do what is announced.

        Raises
        ------
        InvalidInput
            It is of another mission than the one that has started.
        """
        if not self._has_started:
            self._mission = announcement
            self._apply()
        elif announcement.name != self._mission.name or announcement.state is State.WAITING:
            raise InvalidInput(f'mission {announcement.name[:80]} is not followed: '
                               f'mission {self._mission.name[:80]} has started, and a robot drives only one')
        elif announcement.state is State.STOPPED:
            self.robot.stop()
            self._is_stopped = True

    def receive(self, message: RobotMsg | Contracts | JointPlan, now: float) -> None:
        """Take in what a robot says.

        Raises
        ------
        InvalidInput
            The robot was started a second time.
        """
        if message.robot_id == self._id:
            if message.boot_epoch > self.epoch:
                raise InvalidInput(f'robot {self._id} was started a second time, and all listen to that one')
        elif self.robot is not None:
            self.robot.receive(message, now)

    @property
    def has_answers(self) -> bool:
        """Whether `answers` has something to send."""
        return self.robot is not None and self.robot.has_answers

    def answers(self, now: float) -> list[Contracts]:
        """Return what to tell the others at ``now`` [s] before the next step."""
        return [] if self.robot is None else self.robot.answers(now)

    def until_cycle(self, now: float) -> float:
        """Return how long [s] after `step` at ``now`` [s] the next one is best."""
        return _UNKNOWN if self.robot is None else self.robot.until_cycle(now)

    def step(self, clock: Callable[[], float]) -> list[RobotMsg | Contracts | JointPlan]:
        """Return what to tell the others, having planned where that is due.

        Parameters
        ----------
        clock : callable
            Returns the common time [s]; read again after planning, for a section may come too late.
        """
        return [] if self.robot is None else self.robot.commit(self.robot.plan_section(clock()), clock())

    @property
    def _has_started(self):
        """Whether a mission with this robot was started."""
        return (self.robot is not None and self._mission is not None and self._mission.state is State.STARTED
                and self._id in self._mission.robot_ids)

    def _make(self, grid, now):
        try:
            self.robot = self._scene.robot(self._id, grid, epoch=self.epoch, start_time=now, **self._options)
        except PlanningError as error:
            self.robot, self.trouble = None, str(error)
            raise
        self.trouble = ''
        if self._mission is not None:
            self._apply()

    def _apply(self):
        """Tell the robot of a mission that has not started before."""
        if self.robot is None or self._mission.state is State.STOPPED:
            return
        self.robot.join(list(self._mission.robot_ids))
        if self._has_started:
            self.robot.start(list(self._mission.robot_ids), self._mission.start)
