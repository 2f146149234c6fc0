"""Poses along a curve of arcs and straights."""
import numpy as np
from numba import f8, i8, njit, types, void

POSE = types.UniTuple(f8, 3)
TURNS = types.Array(i8, 1, 'C', readonly=True)
LENGTHS = types.Array(f8, 1, 'C', readonly=True)


@njit(POSE(f8, f8, f8, i8, f8, f8), nogil=True, cache=True, _nrt=False)
def advanced(x, y, heading, turn, length, radius):
    """Return the pose after one segment: turn 1 to the left, 0 straight, -1 to the right; backwards if negative.

    By its chord: a difference of two sines would lose short arcs.
    """
    if turn == 0:
        return x + length * np.cos(heading), y + length * np.sin(heading), heading
    half = 0.5 * turn * length / radius
    chord = 2.0 * radius * np.sin(0.5 * length / radius)
    return x + chord * np.cos(heading + half), y + chord * np.sin(heading + half), heading + 2.0 * half


@njit(void(f8, f8, f8, TURNS, LENGTHS, f8, LENGTHS, f8[:, ::1]), nogil=True, cache=True)
def write_poses(x, y, heading, turns, lengths, radius, places, poses):
    """Write the pose (x, y, heading) at each of the ascending arc lengths ``places`` [m] into ``poses`` (n, 3)."""
    segment, begun = 0, 0.0
    for k in range(len(places)):
        while segment < len(turns) - 1 and places[k] > begun + abs(lengths[segment]):
            begun += abs(lengths[segment])
            x, y, heading = advanced(x, y, heading, turns[segment], lengths[segment], radius)
            segment += 1
        driven = min(places[k] - begun, abs(lengths[segment]))
        poses[k, 0], poses[k, 1], poses[k, 2] = advanced(
            x, y, heading, turns[segment], -driven if lengths[segment] < 0 else driven, radius)
