"""The compiled rows of a section: each says of a plan what numpy says of its derivatives and Bezier points."""
import numpy as np
import pytest
from curves import curve
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.fleet import section_kernels as kernels
from mobile_planning.fleet.bspline import bezier

STEP, POINTS = 0.125, 15
seeds = st.integers(0, 2**32 - 1)


def drawn(seed):
    """Return a generator, and two plans that start alike and end at rest."""
    rng = np.random.default_rng(seed)
    old = np.cumsum(rng.normal(size=(POINTS, 2)) * 0.2, axis=0)
    new = old + rng.normal(size=old.shape) * 0.3
    new[:3], old[-2:], new[-2:] = old[:3], old[-3], new[-3]
    return rng, old, new


def slacks(write, old, new, *arguments):
    """Return what the rows that ``write`` leaves say of ``new``."""
    rows, bounds = np.full((2000, 2 * (POINTS - 5)), np.nan), np.full(2000, np.nan)
    end = write(old, *arguments, rows, bounds, 7)
    assert np.isnan(rows[:7]).all() and np.isnan(rows[end:]).all()
    return rows[7:end] @ new[3:-2].ravel() - bounds[7:end]


def units(rng, count):
    angles = rng.uniform(-np.pi, np.pi, count)
    return np.column_stack([np.cos(angles), np.sin(angles)])


@settings(max_examples=50)
@given(seeds)
def test_a_row_of_a_fence_is_the_room_of_a_bezier_point_beyond_the_margin(seed):
    rng, old, new = drawn(seed)
    spans, normals = rng.integers(0, POINTS - 3, 9), units(rng, 9)
    places, later = (np.einsum('qd,qkd->qk', normals, bezier(points)[spans]) for points in (old, new))
    room = rng.uniform(0, 0.01, places.shape)
    wanted = later - (places - room) - np.minimum(room, 0.004)
    is_given = (spans == 0)[:, None] & (np.arange(4) < 3)
    found = slacks(kernels.write_fences, old, new, spans, normals, places - room, 0.004)
    assert found == pytest.approx(wanted[~is_given], abs=1e-9)


@pytest.mark.parametrize('order, first', [(1, 2), (2, 1)])
@settings(max_examples=30)
@given(seed=seeds)
def test_a_row_of_a_limit_is_what_a_derivative_leaves_of_a_bound_or_of_what_was_before(order, first, seed):
    rng, old, new = drawn(seed)
    stencil = np.array([[-1, 1, 0, 0], [1, -2, 1, 0]][order - 1]) / STEP**order
    normals, most = units(rng, 5), rng.uniform(0, 5)
    before, after = (np.diff(points, n=order, axis=0) / STEP**order @ normals.T for points in (old, new))
    wanted = np.maximum(before, most) - after
    found = slacks(kernels.write_limits, old, new, stencil, first, POINTS - 3, normals, most)
    assert found == pytest.approx(wanted[first:POINTS - 3].ravel(), abs=1e-8)


@settings(max_examples=50)
@given(seeds, st.sampled_from([0.0, 0.5]))
def test_the_rows_of_turns_are_velocity_along_less_acceleration_across_at_the_knots(seed, slow):
    (_, old, new), omega, direction = drawn(seed), 3.0, np.array([0.6, 0.8])
    knots = STEP * np.arange(1, POINTS - 3)
    wanted = []
    for knot, time in enumerate(knots, 1):
        velocity = curve(old, STEP).derivative(1)(time)
        if np.linalg.norm(velocity) > slow:
            direction = velocity / np.linalg.norm(velocity)
        across = np.array([-direction[1], direction[0]])
        along, aside, onward = np.array([
            (omega * curve(points, STEP).derivative(1)(time) @ direction,
             curve(points, STEP).derivative(2)(time) @ across,
             (points[knot + 1] - points[knot]) @ direction / STEP) for points in (new, old)]).T
        for value in (along - aside, along + aside) + ((onward,) if knot >= 2 else ()):
            wanted.append(value[0] - min(value[1], 0.0))
    assert slacks(kernels.write_turns, old, new, old, np.array([0.6, 0.8]), STEP, omega, slow) == pytest.approx(
        wanted, abs=1e-7)


def test_where_the_change_is_nothing_but_the_plan_is_over_its_limit_by_rounding_all_of_it_is_let_through():
    old = np.zeros((6, 2))
    old[3:] = 1.0
    assert kernels.share_in_disc(old, np.zeros((6, 2)), 1, 1.0) == 1.0
