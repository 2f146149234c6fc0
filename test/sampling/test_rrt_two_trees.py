"""Two trees that meet: the same promises as of one, whichever way round their ways were grown."""
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from test_rrt import assert_sound, assert_tree, forest, planted

from mobile_planning import RRT, Boundary, Environment, Footprint, RectangleObstacle, Steering, load_problem
from mobile_planning.sampling.rrt_search import Search
from mobile_planning.sampling.steering import car_of
from mobile_planning.sampling.steering_kernels import cut, driven_back, steer, way_end

FOLDER = Path(__file__).resolve().parent.parent / 'data' / 'sampling'
POSES = st.tuples(st.floats(-9, 9), st.floats(-9, 9), st.floats(-3.1, 3.1))


@given(POSES, POSES, st.sampled_from(Steering))
def test_a_way_driven_back_is_a_way_of_the_poses_turned_round(start, goal, steering):
    car = car_of(2.0, steering)
    length, word, parts = steer(car, *start, *goal)
    back, back_parts = driven_back(word, parts)
    for share in (0.25, 0.5, 1.0):
        x, y, heading = way_end(car, goal[0], goal[1], goal[2] + np.pi, back, cut(back_parts, share * length))
        there = way_end(car, *start, word, cut(parts, (1 - share) * length))
        assert (x, y) == pytest.approx(there[:2], abs=1e-8)
        assert np.cos(heading - there[2]) == pytest.approx(-1)


@settings(max_examples=10)
@given(st.integers(0, 2**32 - 1), st.sampled_from([0.0, 2.0, 5.0]), st.sampled_from([(0, 0, 0), (1, 1, 0.3)]))
def test_where_the_trees_meet_the_path_is_sound_and_the_tree_one(seed, radius, precision):
    rrt = planted(forest(seed % 7, 40), (4, 50, 0) if radius else (4, 50), radius=radius, precision=precision)
    result = rrt.run((96, 50, 0) if radius else (96, 50), 2000, seed=seed)
    if result.is_solved:
        assert_sound(rrt, result, rrt.root)
    assert_tree(rrt)


def test_a_way_out_of_a_trap_is_found_with_less_work_by_two_trees():
    problem = load_problem(FOLDER / 'bug_trap.json')
    drawn = {}
    for two_trees in (True, False):
        runs = []
        for seed in range(5):
            rrt = RRT(problem.environment, problem.goal_tolerance, radius=0, two_trees=two_trees)
            rrt.set_start(problem.start)
            runs.append(rrt.run(problem.goal, 30_000, seed=seed).iterations)
        drawn[two_trees] = np.median(runs)
    assert drawn[True] < drawn[False] / 2


@pytest.mark.parametrize('change', ['goal_rate', 'footprint', 'moving', 'goal'])
def test_there_is_one_tree_where_ways_cannot_be_driven_back(change):
    world = forest(moving=change == 'moving')
    if change == 'footprint':
        world = world.for_footprint(Footprint.rectangle(2, 1))
    if change == 'goal':
        world = Environment(Boundary((0, 100), (0, 100)), [RectangleObstacle((95, 49), (97, 51))])
    rrt = planted(world)
    rrt.goal_rate = 0.0 if change == 'goal_rate' else 0.1
    goal = np.array((96.0, 50.0, 0.0))
    assert not has_two_trees(rrt, goal) and has_two_trees(planted(forest()), goal)


def has_two_trees(rrt, goal):
    """Return whether a search of the planner would grow a second tree."""
    world, goal_is_free = rrt._setting.world(rrt._tree.poses[0], 0.0, goal)
    task = rrt._setting.task(goal, 0.0, rrt.goal_rate, 'local')
    return Search(world, rrt._tree, task, 1, 10, np.zeros(1, np.uint8), has_two_trees=goal_is_free).has_two_trees
