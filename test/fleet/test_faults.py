"""Faults: what is drawn is what the family says, and what makes no sense is refused."""
from itertools import combinations

import numpy as np
import pytest
from mobile_planning import InvalidInput
from mobile_planning.fleet.channel import Cut, Partition
from mobile_planning.fleet.faults import FaultKind, Faults, Join, Kill, SolveTime, draw_faults

IDS = [1, 2, 3, 5, 8]


@pytest.mark.parametrize('kind', FaultKind)
def test_one_seed_draws_the_same_faults_and_another_seed_others(kind):
    assert draw_faults(kind, IDS, 4) == draw_faults(kind.value, IDS, 4)
    assert len({draw_faults(kind, IDS, seed) for seed in range(8)}) > 1


@pytest.mark.parametrize('kind, interruptions, kills, joins', [
    ('none', 0, 0, 0), ('net', 4, 0, 0), ('kill', 0, 1, 0), ('restart', 0, 1, 0), ('join', 0, 0, 1), ('all', 4, 2, 1)])
def test_a_family_draws_its_own_faults(kind, interruptions, kills, joins):
    faults = draw_faults(kind, IDS, 0)
    assert (len(faults.interruptions), len(faults.kills), len(faults.joins)) == (interruptions, kills, joins)
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
    assert len(faults.interruptions) == (4 if count > 1 else 0)


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
    Faults(interruptions=(Partition({4}, 0.0, 1.0),)), Faults(kills=(Kill(1, 1.0),), joins=(Join(1, 2.0),))])
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
