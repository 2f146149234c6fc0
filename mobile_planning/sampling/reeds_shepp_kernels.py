"""The words of Reeds and Shepp in closed form.

Reeds and Shepp (1990), Optimal paths for a car that goes both forwards and backwards, Pacific Journal of Mathematics
145(2), section 8, where the numbers of the formulas are from. Frame and units as in `dubins_kernels`.

Nine formulas cover 48 words: each is asked for the goal as it is, for the goal seen in a mirror (left and right change
places), for time running backwards (forwards and backwards do), for both, and, where the order of segments matters,
for the way from the goal to the start. A word is a number: its formula, plus 16 for backwards in time, 32 for the
mirror, 64 for the reversed order.
"""
import numpy as np
from numba import f8, i8, njit, types, void

from mobile_planning.sampling.dubins_kernels import POSES, TURN, tangent

LENGTHS = types.UniTuple(f8, 5)
SOLUTION = types.Tuple((f8, i8, f8, f8, f8, f8, f8))
#: Turns of each formula's segments: 1 left, 0 straight, -1 right; 9 where there is none.
TURNS = np.array([
    [1, 0, 1, 9, 9],      # 0: L+ S+ L+, 8.1
    [1, 0, -1, 9, 9],     # 1: L+ S+ R+, 8.2
    [1, -1, 1, 9, 9],     # 2: L+ R- L+, 8.3
    [1, -1, 1, 9, 9],     # 3: L+ R- L-, 8.4
    [1, -1, 1, -1, 9],    # 4: L+ R+ L- R-, 8.7
    [1, -1, 1, -1, 9],    # 5: L+ R- L- R+, 8.8
    [1, -1, 0, 1, 9],     # 6: L+ R- S- L-, 8.9
    [1, -1, 0, -1, 9],    # 7: L+ R- S- R-, 8.10
    [1, -1, 0, 1, -1],    # 8: L+ R- S- L- R+, 8.11
])
FORMULAS = 9
BACKWARDS, MIRRORED, REVERSED = 16, 32, 64
_NONE = (np.inf, 0.0, 0.0, 0.0, 0.0)
_SNAP = 1e-10
_QUARTER = 0.5 * np.pi


@njit(f8(f8), nogil=True, cache=True, _nrt=False)
def wrapped(angle):
    """Return the angle in [-pi, pi)."""
    return angle - TURN * np.floor((angle + np.pi) / TURN)


