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
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from mobile_planning.world.environment import Environment

#: Distance of places [m], of those that are joined by an edge, and by a long one where a short one does not do.
SPACING, REACH, LONG_REACH = 0.5, 0.8, 1.4
#: Room that an edge leaves beside the body [m], and the least that counts as room.
MARGIN, TIGHT = 0.03, 0.012
#: Nobody passes anybody where the middle has less than a diameter of the body and this [m] within this distance [m].
_PASSING, _ASIDE = 0.05, 0.3
#: A long edge is worth it where the way round is so many times as long.
_ROUND = 2.5
#: A passage is a lane where the way round is longer by this [m].
_DETOUR = 4.0
#: Samples of the room: the radius is four cells, unless that makes more nodes than this.
_FINE, _NODES = 4.0, 1 << 18
#: Between samples of a segment [m].
_STEP = 0.05
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
        self._low, self._cell = low, max(self.radius / _FINE, np.sqrt(np.prod(high - low) / _NODES))
        columns, rows = np.maximum(np.ceil((high - low) / self._cell).astype(int), 1) + 1
        nodes = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1) * self._cell + low
        room = environment.clearance(nodes)
        narrow = self._narrow(room)
        self.places = self._spread(nodes, room, narrow)
        self.edges, self.rooms = self._join(narrow)
        self._lanes = self._lanes_of(narrow)
        self._conflicts: dict[float, tuple] = {}

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

    def near(self, points: ArrayLike, reach: float = REACH) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the pairs of a point of ``points`` (N, 2) and a place within ``reach`` [m]: two (K,) indices."""
        found = cKDTree(self.places).query_ball_point(np.asarray(points, float).reshape(-1, 2), reach)
        counts = [len(each) for each in found]
        return np.repeat(np.arange(len(found)), counts), np.concatenate([*map(np.sort, found), []]).astype(np.int64)

    def conflicts(self, distance: float) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Return which places (n, n) are nearer than ``distance`` [m] to others, and which edges to places (m, n)."""
        if distance not in self._conflicts:
            tree, count = cKDTree(self.places), len(self.places)
            close, swept = np.eye(count, dtype=bool), np.zeros((len(self.edges), count), bool)
            pairs = tree.query_pairs(distance, output_type='ndarray')
            close[pairs[:, 0], pairs[:, 1]] = close[pairs[:, 1], pairs[:, 0]] = True
            ends = self.places[self.edges]
            halves = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
            near = tree.query_ball_point(ends.mean(axis=1), halves + distance)
            edges = np.repeat(np.arange(len(near)), [len(each) for each in near])
            places = np.concatenate([*near, []]).astype(np.int64)
            a, b, points = ends[edges, 0], ends[edges, 1], self.places[places]
            along = b - a
            share = np.clip(((points - a) * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
            hit = np.linalg.norm(points - a - share[:, None] * along, axis=1) < distance
            swept[edges[hit], places[hit]] = True
            self._conflicts[distance] = close, swept
        return self._conflicts[distance]

    def lane_at(self, points: ArrayLike) -> NDArray[np.int64]:
        """Return in which lane each point (N, 2) [m] is, 0 for none."""
        cells = np.rint((np.asarray(points, float).reshape(-1, 2) - self._low) / self._cell).astype(np.int64)
        columns, rows = np.clip(cells, 0, np.array(self._lanes.shape[::-1]) - 1).T
        return self._lanes[rows, columns].astype(np.int64)

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
        return self._with(places[(room >= self.radius + TIGHT) & (others >= 0.0) & is_tight])

    def _with(self, places):
        """Return the roadmap with more places, joined to what is near."""
        more = copy(self)
        more._conflicts, count = {}, len(self.places)
        more.places = np.concatenate([self.places, places])
        who, where = more.near(places)
        who = who + count
        edges, rooms = more._edges(np.column_stack([where, who])[where < who], TIGHT)
        more.edges, more.rooms = np.concatenate([self.edges, edges]), np.append(self.rooms, rooms)
        return more

    # How it is made

    def _narrow(self, room):
        """Return where (h, w) a body fits and nobody can pass it."""
        size = int(_ASIDE / self._cell + 1e-9)
        x, y = np.meshgrid(*[np.arange(-size, size + 1)] * 2)
        best = maximum_filter(room, footprint=x**2 + y**2 <= size**2 + 1e-9, mode='nearest')
        return (room >= self.radius + TIGHT) & (best < 2 * self.widest + _PASSING)

    def _spread(self, nodes, room, narrow):
        """Return places (n, 2) a distance apart: the middles of what is narrow first, then row by row."""
        ridge = room >= maximum_filter(room, 3, mode='nearest') - 0.4 * self._cell
        # A place in the open has room for the edges that end there; in a tight passage there may be no such place.
        is_open = (room >= self.radius + MARGIN) | narrow & ridge
        rows, columns = np.nonzero(is_open)
        turn = np.lexsort((-room[rows, columns] * narrow[rows, columns], ~(narrow & ridge)[rows, columns]))
        size = int(SPACING / self._cell)
        x, y = np.meshgrid(*[np.arange(-size, size + 1)] * 2)
        apart = (np.hypot(x, y) * self._cell >= SPACING - 1e-6)
        left = np.pad(is_open, size)
        places = []
        for row, column in zip(rows[turn].tolist(), columns[turn].tolist()):
            if left[row + size, column + size]:
                places.append(nodes[row, column])
                left[row:row + 2 * size + 1, column:column + 2 * size + 1] &= apart
        return np.array(places).reshape(-1, 2)

    def _join(self, narrow):
        """Return edges (m, 2) and their rooms (m,).

        Long and tight ones are there only where they join what is apart, or save a long way to a narrow place: of a
        lattice that begins anywhere no node need be just before a door.
        """
        edges, rooms = self._edges(self._pairs(REACH), MARGIN)
        graph = self._graph(edges)
        parts = connected_components(graph, directed=False)[1]
        columns, rows = np.rint((self.places - self._low) / self._cell).astype(int).T
        tight = np.flatnonzero(narrow[rows, columns])
        pairs = self._pairs(LONG_REACH)
        apart = parts[pairs[:, 0]] != parts[pairs[:, 1]]
        if len(tight):
            around = dijkstra(graph, directed=False, indices=tight, limit=_ROUND * LONG_REACH)
            turn = np.full(len(self.places), -1)
            turn[tight] = np.arange(len(tight))
            for ends in (pairs, pairs[:, ::-1]):
                row = turn[ends[:, 0]]
                straight = np.linalg.norm(self.places[ends[:, 0]] - self.places[ends[:, 1]], axis=1)
                apart |= (row >= 0) & (around[row, ends[:, 1]] > _ROUND * straight)
        more, more_rooms = self._edges(pairs[apart], TIGHT)
        return np.concatenate([edges, more]), np.append(rooms, more_rooms)

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
    a, b, points = (np.asarray(each, float).reshape(-1, 2) for each in (a, b, points))
    along, offset = (b - a)[:, None], points - a[:, None]
    squared = np.maximum((along**2).sum(axis=2), 1e-18)
    share = np.clip((along * offset).sum(axis=2) / squared, 0.0, 1.0)
    return np.linalg.norm(offset - share[..., None] * along, axis=2)
