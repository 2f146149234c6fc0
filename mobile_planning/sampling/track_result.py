"""A track as a path that can be driven."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mobile_planning.geometry import wrap_angle
from mobile_planning.sampling.curve import Curve
from mobile_planning.sampling.plan_result import SPACING, PlanResult, PlanStatus
from mobile_planning.sampling.rrt_graph import word_of
from mobile_planning.sampling.track import Track


def result_of(track: Track, end: NDArray[np.float64], radius: float) -> PlanResult:
    """Return a solved result with the track's path, cost and word; its last pose is exactly ``end``."""
    count = track.count
    word, lengths = word_of(track.turns[:count]), tuple(track.lengths[:count].tolist())
    if count == 0:
        path = track.starts[:1].copy()
    elif radius > 0:
        path = Curve(tuple(track.starts[0]), word, lengths, radius).sample(SPACING)
    else:
        path = np.vstack([_line(track.starts[k, :2], track.starts[k + 1, :2]) for k in range(count)] + [[end[:2]]])
    path[-1, :2] = end[:2]
    if radius > 0:
        path[-1, 2] = end[2]
        path[:, 2] = wrap_angle(path[:, 2])
    return PlanResult(PlanStatus.SOLVED, path[:, :3 if radius > 0 else 2], float(sum(lengths)), word=word,
                      lengths=lengths)


def _line(start: NDArray[np.float64], end: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points (n, 2) from start on, without the end."""
    pieces = max(1, int(np.ceil(np.hypot(*(end - start)) / SPACING)))
    return start + (end - start) * (np.arange(pieces) / pieces)[:, None]
