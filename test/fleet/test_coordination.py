"""Coordination: which plan counts, how it is carried out and who waits, with messages passed by hand."""
from dataclasses import replace

import numpy as np
from joint_plans import WAYS, joint_plan
from partners import CYCLE, coordination, doorway, follows, message

from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.joint_message import JointStatus
from mobile_planning.fleet.message import Mode


# Which plan counts


def test_the_newest_plan_counts_and_of_one_epoch_that_of_the_lower_id():
    own = coordination(2, [message(1), message(3)])
    for plan, expected in ((joint_plan(5, 3), (5, -3)), (joint_plan(5, 1), (5, -1)), (joint_plan(4, 1), (5, -1)),
                           (joint_plan(5, 2, robot_id=1), (5, -1)), (joint_plan(6, 3), (6, -3))):
        own.hear(plan, 1.0)
        own.update(1.0, (0, 0), (0, 0), (3, 0), False, 0.0)
        assert own.status.version == expected


def test_a_plan_for_others_is_not_followed():
    own = coordination(4, [message(1)])
    assert own.hear(joint_plan(), 1.0) and not own.is_following


def test_a_plan_said_twice_or_by_a_stranger_is_no_news():
    own = coordination(2, [message(1), message(3)])
    assert not own.hear(joint_plan(robot_id=9), 1.0)
    assert own.hear(joint_plan(), 1.0)
    assert not own.hear(joint_plan(robot_id=3), 1.0)


def test_when_a_partner_leaves_for_a_plan_without_this_robot_the_plan_is_given_up():
    own = coordination(2, [message(1), message(3)])
    own.hear(joint_plan(), 1.0)
    newer = joint_plan(2, 3, (1, 3), (WAYS[0], WAYS[2]), (((),), ((),)))
    own.hear(newer, 1.0)
    own.hear(message(3, status=follows(newer)), 1.0)
    own.update(1.25, (1, 0), (1, 0), (3, 0), False, 0.0)
    assert not own.is_following and not own.status.is_followed


def test_when_a_partner_is_heard_in_a_plan_that_does_not_come_the_plan_is_given_up_after_a_while():
    own = coordination(2, [message(1), message(3)])
    own.hear(joint_plan(), 1.0)
    until = {}
    for now in np.arange(1.25, 5.0, CYCLE):
        own.hear(message(3, status=JointStatus(9, 3, True)), now)
        own.update(now, (1, 0), (1, 0), (3, 0), False, 0.0)
        until[now] = own.is_following
    assert until[2.0] and not until[4.0]


def test_a_plan_that_was_given_up_is_not_taken_up_again():
    own = coordination(2, [message(1), message(3)])
    plan = joint_plan()
    own.hear(plan, 1.0)
    own.hear(message(1, status=replace(follows(plan), is_followed=False)), 1.0)
    own.update(1.25, (1, 0), (1, 0), (3, 0), False, 0.0)
    assert not own.is_following
    own.hear(replace(plan, robot_id=3, sequence=8), 1.5)
    assert not own.is_following


def test_a_plan_is_over_when_all_have_finished():
    own = coordination(2, [message(1), message(3)])
    plan = joint_plan()
    own.hear(plan, 1.0)
    own.hear(message(1, status=follows(plan, r1=1)), 1.0)
    own.update(1.25, (2, 0), (2, 0), (2, 0), False, 0.0)
    assert own.is_following and not own.calls
    own.hear(message(1, status=follows(plan, r1=1, r3=1)), 1.5)
    own.update(1.5, (2, 0), (2, 0), (2, 0), False, 0.0)
    assert not own.is_following and own.status.progress[2] == 1


def test_a_plan_is_said_again_until_all_members_have_it():
    own = coordination(2, [message(1), message(3)])
    plan = joint_plan()
    own.hear(plan, 1.0)
    said = []
    for now in np.arange(1.25, 6.0, CYCLE):
        own.hear(message(1, status=follows(plan)), now)
        own.hear(message(3, status=follows(plan) if now > 3.0 else JointStatus()), now)
        said += [(now, each) for each in own.update(now, (1, 0), (1, 0), (3, 0), False, 0.0)]
    assert 2 <= len(said) <= 4 and all(now <= 3.0 for now, _ in said)
    assert all(each.version == plan.version and each.robot_id == 2 for _, each in said)
    assert len({each.sequence for _, each in said}) == len(said)


# On the way


def test_who_has_no_moves_is_not_called():
    own = coordination(1)
    own.hear(message(2), 0.0)
    own.hear(joint_plan(1, 2, (1, 2), ([(0, 0)], WAYS[1]), ((), ((),))), 0.0)
    assert own.is_following and not own.calls


# Who waits, and why


def test_a_robot_waits_for_those_that_go_first():
    own = coordination(1, [message(2), message(3)])
    own.hear(joint_plan(robot_id=3), 1.0)
    own.update(1.25, (0, 0), (0, 0), (1, 0), False, 0.0)
    own.update(1.5, (0, 0), (0, 0), (1, 0), False, 0.0)
    assert own.held_up == HoldUp(1.25, Reason.TURN, (2,))
    own.hear(message(2, status=follows(joint_plan(), r2=1)), 1.6)
    own.update(1.75, (0, 0), (0, 0), (1, 0), False, 0.0)
    assert own.held_up is None


def test_a_robot_whose_goal_is_taken_by_one_that_stopped_is_blocked_and_says_by_whom():
    own = coordination(2, environment=doorway())
    reasons, proposals = [], []
    for now in np.arange(0.0, 60.0, CYCLE):
        own.hear(message(7, (0.0, 0.0), mode=Mode.STOPPED), now)
        own.update(now, (-1.5, 0.0), (-1.5, 0.0), (1.5, 0.0), False, 2.0 + now)
        request = own.take_request()
        if request is not None:
            own.propose(request.plan(), now)
            proposals.append(now)
        reasons.append(own.held_up)
    assert reasons[-1].reason is Reason.BLOCKED and reasons[-1].for_robots == (7,) and len(proposals) < 15


def test_who_makes_progress_or_is_home_does_not_wait():
    own = coordination(2)
    own.update(0.0, (0, 0), (0, 0), (3, 0), False, 0.5)
    assert own.held_up is None
    own.update(0.25, (0, 0), (0, 0), (3, 0), True, 9.0)
    assert own.held_up is None
    own.update(0.5, (0, 0), (0, 0), (3, 0), False, 9.0)
    assert own.held_up == HoldUp(-8.5, Reason.STALLED)


def test_with_a_new_goal_the_plan_is_left_and_the_others_leave_it_too():
    one, other = coordination(1, [message(2), message(3)]), coordination(2, [message(1), message(3)])
    for own in (one, other):
        own.hear(joint_plan(robot_id=3), 1.0)
    one.update(1.25, (0, 0), (0, 0), (1, 0), False, 0.0)
    one.update(1.5, (0, 0), (0, 0), (4, 4), False, 0.0)
    assert not one.is_following and not one.status.is_followed
    other.hear(message(1, status=one.status), 1.5)
    other.update(1.75, (1, 0), (1, 0), (2, 0), False, 0.0)
    assert not other.is_following
