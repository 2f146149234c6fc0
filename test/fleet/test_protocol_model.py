"""No history of one link breaks safety, and every rule is needed: with one taken away some history does."""
import pytest
import weakened_sides as weak
from link_model import Model

from mobile_planning.fleet.message import LinkMode

SEEING = dict(is_seeing=True, do_rest=False, has_contract=True)


@pytest.mark.parametrize('bounds', [
    pytest.param(dict(offers=4), id='handshake'),
    pytest.param(dict(offers=2, epochs=(1, 3)), id='the peer restarts'),
    pytest.param(dict(offers=2, epochs=(2, 1)), id='the owner restarts'),
    pytest.param(dict(offers=1, epochs=(2, 2)), id='both restart'),
    pytest.param(dict(offers=1, ticks=2, departures=2), id='lease and conversion'),
    pytest.param(dict(offers=2, ticks=1), id='conversion and a new contract'),
    pytest.param(dict(offers=1, ticks=1, epochs=(1, 2)), id='conversion and the peer restarts'),
    pytest.param(dict(offers=1, ticks=1, epochs=(2, 1)), id='conversion and the owner restarts'),
    pytest.param(dict(offers=1, ticks=1, kills=(True, True)), id='both die'),
    pytest.param(dict(offers=1, ticks=1, epochs=(1, 2), kills=(False, True)), id='the peer dies and restarts'),
    pytest.param(dict(offers=1, ticks=6, **SEEING), id='a contract lapses'),
    pytest.param(dict(offers=2, ticks=3, zone=1, **SEEING), id='a contract lapses and another comes'),
    pytest.param(dict(offers=1, ticks=1, is_seeing=True, do_rest=False, zone=1), id='first contact')])
def test_no_history_within_the_bounds_breaks_safety(bounds):
    result = Model(**bounds).search()
    assert result.trace is None, '\n'.join(result.trace)
    assert result.is_complete


AWAY_AND_BACK = dict(offers=2, zone=2, path=(3, 2, 1, 0), **SEEING)
BACK_TO_REST = dict(offers=1, zone=3, path=(2, 1, 0), is_seeing=True, has_contract=True)
WEAKENED = {
    'the owner keeps only what is acknowledged': dict(owner=weak.DropsAllButTheAcknowledged, offers=4),
    'the owner is bound only once it is acknowledged': dict(owner=weak.BindsItselfWhenAcknowledged),
    'the peer takes what it promised not to': dict(peer=weak.ForgetsItsPromise, offers=3),
    'the peer takes an offer for its sequence or age': dict(does_test_own_plan=False),
    'no lease': dict(peer=weak.NeedsNoLease, offers=1, ticks=1),
    'both sides convert': dict(do_both_convert=True, offers=1, ticks=1),
    'no epochs': dict(owner=weak.OwnerWithoutEpochs, peer=weak.PeerWithoutEpochs, epochs=(2, 2)),
    'a restart is answered with a disc': dict(
        owner=weak.OwnerThatAnswersWithADisc, peer=weak.PeerThatAnswersWithADisc, offers=1, epochs=(2, 2)),
    'certificates of another life count': dict(
        owner=weak.OwnerWithOldCertificates, peer=weak.PeerWithOldCertificates, offers=1, ticks=1, epochs=(2, 2),
        kills=(True, True)),
    'a robot that joins assumes to be far': dict(
        is_seeing=True, offers=1, zone=1, path=(0,), start=(LinkMode.STATIC, LinkMode.FAR)),
    'no doubt': dict(owner=weak.OwnerWithoutDoubt, peer=weak.PeerWithoutDoubt, **AWAY_AND_BACK),
    'a gap is a lapse': dict(
        owner=weak.OwnerThatGivesUpAfterAGap, peer=weak.PeerThatGivesUpAfterAGap, offers=1, ticks=6, **SEEING),
    'a gap is overlooked': dict(
        owner=weak.OwnerThatOverlooksGaps, peer=weak.PeerThatOverlooksGaps, offers=1, ticks=6, **SEEING),
    'an offer from before a doubt is taken': dict(peer=weak.TakesOffersFromBefore, **AWAY_AND_BACK),
    'the owner trusts what is not acknowledged': dict(owner=weak.TrustsItsNewestContract, **AWAY_AND_BACK),
    'a disc never lapses': dict(owner=weak.TrustsADiscForEver, **BACK_TO_REST),
    'a peer is converted in doubt': dict(owner=weak.ConvertsInDoubt, **BACK_TO_REST),
}


@pytest.mark.parametrize('bounds', WEAKENED.values(), ids=WEAKENED)
def test_without_one_rule_some_history_breaks_safety(bounds):
    assert Model(**bounds).shortest(40_000).trace or Model(**bounds).search(100_000).trace
