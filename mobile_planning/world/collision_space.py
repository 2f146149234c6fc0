"""An environment as plain arrays, for the kernels that check motions against it."""
from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.world.obstacles import Obstacle, PolygonObstacle

if TYPE_CHECKING:
    from mobile_planning.world.environment import Environment

#: How deep a pose may lie in an obstacle and still count as touching it [m].
TOUCH = 1e-3
# Consecutive edges of an outline that share a bounding box.
_BLOCK = 8
# An outline is checked against its obstacles with this little taken off [m], so that touching is not crossing.
_LEAST_MARGIN = 1e-4


class CollisionSpace(NamedTuple):
    """What may be hit, and by what. All in metres of the map frame, obstacles at time 0.

    Polygons of one velocity make a group: their union's edges, so that no path leads between two that share an edge.
    Edges stand in blocks of neighbours, each with its bounding box.
    """

    #: (4,) boundary: x_min, y_min, x_max, y_max, infinite without one.
    box: NDArray[np.float64]
    #: (E, 4) ends of the edges: ax, ay, bx, by.
    edges: NDArray[np.float64]
    #: (B, 4) bounding boxes of blocks: x_min, y_min, x_max, y_max.
    blocks: NDArray[np.float64]
    #: (B + 1,) first edge of each block, and the number of edges.
    first: NDArray[np.int64]
    #: (G + 1,) first block of each group, and the number of blocks.
    groups: NDArray[np.int64]
    #: (G, 2) velocity of each group [m/s].
    velocities: NDArray[np.float64]
    #: (C, 5) circles: x, y, radius, vx, vy.
    circles: NDArray[np.float64]
    #: (h, w) whether a cell is occupied; (0, 0) without a grid.
    cells: NDArray[np.uint8]
    #: squared distance [cells^2] from each cell corner to the nearest occupied square, flat; empty if all is free.
    field: NDArray[np.int32]
    #: (5,) x, y, cosine and sine of the grid's origin, resolution.
    frame: NDArray[np.float64]
    #: (V, 2) outline of the robot in its frame; (0, 2) for a disc.
    body: NDArray[np.float64]
    #: (4,) radius of the disc, reach of the robot, how deep it may lie in obstacles, greatest speed of an obstacle.
    reach: NDArray[np.float64]


def collision_space(environment: Environment, allowed: float) -> CollisionSpace:
    """Return the arrays of an environment in which a robot may lie ``allowed`` [m] deep in what it touches.

    Raises
    ------
    InvalidInput
        If an obstacle is of an unknown kind, or the footprint is thinner than twice what is allowed.
    """
    boundary, grid, footprint = environment.boundary, environment.grid, environment.footprint
    groups, circles = defaultdict(list), []
    pairs = [(shape, (0.0, 0.0)) for shape in environment.obstacles]
    for shape, velocity in [*pairs, *((each.shape, each.velocity) for each in environment.moving)]:
        if isinstance(shape, PolygonObstacle):
            groups[velocity].append(shape.vertices)
        elif type(shape) is Obstacle or hasattr(shape, 'radius'):
            circles.append((shape.x, shape.y, shape.bounding_circle_radius, *velocity))
        else:
            raise InvalidInput(f'obstacle {shape!r} is neither round nor a polygon')
    edges, first, counts = [], [0], [0]
    for polygons in groups.values():
        for ring in _outlines(polygons):
            ends = np.hstack([ring, np.roll(ring, -1, axis=0)])
            for begin in range(0, len(ends), _BLOCK):
                edges.append(ends[begin:begin + _BLOCK])
                first.append(first[-1] + len(edges[-1]))
        counts.append(len(edges))
    blocks = [(*np.minimum(part[:, :2], part[:, 2:]).min(axis=0), *np.maximum(part[:, :2], part[:, 2:]).max(axis=0))
              for part in edges]
    velocities = np.array(list(groups), float).reshape(-1, 2)
    circles = np.array(circles, float).reshape(-1, 5)
    fastest = np.hypot(*np.vstack([velocities, circles[:, 3:]]).T).max(initial=0.0)
    field = None if grid is None else environment._corner_field
    x, y, yaw = (0.0, 0.0, 0.0) if grid is None else grid.origin
    return CollisionSpace(
        box=np.array([-np.inf, -np.inf, np.inf, np.inf] if boundary is None else
                     [boundary.x_min, boundary.y_min, boundary.x_max, boundary.y_max]),
        edges=np.vstack([np.empty((0, 4)), *edges]),
        blocks=np.array(blocks, float).reshape(-1, 4),
        first=np.array(first, np.int64),
        groups=np.array(counts, np.int64),
        velocities=velocities,
        circles=circles,
        cells=np.zeros((0, 0), np.uint8) if grid is None else environment.occupied.astype(np.uint8),
        field=np.empty(0, np.int32) if field is None else np.array(field),
        frame=np.array([x, y, np.cos(yaw), np.sin(yaw), 1.0 if grid is None else grid.resolution]),
        body=footprint.shrunk(max(allowed, _LEAST_MARGIN)),
        reach=np.array([footprint.radius, footprint.reach, allowed, fastest]))


def _outlines(polygons: Iterable[NDArray]) -> list[NDArray[np.float64]]:
    """Return the outlines (N, 2) of the polygons' union, holes among them."""
    import shapely

    union = shapely.union_all([shapely.Polygon(vertices) for vertices in polygons])
    rings = shapely.get_rings(shapely.get_parts(union))
    return [shapely.get_coordinates(ring)[:-1].copy() for ring in rings]
