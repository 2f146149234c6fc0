"""What may be asked of a roadmap: how many nodes, seeds, and the ends of a query."""
from __future__ import annotations

from numbers import Integral

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.sampling.roadmap import Roadmap
from mobile_planning.sampling.spaces import Space


def check_count(n: int) -> None:
    """Refuse a number of nodes that is none.

    Raises
    ------
    InvalidInput
    """
    if not isinstance(n, Integral) or isinstance(n, bool) or n < 1:
        raise InvalidInput(f'{n!r} nodes: a roadmap has a whole number of at least 1')


def seed_of(seed: int | None) -> int:
    """Return the seed, a drawn one if None.

    Raises
    ------
    InvalidInput
        If it is not a whole number of at least 0.
    """
    if seed is None:
        return int(np.random.SeedSequence().generate_state(1)[0])
    if not isinstance(seed, Integral) or isinstance(seed, bool) or not 0 <= seed < 2**63:
        raise InvalidInput(f'seed {seed!r} is not a whole number from 0 to 2^63 - 1')
    return int(seed)


def continued_seed(seed: int, roadmap: Roadmap) -> int:
    """Return the seed for what comes after a roadmap that was not built here."""
    return int(np.random.SeedSequence([seed, len(roadmap.points)]).generate_state(1)[0])


def free_end(space: Space, point: ArrayLike, name: str, outside: type[PlanningError], occupied: type[PlanningError]
             ) -> NDArray[np.float64]:
    """Return the start or the goal of a query as an array (d,), or raise what is wrong with it.

    Raises
    ------
    InvalidInput
        If a number is not finite or there are not as many as the space has dimensions.
    outside, occupied
        If it is beyond the bounds, or not free.
    """
    try:
        point = np.array(point, dtype=float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{name} {point!r} is not made of numbers') from None
    if point.shape != space.low.shape or not np.isfinite(point).all():
        raise InvalidInput(f'{name} {point.tolist()} is not {len(space.low)} finite numbers')
    point = space.normalised(point[None])[0]
    if not ((space.low <= point) & (point <= space.high)).all():
        raise outside(f'{name} {point.tolist()} is outside the bounds {space.low.tolist()} to {space.high.tolist()}')
    if not space.free(point[None])[0]:
        raise occupied(f'{name} {point.tolist()} is not free')
    return point
