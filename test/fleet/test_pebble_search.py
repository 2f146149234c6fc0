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


@settings(max_examples=60, deadline=None)
@given(small_instances())
def test_two_that_cannot_meet_may_move_in_any_order_wherever_they_go(instance):
    from mobile_planning.fleet.pebble_kernels import orders

    ends = instance.edges.tolist()
    moves = {u: [(u, -1), *((a + b - u, e) for e, (a, b) in enumerate(ends) if u in (a, b))]
             for u in range(instance.to_go.shape[1])}
    for u, w in np.argwhere(~instance.meets).tolist():
        assert all(orders(instance.close, instance.swept, 0, u, v, e, w, x, f) == 3
                   for v, e in moves[u] for x, f in moves[w])


@given(st.lists(st.tuples(st.sampled_from([0.0, 0.5, 1.0]), st.integers(0, 9)), max_size=40))
def test_a_heap_gives_back_in_order_what_was_put_into_it(entries):
    from mobile_planning.fleet.pebble_kernels import pop, push

    keys, codes = np.empty(40), np.empty(40, np.int64)
    for size, (key, code) in enumerate(entries):
        push(keys, codes, size, key, code)
    assert [pop(keys, codes, size) for size in range(len(entries), 0, -1)] == sorted(entries)
