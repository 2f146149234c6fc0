"""Messages refuse what makes no sense."""
from dataclasses import replace

import numpy as np
import pytest

from mobile_planning import InvalidInput, RobotMsg
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import MAX_LINKS, Contracts, Death, Link, LinkMode, Mode, Offer

PLAN = Plan.at_rest(3, 0.25, (1.0, 2.0, 0.0))
GOOD = RobotMsg(False, [1.0], [2.0], [1.0, 2.0], robot_id=1, plan=PLAN, links={2: Link(1, LinkMode.CON, 5, 6, 7)})
OFFER = Offer(2, 1, 4, Contract(1, 3, [[1.0, 0.0]], [[0.0] * 4]))


def test_the_seed_s_four_fields_alone_are_a_message():
    message = RobotMsg(True, [0.0, 1.0], [0.0, 2.0], [0.0, 0.0])
    assert message.done_planning is message.dp is True
    assert message.plan is None and message.mode is Mode.WAITING and message.links == {}
    assert message.ip_z1.tolist() == [0, 1] and message.ip_z2.tolist() == [0, 2] and message.lz.tolist() == [0, 0]


@pytest.mark.parametrize('changed, word', [
    ({'ip_z1': [np.nan]}, 'ip_z1'), ({'ip_z2': [np.inf]}, 'ip_z2'), ({'ip_z1': [[1.0]]}, 'ip_z1'),
    ({'ip_z1': [1.0, 2.0]}, 'intended_path_z1'), ({'ip_z1': 'path'}, 'ip_z1'), ({'lz': None}, 'lz'),
    ({'lz': [1.0]}, 'lz'), ({'lz': [1.0, np.nan]}, 'lz'), ({'goal': [1.0, 2.0, 3.0]}, 'goal'),
    ({'goal': [np.inf, 0.0]}, 'goal'), ({'radius': 0.0}, 'radius'), ({'radius': -1.0}, 'radius'),
    ({'radius': np.nan}, 'radius'), ({'radius': 101.0}, 'radius'), ({'v_max': 0.0}, 'v_max'),
    ({'v_max': np.inf}, 'v_max'), ({'omega_max': -5.0}, 'omega_max'), ({'a_max': np.nan}, 'a_max'),
    ({'sequence': -1}, 'sequence'), ({'boot_epoch': 1.5}, 'boot_epoch'), ({'robot_id': 2**70}, 'robot_id'),
    ({'links': {i: Link() for i in range(MAX_LINKS + 1)}}, 'links')])
def test_a_message_that_makes_no_sense_is_refused(changed, word):
    with pytest.raises(InvalidInput, match=word):
        replace(GOOD, **changed)


def test_a_link_says_nothing_unless_told():
    assert Link() == Link(0, LinkMode.NONE, 0, 0, -1)
    assert Link(mode=2).mode is LinkMode.CON


@pytest.mark.parametrize('changed, word', [
    ({'epoch': -1}, 'epoch'), ({'mode': 4}, 'mode'), ({'contract': -1}, 'contract'), ({'promised': 0.5}, 'promised'),
    ({'granted': -2}, 'granted'), ({'granted': None}, 'granted')])
def test_a_link_that_makes_no_sense_is_refused(changed, word):
    with pytest.raises(InvalidInput, match=word):
        Link(**changed)


@pytest.mark.parametrize('changed, word', [
    ({'peer_id': -1}, 'peer_id'), ({'peer_epoch': 'new'}, 'peer_epoch'), ({'base_sequence': -1}, 'base_sequence'),
    ({'contract': None}, 'contract')])
def test_an_offer_that_makes_no_sense_is_refused(changed, word):
    with pytest.raises(InvalidInput, match=word):
        replace(OFFER, **changed)


def test_contracts_hold_offers_and_answers_up_to_a_number():
    message = Contracts(1, 1, 9, [OFFER], {0: Link(1)})
    assert message.offers == (OFFER,) and message.answers[0].epoch == 1
    with pytest.raises(InvalidInput, match='offers'):
        replace(message, offers=[OFFER] * (MAX_LINKS + 1))
    with pytest.raises(InvalidInput, match='answers'):
        replace(message, answers={i: Link() for i in range(MAX_LINKS + 1)})
    with pytest.raises(InvalidInput, match='sequence'):
        replace(message, sequence=-1)


@pytest.mark.parametrize('changed, word', [
    ({'place': (0.0, np.nan)}, 'place'), ({'place': (0.0,)}, 'place'), ({'issued': np.inf}, 'issued'),
    ({'radius': 0.0}, 'radius'), ({'radius': np.nan}, 'radius'), ({'robot_id': -1}, 'robot_id')])
def test_a_certificate_that_makes_no_sense_is_refused(changed, word):
    with pytest.raises(InvalidInput, match=word):
        replace(Death(1, 1, (0.0, 0.0), 5.0), **changed)
