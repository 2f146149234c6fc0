"""The quadratic programs against the conditions of an optimum, and against two other solvers."""
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning import InvalidInput
from mobile_planning.fleet import active_set, qp_kernels
from mobile_planning.fleet.qp import QuadraticProgram

POINTS = 10
SIZE = 2 * POINTS
SEEDS = st.integers(0, 2**32 - 1)


def smoothing_hessian():
    """Return the Hessian of a section: control points near a reference, with little speed and acceleration."""
    first, second = np.diff(np.eye(POINTS), axis=0), np.diff(np.eye(POINTS), n=2, axis=0)
    return np.kron(0.3 * np.eye(POINTS) + first.T @ first + 10 * second.T @ second, np.eye(2))


HESSIAN = smoothing_hessian()
COMPILED, PLAIN = QuadraticProgram(HESSIAN), QuadraticProgram(HESSIAN, compiled=False)
BOTH = pytest.mark.parametrize('program', [COMPILED, PLAIN], ids=['compiled', 'numpy'])


def section(seed, count=900, slack=1.0):
    """Return gradient, rows and bounds like those of a section: lines that a feasible curve keeps to."""
    rng = np.random.default_rng(seed)
    reference = np.cumsum(rng.normal(0, 0.6, (POINTS, 2)) + rng.normal(0, 0.3, 2), axis=0).ravel()
    feasible = np.cumsum(rng.normal(0, 0.1, (POINTS, 2)), axis=0).ravel()
    rows = np.zeros((count, POINTS, 2))
    first, angle = rng.integers(0, POINTS - 3, count), rng.uniform(0, 2 * np.pi, count)
    normals = np.column_stack([np.cos(angle), np.sin(angle)])
    weights = rng.dirichlet(np.ones(4), count)
    rows[np.arange(count)[:, None], first[:, None] + np.arange(4)] = weights[..., None] * normals[:, None]
    rows = rows.reshape(count, SIZE)
    return -HESSIAN @ reference, rows, rows @ feasible - rng.uniform(0, slack, count)


def with_equations(seed, count):
    """Return a section whose first ``count`` rows are equations that can be met."""
    gradient, rows, bounds = section(seed, 200)
    rng = np.random.default_rng(seed)
    place = rng.normal(0, 0.2, SIZE)
    rows[:count] = rng.normal(size=(count, SIZE))
    bounds = rows @ place - rng.uniform(0, 1, len(rows))
    bounds[:count] = rows[:count] @ place
    return gradient, rows, bounds


def cost(x, gradient, hessian=HESSIAN):
    return 0.5 * x @ hessian @ x + gradient @ x


def is_optimal(result, gradient, rows, bounds, equalities=0, hessian=HESSIAN):
    """Return whether the conditions of Karush, Kuhn and Tucker hold: within all rows, held by pushing ones."""
    if result.status != 'solved':
        return False
    length = np.linalg.norm(rows, axis=1)
    slack = (rows @ result.x - bounds) / np.where(length > 0, length, 1)
    held = np.concatenate([np.arange(equalities), result.active]).astype(int)
    slope = hessian @ result.x + gradient
    push = np.linalg.lstsq(rows[held].T, slope, rcond=None)[0] if len(held) else np.zeros(0)
    scale = 1 + np.abs(gradient).max()
    return (slack.min(initial=0) > -2e-9 and np.abs(slack[held]).max(initial=0) < 1e-8
            and np.abs(rows[held].T @ push - slope).max() < 1e-7 * scale and push[equalities:].min(initial=0) > -1e-7)


# The active set method


@BOTH
@settings(max_examples=60)
@given(seed=SEEDS, count=st.integers(1, 900))
def test_the_answer_is_the_optimum(program, seed, count):
    problem = section(seed, count)
    assert is_optimal(program.solve(*problem), *problem)


@pytest.mark.parametrize('program', [COMPILED, PLAIN, QuadraticProgram(HESSIAN, 'osqp')],
                         ids=['compiled', 'numpy', 'osqp'])
def test_without_rows_the_answer_is_the_free_optimum(program):
    result = program.solve(-HESSIAN @ np.arange(SIZE), np.zeros((0, SIZE)), [])
    assert result.x == pytest.approx(np.arange(SIZE), abs=1e-6)
    assert result.status == 'solved' and len(result.active) == 0


