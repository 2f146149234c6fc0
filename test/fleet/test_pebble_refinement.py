"""Refinement of the steps of pebbles: never worse, and still a way home."""
import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from pebble_graphs import graph_instance, play, small_instances

from mobile_planning.fleet import pebbles
from mobile_planning.fleet.pebble_refinement import best_steps, refined
from mobile_planning.fleet.pebble_search import search, solve


@settings(max_examples=60, deadline=None)
@given(small_instances(), st.integers(0, 3))
def test_refined_steps_are_no_worse_and_lead_home_too(instance, seed):
    rng = np.random.default_rng(seed)
    found = search(instance, np.zeros(instance.count), rng, 2000)
    better = refined(instance, found, rng, 20)
    if found.is_solved:
        assert np.array_equal(play(instance, better), instance.goals)
        costs = [sum(pebbles.cost(instance, edges) for edges in steps.edges.T) for steps in (found, better)]
        worst = [max(pebbles.cost(instance, edges) for edges in steps.edges.T) for steps in (found, better)]
        assert worst[1] + 0.5 * costs[1] / instance.count <= worst[0] + 0.5 * costs[0] / instance.count + 1e-6


def test_a_lone_robot_takes_the_shortest_way():
    instance = graph_instance([(0, 1), (1, 2), (2, 3), (0, 4), (4, 3)], [0], [3])
    rng = np.random.default_rng(0)
    steps = refined(instance, solve(instance, [0.0], rng), rng)
    assert steps.places[:, 0].tolist() == [0, 4, 3]


@settings(max_examples=40, deadline=None)
@given(small_instances(), st.integers(0, 3))
def test_the_best_steps_lead_home_where_a_search_does_and_cost_no_more(instance, seed):
    urgency = np.zeros(instance.count)
    first = solve(instance, urgency, np.random.default_rng(seed))
    best = best_steps(instance, urgency, np.random.default_rng(seed))
    assert best.is_solved == first.is_solved
    if first.is_solved:
        assert np.array_equal(play(instance, best), instance.goals)
        assert pebbles.value(instance, best) <= pebbles.value(instance, first) + 1e-6
