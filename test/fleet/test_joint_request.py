"""Joint request: who is asked to join a plan, and who only stands."""
import numpy as np

from mobile_planning.fleet.joint_request import Candidate, gather, standing_beside

RADIUS = 0.205


def candidates(**of):
    return {int(name[1:]): Candidate(np.array((x, 0.0)), np.zeros(2), RADIUS, 0.0, frozenset(lanes),
                                     frozenset(partners)) for name, (x, lanes, partners) in of.items()}


def test_a_group_takes_in_partners_and_users_of_a_lane_and_theirs():
    all_of_them = candidates(r1=(0, (), ()), r2=(1, (7,), ()), r3=(9, (7,), (4,)), r4=(12, (), ()), r5=(9, (), ()))
    assert gather(all_of_them, 1, 2.5) == ([1, 2, 3, 4], True)
    assert gather(all_of_them, 5, 2.5) == ([2, 3, 4, 5], True)
    assert gather(candidates(r1=(0, (), ()), r2=(3, (), ())), 1, 2.5) == ([1], False)


def test_a_member_that_rested_so_far_is_no_obstacle():
    member = Candidate(np.array((1.0, 1.0)), np.zeros(2), RADIUS)
    kept = standing_beside([((1.0, 1.05), RADIUS), ((2.0, 1.0), RADIUS)], [], [member])
    assert [place.tolist() for place, _ in kept] == [[2.0, 1.0]]


def test_a_body_that_is_known_twice_stands_once():
    kept = standing_beside([((2.0, 1.0), RADIUS), ((2.0, 1.0001), RADIUS)],
                           [((2.0, 1.0001), RADIUS), ((2.0, 2.0), RADIUS)],
                           [Candidate(np.zeros(2), np.zeros(2), RADIUS)])
    assert [place.tolist() for place, _ in kept] == [[2.0, 1.0], [2.0, 2.0]]
    # Between two whose contracts stand there is a line that leaves room on both sides.
    assert kept[0][1] == RADIUS < kept[1][1]
