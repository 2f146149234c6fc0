"""Checks of the fields of messages."""
from __future__ import annotations

from operator import index

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import MAX_NUMBER


def whole(name: str, value: int, least: int) -> int:
    """Return a whole number that is ``least`` at least, else raise InvalidInput."""
    try:
        number = index(value)
    except TypeError:
        raise InvalidInput(f'{name} is {value!r}, not a whole number') from None
    if not least <= number < MAX_NUMBER:
        raise InvalidInput(f'{name} is {number}, not in {least}..{MAX_NUMBER - 1}')
    return number


def finite(name: str, value: ArrayLike, size: int | None) -> NDArray[np.float64]:
    """Return finite numbers (n,), as many as ``size`` says if it does, else raise InvalidInput."""
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{name} must be numbers, not {value!r}') from None
    if array.ndim != 1 or (size is not None and array.shape != (size,)) or not np.isfinite(array).all():
        raise InvalidInput(f'{name} must be finite numbers, {size or "any count"} of them')
    return array
