"""RobotMsg and Channel refuse what makes no sense."""
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mobile_planning import InvalidInput, RobotMsg
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.channel import Channel
from mobile_planning.fleet.message import MAX_LINKS, Link, Mode

PLAN = Plan.at_rest(3, 0.25, (1.0, 2.0, 0.0))
GOOD = RobotMsg(False, [1.0], [2.0], [1.0, 2.0], robot_id=1, plan=PLAN, proposal=PLAN, proposal_seq=4,
                links={2: Link(0, 5, 1)})


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
    ({'links': {i: Link(0, 0, 0) for i in range(MAX_LINKS + 1)}}, 'links'),
    ({'proposal': None}, 'proposal_seq'), ({'proposal_seq': 0}, 'proposal_seq'), ({'proposal_seq': -1}, 'proposal_seq'),
    ({'proposal': Plan.at_rest(3, 0.5, (1.0, 2.0, 0.0))}, 'step')])
def test_a_message_that_makes_no_sense_is_refused(changed, word):
    with pytest.raises(InvalidInput, match=word):
        replace(GOOD, **changed)


@pytest.mark.parametrize('changed, word', [
    ({'loss': -0.1}, 'loss'), ({'loss': 1.1}, 'loss'), ({'loss': np.nan}, 'loss'), ({'delay': -1.0}, 'delay'),
    ({'delay': np.inf}, 'delay'),
    ({'delay': np.nan}, 'delay'), ({'least': -0.1}, 'delay'), ({'least': np.nan}, 'delay')])
def test_a_channel_that_makes_no_sense_is_refused(changed, word):
    with pytest.raises(InvalidInput, match=word):
        Channel(**changed)


@given(st.floats(0, 1), st.floats(0, 2), st.integers(0, 2**32))
def test_a_channel_loses_its_share_and_keeps_its_delays(loss, delay, seed):
    channel, rng = Channel(loss, delay), np.random.default_rng(seed)
    times = [channel.travel_time(rng) for _ in range(400)]
    arrived = [time for time in times if time is not None]
    assert abs(len(arrived) / 400 - (1 - loss)) < 0.15
    assert all(channel.least <= time <= channel.least + delay for time in arrived)


def test_a_channel_without_loss_delivers_all_and_with_full_loss_nothing():
    rng = np.random.default_rng(0)
    assert all(Channel().travel_time(rng) == 0.002 for _ in range(100))
    assert all(Channel(loss=1.0).travel_time(rng) is None for _ in range(100))
