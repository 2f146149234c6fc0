"""Sections of the receding horizon: shapes, blocks and solvers against independent arithmetic."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from mobile_planning import Boundary, InvalidInput, PolygonObstacle, RoundObstacle, UnicycleKineModel
from mobile_planning.fleet import clamped_spline, nonlinear
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.horizon_blocks import (
    Acceleration, Collision, Communication, Obstacles, Speed, TurnRate)
from mobile_planning.fleet.horizon_options import HorizonOptions
from mobile_planning.fleet.horizon_section import Kind, Start
from mobile_planning.fleet.receding_horizon import SectionPlanner, goal_point
from mobile_planning.fleet.section import Limits
from mobile_planning.fleet.section_shape import SectionShape
from mobile_planning.world.convex_pieces import ConvexPieces
from mobile_planning.world.environment import Environment

SEEDS = st.integers(0, 2**32 - 1)
WORLD = Environment(Boundary((-4, 4), (-3, 3)),
                    [RoundObstacle((1.5, 0.2), 0.3), PolygonObstacle([(0, 1), (1, 1), (1, 2)])])
PIECES = ConvexPieces(WORLD)
LIMITS = Limits(1.0, 2.0, 5.0, 0.205)


def drawn_shape(rng, is_free, has_goal, departs):
    """Return a shape of random knots and motion, and random variables of it."""
    breaks = np.cumsum(np.append(0.0, rng.uniform(0.5, 1.5, rng.integers(4, 8))))
    motion = rng.normal(size=(3, 2)) * ([[1.0], [0.0], [0.0]] if departs else 1.0)
    angle = rng.uniform(-np.pi, np.pi)
    shape = SectionShape(
        breaks / breaks[-1], motion, None if is_free else rng.uniform(0.5, 4.0), samples=7,
        goal=rng.normal(size=2) if has_goal else None,
        direction=np.array([np.cos(angle), np.sin(angle)]) if departs else None)
    x = rng.normal(size=shape.size)
    if is_free:
        x[-1] = rng.uniform(0.5, 4.0)
    return shape, x


def moving(times):
    """Return where another robot is, on a loop, and its velocity."""
    return (np.column_stack([np.cos(times), np.sin(2 * times)]),
            np.column_stack([-np.sin(times), 2 * np.cos(2 * times)]))


BLOCKS = {
    'speed': Speed(1.3), 'acceleration': Acceleration(2.0), 'turn rate': TurnRate(3.0),
    'obstacles': Obstacles(PIECES, np.arange(len(PIECES)), np.arange(len(PIECES.wall_offsets)),
                           np.full(len(PIECES) + len(PIECES.wall_offsets), 0.2)),
    'collision': Collision(moving, 0.4), 'communication': Communication(moving, 2.0)}


@pytest.mark.parametrize('name', BLOCKS)
@settings(max_examples=25)
@given(SEEDS, st.booleans(), st.booleans(), st.booleans())
def test_the_slopes_of_every_block_are_those_of_finite_differences(name, seed, is_free, has_goal, departs):
    shape, x = drawn_shape(np.random.default_rng(seed), is_free, has_goal, departs)
    block, h = BLOCKS[name], 1e-6
    _, slopes = block(shape.samples(x))
    differences = np.column_stack([(block(shape.samples(x + h * axis))[0] - block(shape.samples(x - h * axis))[0])
                                   / (2 * h) for axis in np.eye(shape.size)])
    # Where another edge or corner of an obstacle comes nearest, a distance has no slope: there the two differ.
    ahead, behind = ((block(shape.samples(x + side * h * np.ones(shape.size)))[1]) for side in (1, -1))
    smooth = np.abs(ahead - behind).max(axis=1) <= 1e-2 * (1 + np.abs(slopes).max(axis=1))
    assert slopes[smooth] == pytest.approx(differences[smooth], rel=1e-4, abs=1e-4 * (1 + np.abs(slopes).max()))
    assert smooth.mean() > 0.5


@given(SEEDS, st.booleans(), st.booleans(), st.booleans())
def test_a_section_goes_on_from_its_start_and_ends_at_rest(seed, is_free, has_goal, departs):
    rng = np.random.default_rng(seed)
    shape, x = drawn_shape(rng, is_free, has_goal, departs)
    points, duration, motion = shape.points(x), shape.duration(x), shape._motion
    curve = BSpline(clamped_spline.gen_knots(np.concatenate([[0.0, *shape._first], np.linspace(
        shape._first[1], 1.0, len(points) - 4)[1:]])), points, 3)
    for order in range(3):
        assert curve.derivative(order)(0.0) / duration**order == pytest.approx(motion[order], abs=1e-6)
    at = shape.samples(x)
    assert at.z[-1] == pytest.approx(points[-1]) and (points[-3:] == points[-1]).all()
    assert np.abs(at.v[-1]).max() < 1e-9 and np.abs(at.a[-1]).max() < 1e-9
    if has_goal:
        assert (points[-1] == shape._goal).all()


@given(SEEDS, st.integers(4, 9), st.integers(0, 20))
def test_on_the_grid_a_clamped_spline_is_a_uniform_one(seed, intervals, more):
    spans = intervals + more
    breaks, points = clamped_spline.even_breaks(spans, intervals), np.random.default_rng(seed).normal(
        size=(intervals + 3, 2))
    points[-3:] = points[-1]
    uniform = clamped_spline.to_uniform(breaks) @ points
    assert uniform[-3:] == pytest.approx(points[-3:])
    uniform[-3:] = points[-1]
    times = np.linspace(0, spans, 50)
    curve = clamped_spline.comb_bsp(clamped_spline.gen_knots(breaks), points, times)
    assert Plan(0, 1.0, uniform).states(times)[:, :2] == pytest.approx(curve, abs=1e-9)


@given(SEEDS)
def test_inputs_and_their_derivatives_are_those_of_a_random_spline(seed):
    rng = np.random.default_rng(seed)
    # Never at rest: it goes on to the right.
    points = np.column_stack([np.arange(9) + rng.uniform(-0.2, 0.2, 9), rng.normal(size=9)])
    curve = BSpline(np.arange(-3.0, 10.0), points, 3)
    model, t, h = UnicycleKineModel((0, 0, 0), (1, 1, 0)), rng.uniform(0.1, 5.9), 1e-5
    t += 2 * h * (abs(t - round(t)) < 2 * h)                        # the third derivative jumps at knots

    def zl(time):
        return np.column_stack([curve.derivative(order)(time) for order in range(4)])

    def slope(function):
        return (function(t + h) - function(t - h)) / (2 * h)
    theta_slope = np.angle(np.exp(1j * (model.phi_1(zl(t + h))[2] - model.phi_1(zl(t - h))[2]))) / (2 * h)
    assert model.phi_2(zl(t)) == pytest.approx([np.linalg.norm(slope(curve)), theta_slope], rel=1e-4, abs=1e-4)
    assert model.phi_3(zl(t)) == pytest.approx(slope(lambda time: model.phi_2(zl(time))), rel=1e-3, abs=1e-3)


# Solvers


@given(SEEDS)
@settings(max_examples=20)
def test_all_solvers_find_the_same_nearest_point_outside_a_circle(seed):
    rng = np.random.default_rng(seed)
    centre, wanted = rng.normal(size=2), rng.normal(size=2)
    wanted = wanted if np.linalg.norm(wanted - centre) > 0.3 else centre + (0.3, 0.4)
    way = wanted - centre
    nearest = centre + way / np.linalg.norm(way) * max(1.0, np.linalg.norm(way))

    def outside(x):
        return np.array([(x - centre) @ (x - centre) - 1.0]), 2 * (x - centre)[None]
    program = nonlinear.Program(np.eye(2), -wanted, outside, np.full(2, -9.0), np.full(2, 9.0))
    for solver in nonlinear.SOLVERS:
        answer = nonlinear.solve(program, centre + 2 * way / np.linalg.norm(way), solver, 1e-8, 60)
        assert answer.x == pytest.approx(nearest, abs=1e-3) and answer.violation < 1e-5


def test_an_unknown_solver_is_refused():
    with pytest.raises(InvalidInput, match='newton'):
        nonlinear.solve(None, np.zeros(2), 'newton')


# Sections


def planned(kind, place, heading, goal, solver='slsqp', **options):
    """Return planner, start and what was found, alone, from rest."""
    options = HorizonOptions(solver=solver, **options)
    planner, start = SectionPlanner(options, LIMITS, np.array(goal)), Start(np.tile(place, (3, 1)), heading, 0.0)
    found = planner.plan(kind, start, PIECES, [], duration=options.Tp, prove=lambda points: True)
    return options, Plan(0, options.step, found.points, heading), found


@pytest.mark.parametrize('solver', nonlinear.SOLVERS)
def test_a_first_section_keeps_to_the_limits_and_off_the_obstacle_in_its_way(solver):
    options, plan, found = planned(Kind.FIRST, (-0.5, 0.2), 0.0, (3.5, 0.2), solver)
    states = plan.states(np.linspace(0, plan.end_knot * plan.step, 2000))
    assert found.solves <= 5 and plan.end[0] > 0.5
    assert states[:, 3].max() <= 1.0 and WORLD.clearance(states[:, :2]).min() >= 0.2


@pytest.mark.parametrize('solver', nonlinear.SOLVERS)
def test_a_last_section_ends_at_the_goal_soon(solver):
    options, plan, _ = planned(Kind.LAST, (-3.0, -2.0), 0.0, (-1.8, -2.0), solver)
    assert (plan.end == (-1.8, -2.0)).all()
    # 1.2 m at 1 m/s, and half a second to speed up and to brake each.
    assert 1.7 <= plan.end_knot * plan.step <= 2.3


@given(st.floats(-9, 9), st.floats(-9, 9), st.floats(0.1, 5.0), st.floats(0.1, 20.0))
def test_the_goal_point_is_ahead_and_never_beyond_the_goal(x, y, horizon, farthest):
    goal = np.array([x, y])
    point = goal_point(np.zeros(2), goal, horizon, farthest)
    assert np.linalg.norm(point) == pytest.approx(min(np.linalg.norm(goal), 1.5 * horizon, farthest))
    assert point @ goal == pytest.approx(np.linalg.norm(point) * np.linalg.norm(goal), abs=1e-9)


@pytest.mark.parametrize('changed, name', [
    ({'N_s': 3}, 'N_s'), ({'N_s': 20.0}, 'N_s'), ({'n_knots': 2}, 'n_knots'), ({'Tc': 0.0}, 'Tc'),
    ({'Tp': np.nan}, 'Tp'),
    ({'Tc': 3.0}, 'Tc'), ({'Td': 4.0}, 'Td'), ({'t_sup': -1.0}, 't_sup'), ({'t_sup': 'never'}, 't_sup'),
    ({'detec_rho': -1.0}, 'detec_rho'),
    ({'com_range': np.inf}, 'com_range'), ({'def_epsilon': 0.0}, 'def_epsilon'),
    ({'safe_epsilon': -0.1}, 'safe_epsilon'),
    ({'ls_time_opt_scale': 0.0}, 'ls_time'), ({'dist_opt_offset': 1e4}, 'dist_opt'), ({'ls_min_dist': -1.0}, 'ls_min'),
    ({'solver': 'newton'}, 'newton'), ({'acc': 0.0}, 'acc'), ({'maxit': 0}, 'maxit'), ({'Tc': True}, 'Tc'),
    ({'n_knots': 40}, 'n_knots')])
def test_an_option_out_of_its_range_is_refused_by_name(changed, name):
    with pytest.raises(InvalidInput, match=name):
        HorizonOptions(**changed)


def test_numbers_of_numpy_are_numbers():
    said = HorizonOptions(N_s=np.int64(14), n_knots=np.int32(5), Tc=np.float32(0.5), t_sup=np.inf)
    assert said == HorizonOptions(N_s=14, n_knots=5, Tc=0.5, t_sup=np.inf)


def test_an_unknown_option_is_refused():
    with pytest.raises(TypeError):
        HorizonOptions(n_knot=6)
    with pytest.raises(InvalidInput, match='accuracy'):
        HorizonOptions().with_option('accuracy', 1e-3)
    assert HorizonOptions().with_option('acc', 1e-2).with_option('acc', None) == HorizonOptions()
