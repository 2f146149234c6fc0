"""The exchange of intentions: nobody drives what another may drive, and nobody waits for ever."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.exchange import Exchange
from mobile_planning.fleet.message import Death, RobotMsg

#: Plans here are places on a line, clear of each other unless they are the same.
PLACES = 5


def rest(place):
    return Plan.at_rest(0, 0.1, (float(place), 0.0, 0.0))


def are_clear(own, other, theirs):
    return own.end[0] != theirs.end[0]


def exchange(robot_id, place, patience=np.inf, epoch=1, roster=(1, 2, 3)):
    one = Exchange(robot_id, epoch, rest(place), are_clear, patience, 4.0)
    one.join(roster, {}, 0.0)
    return one


def say(one):
    """Return what a robot says."""
    plan = (one.candidate or one.in_force).plan
    return RobotMsg(False, plan.points[:1, 0], plan.points[:1, 1], one.in_force.plan.end, robot_id=one.robot_id,
                    boot_epoch=one.epoch, sequence=one.next_sequence(), plan=plan,
                    plan_seq=(one.candidate or one.in_force).number, links=one.links(0.0))


def near(peer):
    return False


def hear_all(robots, now=0.0):
    """Let everybody hear everybody, and grant."""
    said = [say(one) for one in robots]
    for one in robots:
        for message in said:
            if message.robot_id != one.robot_id:
                one.hear(message, now)
        one.grant()


EVENTS = st.lists(st.tuples(st.sampled_from(['propose', 'say', 'hear', 'hear', 'hear', 'settle', 'drop', 'restart']),
                            st.integers(0, 2), st.integers(0, 10**6)), min_size=20, max_size=150)


def is_broken(events, kind=Exchange):
    """Return whether two of three robots of a ``kind`` of exchange ever drive the same in the course of ``events``."""
    def fresh(robot_id, place, epoch=1):
        one = kind(robot_id, epoch, rest(place), are_clear, np.inf, 4.0)
        one.join((1, 2, 3), {}, 0.0)
        return one
    robots, network = [fresh(1, 0), fresh(2, 1), fresh(3, 2)], []
    for what, index, number in events:
        one = robots[index]
        if what == 'propose':
            one.propose(rest(number % PLACES))
        elif what == 'say':
            network.append(say(one))
        elif what == 'hear' and network:
            # The newer of what was said is likelier, but anything may come, and come again.
            message = network[-1 - min(number % 7, number % 30) % len(network)]
            if message.robot_id != one.robot_id:
                one.hear(message, 0.0)
        elif what == 'settle':
            one.grant()
            one.take(0.0, near)
        elif what == 'drop':
            one.drop()
        elif what == 'restart':
            robots[index] = fresh(one.robot_id, one.in_force.plan.end[0], one.epoch + 1)
        if len({robot.in_force.plan.end[0] for robot in robots}) < 3:
            return True
    return False


@settings(max_examples=100, deadline=None)
@given(EVENTS)
def test_whatever_is_lost_late_doubled_or_disordered_no_two_robots_drive_the_same(events):
    assert not is_broken(events)


class TakesAnyGrant(Exchange):
    """Whoever has granted something once has granted all."""

    def take(self, now, is_far):
        return super().take(now, lambda peer: peer.has_granted >= 0)


class NeverLooks(Exchange):
    """Drives what others were granted meanwhile, and grants what it drives itself: of one alone the peer would know."""

    def is_clear(self, plan):
        return True

    def grant(self):
        in_force, self.in_force = self.in_force, type(self.in_force)(0, rest(-1))
        try:
            return super().grant()
        finally:
            self.in_force = in_force


@pytest.mark.parametrize('kind', [TakesAnyGrant, NeverLooks])
def test_this_would_find_an_exchange_that_lacks_one_of_its_rules(kind):
    rng, kinds = np.random.default_rng(0), ['propose', 'say', 'hear', 'hear', 'hear', 'settle', 'settle']
    assert any(is_broken(zip(rng.choice(kinds, 200).tolist(), rng.integers(0, 3, 200).tolist(),
                             rng.integers(0, 10**6, 200).tolist()), kind) for _ in range(200))


@given(st.permutations(range(3, 9)))
def test_on_a_network_that_works_all_get_at_once_where_nobody_is(goals):
    robots = [exchange(1, 0), exchange(2, 1), exchange(3, 2)]
    for one, goal in zip(robots, goals):
        one.propose(rest(goal))
    for _ in range(2):
        hear_all(robots)
    assert [one.take(0.0, near).end[0] for one in robots] == goals[:3]


def test_of_two_candidates_that_are_not_clear_of_each_other_the_senior_s_is_driven():
    robots = junior, senior = exchange(2, 1, roster=(1, 2)), exchange(1, 0, roster=(1, 2))
    for one in robots:
        one.propose(rest(4))
    for _ in range(2):
        hear_all(robots)
    assert junior.candidate is None and junior.take(0.0, near) is None
    assert senior.take(0.0, near).end[0] == 4


def test_a_peer_that_never_speaks_is_waited_for_as_long_as_the_patience_and_no_longer():
    one = exchange(1, 0, patience=3.0, roster=(1, 2))
    one.propose(rest(1))
    assert one.take(2.9, near) is None
    assert one.take(3.1, near).end[0] == 1


def test_a_peer_that_falls_silent_does_not_block_but_keeps_its_place():
    one, dead = exchange(1, 0, patience=3.0, roster=(1, 2)), exchange(2, 1, roster=(1, 2))
    one.hear(say(dead), 0.0)
    one.propose(rest(1))
    assert one.take(10.0, near) is None
    one.propose(rest(2))
    assert one.take(10.0, near).end[0] == 2


def test_a_certificate_of_death_spares_the_waiting():
    one, dead = exchange(1, 0, roster=(1, 2)), exchange(2, 1, roster=(1, 2))
    one.hear(say(dead), 0.0)
    one.propose(rest(2))
    assert one.take(100.0, near) is None
    assert one.bury(Death(2, 1, np.array([1.0, 0.0]), 0.0)) and one.take(100.0, near).end[0] == 2


def test_a_robot_that_is_not_switched_on_yet_is_driven_around_and_asked_from_then_on():
    one = Exchange(1, 1, rest(0), are_clear, np.inf, 4.0)
    one.join((1, 2), {2: ((1.0, 0.0), 0.2)}, 0.0)
    one.propose(rest(1))
    assert one.take(0.0, near) is None
    one.propose(rest(2))
    assert one.take(0.0, near).end[0] == 2
    one.hear(say(exchange(2, 1, roster=(1, 2))), 0.0)
    one.propose(rest(3))
    assert one.take(0.0, near) is None


def test_a_message_of_another_mission_or_an_old_one_is_ignored():
    one, other = exchange(1, 0, roster=(1, 2)), exchange(2, 1, roster=(1, 2))
    old, new = say(other), say(other)
    assert one.hear(new, 0.0) and not one.hear(old, 0.0) and not one.hear(new, 0.0)
    assert not one.hear(say(exchange(7, 3, roster=(1, 7))), 0.0)
    assert one.ignored == 3


@pytest.mark.parametrize('grants', [True, False])
def test_only_a_grant_of_this_very_candidate_counts(grants):
    one, other = exchange(1, 0, roster=(1, 2)), exchange(2, 1, roster=(1, 2))
    one.propose(rest(2))
    hear_all([one, other])
    granted = say(other)
    if not grants:
        one.propose(rest(3))
    one.hear(granted, 0.0)
    assert (one.take(0.0, near) is not None) == grants
