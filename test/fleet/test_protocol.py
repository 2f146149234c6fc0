"""The protocol of one robot: what it believes, what it says, and when it lets the robot move."""
from dataclasses import replace

import numpy as np
import pytest
import weakened_sides as weak

from benchmark import protocol_adversary
from mobile_planning import InvalidInput, RobotMsg
from mobile_planning.fleet import protocol as home
from mobile_planning.fleet import repetition
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import Contracts, Death, Link, LinkMode, Offer
from mobile_planning.fleet.protocol import Protocol
from mobile_planning.fleet.repetition import REPEAT, SOON, TIMES

PLACES = {1: (0.0, 0.0), 2: (2.0, 0.0), 3: (0.0, 2.0)}


class Yielding:
    """A geometry that agrees to all, or to nothing."""

    def __init__(self, agrees=True):
        self.agrees, self.has_room = agrees, False

    def is_ample(self, contract, heard):
        return self.has_room

    def accepts(self, contract, is_owner):
        return self.agrees

    def clear_of(self, place, radius):
        return self.agrees

    def offer(self, contract_id, heard):
        return Contract(contract_id, 0, [[1.0, 0.0]], [[0.0] * 4]) if self.agrees else None


def robot(number, epoch=1, agrees=True, roster=(1, 2), **options):
    """Return a protocol that has joined."""
    made = Protocol(number, epoch, Yielding(agrees), **options)
    made.join(roster)
    return made


def says(protocol, now, moving=False):
    """Return the message of a cycle."""
    place = PLACES[protocol.robot_id]
    points = np.tile(place, (6, 1)) + (np.array([[0.0, 0], [0, 0], [0, 1], [0, 2], [0, 2], [0, 2]]) if moving else 0)
    number = protocol.next_sequence()
    protocol.sent(number, now)
    return RobotMsg(False, [0.0], [0.0], place, robot_id=protocol.robot_id, boot_epoch=protocol.epoch, sequence=number,
                    plan=Plan(0, 0.25, points), links=protocol.links(now))


def agreed(now=0.0, **options):
    """Return an owner and a peer with a contract and a lease."""
    owner, peer = robot(1, **options), robot(2, **options)
    for one, other in ((peer, owner), (owner, peer)):
        other.hear(says(one, now), now)
    peer.hear(owner.due(now), now)
    owner.hear(peer.due(now), now)
    peer.hear(says(owner, now), now)
    return owner, peer


def mode(protocol, other=None):
    return protocol.links(0.0)[other or 3 - protocol.robot_id].mode


def test_before_anything_is_agreed_nobody_moves():
    for number in (1, 2):
        assert not robot(number).may_move(0.0, True) and not robot(number).may_move(0.0, False)
    assert robot(1, roster=[1]).may_move(0.0, True)


def test_a_contract_that_leaves_ample_room_is_not_renewed_until_it_does_not():
    owner, peer = agreed()
    for owner._geometry.has_room, is_renewed in ((True, False), (False, True)):
        owner.hear(says(peer, 1.0), 1.0)
        message = owner.due(1.0)
        assert (message is not None and bool(message.offers)) == is_renewed
        assert owner.may_move(1.0, False)


def test_what_is_not_yet_agreed_is_offered_whatever_room_there_is():
    owner, peer = robot(1), robot(2)
    owner._geometry.has_room = True
    owner.hear(says(peer, 0.0), 0.0)
    assert owner.due(0.0).offers


def test_an_offer_and_an_answer_bind_both_and_let_both_move():
    owner, peer = agreed()
    assert mode(owner) is mode(peer) is LinkMode.CON
    assert [(contract.id, is_owner) for contract, is_owner in owner.bound()] == [(1, True)]
    assert [(contract.id, is_owner) for contract, is_owner in peer.bound()] == [(1, False)]
    assert owner.may_move(0.0, True) and peer.may_move(0.0, True)


def test_an_owner_is_bound_before_its_offer_is_sent():
    owner, peer = robot(1), robot(2)
    owner.hear(says(peer, 0.0), 0.0)
    assert owner.bound() == [] and owner.has_due
    offers = owner.due(0.0).offers
    assert [(offer.peer_id, offer.peer_epoch, offer.base_sequence) for offer in offers] == [(2, 1, 1)]
    assert [contract for contract, _ in owner.bound()] == [offers[0].contract]


