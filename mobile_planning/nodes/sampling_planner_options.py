"""The parameters of the node ``sampling_planner``."""
from __future__ import annotations

from dataclasses import dataclass

from mobile_planning.nodes.parameters import option
from mobile_planning.sampling_options import SamplingOptions


@dataclass(frozen=True)
class SamplingPlannerOptions:
    """The parameters of the node."""

    autostart: bool = option(True, 'whether the node configures and activates itself', read_only=True)
    map_topic: str = option('map', 'latched topic of the map', read_only=True)
    obstacles_topic: str = option('obstacles', 'latched topic of the obstacles beside the map', read_only=True)
    default_planner: str = option('rrt', 'planner of a request that names none: rrt, rrt_star, prm, prm_dubins or '
                                  'prm_reeds_shepp')
    default_deadline: float = option(2.0, 'time for a request that gives none [s]', low=1e-3, high=3600.0)
    turning_radius: float = option(0.5, 'least turning radius of the car, of all planners but prm [m]',
                                   low=0.001, high=1000.0)
    steering: str = option('dubins', 'of rrt and rrt_star: dubins forwards only, reeds_shepp backwards too')
    robot_radius: float = option(0.0, 'radius of the disc that the robot covers [m]', low=0.0, high=100.0)
    speed: float = option(1.0, 'at which the robot drives, when it meets obstacles that move [m/s]',
                          low=0.001, high=1000.0)
    precision: tuple[float, ...] = option((0.1, 0.1, 0.1), 'how far from the goal a tree may end, in x, y and heading '
                                          '[m, m, rad]')
    roadmap_nodes: int = option(5000, 'nodes of a roadmap that is built because a request needs it',
                                low=1, high=1000000)
    unknown_is_free: bool = option(False, 'whether unknown cells may be entered')

    def __post_init__(self):
        self.sampling()

    def sampling(self) -> SamplingOptions:
        """Return what the library is told."""
        return SamplingOptions(
            default_planner=self.default_planner, turning_radius=self.turning_radius, steering=self.steering,
            robot_radius=self.robot_radius, speed=self.speed, precision=tuple(self.precision),
            roadmap_nodes=self.roadmap_nodes, unknown_is_free=self.unknown_is_free)
