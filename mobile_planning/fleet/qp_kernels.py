"""The dual active set method of `active_set` as loops: the same steps, the same names, compiled.

Most of the work would be the slacks of all the rows at every step. A row of unit length loses no more slack than x
moves: with the slack it had when it was last looked at, it is looked at again only once x has moved that far since.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL.
"""
import numpy as np
from numba import b1, f8, i8, njit, types

# What these mean stands in `active_set`, which has the same; numba's cache would not notice a change over there.
SOLVED, INFEASIBLE, LIMIT, BAD_INPUT = range(4)
FEASIBLE, ROUNDING = 1e-9, 1e-13
DEPENDENT, WELL_INDEPENDENT = 1e-14, 1e-8
TINY, LEAST_RATE = 1e-100, 1e-14

# Arrays that are only read may be read-only.
MATRIX = types.Array(f8, 2, 'C', readonly=True)
VECTOR = types.Array(f8, 1, 'C', readonly=True)
INDICES = types.Array(i8, 1, 'C', readonly=True)

# Sums may be taken in any order, which lets the compiler take four terms at a time; NaN and inf stay what they are.
SUMS = {'reassoc', 'contract'}


@njit(i8(MATRIX, VECTOR, i8, f8[::1], f8[::1]), nogil=True, cache=True, fastmath=SUMS)
def measure(rows, bounds, equalities, scale, due):
    """Set what each row is multiplied by to have unit length, and when it is due: at once or never; return a status."""
    count, size = rows.shape
    for i in range(count):
        scale[i], due[i] = 0.0, np.inf
        if bounds[i] == -np.inf and i >= equalities:
            continue
        square = 0.0
        for j in range(size):
            square += rows[i, j] * rows[i, j]
        length = np.sqrt(square)
        if not (np.isfinite(length) and np.isfinite(bounds[i])):
            return BAD_INPUT
        if length < TINY:
            if bounds[i] > FEASIBLE or (i < equalities and bounds[i] < -FEASIBLE):
                return INFEASIBLE
            continue
        scale[i], due[i] = 1.0 / length, -np.inf
        if not np.isfinite(bounds[i] * scale[i]):
            return BAD_INPUT
    return SOLVED


@njit(f8(VECTOR), nogil=True, cache=True)
def tolerance(x):
    """Return by how much a row may be violated; not finite if x is not."""
    largest = 0.0
    for value in x:
        if not abs(value) <= largest:
            largest = abs(value)
    return FEASIBLE + ROUNDING * largest


@njit(f8(MATRIX, VECTOR, f8[::1], i8, VECTOR), nogil=True, cache=True, fastmath=SUMS)
def slack(rows, bounds, scale, i, x):
    """Return how far x lies on the right side of row i."""
    value = 0.0
    for j in range(len(x)):
        value += rows[i, j] * x[j]
    return (value - bounds[i]) * scale[i]


@njit(i8(MATRIX, VECTOR, i8, f8[::1], f8[::1], VECTOR, f8, f8), nogil=True, cache=True, fastmath=SUMS)
def most_violated(rows, bounds, equalities, scale, due, x, travelled, allowed):
    """Return the inequality violated most by x, -1 if none is; ``travelled`` is how far x has moved so far."""
    worst, least = -1, -allowed
    # Rounding must not make a row seem further away than it is.
    now = travelled * (1.0 + 1e-12)
    for i in range(equalities, len(bounds)):
        if now < due[i]:
            continue
        s = slack(rows, bounds, scale, i, x)
        due[i] = travelled + s
        if s < least:
            worst, least = i, s
    return worst


@njit(f8(f8[:, ::1], MATRIX, i8, f8, i8, f8[::1], f8[::1]), nogil=True, cache=True, fastmath=SUMS)
def project(J, rows, row, factor, q, n, d):
    """Set the row's unit normal ``n`` and ``d = J'n``; return the share of |d2|^2 in |d|^2."""
    size = len(n)
    for j in range(size):
        n[j] = rows[row, j] * factor
        d[j] = 0.0
    for i in range(size):
        for j in range(size):
            d[j] += J[i, j] * n[i]
    inside, outside = 0.0, 0.0
    for j in range(q):
        inside += d[j] * d[j]
    for j in range(q, size):
        outside += d[j] * d[j]
    return outside / (inside + outside) if outside > 0.0 else 0.0


