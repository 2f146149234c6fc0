"""The path server of a node, kept on what was heard last, in the thread that plans."""
from __future__ import annotations

from contextlib import contextmanager

import numpy as np
from geometry_msgs.msg import PoseStamped
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import PlanningError
from mobile_planning.nodes.convert import check_frame, configuration
from mobile_planning.nodes.planning_basis import PlanningBasis
from mobile_planning.nodes.progress import UnderWay
from mobile_planning.nodes.site import Site, remaining
from mobile_planning.path_query import PlannedPath
from mobile_planning.path_server import FIELD_PLANNERS
from mobile_planning.world.occupancy_grid import OccupancyGrid


class PlanningSite(Site[PlanningBasis]):
    """A path server that takes over what is wanted of it when the next request's turn comes.

    Attributes
    ----------
    under_way : UnderWay or None
        What is being planned at the moment.
    """

    def __init__(self, wanted: PlanningBasis):
        super().__init__(wanted)
        self.under_way = None
        self._server = wanted.options.path_server()
        # Goal and planner of the newest path.
        self._newest = None

    def update_costs(self, wanted: PlanningBasis, frame: str, cells: ArrayLike, costs: ArrayLike) -> None:
        """Change the costs of cells of the map that was the newest when the update came; a newer one forgets it.

        Parameters
        ----------
        wanted : PlanningBasis
            What was wanted when it came.
        frame : str
            Of the update.
        cells : (N,) array_like of int
            ``x + y * width`` of each.
        costs : (N,) array_like

        Raises
        ------
        PlanningError
            As `PathServer.update_costs`, or if it is not in the frame of the map.
        """
        grid = wanted.require_map()
        check_frame(frame, wanted.frame, 'the update of costs')
        self.adopt()
        if self._adopted.grid is grid:
            y, x = np.divmod(np.asarray(cells, np.int64), grid.width)
            self._server.update_costs(np.column_stack([x, y]), costs)

    def cost_to_go(self, until: float, stop: NDArray) -> tuple[OccupancyGrid, str, tuple[float, ...], str, NDArray]:
        """Return the map, its frame, the newest path's goal, and the cost from every cell to it.

        Parameters
        ----------
        until, stop
            See `plan`.

        Returns
        -------
        grid : OccupancyGrid
        frame : str
        goal : (3,) tuple of float [m, m, rad]
        planner : str
            Whose field it is: that of the path, if it has one.
        field : (h, w) ndarray [m]

        Raises
        ------
        PlanningError
            If nothing was planned yet, or as `PathServer.cost_to_go`.
        """
        self.adopt()
        if self._newest is None:
            raise PlanningError('no path was planned yet: the field leads to the goal of the newest one')
        goal, planner = self._newest
        planner = planner if planner in FIELD_PLANNERS else FIELD_PLANNERS[0]
        with self._counted(planner, goal) as done:
            grid, field = self._server.cost_to_go(goal, planner, deadline=remaining(until), stop=stop, done=done)
        return grid, self._adopted.frame, goal, planner, field

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
        frame = self._adopted.frame
        self._adopted.require_map()
        ends = configuration(start, frame, 'start'), configuration(goal, frame, 'goal')
        with self._counted(planner or self._server.default_planner, ends[1]) as done:
            path = self._server.plan_path(planner, *ends, deadline=remaining(until), seed=int(seed),
                                          tolerance=float(tolerance), stop=stop, done=done)
        self._newest = tuple(path.poses[-1].tolist()), path.statistics['planner']
        return path, frame

    def _take_over(self, wanted, before):
        masks = {} if wanted.grid is None else wanted.mask_grids()
        updates = self._server.updates
        if wanted.options is not before.options or wanted.grid is None:
            self._server = wanted.options.path_server()
        if wanted.grid is not None:
            # Of the same server plans may still do.
            self._server.set_map(wanted.grid, **masks)
            if wanted.grid is before.grid:
                self._server.update_costs(*updates)
        if wanted.frame != before.frame:
            self._newest = None

    @contextmanager
    def _counted(self, planner, goal):
        """Give the array to count in what is done, and show it until the ``with`` block is over."""
        self.under_way = UnderWay(planner, goal, self._adopted.frame)
        try:
            yield self.under_way.done
        finally:
            self.under_way = None
