"""The newest map with its path server, handed from the thread that hears of maps to the one that plans."""
from __future__ import annotations

import time
from typing import Protocol

from geometry_msgs.msg import PoseStamped
from numpy.typing import NDArray

from mobile_planning.errors import NoMap, PlanningTimeout
from mobile_planning.nodes.convert import configuration
from mobile_planning.path_server import PathServer, PlannedPath
from mobile_planning.world.occupancy_grid import OccupancyGrid


class PlanningOptions(Protocol):
    """Options of a node that plans."""

    def path_server(self) -> PathServer:
        """Return a path server with these options, without a map."""


class PlanningSite:
    """A map, its frame and the options it is planned with, always replaced together.

    `want` is for the executor's thread, `adopt` and `plan` for the worker's: a request is planned on one map with one
    set of options, the newest when its turn comes.

    Parameters
    ----------
    options : PlanningOptions
    """

    def __init__(self, options: PlanningOptions):
        self._wanted = self._adopted = (options, None, '')
        self._server = options.path_server()

    @property
    def grid(self) -> OccupancyGrid | None:
        """The newest map."""
        return self._wanted[1]

    @property
    def frame(self) -> str:
        """The frame of the newest map."""
        return self._wanted[2]

    def want(self, options: PlanningOptions, grid: OccupancyGrid | None, frame: str) -> None:
        """Let the next request be planned with these options on this map.

        Parameters
        ----------
        options : PlanningOptions
        grid : OccupancyGrid or None
        frame : str
        """
        self._wanted = (options, grid, frame)

    def adopt(self) -> None:
        """Take over what is wanted, if it is not there yet."""
        wanted = self._wanted
        if wanted is self._adopted:
            return
        options, grid, _ = wanted
        server = options.path_server()
        if grid is not None:
            server.set_map(grid)
        self._server, self._adopted = server, wanted

    def plan(self, planner: str, start: PoseStamped, goal: PoseStamped, until: float, seed: int, tolerance: float,
             stop: NDArray) -> tuple[PlannedPath, str]:
        """Return the path between two poses on the newest map, and the frame it is in.

        Parameters
        ----------
        planner : str
            Id, empty for the default.
        start, goal : geometry_msgs/PoseStamped
        until : float [s]
            When the time to plan is over, on the monotonic clock.
        seed : int
        tolerance : float [m]
        stop : (1,) ndarray of uint8
            Set from another thread to withdraw the query.

        Raises
        ------
        PlanningError
            As `PathServer.plan_path`, or if a pose is not in the frame of the map.
        """
        self.adopt()
        _, grid, frame = self._adopted
        if grid is None:
            raise NoMap('no map has come yet')
        ends = configuration(start, frame, 'start'), configuration(goal, frame, 'goal')
        remaining = until - time.monotonic()
        if remaining <= 0:
            raise PlanningTimeout('the deadline passed while other requests were answered')
        return self._server.plan_path(planner, *ends, deadline=remaining, seed=int(seed), tolerance=float(tolerance),
                                      stop=stop), frame