@settings(max_examples=60)
@given(SEEDS)
def test_compiled_and_numpy_take_the_same_steps(seed):
    one, other = COMPILED.solve(*section(seed)), PLAIN.solve(*section(seed))
    assert one.x == pytest.approx(other.x, abs=1e-9)
    assert (one.iterations, sorted(one.active)) == (other.iterations, sorted(other.active))


@BOTH
@settings(max_examples=60)
@given(seed=SEEDS, guess=st.lists(st.integers(-10, 310), max_size=40))
def test_a_guess_never_changes_the_optimum(program, seed, guess):
    problem = section(seed, 300)
    result = program.solve(*problem, guess=guess)
    assert is_optimal(result, *problem)
    assert result.x == pytest.approx(program.solve(*problem).x, abs=1e-8)


@BOTH
@pytest.mark.parametrize('seed', range(10))
def test_a_right_guess_leaves_nothing_to_do(program, seed):
    problem = section(seed)
    assert program.solve(*problem, guess=program.solve(*problem).active).iterations == 0


@BOTH
@settings(max_examples=40)
@given(seed=SEEDS, count=st.integers(1, 15))
def test_equations_hold_exactly(program, seed, count):
    gradient, rows, bounds = with_equations(seed, count)
    result = program.solve(gradient, rows, bounds, count)
    assert is_optimal(result, gradient, rows, bounds, count)
    assert result.active.min(initial=count) >= count


@BOTH
@settings(max_examples=40)
@given(seed=SEEDS, count=st.integers(1, 12))
def test_equations_may_repeat_each_other(program, seed, count):
    gradient, rows, bounds = with_equations(seed, count)
    mixed = np.random.default_rng(seed).normal(size=(count, count))
    both = np.vstack([rows[:count], mixed @ rows[:count], rows[count:]])
    limits = np.concatenate([bounds[:count], mixed @ bounds[:count], bounds[count:]])
    assert cost(program.solve(gradient, both, limits, 2 * count).x, gradient) == pytest.approx(
        cost(program.solve(gradient, rows, bounds, count).x, gradient), rel=1e-7)


@BOTH
def test_equations_may_fix_everything(program):
    place = np.arange(SIZE, dtype=float)
    result = program.solve(np.ones(SIZE), np.vstack([np.eye(SIZE), np.ones(SIZE)]), [*place, place.sum() - 1], SIZE)
    assert result.x == pytest.approx(place)
    assert program.solve(np.ones(SIZE), np.vstack([np.eye(SIZE)] * 2), [*place, *place + 1], SIZE).x is None


@BOTH
@settings(max_examples=40)
@given(seed=SEEDS, kind=st.sampled_from(['repeated', 'scaled', 'nearly the same', 'through one vertex']))
def test_rows_may_depend_on_each_other(program, seed, kind):
    rng = np.random.default_rng(seed)
    gradient, rows, bounds = section(seed, 250)
    if kind == 'through one vertex':
        bounds = rows @ rng.normal(0, 0.3, SIZE)
    else:
        factors = np.ones(750) if kind == 'repeated' else 10 ** rng.uniform(-3, 3, 750)
        rows, bounds = np.tile(rows, (3, 1)) * factors[:, None], np.tile(bounds, 3) * factors
    if kind == 'nearly the same':
        rows = rows + 10.0 ** rng.integers(-13, -3) * factors[:, None] * rng.normal(size=rows.shape)
    result = program.solve(gradient, rows, bounds)
    assert result.status == 'solved'
    assert ((rows @ result.x - bounds) / np.linalg.norm(rows, axis=1)).min() > -2e-9
    reference = pytest.importorskip('daqp', reason='the solver to compare with is not installed')
    _, best, flag, _ = reference.solve(HESSIAN, gradient, rows / np.linalg.norm(rows, axis=1)[:, None],
                                       np.full(len(rows), 1e30), bounds / np.linalg.norm(rows, axis=1))
    # The other solver may violate rows by 1e-6, which lets it be cheaper.
    assert flag == 1 and cost(result.x, gradient) <= best + 1e-4 * (1 + abs(best))


@BOTH
@settings(max_examples=40)
@given(seed=SEEDS)
def test_badly_scaled_variables_are_solved_as_well(program, seed):
    scale = 10 ** np.random.default_rng(seed).uniform(-3, 3, SIZE)
    gradient, rows, bounds = section(seed, 300)
    hessian = HESSIAN * scale * scale[:, None]
    scaled = QuadraticProgram((hessian + hessian.T) / 2, compiled=program is COMPILED)
    result = scaled.solve(gradient * scale, rows * scale, bounds)
    assert result.x * scale == pytest.approx(program.solve(gradient, rows, bounds).x, abs=1e-6)


