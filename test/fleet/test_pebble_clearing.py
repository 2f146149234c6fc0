"""Clearing a dead end by way of open ground: every move can be played, and all are home in the end."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pebble_graphs import graph_instance, play, small_instances

from mobile_planning.fleet.pebble_clearing import by_open_ground


@settings(max_examples=80, deadline=None)
@given(small_instances(), st.integers(0, 3))
def test_what_is_found_can_be_played_and_leads_home(instance, seed):
    found = by_open_ground(instance, [0.0] * instance.count, np.random.default_rng(seed))
    if found is not None:
        assert found.is_solved and np.array_equal(play(instance, found), instance.goals)


@pytest.mark.parametrize('robots', [2, 3, 4])
def test_in_a_dead_end_beside_a_hall_any_number_turns_its_order_round(robots):
    # Places 0..15 are a hall of 4 x 4, and 16 and on a lane that leads nowhere, from place 0.
    hall = [(4 * y + x, 4 * y + x + 1) for y in range(4) for x in range(3)]
    hall += [(4 * y + x, 4 * y + x + 4) for y in range(3) for x in range(4)]
    lane = [0, *range(16, 17 + robots)]
    instance = graph_instance(hall + list(zip(lane, lane[1:])), lane[-robots:], lane[-robots:][::-1])
    found = by_open_ground(instance, [0.0] * robots, np.random.default_rng(0))
    assert found is not None and np.array_equal(play(instance, found), instance.goals)


def test_where_there_is_no_open_ground_nothing_is_found():
    instance = graph_instance([(0, 1), (1, 2)], [0, 2], [2, 0])
    assert by_open_ground(instance, [0.0, 0.0], np.random.default_rng(0)) is None
