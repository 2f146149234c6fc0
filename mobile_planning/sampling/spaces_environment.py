"""The spaces of mobile robots: the plane, and poses of a car, both among the obstacles of an environment."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import wrap_angle
from mobile_planning.sampling.curve import radius_of
from mobile_planning.sampling.dubins import dubins_lengths
from mobile_planning.sampling.reeds_shepp import reeds_shepp_lengths
from mobile_planning.sampling.spaces import NO_PLANE
from mobile_planning.sampling.steering import Steering, car_of
from mobile_planning.world.environment import Environment
from mobile_planning.world.surroundings import Surroundings

# How deep an edge may lie in an obstacle: rounding, no more [m].
_TOUCH = 1e-6


class PlaneSpace:
    """Points (x, y) joined by straight lines, for a robot that is a disc or a point.

    Parameters
    ----------
    environment : Environment
        As it is now: a later change of it is not seen.

    Raises
    ------
    InvalidInput
        If it has no bounds, or obstacles that move, or the robot has an outline, which needs a heading.

    Examples
    --------
    >>> from mobile_planning import Boundary, RoundObstacle
    >>> space = PlaneSpace(Environment(Boundary((0, 10), (0, 10)), [RoundObstacle((5, 5), 1)]))
    >>> space.edges_free(np.array([[1.0, 5.0], [1.0, 3.9]]), np.array([[9.0, 5.0], [9.0, 3.9]]))
    array([False,  True])
    """

    is_directed = False
    lookahead = 64
    kind = 'plane'

    def __init__(self, environment: Environment):
        if environment.footprint.outline is not None:
            raise InvalidInput('a robot with an outline has a heading: give the planner its turning_radius')
        x_min, y_min, x_max, y_max = _fixed_bounds(environment)
        self.low, self.high = np.array([x_min, y_min]), np.array([x_max, y_max])
        self.plane = environment.surroundings(_TOUCH)

    def normalised(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points."""
        return points

    def coordinates(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points."""
        return points

    def lengths(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distances (n,) [m]."""
        return np.hypot(ends[..., 0] - starts[..., 0], ends[..., 1] - starts[..., 1])

    def free(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which points (n, 2) are free."""
        return _poses_free(self.plane, np.column_stack([points, np.zeros(len(points))]))

    def edges_free(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which lines between free points are free, exactly for shapes."""
        from mobile_planning.sampling.edge_kernels import write_lines_free

        is_free = np.empty(len(starts), bool)
        write_lines_free(self.plane, np.ascontiguousarray(starts), np.ascontiguousarray(ends), is_free)
        return is_free

    def interpolate(self, starts: NDArray[np.float64], ends: NDArray[np.float64],
                    shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the points (n, 2) on the lines."""
        return starts + (ends - starts) * shares[:, None]


class CarSpace:
    """Poses (x, y, heading) joined by the shortest paths of a car: one way there need not be one back.

    Parameters
    ----------
    environment : Environment
        As it is now.
    turning_radius : float [m]
    steering : Steering
        Forwards only, or backwards too.

    Raises
    ------
    InvalidInput
        If the environment has no bounds, or obstacles that move, or the radius is not above 0.
    """

    # Of two Reeds-Shepp paths of one length, that back need not be the same curve as that there.
    is_directed = True
    lookahead = 64
    plane = NO_PLANE

    def __init__(self, environment: Environment, turning_radius: float, steering: Steering = Steering.DUBINS):
        x_min, y_min, x_max, y_max = _fixed_bounds(environment)
        self.low, self.high = np.array([x_min, y_min, -np.pi]), np.array([x_max, y_max, np.pi])
        self._world = environment.surroundings(_TOUCH)
        self._car, self._steering = car_of(radius_of(turning_radius), steering), steering
        name = {Steering.DUBINS: 'Dubins', Steering.REEDS_SHEPP: 'Reeds-Shepp'}[steering]
        self.kind = f'{name} paths of radius {self._car.radius!r} m'

    def normalised(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses with headings in (-pi, pi]."""
        return np.column_stack([points[:, :2], wrap_angle(points[:, 2])])

    def coordinates(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the positions (n, 2): no path is shorter than the line between them."""
        return np.ascontiguousarray(points[:, :2])

    def lengths(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the lengths (n,) [m] of the shortest paths."""
        lengths = dubins_lengths if self._steering is Steering.DUBINS else reeds_shepp_lengths
        return lengths(starts, ends, self._car.radius)

    def free(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which poses (n, 3) are free."""
        return _poses_free(self._world, np.ascontiguousarray(points))

    def edges_free(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Return which paths between free poses are free."""
        from mobile_planning.sampling.edge_kernels import write_curves_free

        is_free = np.empty(len(starts), bool)
        write_curves_free(self._world, self._car, np.ascontiguousarray(starts), np.ascontiguousarray(ends), is_free)
        return is_free

    def interpolate(self, starts: NDArray[np.float64], ends: NDArray[np.float64],
                    shares: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the poses (n, 3) on the paths."""
        from mobile_planning.sampling.edge_kernels import write_curve_poses

        poses = np.empty((len(shares), 3))
        write_curve_poses(self._car, np.ascontiguousarray(starts), np.ascontiguousarray(ends),
                          np.ascontiguousarray(shares), poses)
        poses[:, 2] = wrap_angle(poses[:, 2])
        return poses


def _fixed_bounds(environment):
    """Return the bounds of an environment in which nothing moves."""
    if environment.moving:
        raise InvalidInput(f'a roadmap knows no time: it takes none of the {len(environment.moving)} moving obstacles')
    return environment.bounds


def _poses_free(world: Surroundings, poses: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return at which poses (n, 3) the robot is free."""
    from mobile_planning.sampling.edge_kernels import write_poses_free

    is_free = np.empty(len(poses), bool)
    write_poses_free(world, poses, is_free)
    return is_free
