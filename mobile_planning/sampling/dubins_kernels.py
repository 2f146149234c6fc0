"""Dubins' six words in closed form.

Everything is in the frame of the start and in units of the turning radius: the start is the origin, headed along +x,
the goal is (x, y, phi) with phi in [0, 2 pi). A word that begins to the right is one that begins to the left, seen in
a mirror: y and phi change their signs. `WORDS` in `dubins` names the codes.

An arc of 2 pi less a rounding error is an arc of 0; taken for what it says, it would add a whole circle. Where an arc
meets a straight as short as the rounding itself, its angle is noise. So an angle is made 0 where the end of the path
moves by less than `SNAP` because of it, and the other arc takes up the whole turn: the final heading stays exact.
"""
import numpy as np
from numba import f8, i8, njit, types, void

TURN = 2.0 * np.pi
SNAP = 1e-10
LSL, RSR, RSL, LSR, RLR, LRL = range(6)
ALL_WORDS = 0b111111
ANGLES = types.UniTuple(f8, 3)
POSES = types.Array(f8, 2, 'C', readonly=True)
SHORTEST = types.Tuple((f8, i8, f8, f8, f8))


@njit(f8(f8), nogil=True, cache=True)
def full_turn(angle):
    """Return the angle in [0, 2 pi); what is above 2 pi - SNAP is 0."""
    angle -= TURN * np.floor(angle / TURN)
    return 0.0 if angle >= TURN - SNAP else angle


@njit(ANGLES(f8, f8, f8, f8), nogil=True, cache=True)
def solve_lsl(u, v, p, phi):
    """Return the angles and the straight (t, p, q) of LSL; (u, v) joins the circles' centres, at distance p."""
    t = np.arctan2(v, u)
    if t < 0.0:
        t += TURN
    if p * (TURN - t) <= SNAP:
        return 0.0, p, phi
    q = phi - t
    if q < 0.0:
        q += TURN
    if p * (TURN - q) <= SNAP:
        return phi, p, 0.0
    return t, p, q


@njit(ANGLES(f8, f8, f8, f8), nogil=True, cache=True)
def solve_lsr(u, v, p, phi):
    """Return (t, p, q) of LSR; (u, v) joins the circles' centres, p is the length of their inner tangent."""
    t = np.arctan2(v * p + 2.0 * u, u * p - 2.0 * v)
    if t < 0.0:
        t += TURN
    if (TURN - t) * (p + 2.0) <= SNAP:
        t = 0.0
    return t, p, full_turn(t - phi)


@njit(ANGLES(f8, f8, f8, f8), nogil=True, cache=True)
def solve_lrl(u, v, distance, phi):
    """Return (t, p, q) of LRL; (u, v) joins the outer circles' centres, which are at most 4 apart."""
    if distance <= SNAP:
        return 0.0, TURN, phi
    half = np.arccos(min(0.25 * distance, 1.0))
    t = full_turn(np.arctan2(v, u) + half + 0.5 * np.pi)
    p = np.pi + 2.0 * half
    return t, p, full_turn(phi - t + p)


@njit(f8(f8), nogil=True, cache=True)
def tangent(squared):
    """Return the inner tangent of two unit circles whose centres are so far apart, squared; -1 if there is none."""
    room = squared - 4.0
    if room < -0.1 * SNAP:
        return -1.0
    return np.sqrt(max(room, 0.0))


@njit(SHORTEST(f8, f8, f8, i8), nogil=True, cache=True)
def shortest_local(x, y, phi, words):
    """Return length, word and (t, p, q) of the shortest of the allowed words; the word is -1 if none reaches.

    ``words`` is a mask, bit k for word k. Of equal lengths the first word wins. A word is solved only if its straight
    alone does not lose.
    """
    phi = full_turn(phi)
    mirrored = full_turn(-phi)
    sin, cos = np.sin(phi), np.cos(phi)
    length, word, t, p, q = np.inf, -1, 0.0, 0.0, 0.0
    # Centres of the circles on the same side: for LSL and LRL, and mirrored for RSR and RLR.
    ul, vl = x - sin, y - 1.0 + cos
    ur, vr = x + sin, -y - 1.0 + cos
    left, right = np.sqrt(ul * ul + vl * vl), np.sqrt(ur * ur + vr * vr)
    if words & (1 << LSL):
        t, p, q = solve_lsl(ul, vl, left, phi)
        length, word = t + p + q, LSL
    if words & (1 << RSR) and right < length:
        a, b, c = solve_lsl(ur, vr, right, mirrored)
        if a + b + c < length:
            length, word, t, p, q = a + b + c, RSR, a, b, c
    # Centres on opposite sides.
    u, v = x - sin, -y - 1.0 - cos
    straight = tangent(u * u + v * v)
    if words & (1 << RSL) and 0.0 <= straight < length:
        a, b, c = solve_lsr(u, v, straight, mirrored)
        if a + b + c < length:
            length, word, t, p, q = a + b + c, RSL, a, b, c
    u, v = x + sin, y - 1.0 - cos
    straight = tangent(u * u + v * v)
    if words & (1 << LSR) and 0.0 <= straight < length:
        a, b, c = solve_lsr(u, v, straight, phi)
        if a + b + c < length:
            length, word, t, p, q = a + b + c, LSR, a, b, c
    # The middle arc of these is at least pi.
    if words & (1 << RLR) and right <= 4.0 + SNAP and np.pi < length:
        a, b, c = solve_lrl(ur, vr, right, mirrored)
        if a + b + c < length:
            length, word, t, p, q = a + b + c, RLR, a, b, c
    if words & (1 << LRL) and left <= 4.0 + SNAP and np.pi < length:
        a, b, c = solve_lrl(ul, vl, left, phi)
        if a + b + c < length:
            length, word, t, p, q = a + b + c, LRL, a, b, c
    return length, word, t, p, q


@njit(SHORTEST(f8, f8, f8, f8, f8, f8, f8, i8), nogil=True, cache=True)
def shortest_between(x0, y0, heading0, x1, y1, heading1, radius, words):
    """Return length [m], word and its three segments [m] from one pose to another."""
    sin, cos = np.sin(heading0), np.cos(heading0)
    dx, dy = (x1 - x0) / radius, (y1 - y0) / radius
    length, word, t, p, q = shortest_local(
        cos * dx + sin * dy, cos * dy - sin * dx, heading1 - heading0, words)
    return length * radius, word, t * radius, p * radius, q * radius


@njit(void(POSES, POSES, f8, i8, f8[::1]), nogil=True, cache=True)
def lengths_between(starts, goals, radius, words, out):
    """Write the length [m] of the shortest allowed word of each pair; one start or goal serves all."""
    for k in range(len(out)):
        a, b = min(k, len(starts) - 1), min(k, len(goals) - 1)
        out[k] = shortest_between(starts[a, 0], starts[a, 1], starts[a, 2], goals[b, 0], goals[b, 1], goals[b, 2],
                                  radius, words)[0]
