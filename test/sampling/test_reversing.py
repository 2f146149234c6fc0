"""Trees of a car that drives backwards too: its ways are Reeds-Shepp paths, and it gets where no Dubins path leads."""
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from test_rrt import assert_sound, assert_tree, forest, planted

from mobile_planning import (
    Boundary, Environment, InvalidInput, RectangleObstacle, Steering, dubins_shortest, reeds_shepp_shortest, smooth)

POSES = st.tuples(st.floats(20, 80), st.floats(20, 80), st.floats(-3.1, 3.1))
SEEDS = st.integers(0, 2**32 - 1)


def parking():
    """Return a street with a slot beside it, 4 m long and 1.2 m deep, and a pose within, 1 m deep.

    Forwards on a circle of 4 m the last 2 m before that pose lead up 0.54 m only: no Dubins path gets in.
    """
    street = Environment(Boundary((0, 20), (0, 10)),
                         [RectangleObstacle((0, 0), (8, 1.2)), RectangleObstacle((12, 0), (20, 1.2))])
    return street, (10.0, 0.2, 0.0)


def reversals(lengths):
    """Return how often the car changes its direction."""
    return int((np.diff(np.sign(lengths)) != 0).sum())


@given(POSES, POSES)
def test_in_the_open_the_path_is_the_shortest_of_all(start, goal):
    assume(np.hypot(goal[0] - start[0], goal[1] - start[1]) > 1e-6)
    best = reeds_shepp_shortest(start, goal, 4.0)
    rrt = planted(Environment(Boundary((0, 100), (0, 100))), start, precision=(0, 0, 0), steering='reeds_shepp')
    result = rrt.run(goal, 10, seed=1)
    assert_sound(rrt, result, start)
    assert result.cost == pytest.approx(best.length, abs=1e-9)
    assert result.cost <= dubins_shortest(start, goal, 4.0).length + 1e-9
    assert result.path[-1] == pytest.approx(goal, abs=1e-12) and reversals(result.lengths) == reversals(best.lengths)


@settings(max_examples=8)
@given(SEEDS, st.booleans())
def test_every_edge_leads_to_its_node_and_every_answer_is_sound(seed, star):
    rrt = planted(forest(seed % 5, 40), precision=(1, 1, 0.3), steering=Steering.REEDS_SHEPP)
    result = rrt.run((96, 50, np.pi), 400, seed=seed, star=star)
    if result.is_solved:
        assert_sound(rrt, result, (4, 50, 0))
    assert_tree(rrt)
    for (node_from, node_to), edge in rrt.edges.items():
        for pose, node in ((edge.path[0], node_from), (edge.path[-1], node_to)):
            assert pose[:2] == pytest.approx(node[:2], abs=1e-7) and np.cos(pose[2] - node[2]) == pytest.approx(1)


@pytest.mark.parametrize('star', [False, True])
def test_a_slot_that_cannot_be_entered_forwards_is_parked_in_backwards(star):
    street, goal = parking()
    rrt = planted(street, (3, 5, 0), precision=(0.05, 0.05, 0.05), steering='reeds_shepp')
    result = rrt.run(goal, 500 if star else 20_000, seed=2, star=star)
    assert_sound(rrt, result, (3, 5, 0))
    assert min(result.lengths) < 0 and reversals(result.lengths) >= 1


def test_no_path_forwards_leads_into_the_slot():
    street, goal = parking()
    rrt = planted(street, (3, 5, 0), precision=(0.05, 0.05, 0.05))
    assert not rrt.run(goal, 5_000, seed=2).is_solved


@settings(max_examples=5)
@given(SEEDS)
def test_a_path_with_reversals_is_smoothed_and_stays_sound(seed):
    street, goal = parking()
    rrt = planted(street, (3, 5, 0), precision=(0, 0, 0), steering='reeds_shepp')
    found = rrt.run(goal, 20_000, seed=seed)
    shorter = smooth(found.path, street, 4.0, None, seed, nb_iteration=300, steering='reeds_shepp')
    assert_sound(rrt, shorter, (3, 5, 0))
    assert shorter.cost <= found.cost + 1e-6


@pytest.mark.parametrize('options', [{'steering': 'crab'}, {'steering': 'reeds_shepp', 'radius': 0}])
def test_a_steering_that_makes_no_sense_is_refused(options):
    with pytest.raises(InvalidInput, match='steering'):
        planted(forest(), **options)
