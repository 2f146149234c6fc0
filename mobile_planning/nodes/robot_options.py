"""Parameters of the node ``robot``."""
from __future__ import annotations

from dataclasses import dataclass

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.base import BaseOptions
from mobile_planning.fleet.scene import MAX_ROBOTS, RobotSpec, Scene
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.nodes.parameters import option

#: What a margin must hold for rounding, beside all errors that are measured [m].
_NUMERIC = 0.001


@dataclass(frozen=True)
class RobotOptions:
    """Parameters of the node."""

    robot_id: int = option(0, 'id of this robot; of two the lower one offers the contracts', low=0, high=2**32 - 1,
                           read_only=True)
    robots: tuple = option((0,), 'ids of several robots of the scene that this process drives; 0 alone: robot_id only',
                           read_only=True)
    scene: str = option('', 'YAML file of the scene that names this robot; empty: the parameters below', read_only=True)
    scene_robots: int = option(0, 'robots the scene is to have, 0 for as many as it says', low=0, high=MAX_ROBOTS,
                               read_only=True)
    start: tuple = option((0.0, 0.0, 0.0), 'start pose x, y, theta [m, m, rad]', read_only=True)
    goal: tuple = option((0.0, 0.0, 0.0), 'goal pose x, y, theta [m, m, rad]', read_only=True)
    radius: float = option(0.2, 'of the body [m]', low=0.01, high=100.0, read_only=True)
    u_max: tuple = option((1.0, 5.0), 'greatest speed and turn rate [m/s, rad/s]', read_only=True)
    a_max: tuple = option((2.0, 10.0), 'greatest acceleration and turn acceleration [m/s^2, rad/s^2]', read_only=True)
    margin: float = option(0.025, 'added to the radius for the three errors below and rounding [m]', low=0.0, high=1.0,
                           read_only=True)
    tracking_margin: float = option(0.015, 'greatest distance of the body from its plan [m]', low=0.0, high=1.0,
                                    read_only=True)
    localisation_margin: float = option(0.004, 'greatest error of the pose [m]', low=0.0, high=1.0, read_only=True)
    clock_margin: float = option(0.005, 'greatest error of the clock [s]', low=0.0, high=1.0, read_only=True)
    method: str = option('', 'contracts or receding_horizon, one for all robots of a mission; empty: as the scene says',
                         read_only=True)
    Tc: float = option(0.25, 'between two sections, half of it with moves of a joint plan ahead; twice the time '
                             'between knots [s]', low=0.05, high=5.0, read_only=True)
    Tp: float = option(3.0, 'length of a plan, 4 to 50 Tc [s]', low=0.2, high=60.0, read_only=True)
    budget: float = option(0.08, 'to plan a section; what takes longer is dropped [s]', low=0.0, high=10.0,
                           read_only=True)
    neighbours: tuple = option((0,), 'ids of the robots to stay within com_range of; 0 alone: as the scene says',
                               read_only=True)
    com_range: float = option(0.0, 'how far away neighbours may be [m]; 0: as the scene says', low=0.0, high=1e6,
                              read_only=True)
    takes_goal_pose: bool = option(False, 'drive to what comes on /goal_pose, as RViz sends it', read_only=True)
    navigate_to_pose: bool = option(False, "serve the action ~/navigate_to_pose: Nav2's where nav2_msgs is installed, "
                                    'else one of ours with the same fields', read_only=True)
    frame_id: str = option('map', 'frame of all poses', read_only=True)
    simulate: bool = option(True, 'simulate the base and publish ~/odom; else drive a real one by ~/cmd_vel',
                            read_only=True)
    localisation: str = option('pose', 'of a real base: pose, from ~/pose, or tf, from ~/odom and TF', read_only=True)
    pose_timeout: float = option(0.5, 'without a pose for so long the robot comes to rest [s]', low=0.05, high=10.0,
                                 read_only=True)
    control_rate: float = option(20.0, 'of the tracking [Hz]', low=5.0, high=200.0, read_only=True)
    odom_rate: float = option(10.0, 'of ~/odom [Hz]', low=0.1, high=100.0, read_only=True)
    base_a_max: float = option(3.0, 'of the base [m/s^2]', low=0.1, high=100.0, read_only=True)
    base_alpha_max: float = option(30.0, 'of the base; an ERROR where turns in place bring it further off its plan '
                                   'than the tracking margin [rad/s^2]', low=1.0, high=1000.0, read_only=True)
    base_slip: float = option(0.0, 'of the simulated base, standard deviation of its speeds', low=0.0, high=0.9,
                              read_only=True)
    base_noise: float = option(0.0, 'of the simulated pose, standard deviation [m]', low=0.0, high=1.0, read_only=True)
    plans_kept: int = option(8000, 'of the newest plans, for the judge: at four a second those of half an hour',
                             low=100, high=1000000, read_only=True)
    logbook: str = option('', 'file by which a simulated body and the goals outlive the process, empty for none; {id} '
                          'stands for the id of the robot', read_only=True)

    def __post_init__(self):
        if not 4 * self.Tc <= self.Tp <= 50 * self.Tc:
            raise InvalidInput(f'Tp is {self.Tp} s, not within 4 to 50 Tc, which are {4 * self.Tc} to '
                               f'{50 * self.Tc} s')
        if self.localisation not in ('pose', 'tf'):
            raise InvalidInput(f'localisation is {self.localisation!r}, not pose or tf')
        if bool(self.com_range) != (self.neighbours != (0,)):
            raise InvalidInput(f'neighbours {list(self.neighbours)} and com_range {self.com_range} m go together')
        if len(set(self.robots)) != len(self.robots) or not all(0 <= each < 2**32 for each in self.robots):
            raise InvalidInput(f'robots is {list(self.robots)}: ids from 0 to 4294967295, each once')

    @property
    def is_several(self) -> bool:
        """Whether the process drives the robots of a list."""
        return self.robots != (0,)

    @property
    def ids(self) -> tuple[int, ...]:
        """The robots that the process drives."""
        return self.robots if self.is_several else (self.robot_id,)

    def planning(self, scene: Scene) -> dict[str, object]:
        """Return the options of `Robot`; those of the receding horizon but for the margin are the scene's."""
        method = self.method or scene.method
        said = {'method': method, 'margin': self.margin}
        if self.com_range:
            said |= {'neigh': self.neighbours, 'com_range': self.com_range}
        if method == 'receding_horizon':
            return said
        return {**said, 'Tc': self.Tc, 'Tp': self.Tp, 'budget': self.budget}

    def load_scene(self) -> Scene:
        """Return the scene that is named, or one of this robot alone on the map."""
        if self.scene:
            return load_scene(self.scene, self.scene_robots or None)
        return Scene('parameters', (RobotSpec(self.robot_id, self.start, self.goal, self.radius, self.u_max,
                                              self.a_max),), on_map=True)

    def tracker(self, u_max: tuple[float, float]) -> Tracker:
        """Return the tracking law for a robot whose plans are no faster than ``u_max`` [m/s, rad/s].

        Raises
        ------
        InvalidInput
            The margin is too small for all that may go wrong at that speed.
        """
        need = self.tracking_margin + self.localisation_margin + self.clock_margin * u_max[0] + _NUMERIC
        if need > self.margin + 1e-12:
            raise InvalidInput(
                f'margin is {self.margin} m, but tracking_margin {self.tracking_margin} m, localisation_margin '
                f'{self.localisation_margin} m, clock_margin {self.clock_margin} s at {u_max[0]} m/s and {_NUMERIC} m '
                f'for rounding need {need:.4f} m')
        # Who is behind its plan must be able to catch up.
        return Tracker(1.2 * u_max[0], 1.2 * u_max[1], a_max=self.base_a_max, alpha_max=self.base_alpha_max)

    @property
    def most_drift(self) -> float:
        """By how much [m] a body may be elsewhere than thought before it stops."""
        return max(self.tracking_margin, 1e-3)

    def logbook_of(self, robot_id: int) -> str:
        """Return the file of the logbook of one robot."""
        return self.logbook.replace('{id}', str(robot_id))

    def base(self) -> BaseOptions:
        """Return what the simulated base is like."""
        return BaseOptions(self.base_a_max, self.base_alpha_max, self.base_slip, self.base_noise)