def test_a_peer_that_does_not_pass_its_own_test_takes_the_offer_once_it_does():
    owner, peer = robot(1), robot(2, agrees=False)
    owner.hear(says(peer, 0.0), 0.0)
    peer.hear(says(owner, 0.0), 0.0)
    peer.hear(owner.due(0.0), 0.0)
    assert peer.bound() == [] and peer.due(0.0).answers[1] == Link(1, LinkMode.NONE, 0, 0)
    peer._geometry.agrees = True
    peer.committed(0.1)
    assert mode(peer) is LinkMode.CON and peer.due(0.1).answers[1] == Link(1, LinkMode.CON, 1, 1)


def test_a_plan_that_an_owner_builds_no_offer_on_is_told_again_a_few_times():
    owner, peer = robot(1), robot(2)

    def plan(now):
        message = says(peer, now)
        peer.told(message.sequence, now)
        return message

    owner.hear(plan(0.0), 0.0)
    # Nothing was agreed yet: nobody waits for the plan.
    assert not peer.tells_again(SOON)
    peer.hear(owner.due(SOON), SOON)
    assert peer.due(SOON) and not peer.has_due
    plan(0.25)
    assert peer.has_due and not peer.tells_again(0.25 + 0.9 * SOON)
    told = [peer.tells_again(0.25 + 1.01 * number * SOON) for number in range(1, 6)]
    assert told == [True] * (TIMES - 1) + [False] * (6 - TIMES)
    assert not peer.has_due
    heard = plan(0.5)
    owner.hear(heard, 0.5)
    peer.hear(owner.due(0.5), 0.5)
    assert not peer.tells_again(0.5 + 2 * SOON)


def test_where_nothing_gets_lost_nothing_is_said_again_soon():
    owner, peer = robot(1), robot(2)
    for each in owner, peer:
        each.expect_losses(False)
    owner.hear(says(peer, 0.0), 0.0)
    offered = owner.due(0.0)
    assert offered.offers and not owner.has_due and owner.due(0.9 * REPEAT) is None
    assert owner.due(1.01 * REPEAT).offers == offered.offers
    peer.hear(offered, 0.0)
    message = says(peer, 0.25)
    peer.told(message.sequence, 0.25)
    assert peer.due(0.25) and not peer.has_due and not peer.tells_again(1.0)
    peer.expect_losses(True)
    assert peer.has_due and peer.tells_again(0.25 + 1.01 * SOON)


def test_an_open_offer_is_said_again_soon_then_more_rarely_and_no_more_than_three_are_open():
    owner, peer = robot(1), robot(2)
    owner.hear(says(peer, 0.0), 0.0)
    first, last = owner.due(0.0).offers[0].contract.id, (TIMES - 1) * SOON
    for number in range(1, TIMES):
        assert owner.has_due and owner.due((number - 0.1) * SOON) is None
        assert owner.due(number * SOON).offers[0].contract.id == first
    assert not owner.has_due and owner.due(last + 0.9 * REPEAT) is None
    assert owner.due(last + REPEAT).offers[0].contract.id == first
    seen = []
    for cycle in range(1, 8):
        owner.hear(says(peer, float(cycle)), float(cycle))
        seen.append(owner.due(float(cycle)).offers[0].contract.id)
    assert seen == [2, 3, 3, 3, 3, 3, 3] and len(owner.bound()) == 3


def test_one_acknowledgement_stands_for_all_that_were_lost():
    owner, peer = robot(1), robot(2)
    for cycle in (1.0, 2.0, 3.0):
        owner.hear(says(peer, cycle), cycle)
        message = owner.due(cycle)
    peer.hear(says(owner, 2.0), 2.0)
    peer.hear(message, 2.0)
    answer = peer.due(2.0)
    assert owner.hear(answer, 2.0) and [contract.id for contract, _ in owner.bound()] == [3]
    assert not owner.hear(answer, 2.1)


