"""Tethers: two robots that keep to one are within its range at every instant, and they keep to it whatever happens."""
import numpy as np
import pytest
from curves import curve, walks
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from missions import exchange, robot
from staged import drive, rest, vehicle

from mobile_planning import Boundary, InvalidInput, RobotMsg, RoundObstacle
from mobile_planning.fleet import contracts
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import ROUNDING, Contract, build
from mobile_planning.fleet.faults import Faults, Kill
from mobile_planning.fleet.fences import of_contracts
from mobile_planning.fleet.invariant import Invariant
from mobile_planning.fleet.message import Contracts, Link, LinkMode, Offer
from mobile_planning.fleet.plan_distances import contract_room, curves, farthest_of_plans
from mobile_planning.fleet.protocol import Protocol
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.fleet.tether import SHARE, Tether, between

STEP = 0.25
plans = st.builds(lambda points, knot, x, y: Plan(knot, STEP, points + (x, y)), walks(8), st.integers(-3, 4),
                  st.floats(-2, 2), st.floats(-2, 2))


def farthest(one, other, first, last):
    """Return the greatest distance [m] of two plans, densely sampled by scipy, from one span to another."""
    times = np.linspace(first, last, 50 * (last - first) + 1) * STEP
    places = [curve(plan.points, STEP, plan.first_knot)(
        np.clip(times, plan.first_knot * STEP, plan.end_knot * STEP - 1e-12)) for plan in (one, other)]
    return float(np.linalg.norm(places[0] - places[1], axis=1).max())


@given(plans, plans, st.integers(0, 4), st.floats(0.5, 6.0))
def test_a_tether_exists_just_where_two_plans_are_in_range_and_each_then_keeps_to_it(one, other, wait, reach):
    first = max(one.first_knot, other.first_knot) + wait
    count = max(one.end_knot, other.end_knot, first + 1) - first
    tether = between(one, other, first, count, reach)
    most = farthest(one, other, first, first + count + 2)
    if tether is None:
        assert farthest_of_plans(one, other, first) > reach * SHARE
    else:
        assert most <= reach + 1e-9
        assert min(tether.room(plan, first, 0) for plan in (one, other)) >= -ROUNDING


@given(plans, plans, st.lists(st.tuples(*[st.floats(-2, 2)] * 8), min_size=1, max_size=4), st.floats(5.0, 12.0))
def test_two_plans_that_keep_to_any_one_tether_are_in_range_at_every_instant(one, other, middles, reach):
    tether, first = Tether(reach, np.reshape(middles, (-1, 4, 2))), max(one.first_knot, other.first_knot)
    last = max(one.end_knot, other.end_knot, first + len(middles))
    assume(min(tether.room(plan, first, 0) for plan in (one, other)) >= 0.0)
    assert farthest(one, other, first, last + 1) <= reach + 1e-9
    # The judge asks for the disc, in which the polygon lies.
    far = np.tile([0.0, 1.0], (len(middles), 1)), np.full((len(middles), 4), -50.0)
    assert contract_room(Contract(1, first, *far, tether), one, first, True, 0.2) >= -1e-9


@given(plans, plans, st.integers(0, 4))
def test_the_fences_of_a_tether_say_what_its_room_says(one, other, wait):
    first = max(one.first_knot, other.first_knot)
    tether = between(one, other, first, max(one.end_knot, other.end_knot, first + 1) - first, 12.0)
    contract = Contract(1, first, np.tile([0.0, 1.0], (len(tether.middles), 1)),
                        np.full((len(tether.middles), 4), -50.0), tether)
    since = first + wait
    count = max(one.end_knot, first + len(tether.middles), since + 1) - since + 1
    fences = of_contracts([(contract, True)], since, count, 0.2)
    assert fences.room(curves(one, since, count)).min() == pytest.approx(tether.room(one, since, wait), abs=1e-9)


@pytest.mark.parametrize('reach, middles, match', [
    (0.0, np.zeros((1, 4, 2)), 'reach'), (np.nan, np.zeros((1, 4, 2)), 'reach'), (1.0, np.zeros((0, 4, 2)), 'middles'),
    (1.0, np.zeros((1, 4)), 'middles'), (1.0, np.full((1, 4, 2), np.nan), 'finite'), ('far', [[]], 'numbers')])
def test_what_is_no_tether_is_refused(reach, middles, match):
    with pytest.raises(InvalidInput, match=match):
        Tether(reach, middles)
    with pytest.raises(InvalidInput, match='1 lines has 2'):
        Contract(1, 0, [[1.0, 0.0]], [[0.0] * 4], Tether(1.0, np.zeros((2, 4, 2))))


# The judge


