"""Static obstacles: points, discs and polygons, and how far away they are.

Distances are signed: positive outside, 0 on the border, negative inside.
"""
from __future__ import annotations

from functools import cached_property
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import finite_points

# Points times edges looked at in one go: small enough to stay in the cache.
_CHUNK = 1 << 15


class Obstacle:
    """An obstacle, here the bare point that other kinds are built around.

    Parameters
    ----------
    position : (2,) array_like [m]

    Attributes
    ----------
    centroid : (2,) ndarray [m], read-only
    x, y : float [m]
        Coordinates of the centroid.
    bounding_circle_radius : float [m]
        Radius of a circle about the centroid that holds the obstacle.

    Raises
    ------
    InvalidInput
        If the position is not a finite point.
    """

    bounding_circle_radius = 0.0

    def __init__(self, position: ArrayLike):
        centroid = np.array(finite_points(position))
        if centroid.shape != (2,):
            raise InvalidInput(f'obstacle position has shape {centroid.shape}: it must be one point (x, y)')
        centroid.flags.writeable = False
        self.centroid = centroid

    @property
    def x(self) -> float:
        """The x-coordinate of the centroid [m]."""
        return float(self.centroid[0])

    @property
    def y(self) -> float:
        """The y-coordinate of the centroid [m]."""
        return float(self.centroid[1])

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the signed distance from each point to the obstacle's border.

        Parameters
        ----------
        points : (..., 2) array_like [m]

        Returns
        -------
        (...) ndarray [m]
            Negative inside the obstacle.
        """
        offset = finite_points(points) - self.centroid
        return np.hypot(offset[..., 0], offset[..., 1])

    def pt_2_obst(self, pt: ArrayLike, offset: float = 0.0) -> float:
        """Return the signed distance from one point to the obstacle, less the offset.

        Parameters
        ----------
        pt : (2,) array_like [m]
        offset : float [m]
            For example the radius of the robot at ``pt``.

        Returns
        -------
        float [m]
            Negative if the point is nearer than the offset, or inside.
        """
        if not isfinite(offset):
            raise InvalidInput(f'offset {offset} m is not finite')
        return self._distance(pt) - offset

    def detected_dist(self, pt: ArrayLike) -> float:
        """Return how far the obstacle's border is from a robot at ``pt``.

        Parameters
        ----------
        pt : (2,) array_like [m]

        Returns
        -------
        float [m]
            Never negative: from inside it is the distance to the border as well.
        """
        return abs(self._distance(pt))

    def _distance(self, pt: ArrayLike) -> float:
        """Return the signed distance [m] from one point."""
        distance = self.distance(pt)
        if distance.shape:
            raise InvalidInput(f'pt has shape {np.shape(pt)}: it must be one point (x, y); `distance` takes many')
        return float(distance)


class RoundObstacle(Obstacle):
    """A disc.

    Parameters
    ----------
    position : (2,) array_like [m]
        Its centre.
    radius : float [m]
        At least 0.

    Attributes
    ----------
    radius : float [m]

    Raises
    ------
    InvalidInput
        If the position or the radius is not finite, or the radius is negative.

    Examples
    --------
    >>> RoundObstacle((1.0, 2.0), 0.5).pt_2_obst((1.0, 5.0), offset=0.25)
    2.25
    """

    def __init__(self, position: ArrayLike, radius: float):
        super().__init__(position)
        if not (isfinite(radius) and radius >= 0):
            raise InvalidInput(f'obstacle radius {radius} m is not a finite number of at least 0')
        self.radius = float(radius)

    def __repr__(self) -> str:
        return f'RoundObstacle(({self.x:g}, {self.y:g}), {self.radius:g})'

    @property
    def bounding_circle_radius(self) -> float:
        """The disc's own radius [m]."""
        return self.radius

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the signed distance from each point to the circle (see `Obstacle.distance`)."""
        return super().distance(points) - self.radius

    def _plt_circle(self, color: str = 'k', linestyle: str = 'solid', filled: bool = False, alpha: float = 1.0,
                    offset: float = 0.0):
        """Return a matplotlib ``Circle`` of the obstacle, its radius larger by the offset [m]."""
        from mobile_planning.drawing.obstacles import circle

        return circle(self.centroid, self.radius + offset, color, linestyle, filled, alpha)

    def plot(self, fig, offset: float = 0.0) -> None:
        """Draw the disc in grey, and around it a dashed circle, on the figure's current axes.

        Parameters
        ----------
        fig : matplotlib.figure.Figure
        offset : float [m]
            How much larger the dashed circle is.
        """
        from mobile_planning.drawing.obstacles import draw_disc

        draw_disc(fig.gca(), self.centroid, self.radius, offset)


class PolygonObstacle(Obstacle):
    """A simple polygon, convex or not.

    Parameters
    ----------
    vertices : (N, 2) array_like [m]
        In order, either way round; the first may be repeated at the end.

    Attributes
    ----------
    vertices : (N, 2) ndarray [m], read-only
        Counter-clockwise, the first not repeated.

    Raises
    ------
    InvalidInput
        If fewer than three vertices differ, the area is zero, or edges cross.

    Examples
    --------
    >>> square = PolygonObstacle([(0, 0), (2, 0), (2, 2), (0, 2)])
    >>> square.distance([(1, 1), (3, 1), (5, 6)])
    array([-1.,  1.,  5.])
    """

    def __init__(self, vertices: ArrayLike):
        self.vertices = _simple_polygon(vertices)
        self.vertices.flags.writeable = False
        super().__init__(self._calculate_polygon_centroid(self.vertices))
        self._edges = np.roll(self.vertices, -1, axis=0) - self.vertices

    def __repr__(self) -> str:
        return f'PolygonObstacle({self.vertices.tolist()})'

    @cached_property
    def bounding_circle_radius(self) -> float:
        """The distance from the centroid to the furthest vertex [m]."""
        return float(np.linalg.norm(self.vertices - self.centroid, axis=1).max())

    @cached_property
    def smallest_bounding_circle(self) -> tuple[NDArray[np.float64], float]:
        """Centre (2,) [m] and radius [m] of the smallest circle that holds the polygon.

        Examples
        --------
        >>> centre, radius = PolygonObstacle([(0, 0), (4, 0), (1, 1)]).smallest_bounding_circle
        >>> centre.round(9).tolist(), round(radius, 9)
        ([2.0, 0.0], 2.0)
        """
        import shapely

        polygon = shapely.Polygon(self.vertices)
        centre = shapely.get_coordinates(shapely.minimum_bounding_circle(polygon).centroid)[0]
        return centre, float(shapely.minimum_bounding_radius(polygon))

    def distance(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the exact signed distance from each point to the nearest edge (see `Obstacle.distance`)."""
        points = finite_points(points)
        flat = points.reshape(-1, 2)
        step = max(1, _CHUNK // len(self.vertices))
        parts = [self._chunk_distance(flat[first:first + step]) for first in range(0, len(flat), step)]
        return np.concatenate(parts or [np.empty(0)]).reshape(points.shape[:-1])

    def _chunk_distance(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the signed distances of (n, 2) points, every point against every edge."""
        ex, ey = self._edges.T
        px, py = (points[:, None, :] - self.vertices).transpose(2, 0, 1)
        share = np.clip((px * ex + py * ey) / (ex * ex + ey * ey), 0.0, 1.0)
        nearest = np.sqrt(((px - share * ex) ** 2 + (py - share * ey) ** 2).min(axis=1))
        # Even-odd rule: an edge is crossed by the ray to +x if it spans the point's y and passes right of it.
        # The ends are compared as they are, so that both edges at a vertex agree on its side to the last bit.
        start_above = self.vertices[:, 1] > points[:, 1:]
        end_above = np.roll(start_above, -1, axis=1)
        crossed = (start_above != end_above) & ((ex * py > ey * px) == end_above)
        inside = np.count_nonzero(crossed, axis=1) % 2 == 1
        return np.where(inside, -nearest, nearest)

    @staticmethod
    def _calculate_polygon_area(polygon: ArrayLike, signed: bool = False) -> float:
        """Return the area of a simple polygon.

        Parameters
        ----------
        polygon : (N, 2) array_like [m]
            Closed (the last point repeats the first) or not.
        signed : bool
            Whether a clockwise polygon has a negative area.

        Returns
        -------
        float [m^2]
        """
        area = _cross_terms(polygon)[1].sum() / 2
        return float(area if signed else abs(area))

    @staticmethod
    def _calculate_polygon_centroid(polygon: ArrayLike) -> NDArray[np.float64]:
        """Return the centroid of a simple polygon.

        Parameters
        ----------
        polygon : (N, 2) array_like [m]
            Closed (the last point repeats the first) or not.

        Returns
        -------
        (2,) ndarray [m]
        """
        local, cross = _cross_terms(polygon)
        corner_sums = local + np.roll(local, -1, axis=0)
        return np.asarray(polygon, float)[0] + cross @ corner_sums / (3 * cross.sum())

    def _create_aug_vertices(self, offset: float) -> NDArray[np.float64]:
        """Return the outline of all points within ``offset`` of the polygon.

        It is the outer border of the polygon's Minkowski sum with a disc: the centre of
        a robot of that radius must stay outside.

        Parameters
        ----------
        offset : float [m]
            At least 0.

        Returns
        -------
        (M, 2) ndarray [m]
            Counter-clockwise, arcs given by points on them, the first not repeated.
        """
        import shapely

        if not (isfinite(offset) and offset >= 0):
            raise InvalidInput(f'offset {offset} m is not a finite number of at least 0')
        if offset == 0:
            return np.array(self.vertices)
        outline = shapely.Polygon(self.vertices).buffer(offset, quad_segs=16).exterior
        return shapely.get_coordinates(outline.normalize())[:-1][::-1]

    def plot(self, fig, offset: float = 0.0) -> None:
        """Draw the polygon in grey, and its outline grown by the offset dashed, on the figure's current axes.

        Parameters
        ----------
        fig : matplotlib.figure.Figure
        offset : float [m]
        """
        from mobile_planning.drawing.obstacles import draw_polygon

        draw_polygon(fig.gca(), self.vertices, self._create_aug_vertices(offset))


class RectangleObstacle(PolygonObstacle):
    """An upright rectangle.

    Parameters
    ----------
    low, high : (2,) array_like [m]
        Lower left and upper right corner.

    Raises
    ------
    InvalidInput
        If a coordinate is not finite, or the rectangle has no area.

    Examples
    --------
    >>> RectangleObstacle((0, 0), (2, 1)).distance((3, 0.5)).item()
    1.0
    """

    def __init__(self, low: ArrayLike, high: ArrayLike):
        low, high = finite_points(low), finite_points(high)
        if low.shape != (2,) or high.shape != (2,) or not (low < high).all():
            raise InvalidInput(f'rectangle {low.tolist()} to {high.tolist()} must be two points, the lower left first')
        super().__init__([low, (high[0], low[1]), high, (low[0], high[1])])

    def __repr__(self) -> str:
        return f'RectangleObstacle({self.vertices[0].tolist()}, {self.vertices[2].tolist()})'


def _cross_terms(polygon: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the vertices seen from the first one, and each one's cross product with the next.

    From the first vertex, because far from the origin the products would cancel.
    """
    local = np.asarray(polygon, float) - np.asarray(polygon, float)[0]
    following = np.roll(local, -1, axis=0)
    return local, local[:, 0] * following[:, 1] - local[:, 1] * following[:, 0]


def _simple_polygon(vertices: ArrayLike) -> NDArray[np.float64]:
    """Return the vertices counter-clockwise, open and without repeats, if they make a simple polygon."""
    import shapely

    vertices = finite_points(vertices)
    if vertices.ndim != 2:
        raise InvalidInput(f'polygon has shape {vertices.shape}: it must be (N, 2)')
    vertices = vertices[(vertices != np.roll(vertices, -1, axis=0)).any(axis=1)]
    if len(vertices) < 3:
        raise InvalidInput(f'polygon has {len(vertices)} different vertices: it must have at least 3')
    polygon = shapely.Polygon(vertices)
    area = PolygonObstacle._calculate_polygon_area(vertices, signed=True)
    # Flatter than this in proportion, its inside is lost in rounding.
    if abs(area) <= 1e-12 * polygon.length ** 2:
        raise InvalidInput(f'polygon {vertices[0].tolist()}, ... has no area')
    if not polygon.is_valid:
        raise InvalidInput(f'polygon is not simple: {shapely.is_valid_reason(polygon)}')
    return np.array(vertices if area > 0 else vertices[::-1])
