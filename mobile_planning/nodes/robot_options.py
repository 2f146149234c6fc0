"""Parameters of the node ``robot``."""
from __future__ import annotations

from dataclasses import dataclass

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.scene import MAX_ROBOTS, RobotSpec, Scene
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.nodes.parameters import option


@dataclass(frozen=True)
class RobotOptions:
    """Parameters of the node."""

    robot_id: int = option(0, 'id of this robot; of two the lower one offers the contracts', low=0, high=2**32 - 1,
                           read_only=True)
    scene: str = option('', 'YAML file of the scene that names this robot; empty: the parameters below', read_only=True)
    scene_robots: int = option(0, 'robots the scene is to have, 0 for as many as it says', low=0, high=MAX_ROBOTS,
                               read_only=True)
    start: tuple = option((0.0, 0.0, 0.0), 'start pose x, y, theta [m, m, rad]', read_only=True)
    goal: tuple = option((0.0, 0.0, 0.0), 'goal pose x, y, theta [m, m, rad]', read_only=True)
    radius: float = option(0.2, 'of the body [m]', low=0.01, high=100.0, read_only=True)
    u_max: tuple = option((1.0, 5.0), 'greatest speed and turn rate [m/s, rad/s]', read_only=True)
    a_max: tuple = option((2.0, 10.0), 'greatest acceleration and turn acceleration [m/s^2, rad/s^2]', read_only=True)
    margin: float = option(0.025, 'added to the radius for tracking, clock and numeric errors [m]', low=0.0, high=1.0,
                           read_only=True)
    Tc: float = option(0.25, 'between two sections, twice the time between knots [s]', low=0.05, high=5.0,
                       read_only=True)
    Tp: float = option(3.0, 'length of a plan, 4 to 50 Tc [s]', low=0.2, high=60.0, read_only=True)
    budget: float = option(0.08, 'to plan a section; what takes longer is dropped [s]', low=0.0, high=10.0,
                           read_only=True)
    frame_id: str = option('map', 'frame of all poses', read_only=True)
    odom_rate: float = option(10.0, 'of ~/odom [Hz]', low=0.1, high=100.0, read_only=True)

    def __post_init__(self):
        if not 4 * self.Tc <= self.Tp <= 50 * self.Tc:
            raise InvalidInput(f'Tp is {self.Tp} s, not within 4 to 50 Tc, which are {4 * self.Tc} to '
                               f'{50 * self.Tc} s')

    def load_scene(self) -> Scene:
        """Return the scene that is named, or one of this robot alone on the map."""
        if self.scene:
            return load_scene(self.scene, self.scene_robots or None)
        return Scene('parameters', (RobotSpec(self.robot_id, self.start, self.goal, self.radius, self.u_max,
                                              self.a_max),), on_map=True)
