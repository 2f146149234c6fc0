"""The lattice planner: paths of straight pieces and arcs that a car can drive, searched on integer states."""
from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from mobile_planning.errors import InvalidInput, LimitExceeded, NoPath
from mobile_planning.grid.lattice_motions import LatticeMotions, numbers
from mobile_planning.grid.lattice_plots import LatticePlots
from mobile_planning.grid.lattice_status import LatticeEdge, LatticeStatus
from mobile_planning.grid.planner import PlannerBase
from mobile_planning.grid.state_lattice import StateLattice
from mobile_planning.world.cost_to_go import MAX_CELLS
from mobile_planning.world.occupancy_grid import OCCUPIED_FROM, OccupancyGrid

# How far a heading may be from one of the lattice's [rad].
_SAME_HEADING = 1e-3


class LatticePlanner(LatticePlots, PlannerBase):
    """Cheapest paths of short motions that join cell centres in a few headings.

    With the usual four headings a motion is one cell straight ahead or a quarter of a circle to the left or right.
    With 16 or more the arcs are gentler and a path can be driven by a car of that turning radius.

    `plan` grows the graph of all that can be reached from the root; `query` searches in it by A*. On a grid a query
    needs no plan: then it may use every motion from its own start. A motion belongs to the graph if all cells that
    the robot's centre crosses are free, not only the last.

    Parameters
    ----------
    costs : (3,) array_like, optional
        Of going straight, left and right by one of the four-heading motions of radius 1; longer or shorter motions
        cost in proportion to their length. Every motion costs its length if not given: (1, pi/2, pi/2).
    root : (3,) array_like [cells, cells, rad]
        Configuration from which the graph grows.
    occgrid : (h, w) array_like or OccupancyGrid, optional
        Nonzero where a robot must not enter.
    headings : int
        4, or a multiple of 8 up to 64.
    radius : float [cells]
        Least turning radius.
    reverse_cost : float, optional
        Motions can also be driven backwards, for so many times their cost. None: forwards only.
    turn_cost : float [1/rad]
        Added for each radian that a motion turns.
    corner_cutting : bool
        Whether a motion may pass exactly through the corner of an occupied cell.
    goal, start : (3,) array_like, optional
        Configurations (x, y, theta); a goal (x, y) may be reached in any heading.
    inflate, occupied_from, unknown_is_free, verbose
        See `PlannerBase`.

    Examples
    --------
    >>> from mobile_planning import LatticePlanner
    >>> import numpy as np
    >>> lattice = LatticePlanner();
    >>> lattice.plan(iterations=6)
    >>> path, status = lattice.query(start=(0, 0, 0), goal=(1, 2, np.pi/2))
    >>> print(path.T.round(4))
    [[0.     1.     1.    ]
     [0.     1.     2.    ]
     [0.     1.5708 1.5708]]
    >>> print(status)
    LatticeStatus(cost=2.5707963267948966, segments=['L', 'S'],
                  edges=[Edge{[0] -- [0L], cost=1.571}, Edge{[0L] -- [0LS], cost=1}])
    """

    def __init__(
        self,
        costs: ArrayLike | None = None,
        root: ArrayLike = (0, 0, 0),
        *,
        occgrid: ArrayLike | OccupancyGrid | None = None,
        headings: int = 4,
        radius: float = 1.0,
        reverse_cost: float | None = None,
        turn_cost: float = 0.0,
        corner_cutting: bool = True,
        goal: ArrayLike | None = None,
        start: ArrayLike | None = None,
        inflate: float = 0,
        occupied_from: int = OCCUPIED_FROM,
        unknown_is_free: bool = False,
        verbose: bool = False,
    ):
        self._motions = LatticeMotions(headings, radius, costs, reverse_cost, turn_cost)
        super().__init__(occgrid, goal=goal, start=start, inflate=inflate, occupied_from=occupied_from,
                         unknown_is_free=unknown_is_free, verbose=verbose)
        self._root = root
        self._corner_cutting = bool(corner_cutting)
        self._lattice = None
        if self._occupied is not None:
            self._lattice = StateLattice(self._occupied, (0, 0), self._motions, self._corner_cutting)
        # The lattice on which the plan was made, with its graph.
        self._planned = None

    @property
    def angles(self) -> NDArray[np.float64]:
        """The lattice's headings (n,) [rad], counted from +x to the left."""
        return self._motions.angles

    @property
    def vertices(self) -> NDArray[np.float64]:
        """Configurations (N, 3) of the graph's vertices in the order in which they were found."""
        planned = self._require_plan()
        return self._configurations(planned, planned.vertices)

    @property
    def nedges(self) -> int:
        """Number of edges of the graph."""
        return self._require_plan().edges

    def nearest(self, pose: ArrayLike) -> NDArray[np.float64]:
        """Return the configuration (3,) of the lattice that is nearest to a pose (3,): `query` wants such ones."""
        values = numbers(pose, 'pose')
        if values.shape != (3,):
            raise InvalidInput(f'pose {values.tolist()} is not a configuration (x, y, theta)')
        return np.append(self._nearest_cell(values[:2], 'pose'), self.angles[self._heading(values, np.inf, 'pose')])

    def validate_endpoint(self, p: ArrayLike, dtype: DTypeLike = None, *, name: str = 'start') -> NDArray:
        """Return the configuration, if a robot can be there.

        Parameters
        ----------
        p : (3,) array_like
            (x, y, theta): the cell whose centre is nearest, and a heading of the lattice. A goal may be (x, y).
        dtype : data type, optional
            Of the result, float64 if not given.
        name : {'start', 'goal', 'root'}
            Which point it is: it decides the kind of error.

        Returns
        -------
        (3,) or (2,) ndarray

        Raises
        ------
        StartOutside, StartOccupied, GoalOutside, GoalOccupied
            If it is no free cell.
        InvalidInput
            If the heading is not one of the lattice.
        """
        values = numbers(p, name)
        if values.shape != (3,) and (values.shape, name) != ((2,), 'goal'):
            raise InvalidInput(f'{name} {values.tolist()} is not a configuration (x, y, theta)')
        end = super().validate_endpoint(values[:2], float, name=name)
        if len(values) == 3:
            end = np.append(end, self.angles[self._heading(values, _SAME_HEADING, name)])
        return end.astype(dtype) if dtype is not None else end

    def plan(
        self,
        iterations: int | None = None,
        verbose: bool = False,
        summary: bool = False,
        *,
        animate: bool = False,
        progress: bool | Callable[[float], None] = True,
        movie: str | Path | tuple | None = None,
        stop: NDArray[np.uint8] | None = None,
    ) -> None:
        """Grow the graph from the root.

        Parameters
        ----------
        iterations : int, optional
            Each adds the motions from the vertices that the one before found. Without a number the grid is filled.
        verbose, summary, animate, progress, movie, stop
            See `PlannerBase.plan`.

        Raises
        ------
        InvalidInput
            If there are neither iterations nor a grid.
        StartOutside, StartOccupied
            If the root is no free cell.
        LimitExceeded
            If the graph could reach more than 2**27 cells, or more states than 32 bits can count.
        Cancelled
            If ``stop`` was set; the plan before stays.
        """
        if iterations is None and self._occupied is None:
            raise InvalidInput('without an occupancy grid the number of iterations must be given')
        rounds = None if iterations is None else _whole(iterations)
        self._watch_plan(lambda stop, done: self._grow(rounds, stop, done), animate, progress, verbose, summary, movie,
                         stop)

    def curve(self, path: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the curve that a robot drives along a path of this lattice.

        Parameters
        ----------
        path : (N, 3) array_like [cells, cells, rad]
            As `query` returns it. Where no motion joins two of its configurations the curve is straight.

        Returns
        -------
        curve : (P, 3) ndarray [cells, cells, rad]
            Poses, those of the path among them, on arcs at most 0.1 cells apart. The heading is the robot's own:
            backwards it is opposite to the way it goes.
        directions : (P,) ndarray
            1 where the robot arrives at a pose forwards, -1 where backwards.

        Examples
        --------
        >>> curve, directions = LatticePlanner().curve([(0, 0, 0), (1, 0, 0), (2, 1, np.pi / 2)])
        >>> curve[[0, 1, 9, -1]].round(2)
        array([[0.  , 0.  , 0.  ],
               [1.  , 0.  , 0.  ],
               [1.71, 0.29, 0.79],
               [2.  , 1.  , 1.57]])
        """
        path = numbers(path, 'path')
        if path.ndim != 2 or path.shape[1] != 3:
            raise InvalidInput(f'a path of shape {path.shape} is not one of configurations (N, 3)')
        return self._motions.curve(path)

    def has_plan(self) -> bool:
        """Return True: a graph serves every goal, and a new goal is no reason to grow another."""
        return True

    def _grow(self, iterations, stop, done):
        root = self.validate_endpoint(self._root, name='root')
        lattice = self._lattice
        if lattice is None:
            half = iterations * max(max(map(abs, motion.end)) for motion in self._motions.primitives)
            if (2 * half + 1) ** 2 > MAX_CELLS:
                raise LimitExceeded(f'{iterations} iterations could reach more than {MAX_CELLS} cells')
            lattice = StateLattice(np.zeros((2 * half + 1, 2 * half + 1), bool), root[:2].astype(int) - half,
                                   self._motions, self._corner_cutting)
        heading = self._heading(root, _SAME_HEADING, 'root')
        self._planned = lattice.grown(lattice.state(root[:2].astype(int), heading), iterations, stop, done)

    def _solve(self, start, stop):
        """Return the path (N, 3) and its status."""
        goal = self.goal
        if goal is None:
            raise InvalidInput('no goal was given')
        lattice = self._planned or self._lattice
        if lattice is None:
            raise RuntimeError('no plan, and no grid to search: call plan() first')
        ends = []
        for name, end in (('start', start), ('goal', goal)):
            heading = -1 if len(end) == 2 else self._heading(end, _SAME_HEADING, name)
            ends.append((end[:2].astype(int), heading))
            if not lattice.has_vertex(*ends[-1]):
                if lattice.is_filled:
                    raise NoPath(f'{name} {_text(end)} cannot be reached from root {_text(self._root)}')
                raise InvalidInput(f'{name} {_text(end)} is not in the lattice grown from root {_text(self._root)}')
        motions, states, cost = lattice.cheapest(*ends, stop)
        if motions is None:
            raise NoPath(f'no path leads from start {_text(start)} to goal {_text(goal)}')
        names = lattice.names(motions, states)
        taken, costs = [self._motions.primitives[i] for i in motions], self._motions.costs[motions].tolist()
        edges = [LatticeEdge(*row, motion.code, motion.length)
                 for *row, motion in zip(names, names[1:], costs, taken)]
        return self._configurations(lattice, states), LatticeStatus(cost, [edge.move for edge in edges], edges)

    def _heading(self, pose, tolerance, name):
        """Return the index of the lattice's heading nearest to a pose's, or raise InvalidInput if it is too far."""
        heading, off = self._motions.nearest_headings(pose[2])
        if not np.isfinite(off):
            raise InvalidInput(f'{name} {_text(pose)} has a heading that is not finite')
        if off > tolerance:
            raise InvalidInput(f'{name} {_text(pose)} is in none of the {len(self.angles)} headings of the lattice, '
                               f'the nearest is {self.angles[heading]:.6g} rad')
        return int(heading)

    def _configurations(self, lattice, states):
        """Return the configurations (N, 3) of states."""
        cells, headings = lattice.cells_and_headings(states)
        return np.column_stack([cells.astype(float), self.angles[headings]])

    def _require_plan(self):
        if self._planned is None:
            raise RuntimeError('no graph: call plan() first')
        return self._planned

    def _facts(self):
        radius = min(motion.radius for motion in self._motions.primitives)
        graph = 'none' if self._planned is None else '{} vertices and {} edges from root {}'.format(
            len(self._planned.vertices), self._planned.edges, _text(self._root))
        return [*super()._facts(), f'headings: {len(self.angles)}', f'turning radius: {radius:.4g} cells',
                f'graph: {graph}']


def _whole(iterations):
    """Return a number of iterations as an int."""
    number = numbers(iterations, 'iterations')
    if number.ndim or not 0 <= number < np.inf or number % 1:
        raise InvalidInput(f'iterations {iterations!r} is not a whole number of at least 0')
    return int(number)


def _text(configuration):
    return '({})'.format(', '.join(f'{value:.6g}' for value in np.asarray(configuration, float)))
