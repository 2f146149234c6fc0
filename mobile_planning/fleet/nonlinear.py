"""Nonlinear programs of a section behind one function: scipy's SLSQP, and sequential quadratic programs on any QP."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.qp import QuadraticProgram

SOLVERS = ('slsqp', 'osqp', 'active_set')
#: Of the sequential programs: first and least reach of a step, the price of one unit of violation beside the objective,
#: what keeps each Hessian positive definite, and the limit on the QP's own iterations.
_REACH, _LEAST_REACH, _PRICE, _DAMPING, _INNER = 0.5, 1e-4, 1e2, 1e-3, 300


@dataclass(frozen=True, eq=False)
class Program:
    """Minimise ``1/2 x'Px + q'x`` where ``constraints(x)`` are not negative and ``low <= x <= high``.

    Attributes
    ----------
    hessian : (n, n) ndarray
    gradient : (n,) ndarray
    constraints : callable
        Returns values (m,) and Jacobian (m, n) at x.
    low, high : (n,) ndarray
    """

    hessian: NDArray[np.float64]
    gradient: NDArray[np.float64]
    constraints: Callable[[NDArray], tuple[NDArray, NDArray]]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def objective(self, x: NDArray) -> tuple[float, NDArray[np.float64]]:
        """Return the cost at ``x`` and its gradient."""
        pulled = self.hessian @ x
        return float(0.5 * x @ pulled + self.gradient @ x), pulled + self.gradient


@dataclass(frozen=True, eq=False)
class Answer:
    """What a solver found.

    Attributes
    ----------
    x : (n,) ndarray
        Its last point, whatever it is worth.
    violation : float
        Greatest, of any constraint; infinite where x is not finite.
    iterations : int
    """

    x: NDArray[np.float64]
    violation: float
    iterations: int


def solve(program: Program, start: NDArray, solver: str = 'slsqp', accuracy: float = 1e-3, limit: int = 30) -> Answer:
    """Return the best point found from ``start`` (n,), in at most ``limit`` iterations.

    Raises
    ------
    InvalidInput
        The solver is unknown.

    Examples
    --------
    The point nearest to (2, 0) outside a circle of radius 1 about (1.5, 0.1):

    >>> def outside(x):
    ...     away = x - (1.5, 0.1)
    ...     return np.array([away @ away - 1.0]), 2 * away[None]
    >>> nearest = Program(np.eye(2), np.array([-2.0, 0.0]), outside, np.full(2, -9.0), np.full(2, 9.0))
    >>> [solve(nearest, np.array([3.0, 0.0]), solver, 1e-6, 50).x.round(3).tolist() for solver in SOLVERS]
    [[2.481, -0.096], [2.481, -0.096], [2.481, -0.096]]
    """
    if solver not in SOLVERS:
        raise InvalidInput(f'solver {solver!r} is not one of {", ".join(SOLVERS)}')
    start = np.clip(start, program.low, program.high)
    if solver == 'slsqp':
        x, iterations = _slsqp(program, start, accuracy, limit)
    else:
        x, iterations = _sequential(program, start, solver, accuracy, limit)
    return Answer(x, violation(program, x), iterations)


def violation(program: Program, x: NDArray) -> float:
    """Return how far ``x`` is from keeping to the constraints and bounds, infinite if it is no number."""
    if not np.isfinite(x).all():
        return np.inf
    outside = np.maximum(program.low - x, x - program.high).max(initial=0.0)
    return float(max(0.0, outside, -program.constraints(x)[0].min(initial=0.0)))


def _slsqp(program, start, accuracy, limit):
    known: list = [None, None]

    def at(x):
        # SLSQP asks for values and slopes in two calls.
        if known[0] is None or not np.array_equal(x, known[0]):
            known[:] = x.copy(), program.constraints(x)
        return known[1]

    result = minimize(program.objective, start, jac=True, method='SLSQP', bounds=list(zip(program.low, program.high)),
                      constraints={'type': 'ineq', 'fun': lambda x: at(x)[0], 'jac': lambda x: at(x)[1]},
                      options={'maxiter': limit, 'ftol': accuracy})
    return result.x, int(result.nit)


def _sequential(program, start, solver, accuracy, limit):
    """Linearise the constraints, allow a step so far, keep it if cost and violation together become less.

    One variable more, the greatest violation, keeps every program solvable.
    """
    size, scale = len(start), max(1.0, np.abs(program.hessian).max())
    hessian = np.zeros((size + 1, size + 1))
    hessian[:size, :size] = program.hessian + _DAMPING * np.eye(size)
    hessian[size, size] = 1.0
    inner, price = QuadraticProgram((hessian + hessian.T) / 2, solver, limit=_INNER), _PRICE * scale
    x, reach = start, _REACH
    cost, slope = program.objective(x)
    values, jacobian = program.constraints(x)
    worst = max(0.0, -values.min(initial=0.0))
    iteration = 0
    for iteration in range(1, limit + 1):
        low, high = np.maximum(program.low - x, -reach), np.minimum(program.high - x, reach)
        near = np.flatnonzero(values < np.abs(jacobian).sum(axis=1) * reach)
        rows = np.zeros((len(near) + 2 * size + 1, size + 1))
        rows[:len(near), :size], rows[:len(near), size] = jacobian[near], 1.0
        rows[len(near):len(near) + size, :size] = np.eye(size)
        rows[len(near) + size:len(near) + 2 * size, :size] = -np.eye(size)
        rows[-1, size] = 1.0
        bounds = np.concatenate([-values[near], low, -high, [0.0]])
        step = inner.solve(np.append(slope, price), rows, bounds).x
        step = None if step is None else np.clip(step[:size], low, high)
        if step is not None:
            cost_new, slope_new = program.objective(x + step)
            values_new, jacobian_new = program.constraints(x + step)
            worst_new = max(0.0, -values_new.min(initial=0.0))
            gain = cost - cost_new + price * (worst - worst_new)
            if gain > 0:
                x, cost, slope, worst = x + step, cost_new, slope_new, worst_new
                values, jacobian, reach = values_new, jacobian_new, min(2 * reach, 4 * _REACH)
                if gain <= accuracy and worst <= accuracy:
                    break
                continue
        reach /= 4
        if reach < _LEAST_REACH:
            break
    return x, iteration
