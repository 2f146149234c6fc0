"""Follower: how far one is by a joint plan, and how far it may go."""
import numpy as np
from joint_plans import NEEDS, WAYS, joint_plan

from mobile_planning.fleet.follower import Follower

CYCLE = 0.25


def test_a_move_waits_for_the_moves_that_it_needs():
    follower = Follower(joint_plan(), 1, 0.0)
    follower.advance(np.zeros(2), np.zeros(2), 0.25)
    assert follower.released == 0 and follower.waits_for(0) == [2]
    assert np.allclose(follower.way(np.zeros(2))[-1], (0, 0))
    follower.learn({2: 1, 1: 5})
    assert follower.released == 1 and np.allclose(follower.way(np.zeros(2)), [(0, 0), (1, 0)])
    assert follower.progress[1] == 0, 'nobody knows better than the robot itself'


def test_a_move_begins_when_another_is_about_to_make_way_and_waits_for_nobody():
    ways = [(0, 0), (1, 0)], [(1, 0), (2, 0), (3, 0), (4, 0), (5, 0)], [(0, 5), (1, 5)]
    needs = (((2, 4),),), ((), (), (), ((3, 1),)), ((),)
    follower = Follower(joint_plan(ways=ways, needs=needs), 1, 0.0)
    for known, released in (({2: 2}, 0), ({2: 3}, 0), ({3: 1}, 1)):
        follower.learn(known)
        assert follower.released == released and follower.waits_for(0) == ([] if released else [2])
    follower.learn({2: 4})
    assert follower.released == 1


def test_a_move_waits_for_who_has_not_set_out_however_near_it_is():
    follower = Follower(joint_plan(), 1, 0.0)
    follower.learn({2: 0, 3: 1})
    assert follower.waits_for(0) == [2]


def test_the_end_of_the_plan_in_force_counts_for_others_and_the_body_for_the_way():
    follower = Follower(joint_plan(ways=([(0, 0), (1, 0)], [(1, 0), (2, 0), (3, 0)], WAYS[2]),
                                   needs=(NEEDS[0], ((), ()), ((),))), 2, 0.0)
    follower.advance(np.array((1.1, 0.0)), np.array((2.9, 0.0)), 0.25)
    assert follower.done == 0 and follower.progress[2] == 2
    assert np.allclose(follower.way((1.1, 0.0)), [(1.1, 0), (2, 0), (3, 0)])


def test_what_is_released_there_and_back_may_be_left_out():
    there_and_back = [(0, 0), (1, 0), (1, 1), (1, 0.05), (2, 0)]
    follower = Follower(joint_plan(1, 1, (1,), (there_and_back,), (((),) * 4,)), 1, 0.0)
    follower.advance(np.array((1.2, 0.05)), np.array((1.2, 0.05)), 0.25)
    assert follower.done == 3


def test_who_is_stuck_goes_back_to_the_line_of_its_move():
    follower = Follower(joint_plan(), 3, 0.0)
    for now in np.arange(0.0, 2.0, CYCLE):
        follower.advance(np.array((0.5, 5.2)), np.array((0.5, 5.2)), now)
    assert np.allclose(follower.way((0.5, 5.2)), [(0.5, 5.2), (0.5, 5.0), (1, 5)])
