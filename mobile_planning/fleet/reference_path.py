"""Reference path: a way that somebody else has planned for a robot, checked before it is taken."""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.ground import Ground

#: Poses of a path; how far [m] from the robot it may begin.
MAX_PATH, _GAP = 10_000, 1.0


def reference_path(poses: ArrayLike, here: NDArray, ground: Ground) -> NDArray[np.float64]:
    """Return a path that a robot can be led along.

    Parameters
    ----------
    poses : (N, 3) array_like [m, m, rad]
    here : (2,) ndarray [m]
        Where the robot is.
    ground : Ground
        In which its body must fit all along the path.

    Returns
    -------
    (N, 3) ndarray [m, m, rad]

    Raises
    ------
    InvalidInput
        It is no path, it begins far away, or the body does not fit along it.
    """
    path = np.array(poses, float)
    if path.ndim != 2 or path.shape[1] != 3 or not 2 <= len(path) <= MAX_PATH or not np.isfinite(path).all():
        raise InvalidInput(f'a path has 2 to {MAX_PATH} finite poses (x, y, theta), not an array of {path.shape}')
    points = path[:, :2]
    gap = np.linalg.norm(points[0] - here)
    if gap > _GAP:
        raise InvalidInput(f'the path begins {gap:.3f} m away from robot {ground.robot_id}, farther than {_GAP} m')
    ground.require_way(points)
    return path
