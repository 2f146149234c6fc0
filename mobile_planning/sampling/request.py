"""What may be asked of a tree: positions, and the numbers of a run."""
from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.geometry import wrap_angle

#: The seed's number of iterations. Beside a deadline it does not count.
NB_ITERATION = 100
METRICS = ('local', 'euclidean', 'euclidian')


def check_run(nb_iteration: int, goal_rate: float, metric: str, deadline: float | None, seed: int | None) -> None:
    """Refuse what cannot be a run.

    Raises
    ------
    InvalidInput
    """
    if not (isinstance(nb_iteration, (int, np.integer)) and nb_iteration >= 0):
        raise InvalidInput(f'nb_iteration {nb_iteration!r} is not a whole number of at least 0')
    if not (np.isreal(goal_rate) and 0 <= goal_rate <= 1):
        raise InvalidInput(f'goal_rate {goal_rate!r} is not within 0..1')
    if metric not in METRICS:
        raise InvalidInput(f'metric {metric!r} is none of {", ".join(METRICS)}')
    if deadline is not None and not (np.isreal(deadline) and deadline >= 0):
        raise InvalidInput(f'deadline {deadline!r} s is not a number of at least 0')
    if seed is not None and not (isinstance(seed, (int, np.integer)) and seed >= 0):
        raise InvalidInput(f'seed {seed!r} is not a whole number of at least 0')


def as_pose(position: ArrayLike, name: str, has_heading: bool) -> NDArray[np.float64]:
    """Return a position as a pose (3,), the heading in (-pi, pi]; 0 where it means nothing.

    Raises
    ------
    InvalidInput
        If it is not made of finite numbers, or of too few.
    """
    try:
        pose = np.array(position, float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{name} {position!r} is not made of numbers') from None
    if not has_heading and pose.shape in ((2,), (3,)):
        pose = np.append(pose[:2], 0.0)
    if pose.shape != (3,):
        raise InvalidInput(f'{name} {position!r} must be (x, y, psi)')
    if not np.isfinite(pose).all():
        raise InvalidInput(f'{name} {tuple(pose.tolist())} has a number that is not finite')
    pose[2] = wrap_angle(pose[2])
    return pose


def three_numbers(values: ArrayLike, name: str) -> tuple[float, float, float]:
    """Return three finite numbers.

    Raises
    ------
    InvalidInput
    """
    try:
        numbers = tuple(float(value) for value in values)
    except (TypeError, ValueError):
        numbers = ()
    if len(numbers) != 3 or not all(map(isfinite, numbers)):
        raise InvalidInput(f'{name} {values!r} is not made of three finite numbers')
    return numbers
