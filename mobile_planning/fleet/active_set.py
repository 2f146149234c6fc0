"""The dual active set method of Goldfarb and Idnani (1983) for small dense strictly convex QPs, in plain numpy.

Find ``x`` that minimises ``1/2 x'Px + g'x`` with ``n_i.x = b_i`` for the first rows and ``n_i.x >= b_i`` for the
others. The method starts at the optimum without the inequalities, or with those that a guess names. As long as a row
is violated it takes in the worst one, along the way dropping the active rows that pull the wrong way. Every iterate is
the optimum on its active rows, and the cost grows strictly, so that no active set comes back.

The names are the paper's. ``N`` are the normals of the ``q`` active rows, and ``J = [J1 J2]``, ``R`` their factors:
``J'PJ = I`` and ``J'N = [R; 0]``. For the normal ``n`` of the row that enters, ``d = J'n``; ``z = J2 d2`` is the
direction of the step in ``x``, and ``-r = -inv(R) d1`` that of the multipliers ``u``. A step as long as ``t1`` brings a
multiplier to 0, one as long as ``t2`` satisfies the row.

Rows are scaled to unit length, so that slacks are distances.

Goldfarb, D. and Idnani, A. (1983): A numerically stable dual method for solving strictly convex quadratic programs.
Mathematical Programming 27, 1-33.
"""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

# All of these are in `qp_kernels` once more.
SOLVED, INFEASIBLE, LIMIT, BAD_INPUT = range(4)
#: A row violated by less, plus the rounding of numbers as large as those of x, is satisfied.
FEASIBLE, ROUNDING = 1e-9, 1e-13
#: Share of |d|^2 in |d2|^2 below which a normal depends on the active ones; for a mere guess the demand is higher.
DEPENDENT, WELL_INDEPENDENT = 1e-14, 1e-8
#: A row shorter than this is zero.
TINY = 1e-100
#: A multiplier that falls more slowly than this never gets to 0.
LEAST_RATE = 1e-14


def solve(inverse_factor: NDArray, gradient: NDArray, rows: NDArray, bounds: NDArray, equalities: int,
          guess: NDArray, limit: int) -> tuple[NDArray, int, int, NDArray]:
    """Return x (n,), a status, the number of steps, and the active inequalities as indices of rows.

    Parameters
    ----------
    inverse_factor : (n, n) ndarray
        Any ``J`` with ``J J' = inv(P)``.
    gradient : (n,) ndarray
    rows : (m, n) ndarray
    bounds : (m,) ndarray
        -inf for a row that does not count.
    equalities : int
        How many of the first rows are equations.
    guess : (k,) ndarray of int
        Rows that may be active.
    limit : int
        On the number of steps.
    """
    none = np.empty(0, np.int64)
    with np.errstate(over='ignore', invalid='ignore', divide='ignore'):
        normals, h, status = _scaled(rows, bounds, equalities)
        if not np.isfinite(gradient).all():
            status = BAD_INPUT
        if status != SOLVED:
            return np.zeros(len(gradient)), status, 0, none
        x, status, steps, active = _iterate(_Factors(inverse_factor), gradient, normals, h, equalities, guess, limit)
    return x, status, steps, np.array(active, np.int64) if status == SOLVED else none


def _iterate(factors, gradient, normals, h, equalities, guess, limit):
    """Return x, a status, the number of steps and the active inequalities; the rows are of unit length."""
    for row in range(equalities):
        factors.offer(row, normals[row], DEPENDENT)
    fixed = factors.q
    for row in guess[(guess >= equalities) & (guess < len(h))]:
        if h[row] > -np.inf:
            factors.offer(row, normals[row], WELL_INDEPENDENT)
    x, steps = factors.optimum(gradient, h), 0
    while factors.q > fixed and factors.u[fixed:].min() < 0:
        factors.drop(fixed + int(factors.u[fixed:].argmin()))
        x, steps = factors.optimum(gradient, h), steps + 1
    if not np.isfinite(x).all():
        return x, BAD_INPUT, steps, []
    if (np.abs(normals[:equalities] @ x - h[:equalities]) > _tolerance(x)).any():
        return x, INFEASIBLE, steps, []
    while steps < limit:
        slacks = normals[equalities:] @ x - h[equalities:]
        p = int(slacks.argmin()) + equalities if len(slacks) else -1
        if not np.isfinite(x).all():
            return x, BAD_INPUT, steps, []
        if p < 0 or slacks[p - equalities] >= -_tolerance(x):
            return x, SOLVED, steps, factors.rows[fixed:]
        if p in factors.rows:
            break  # only rounding can bring that about
        x, status, steps = _take_in(factors, p, normals[p], h[p], x, fixed, steps, limit)
        if status != SOLVED:
            return x, status, steps, []
    return x, LIMIT, steps, []


