"""Whole-map array work in pieces small enough to be stopped between them."""
from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import DTypeLike, NDArray

from mobile_planning.errors import Cancelled

# Memory that is touched for the first time can take 20 ns a cell.
_CELLS = 1 << 18


def row_blocks(shape: tuple[int, int], stop: NDArray[np.uint8] | None, least: int = 1) -> Iterator[slice]:
    """Yield slices that together are all rows of an array, each of at most 2**18 cells, or a few rows.

    Parameters
    ----------
    shape : (2,) tuple of int
    stop : (1,) ndarray of uint8, optional
        Looked at before each slice.
    least : int
        Rows of a slice that may have more cells.

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
    rows = max(least, _CELLS // width)
    for first in range(0, height, rows):
        if stop is not None and stop[0]:
            raise Cancelled('the work on a map was stopped before it was complete')
        yield slice(first, min(height, first + rows))


def by_rows(function: Callable[..., NDArray], dtype: DTypeLike, stop: NDArray[np.uint8] | None,
            *arrays: NDArray) -> NDArray:
    """Return ``function(*arrays)`` of one that looks at each element by itself, computed in pieces.

    Parameters
    ----------
    function : callable
    dtype : data type
        Of the result.
    stop : (1,) ndarray of uint8, optional
    *arrays : (h, w) ndarray

    Raises
    ------
    Cancelled
        If ``stop`` was set.

    Examples
    --------
    >>> by_rows(np.isfinite, bool, None, np.array([[1.0, np.inf]]))
    array([[ True, False]])
    """
    result = np.empty(arrays[0].shape, dtype)
    for rows in row_blocks(result.shape, stop):
        result[rows] = function(*(array[rows] for array in arrays))
    return result
