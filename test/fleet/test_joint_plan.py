"""Joint plans: how a group becomes pebbles, and the order of their moves."""
from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from pebble_graphs import play

from mobile_planning import Boundary, Environment, PolygonObstacle
from mobile_planning.fleet import scenarios
from mobile_planning.fleet.joint_plan import GAP, Member, make_instance, plan_jointly
from mobile_planning.fleet.move_order import segments_apart
from mobile_planning.fleet.pebble_search import solve
from mobile_planning.fleet.roadmap import LONG_REACH, TIGHT, Roadmap
from mobile_planning.fleet.waiting import is_cut_off

RADIUS = 0.205


def box(x_min, y_min, x_max, y_max):
    return PolygonObstacle([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


@pytest.fixture(scope='module')
def doorway():
    """Two rooms, a wall and a door of 0.65 m."""
    walls = [box(-0.1, -2, 0.1, -0.325), box(-0.1, 0.325, 0.1, 2)]
    return Roadmap(Environment(Boundary((-2.5, 2.5), (-2, 2)), walls), RADIUS)


def crossing_members(rng, count):
    """Return members that start and end apart from each other, in any of the two rooms."""
    def places():
        found = []
        while len(found) < count:
            x = rng.uniform(0.5, 2.2) * rng.choice((-1, 1))
            place = np.array([x, rng.uniform(-1.7, 1.7)])
            if all(np.linalg.norm(place - other) > 0.6 for other in found):
                found.append(place)
        return found
    return [Member(start, goal, RADIUS) for start, goal in zip(places(), places())]


def segment_gap(a, b, c, d):
    """Return the least distance of two segments, by sampling."""
    shares = np.linspace(0, 1, 41)[:, None]
    return np.linalg.norm((a + shares * (b - a))[:, None] - (c + shares * (d - c))[None], axis=2).min()


@pytest.mark.parametrize('seed', range(8))
def test_any_order_of_execution_that_keeps_the_needs_leads_home_without_meeting(doorway, seed):
    rng = np.random.default_rng(seed)
    members = crossing_members(rng, 4)
    plan = plan_jointly(doorway, members, rng)
    assert plan.is_whole
    done = [0] * len(members)
    while any(count < len(way) - 1 for count, way in zip(done, plan.ways)):
        ready = [i for i, way in enumerate(plan.ways) if done[i] < len(way) - 1
                 and all(done[j] >= moves for j, moves in plan.needs[i][done[i]])]
        assert ready, 'the order is cyclic'
        # All that are released at once must be clear of each other, however fast each is, and of all who stand.
        for i, j in product(ready, range(len(members))):
            if i != j:
                other = plan.ways[j][done[j]:done[j] + (2 if j in ready else 1)]
                gap = segment_gap(*plan.ways[i][done[i]:done[i] + 2], other[0], other[-1])
                assert gap >= 2 * RADIUS + GAP - 1e-6
        done[rng.choice(ready)] += 1
    assert all(np.array_equal(way[-1], member.goal) for way, member in zip(plan.ways, members))


def test_a_horizon_cuts_the_ways_short(doorway):
    members = crossing_members(np.random.default_rng(3), 4)
    whole = plan_jointly(doorway, members, np.random.default_rng(0))
    short = plan_jointly(doorway, members, np.random.default_rng(0), horizon=2)
    assert whole.is_whole and not short.is_whole
    assert all(np.linalg.norm(np.diff(way, axis=0), axis=1).sum() <= 2 * LONG_REACH for way in short.ways)


def test_moves_are_short_so_that_nobody_waits_for_longer_than_it_must(doorway):
    plan = plan_jointly(doorway, crossing_members(np.random.default_rng(3), 4), np.random.default_rng(0))
    for way, needs in zip(plan.ways, plan.needs):
        assert len(needs) == len(way) - 1 and np.linalg.norm(np.diff(way, axis=0), axis=1).max() <= 0.3 + 1e-9


def test_a_robot_whose_goal_is_barred_stays(doorway):
    member = Member((-1.5, 0.0), (1.5, 0.0), RADIUS)
    assert np.allclose(plan_jointly(doorway, [member], np.random.default_rng(0)).ways[0][-1], (1.5, 0.0))
    barred = plan_jointly(doorway, [member], np.random.default_rng(0), standing=[((0.0, 0.0), RADIUS)])
    assert len(barred.ways[0]) == 1


@pytest.mark.parametrize('seed', range(12))
def test_who_can_pass_a_body_that_stands_near_the_door_is_led_past_it(doorway, seed):
    rng, body = np.random.default_rng(seed), np.zeros(2)
    while (doorway.environment.clearance(body) < RADIUS
           or is_cut_off((-2, 0), (2, 0), RADIUS, [(body, RADIUS)], doorway.environment)):
        body = rng.uniform((0.3, -0.7), (1.0, 0.7))
    members = [Member((-2.0, 0.0), (2.0, 0.0), RADIUS), Member((2.0, 1.2), (-2.0, 1.2), RADIUS)]
    plan = plan_jointly(doorway, members, rng, [(body, RADIUS)])
    assert plan.is_whole and all(np.array_equal(way[-1], member.goal) for way, member in zip(plan.ways, members))
    for way in plan.ways:
        assert min(segment_gap(a, b, body, body) for a, b in zip(way[:-1], way[1:])) >= 2 * RADIUS + TIGHT - 1e-6


def test_one_in_the_way_steps_aside_and_comes_back(doorway):
    idle = Member((0.0, 0.0), (0.0, 0.0), RADIUS)
    plan = plan_jointly(doorway, [idle, Member((-1.5, 0.0), (1.5, 0.0), RADIUS)], np.random.default_rng(0))
    assert plan.is_whole and len(plan.ways[0]) >= 3
    assert np.allclose(plan.ways[0][-1], (0.0, 0.0))


def test_robots_that_touch_can_leave_each_other(doorway):
    members = [Member((-1.0, 0.0), (-2.0, 1.0), RADIUS), Member((-1.0, 2 * RADIUS + 1e-4), (-2.0, -1.0), RADIUS)]
    assert plan_jointly(doorway, members, np.random.default_rng(0)).is_whole


def test_robots_that_touch_where_the_lattice_has_no_place_to_part_to_are_led_apart():
    # Found by a mission with loss: each could only go to places that are nearer to the other.
    forest = scenarios.make('forest', seed=10, robots=16).environment
    members = [Member((2.4442, -1.7750), (4.619, -4.847), 0.205), Member((2.3565, -2.1837), (4.633, -4.016), 0.205)]
    found = plan_jointly(Roadmap(forest, 0.205), members, np.random.default_rng(0))
    assert found.is_whole
    assert [way[-1].tolist() for way in found.ways] == [list(member.goal) for member in members]


def test_a_robot_that_touches_a_wall_can_leave_it(doorway):
    member = Member((-2.5 + RADIUS + 1e-4, 0.3), (1.5, 0.0), RADIUS)
    assert plan_jointly(doorway, [member], np.random.default_rng(0)).is_whole


def test_bodies_of_different_size_keep_the_distance_of_each_pair():
    roadmap = Roadmap(Environment(Boundary((0, 5), (0, 5))), 0.15, 0.4)
    members = [Member((1, 1), (4, 4), 0.4), Member((4, 4), (1, 1), 0.15), Member((1, 4), (4, 1), 0.4)]
    instance, _ = make_instance(roadmap, members)
    steps = solve(instance, [0.0] * 3, np.random.default_rng(0))
    assert steps.is_solved
    assert np.array_equal(play(instance, steps), instance.goals)
    assert len(instance.close) == 3


def test_the_same_generator_gives_the_same_plan(doorway):
    members = crossing_members(np.random.default_rng(5), 5)
    plans = [plan_jointly(doorway, members, np.random.default_rng(7)) for _ in range(2)]
    assert plans[0].needs == plans[1].needs
    assert all(np.array_equal(a, b) for a, b in zip(plans[0].ways, plans[1].ways))


@given(arrays(float, (2, 2, 2), elements=st.floats(-2, 2)))
def test_the_distance_of_segments_agrees_with_that_of_all_their_points(ends):
    gap = segments_apart(ends[:1], ends[1:])[0]
    sampled = segment_gap(*ends[0], *ends[1])
    # Nearest points lie at most half a sample from one that was tried, on both.
    off = np.linalg.norm(np.diff(ends, axis=1), axis=2).sum() / 80
    assert sampled - off - 1e-9 <= gap <= sampled + 1e-9
