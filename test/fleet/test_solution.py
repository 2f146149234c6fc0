"""Solutions: what a robot has driven, sampled from the start of the mission."""
import numpy as np
import pytest

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution

STEP = 0.25
#: 3 m along x in steps of 0.25 m, from knot 8, 2 s, on.
POINTS = np.column_stack([np.cumsum([0, 0, 0, *[0.25] * 12, 0, 0]), np.zeros(17)])


@pytest.mark.parametrize('start_time, rest', [(None, 0.0), (2.0, 0.0), (0.5, 1.5), (1.8e9, 0.0)])
def test_the_time_counts_from_the_start_of_the_mission(start_time, rest):
    knot = 8 if start_time != 1.8e9 else int(1.8e9 / STEP)
    solution = Solution(1, (Plan(knot, STEP, POINTS),), start_time=start_time)
    assert solution.t[0] == 0 and solution.t[-1] == pytest.approx(rest + 14 * STEP)
    assert np.diff(solution.t).max() <= 0.01 + 1e-9
    # Switched on after the start it stands at its first place until then.
    assert np.abs(solution.x[solution.t < rest]).max(initial=0) == 0
    assert solution.x[-1] == pytest.approx(3.0) and solution.v[0] == solution.v[-1] == 0
    assert np.gradient(solution.x, solution.t) == pytest.approx(solution.v, abs=0.02)


def test_the_plans_keep_the_knots_of_the_fleets_clock():
    solution = Solution(1, (Plan(8, STEP, POINTS),), start_time=1.0)
    assert solution.plans[0].first_knot == 8 and solution.end == pytest.approx(22 * STEP)
    assert solution.states(np.array([22 * STEP]))[0, 0] == pytest.approx(3.0)


def test_a_solution_that_ended_before_the_mission_is_one_sample():
    solution = Solution(1, (Plan(0, STEP, POINTS),), start_time=100.0)
    assert solution.t.tolist() == [0.0] and solution.x.tolist() == pytest.approx([3.0])
