"""A sparse roadmap of the room that a world leaves: places to stand and straight ways between them.

Narrow passages come first: whoever must let others by has to know where two cannot pass.
"""
from __future__ import annotations

from collections.abc import Sequence
from copy import copy

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import label, maximum_filter
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from mobile_planning.fleet.room_lattice import Neighbourhoods, RoomLattice
from mobile_planning.world.environment import Environment

#: Distance of places [m], of those that are joined by an edge, and by a long one where a short one does not do.
SPACING, REACH, LONG_REACH = 0.5, 0.8, 1.4
#: Room that an edge leaves beside the body [m], and the least that counts as room.
MARGIN, TIGHT = 0.03, 0.012
#: Nobody passes anybody where the middle has less than a diameter of the body and this [m] within this distance [m].
_PASSING, _ASIDE = 0.05, 0.3
#: Where edges lead a way round that is so many times as long as it must be, more are laid.
_ROUND = 2.0
#: The lattice leaves so much more room [m] than edges need, which are looked at in other places.
_SPARE = 0.001
#: A passage is a lane where the way round is longer by this [m].
_DETOUR = 4.0
#: Samples of the room: the radius is four cells, unless that makes more nodes than this.
_FINE, _NODES = 4.0, 1 << 18
#: Between samples of a segment, and what is as good as none [m].
_STEP, _ROUNDING = 0.05, 1e-4
#: Places around a disc, and how much farther out than they must be [m].
_AROUND, _BEYOND = 20, 0.003