@njit(types.void(f8[:, ::1], f8[:, ::1], i8, f8[::1]), nogil=True, cache=True, fastmath=SUMS)
def add(J, R, q, d):
    """Append the normal with ``J'n = d`` to q active ones; a reflection of J2 leaves one entry of d2."""
    size = len(d)
    square = 0.0
    for j in range(q, size):
        square += d[j] * d[j]
    length = -np.copysign(np.sqrt(square), d[q])
    for j in range(q):
        R[j, q] = d[j]
    R[q, q] = length
    # d2 becomes the normal v of the mirror, of which v'v / 2 is:
    half = square - length * d[q]
    d[q] -= length
    for i in range(size):
        along = 0.0
        for j in range(q, size):
            along += J[i, j] * d[j]
        along /= half
        for j in range(q, size):
            J[i, j] -= along * d[j]


@njit(types.void(f8[:, ::1], f8[:, ::1], i8[::1], f8[::1], i8, i8), nogil=True, cache=True, fastmath=SUMS)
def drop(J, R, active, u, q, place):
    """Remove the active row at ``place`` of q; rotations of J1 make R a triangle again."""
    for j in range(place, q - 1):
        active[j], u[j] = active[j + 1], u[j + 1]
        for i in range(j + 2):
            R[i, j] = R[i, j + 1]
    for i in range(place, q - 1):
        length = np.hypot(R[i, i], R[i + 1, i])
        cos, sin = R[i, i] / length, R[i + 1, i] / length
        for j in range(i, q - 1):
            above, below = R[i, j], R[i + 1, j]
            R[i, j], R[i + 1, j] = cos * above + sin * below, cos * below - sin * above
        for j in range(len(J)):
            left, right = J[j, i], J[j, i + 1]
            J[j, i], J[j, i + 1] = cos * left + sin * right, cos * right - sin * left


@njit(types.void(f8[:, ::1], i8, f8[::1]), nogil=True, cache=True, fastmath=SUMS)
def back_substitute(R, q, r):
    """Replace the first q entries of ``r`` by ``inv(R) r``."""
    for i in range(q - 1, -1, -1):
        value = r[i]
        for j in range(i + 1, q):
            value -= R[i, j] * r[j]
        r[i] = value / R[i, i]


@njit(types.void(f8[:, ::1], f8[:, ::1], i8[::1], f8[::1], i8, VECTOR, VECTOR, f8[::1], f8[::1]), nogil=True,
      cache=True, fastmath=SUMS)
def optimum(J, R, active, u, q, gradient, bounds, scale, x):
    """Set the optimum x on the active rows, and their multipliers."""
    size = len(x)
    g, y = np.zeros(size), np.empty(q)
    for i in range(size):
        for j in range(size):
            g[j] += J[i, j] * gradient[i]
    for i in range(q):
        value = bounds[active[i]] * scale[active[i]]
        for j in range(i):
            value -= R[j, i] * y[j]
        y[i] = value / R[i, i]
    for i in range(size):
        value = 0.0
        for j in range(q):
            value += J[i, j] * y[j]
        for j in range(q, size):
            value -= J[i, j] * g[j]
        x[i] = value
    for j in range(q):
        u[j] = y[j] + g[j]
    back_substitute(R, q, u)


@njit(f8(f8[:, ::1], f8[::1], i8, f8, f8[::1]), nogil=True, cache=True, fastmath=SUMS)
def step_along(J, d, q, t, x):
    """Move x by ``t z``, ``z = J2 d2``; return how far that is."""
    square = 0.0
    for i in range(len(x)):
        z = 0.0
        for j in range(q, len(x)):
            z += J[i, j] * d[j]
        x[i] += t * z
        square += t * z * t * z
    return np.sqrt(square)


@njit(i8(f8[:, ::1], f8[:, ::1], i8[::1], f8[::1], i8, i8, MATRIX, i8, f8[::1], f8, f8[::1], f8[::1]), nogil=True,
      cache=True)
