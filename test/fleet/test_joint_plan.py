"""Joint plans: pebbles against exhaustive search, refinement against brute force, and the order of moves."""
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning import Boundary, Environment, PolygonObstacle
from mobile_planning.fleet import pebbles
from mobile_planning.fleet.joint_plan import GAP, Member, make_instance, plan_jointly
from mobile_planning.fleet.pebble_refinement import refined
from mobile_planning.fleet.pebble_search import search, solve
from mobile_planning.fleet.pebbles import Instance
from mobile_planning.fleet.roadmap import LONG_REACH, Roadmap

RADIUS = 0.205


def box(x_min, y_min, x_max, y_max):
    return PolygonObstacle([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


@pytest.fixture(scope='module')
def doorway():
    """Two rooms, a wall and a door of 0.65 m."""
    walls = [box(-0.1, -2, 0.1, -0.325), box(-0.1, 0.325, 0.1, 2)]
    return Roadmap(Environment(Boundary((-2.5, 2.5), (-2, 2)), walls), RADIUS)


def graph_instance(edges, starts, goals):
    """Return an instance on a plain graph, where robots meet only at places, or face to face on an edge."""
    edges = np.array(edges, np.int64).reshape(-1, 2)
    count = int(max(edges.max(), *starts, *goals)) + 1
    to_go = np.full((len(goals), count), np.inf)
    for robot, goal in enumerate(goals):
        to_go[robot, goal] = 0.0
        for _ in range(count):
            for u, v in edges:
                to_go[robot, u] = min(to_go[robot, u], to_go[robot, v] + 1)
                to_go[robot, v] = min(to_go[robot, v], to_go[robot, u] + 1)
    swept = np.zeros((1, len(edges), count), bool)
    swept[0, np.arange(len(edges))[:, None], edges] = True
    return Instance(edges, np.ones(len(edges)), np.array(starts), np.array(goals),
                    np.ones((len(starts), len(edges)), bool), to_go, np.zeros((len(starts),) * 2, np.int64),
                    np.eye(count, dtype=bool)[None], swept)


def can_be_solved(instance):
    """Whether moves of one robot at a time lead from the starts to the goals, by looking at all configurations."""
    neighbours = {}
    for (u, v), e in zip(instance.edges.tolist(), range(len(instance.edges))):
        neighbours.setdefault(u, []).append((v, e))
        neighbours.setdefault(v, []).append((u, e))
    start, goal = tuple(instance.starts.tolist()), tuple(instance.goals.tolist())
    known, front = {start}, [start]
    while front:
        here = front.pop()
        if here == goal:
            return True
        for robot, place in enumerate(here):
            for v, e in neighbours.get(place, []):
                others = [w for other, w in enumerate(here) if other != robot]
                there = (*here[:robot], v, *here[robot + 1:])
                if there not in known and not any(instance.swept[0, e, w] or instance.close[0, v, w] for w in others):
                    known.add(there)
                    front.append(there)
    return False


def play(instance, steps):
    """Play all moves one at a time in the order of their ranks; fail if one meets a robot that stands."""
    here = instance.starts.copy()
    for t in range(len(steps.edges)):
        turn = pebbles.ranks(instance, steps, t)
        assert turn is not None
        for robot in np.argsort(turn, kind='stable'):
            e, v = steps.edges[t, robot], steps.places[t + 1, robot]
            if e < 0:
                assert v == here[robot]
                continue
            assert set(instance.edges[e]) == {here[robot], v} and instance.usable[robot, e]
            for other in range(instance.count):
                kind = instance.kinds[robot, other]
                assert other == robot or not instance.swept[kind, e, here[other]]
            here[robot] = v
    assert np.array_equal(here, steps.places[-1])
    return here


@st.composite
def small_instances(draw):
    places = draw(st.integers(3, 6))
    edges = [(draw(st.integers(0, v - 1)), v) for v in range(1, places)]
    edges += draw(st.lists(st.tuples(st.integers(0, places - 1), st.integers(0, places - 1)), max_size=2))
    edges = sorted({tuple(sorted(edge)) for edge in edges if edge[0] != edge[1]})
    robots = draw(st.integers(1, min(4, places)))
    starts, goals = (draw(st.permutations(range(places)))[:robots] for _ in range(2))
    return graph_instance(edges, starts, goals)


@settings(max_examples=150, deadline=None)
@given(small_instances(), st.integers(0, 3))
def test_lacam_solves_just_what_can_be_solved(instance, seed):
    rng = np.random.default_rng(seed)
    found = search(instance, np.zeros(instance.count), rng, 200_000)
    assert found.is_solved == can_be_solved(instance)
    here = play(instance, found)
    if found.is_solved:
        assert np.array_equal(here, instance.goals)


@settings(max_examples=60, deadline=None)
@given(small_instances(), st.integers(0, 3))
def test_refined_steps_are_no_worse_and_lead_home_too(instance, seed):
    rng = np.random.default_rng(seed)
    found = search(instance, np.zeros(instance.count), rng, 2000)
    better = refined(instance, found, rng, 20)
    if found.is_solved:
        assert np.array_equal(play(instance, better), instance.goals)
        costs = [sum(pebbles.cost(instance, edges) for edges in steps.edges.T) for steps in (found, better)]
        worst = [max(pebbles.cost(instance, edges) for edges in steps.edges.T) for steps in (found, better)]
        assert worst[1] + 0.5 * costs[1] / instance.count <= worst[0] + 0.5 * costs[0] / instance.count + 1e-6


def test_a_lone_robot_takes_the_shortest_way():
    instance = graph_instance([(0, 1), (1, 2), (2, 3), (0, 4), (4, 3)], [0], [3])
    rng = np.random.default_rng(0)
    steps = refined(instance, solve(instance, [0.0], rng), rng)
    assert steps.places[:, 0].tolist() == [0, 4, 3]


def test_two_swap_in_a_line_with_one_pocket():
    instance = graph_instance([(0, 1), (1, 2), (1, 3)], [0, 2], [2, 0])
    assert solve(instance, [0.0, 0.0], np.random.default_rng(0)).is_solved


def test_nobody_rotates_on_a_full_ring():
    instance = graph_instance([(0, 1), (1, 2), (2, 0)], [0, 1, 2], [1, 2, 0])
    assert not solve(instance, [0.0] * 3, np.random.default_rng(0)).is_solved


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


def test_one_in_the_way_steps_aside_and_comes_back(doorway):
    idle = Member((0.0, 0.0), (0.0, 0.0), RADIUS)
    plan = plan_jointly(doorway, [idle, Member((-1.5, 0.0), (1.5, 0.0), RADIUS)], np.random.default_rng(0))
    assert plan.is_whole and len(plan.ways[0]) >= 3
    assert np.allclose(plan.ways[0][-1], (0.0, 0.0))


def test_robots_that_touch_can_leave_each_other(doorway):
    members = [Member((-1.0, 0.0), (-2.0, 1.0), RADIUS), Member((-1.0, 2 * RADIUS + 1e-4), (-2.0, -1.0), RADIUS)]
    assert plan_jointly(doorway, members, np.random.default_rng(0)).is_whole


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
