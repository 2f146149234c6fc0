"""Visits: when a robot stood at each of its goals, read from its published plans alone."""
from __future__ import annotations

import numpy as np
from numpy.linalg import norm

from mobile_planning.fleet.track import Track
from mobile_planning.geometry import wrap_angle


def visits(track: Track, near: float, turned: float) -> list[float]:
    """Return the times [s] since the start at which the robot had reached one goal after the other.

    It has reached one when for a whole span it neither drives nor turns, within ``near`` [m] of the place and within
    ``turned`` [rad] of the heading. A goal counts only after all goals before it, each with a span of its own.
    """
    knots = np.arange(0, max(int(track.last[-1]), 0) + len(track.body.goals) + 1)
    spans = track.at(track.driven(knots), knots)
    stands = ~track.velocity[spans].any(axis=(1, 2)) & (track.turn[spans] == 0.0)
    times, since = [], 0
    for goal in track.body.goals:
        is_there = (stands & (norm(track.points[spans, 3] - goal[:2], axis=1) <= near)
                    & (np.abs(wrap_angle(track.theta[spans] - goal[2])) <= turned))
        found = np.flatnonzero(is_there[since:])
        if not len(found):
            break
        since += int(found[0]) + 1
        times.append(float(track.time(knots[since - 1])))
    return times
