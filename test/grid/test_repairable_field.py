"""The path kept from one query to the next: never another one than the way down the field from scratch."""
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning.errors import Cancelled, LimitExceeded
from mobile_planning.grid import descent_kernels as kernels
from mobile_planning.grid.repairable_field import RepairableField

NEVER = np.zeros(1, np.uint8)


def planned(costs, goal, **options):
    costs = np.asarray(costs, float)
    field = RepairableField(costs, np.isinf(costs), True, **{'max_expansions': 10 ** 9, **options})
    field.plan(field.index(*goal), None)
    return field


def path_from(field, start):
    start = field.index(*start)
    field.settle(start, None)
    return field.path(start, None)


def path_from_scratch(field, start):
    """Return the way down the settled field and its cost, each step looked for."""
    cells, cost = [field.index(*start)], 0.0
    while cells[-1] != field._goal:
        cells.append(field.next_cell(cells[-1]))
    for cell, other in reversed(list(zip(cells, cells[1:]))):
        cost += field.step_cost(cell, other)
    return np.array([field.cell(cell) for cell in cells]), cost


def corridors(side):
    """Return costs with walls that make one long way through the map."""
    costs = np.ones((side, side))
    for i, x in enumerate(range(3, side - 1, 4)):
        costs[:, x] = np.inf
        costs[0 if i % 2 else side - 1, x] = 1.0
    return costs


@given(st.integers(0, 2 ** 30), st.sampled_from(['ones', 'whole', 'fractions', 'corridors']), st.booleans())
def test_a_path_that_reuses_the_last_one_is_bit_for_bit_the_way_down_from_scratch(seed, kind, corner_cutting):
    random = np.random.default_rng(seed)
    side = int(random.integers(4, 24))
    costs = {'ones': np.ones((side, side)), 'whole': random.integers(1, 4, (side, side)).astype(float),
             'fractions': random.random((side, side)) + 1e-3, 'corridors': corridors(side)}[kind]
    new_costs = [np.inf, 1.0, 1.0, 0.4, 2.0]
    field = RepairableField(costs, np.isinf(costs), corner_cutting, 10 ** 9)
    field.plan(field.index(*random.integers(side, size=2).tolist()), None)
    start = tuple(random.integers(side, size=2).tolist())
    for turn in range(12):
        at = random.integers(side, size=2)
        if turn % 3:
            at = np.clip(np.add(start, random.integers(-2, 3, 2)), 0, side - 1)
        cells = np.clip(at + random.integers(-1, 2, (random.integers(4), 2)), 0, side - 1)
        field.set_costs(np.column_stack([cells, random.choice(new_costs, len(cells))]).astype(float))
        index = field.index(*start)
        if field.is_blocked(index) or field.is_blocked(field._goal):
            continue
        field.settle(index, None)
        if not field.is_reached(index):
            start = tuple(random.integers(side, size=2).tolist())
            continue
        path, cost = field.path(index, None)
        expected, expected_cost = path_from_scratch(field, start)
        assert np.array_equal(path, expected) and cost == expected_cost
        start = tuple(path[random.integers(min(4, len(path)))].tolist())


def test_a_change_near_the_robot_leaves_the_rest_of_a_long_path_alone():
    field = planned(corridors(40), (38, 38))
    before, _ = path_from(field, (0, 0))
    with patch.object(kernels, 'descend', wraps=kernels.descend) as descend:
        field.set_costs(np.array([[*before[5], np.inf]], float))
        after, _ = path_from(field, (0, 0))
    old, _, first, changed_from = descend.call_args.args[:4]
    values = [field.values()[y, x] for x, y in old[first:].tolist()]
    assert np.sum(np.array(values) < changed_from) > len(before) - 15
    assert np.array_equal(after[-300:], before[-300:])


def test_a_path_belongs_to_the_caller():
    field = planned(np.ones((9, 9)), (8, 8))
    path, _ = path_from(field, (0, 3))
    path[:] = -1
    assert np.array_equal(path_from(field, (0, 3))[0], path_from_scratch(field, (0, 3))[0])


def test_a_stopped_descent_keeps_what_is_known_of_the_last_path():
    field = planned(corridors(100), (98, 98))
    start = field.index(0, 0)
    with pytest.raises(Cancelled):
        field.path(start, np.ones(1, np.uint8))
    assert np.array_equal(field.path(start, NEVER)[0], path_from_scratch(field, (0, 0))[0])


def test_costs_that_rounding_cannot_tell_apart_are_an_error_and_no_endless_search():
    field = planned([[1, 1e-20, 1e-20, 1]], (0, 0))
    with pytest.raises(LimitExceeded, match='rounding'):
        path_from(field, (3, 0))
