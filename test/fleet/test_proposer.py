"""Who proposes a joint plan and when, with messages passed by hand."""
from dataclasses import replace

import numpy as np
import pytest
from joint_plans import WAYS, joint_plan
from partners import CYCLE, coordination, doorway, message

from mobile_planning import Boundary, Environment
from mobile_planning.fleet.joint_message import MAX_MOVES, JointStatus
from mobile_planning.fleet.message import Mode
from mobile_planning.fleet.roadmap import Roadmap


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
        if request is not None and not request.ids:
            own.propose(request.plan(), now)
            request = None
        late += [request] if request is not None else []
    before, after = late
    assert (after.roadmap is before.roadmap) == (end != 'it is in another world')
    assert own.propose(before.plan(), 4.0) == [] and not own.is_following
    said = own.propose(after.plan(), 4.25)
    assert len(said) == 1 and own.is_following and said[0].version > (before.epoch, -2)


@pytest.mark.parametrize('stalled', [0.0, 2.0])
@pytest.mark.parametrize('new', ['world', 'radius'])
def test_a_roadmap_is_made_where_plans_are_and_never_in_a_cycle(new, stalled, monkeypatch):
    own, made = coordination(1, environment=doorway()), []

    def plain(*args):
        made.append(args)
        return Roadmap(*args)

    monkeypatch.setattr('mobile_planning.fleet.joint_ground.Roadmap', plain)
    if new == 'world':
        own.enter(doorway())
    asked = []
    for now in np.arange(0.0, 2.0, CYCLE):
        other = message(2, (1, 0), (-1, 0))
        own.hear(replace(other, radius=0.25) if new == 'radius' else other, now)
        before = len(made)
        own.update(now, (-1, 0), (-1, 0), (1, 0), False, stalled)
        assert len(made) == before
        request = own.take_request()
        if request is not None:
            asked.append(request.ids)
            own.propose(request.plan(), now)
    # First the ground, then the plan of the two that come against each other in the door.
    assert asked == [(), (1, 2)] and len(made) == 1


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