def _take_in(factors, p, n, bound, x, fixed, steps, limit):
    """Step until row ``p`` is satisfied and active; return x, a status and the number of steps."""
    u_p = 0.0
    while steps < limit:
        steps += 1
        q, R = factors.q, factors.R
        d = factors.J.T @ n
        d2 = d[q:]
        z_n = d2 @ d2
        r = np.linalg.solve(R[:q, :q], d[:q])
        times = np.append(np.where(r > LEAST_RATE, factors.u / r, np.inf)[fixed:], np.inf)
        out = int(times.argmin())
        t1, t2 = times[out], (bound - n @ x) / z_n if z_n > DEPENDENT * (d @ d) else np.inf
        t = min(t1, t2)
        if t == np.inf:
            return x, INFEASIBLE, steps
        if t2 < np.inf:
            x = x + t * (factors.J[:, q:] @ d2)
        factors.u, u_p = factors.u - t * r, u_p + t
        if t2 <= t1:
            factors.add(p, d, u_p)
            return x, SOLVED, steps
        factors.drop(fixed + out)
    return x, LIMIT, steps


class _Factors:
    """The active rows, their multipliers ``u``, and the factors ``J`` and ``R`` of their normals."""

    def __init__(self, inverse_factor):
        self.J = inverse_factor.copy()
        self.R = np.zeros_like(self.J)
        self.rows = []
        self.u = np.empty(0)

    @property
    def q(self):
        """Number of active rows."""
        return len(self.rows)

    def offer(self, row, n, share):
        """Take in a row if it is as independent of the others as ``share`` demands."""
        d = self.J.T @ n
        if (d[self.q:] ** 2).sum() > share * (d @ d):
            self.add(row, d, 0.0)

    def optimum(self, gradient, h):
        """Return the optimum x on the active rows and set their multipliers."""
        q, g = self.q, self.J.T @ gradient
        y = np.linalg.solve(self.R[:q, :q].T, h[self.rows])
        self.u = np.linalg.solve(self.R[:q, :q], y + g[:q])
        return self.J[:, :q] @ y - self.J[:, q:] @ g[q:]

    def add(self, row, d, u):
        """Append a row: a reflection of J2 leaves one entry of d2."""
        q = self.q
        v = d[q:].copy()
        length = -np.copysign(np.linalg.norm(v), v[0])
        v[0] -= length
        self.J[:, q:] -= np.outer(self.J[:, q:] @ v, v * (2.0 / (v @ v)))
        self.R[:q, q], self.R[q, q] = d[:q], length
        self.rows.append(row)
        self.u = np.append(self.u, u)

    def drop(self, place):
        """Remove the row at ``place``; a rotation of J1 makes R a triangle again."""
        q = self.q
        turn, R = np.linalg.qr(np.delete(self.R[:q, :q], place, axis=1), mode='complete')
        self.J[:, :q] = self.J[:, :q] @ turn
        self.R[:q, :q - 1], self.R[:q, q - 1] = R, 0.0
        del self.rows[place]
        self.u = np.delete(self.u, place)


def _tolerance(x):
    return FEASIBLE + ROUNDING * np.abs(x).max()


def _scaled(rows, bounds, equalities):
    """Return the normals of unit length, their bounds, and a status; rows that do not count are zero."""
    wanted = bounds != -np.inf
    wanted[:equalities] = True
    norms = np.sqrt(np.einsum('ij,ij->i', rows, rows))
    if not (np.isfinite(norms[wanted]) & np.isfinite(bounds[wanted])).all():
        return rows, bounds, BAD_INPUT
    zero = wanted & (norms < TINY)
    unmet = np.where(np.arange(len(bounds)) < equalities, np.abs(bounds), bounds) > FEASIBLE
    if (zero & unmet).any():
        return rows, bounds, INFEASIBLE
    wanted &= ~zero
    normals = np.divide(rows, norms[:, None], out=np.zeros_like(rows), where=wanted[:, None])
    h = np.divide(bounds, norms, out=np.full_like(bounds, -np.inf), where=wanted)
    h[:equalities][~wanted[:equalities]] = 0.0
    return normals, h, SOLVED if np.isfinite(h[wanted]).all() else BAD_INPUT