@BOTH
@settings(max_examples=20)
@given(seed=SEEDS, far=st.sampled_from([1e2, 1e4, 1e6]))
def test_far_from_the_origin_the_answer_is_the_same(program, seed, far):
    gradient, rows, bounds = section(seed, 300)
    shift = np.tile([far, -far], POINTS)
    result = program.solve(gradient - HESSIAN @ shift, rows, bounds + rows @ shift)
    assert result.x - shift == pytest.approx(program.solve(gradient, rows, bounds).x, abs=1e-9 * far)


@BOTH
@settings(max_examples=60)
@given(seed=SEEDS, gap=st.floats(-6, 2), guess=st.lists(st.integers(0, 300), max_size=20))
def test_rows_that_contradict_each_other_are_infeasible(program, seed, gap, guess):
    gradient, rows, bounds = section(seed, 300)
    rows, bounds = np.vstack([rows, -rows[0]]), np.append(bounds, 10**gap * np.linalg.norm(rows[0]) - bounds[0])
    result = program.solve(gradient, rows, bounds, guess=guess)
    assert (result.status, result.x) == ('infeasible', None)


# All solvers


@pytest.mark.parametrize('seed', range(20))
def test_the_optimum_is_that_of_daqp(seed):
    daqp = pytest.importorskip('daqp', reason='the solver to compare with is not installed')
    gradient, rows, bounds = section(seed)
    x, _, flag, _ = daqp.solve(HESSIAN, gradient, rows, np.full(len(rows), 1e30), bounds)
    assert flag == 1 and COMPILED.solve(gradient, rows, bounds).x == pytest.approx(x, abs=1e-5)


@pytest.mark.parametrize('seed', range(20))
def test_the_optimum_with_equations_is_that_of_daqp(seed):
    daqp = pytest.importorskip('daqp', reason='the solver to compare with is not installed')
    gradient, rows, bounds = with_equations(seed, 6)
    upper, sense = np.full(len(rows), 1e30), np.zeros(len(rows), np.int32)
    upper[:6], sense[:6] = bounds[:6], 5
    x, _, flag, _ = daqp.solve(HESSIAN, gradient, rows, upper, bounds, sense)
    assert flag == 1 and COMPILED.solve(gradient, rows, bounds, 6).x == pytest.approx(x, abs=1e-5)


def test_osqp_comes_to_the_same_optimum_whatever_the_number_of_rows():
    osqp = QuadraticProgram(HESSIAN, 'osqp', limit=50_000)
    for seed, count in enumerate([5, 900, 40, 901, 0, 300]):
        problem = section(seed, count)
        found, best = osqp.solve(*problem), COMPILED.solve(*problem)
        assert found.status == 'solved' and found.x == pytest.approx(best.x, abs=1e-4)
        problem = with_equations(seed, 6)
        assert osqp.solve(*problem, 6).x == pytest.approx(COMPILED.solve(*problem, 6).x, abs=1e-4)


def test_osqp_recovers_from_a_problem_without_an_answer():
    osqp, (gradient, rows, bounds) = QuadraticProgram(HESSIAN, 'osqp', limit=50_000), section(3, 50)
    assert osqp.solve(gradient, [*rows, -rows[0]], [*bounds, 1 - bounds[0]]).status == 'infeasible'
    assert osqp.solve(gradient, rows, bounds).x == pytest.approx(COMPILED.solve(gradient, rows, bounds).x, abs=1e-4)


def test_osqp_names_the_active_rows():
    problem = section(4, 100)
    found = QuadraticProgram(HESSIAN, 'osqp', limit=50_000).solve(*problem)
    assert sorted(found.active) == sorted(COMPILED.solve(*problem).active)


ALL = pytest.mark.parametrize('program', [COMPILED, PLAIN, QuadraticProgram(HESSIAN, 'osqp', limit=20_000)],
                              ids=['compiled', 'numpy', 'osqp'])


@ALL
def test_a_bound_of_minus_infinity_lifts_its_row(program):
    gradient, rows, bounds = section(7, 100)
    lifted = np.vstack([rows, -rows, np.full((1, SIZE), np.nan)])
    result = program.solve(gradient, lifted, [*bounds, *np.full(101, -np.inf)], guess=[100, 199])
    assert result.x == pytest.approx(COMPILED.solve(gradient, rows, bounds).x, abs=1e-4)


