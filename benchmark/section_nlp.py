"""One section as a nonlinear program for SLSQP, with analytic Jacobians, as the first planners of this kind solve it.

Variables and objective are those of our quadratic program. The constraints are the true ones, at evenly spaced samples:
speed, acceleration, turn rate, the distance to each obstacle's centre and to where each peer will be.
"""
import numpy as np
from scipy.optimize import minimize

SAMPLES = 20
#: Turn rates of slower drives [m/s] have no meaning; the product's own bound is rounded off alike.
SLOW = 0.05


class SectionProgram:
    """The program of all sections with the same limits, step and length.

    Parameters
    ----------
    hessian : (2 F, 2 F) ndarray
        Of the objective in the free control points, x and y of the first, then of the next.
    limits : Limits
    step : float [s]
    spans : int
    """

    def __init__(self, hessian, limits, step, spans):
        self._hessian, self._limits, self._step = hessian, limits, step
        free = spans - 2
        # Control points 3 to M are free, the two beyond equal the last: the plan ends at rest.
        self._spread = np.zeros((spans + 3, free))
        self._spread[np.arange(3, spans + 3), np.minimum(np.arange(spans), free - 1)] = 1.0
        self._basis = _basis(np.linspace(0, spans, SAMPLES + 1)[1:], spans, step)

    def solve(self, old, gradient, circles, peers, start):
        """Return scipy's result and the greatest violation at the samples.

        Parameters
        ----------
        old : (M + 3, 2) ndarray [m]
            Control points of the plan in force; the first three stay.
        gradient : (2 F,) ndarray
        circles : (K, 3) ndarray [m]
            Centre and radius of each obstacle.
        peers : (P, M + 3, 2) ndarray [m]
            Control points of the others' plans.
        start : (2 F,) ndarray
            First guess.
        """
        fixed = np.zeros_like(old)
        fixed[:3] = old[:3]
        centres = np.concatenate([np.repeat(circles[:, None, :2], SAMPLES, axis=1), self._basis[0] @ peers])
        radius = self._limits.radius
        need = np.concatenate([circles[:, 2] + radius, np.full(len(peers), 2 * radius)])

        def objective(x):
            pulled = self._hessian @ x
            return 0.5 * x @ pulled + gradient @ x, pulled + gradient

        def constraints(x):
            return self._constraints(fixed + self._spread @ x.reshape(-1, 2), centres, need)[0]

        def jacobian(x):
            return self._constraints(fixed + self._spread @ x.reshape(-1, 2), centres, need)[1]

        result = minimize(objective, start, jac=True, method='SLSQP', options={'maxiter': 100, 'ftol': 1e-6},
                          constraints={'type': 'ineq', 'fun': constraints, 'jac': jacobian})
        return result, max(0.0, -float(constraints(result.x).min()))

    def _constraints(self, points, centres, need):
        """Return the values (m,), not negative where kept, and the Jacobian (m, 2 F)."""
        limits = self._limits
        (place, velocity, acceleration), rows = self._basis @ points, self._basis @ self._spread
        values = [limits.v_max**2 - (velocity**2).sum(axis=1), limits.a_max**2 - (acceleration**2).sum(axis=1)]
        slopes = [_along(-2 * velocity, rows[1]), _along(-2 * acceleration, rows[2])]
        cross = velocity[:, 0] * acceleration[:, 1] - velocity[:, 1] * acceleration[:, 0]
        turned = np.column_stack([acceleration[:, 1], -acceleration[:, 0]])
        cross_slope = _along(turned, rows[1]) + _along(np.column_stack([-velocity[:, 1], velocity[:, 0]]), rows[2])
        for side in (1.0, -1.0):
            values.append(limits.omega_max * ((velocity**2).sum(axis=1) + SLOW**2) - side * cross)
            slopes.append(_along(2 * limits.omega_max * velocity, rows[1]) - side * cross_slope)
        away = place - centres
        distance = np.linalg.norm(away, axis=-1)
        values.append((distance - need[:, None]).ravel())
        slopes += [_along(unit, rows[0]) for unit in away / np.maximum(distance, 1e-9)[..., None]]
        return np.concatenate(values), np.concatenate(slopes)


def _along(directions, rows):
    """Return the slopes (S, 2 F) of what changes by ``directions`` (S, 2) per unit of a point with the rows (S, F)."""
    return (rows[:, :, None] * directions[:, None]).reshape(len(rows), -1)


def _basis(times, spans, step):
    """Return matrices (3, S, M + 3) from control points to place, velocity and acceleration at ``times`` in steps."""
    basis = np.zeros((3, len(times), spans + 3))
    for row, time in enumerate(times):
        span = min(int(time), spans - 1)
        u = time - span
        basis[:, row, span:span + 4] = (
            [(1 - u)**3 / 6, (3 * u**3 - 6 * u**2 + 4) / 6, (-3 * u**3 + 3 * u**2 + 3 * u + 1) / 6, u**3 / 6],
            np.array([-(1 - u)**2, 3 * u**2 - 4 * u, -3 * u**2 + 2 * u + 1, u**2]) / (2 * step),
            np.array([1 - u, 3 * u - 2, 1 - 3 * u, u]) / step**2)
    return basis
