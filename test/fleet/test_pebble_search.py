"""Search for the steps of pebbles, against an exhaustive search."""
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from pebble_graphs import can_be_solved, graph_instance, play, small_instances

from mobile_planning.fleet.pebble_search import search, solve


@settings(max_examples=150, deadline=None)
@given(small_instances(), st.integers(0, 3))
def test_lacam_solves_just_what_can_be_solved(instance, seed):
    rng = np.random.default_rng(seed)
    found = search(instance, np.zeros(instance.count), rng, 200_000)
    assert found.is_solved == can_be_solved(instance)
    here = play(instance, found)
    if found.is_solved:
        assert np.array_equal(here, instance.goals)


def test_two_swap_in_a_line_with_one_pocket():
    instance = graph_instance([(0, 1), (1, 2), (1, 3)], [0, 2], [2, 0])
    assert solve(instance, [0.0, 0.0], np.random.default_rng(0)).is_solved


def test_nobody_rotates_on_a_full_ring():
    instance = graph_instance([(0, 1), (1, 2), (2, 0)], [0, 1, 2], [1, 2, 0])
    assert not solve(instance, [0.0] * 3, np.random.default_rng(0)).is_solved


@settings(max_examples=60, deadline=None)
@given(small_instances(), st.integers(0, 3))
def test_a_search_that_is_cut_off_still_leads_through_steps_that_can_be_played(instance, seed):
    found = solve(instance, np.zeros(instance.count), np.random.default_rng(seed), limits=(2, 3))
    assert found.configurations <= 5
    assert np.array_equal(play(instance, found), instance.goals) or not found.is_solved
