"""Premises: what must be known before a robot exists, where its body stands and the world around it."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.scene import Scene
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import Obstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid


class Premises:
    """One robot's place and static world, as far as they are known by now.

    Parameters
    ----------
    scene : Scene
    robot_id : int
    is_placed : bool
        Whether the body is where the scene says; else `place` says where.
    **options
        For `Robot`.

    Attributes
    ----------
    grid : OccupancyGrid or None
        The map, when it has come.
    obstacles : sequence of Obstacle
        Beside those of the scene and the map.

    Raises
    ------
    PlanningError
        The scene has no such robot.

    Examples
    --------
    >>> from mobile_planning.fleet.scene import RobotSpec
    >>> from mobile_planning.world.environment import Boundary
    >>> hall = Scene('hall', (RobotSpec(1, (1, 1, 0), (3, 1, 0)),), boundary=Boundary((0, 4), (0, 4)))
    >>> premises = Premises(hall, 1, is_placed=False)
    >>> premises.lacking
    'waiting for the pose'
    >>> premises.place((2, 2, 0))
    >>> premises.robot(epoch=1, now=0.0).state(0.0)[:2].tolist()
    [2.0, 2.0]
    """

    def __init__(self, scene: Scene, robot_id: int, is_placed: bool = True, **options):
        scene.spec(robot_id)
        self._scene, self._id, self._is_placed, self._options = scene, robot_id, is_placed, options
        self.grid: OccupancyGrid | None = None
        self.obstacles: Sequence[Obstacle] = ()

    @property
    def method(self) -> str:
        """By which the robot plans."""
        return self._options.get('method', self._scene.method)

    @property
    def lacking(self) -> str:
        """What is waited for, empty for nothing."""
        if not self._is_placed:
            return 'waiting for the pose'
        return 'waiting for the map' if self._scene.on_map and self.grid is None else ''

    @property
    def environment(self) -> Environment:
        """The static world."""
        grid = self._scene.grid if self.grid is None else self.grid
        return Environment(self._scene.boundary, (*self._scene.obstacles, *self.obstacles), grid)

    def place(self, pose: ArrayLike) -> None:
        """Take the body to rest at ``pose`` (3,) [m, m, rad], wherever the scene says that it starts."""
        start = tuple(float(value) for value in pose)
        robots = tuple(replace(spec, start=start) if spec.id == self._id else spec for spec in self._scene.robots)
        self._scene, self._is_placed = replace(self._scene, robots=robots), True

    def robot(self, epoch: int, now: float) -> Robot:
        """Return the robot that is switched on at ``now`` [s]; nothing may be lacking.

        Raises
        ------
        PlanningError
            It has no room there, or no way to its goal.
        """
        scene = replace(self._scene, obstacles=(*self._scene.obstacles, *self.obstacles))
        return scene.robot(self._id, self.grid, epoch=epoch, start_time=now, **self._options)
