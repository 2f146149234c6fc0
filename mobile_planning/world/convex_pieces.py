"""The static world as convex pieces, and the lines that keep a curve off them.

Obstacles, of whatever shape, and the occupied cells of a map are cut into convex pieces whose union they are: nothing
is left out and nothing is rounded off. What lies outside the boundary or the map is held off by walls. A curve that
stays on its side of a line that supports a piece stays clear of the piece.
"""
from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import finite_points
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import Obstacle, PolygonObstacle, RoundObstacle

#: A corner whose sine is above this is convex: that much is rounding.
_STRAIGHT = -1e-12


class ConvexPieces:
    """The convex pieces of an environment, in buckets to find the near ones.

    Parameters
    ----------
    environment : Environment

    Attributes
    ----------
    radii : (P,) ndarray [m]
        A piece is all that lies within its radius of the hull of its vertices.
    wall_normals : (H, 2) ndarray
        Unit vectors; a point x is within the boundary and the map if ``wall_normals @ x >= wall_offsets``.
    wall_offsets : (H,) ndarray [m]

    Raises
    ------
    InvalidInput
        If an obstacle is of an unknown kind.

    Examples
    --------
    >>> pieces = ConvexPieces(Environment(obstacles=[RoundObstacle((5, 0), 1), RoundObstacle((0, 50), 1)]))
    >>> curve = np.array([[(0, 0), (1, 1), (2, 1), (3, 0)]], float)
    >>> starts, found = pieces.near(curve.min(axis=1) - 2, curve.max(axis=1) + 2)
    >>> pieces.lines(curve, np.repeat([0], np.diff(starts)), found)
    (array([[-1.,  0.]]), array([-4.]), array([1.]))
    """

    def __init__(self, environment: Environment):
        polygons, radii = [], []
        for obstacle in environment.obstacles:
            for vertices, radius in _pieces_of(obstacle):
                polygons.append(vertices)
                radii.append(radius)
        counts = [len(vertices) for vertices in polygons]
        if environment.grid is not None:
            corners = _rectangles(environment)
            polygons.append(corners.reshape(-1, 2))
            counts += [4] * len(corners)
            radii += [0.0] * len(corners)
        self._points = np.concatenate([np.zeros((0, 2)), *polygons])
        self._starts = np.concatenate([[0], np.cumsum(counts, dtype=np.int64)])
        self.radii = np.array(radii, dtype=float)
        self.wall_normals, self.wall_offsets = _walls(environment)
        self._fill_buckets()

    def __len__(self) -> int:
        """Return the number of pieces P."""
        return len(self.radii)

    @property
    def counts(self) -> NDArray[np.int64]:
        """How many vertices (P,) each piece has."""
        return np.diff(self._starts)

    @cached_property
    def vertices(self) -> NDArray[np.float64]:
        """The vertices (P, V, 2) [m] of each piece, counter-clockwise; the last is repeated where there are fewer."""
        place = np.minimum(np.arange(self.counts.max(initial=1)), self.counts[:, None] - 1)
        return self._points[self._starts[:-1, None] + place]

    def near(self, low: ArrayLike, high: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the pieces whose bounding box touches each of some upright boxes.

        Parameters
        ----------
        low, high : (B, 2) array_like [m]
            Lower left and upper right corners.

        Returns
        -------
        starts : (B + 1,) ndarray of int
        pieces : (K,) ndarray of int
            Those of box b are ``pieces[starts[b]:starts[b + 1]]``, each once, in no particular order.

        Raises
        ------
        InvalidInput
            If a coordinate is NaN or the corners are not pairs, equal in number.
        """
        from mobile_planning.world import convex_pieces_kernels as kernels

        low, high = np.ascontiguousarray(low, dtype=float), np.ascontiguousarray(high, dtype=float)
        if low.ndim != 2 or low.shape[1] != 2 or low.shape != high.shape or np.isnan(low).any() or np.isnan(high).any():
            raise InvalidInput(f'boxes have corners (B, 2) without NaN, not {low.tolist()} and {high.tolist()}')
        return kernels.touching(low, high, self._boxes, *self._buckets)

    def lines(self, curves: ArrayLike, spans: ArrayLike, pieces: ArrayLike
              ) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Return for each pair of a curve and a piece the line that separates them best.

        Parameters
        ----------
        curves : (S, n, 2) array_like [m]
            Bezier points: a curve lies in their hull.
        spans, pieces : (K,) array_like of int
            Pair q is ``curves[spans[q]]`` and piece ``pieces[q]``.

        Returns
        -------
        normals : (K, 2) ndarray
            Unit vectors that point from the piece to the curve.
        offsets : (K,) ndarray [m]
            The piece lies where ``normal @ x <= offset``, its radius included.
        distances : (K,) ndarray [m]
            From the curve's hull to the piece; where they overlap, minus how far they do.

        Raises
        ------
        InvalidInput
            If a coordinate is not finite or the shapes do not fit.
        IndexError
            If there is no such span or piece.
        """
        from mobile_planning.world import convex_pieces_kernels as kernels

        curves = np.ascontiguousarray(finite_points(curves))
        spans, pieces = np.ascontiguousarray(spans, dtype=np.int64), np.ascontiguousarray(pieces, dtype=np.int64)
        if curves.ndim != 3 or curves.shape[1] < 1 or spans.ndim != 1 or spans.shape != pieces.shape:
            raise InvalidInput(f'curves {curves.shape} must be (S, n, 2) and spans {spans.shape} as many as pieces '
                               f'{pieces.shape}')
        normals, offsets, distances = np.empty((len(spans), 2)), np.empty(len(spans)), np.empty(len(spans))
        kernels.support_lines(curves, spans, pieces, self._points, self._starts, self.radii, normals, offsets,
                              distances)
        return normals, offsets, distances

    def _fill_buckets(self):
        """Sort the pieces' bounding boxes into square buckets, about two for each piece."""
        from mobile_planning.world import convex_pieces_kernels as kernels

        count = len(self)
        if count == 0:
            low = high = np.zeros((0, 2))
            origin, size = np.zeros(2), np.zeros(2)
        else:
            low = np.minimum.reduceat(self._points, self._starts[:-1]) - self.radii[:, None]
            high = np.maximum.reduceat(self._points, self._starts[:-1]) + self.radii[:, None]
            origin, size = low.min(axis=0), np.ptp(np.concatenate([low, high]), axis=0)
        side = max(np.sqrt(size[0] * size[1] / (2 * count + 1)), size.max() / (2 * count + 1)) or 1.0
        columns, rows = (int(cells) + 1 for cells in size / side)
        self._boxes = np.concatenate([low, high], axis=1)
        starts, members = kernels.fill_buckets(self._boxes, origin, side, columns, rows)
        self._buckets = origin, side, columns, rows, starts, members


def _pieces_of(obstacle: Obstacle) -> Iterable[tuple[NDArray[np.float64], float]]:
    """Return the vertices (V, 2) [m] and the radius [m] of each convex piece of an obstacle."""
    if isinstance(obstacle, PolygonObstacle):
        return [(np.array(part), 0.0) for part in convex_parts(obstacle.vertices)]
    if isinstance(obstacle, RoundObstacle):
        return [(obstacle.centroid[None], obstacle.radius)]
    if type(obstacle) is Obstacle:
        return [(obstacle.centroid[None], 0.0)]
    raise InvalidInput(f'{obstacle!r} is neither a point nor a disc nor a polygon')


def _rectangles(environment: Environment) -> NDArray[np.float64]:
    """Return the corners (R, 4, 2) [m] of rectangles whose union is the occupied cells."""
    from mobile_planning.world import convex_pieces_kernels as kernels

    cells = kernels.rectangles(np.ascontiguousarray(environment.occupied).view(np.uint8))
    return environment.grid.grid_to_world(cells[:, [[0, 1], [2, 1], [2, 3], [0, 3]]])


def _walls(environment: Environment) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the normals (H, 2), which point inwards, and offsets (H,) [m] of the edges of boundary and map.

    A wall that the other rectangle does not reach is left out.
    """
    inner = outer = np.empty((0, 2))
    if environment.boundary is not None:
        b = environment.boundary
        inner = np.array([(b.x_min, b.y_min), (b.x_max, b.y_min), (b.x_max, b.y_max), (b.x_min, b.y_max)])
    if environment.grid is not None:
        width, height = environment.grid.shape[::-1]
        outer = environment.grid.grid_to_world([(0, 0), (width, 0), (width, height), (0, height)])
    # Of two walls in the same place one stays.
    walls = [(normal, offset) for normal, offset in _edges(inner) if not len(outer) or (outer @ normal).min() <= offset]
    walls += [(normal, offset) for normal, offset in _edges(outer)
              if not len(inner) or (inner @ normal).min() < offset]
    return np.array([wall[0] for wall in walls]).reshape(-1, 2), np.array([wall[1] for wall in walls])


def _edges(corners):
    """Return (normal, offset) of each edge of a convex polygon given counter-clockwise."""
    edges = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.hypot(*(b - a)) + 0.0  # no -0.0
        edges.append((normal, normal @ a))
    return edges


def convex_parts(vertices: ArrayLike) -> list[list[tuple[float, float]]]:
    """Return convex polygons that make up a simple polygon.

    The triangles of its constrained Delaunay triangulation are joined across every diagonal that leaves no reflex
    corner behind, the longest first (Hertel and Mehlhorn 1983): at most four times as many parts as there must be.

    Parameters
    ----------
    vertices : (N, 2) array_like [m]
        Counter-clockwise, the first not repeated.

    Examples
    --------
    >>> [len(part) for part in convex_parts([(0, 0), (3, 0), (3, 1), (1, 1), (1, 2), (0, 2)])]  # an L
    [4, 4]
    """
    import shapely

    whole = [tuple(vertex) for vertex in np.asarray(vertices, float).tolist()]
    if all(_is_convex(*corner) for corner in zip(whole[-1:] + whole[:-1], whole, whole[1:] + whole[:1])):
        return [whole]
    triangles = shapely.constrained_delaunay_triangles(shapely.Polygon(whole)).geoms
    parts = {}  # by each of their edges
    for triangle in triangles:
        ring = shapely.get_coordinates(shapely.orient_polygons(triangle)).tolist()
        part = [tuple(vertex) for vertex in ring[:-1]]
        parts.update((edge, part) for edge in _sides(part))
    diagonals = [edge for edge in parts if edge < edge[::-1] and edge[::-1] in parts]
    for a, b in sorted(diagonals, key=lambda edge: (-np.hypot(edge[0][0] - edge[1][0], edge[0][1] - edge[1][1]), edge)):
        left, right = parts[a, b], parts[b, a]
        left, right = _from(left, b), _from(right, a)  # b ... a and a ... b
        if _is_convex(left[-2], a, right[1]) and _is_convex(right[-2], b, left[1]):
            joined = left + right[1:-1]
            del parts[a, b], parts[b, a]
            parts.update((edge, joined) for edge in _sides(joined))
    return list({id(part): part for part in parts.values()}.values())


def _sides(ring):
    return pairwise([*ring, ring[0]])


def _from(ring, vertex):
    """Return the ring as it goes from ``vertex`` on."""
    place = ring.index(vertex)
    return ring[place:] + ring[:place]


def _is_convex(before, corner, after):
    """Return whether a counter-clockwise polygon has no reflex corner here."""
    ax, ay, bx, by = corner[0] - before[0], corner[1] - before[1], after[0] - corner[0], after[1] - corner[1]
    return ax * by - ay * bx >= _STRAIGHT * np.hypot(ax, ay) * np.hypot(bx, by)
