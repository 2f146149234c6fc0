"""The order of the moves of a joint plan: which waits for which, and when all are over by that.

The steps of pebbles are no timetable: what is left of them is that a move comes after those of others that it would
meet. The moves are cut into short ones, so that nobody waits for longer than it must.
"""
from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.fleet import pebbles
from mobile_planning.fleet.pebbles import Instance, Steps

#: Moves are no longer than this [m].
PIECE = 0.3
#: They are looked at in pieces of this [m], where only the time counts.
_FINE = 0.15


def finish_times(instance: Instance, places: NDArray[np.float64], steps: Steps, radii: ArrayLike,
                 gap: float, leads: ArrayLike) -> NDArray[np.float64]:
    """Return when each robot (N,) has made its last move, as the way [m] that is driven at full speed until then.

    Parameters
    ----------
    instance : Instance
    places : (n, 2) ndarray [m]
    steps : Steps
    radii : (N,) array_like [m]
    gap : float [m]
        Moves meet where they leave less than this between two bodies.
    leads : (N,) array_like [m]
        What each robot has to drive before its first move.
    """
    from mobile_planning.fleet import move_order_kernels as kernels

    return kernels.finish_times(places, steps.places, steps.edges, pebbles.ranks(instance, steps),
                                np.asarray(radii, float), np.asarray(leads, float), gap, _FINE)


def _turns(instance, steps):
    """Return the turn (T, N) in which each robot makes its move of each step."""
    ranks = pebbles.ranks(instance, steps)
    return np.arange(len(ranks))[:, None] * (instance.count + 1) + ranks


def order_moves(instance: Instance, places: NDArray[np.float64], steps: Steps, radii: ArrayLike,
                gap: float) -> tuple[list[NDArray[np.float64]], list[list[list[tuple[int, int]]]]]:
    """Return the ways (K + 1, 2) of all robots without their waits, and what each move needs, as in `JointWays`.

    The moves of the steps are cut into short ones, so that nobody waits for longer than it must. A move waits for the
    last move of each other robot that comes before it, by its step and its turn in the step, and that it would meet.

    Parameters
    ----------
    instance : Instance
    places : (n, 2) ndarray [m]
    steps : Steps
    radii : (N,) array_like [m]
    gap : float [m]
        Moves meet where they leave less than this between two bodies.
    """
    count, radii = instance.count, np.asarray(radii, float)
    robot, at = np.nonzero(steps.edges.T >= 0)
    when = _turns(instance, steps)[at, robot]
    u, v, e = steps.places[at, robot], steps.places[at + 1, robot], steps.edges[at, robot]
    kinds = instance.kinds[robot[:, None], robot]
    meets = _crosses(places[u], places[v])
    for end in (u, v):
        sweeps = instance.swept[kinds, e[:, None], end]
        meets |= sweeps | sweeps.T
    later, earlier = np.nonzero(meets & (when[:, None] > when) & (robot[:, None] != robot))

    move, ends = _cut(places[u], places[v])
    robot = robot[move]
    first = np.searchsorted(robot, np.arange(count + 1))
    waits = np.zeros((len(move),) * 2, np.int64)
    i, j = _pairs_of_pieces(move, later, earlier)
    meet = segments_apart(ends[i], ends[j]) < radii[robot[i]] + radii[robot[j]] + gap
    waits[i[meet], j[meet]] = (np.arange(len(robot)) - first[robot] + 1)[j[meet]]
    ways = [np.concatenate([places[steps.places[:1, i]], ends[first[i]:first[i + 1], 1]]) for i in range(count)]
    needs = []
    for i in range(count):
        own = waits[first[i]:first[i + 1]]
        most = np.stack([own[:, first[j]:first[j + 1]].max(axis=1, initial=0) for j in range(count)], axis=1)
        before = np.maximum.accumulate(np.concatenate([np.zeros((1, count), most.dtype), most]), axis=0)[:-1]
        needs.append([[(int(j), int(row[j])) for j in np.flatnonzero(row > known)] for row, known in zip(most, before)])
    return ways, needs


def _cut(a, b):
    """Return pieces of the segments from ``a`` to ``b`` (K, 2): of which segment each is, and its ends (P, 2, 2)."""
    count = np.maximum(np.ceil(np.linalg.norm(b - a, axis=1) / PIECE - 1e-9).astype(np.int64), 1)
    move = np.repeat(np.arange(len(a)), count)
    number = np.arange(len(move)) - np.repeat(np.cumsum(count) - count, count)
    shares = np.stack([number, number + 1], axis=1) / count[move, None]
    ends = a[move, None] + shares[..., None] * (b - a)[move, None]
    # The last piece ends exactly where the move does: it may be the goal.
    is_last = number + 1 == count[move]
    ends[is_last, 1] = b[move[is_last]]
    return move, ends


def _pairs_of_pieces(move, a, b):
    """Return the pairs of pieces of the moves ``a`` and ``b`` (L,), two (Q,) arrays; ``move`` (P,) is sorted."""
    first, last = (np.searchsorted(move, np.arange(move.max(initial=-1) + 2), side) for side in ('left', 'right'))
    counts = (last - first)[a] * (last - first)[b]
    pair = np.repeat(np.arange(len(a)), counts)
    number = np.arange(len(pair)) - np.repeat(np.cumsum(counts) - counts, counts)
    width = (last - first)[b][pair]
    return first[a][pair] + number // np.maximum(width, 1), first[b][pair] + number % np.maximum(width, 1)


def segments_apart(a, b):
    """Return the distance of the segments ``a`` and ``b`` (Q, 2, 2) [m], row by row; 0 where they cross."""
    def to_segment(points, ends):
        along, offset = ends[:, 1] - ends[:, 0], points - ends[:, 0]
        share = np.clip((along * offset).sum(axis=1) / np.maximum((along**2).sum(axis=1), 1e-18), 0.0, 1.0)
        return np.linalg.norm(offset - share[:, None] * along, axis=1)

    def is_split(ends, other):
        along = ends[:, 1] - ends[:, 0]
        sides = [along[:, 0] * offset[:, 1] - along[:, 1] * offset[:, 0]
                 for offset in (other[:, 0] - ends[:, 0], other[:, 1] - ends[:, 0])]
        return sides[0] * sides[1] < 0

    apart = np.min([to_segment(a[:, 0], b), to_segment(a[:, 1], b), to_segment(b[:, 0], a), to_segment(b[:, 1], a)],
                   axis=0)
    return np.where(is_split(a, b) & is_split(b, a), 0.0, apart)


def _crosses(a, b):
    """Return which of the segments from ``a`` to ``b`` (K, 2) cross each other (K, K)."""
    along = b - a
    from_a, from_b = a[None] - a[:, None], b[None] - a[:, None]
    side_a = along[:, None, 0] * from_a[..., 1] - along[:, None, 1] * from_a[..., 0]
    side_b = along[:, None, 0] * from_b[..., 1] - along[:, None, 1] * from_b[..., 0]
    splits = side_a * side_b < 0
    return splits & splits.T
