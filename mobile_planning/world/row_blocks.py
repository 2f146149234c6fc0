"""Whole-map array work in pieces small enough to be stopped between them."""
from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import Cancelled

# Memory that is touched for the first time can take 20 ns a cell.
_CELLS = 1 << 18


def row_blocks(shape: tuple[int, int], stop: NDArray[np.uint8] | None) -> Iterator[slice]:
    """Yield slices that together are all rows of an array, each of at most 2**18 cells, or one row.

    Parameters
    ----------
    shape : (2,) tuple of int
    stop : (1,) ndarray of uint8, optional
        Looked at before each slice.

    Raises
    ------
    Cancelled
        If ``stop`` was set.

    Examples
    --------
    >>> list(row_blocks((3, 200_000), None))
    [slice(0, 1, None), slice(1, 2, None), slice(2, 3, None)]
    """
    height, width = shape
    rows = max(1, _CELLS // width)
    for first in range(0, height, rows):
        if stop is not None and stop[0]:
            raise Cancelled('the work on a map was stopped before it was complete')
        yield slice(first, min(height, first + rows))
