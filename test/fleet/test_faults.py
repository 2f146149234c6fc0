"""Faults: what is drawn is what the family says, and what makes no sense is refused."""
from itertools import combinations

import numpy as np
import pytest
from mobile_planning import InvalidInput
from mobile_planning.fleet.channel import Burst, Cut, Partition
from mobile_planning.fleet.faults import FaultKind, Faults, Join, Kill, SolveTime, draw_faults

IDS = [1, 2, 3, 5, 8]


@pytest.mark.parametrize('kind', FaultKind)
def test_one_seed_draws_the_same_faults_and_another_seed_others(kind):
    assert draw_faults(kind, IDS, 4) == draw_faults(kind.value, IDS, 4)
    assert len({draw_faults(kind, IDS, seed) for seed in range(8)}) > 1


@pytest.mark.parametrize('kind, interruptions, kills, joins', [
    ('none', 0, 0, 0), ('net', 4, 0, 0), ('death', 0, 1, 0), ('kill', 0, 1, 0), ('restart', 0, 1, 0),
    ('join', 0, 0, 1), ('storm', 6, 1, 1), ('all', 6, 2, 1)])
def test_a_family_draws_its_own_faults(kind, interruptions, kills, joins):
    faults = draw_faults(kind, IDS, 0)
    lasting = [each for each in faults.interruptions if not isinstance(each, Burst)]
    assert (len(lasting), len(faults.kills), len(faults.joins)) == (interruptions, kills, joins)
    faults.require_known(IDS)


@pytest.mark.parametrize('seed', range(20))
def test_all_at_once_hits_each_robot_at_most_once(seed):
    faults = draw_faults('all', IDS, seed)
    hit = [fault.robot for fault in (*faults.kills, *faults.joins)]
    assert len(set(hit)) == len(hit)
    assert sorted(np.isfinite(kill.restart_after) for kill in faults.kills) == [False, True]


@pytest.mark.parametrize('count', [1, 2])
def test_few_robots_get_as_many_faults_as_they_can_bear(count):
    faults = draw_faults('all', IDS[:count], 0)
    assert len(faults.kills) + len(faults.joins) == count
    assert bool(faults.interruptions) == (count > 1)


def test_whoever_dies_is_certified_and_in_a_storm_nobody_dies_for_good():
    for seed in range(20):
        assert draw_faults('death', IDS, seed).kills[0].is_certified
        assert all(np.isfinite(kill.restart_after) for kill in draw_faults('storm', IDS, seed).kills)


def test_a_storm_silences_radios_for_a_second_or_so_and_links_for_16_s():
    bursts = [each for seed in range(40) for each in draw_faults('storm', IDS, seed).interruptions
              if isinstance(each, Burst)]
    assert np.mean([each.until - each.since for each in bursts]) == pytest.approx(1.0, abs=0.1)
    # Of eight good seconds and a bad one, nine in 40 s make some four bursts and a half.
    assert len(bursts) / 40 / len(IDS) == pytest.approx(40 / 9, rel=0.1)
    long = [each for each in draw_faults('storm', IDS, 3).interruptions if each.until - each.since == pytest.approx(16)]
    assert {type(each) for each in long} == {Cut, Partition}


def test_half_of_those_that_die_for_good_are_certified():
    certified = [draw_faults('kill', IDS, seed).kills[0].is_certified for seed in range(200)]
    assert 0.4 < np.mean(certified) < 0.6


def test_solve_times_are_drawn_from_their_range_and_some_come_late():
    rng, solve = np.random.default_rng(0), SolveTime(0.01, 0.06, 0.1, 0.4)
    drawn = np.array([solve.draw(rng) for _ in range(2000)])
    assert np.mean(drawn == 0.4) == pytest.approx(0.1, abs=0.03)
    assert drawn.min() >= 0.01 and drawn[drawn != 0.4].max() <= 0.06


@pytest.mark.parametrize('faults', [
    Faults(kills=(Kill(4, 1.0),)), Faults(joins=(Join(4, 1.0),)), Faults(interruptions=(Cut(1, 4, 0.0, 1.0),)),
    Faults(interruptions=(Partition({4}, 0.0, 1.0),)), Faults(interruptions=(Burst(4, 0.0, 1.0),)),
    Faults(kills=(Kill(1, 1.0),), joins=(Join(1, 2.0),))])
def test_faults_of_robots_that_are_not_there_are_refused(faults):
    with pytest.raises(InvalidInput):
        faults.require_known([1, 2, 3])
    if not any(a.robot == b.robot for a, b in combinations((*faults.kills, *faults.joins), 2)):
        faults.require_known([1, 2, 3, 4])


@pytest.mark.parametrize('make', [
    lambda: Faults(skew=-1.0), lambda: Faults(skew=np.inf), lambda: Faults(radio_range=0.0),
    lambda: Kill(1, -1.0), lambda: Kill(1, 1.0, 0.0), lambda: Kill(1, np.inf), lambda: Join(1, 0.0),
    lambda: Join(1, np.inf), lambda: SolveTime(0.1, 0.05), lambda: SolveTime(late_share=1.5),
    lambda: SolveTime(late=np.inf), lambda: draw_faults('plague', IDS, 0), lambda: draw_faults('all', IDS, -1)])
def test_numbers_out_of_their_range_are_refused(make):
    with pytest.raises(InvalidInput):
        make()
