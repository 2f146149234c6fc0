"""The sampling server of a node, kept on what was heard last, in the thread that plans."""
from __future__ import annotations

from dataclasses import dataclass, replace

from geometry_msgs.msg import PoseStamped
from mobile_planning_msgs.msg import ObstacleArray
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput, NoMap, PlanningError
from mobile_planning.nodes.convert import check_frame, configuration
from mobile_planning.nodes.convert_obstacles import Obstacles, obstacles
from mobile_planning.nodes.site import Site, remaining
from mobile_planning.path_query import PlannedPath
from mobile_planning.sampling.prm_statistics import RoadmapStatistics
from mobile_planning.sampling_options import SamplingOptions
from mobile_planning.sampling_server import Progress, SamplingServer
from mobile_planning.world.occupancy_grid import OccupancyGrid


@dataclass(frozen=True, eq=False)
class SamplingBasis:
    """All that belongs together when a path is planned; a change makes another one.

    Attributes
    ----------
    options : SamplingOptions
    grid : OccupancyGrid or None
        The map, if one has come.
    frame : str
        Of the map.
    obstacles : Obstacles
    obstacles_frame : str
        Empty before any have come. Whether it is the map's is seen once there is a map.
    """

    options: SamplingOptions
    grid: OccupancyGrid | None = None
    frame: str = ''
    obstacles: Obstacles = Obstacles()
    obstacles_frame: str = ''


class SamplingSite(Site[SamplingBasis]):
    """A sampling server that takes over what is wanted of it when the next request's turn comes."""

    def __init__(self, wanted: SamplingBasis):
        super().__init__(wanted)
        self._server = SamplingServer(wanted.options)

    def change(self, **changes) -> None:
        """Have the next request planned on something else: fields of `SamplingBasis`."""
        self.wanted = replace(self.wanted, **changes)

    def change_obstacles(self, message: ObstacleArray, now: float) -> None:
        """Have the next request planned among the obstacles of a message, or raise what is wrong with it.

        Parameters
        ----------
        message : ObstacleArray
            Without a stamp its obstacles move from now on.
        now : float [s]
        """
        frame = message.header.frame_id
        there = obstacles(message, self.wanted.frame or frame)
        self.change(obstacles=there if there.since > 0 else there._replace(since=now), obstacles_frame=frame)

    def plan(self, planner: str, start: PoseStamped, goal: PoseStamped, until: float, seed: int, now: float,
             stop: NDArray, progress: Progress) -> tuple[PlannedPath, str]:
        """Return the path between two poses among what is known, and the frame it is in.

        Parameters
        ----------
        planner : str
            Id, empty for the default.
        start, goal : geometry_msgs/PoseStamped
        until : float [s]
            When the time to plan is over, on the monotonic clock.
        seed : int
        now : float [s]
            On the node's clock.
        stop : (1,) ndarray of uint8
            Set from another thread to withdraw the query.
        progress : Progress

        Raises
        ------
        PlanningError
            As `SamplingServer.plan`, or if a pose is not in the frame of the map.
        """
        frame = self._ready()
        ends = configuration(start, frame, 'start'), configuration(goal, frame, 'goal')
        return self._server.plan(planner, *ends, deadline=remaining(until), seed=int(seed), now=now, stop=stop,
                                 progress=progress), frame

    def build_roadmap(self, planner: str, nodes: int, seed: int, until: float, now: float, stop: NDArray
                      ) -> RoadmapStatistics:
        """Build the roadmap of a planner anew, see `SamplingServer.build_roadmap`."""
        self._ready()
        return self._server.build_roadmap(planner, int(nodes), seed=int(seed), now=now, deadline=remaining(until),
                                          stop=stop)

    def save_roadmap(self, planner: str, path: str) -> RoadmapStatistics:
        """Write the roadmap of a planner to a file."""
        self._ready()
        return _told(self._server.save_roadmap, planner, _path(path))

    def load_roadmap(self, planner: str, path: str, now: float) -> RoadmapStatistics:
        """Take the roadmap of a planner from a file."""
        self._ready()
        return _told(self._server.load_roadmap, planner, _path(path), now=now)

    def clear(self) -> None:
        """Forget all roadmaps."""
        self._server.clear()

    def newest_graph(self) -> tuple[NDArray, str]:
        """Return the edges (n, 2, 2) [m] of the newest tree or roadmap, and their frame."""
        return self._server.newest_graph(), self._adopted.frame

    def _take_over(self, wanted, before):
        if wanted.obstacles_frame and wanted.grid is not None:
            check_frame(wanted.obstacles_frame, wanted.frame, 'the obstacle array')
        is_new = wanted.options != before.options or wanted.grid is None
        if is_new:
            self._server = SamplingServer(wanted.options)
        if wanted.grid is not None and (is_new or wanted.grid is not before.grid):
            self._server.set_map(wanted.grid)
        self._server.set_obstacles(*wanted.obstacles)

    def _ready(self):
        """Take over what is wanted and return the frame of the map, or raise NoMap."""
        basis = self.adopt()
        if basis.grid is None:
            raise NoMap('no map has come yet')
        return basis.frame


def _path(path):
    """Return the path of a file, if one is given."""
    if not path:
        raise InvalidInput('no file is named: the path is empty')
    return path


def _told(function, *args, **options):
    """Return what the function returns; what the system refuses is an answer, not a fault."""
    try:
        return function(*args, **options)
    except OSError as error:
        raise PlanningError(f'{args[-1]}: {error.strerror or error}') from None
