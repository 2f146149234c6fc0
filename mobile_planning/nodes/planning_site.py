"""The newest map with its path server, handed from the thread that hears of maps to the one that plans."""
from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Protocol

import numpy as np
from geometry_msgs.msg import PoseStamped
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import NoMap, PlanningError, PlanningTimeout
from mobile_planning.nodes.convert import check_frame, configuration
from mobile_planning.path_server import FIELD_PLANNERS, PathServer, PlannedPath
from mobile_planning.world.occupancy_grid import OccupancyGrid


class PlanningOptions(Protocol):
    """Options of a node that plans."""

    def path_server(self) -> PathServer:
        """Return a path server with these options, without a map."""


class PlanningSite:
    """A map, its frame and the options it is planned with, always replaced together.

    `want`, `want_mask` and `wanted` are for the executor's thread, the others for the worker's: a request is planned
    on one map with one set of options, the newest when its turn comes.

    Parameters
    ----------
    options : PlanningOptions
    masks : iterable of str
        Names of those without which nothing is planned: keepout, speed.
    """

    def __init__(self, options: PlanningOptions, masks: Iterable[str] = ()):
        self._wanted = self._adopted = (options, None, '', dict.fromkeys(masks))
        self._server = options.path_server()
        # Goal and planner of the newest path.
        self._newest = None

    @property
    def wanted(self) -> tuple:
        """Options, map, frame and masks, one object from one `want` to the next."""
        return self._wanted

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
        masks = self._wanted[3] if grid is not None else dict.fromkeys(self._wanted[3])
        self._wanted = (options, grid, frame, masks)

    def want_mask(self, name: str, grid: OccupancyGrid, frame: str) -> None:
        """Let the next request be planned with this mask, see `PathServer.set_map`.

        Parameters
        ----------
        name : str
        grid : OccupancyGrid
        frame : str
            It must be the map's, else nothing is planned.
        """
        self._wanted = (*self._wanted[:3], {**self._wanted[3], name: (grid, frame)})

    def adopt(self) -> None:
        """Take over what is wanted, if it is not there yet."""
        wanted = self._wanted
        if wanted is self._adopted:
            return
        (options, grid, frame, masks), before = wanted, self._adopted
        grids = _mask_grids(masks, frame) if grid is not None else {}
        updates = self._server.updates
        if options is not before[0] or grid is None:
            self._server = options.path_server()
        if grid is not None:
            # Of the same server plans may still do.
            self._server.set_map(grid, **grids)
            if grid is before[1]:
                self._server.update_costs(*updates)
        if frame != before[2]:
            self._newest = None
        self._adopted = wanted

    def update_costs(self, wanted: tuple, frame: str, cells: ArrayLike, costs: ArrayLike) -> None:
        """Change the costs of cells of the map that was the newest when the update came; a newer one forgets it.

        Parameters
        ----------
        wanted : tuple
            What was `wanted` when it came.
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
        _, grid, map_frame, _ = wanted
        if grid is None:
            raise NoMap('no map has come yet')
        check_frame(frame, map_frame, 'the update of costs')
        self.adopt()
        if self._adopted[1] is grid:
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
        grid, field = self._server.cost_to_go(goal, planner, deadline=_remaining(until), stop=stop)
        return grid, self._adopted[2], goal, planner, field

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
        _, grid, frame, _ = self._adopted
        if grid is None:
            raise NoMap('no map has come yet')
        ends = configuration(start, frame, 'start'), configuration(goal, frame, 'goal')
        path = self._server.plan_path(planner, *ends, deadline=_remaining(until), seed=int(seed),
                                      tolerance=float(tolerance), stop=stop)
        self._newest = tuple(path.poses[-1].tolist()), path.statistics['planner']
        return path, frame


def _mask_grids(masks, frame):
    """Return the masks by name, or raise if one has not come or lies in another frame than the map."""
    for name, mask in masks.items():
        if mask is None:
            raise NoMap(f'no {name} mask has come yet')
        check_frame(mask[1], frame, f'the {name} mask')
    return {name: grid for name, (grid, _) in masks.items()}


def _remaining(until):
    """Return the time until then [s], or raise PlanningTimeout."""
    remaining = until - time.monotonic()
    if remaining <= 0:
        raise PlanningTimeout('the deadline passed while other requests were answered')
    return remaining
