"""A track as a path that can be driven."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.sampling.plan_result import SPACING, PlanResult, PlanStatus
from mobile_planning.sampling.rrt_graph import word_of
from mobile_planning.sampling.steering import Car
from mobile_planning.sampling.track import Track


def result_of(track: Track, end: NDArray[np.float64], car: Car) -> PlanResult:
    """Return a solved result with the track's path, cost and word; its last pose is exactly ``end``."""
    from mobile_planning.sampling.track_kernels import write_path

    count = track.count
    lengths = track.lengths[:count]
    path = np.empty((int(np.ceil(np.abs(lengths) / SPACING).sum()) + 1, 3))
    write_path(track, car, SPACING, path)
    path[-1] = end
    lengths = tuple(lengths.tolist())
    driven = path[:, :2].copy() if car.turns_in_place else path
    return PlanResult(PlanStatus.SOLVED, driven, sum(map(abs, lengths), 0.0),
                      word=word_of(track.turns[:count]), lengths=lengths)