def test_what_is_own_foreign_old_or_incomplete_is_ignored_and_counted():
    owner, peer = agreed()
    message = says(peer, 0.5)
    assert owner.hear(message, 0.5)
    before = owner.bound(), owner.links(0.5)
    bad = [message, replace(message, robot_id=1), replace(message, robot_id=9), replace(message, sequence=1),
           replace(message, boot_epoch=0, sequence=99), replace(message, plan=None, sequence=99),
           Contracts(9, 1, 99), Contracts(1, 1, 99), Contracts(2, 0, 99), Death(9, 1, (0, 0), 9.0),
           Death(2, 0, (0, 0), 9.0)]
    for count, each in enumerate(bad, 1):
        assert not owner.hear(each, 0.6)
        assert owner.ignored == count
    assert (owner.bound(), owner.links(0.5)) == before


def test_offers_and_answers_for_others_change_nothing():
    owner, peer = agreed()
    before = peer.bound(), peer.links(0.0)
    other = Contract(9, 0, [[1.0, 0.0]], [[0.0] * 4])
    for offer in (Offer(3, 1, 1, other), Offer(2, 7, 1, other)):
        assert not peer.hear(Contracts(1, 1, 50, [offer]), 0.0)
    assert not owner.hear(Contracts(2, 1, 50, [Offer(1, 1, 1, other)], {3: Link(1, LinkMode.CON, 9, 9)}), 0.0)
    assert not owner.hear(Contracts(2, 1, 50, [], {1: Link(4, LinkMode.CON, 1, 9)}), 0.0)
    assert (peer.bound(), peer.links(0.0)) == before


def test_a_peer_at_rest_departs_only_on_a_fresh_grant_and_one_that_moves_needs_none():
    owner, peer = agreed(lease=3.0)
    assert peer.may_move(2.9, True) and not peer.may_move(3.0, True) and peer.may_move(3.0, False)
    assert owner.may_move(100.0, True)
    # A grant that quotes an old message is an old one, whenever it arrives.
    peer.hear(says(owner, 9.0), 9.0)
    assert not peer.may_move(9.0, True)
    owner.hear(says(peer, 9.5), 9.5)
    peer.hear(says(owner, 9.6), 9.6)
    assert peer.may_move(12.4, True)


def test_a_silent_peer_seen_at_rest_for_a_whole_plan_becomes_a_disc_for_its_owner_alone():
    owner, peer = agreed(lease=3.0, rest_time=2.0)
    for now in np.arange(0, 5.2, 0.25):
        for one in (owner, peer):
            one.observe({3 - one.robot_id: (PLACES[3 - one.robot_id], 0.0)}, now)
    assert mode(owner) is LinkMode.CON
    for now in np.arange(5.25, 5.8, 0.25):
        for one in (owner, peer):
            one.observe({3 - one.robot_id: (PLACES[3 - one.robot_id], 0.0)}, now)
    assert mode(owner) is LinkMode.STATIC and mode(peer) is LinkMode.CON
    (place, radius), = owner.discs()
    assert place.tolist() == [2, 0] and radius == 0.2 and owner.bound() == []
    owner.committed(6.0)
    assert owner.due(6.0) is None
    owner.hear(says(peer, 6.1), 6.1)
    assert owner.due(6.1).offers and mode(owner) is LinkMode.STATIC


@pytest.mark.parametrize('disturb', ['it moves', 'it speaks', 'it is out of sight', 'nobody looks'])
def test_a_peer_is_no_disc_if_its_rest_is_not_seen_without_a_break(disturb):
    owner, peer = agreed(lease=3.0, rest_time=2.0)
    for now in np.arange(0, 6, 0.25):
        speed = 0.1 if disturb == 'it moves' and now == 5.0 else 0.0
        if disturb == 'it speaks' and now == 5.0:
            owner.hear(says(peer, now), now)
        if disturb == 'nobody looks' and 4.5 < now < 5.3:
            continue
        owner.observe({} if disturb == 'it is out of sight' and now == 5.0 else {2: (PLACES[2], speed)}, now)
    assert mode(owner) is LinkMode.CON