@ALL
def test_a_row_of_zeros_is_met_or_not(program):
    gradient, rows, bounds = section(8, 30)
    rows = np.vstack([np.zeros(SIZE), rows])
    for equalities, bound, status in ((0, -1, 'solved'), (0, 0, 'solved'), (0, 1, 'infeasible'),
                                      (1, 0, 'solved'), (1, 1, 'infeasible'), (1, -1, 'infeasible')):
        assert program.solve(gradient, rows, [bound, *bounds], equalities).status == status


@ALL
@pytest.mark.parametrize('bad', [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize('place', ['gradient', 'rows', 'bounds', 'equation'])
def test_numbers_that_are_not_finite_are_bad_input(program, bad, place):
    gradient, rows, bounds = section(9, 30)
    if place == 'bounds' and bad == -np.inf:
        return
    data = {'gradient': gradient, 'rows': rows, 'bounds': bounds[5:], 'equation': bounds}[place]
    data.flat[0] = bad
    result = program.solve(gradient, rows, bounds, 3)
    assert (result.status, result.x) == ('bad_input', None)


@ALL
@pytest.mark.parametrize('change', [
    dict(gradient=np.ones(3)), dict(rows=np.ones((30, 3))), dict(bounds=np.ones(29)), dict(bounds=np.ones((30, 1))),
    dict(equalities=31), dict(equalities=-1), dict(rows=[[1], [1, 2]]), dict(gradient='curve'), dict(bounds=None),
    dict(guess=[[1]]), dict(guess=['x'])])
def test_data_that_do_not_fit_are_bad_input(program, change):
    gradient, rows, bounds = section(9, 30)
    assert program.solve(**{**dict(gradient=gradient, rows=rows, bounds=bounds), **change}).status == 'bad_input'


@ALL
@pytest.mark.parametrize('huge', [1e20, 1e31, 1e150, 1e200, 1e300])
def test_numbers_too_large_to_work_with_never_pass_as_solved(program, huge):
    gradient, rows, bounds = section(9, 30)
    for problem in ((gradient * huge, rows, bounds), (gradient, rows * huge, bounds), (gradient, rows, bounds * huge)):
        result = program.solve(*problem)
        assert result.status != 'solved' or np.isfinite(result.x).all()


@ALL
def test_read_only_data_and_views_are_welcome_and_stay_as_they_are(program):
    gradient, rows, bounds = section(10, 60)
    before = rows.copy()
    for data in (gradient, rows, bounds):
        data.flags.writeable = False
    result = program.solve(gradient, rows[::2], bounds[::2])
    assert result.x == pytest.approx(COMPILED.solve(gradient, before[::2], bounds[::2]).x, abs=1e-4)
    assert (rows == before).all()


@pytest.mark.parametrize('options', [dict(compiled=True), dict(compiled=False), dict(solver='osqp')], ids=str)
def test_the_limit_ends_the_search_and_leaves_the_last_iterate(options):
    result = QuadraticProgram(HESSIAN, limit=2, **options).solve(*section(11))
    assert result.status == 'limit' and result.iterations == 2 and np.isfinite(result.x).all()


@pytest.mark.parametrize('hessian, solver', [
    (np.ones((2, 3)), 'active_set'), ([[1, 2], [2, 1]], 'active_set'), ([[1, 1], [0, 1]], 'active_set'),
    ([[np.nan]], 'active_set'), ([1, 2], 'osqp'), (np.zeros((1, 1)), 'osqp'), (np.eye(2), 'simplex')])
def test_a_hessian_or_solver_that_is_none_is_refused(hessian, solver):
    with pytest.raises(InvalidInput):
        QuadraticProgram(hessian, solver)


def test_without_numba_the_same_answer_comes_from_numpy():
    code = ('import sys; sys.modules["numba"] = None\n'
            'from mobile_planning.fleet.qp import QuadraticProgram\n'
            'print(QuadraticProgram([[1.0]]).solve([-3.0], [[-1.0]], [-2.0]).x)')
    done = subprocess.run([sys.executable, '-c', code], capture_output=True, text=True)
    assert done.stdout == '[2.]\n', done.stderr


@pytest.mark.parametrize('name', [name for name in vars(active_set) if name.isupper()])
def test_a_number_has_the_same_value_compiled(name):
    assert getattr(qp_kernels, name) == getattr(active_set, name)
