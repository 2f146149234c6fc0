"""The parameters of the node ``grid_planner``."""
from __future__ import annotations

from dataclasses import dataclass

from mobile_planning.nodes.parameters import option
from mobile_planning.path_server import PathServer


@dataclass(frozen=True)
class GridPlannerOptions:
    """The parameters of the node."""

    autostart: bool = option(True, 'whether the node configures and activates itself', read_only=True)
    map_topic: str = option('map', 'latched topic of the map', read_only=True)
    keepout_topic: str = option('', 'latched topic of a mask of forbidden cells, empty for none', read_only=True)
    speed_topic: str = option('', 'latched topic of a mask of speeds in percent, empty for none', read_only=True)
    inflation_radius: float = option(0.0, 'by which obstacles and forbidden cells grow, the radius of the robot [m]',
                                     low=0.0, high=100.0)
    corner_cutting: bool = option(False, 'whether a diagonal step may pass between or beside occupied cells')
    unknown_is_free: bool = option(False, 'whether unknown cells may be entered')
    turning_radius: float = option(0.5, "least radius of the lattice's curves [m]", low=0.001, high=100.0)
    reverse_cost: float = option(0.0, 'times its length that a way costs the lattice backwards, 0: forwards only',
                                 low=0.0, high=1000.0)
    default_planner: str = option('distance_transform', 'planner of a request that names none')
    default_deadline: float = option(5.0, 'time for a request that gives none [s]', low=1e-3, high=3600.0)

    def __post_init__(self):
        self.path_server()

    @property
    def mask_topics(self) -> dict[str, str]:
        """Topics of the masks without which nothing is planned, by what they say: keepout, speed."""
        topics = {'keepout': self.keepout_topic, 'speed': self.speed_topic}
        return {name: topic for name, topic in topics.items() if topic}

    def path_server(self) -> PathServer:
        """Return a path server with these options, without a map."""
        return PathServer(self.default_planner, inflation_radius=self.inflation_radius,
                          corner_cutting=self.corner_cutting, unknown_is_free=self.unknown_is_free,
                          turning_radius=self.turning_radius, reverse_cost=self.reverse_cost or None)