def test_a_restarted_robot_is_a_disc_until_it_has_agreed_anew():
    owner, peer = agreed()
    again = robot(2, epoch=2)
    assert owner.hear(says(again, 1.0), 1.0)
    assert mode(owner) is LinkMode.STATIC and owner.bound() == [] and owner.may_move(1.0, True)
    assert not owner.hear(says(peer, 1.0), 1.0), 'its former life is over'
    assert not again.may_move(1.0, True)
    again.hear(says(owner, 1.1), 1.1)
    again.hear(owner.due(1.1), 1.1)
    owner.hear(again.due(1.1), 1.1)
    assert mode(owner) is mode(again) is LinkMode.CON and owner.discs() == []


def test_a_restart_is_not_believed_of_a_robot_that_moves_or_stands_in_the_way():
    owner, _ = agreed()
    again = robot(2, epoch=2)
    assert not owner.hear(says(again, 1.0, moving=True), 1.0)
    owner._geometry.agrees = False
    assert not owner.hear(says(again, 1.0), 1.0)
    assert mode(owner) is LinkMode.CON and owner.ignored == 2


def test_two_robots_that_have_agreed_on_nothing_are_no_discs_for_each_other():
    one = robot(1)
    for epoch in (7, 8):
        two = robot(2, epoch=epoch)
        one.hear(says(two, 0.0), 0.0)
        two.hear(says(one, 0.0), 0.0)
        assert mode(one) is mode(two) is LinkMode.NONE


def test_an_offer_of_a_new_life_of_the_owner_is_taken_at_once():
    _, peer = agreed()
    again = robot(1, epoch=2)
    again.hear(says(peer, 1.0), 1.0)
    assert peer.hear(again.due(1.0), 1.0)
    assert mode(peer) is LinkMode.CON and peer.links(1.0)[1].epoch == 2 and not peer.may_move(1.0, True)


def test_who_is_switched_on_later_is_a_disc_at_its_dock_and_itself_waits():
    others, late = robot(1), robot(2)
    others.join((1, 2), {2: (PLACES[2], 0.3)})
    assert others.may_move(0.0, True) and others.discs()[0][1] == 0.3 and not late.may_move(0.0, True)
    others.hear(says(late, 1.0), 1.0)
    others.join((1, 2), {2: ((9.0, 9.0), 0.3)})
    assert mode(others) is LinkMode.STATIC and others.discs()[0][0].tolist() == [2, 0]


@pytest.mark.parametrize('death, is_believed', [
    (Death(2, 1, PLACES[2], 5.0), True), (Death(2, 7, PLACES[2], 5.0), True), (Death(2, 1, PLACES[2], 1.0), False)])
def test_a_certificate_counts_if_it_is_younger_than_the_own_boot(death, is_believed):
    owner, peer = agreed(born=1.0)
    assert owner.hear(death, 6.0) is is_believed and peer.hear(replace(death, robot_id=1), 6.0) is is_believed
    for one in (owner, peer):
        assert (mode(one) is LinkMode.STATIC) is is_believed
    if is_believed:
        assert not owner.hear(says(peer, 6.0), 6.0) and owner.due(6.0) is None
        assert not owner.hear(death, 7.0)


def test_a_certificate_needs_a_radius_a_free_place_and_no_newer_life():
    fresh = robot(1)
    assert not fresh.hear(Death(2, 1, PLACES[2], 5.0), 6.0)
    fresh._geometry.agrees = False
    assert not fresh.hear(Death(2, 1, PLACES[2], 5.0, radius=0.2), 6.0)
    fresh._geometry.agrees = True
    assert fresh.hear(Death(2, 1, PLACES[2], 5.0, radius=0.2), 6.0) and fresh.discs()[0][1] == 0.2
    owner, _ = agreed()
    owner.hear(says(robot(2, epoch=3), 1.0), 1.0)
    assert not owner.hear(Death(2, 2, PLACES[2], 5.0), 6.0)


def see(one, other, x, now):
    """Let two robots look, the second ``x`` [m] away from the first."""
    one.observe({other.robot_id: ((x, 0.0), 0.1)}, now, (0.0, 0.0))
    other.observe({one.robot_id: ((0.0, 0.0), 0.1)}, now, (x, 0.0))


