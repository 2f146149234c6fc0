"""A lattice of the room that a world leaves, with its nodes drawn to the middle of what is tight.

No row of a lattice need lie in the middle of a door. Where a node sees too little room to tell whether a body fits, the
square around it is looked at more closely, and the node moves to the best place in it; along a tight passage these
places are on the medial axis (Blum, A transformation for extracting new descriptors of shape, 1967).
"""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter

from mobile_planning.world.environment import Environment

#: So many places in a row of a square that is looked at more closely.
_CLOSER = 9
#: Where the room grows by this share of a cell towards a neighbour, there is a wall on one side only.
_SLOPE = 0.9
#: Looked at on the way from node to node, where the room at both ends does not prove that there is some.
_BETWEEN = np.array([0.25, 0.5, 0.75])
#: A way that leaves so much more room than is needed [m] counts as long as it is, one without so many times as long.
_COMFORT, _TIGHT_COST = 0.1, 3.0
#: Steps to a neighbour, in rows and columns; two straight and two diagonal ones, and what these cost.
_MOVES = (0, 1), (1, 0), (1, 1), (1, -1)
_STRAIGHT, _DIAGONAL = 5, 7


class RoomLattice:
    """Nodes for the centre of a disc, and which neighbours it can move between.

    Parameters
    ----------
    environment : Environment
        With a boundary or a grid, which give its extent.
    need : float [m]
        Room that the centre needs. A passage is found, wherever it lies, if it leaves a tenth of a cell more.
    cell : float [m]
        Distance of the nodes, not much more than a quarter of ``need``.

    Attributes
    ----------
    low : (2,) ndarray [m]
        Of the node in the first row and column.
    cell : float [m]
    places : (h, w, 2) ndarray [m]
        Each in the square of its node.
    rooms : (h, w) ndarray [m]
        How far the nearest thing static is from them.
    is_drawn : (h, w) ndarray of bool
        Which were drawn away from their nodes.

    Raises
    ------
    InvalidInput
        If the world has no extent.

    Examples
    --------
    >>> from mobile_planning import Boundary
    >>> lane = RoomLattice(Environment(Boundary((0, 2), (0, 0.45))), need=0.22, cell=0.05)
    >>> free = lane.rooms >= 0.22
    >>> bool(free.any()), np.unique(lane.places[free][:, 1].round(3)).tolist()
    (True, [0.225])
    """

    def __init__(self, environment: Environment, need: float, cell: float):
        low, high = np.reshape(environment.bounds, (2, 2))
        columns, rows = np.maximum(np.ceil((high - low) / cell).astype(int), 1) + 1
        self._environment, self._need, self.low, self.cell = environment, need, low, cell
        self.places = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1) * cell + low
        self.rooms = environment.clearance(self.places)
        self.is_drawn = np.zeros(self.rooms.shape, bool)
        self._draw()

    def _draw(self):
        """Move the nodes of what is tight to the best place around them."""
        is_between = maximum_filter(self.rooms, 3, mode='nearest') - self.rooms < _SLOPE * self.cell
        is_tight = (self.rooms >= self._need - self.cell / np.sqrt(2)) & (self.rooms < self._need + self.cell)
        tight = np.flatnonzero(is_between & is_tight)
        # Within the square, so that the place is still that of its node.
        offsets = 0.999 * np.linspace(-self.cell / 2, self.cell / 2, _CLOSER)
        closer = np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
        # The node itself comes first: where nothing is better it stays.
        closer = closer[np.argsort(np.hypot(*closer.T), kind='stable')]
        looked_at = self.places.reshape(-1, 2)[tight, None] + closer
        rooms = self._environment.clearance(looked_at)
        best = rooms.argmax(axis=1)[:, None]
        self.places.reshape(-1, 2)[tight] = np.take_along_axis(looked_at, best[..., None], axis=1)[:, 0]
        self.rooms.ravel()[tight] = np.take_along_axis(rooms, best, axis=1)[:, 0]
        self.is_drawn.ravel()[tight] = best[:, 0] > 0

    def cells(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return column and row (N, 2) of the node in whose square each point (N, 2) [m] is."""
        cells = np.rint((points - self.low) / self.cell).astype(np.int64)
        return np.clip(cells, 0, np.array(self.rooms.shape[::-1]) - 1)

    def steps(self) -> NDArray[np.uint8]:
        """Return what a step to each neighbour costs (8, h, w), 0 where there is no room; see the kernel `spread`."""
        steps = np.zeros((8, *self.rooms.shape), np.uint8)
        lacking = np.clip(1.0 - (self.rooms - self._need) / _COMFORT, 0.0, 1.0)
        factors = 1.0 + (_TIGHT_COST - 1.0) * lacking
        for move, (rows, columns) in enumerate(_MOVES):
            first, second = _neighbours(self.rooms.shape, rows, columns)
            is_open = self._has_way(first, second)
            cost = np.rint((_STRAIGHT, _DIAGONAL)[move // 2] * np.maximum(factors[first], factors[second]))
            steps[move][first] = steps[move + 4][second] = np.where(is_open, cost, 0)
        return steps

    def _has_way(self, first, second):
        """Return between which pairs of nodes there is room all the way."""
        rooms = self.rooms[first] + self.rooms[second]
        way = np.minimum(self.rooms[first], self.rooms[second]) >= self._need
        # Room changes by no more than the length of a step, and a node is drawn by half a diagonal at most.
        doubtful = np.nonzero(way & (rooms < 2 * (self._need + np.sqrt(2) * self.cell)))
        a, b = self.places[first][doubtful], self.places[second][doubtful]
        is_unproved = rooms[doubtful] - np.hypot(*(b - a).T) < 2 * self._need
        a, b, doubtful = a[is_unproved], b[is_unproved], tuple(axis[is_unproved] for axis in doubtful)
        between = a[:, None] + _BETWEEN[:, None] * (b - a)[:, None]
        way[doubtful] = (self._environment.clearance(between) >= self._need).all(axis=1)
        return way


class Neighbourhoods:
    """The nodes that are nearer to each of some nodes than to the others, and the ways from one of these to the next.

    Parameters
    ----------
    lattice : RoomLattice
    sources : (n,) ndarray of int
        Numbers of nodes, row by row.

    Attributes
    ----------
    pairs : (k, 2) ndarray of int
        Indices of sources, the lower one first, whose neighbourhoods touch; in order.
    """

    def __init__(self, lattice: RoomLattice, sources: NDArray[np.int64]):
        from mobile_planning.fleet import room_lattice_kernels as kernels

        self._places, shape = lattice.places.reshape(-1, 2), lattice.rooms.shape
        steps = lattice.steps()
        owners, costs = np.empty(shape, np.int32), np.empty(shape, np.int32)
        self._before = np.empty(shape, np.int64)
        kernels.spread(steps, np.ascontiguousarray(sources, np.int64), owners, costs, self._before)
        numbers, found = np.arange(owners.size).reshape(shape), []
        for move, (rows, columns) in enumerate(_MOVES):
            first, second = _neighbours(shape, rows, columns)
            meets = (steps[move][first] > 0) & (owners[first] != owners[second])
            total = costs[first][meets] + costs[second][meets] + steps[move][first][meets]
            found.append(np.column_stack([owners[first][meets], owners[second][meets], total,
                                          numbers[first][meets], numbers[second][meets]]))
        found = np.concatenate(found).astype(np.int64)
        turned = found[:, 0] > found[:, 1]
        found[turned] = found[turned][:, [1, 0, 2, 4, 3]]
        found = found[np.lexsort(found.T[::-1])]
        is_first = np.append(True, (np.diff(found[:, :2], axis=0) != 0).any(axis=1))[:len(found)]
        self.pairs, self._meetings = found[is_first, :2], found[is_first, 3:]

    def way(self, index: int) -> NDArray[np.float64]:
        """Return the places (W, 2) [m] on the cheapest way from one source of a pair to the other."""
        halves = []
        for node in self._meetings[index].tolist():
            half = [node]
            while self._before.flat[half[-1]] >= 0:
                half.append(int(self._before.flat[half[-1]]))
            halves.append(half)
        return self._places[halves[0][::-1] + halves[1]]


def _neighbours(shape, rows, columns):
    """Return the slices of all nodes that have a neighbour so many rows and columns on, and of those neighbours."""
    first = slice(0, shape[0] - rows), slice(max(-columns, 0), shape[1] - max(columns, 0))
    second = slice(rows, shape[0]), slice(max(columns, 0), shape[1] - max(-columns, 0))
    return first, second