def test_the_judge_names_plans_that_leave_their_range_and_a_range_that_is_given_up():
    here, there = drive((0, 1), (5, 1)), drive((0, -1), (5, -1))
    line, free = build(1, here, there, 0, 0.2, 0.2, 3.0), build(2, here, there, 0, 0.2, 0.2)
    pair = vehicle(1, here, [line]), vehicle(2, there, [line])
    invariant = Invariant(pair)
    invariant.check(pair[0], 0.0)
    assert not invariant.breaches
    pair[0].robot.plan = drive((0, 1), (9, 1))
    invariant.check(pair[0], 0.1)
    assert invariant.breaches[-1].what.startswith('they leave their range')
    pair[0].robot.plan = here
    pair[0].robot.protocol.contracts = [line, free]
    invariant.check(pair[0], 0.2)
    pair[1].robot.protocol.contracts = [free]
    invariant.check(pair[1], 0.3)
    assert invariant.breaches[-1].what.startswith('their range is given up')


def test_the_judge_sees_it_where_robots_drive_regardless_of_their_tether(monkeypatch):
    monkeypatch.setattr(contracts.Tether, 'sides', lambda self, span, count: (np.zeros((0, 2)), np.zeros((0, 4))))
    monkeypatch.setattr('mobile_planning.fleet.fences.SIDES', 0)
    report = forest(2.3, 1).world_sim().run(seed=1, timeout=8.0)
    assert any('range' in said for said in report.violations)


# The protocol


class Placed:
    """A geometry of plans on a stage."""

    def __init__(self, plan):
        self.plan, self.is_far = plan, False

    def is_ample(self, contract, heard):
        return False

    def accepts(self, contract, is_owner):
        return True

    def clear_of(self, place, radius):
        return True

    def offer(self, contract_id, heard, reach=np.inf):
        return None if self.is_far and reach < np.inf else build(contract_id, self.plan, heard.plan, 0, 0.2, 0.2, reach)


def test_an_owner_offers_a_tether_once_in_range_and_from_then_on_nothing_without_one():
    geometry = Placed(rest((0, 0)))
    owner = Protocol(1, 1, geometry, ranges={2: 3.0})
    owner.join([1, 2])

    def offered(sequence, contract):
        answer = Link(1, LinkMode.CON, contract, contract) if contract else Link(1)
        owner.hear(RobotMsg(False, [2.0], [0.0], (2.0, 0.0), robot_id=2, boot_epoch=1, sequence=sequence,
                            plan=rest((2, 0)), links={1: answer}), 0.1 * sequence)
        said = owner.due(0.1 * sequence)
        return [] if said is None else [(offer.contract.id, offer.contract.tether is not None) for offer in said.offers]
    geometry.is_far = True
    assert offered(1, 0) == [(1, False)]
    geometry.is_far = False
    assert offered(2, 1) == [(2, True)]
    geometry.is_far = True
    assert offered(30, 2) == []                         # out of range, so that nothing is on offer
    geometry.is_far = False
    assert offered(40, 2) == [(3, True)]


def test_a_peer_in_range_takes_no_offer_without_a_tether_but_from_a_new_life_of_the_owner():
    peer = Protocol(2, 1, Placed(rest((2, 0))))
    peer.join([1, 2])
    makes = {number: build(number, rest((0, 0)), rest((2, 0)), 0, 0.2, 0.2, reach)
             for number, reach in ((1, np.inf), (2, 3.0), (3, np.inf), (4, 3.0))}

    def holds(number, epoch=1):
        peer.hear(Contracts(1, epoch, number, (Offer(2, 1, 1, makes[number]),)), 0.1 * number)
        return peer.links(0.0)[1].contract
    assert [holds(number) for number in (1, 2, 3, 4, 3)] == [1, 2, 2, 4, 4]
    assert holds(3, epoch=2) == 3


# Missions


def forest(reach, seed, neighbours=((1, 2), (2, 3), (1, 3)), slow=2):
    """Return a scene of three robots, one of them slow, that cross a forest within range of each other."""
    rng, trees = np.random.default_rng(seed), []
    while len(trees) < 12:
        place, radius = rng.uniform((3, 0.5), (11, 6.5)), rng.uniform(0.2, 0.5)
        if all(np.linalg.norm(place - other) > radius + room + 0.6 for other, room in trees):
            trees.append((place, radius))
    robots = tuple(RobotSpec(i, (1.0, 1.5 + i, 0.0), (13.0, 1.5 + i, 0.0), u_max=(0.6 if i == slow else 1.0, 5.0))
                   for i in (1, 2, 3))
    return Scene('forest', robots, tuple(RoundObstacle(*tree) for tree in trees), Boundary((0, 14), (0, 7)),
                 neighbours=neighbours, com_range=reach)


def ranges(simulation, pairs, until):
    """Return the greatest distance [m] of each pair, by samples of what was driven."""
    times = np.arange(0.0, until, 0.2)
    states = {eyed: np.array([driven_at(solution, time) for time in times])
              for eyed, solution in simulation.solutions.items()}
    return [float(np.linalg.norm(states[one] - states[other], axis=1).max()) for one, other in pairs]