def offer(J, R, active, u, q, room, rows, row, scale, share, n, d):
    """Take in a row if it is as independent of the q active ones as ``share`` demands; return how many there are."""
    if q == room or not project(J, rows, row, scale[row], q, n, d) > share:
        return q
    add(J, R, q, d)
    active[q], u[q] = row, 0.0
    return q + 1


@njit(types.Tuple((i8, f8))(f8[::1], f8[::1], i8, i8), nogil=True, cache=True)
def first_to_vanish(u, r, fixed, q):
    """Return which multiplier reaches 0 first when ``u - t r`` is followed, and at which t; -1 and inf for none."""
    out, t1 = -1, np.inf
    for j in range(fixed, q):
        if r[j] > LEAST_RATE and u[j] < t1 * r[j]:
            out, t1 = j, u[j] / r[j]
    return out, t1


@njit(b1(i8[::1], i8, i8), nogil=True, cache=True)
def is_active(active, q, row):
    """Return whether the row is one of the q active ones."""
    for j in range(q):
        if active[j] == row:
            return True
    return False


@njit(types.Tuple((f8[::1], i8, i8, i8[::1]))(MATRIX, VECTOR, MATRIX, VECTOR, i8, INDICES, i8), nogil=True, cache=True,
      fastmath=SUMS)
def solve(inverse_factor, gradient, rows, bounds, equalities, guess, limit):
    """Return x, a status, the number of steps, and the active inequalities; see `active_set.solve`."""
    size, count = len(gradient), len(bounds)
    none = np.empty(0, np.int64)
    x, n, d, r, u = np.zeros(size), np.empty(size), np.empty(size), np.empty(size), np.empty(size)
    scale, due = np.empty(count), np.empty(count)
    status = measure(rows, bounds, equalities, scale, due)
    if not np.isfinite(np.abs(gradient).sum()):
        status = BAD_INPUT
    if status != SOLVED:
        return x, status, 0, none

    # The first active set: the equations, and what is right of the guess.
    J, R, active = inverse_factor.copy(), np.zeros((size, size)), np.empty(size, np.int64)
    q, steps = 0, 0
    for row in range(equalities):
        q = offer(J, R, active, u, q, size, rows, row, scale, DEPENDENT, n, d)
    fixed = q
    for row in guess:
        if equalities <= row < count and scale[row] > 0.0:
            q = offer(J, R, active, u, q, size, rows, row, scale, WELL_INDEPENDENT, n, d)
    optimum(J, R, active, u, q, gradient, bounds, scale, x)
    while q > fixed and u[fixed:q].min() < 0.0:
        drop(J, R, active, u, q, fixed + u[fixed:q].argmin())
        q, steps = q - 1, steps + 1
        optimum(J, R, active, u, q, gradient, bounds, scale, x)
    allowed = tolerance(x)
    for row in range(equalities):
        if abs(slack(rows, bounds, scale, row, x)) > allowed:
            return x, INFEASIBLE, steps, none

    # Take in the row violated most, until none is.
    travelled, p, u_p = 0.0, -1, 0.0
    while steps < limit:
        if p < 0:
            allowed, u_p = tolerance(x), 0.0
            if not np.isfinite(allowed):
                return x, BAD_INPUT, steps, none
            p = most_violated(rows, bounds, equalities, scale, due, x, travelled, allowed)
            if p < 0:
                return x, SOLVED, steps, active[fixed:q].copy()
            if is_active(active, q, p):
                break  # only rounding can bring that about
        steps += 1
        is_free = project(J, rows, p, scale[p], q, n, d) > DEPENDENT
        r[:q] = d[:q]
        back_substitute(R, q, r)
        out, t1 = first_to_vanish(u, r, fixed, q)
        t2 = np.inf
        if is_free:
            t2 = -slack(rows, bounds, scale, p, x) / (d[q:] * d[q:]).sum()
        t = min(t1, t2)
        if t == np.inf:
            return x, INFEASIBLE, steps, none
        if is_free:
            travelled += step_along(J, d, q, t, x)
        for j in range(q):
            u[j] -= t * r[j]
        u_p += t
        if t2 <= t1:
            add(J, R, q, d)
            active[q], u[q] = p, u_p
            q, p = q + 1, -1
        else:
            drop(J, R, active, u, q, out)
            q -= 1
    return x, LIMIT, steps, none
