"""PlanInForce: what it accepts, offers and stays clear of, against samples of the plans."""
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from missions import SWAP, robot, under_way

from mobile_planning.fleet.contracts import room

AGENT, NOW = under_way(6)
OTHER = robot(2, *SWAP[1]).step(0.0)[0]


def in_force(now=NOW):
    plan = AGENT._in_force
    plan.now = now
    return plan


def test_what_is_offered_is_kept_by_both_plans_from_now_on():
    contract = in_force().offer(7, OTHER)
    assert contract.id == 7 and contract.first_span == in_force().span
    for plan, is_owner in ((AGENT.plan, True), (OTHER.plan, False)):
        assert room(contract, plan, contract.first_span, is_owner, 0.205) >= -1e-9
    assert in_force().accepts(contract, True) and not in_force().accepts(contract, False)


def test_a_contract_that_begins_later_than_clocks_differ_is_not_accepted():
    contract = in_force().offer(7, OTHER)
    late = replace(contract, first_span=contract.first_span + 3)
    assert not in_force().accepts(late, True)


def test_nothing_is_offered_to_one_with_other_knots():
    stranger = robot(2, *SWAP[1], Tc=0.5, Tp=4.0).step(0.0)[0]
    assert in_force().offer(7, stranger) is None


def test_a_contract_is_ample_as_long_as_both_are_farther_from_its_line_than_they_drive_in_one_and_a_half_seconds():
    contract = in_force().offer(7, OTHER)
    rooms = [room(contract, plan, in_force().span, is_owner, 0.205)
             for plan, is_owner in ((AGENT.plan, True), (OTHER.plan, False))]
    assert in_force().is_ample(contract, OTHER) == (min(rooms) >= 1.5 * OTHER.v_max)
    assert not in_force().is_ample(contract, replace(OTHER, v_max=min(rooms) / 1.5 + 0.01))
    assert in_force().is_ample(contract, replace(OTHER, v_max=min(rooms) / 1.5 - 0.01))


@given(st.floats(0.0, 10.0), st.floats(0.0, 6.0), st.floats(0.1, 0.5))
def test_what_it_is_clear_of_it_never_comes_near_to(x, y, radius):
    times = np.linspace(NOW, NOW + 5.0, 200)
    least = np.linalg.norm(AGENT.plan.states(times)[:, :2] - (x, y), axis=1).min()
    if in_force().clear_of((x, y), radius):
        assert least >= radius + 0.205 - 1e-7
    else:
        # The plan's hull is a little larger than the plan.
        assert least <= radius + 0.205 + 0.05


def test_the_span_that_is_driven_is_none_before_the_plan():
    first = AGENT.plan.first_knot
    assert in_force(first * 0.125 - 3.0).span == first and in_force(first * 0.125 + 0.3).span == first + 2
    assert in_force(NOW).now == pytest.approx(NOW)
