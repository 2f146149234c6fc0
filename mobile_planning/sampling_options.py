"""What a server of sampling planners is told, and the ids of its planners."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mobile_planning.errors import InvalidInput, InvalidPlanner
from mobile_planning.sampling.steering import Steering

ROADMAPS = ('prm', 'prm_dubins', 'prm_reeds_shepp')
PLANNERS = ('rrt', 'rrt_star', *ROADMAPS)


@dataclass(frozen=True)
class SamplingOptions:
    """What a `SamplingServer` is told.

    Attributes
    ----------
    default_planner : str
        One of `PLANNERS`.
    turning_radius : float [m]
        Of the car of all planners but prm, above 0.
    steering : str
        Of the car of rrt and rrt_star: dubins drives forwards only, reeds_shepp backwards too.
    robot_radius : float [m]
        Of the disc that the robot covers, at least 0.
    speed : float [m/s]
        At which the robot drives, above 0: when it meets obstacles that move.
    precision : (3,) tuple of float [m, m, rad]
        How far from the goal a tree may end; a roadmap ends at the goal.
    roadmap_nodes : int
        Of a roadmap that is built because a query needs it.
    unknown_is_free : bool

    Raises
    ------
    InvalidInput
        If one is out of its range.
    """

    default_planner: str = 'rrt'
    turning_radius: float = 0.5
    steering: str = 'dubins'
    robot_radius: float = 0.0
    speed: float = 1.0
    precision: tuple[float, float, float] = (0.1, 0.1, 0.1)
    roadmap_nodes: int = 5000
    unknown_is_free: bool = False

    def __post_init__(self):
        check_planner(self.default_planner)
        Steering(self.steering)
        for name in ('turning_radius', 'speed'):
            if not 0 < getattr(self, name) < np.inf:
                raise InvalidInput(f'{name} {getattr(self, name)!r} is not a finite number above 0')
        if not 0 <= self.robot_radius < np.inf:
            raise InvalidInput(f'robot_radius {self.robot_radius!r} m is not a finite number of at least 0')
        if len(self.precision) != 3 or not all(0 <= value < np.inf for value in self.precision):
            raise InvalidInput(f'precision {self.precision!r} is not three finite numbers of at least 0')
        if self.roadmap_nodes < 1:
            raise InvalidInput(f'roadmap_nodes {self.roadmap_nodes} is below 1')


def check_planner(planner: str) -> None:
    """Raise InvalidPlanner unless it is the id of a planner."""
    if planner not in PLANNERS:
        raise InvalidPlanner(f'planner {planner!r} is not one of {", ".join(PLANNERS)}')


def roadmap_id(planner: str) -> str:
    """Return the id of a planner with a roadmap, prm if it is empty; InvalidPlanner if it has none."""
    if planner not in ('', *ROADMAPS):
        raise InvalidPlanner(f'planner {planner!r} has no roadmap: it is not one of {", ".join(ROADMAPS)}')
    return planner or 'prm'