def driven_at(solution, time):
    plan = next((plan for plan in reversed(solution.plans) if plan.first_knot * plan.step <= time), solution.plans[0])
    return plan.state(time)[:2]


@pytest.mark.parametrize('seed, slow', [(1, 2), (3, 1)])
def test_three_robots_cross_a_forest_in_range_of_each_other_with_30_percent_loss(seed, slow):
    scene = forest(2.3, seed, slow=slow)
    simulation = scene.world_sim()
    report = simulation.run(seed=seed, loss=0.3, delay=0.2, timeout=60.0)
    assert report.arrived == 3 and report.valid, report.violations
    assert max(ranges(simulation, scene.neighbours, report.mission_time)) <= 2.3


def test_without_a_range_the_same_robots_part():
    free = forest(np.inf, 1, neighbours=()).world_sim()
    assert free.run(seed=1, timeout=30.0).arrived == 3
    assert max(ranges(free, [(1, 2)], 15.0)) > 4.0


def test_a_dead_neighbour_holds_the_others_until_its_death_is_certified():
    far = {}
    for is_certified, until in ((False, 16.0), (True, 26.0)):
        simulation = forest(2.3, 1).world_sim()
        report = simulation.run(seed=1, timeout=until, faults=Faults(kills=(Kill(2, 6.0, np.inf, is_certified),)))
        assert not report.violations
        far[is_certified], = ranges(simulation, [(1, 2)], until)
        assert report.arrived == (2 if is_certified else 0)
    assert far[False] <= 2.3 < far[True]


def test_a_neighbour_that_was_started_again_is_held_to_its_range_again():
    simulation = forest(3.0, 2).world_sim()
    report = simulation.run(seed=2, timeout=60.0, faults=Faults(kills=(Kill(2, 6.0, 2.0),)))
    assert report.arrived == 3 and report.valid
    bound = simulation.robots[1].protocol.bound()
    assert any(contract.tether is not None for contract, _ in bound)


def test_robots_out_of_range_drive_without_a_tether_until_they_are_within_it():
    agents = [robot(1, (1, 3, 0.0), (7, 3, 0.0), neigh=(2,), com_range=3.0),
              robot(2, (8, 2, 3.14), (5, 2, 3.14), neigh=(1,), com_range=3.0)]
    for agent in agents:
        agent.start([1, 2], 0.0)
    held = []
    for now, agent, _ in exchange(agents, 14.0):
        held.append(any(contract.tether is not None for contract, _ in agents[1].protocol.bound()))
        assert not held[-1] or np.linalg.norm(np.subtract(*(each.state(now)[:2] for each in agents))) <= 3.0
    assert not held[0] and held[-1] and held == sorted(held) and all(agent.is_done for agent in agents)


@pytest.mark.parametrize('options, match', [
    ({'neighbours': ((1, 4),)}, 'pairs of robots'), ({'neighbours': ((1, 1),)}, 'pairs of robots'),
    ({'neighbours': (7,)}, 'pairs of robots'), ({'neighbours': ()}, 'com_range needs'),
    ({'reach': np.inf}, 'need a com_range'), ({'reach': -1.0}, 'com_range'), ({'reach': 1.9}, '2.000 m apart')])
def test_neighbours_that_cannot_be_are_refused(options, match):
    with pytest.raises(InvalidInput, match=match):
        forest(**{'reach': 2.3, 'seed': 1, **options})


@settings(max_examples=10)
@given(st.floats(-1.0, 0.41))
def test_a_range_in_which_two_robots_have_no_room_is_refused(reach):
    with pytest.raises(InvalidInput, match='com_range'):
        robot(1, (1, 3, 0.0), (9, 3, 0.0), com_range=reach)


@pytest.mark.parametrize('method', ['contracts', 'receding_horizon'])
def test_a_scene_file_says_who_stays_with_whom(tmp_path, method):
    path = tmp_path / 'scene.yaml'
    listed = ''.join(f'  - {{id: {i}, start: [2, {2 * i}, 0], goal: [17, {2 * i}, 0]}}\n' for i in (1, 2, 3))
    path.write_text('boundary: {x: [0, 20], y: [0, 8]}\nneighbours: [[1, 2], [3, 2]]\ncom_range: 12.5\nrobots:\n'
                    + listed)
    robots = [load_scene(path).robot(i, method=method) for i in (1, 2, 3)]
    assert [one.neigh for one in robots] == [(2,), (1, 3), (2,)]
    assert {one.options.com_range for one in robots} == {12.5}
    assert load_scene(path, 2).neighbours == ((1, 2),) and load_scene(path, 1).com_range == np.inf
    path.write_text('boundary: {x: [0, 20], y: [0, 8]}\nneighbours: 2\nrobots: []')
    with pytest.raises(InvalidInput, match='neighbours'):
        load_scene(path)
