"""PlanRecord: which of the plans drives when."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from missions import under_way

AGENT, NOW = under_way(10)


@given(st.floats(0.0, 8.0))
def test_a_state_is_that_of_the_solution(time):
    record = AGENT._motion.record
    assert record.state(time).tolist() == record.solution(1, False).states(np.array([time]))[0].tolist()
    assert np.array_equal(AGENT.state(time), record.state(time))


def test_before_its_first_plan_a_robot_stands_where_it_was_switched_on():
    record = AGENT._motion.record
    assert record.state(-5.0) == pytest.approx([1, 3, 0, 0, 0], abs=1e-12) and record.heading(-40) == 0.0


def test_each_plan_has_its_commit_and_they_are_in_order():
    solution = AGENT.sol
    assert len(solution.plans) == len(solution.commits) == len(AGENT._motion.record) > 5
    assert np.isnan(solution.commits[0]) and (np.diff(solution.commits[1:]) > 0).all()
    assert all(plan.first_knot * plan.step > commit for plan, commit in zip(solution.plans[1:], solution.commits[1:]))