def test_far_apart_a_contract_lapses_and_nearby_another_one_is_needed():
    owner, peer = robot(1, sensor_range=5.0), robot(2, sensor_range=5.0)
    see(owner, peer, 4.0, 0.0)
    for one, other in ((peer, owner), (owner, peer)):
        other.hear(says(one, 0.2), 0.2)
    peer.hear(owner.due(0.2), 0.2)
    owner.hear(peer.due(0.2), 0.2)
    peer.hear(says(owner, 0.2), 0.2)
    assert owner.may_move(0.2, False) and peer.may_move(0.2, False)
    see(owner, peer, 6.5, 0.4)
    assert mode(owner) is mode(peer) is LinkMode.CON and owner.may_move(0.4, False)
    see(owner, peer, 4.9, 0.6)
    assert not owner.may_move(0.6, False) and not peer.may_move(0.6, False), 'the other may have given it up'
    see(owner, peer, 7.1, 0.8)
    assert mode(owner) is mode(peer) is LinkMode.FAR and owner.bound() == peer.bound() == []
    assert owner.may_move(0.8, True) and peer.may_move(0.8, True)
    owner.committed(0.8)
    assert owner.due(0.8) is None, 'no offers that far'
    see(owner, peer, 4.9, 1.0)
    assert not owner.may_move(1.0, True) and not peer.may_move(1.0, True)
    owner.hear(says(peer, 1.1), 1.1)
    peer.hear(owner.due(1.1), 1.1)
    owner.hear(peer.due(1.1), 1.1)
    assert owner.may_move(1.1, False) and peer.may_move(1.1, False)


def test_whoever_has_heard_the_other_may_move_out_of_its_sight():
    one, two = robot(1, sensor_range=5.0), robot(2, sensor_range=5.0)
    see(one, two, 20.0, 0.0)
    assert not one.may_move(0.0, True)
    for _ in range(2):
        one.hear(says(two, 0.0), 0.0)
        two.hear(says(one, 0.0), 0.0)
    assert mode(one) is mode(two) is LinkMode.FAR and one.may_move(0.0, True) and two.may_move(0.0, True)


def test_with_a_sensor_nobody_moves_who_has_not_looked_or_sees_a_stranger():
    alone = robot(1, roster=[1], sensor_range=5.0)
    assert not alone.may_move(0.0, True)
    alone.observe({7: ((4.9, 0.0), 0.0)}, 1.0, (0.0, 0.0))
    assert not alone.may_move(1.0, True)
    alone.observe({7: ((5.1, 0.0), 0.0)}, 1.2, (0.0, 0.0))
    assert alone.may_move(1.2, True) and not alone.may_move(1.8, True)


@pytest.mark.parametrize('changed', [{'epoch': 0}, {'lease': 0.0}, {'rest_time': -1.0}, {'sensor_range': np.nan},
                                     {'margin': 0.0}, {'gap': -1.0}])
def test_a_protocol_that_makes_no_sense_is_refused(changed):
    with pytest.raises(InvalidInput):
        Protocol(1, changed.pop('epoch', 1), Yielding(), **changed)


def test_no_two_plans_ever_overlap_whatever_the_network_and_the_schedule_do():
    counts, least = protocol_adversary.run(120_000)
    assert least >= -1e-6
    for what in ('commits', 'departures', 'delivered', 'offers', 'conversions', 'lapses', 'kill', 'start', 'certify',
                 'cut', 'part'):
        assert counts[what] > 0, what


@pytest.mark.parametrize('sides', [
    {'OwnerSide': weak.DropsAllButTheAcknowledged}, {'OwnerSide': weak.BindsItselfWhenAcknowledged},
    {'PeerSide': weak.ForgetsItsPromise}, {'PeerSide': weak.NeedsNoLease}], ids=str)
def test_the_adversary_finds_what_is_wrong_with_weaker_rules(sides, monkeypatch):
    for name, side in sides.items():
        monkeypatch.setattr(home, name, side)
    # Links that mend themselves soon hide most of what is wrong.
    monkeypatch.setattr(repetition, 'SOON', REPEAT)
    with pytest.raises(protocol_adversary.Collision):
        protocol_adversary.run(200_000)