class Roadmap:
    """Places where a disc can stand, edges along which it can move, and the lanes among them.

    Parameters
    ----------
    environment : Environment
        With a boundary or a grid, which give its extent.
    radius : float [m]
        Of the smallest body that uses it.
    widest : float [m], optional
        Radius of the largest; by default they are all alike.

    Attributes
    ----------
    places : (n, 2) ndarray [m]
    spread : int
        So many of the places are a distance apart; the others are where a way between them bends.
    edges : (m, 2) ndarray of int
        Indices of the places that each edge joins.
    rooms : (m,) ndarray [m]
        How far the nearest thing static is from each edge.

    Raises
    ------
    InvalidInput
        If the world has no extent.

    Examples
    --------
    >>> from mobile_planning import Boundary
    >>> room = Roadmap(Environment(Boundary((0, 3), (0, 2))), radius=0.2)
    >>> len(room.places), bool(room.rooms.min() > 0.2), room.lane_at([(1, 1)]).tolist()
    (22, True, [0])
    """

    def __init__(self, environment: Environment, radius: float, widest: float | None = None):
        self.environment, self.radius = environment, float(radius)
        self.widest = self.radius if widest is None else float(widest)
        low, high = np.reshape(environment.bounds, (2, 2))
        cell = max(self.radius / _FINE, float(np.sqrt(np.prod(high - low) / _NODES)))
        self._lattice = RoomLattice(environment, self.radius + TIGHT + _SPARE, cell)
        narrow = self._narrow(self._lattice.rooms)
        nodes = self._spread(narrow)
        self.places, self.spread = self._lattice.places.reshape(-1, 2)[nodes], len(nodes)
        self.edges, self.rooms = self._edges(self._pairs(REACH), MARGIN)
        self._lay_ways(Neighbourhoods(self._lattice, nodes))
        self._join_bends()
        self._lanes = self._lanes_of(narrow)
        self._conflicts: dict[float, tuple] = {}
        self._tree: cKDTree | None = None

    # What can be asked

    def room_along(self, a: ArrayLike, b: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return how far the nearest thing static is from each segment from ``a`` to ``b`` (K, 2), and from ``a``.

        Returns
        -------
        (K,) ndarray [m], (K,) ndarray [m]
        """
        a, b = np.asarray(a, float).reshape(-1, 2), np.asarray(b, float).reshape(-1, 2)
        if not len(a):
            return np.empty(0), np.empty(0)
        count = int(np.ceil(np.linalg.norm(b - a, axis=1).max() / _STEP)) + 2
        shares = np.linspace(0.0, 1.0, count)[:, None, None]
        rooms = self.environment.clearance(a + shares * (b - a))
        return rooms.min(axis=0), rooms[0]

    def has_room(self, a: ArrayLike, b: ArrayLike, need: ArrayLike) -> NDArray[np.bool_]:
        """Return whether all that is static is ``need`` (K,) [m] from each segment from ``a`` to ``b`` (K, 2).

        Who stands at ``a`` already may come a little nearer to what is as near as that there.
        """
        a, b = np.asarray(a, float).reshape(-1, 2), np.asarray(b, float).reshape(-1, 2)
        at_a, at_b = self.environment.clearance(np.stack([a, b]))
        need = np.minimum(need, at_a - _ROUNDING)
        # Along a segment the room changes by no more than the way does.
        found = (at_a + at_b - np.linalg.norm(b - a, axis=1)) / 2 >= need
        doubtful = np.flatnonzero(~found & (at_b >= need))
        found[doubtful] = self.room_along(a[doubtful], b[doubtful])[0] >= need[doubtful]
        return found

    def near(self, points: ArrayLike, reach: float = REACH) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the pairs of a point of ``points`` (N, 2) and a place within ``reach`` [m]: two (K,) indices."""
        if self._tree is None:
            self._tree = cKDTree(self.places)
        found = self._tree.query_ball_point(np.asarray(points, float).reshape(-1, 2), reach)
        counts = [len(each) for each in found]
        return np.repeat(np.arange(len(found)), counts), np.concatenate([*map(np.sort, found), []]).astype(np.int64)

    def conflicts(self, distance: float) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return what is nearer than ``distance`` [m]: pairs of places (2, K), both ways, and of edge and place (2, L).

        A place is near itself. As tables, which are mostly empty, these take 12 MB for the depot.
        """
        if distance not in self._conflicts:
            tree, every = cKDTree(self.places), np.arange(len(self.places))
            pairs = tree.query_pairs(distance, output_type='ndarray').T
            close = np.concatenate([np.stack([every, every]), pairs, pairs[::-1]], axis=1)
            ends = self.places[self.edges]
            halves = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
            near = tree.query_ball_point(ends.mean(axis=1), halves + distance)
            edges = np.repeat(np.arange(len(near)), [len(each) for each in near])
            places = np.concatenate([*near, []]).astype(np.int64)
            a, b, points = ends[edges, 0], ends[edges, 1], self.places[places]
            along = b - a
            share = np.clip(((points - a) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
            hit = np.linalg.norm(points - a - share[:, None] * along, axis=1) < distance
            self._conflicts[distance] = close.astype(np.int32), np.stack([edges[hit], places[hit]]).astype(np.int32)
        return self._conflicts[distance]

    def lane_at(self, points: ArrayLike) -> NDArray[np.int64]:
        """Return in which lane each point (N, 2) [m] is, 0 for none."""
        columns, rows = self._lattice.cells(np.asarray(points, float).reshape(-1, 2)).T
        return self._lanes[rows, columns].astype(np.int64)

    def lane_extent(self, lane: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the least and the greatest x and y (2,) [m] of what `lane_at` takes for a lane, or a little more."""
        nodes, low, cell = np.argwhere(self._lanes == lane)[:, ::-1], self._lattice.low, self._lattice.cell
        return low + (nodes.min(axis=0) - 1) * cell, low + (nodes.max(axis=0) + 1) * cell

    @property
    def has_lanes(self) -> bool:
        """Whether there are passages in which nobody passes anybody, and that cannot be driven round."""
        return bool(self._lanes.any())

    def beside(self, discs: Sequence[tuple[ArrayLike, float]], gap: float) -> Roadmap:
        """Return the roadmap with places all around ``discs`` where it is narrow beside them.

        A lattice need have no place between a wall and a body that stands somewhere.

        Parameters
        ----------
        discs : sequence of ((2,) array_like [m], float [m])
            Places and radii of those who stand.
        gap : float [m]
            To be left between them and the largest body.
        """
        if not len(discs):
            return self
        centres = np.array([place for place, _ in discs], float)
        need = np.array([radius for _, radius in discs], float) + self.widest + gap
        angles = 2 * np.pi / _AROUND * np.arange(_AROUND)
        # From one to the next in a straight line, it comes nearer than at both.
        rings = need / np.cos(np.pi / _AROUND) + _BEYOND
        places = centres[:, None] + rings[:, None, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        places = places.reshape(-1, 2)
        room = self.environment.clearance(places)
        apart = np.linalg.norm(places[:, None] - centres, axis=2) - need
        is_own = np.arange(len(places))[:, None] // _AROUND == np.arange(len(centres))
        others = np.where(is_own, np.inf, apart).min(axis=1)
        is_tight = np.minimum(room - self.widest, others) < SPACING
        return self.with_places(places[(room >= self.radius + TIGHT) & (others >= 0.0) & is_tight])

    def with_places(self, places: NDArray[np.float64], reach: float = REACH) -> Roadmap:
        """Return the roadmap with more ``places`` (N, 2) [m], joined to what is within ``reach`` [m]."""
        more = copy(self)
        more._conflicts, more._tree, count = {}, None, len(self.places)
        more.places = np.concatenate([self.places, places])
        who, where = more.near(places, reach)
        who = who + count
        edges, rooms = more._edges(np.column_stack([where, who])[where < who], TIGHT)
        more.edges, more.rooms = np.concatenate([self.edges, edges]), np.append(self.rooms, rooms)
        return more

    # How it is made

    def _narrow(self, room):
        """Return where (h, w) a body fits and nobody can pass it."""
        size = int(_ASIDE / self._lattice.cell + 1e-9)
        x, y = np.meshgrid(*[np.arange(-size, size + 1)] * 2)
        best = maximum_filter(room, footprint=x**2 + y**2 <= size**2 + 1e-9, mode='nearest')
        return (room >= self.radius + TIGHT) & (best < 2 * self.widest + _PASSING)

    def _spread(self, narrow):
        """Return the numbers (n,) of nodes a distance apart: the middles of what is narrow first, then row by row."""
        lattice = self._lattice
        room, cell = lattice.rooms, lattice.cell
        ridge = narrow & (room >= maximum_filter(room, 3, mode='nearest') - 0.4 * cell)
        # A place in the open has room for the edges that end there; in a tight passage there may be no such place.
        is_open = (room >= self.radius + MARGIN) & ~lattice.is_drawn | ridge
        size = int(SPACING / cell) + 1
        x, y = np.meshgrid(*[np.arange(-size, size + 1)] * 2)
        apart = np.hypot(x, y) * cell >= SPACING - 1e-6
        left, places = np.pad(is_open, size), np.pad(lattice.places, ((size, size), (size, size), (0, 0)))
        widest_first = np.argsort(-room[ridge], kind='stable')
        middles, others = np.flatnonzero(ridge)[widest_first], np.flatnonzero(is_open & ~ridge)
        nodes = []
        for node in [*middles.tolist(), *others.tolist()]:
            row, column = divmod(node, room.shape[1])
            if not left[row + size, column + size]:
                continue
            nodes.append(node)
            around = slice(row, row + 2 * size + 1), slice(column, column + 2 * size + 1)
            if ridge[row, column]:
                # It need not be in the middle of its square, nor need those around.
                left[around] &= np.hypot(*(places[around] - lattice.places[row, column]).T).T >= SPACING
            else:
                left[around] &= apart
        return np.array(nodes, np.int64)

    def _lay_ways(self, around):
        """Lay edges, with places where they bend, between neighbours that are a long way round from each other."""
        pairs, graph = around.pairs, self._graph(self.edges)
        lengths = np.linalg.norm(self.places[pairs[:, 0]] - self.places[pairs[:, 1]], axis=1)
        asked = np.flatnonzero(~self._are_joined(pairs))
        first, row = np.unique(pairs[asked, 0], return_inverse=True)
        if len(asked):
            found = dijkstra(graph, directed=False, indices=first, limit=2 * _ROUND * LONG_REACH)
            asked = asked[found[row, pairs[asked, 1]] > _ROUND * lengths[asked]]
        for index in asked[np.argsort(lengths[asked], kind='stable')].tolist():
            (a, b), way = pairs[index], around.way(index)
            limit = _ROUND * float(np.hypot(*np.diff(way, axis=0).T).sum())
            if not np.isfinite(dijkstra(self._graph(self.edges), directed=False, indices=a, limit=limit)[b]):
                self._lay(way, a, b)

    def _lay(self, way, a, b):
        """Lay edges along ``way`` (W, 2) from place ``a`` to place ``b``, as few as keep its room or a margin."""
        steps, _ = self.room_along(way[:-1], way[1:])
        here, at = a, 0
        while at < len(way) - 1:
            ahead = way[at + 1:]
            rooms, _ = self.room_along(np.broadcast_to(way[at], ahead.shape), ahead)
            least = np.minimum(np.minimum.accumulate(steps[at:]), self.radius + MARGIN)
            is_good = (rooms >= least) & (np.hypot(*(ahead - way[at]).T) <= LONG_REACH)
            # The next one is all that the lattice vouches for.
            index = int(np.flatnonzero(is_good).max(initial=0))
            at += index + 1
            there = b
            if at < len(way) - 1:
                there, self.places = len(self.places), np.concatenate([self.places, way[at:at + 1]])
            self.edges = np.concatenate([self.edges, [sorted((here, there))]])
            self.rooms, here = np.append(self.rooms, rooms[index]), there

    def _join_bends(self):
        """Lay edges between the places where ways bend and all that is near and in sight."""
        pairs = self._pairs(REACH)
        pairs = pairs[(pairs >= self.spread).any(axis=1)]
        edges, rooms = self._edges(pairs[~self._are_joined(pairs)], MARGIN)
        self.edges, self.rooms = np.concatenate([self.edges, edges]), np.append(self.rooms, rooms)

    def _pairs(self, reach):
        """Return the pairs (k, 2) of places within ``reach``, in order."""
        if len(self.places) < 2:
            return np.empty((0, 2), np.int64)
        pairs = cKDTree(self.places).query_pairs(reach + 1e-9, output_type='ndarray').astype(np.int64)
        return pairs[np.lexsort(pairs.T[::-1])]

    def _edges(self, pairs, margin):
        rooms, _ = self.room_along(*self.places[pairs.T])
        has_room = rooms >= self.radius + margin
        return pairs[has_room], rooms[has_room]

    def _are_joined(self, pairs):
        """Return which pairs (k, 2), the lower first, have an edge."""
        first = len(self.places)
        return np.isin(pairs @ (first, 1), self.edges @ (first, 1))

    def _graph(self, edges):
        count = len(self.places)
        lengths = np.linalg.norm(self.places[edges[:, 0]] - self.places[edges[:, 1]], axis=1)
        return csr_matrix((lengths, edges.T), shape=(count, count))

    def _lanes_of(self, narrow):
        """Return the number of the lane at each node (h, w): narrow passages without a short way round."""
        pieces, count = label(narrow, np.ones((3, 3)))
        self._lanes = pieces.astype(np.int32)
        if not count or not len(self.edges):
            return np.zeros_like(self._lanes)
        ends = self.places[self.edges]
        along = ends[:, :1] + np.linspace(0.0, 1.0, 17)[:, None] * (ends[:, 1:] - ends[:, :1])
        through = self.lane_at(along).reshape(len(ends), -1)
        inside = self.lane_at(self.places)
        kept = np.zeros(count + 1, np.int32)
        for piece in np.unique(through[through > 0]):
            if not self._has_way_round(through == piece, inside == piece):
                kept[piece] = piece
        return kept[self._lanes]

    def _has_way_round(self, through, inside):
        """Return whether all that the piece joins is joined nearby too; ``through`` (m, s) samples, ``inside`` (n,)."""
        crossing = through.any(axis=1)
        mouths = np.unique(self.edges[crossing])
        mouths = mouths[~inside[mouths]]
        if len(mouths) < 2:
            return True
        spread = np.linalg.norm(np.ptp(self.places[mouths], axis=0))
        lengths = dijkstra(self._graph(self.edges[~crossing]), directed=False, indices=mouths[0],
                           limit=_DETOUR + 1.5 * spread)
        return bool(np.isfinite(lengths[mouths]).all())


def distances(a: ArrayLike, b: ArrayLike, points: ArrayLike) -> NDArray[np.float64]:
    """Return the distance from each segment from ``a`` to ``b`` (K, 2) to each point (M, 2): (K, M) [m].

    Examples
    --------
    >>> distances([(0, 0), (0, 1)], [(2, 0), (0, 1)], [(1, 1), (3, 0)]).round(3).tolist()
    [[1.0, 1.0], [1.0, 3.162]]
    """
    from mobile_planning.fleet.distance_kernels import to_segments

    return to_segments(*(np.ascontiguousarray(each, float).reshape(-1, 2) for each in (a, b, points)))
