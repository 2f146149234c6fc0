"""A path as the kernels shorten it: segments with their start poses, in arrays."""
from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Track(NamedTuple):
    """Segments one after the other; only the first ``sizes[0]`` entries count.

    The pose after the last segment stands in ``starts`` and the whole length in ``places``.
    """

    #: (n + 1, 3) pose [m, m, rad] in which each segment starts.
    starts: NDArray[np.float64]
    #: (n,) 1 left, 0 straight, -1 right.
    turns: NDArray[np.int64]
    #: (n,) [m].
    lengths: NDArray[np.float64]
    #: (n + 1,) length of the path up to each segment [m].
    places: NDArray[np.float64]
    #: (1,) number of segments.
    sizes: NDArray[np.int64]

    @property
    def count(self) -> int:
        """The number of segments."""
        return int(self.sizes[0])

    @property
    def length(self) -> float:
        """The whole length [m]."""
        return float(self.places[self.count])

    def copy(self) -> Track:
        """Return a track with arrays of its own."""
        return Track(*(array.copy() for array in self))


def empty_track(start: NDArray[np.float64], capacity: int) -> Track:
    """Return a track of no segments at the pose ``start``, with room for so many."""
    track = Track(np.zeros((capacity + 1, 3)), np.zeros(capacity, np.int64), np.zeros(capacity),
                  np.zeros(capacity + 1), np.zeros(1, np.int64))
    track.starts[0] = start
    return track
