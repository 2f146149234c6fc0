"""The states of a lattice on a grid, as integers, and what the kernels find among them."""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from copy import copy
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import Cancelled, LimitExceeded
from mobile_planning.grid.lattice_motions import LatticeMotions
from mobile_planning.grid.motion_primitives import octile_length
from mobile_planning.world.cost_to_go import cost_to_go

_FOR_EVER = 1 << 62


class StateLattice:
    """Cells times headings, the motions between them, and perhaps a graph grown from a root.

    A state is ``cell * headings + heading``; cells are counted along the rows of the grid with an occupied border
    around it that no motion can leave.

    Parameters
    ----------
    occupied : (h, w) ndarray of bool
    corner : (2,) sequence of int
        Cell (x, y) of ``occupied[0, 0]``.
    motions : LatticeMotions
    corner_cutting : bool

    Attributes
    ----------
    motions : LatticeMotions
    graph : (states,) ndarray of uint16, or None
        How each vertex was found, see `lattice_kernels`.
    vertices : (N,) ndarray of uint32
        States in the order in which they were found.
    expanded : int
        How many vertices, the first ones, have their motions in the graph.
    edges : int
    """

    MAX_STATES = (1 << 32) - 1

    def __init__(self, occupied: NDArray[np.bool_], corner: Sequence[int], motions: LatticeMotions,
                 corner_cutting: bool):
        self.motions, primitives, costs = motions, motions.primitives, motions.costs
        self._headings = headings = len(motions.angles)
        swept = [motion.swept_cells(corner_cutting) for motion in primitives]
        self._border = border = int(max(np.abs(cells).max() for cells in swept))
        height, width = np.add(occupied.shape, 2 * border).tolist()
        if height * width * headings > self.MAX_STATES:
            raise LimitExceeded(f'a lattice of {height * width * headings} states is above {self.MAX_STATES}')
        self._occupied = np.ones((height, width), np.uint8)
        self._occupied[border:height - border, border:width - border] = occupied
        self._corner = np.subtract(corner, border)
        self._first = np.searchsorted([motion.heading for motion in primitives], np.arange(headings + 1))
        shift = np.array([y * width + x for x, y in (motion.end for motion in primitives)])
        turned = [motion.end_heading - motion.heading for motion in primitives]
        self._step = shift * headings + turned
        self._octets = -(-int(np.diff(self._first).max()) // 8)
        self._bounds = np.cumsum([0, *map(len, swept)])
        self._swept = np.concatenate(swept) @ (1, width)
        # No motion costs less than this for each cell of the crow's flight, and of the octile path over its cells.
        self._per_cell = float(min(cost / np.hypot(*motion.end) for cost, motion in zip(costs, primitives)))
        lengths = [octile_length(motion, corner_cutting) for motion in primitives]
        self._per_step = float(min(costs / lengths)) * (1 - 1e-12)
        self._corner_cutting = corner_cutting
        self._field, self._free = (-1, None), None
        self.graph = self.vertices = None
        self.expanded, self.edges = 0, 0

    @property
    def is_filled(self) -> bool:
        """Whether there is a graph, and it has all that its root reaches."""
        return self.graph is not None and self.expanded == len(self.vertices)

    def state(self, cell: NDArray[np.int64], heading: int) -> int:
        """Return the state of a cell (x, y) and a heading, or -1 outside the grid."""
        x, y = (cell - self._corner).tolist()
        height, width = self._occupied.shape
        return (y * width + x) * self._headings + heading if 0 <= x < width and 0 <= y < height else -1

    def has_vertex(self, cell: NDArray[np.int64], heading: int) -> bool:
        """Return whether the graph has a state, in any heading if it is negative; without a graph it has all."""
        state = self.state(cell, max(heading, 0))
        if state < 0:
            return False
        return self.graph is None or bool(self.graph[state:state + (1 if heading >= 0 else self._headings)].any())

    def cells_and_headings(self, states: NDArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the cells (N, 2) and headings (N,) of states."""
        cells, headings = np.divmod(np.asarray(states, np.int64), self._headings)
        y, x = np.divmod(cells, self._occupied.shape[1])
        return np.column_stack([x, y]) + self._corner, headings

    def grown(self, root: int, iterations: int | None, stop: NDArray[np.uint8],
              done: NDArray[np.int64]) -> StateLattice:
        """Return this lattice with the graph that ``iterations`` rounds reach from the root.

        Raises
        ------
        Cancelled
            If ``stop`` was set.
        """
        from mobile_planning.grid import lattice_kernels as kernels

        free = self._free_motions(stop)
        lattice = copy(self)
        lattice.graph = np.zeros(self._occupied.size * self._headings, np.uint16)
        most = int((self._occupied == 0).sum()) * self._headings
        done[:] = 0, most
        lattice.vertices, lattice.expanded, lattice.edges, finished = kernels.grow(
            lattice.graph, free, most, root, _FOR_EVER if iterations is None else iterations, self._headings,
            self._octets, self._first, self._step, stop, done)
        if not finished:
            raise Cancelled('the lattice was stopped before it was complete')
        return lattice

    def names(self, motions: Sequence[int], states: Sequence[int]) -> list[str]:
        """Return the names of a path's vertices: the motions to each from the root, or from the start without a graph.

        Parameters
        ----------
        motions, states : sequence of int
            As `cheapest` returns them.
        """
        from mobile_planning.grid import lattice_kernels as kernels

        named = [motion.name for motion in self.motions.primitives]
        if self.graph is None:
            return list(accumulate([named[motion] for motion in motions], initial='0'))
        return ['0' + ''.join(named[motion] for motion in kernels.motions_from_root(self.graph, state, self._step))
                for state in states]

    def edges_by_motion(self) -> Iterator[tuple[int, NDArray[np.int64]]]:
        """Yield each motion with the cells (N, 2) from which it belongs to the graph."""
        states = self.vertices[:self.expanded].astype(np.int64)
        headings = states % self._headings
        for heading, begin in enumerate(self._first[:-1]):
            here = states[headings == heading]
            cells = self.cells_and_headings(here)[0]
            for i in range(self._first[heading + 1] - begin):
                yield begin + i, cells[self._free[here * self._octets + i // 8] >> i % 8 & 1 != 0]

    def cheapest(
        self, start: tuple[NDArray[np.int64], int], goal: tuple[NDArray[np.int64], int],
        stop: NDArray[np.uint8] | None = None,
    ) -> tuple[list[int] | None, list[int], float]:
        """Return the motions and states of the cheapest path, and its cost; None without a path.

        Parameters
        ----------
        start, goal : tuple of (2,) ndarray and int
            Cell (x, y) and heading; a negative heading of the goal means any.
        stop : (1,) ndarray of uint8, optional
            Set ``stop[0]`` from another thread to give up.

        Raises
        ------
        Cancelled
            If ``stop`` was set.
        """
        from mobile_planning.grid import lattice_kernels as kernels

        stop = np.zeros(1, np.uint8) if stop is None else stop
        states = self._occupied.size * self._headings
        goal_cell = self.state(goal[0], 0) // self._headings
        free, field = self._free_motions(stop), self._field_to(goal_cell, stop)
        # Untouched pages of both cost nothing.
        costs, came = np.empty(states), np.zeros(states, np.uint16)
        graph = np.empty(0, np.uint16) if self.graph is None else self.graph
        begin = self.state(*start)
        state, cost, _ = kernels.search(
            costs, came, graph, free, field, self._occupied.shape[1], begin, goal_cell, goal[1], self._headings,
            self._octets, self._per_step, self._per_cell, self._first, self._step, self.motions.costs, stop)
        if state == -2:
            raise Cancelled('the search of the lattice was stopped before it found a path')
        if state < 0:
            return None, [], np.inf
        # The search marks its start as a graph marks its root.
        motions = kernels.motions_from_root(came, state, self._step).tolist()
        return motions, np.cumsum([begin, *self._step[motions].tolist()]).tolist(), float(cost)

    def _free_motions(self, stop):
        """Return which motions of each state cross no occupied cell, found when first needed; see the kernels."""
        from mobile_planning.grid import lattice_kernels as kernels

        if self._free is None:
            free = np.zeros(self._occupied.size * self._headings * self._octets, np.uint8)
            if not kernels.find_free(free, self._occupied.ravel(), self._occupied.shape[1], self._border,
                                     self._headings, self._octets, self._first, self._bounds, self._swept, stop):
                raise Cancelled('the lattice was stopped before it was complete')
            self._free = free
        return self._free

    def _field_to(self, goal_cell, stop):
        """Return the lengths of octile paths to the goal's cell, those of the last goal kept."""
        known, field = self._field
        if known != goal_cell:
            y, x = divmod(goal_cell, self._occupied.shape[1])
            field = cost_to_go(self._occupied, (x, y), corner_cutting=self._corner_cutting, stop=stop).ravel()
            self._field = (goal_cell, field)
        return field
