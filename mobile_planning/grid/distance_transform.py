"""The distance transform planner: one field of distances to the goal, and the way down from anywhere."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.grid.planner import PlannerBase
from mobile_planning.world.cost_to_go import METRICS, cost_to_go, descend
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, OccupancyGrid


class DistanceTransformPlanner(PlannerBase):
    """Shortest paths to one goal on a grid whose free cells all cost the same.

    `plan` computes the cost-to-go field of the goal, exactly; `query` then goes down it from any start in no time.
    Also known as wavefront, grassfire or brushfire planning.

    Parameters
    ----------
    occgrid : (h, w) array_like or OccupancyGrid, optional
        Nonzero where a robot must not enter.
    metric : {'euclidean', 'manhattan'}
        How the field measures: in steps of 1 and sqrt(2) to eight neighbours, or of 1 to four.
    goal, start : (2,) array_like, optional
        Cells (x, y).
    inflate : float [cells]
        Obstacles are grown by a disc of this radius; the caller's grid stays as it is.
    corner_cutting : bool
        Whether a diagonal step may pass an occupied cell at its side; if not, both cells beside it must be free.
    connectivity : {4, 8}
        Neighbours that a path may step to. With 4 both metrics measure the same: the number of steps. A manhattan
        field with 8 gives paths that prefer diagonal steps and are not always the shortest in the Euclidean sense.
    occupied_from, unknown_is_free, verbose
        See `PlannerBase`.
    distance : str, optional
        Another name of ``metric``.

    Examples
    --------
    >>> from mobile_planning import DistanceTransformPlanner
    >>> import numpy as np
    >>> simplegrid = np.zeros((6, 6));
    >>> simplegrid[2:5, 3:5] = 1
    >>> dx = DistanceTransformPlanner(simplegrid, goal=(1, 1), distance="manhattan");
    >>> dx.plan()
    >>> path = dx.query(start=(5, 4))
    >>> print(path.T)
    [[5 5 5 4 3 2 1]
     [4 3 2 1 1 1 1]]
    >>> dx.distancemap[4, 5]
    np.float64(7.0)
    """

    def __init__(
        self,
        occgrid: ArrayLike | OccupancyGrid | None = None,
        metric: str = 'euclidean',
        *,
        goal: ArrayLike | None = None,
        start: ArrayLike | None = None,
        inflate: float = 0,
        corner_cutting: bool = True,
        connectivity: int = 8,
        occupied_from: int = OCCUPIED_FROM,
        unknown_is_free: bool = False,
        verbose: bool = False,
        distance: str | None = None,
    ):
        super().__init__(occgrid, goal=goal, start=start, inflate=inflate, occupied_from=occupied_from,
                         unknown_is_free=unknown_is_free, verbose=verbose)
        self._metric = metric if distance is None else distance
        if self._metric not in METRICS:
            raise InvalidInput(f'metric {self._metric!r} is not one of {", ".join(METRICS)}')
        if connectivity not in (4, 8):
            raise InvalidInput(f'connectivity {connectivity!r} is not 4 or 8')
        self._corner_cutting = bool(corner_cutting)
        self._connectivity = connectivity
        self._field = None

    @property
    def metric(self) -> str:
        """The distance metric, 'euclidean' or 'manhattan'."""
        return self._metric

    @property
    def distancemap(self) -> NDArray[np.float64] | None:
        """Distance to the last plan's goal, (h, w) [cells]: NaN if occupied, inf if unreachable; None before it."""
        return self._field

    def _plan(self, stop: NDArray[np.uint8], done: NDArray[np.int64]) -> None:
        """Compute the distance of every cell from the goal."""
        occupied, goal = self._require_grid(), self._require_goal()
        metric = 'manhattan' if self._connectivity == 4 else self._metric
        field = cost_to_go(
            occupied, goal, metric=metric, corner_cutting=self._corner_cutting, stop=stop, done=done)
        field.flags.writeable = False
        self._field, self._planned_goal = field, goal

    def _next(self, cell: NDArray[np.int64]) -> NDArray[np.int64] | None:
        path = self._path(cell, steps=1)
        return path[1] if len(path) > 1 else None

    def _path(self, start: NDArray[np.int64], steps: int | None = None) -> NDArray[np.int64]:
        """Return the path (N, 2) from a free cell, or only so many steps of it."""
        return descend(self._field, start, self.goal, corner_cutting=self._corner_cutting,
                       connectivity=self._connectivity, steps=steps)

    def _facts(self) -> list[str]:
        planned = 'none' if self._field is None else (
            '{} cells reach the goal ({}, {})'.format(np.isfinite(self._field).sum(), *self._planned_goal))
        return [*super()._facts(), f'metric: {self.metric}', f'plan: {planned}']
