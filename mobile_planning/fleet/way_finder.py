"""The way to a goal through a static world and around standing discs, and what of it is in sight.

The room that the world leaves is sampled on a lattice, and all that is said to be clear is proved from it.
"""
from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet.search_lattice import SearchLattice

#: How far from a place the nodes are that it is joined to, and that it falls back on where it sees none [cells].
_BESIDE, _NEAR = 3, 8
#: Nodes looked at for a way around discs; where it takes more, a field of the way is computed for them.
_LIMIT = 2000
_NO_DISCS, _NO_NODES = np.empty((0, 3)), np.empty(0, np.int64)


class WayFinder:
    """The way of a disc to one goal, on a lattice of the room around it.

    Discs are given as (P, 3): their places and how far the body's centre keeps from them [m].

    Parameters
    ----------
    lattice : SearchLattice
    goal : (2,) ndarray [m]

    Attributes
    ----------
    lattice, goal
        As given.

    Examples
    --------
    >>> from mobile_planning import Boundary, Environment, RoundObstacle
    >>> room = Environment(Boundary((0, 8), (0, 6)), [RoundObstacle((4, 3.1), 0.5)])
    >>> finder = WayFinder(SearchLattice(room, radius=0.2), np.array((7.0, 3.0)))
    >>> finder.way((1, 3))[[0, -1]].tolist(), finder.is_open((1, 3), (7, 3)), finder.is_open((1, 3), (3, 3))
    ([[1.0, 3.0], [7.0, 3.0]], False, True)
    """

    def __init__(self, lattice: SearchLattice, goal: NDArray):
        from mobile_planning.fleet import guidance_kernels, sight_kernels

        self._kernels, self._sight = guidance_kernels, sight_kernels
        self.lattice, self.goal = lattice, goal
        self._to_cells, self._to_metres, self._resolution = lattice.to_cells, lattice.to_metres, lattice.resolution
        self._squared, self._radius = lattice.squared, lattice.radius / lattice.resolution
        self._kept = None, None, True
        #: Room that the way leaves beside the body where there is some.
        self._comfort = 0.5 * self._radius

    def prepare(self) -> None:
        """Compute now what is else computed when it is first needed, for some ten milliseconds or more."""
        self._field, self._scratch

    def way(self, position: ArrayLike, discs: NDArray = _NO_DISCS) -> NDArray[np.float64]:
        """Return way-points (W, 2) [m] from ``position`` (2,) [m] to the goal, each in sight of the next.

        There are none where nothing leads to the goal. Where no way leads around all discs they are left out.
        """
        start, goal = self._to_cells(position), self._to_cells(self.goal)
        way = self._static_way(start, goal)
        if len(way):
            discs = self._in_cells(discs)
            # A disc never holds an end of the way.
            discs[:, 2] = np.minimum(discs[:, 2], ((discs[:, :2] - goal)**2).sum(axis=1))
            if not self._kernels.is_clear_way(discs, way):
                around = self._way_around(start, goal, discs)
                way = around if len(around) else way
        return np.concatenate([self._to_metres(way[:-1]), self.goal[None]]) if len(way) else way

    def drawn(self, way: NDArray, standing: NDArray, discs: NDArray, reach: NDArray) -> NDArray[np.float64]:
        """Return for each row of ``standing`` (M, 2) [m] the furthest point of a way (W, 2) [m] in sight of it.

        No further along the way than ``reach`` (M,) [m]. Where no point is in sight the row stays.
        """
        places = self._to_cells(standing)
        drawn = self._kernels.draw_ahead(
            self._squared, self._in_cells(discs), self._to_cells(way), bool((way[-1] == self.goal).all()), places,
            reach / self._resolution, self._radius)
        return np.where((drawn == places).all(axis=1, keepdims=True), standing, self._to_metres(drawn))

    def is_open(self, a: ArrayLike, b: ArrayLike, discs: NDArray = _NO_DISCS) -> bool:
        """Return whether the segment from ``a`` to ``b`` (2,) [m] has room for the body, or as much as ``a`` has."""
        return self._sight.is_open(self._squared, self._in_cells(discs), *self._to_cells(a), *self._to_cells(b),
                                   self._radius)

    def room(self, place: ArrayLike) -> float:
        """Return at least how far [m] the nearest thing static is from ``place`` (2,) [m]."""
        return float(np.sqrt(self._sight.room_at(self._squared, *self._to_cells(place)))) * self._resolution

    def _in_cells(self, discs):
        """Return discs with their places and squared distances in cells."""
        return np.column_stack([self._to_cells(discs[:, :2]), (discs[:, 2] / self._resolution)**2])

    def _static_way(self, start, end):
        """Return way-points (n, 2) [cells] through the static world, none if there is no way."""
        if self._sight.is_clear(self._squared, _NO_DISCS, *start, *end, (self._radius + self._comfort)**2):
            return np.stack([start, end])
        return self._by_field(start, end, self._field, _NO_DISCS)

    def _way_around(self, start, end, discs):
        """Return way-points (n, 2) [cells] around discs, none if there is no way."""
        near = discs.copy()
        near[:, 2] = np.minimum(discs[:, 2], ((discs[:, :2] - start)**2).sum(axis=1))
        nodes, _ = self._nodes_in_sight(start, near)
        way = self._kernels.way_around(self._squared, *self._field, near, nodes, np.stack([start, end]), self._radius,
                                       self._comfort, *self._scratch, _LIMIT)
        if len(way):
            return self._taut(start, way, end, near)
        return self._by_field(start, end, self._around(discs, self._nodes_in_sight(start, discs)[0]), discs)

    def _by_field(self, start, end, field, discs):
        nodes, distance = self._nodes_in_sight(start, discs)
        cost, anchors = field
        total = distance + cost.ravel()[nodes]
        if not len(total) or not np.isfinite(total.min()):
            return np.empty((0, 2))
        return self._taut(start, self._kernels.follow_anchors(anchors, nodes[total.argmin()]), end, discs)

    def _taut(self, start, way, end, discs):
        # The nodes lie outside the discs, but a step between two of them may cut a corner.
        shy = np.column_stack([discs[:, :2], np.maximum(np.sqrt(discs[:, 2]) - 0.25, 0.0)**2])
        way = np.concatenate([start[None], way, end[None]])
        # An end may be a node itself.
        way = way[np.append(True, np.abs(np.diff(way, axis=0)).max(axis=1) > 1e-6)]
        return self._kernels.pull_string(self._squared, shy, way, self._radius, self._comfort)

    @cached_property
    def _field(self):
        return self._new_field(_NO_DISCS, _NO_NODES)[0]

    def _around(self, discs, nodes):
        """Return the field around discs, at ``nodes`` at the least, from where somebody wants to know the way.

        The last one is kept, for whoever stands, stands long. Who asks for more of it gets the whole.
        """
        key = discs.tobytes()
        if self._kept[0] != key:
            self._kept = key, *self._new_field(discs, nodes)
        _, (cost, anchors), is_whole = self._kept
        if not is_whole and np.isinf(cost.ravel()[nodes]).any():
            self._kept = key, *self._new_field(discs, _NO_NODES)
        return self._kept[1]

    def _new_field(self, discs, wanted):
        """Return a field and whether it is the whole one.

        It is the cost from each node to the goal [cells], and the node where the way there bends first.
        """
        goal = self._to_cells(self.goal)
        ends, _ = self._nodes_in_sight(goal, discs)
        cost, anchors = np.full(self._squared.shape, np.inf), np.full(self._squared.shape, -1, np.int32)
        is_whole = self._kernels.spread(self._squared, discs, ends, wanted, *goal, self._radius, self._comfort, cost,
                                        anchors)
        return (cost, anchors), is_whole

    @cached_property
    def _scratch(self):
        """What a search has reached and knows, the same before and after each."""
        shape = self._squared.shape
        return np.full(shape, np.inf), np.zeros(shape, np.int8), np.zeros(shape, np.int32), np.zeros(shape, np.int8)

    def _nodes_in_sight(self, place, discs):
        """Return nodes (n,) beside a place [cells] and their distances (n,); one that is near where it sees none."""
        columns, rows = (np.arange(max(0, int(np.ceil(at)) - _NEAR), min(size, int(at) + _NEAR + 1))
                         for at, size in zip(place, self._squared.shape[::-1]))
        if not len(columns) or not len(rows):
            return np.empty(0, np.int64), np.empty(0)
        x, y = (values.ravel() for values in np.meshgrid(columns, rows))
        distance = np.hypot(x - place[0], y - place[1])
        has_room = self._squared[y, x] >= self._radius**2
        beside = np.flatnonzero(has_room & (np.maximum(abs(x - place[0]), abs(y - place[1])) <= _BESIDE))
        seen = [index for index in beside if self._sight.is_clear(
            self._squared, discs, *place, float(x[index]), float(y[index]), self._radius**2)]
        if not seen and has_room.any():
            seen = [np.where(has_room, distance, np.inf).argmin()]
        return (y[seen] * self._squared.shape[1] + x[seen]).astype(np.int64), distance[seen]