@njit(types.UniTuple(f8, 2)(f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def tau_omega(u, v, xi, eta, phi):
    """Return the outer angles of a four-arc word whose middle arcs are u and v (8.5 and 8.6)."""
    delta = wrapped(u - v)
    a, b = np.sin(u) - np.sin(delta), np.cos(u) - np.cos(delta) - 1.0
    t1 = np.arctan2(eta * a - xi * b, xi * a + eta * b)
    t2 = 2.0 * (np.cos(delta) - np.cos(v) - np.cos(u)) + 3.0
    tau = wrapped(t1 + np.pi) if t2 < 0.0 else wrapped(t1)
    return tau, wrapped(tau - u + v - phi)


@njit(LENGTHS(i8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def solve(formula, x, y, phi):
    """Return the lengths of a formula's segments, negative ones driven backwards; the first infinite if it has none."""
    sin, cos = np.sin(phi), np.cos(phi)
    # Centres of the circles: of the same side (xi, eta), of the other side.
    xi, eta = x - sin, y - 1.0 + cos
    rho = np.sqrt(xi * xi + eta * eta)
    other_xi, other_eta = x + sin, y - 1.0 - cos
    other_rho = np.sqrt(other_xi * other_xi + other_eta * other_eta)
    if formula == 0:
        t = np.arctan2(eta, xi)
        return t, rho, wrapped(phi - t), 0.0, 0.0
    if formula == 1:
        u = tangent(other_rho * other_rho)
        if u < 0.0:
            return _NONE
        t = np.arctan2(other_eta, other_xi) + np.arctan2(2.0, u)
        return wrapped(t), u, wrapped(t - phi), 0.0, 0.0
    if formula == 2 or formula == 3:
        if rho > 4.0 + _SNAP:
            return _NONE
        theta = np.arctan2(eta, xi)
        if formula == 2:
            a = np.arccos(min(0.25 * rho, 1.0))
            t, u = wrapped(theta + a + _QUARTER), wrapped(np.pi - 2.0 * a)
            return t, -u, wrapped(phi - t - u), 0.0, 0.0
        u = -2.0 * np.arcsin(min(0.25 * rho, 1.0))
        t = wrapped(theta + 0.5 * u + np.pi)
        return t, u, wrapped(phi - t + u), 0.0, 0.0
    if formula == 4:
        r = 0.25 * (2.0 + other_rho)
        if r > 1.0 + _SNAP:
            return _NONE
        u = np.arccos(min(r, 1.0))
        t, v = tau_omega(u, -u, other_xi, other_eta, phi)
        return t, u, -u, v, 0.0
    if formula == 5:
        r = (20.0 - other_rho * other_rho) / 16.0
        if r < -_SNAP or r > 1.0 + _SNAP:
            return _NONE
        u = -np.arccos(min(max(r, 0.0), 1.0))
        t, v = tau_omega(u, u, other_xi, other_eta, phi)
        return t, u, u, v, 0.0
    if formula == 6:
        if rho < 2.0 - _SNAP:
            return _NONE
        r = np.sqrt(max(rho * rho - 4.0, 0.0))
        t = wrapped(np.arctan2(eta, xi) + np.arctan2(r, -2.0))
        return t, -_QUARTER, 2.0 - r, wrapped(phi - _QUARTER - t), 0.0
    if other_rho < 2.0 - _SNAP:
        return _NONE
    if formula == 7:
        t = np.arctan2(other_xi, -other_eta)
        return t, -_QUARTER, 2.0 - other_rho, wrapped(t + _QUARTER - phi), 0.0
    u = 4.0 - np.sqrt(max(other_rho * other_rho - 4.0, 0.0))
    if u > _SNAP:
        return _NONE
    t = wrapped(np.arctan2((4.0 - u) * other_xi - 2.0 * other_eta, -2.0 * other_xi + (u - 4.0) * other_eta))
    return t, -_QUARTER, u, -_QUARTER, wrapped(t - phi)


@njit(f8(LENGTHS), nogil=True, cache=True, _nrt=False)
def total(lengths):
    """Return the length of all segments."""
    return abs(lengths[0]) + abs(lengths[1]) + abs(lengths[2]) + abs(lengths[3]) + abs(lengths[4])


@njit(LENGTHS(f8, f8, f8, i8), nogil=True, cache=True, _nrt=False)
def solve_word(x, y, phi, word):
    """Return the segment lengths of a word in the order of its formula; the first infinite if it has no solution."""
    if word & REVERSED:
        # The start seen from the goal, with time running backwards.
        sin, cos = np.sin(phi), np.cos(phi)
        x, y = x * cos + y * sin, x * sin - y * cos
    if word & MIRRORED:
        y, phi = -y, -phi
    if word & BACKWARDS:
        x, phi = -x, -phi
    return solve(word & 15, x, y, phi)


@njit(f8(f8, f8, f8, i8, LENGTHS), nogil=True, cache=True, _nrt=False)
def miss(x, y, phi, word, lengths):
    """Return how far from the goal the segments lead, in radii and radians: a formula's root may be the wrong one."""
    at_x, at_y, heading = 0.0, 0.0, 0.0
    for k in range(5):
        segment = k
        if word & REVERSED:
            segment = 4 - k
        turn = TURNS[word & 15, segment]
        if turn == 9:
            continue
        length = -lengths[segment] if word & BACKWARDS else lengths[segment]
        if turn == 0:
            at_x, at_y = at_x + length * np.cos(heading), at_y + length * np.sin(heading)
            continue
        turn = -turn if word & MIRRORED else turn
        after = heading + turn * length
        at_x += turn * (np.sin(after) - np.sin(heading))
        at_y += turn * (np.cos(heading) - np.cos(after))
        heading = after
    return max(abs(at_x - x), abs(at_y - y), abs(wrapped(heading - phi)))


@njit(SOLUTION(f8, f8, f8), nogil=True, cache=True, _nrt=False)
def shortest_local(x, y, phi):
    """Return length, word and segment lengths of the shortest path, in radii; of equal ones the word that comes first.
    """
    best, best_word, best_lengths = np.inf, -1, _NONE
    for formula in range(FORMULAS):
        reversals = 2 if formula == 3 or formula == 6 or formula == 7 else 1
        for change in range(4 * reversals):
            word = formula + BACKWARDS * change
            lengths = solve_word(x, y, phi, word)
            length = total(lengths)
            if length < best - 1e-12 and miss(x, y, phi, word, lengths) < 1e-8:
                best, best_word, best_lengths = length, word, lengths
    return (best, best_word, best_lengths[0], best_lengths[1], best_lengths[2], best_lengths[3], best_lengths[4])


@njit(SOLUTION(f8, f8, f8, f8, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def shortest_between(x0, y0, heading0, x1, y1, heading1, radius):
    """Return length [m], word and segment lengths [m] of the shortest path between two poses."""
    sin, cos = np.sin(heading0), np.cos(heading0)
    dx, dy = (x1 - x0) / radius, (y1 - y0) / radius
    length, word, a, b, c, d, e = shortest_local(
        cos * dx + sin * dy, cos * dy - sin * dx, wrapped(heading1 - heading0))
    return length * radius, word, a * radius, b * radius, c * radius, d * radius, e * radius


@njit(void(POSES, POSES, f8, f8[::1]), nogil=True, cache=True, _nrt=False)
def lengths_between(starts, goals, radius, out):
    """Write the length [m] of the shortest path of each pair; one start or goal serves all."""
    for k in range(len(out)):
        a, b = min(k, len(starts) - 1), min(k, len(goals) - 1)
        out[k] = shortest_between(starts[a, 0], starts[a, 1], starts[a, 2], goals[b, 0], goals[b, 1], goals[b, 2],
                                  radius)[0]
