"""Surroundings: the others as heard, against what their plans say, sampled."""
import numpy as np
import pytest
from missions import SWAP, exchange, robot
from mobile_planning.fleet.message import Death, LinkMode, Mode


def heard_by_a_third(seconds=2.0):
    """Return two robots that pass each other, and one that was switched on beside them, waits, and hears both."""
    robots = [robot(index + 1, *poses) for index, poses in enumerate(SWAP)] + [robot(3, (5, 1, 0), (5, 5, 0))]
    for agent in robots[:2]:
        agent.start([1, 2], 0.0)
    robots[2].join([1, 2, 3])
    for _ in exchange(robots, seconds):
        pass
    return robots


def test_neighbours_are_where_their_plans_are_and_as_fast():
    *others, third = heard_by_a_third()
    for knot in (17, 20, 40):
        neighbours = third._motion.surroundings.neighbours(knot)
        assert len(neighbours) == 2
        for other, neighbour in zip(others, neighbours):
            time, step = knot * other.plan.step, other.plan.step
            states = other.sol.states(np.array([time, time + 1e-6]))
            assert neighbour.position == pytest.approx(states[0, :2], abs=1e-9)
            assert neighbour.velocity == pytest.approx(np.diff(states[:, :2], axis=0)[0] / 1e-6, abs=1e-4)
            assert neighbour.end.tolist() == other.plan.end.tolist() and neighbour.goal.tolist() == [*other.goal[:2]]
            assert not neighbour.is_parked and step == 0.125


def test_one_that_was_stopped_is_parked_from_the_end_of_its_plan_on():
    robots = heard_by_a_third()
    robots[0].stop()
    for _ in exchange(robots, 0.5, since=2.0):
        pass
    end = robots[0].plan.end_knot
    parked = [robots[2]._motion.surroundings.neighbours(knot)[0].is_parked for knot in (end - 1, end, end + 5)]
    assert parked == [False, True, True]


def test_who_rests_unheard_is_a_neighbour_too_and_who_was_heard_there_is_not_one_twice():
    agent, other = robot(1, *SWAP[0]), robot(2, *SWAP[1])
    agent.join([1, 2, 3], {2: ((9.0, 3.0), 0.205), 3: ((5.0, 5.0), 0.3)})
    places = [neighbour.position.tolist() for neighbour in agent._motion.surroundings.neighbours(2)]
    assert sorted(places) == [[5.0, 5.0], [9.0, 3.0]]
    agent.receive(other.step(0.0)[0], 0.0)
    neighbours = agent._motion.surroundings.neighbours(2)
    assert sorted(each.position.tolist() for each in neighbours) == [[5.0, 5.0], [9.0, 3.0]]
    assert all(each.is_parked for each in neighbours), 'nobody of them moves before it has a contract'


def test_one_that_died_on_its_way_is_parked_where_it_lies():
    robots = heard_by_a_third()
    agent, dead = robots[0], robots[1]
    place, knot = dead.plan.end, 40
    assert dead.mode is Mode.DRIVING and not agent._motion.surroundings.neighbours(knot)[0].is_parked
    agent.receive(Death(dead.eyed, dead.protocol.epoch, place, issued=10.0, radius=dead.limits.radius), 10.0)
    assert agent.protocol.sides[dead.eyed].mode is LinkMode.STATIC
    lying, = agent._motion.surroundings.neighbours(knot)
    assert lying.is_parked and lying.position == pytest.approx(place) and lying.goal == pytest.approx(place)
