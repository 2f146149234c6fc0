"""Coordination: who proposes, which plan counts, and how it is carried out, with messages passed by hand."""
from dataclasses import replace

import numpy as np
import pytest
from joint_plans import WAYS, joint_plan

from mobile_planning import Boundary, Environment, PolygonObstacle
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.coordination import Coordination
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.joint_message import MAX_MOVES, JointStatus
from mobile_planning.fleet.message import Mode, RobotMsg

RADIUS, CYCLE = 0.205, 0.25


def box(x_min, y_min, x_max, y_max):
    return PolygonObstacle([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


def doorway():
    walls = [box(-0.1, -2, 0.1, -0.325), box(-0.1, 0.325, 0.1, 2)]
    return Environment(Boundary((-2.5, 2.5), (-2, 2)), walls)


def message(robot_id, place=(0.0, 0.0), goal=(0.0, 0.0), status=JointStatus(), mode=Mode.DRIVING, v_max=1.0):
    place = np.asarray(place, float)
    return RobotMsg(False, place[:1], place[1:], place, robot_id=robot_id, boot_epoch=1, mode=mode,
                    plan=Plan.at_rest(0, 0.125, (*place, 0.0)), radius=RADIUS, goal=np.asarray(goal, float),
                    v_max=v_max, joint=status)


def follows(plan, **progress):
    return JointStatus(plan.epoch, plan.proposer, True, {int(key[1:]): moves for key, moves in progress.items()})


class Body:
    """A robot that does at once what its coordination says, as fast as it drives, as far as nobody is in its way."""

    def __init__(self, robot_id, environment, place, goal):
        self.coordination = Coordination(robot_id, environment, RADIUS, 1.0)
        self.id, self.place, self.goal = robot_id, np.array(place, float), np.array(goal, float)
        self.stalled, self.is_dead = 0.0, False

    @property
    def is_home(self):
        return np.linalg.norm(self.place - self.goal) < 0.02

    def step(self, now):
        own = self.coordination
        said = own.update(now, self.place, self.place, self.goal, self.is_home and not own.calls, self.stalled)
        request = own.take_request()
        if request is not None:
            said += own.propose(request.plan(), now)
        self.stalled = 0.0 if own.is_following else self.stalled + CYCLE
        way, left = own.way(self.place), CYCLE
        for point in () if way is None else way[1:] if len(way) > 1 else way:
            leg = point - self.place
            length = np.linalg.norm(leg)
            self.place = self.place + leg * min(1.0, left / max(length, 1e-9))
            left -= length
            if left <= 0:
                break
        return said


def drive(bodies, seconds, loss=0.0, seed=0):
    """Let the bodies drive with messages that are lost now and then; return the least distance of two of them."""
    rng, least, now = np.random.default_rng(seed), np.inf, 0.0
    while now < seconds and not all(body.is_home or body.is_dead for body in bodies):
        now += CYCLE
        for body in rng.permutation([body for body in bodies if not body.is_dead]):
            before = body.place
            said = body.step(now)
            if any(np.linalg.norm(body.place - other.place) < min(2 * RADIUS, np.linalg.norm(before - other.place))
                   for other in bodies if other is not body and not other.is_dead):
                # What a plan says is guidance: it is contracts that keep robots apart.
                body.place = before
            said = [*said, message(body.id, body.place, body.goal, body.coordination.status)]
            for other in bodies:
                for each in said if other is not body and not other.is_dead else ():
                    if rng.random() >= loss:
                        other.coordination.hear(each, now)
        places = np.array([body.place for body in bodies])
        gaps = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(len(bodies), 1)]
        least = min(least, gaps.min(initial=np.inf))
    return least


def through_the_door():
    world = doorway()
    places = [(-1.5, -0.5), (1.5, 0.5), (-1.5, 0.5), (1.5, -0.5)]
    return [Body(10 + i, world, place, (-place[0], place[1])) for i, place in enumerate(places)]


# All together


def test_robots_that_are_stuck_on_both_sides_of_a_door_get_through_without_touching():
    bodies = through_the_door()
    drive(bodies, 60.0)
    assert all(body.is_home for body in bodies)


@pytest.mark.parametrize('seed', range(6))
def test_they_get_through_when_a_third_of_the_messages_is_lost(seed):
    bodies = through_the_door()
    drive(bodies, 90.0, loss=0.3, seed=seed)
    assert all(body.is_home for body in bodies)


def test_the_others_get_home_past_one_that_falls_silent():
    bodies = through_the_door()
    bodies[0].place[:] = -2.2, -1.6
    drive(bodies, 0.5)
    bodies[0].is_dead = True
    drive(bodies, 90.0)
    assert all(body.is_home for body in bodies[1:])


def test_all_follow_the_plan_of_one():
    bodies = through_the_door()
    for body in bodies:
        body.stalled = 10.0
    drive(bodies, 1.5)
    assert {body.coordination.status.version for body in bodies} == {(1, -10)}


# Who proposes


def coordination(robot_id=2, others=(), now=0.0, environment=None):
    own = Coordination(robot_id, environment or Environment(Boundary((-5, 5), (-5, 5))), RADIUS, 1.0)
    for other in others:
        own.hear(other, now)
    return own


def test_nobody_proposes_as_long_as_there_is_progress():
    own = coordination()
    for now in np.arange(0, 20, CYCLE):
        assert own.update(now, (0, 0), (0, 0), (3, 0), False, 0.5) == [] and own.take_request() is None


def test_a_stalled_robot_says_that_it_is_about_to_propose_and_then_does():
    own = coordination()
    own.update(0.0, (0, 0), (0, 0), (3, 0), False, 2.0)
    assert own.take_request() is None and own.status.is_proposing
    own.update(0.25, (0, 0), (0, 0), (3, 0), False, 2.25)
    plans = own.propose(own.take_request().plan(), 0.25)
    assert len(plans) == 1 and own.is_following and own.status.version == plans[0].version
    assert np.allclose(plans[0].ways[0][-1], (3, 0))


@pytest.mark.parametrize('plan_end, is_done', [((3, 0), False), ((0, 0), True)])
def test_who_is_at_its_goal_does_not_propose(plan_end, is_done):
    own = coordination()
    for now in (0.0, 0.25, 0.5):
        own.update(now, (0, 0), plan_end, (3, 0), is_done, 9.0)
        assert own.take_request() is None


def test_of_two_that_are_about_to_propose_the_lower_id_does_and_the_other_only_after_a_while():
    rival = message(1, (1, 1), status=JointStatus(is_proposing=True))
    own, times = coordination(2), []
    for now in np.arange(0.0, 2.0, CYCLE):
        own.hear(rival, now)
        own.update(now, (0, 0), (0, 0), (3, 0), False, 2.0)
        times.append((now, own.take_request() is not None))
    assert next(now for now, proposes in times if proposes) == 0.75


def test_robots_that_will_meet_in_a_lane_plan_before_they_do():
    facing = message(1, (1.5, 0.3), (-1.5, 0.3))
    own = coordination(2, [facing], environment=doorway())
    for now in (0.0, 0.25):
        own.update(now, (-1.5, 0.0), (-1.5, 0.0), (1.5, 0.0), False, 0.0)
    assert own.take_request().ids == (1, 2)


@pytest.mark.parametrize('other', [message(1, (-2.0, 0.3), (1.5, 0.3)), message(1, (1.5, 0.3), (2.0, -1.0)),
                                   message(1, (1.5, 0.3), (-1.5, 0.3), v_max=0.05)],
                         ids=['same way', 'other room', 'much later'])
def test_robots_that_will_not_meet_in_a_lane_need_no_plan(other):
    own = coordination(2, [other], environment=doorway())
    for now in (0.0, 0.25):
        own.update(now, (-1.5, 0.0), (-1.5, 0.0), (1.5, 0.0), False, 0.0)
    assert own.take_request() is None


@pytest.mark.parametrize('proposer', [1, 2])
def test_who_will_meet_somebody_in_a_lane_asks_ever_more_rarely_if_plans_lead_nobody_on(proposer):
    own, asked = coordination(2, environment=doorway()), []
    for now in np.arange(0.0, 60.0, CYCLE):
        own.hear(message(1, (1.5, 0.3), (-1.5, 0.3)), now)
        own.update(now, (-1.5, 0.0), (-1.5, 0.0), (1.5, 0.0), False, 0.0)
        request = own.take_request()
        if request is None:
            continue
        asked.append(now)
        void = joint_plan(request.epoch, proposer, (1, 2), ([(1.5, 0.3)], [(-1.5, 0.0)]), ((), ()))
        own.propose(void, now) if proposer == 2 else own.propose(None, now) + [own.hear(void, now)]
    pauses = np.diff(asked)
    assert 5 < len(asked) < 15 and (np.diff(pauses) >= -CYCLE).all() and pauses[-1] >= 8.0


def test_a_robot_that_is_due_again_asks_more_and_plans_further():
    own = coordination(2, [message(1, (2, 0)), message(3, (4, 0))])
    sizes = []
    for now in (0.0, 5.0, 10.0):
        own.hear(message(1, (2, 0), (3, 3)), now)
        own.hear(message(3, (4, 0), (3, -3)), now)
        own.update(now, (0, 0), (0, 0), (3, 0), False, 2.0)
        own.update(now, (0, 0), (0, 0), (3, 0), False, 2.0)
        request = own.take_request()
        sizes.append((request.ids, request.horizon))
        own.propose(None, now)
        # Now that it has got on for a moment, it starts from the beginning.
        own.update(now, (0, 0), (0, 0), (3, 0), False, 0.0)
    assert sizes == [((1, 2), 10), ((1, 2, 3), 25), ((1, 2, 3), MAX_MOVES)]


def test_who_is_silent_or_stopped_is_planned_around():
    own = coordination(2, [message(1, (2, 0)), message(3, (0, 1), mode=Mode.STOPPED)], now=0.0)
    own.hear(message(3, (0, 1), mode=Mode.STOPPED), 5.0)
    for now in (5.0, 5.25):
        own.update(now, (0, 0), (0, 0), (3, 0), False, 2.0)
    request = own.take_request()
    assert request.ids == (2,)
    assert sorted(place.tolist() for place, _ in request.standing) == [[0.0, 1.0], [2.0, 0.0]]


def test_a_plan_that_comes_after_a_newer_one_is_dropped():
    own = coordination(2, [message(1)])
    for now in (0.0, 0.25):
        own.update(now, (0, 0), (0, 0), (3, 0), False, 2.0)
    late = own.take_request().plan()
    own.hear(joint_plan(epoch=7), 0.3)
    assert own.propose(late, 0.4) == [] and own.status.version != late.version


@pytest.mark.parametrize('end', ['it leaves', 'it has a new goal', 'it is in another world'])
def test_what_comes_of_a_request_made_before_is_dropped_and_the_next_is_taken(end):
    own, goal, late = coordination(2, [message(1)]), (3, 0), []
    for now in np.arange(0.0, 4.0, CYCLE):
        own.hear(message(1), now)
        if now == 1.0:
            goal = (0, 3) if end == 'it has a new goal' else (3, 0)
            if end == 'it is in another world':
                own.enter(Environment(Boundary((-6, 6), (-5, 5))))
            else:
                own.leave()
        own.update(now, (0, 0), (0, 0), goal, False, 2.0 + now)
        request = own.take_request()
        late += [request] if request is not None else []
    before, after = late
    assert (after.roadmap is before.roadmap) == (end != 'it is in another world')
    assert own.propose(before.plan(), 4.0) == [] and not own.is_following
    said = own.propose(after.plan(), 4.25)
    assert len(said) == 1 and own.is_following and said[0].version > (before.epoch, -2)


def test_a_plan_of_another_that_leads_to_the_goal_this_robot_had_before_is_not_followed_and_they_hear_of_it():
    own = coordination(2, [message(1), message(3)])
    own.update(1.0, (1, 0), (1, 0), (2, 0), False, 0.0)
    own.update(1.25, (1, 0), (1, 0), (4, 4), False, 0.0)
    plan = joint_plan()
    own.hear(plan, 1.3)
    own.update(1.5, (1, 0), (1, 0), (4, 4), False, 0.0)
    assert not own.is_following and own.status.version == plan.version and not own.status.is_followed
    partner = coordination(1, [message(2), message(3)])
    partner.hear(plan, 1.3)
    partner.hear(message(2, status=own.status), 1.5)
    partner.update(1.75, (0, 0), (0, 0), (1, 0), False, 0.0)
    assert not partner.is_following
    own.hear(joint_plan(2, 1, ways=(WAYS[0], [(1, 0), (4, 4)], WAYS[2])), 2.0)
    assert own.is_following


def test_a_request_is_handed_out_once_and_the_next_only_when_it_has_been_answered():
    own, due = coordination(2, [message(1)]), []
    for now in np.arange(0.0, 3.0, CYCLE):
        if now == 2.0:
            own.propose(None, now)
        own.hear(message(1), now)
        own.update(now, (0, 0), (0, 0), (3, 0), False, 2.0 + now)
        due += [now] if own.take_request() is not None else []
        assert own.take_request() is None
    assert due == [0.25, 2.0]


def test_a_request_that_is_never_answered_is_made_anew_after_a_while():
    own, due = coordination(2), []
    for now in np.arange(0.0, 12.0, CYCLE):
        own.update(now, (0, 0), (0, 0), (3, 0), False, 2.0 + now)
        due += [now] if own.take_request() is not None else []
    assert due == [0.25, 5.5, 10.75]


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
