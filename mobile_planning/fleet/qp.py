"""The quadratic program of one section: many problems that share their Hessian, solved one after the other."""
from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet import active_set

SOLVERS = ('active_set', 'osqp')
#: OSQP's own first weight of the constraints, which it adapts.
_RHO = 0.1

_STATUS = {active_set.SOLVED: 'solved', active_set.INFEASIBLE: 'infeasible', active_set.LIMIT: 'limit',
           active_set.BAD_INPUT: 'bad_input'}


@dataclass(frozen=True, eq=False)
class QPResult:
    """What became of one quadratic program.

    Attributes
    ----------
    x : (n,) ndarray or None
        The optimum; with status 'limit' the last iterate, which may violate rows; else None.
    status : str
        'solved', 'infeasible', 'limit' (not solved within the limit of steps), or 'bad_input' (a number is not finite,
        or too large to work with, or the shapes do not fit).
    iterations : int
        Rows taken in and dropped, or OSQP's iterations.
    active : (k,) ndarray of int64
        The inequalities that hold x in its place, a good guess for the next problem like this one.
    """

    x: NDArray[np.float64] | None
    status: str
    iterations: int = 0
    active: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))


class QuadraticProgram:
    """Minimise ``1/2 x'Px + q'x`` subject to linear equations and inequalities.

    Parameters
    ----------
    hessian : (n, n) array_like
        ``P``, symmetric and positive definite.
    solver : {'active_set', 'osqp'}
        The dual active set method is exact and quick for tens of variables. OSQP is a second opinion: it stops near
        the optimum, starts at its last result, and needs a ``limit`` of thousands where many rows are active.
    compiled : bool
        Whether the active set method runs as machine code, where numba is installed; without, it takes the same steps
        in numpy, in ten times the time.
    limit : int
        On the number of steps of one solution.

    Raises
    ------
    InvalidInput
        If the Hessian is not symmetric and positive definite or the solver is unknown.

    Examples
    --------
    The point nearest to (2, 1) with x + y <= 2 and y >= 0:

    >>> result = QuadraticProgram(np.eye(2)).solve([-2, -1], rows=[[-1, -1], [0, 1]], bounds=[-2, 0])
    >>> result.status, result.x, result.active
    ('solved', array([1.5, 0.5]), array([0]))
    """

    def __init__(self, hessian: ArrayLike, solver: str = 'active_set', *, compiled: bool = True, limit: int = 200):
        hessian = np.array(hessian, dtype=float)
        if solver not in SOLVERS:
            raise InvalidInput(f'QP solver {solver!r} is not one of {", ".join(SOLVERS)}')
        if hessian.ndim != 2 or not np.isfinite(hessian).all() or not np.array_equal(hessian, hessian.T):
            raise InvalidInput(f'the Hessian {hessian.shape} of a QP must be square, finite and symmetric')
        try:
            inverse_factor = np.linalg.inv(np.linalg.cholesky(hessian)).T
        except np.linalg.LinAlgError:
            raise InvalidInput('the Hessian of a QP must be positive definite') from None
        self.size = len(hessian)
        if solver == 'osqp':
            self._solve = _Osqp(hessian, limit)
        else:
            self._solve = _ActiveSet(np.ascontiguousarray(inverse_factor), compiled, limit)

    def solve(self, gradient: ArrayLike, rows: ArrayLike, bounds: ArrayLike, equalities: int = 0,
              guess: ArrayLike = ()) -> QPResult:
        """Return the optimum; bad data are answered by the status, never by an exception.

        Parameters
        ----------
        gradient : (n,) array_like
            ``q``.
        rows, bounds : (m, n) and (m,) array_like
            ``rows[i] @ x == bounds[i]`` for the first ``equalities`` rows, ``rows[i] @ x >= bounds[i]`` for the others,
            of which a bound of -inf lifts one. Rows may depend on each other.
        equalities : int
        guess : (k,) array_like of int
            Inequalities thought to be active, right or wrong: a right guess saves time.
        """
        try:
            gradient, rows, bounds = (np.ascontiguousarray(data, dtype=float) for data in (gradient, rows, bounds))
            guess = np.ascontiguousarray(guess, dtype=np.int64)
        except (TypeError, ValueError, OverflowError):
            return QPResult(None, 'bad_input')
        fits = (gradient.shape == (self.size,) and bounds.ndim == 1 and rows.shape == (len(bounds), self.size)
                and guess.ndim == 1 and 0 <= equalities <= len(bounds))
        return self._solve(gradient, rows, bounds, equalities, guess) if fits else QPResult(None, 'bad_input')


class _ActiveSet:
    """The dual active set method, compiled or in numpy."""

    def __init__(self, inverse_factor, compiled, limit):
        self._inverse_factor = inverse_factor
        self._limit = limit
        self._method = _compiled_solve() if compiled else active_set.solve

    def __call__(self, gradient, rows, bounds, equalities, guess):
        x, status, steps, active = self._method(self._inverse_factor, gradient, rows, bounds, equalities, guess,
                                                self._limit)
        known = status in (active_set.SOLVED, active_set.LIMIT)
        return QPResult(x if known else None, _STATUS[status], steps, active)


def _compiled_solve():
    """Return the compiled method, or that in numpy where numba is not installed."""
    try:
        from mobile_planning.fleet import qp_kernels
    except ImportError:
        return active_set.solve
    return qp_kernels.solve


class _Osqp:
    """OSQP, set up anew for each problem: the rows that count, and their entries that are not 0, are never the same."""

    def __init__(self, hessian, limit):
        from scipy import sparse

        self._hessian = sparse.triu(hessian, format='csc')
        self._limit = limit
        self._last, self._rho = None, _RHO

    def __call__(self, gradient, rows, bounds, equalities, guess):
        import osqp
        from scipy import sparse

        wanted = bounds != -np.inf
        wanted[:equalities] = True
        chosen = np.flatnonzero(wanted)
        rows, low = rows[chosen], bounds[chosen]
        if not (np.isfinite(gradient).all() and np.isfinite(rows).all() and np.isfinite(low).all()):
            return QPResult(None, 'bad_input')
        high = np.full(len(chosen), np.inf)
        high[:equalities] = low[:equalities]
        solver = osqp.OSQP()
        try:
            solver.setup(P=self._hessian, q=gradient, A=sparse.csc_matrix(rows), l=low, u=high, verbose=False,
                         max_iter=self._limit, eps_abs=1e-6, eps_rel=1e-6, polishing=True, rho=self._rho)
        except osqp.OSQPException:
            return QPResult(None, 'bad_input')
        if self._last is not None:
            x, y = self._last
            solver.warm_start(x=x, y=y[chosen] if len(y) == len(bounds) else None)
        result = solver.solve(raise_error=False)
        status = {'solved': 'solved', 'solved inaccurate': 'limit', 'maximum iterations reached': 'limit',
                  'primal infeasible': 'infeasible', 'primal infeasible inaccurate': 'infeasible'
                  }.get(result.info.status, 'bad_input')
        if status in ('solved', 'limit') and not np.isfinite(result.x).all():
            status = 'bad_input'
        if status not in ('solved', 'limit'):
            self._last, self._rho = None, _RHO  # where it stopped is no place to start from
            return QPResult(None, status, result.info.iter)
        x, y = np.array(result.x), np.zeros(len(bounds))
        y[chosen] = result.y
        self._last, self._rho = (x, y), result.info.rho_estimate
        pulling = np.flatnonzero(y < -1e-6)
        return QPResult(x.copy(), status, result.info.iter, pulling[pulling >= equalities])
