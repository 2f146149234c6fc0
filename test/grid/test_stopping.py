"""A flag set at any moment ends all of D*'s work soon: between two looks at it lies a row of work, not a map."""
import sys

import numpy as np
import pytest

from mobile_planning.errors import Cancelled
from mobile_planning.grid import descent_kernels, dstar_kernels, heap_kernels
from mobile_planning.grid.dstar import DstarPlanner
from mobile_planning.world import cost_to_go_kernels, row_blocks

WIDTH = 6


class Flag:
    """A stop flag that sets itself at one of the looks at it, and counts the lines that run between two looks."""

    def __init__(self, at=None):
        self.looks, self.at, self.lines, self.most_lines = 0, at, 0, 0

    def __getitem__(self, _):
        self.looks += 1
        self.most_lines, self.lines = max(self.most_lines, self.lines), 0
        return self.at is not None and self.looks > self.at

    def count_lines(self, frame, event, arg):
        self.lines += event == 'line' and 'kernels' in frame.f_code.co_filename
        return self.count_lines


@pytest.fixture(autouse=True)
def interpreted(monkeypatch):
    """Let the kernels run as Python, which a flag of ours can watch, with blocks of one row."""
    monkeypatch.setattr(row_blocks, '_CELLS', WIDTH)
    for module in (cost_to_go_kernels, heap_kernels, dstar_kernels, descent_kernels):
        for name, kernel in list(vars(module).items()):
            if hasattr(kernel, 'py_func'):
                monkeypatch.setattr(module, name, kernel.py_func)
    with np.errstate(over='ignore', invalid='ignore'):
        yield


def mapped(kind, height):
    costs = np.ones((height, WIDTH))
    if kind != 'uniform':
        costs[:, ::2] = 3.0
    costs[2:, 2] = np.inf
    return costs.astype(np.float32 if kind == 'single' else float)


def life(flag, costs):
    """Construct, plan, repair and read a planner."""
    planner = DstarPlanner(costs, goal=(0, 0), stop=flag, max_expansions=10 ** 9)
    planner.plan(stop=flag, progress=False)
    planner.query((WIDTH - 1, 0), stop=flag)
    planner.update([(WIDTH - 2, 0, np.inf), (1, 1, 2.0)])
    planner.query((WIDTH - 1, 0), stop=flag)
    planner.cost_to_go(flag)


@pytest.mark.parametrize('kind', ['uniform', 'weighted', 'single'])
def test_a_flag_set_at_any_look_ends_the_work_at_the_next_ones(kind):
    flag = Flag()
    life(flag, mapped(kind, 8))
    for at in range(0, flag.looks, 7):
        stopped = Flag(at)
        with pytest.raises(Cancelled):
            life(stopped, mapped(kind, 8))
        assert stopped.looks <= at + 4


@pytest.mark.parametrize('kind', ['uniform', 'weighted', 'single'])
def test_the_work_between_two_looks_does_not_grow_with_the_map(kind):
    most = []
    for height in (60, 180):
        flag = Flag()
        sys.settrace(flag.count_lines)
        try:
            life(flag, mapped(kind, height))
        finally:
            sys.settrace(None)
        most.append(flag.most_lines)
        assert flag.looks > 6 * height
    assert most[1] < 1.2 * most[0]
