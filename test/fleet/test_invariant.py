"""The invariant: it lets pass what is safe, and names whatever is not, by geometry of its own."""
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.invariant import (
    Invariant, collisions, contract_room, curves, distance_of_plans, distance_of_point, hull_distance, positions,
    rest_knot)
from mobile_planning.fleet.link import Terms
from mobile_planning.fleet.message import Link, LinkMode
from mobile_planning.fleet.solution import Solution
from scipy.interpolate import BSpline
from shapely import MultiPoint, Point

STEP = 0.25
#: Range of everybody's presence sensor [m].
SIGHT = 7.0
# To the micrometre: shapely takes no length squared that underflows.
coordinates = st.floats(-5, 5).map(lambda value: round(value, 6))
four_points = st.lists(st.tuples(coordinates, coordinates), min_size=4, max_size=4).map(np.array)


def plan_through(*places, first_knot=0):
    """Return a plan with the control points ``places`` that rests at the last."""
    return Plan(first_knot, STEP, np.array([*places, *[places[-1]] * 3], float))


def drive(start, end, spans=8, first_knot=0):
    """Return a plan that rests at ``start`` for a moment, and goes straight to ``end``."""
    way = np.linspace(start, end, spans)
    return plan_through(start, start, *way, first_knot=first_knot)


def rest(place, first_knot=0):
    return Plan.at_rest(first_knot, STEP, np.array([*place, 0.0]))


class Protocol:
    """What a robot says that it is bound to."""

    def __init__(self, bound=(), links=(), is_free=True):
        self._bound, self._links, self.is_free = list(bound), dict(links), is_free
        self.terms = Terms(sensor_range=SIGHT)

    def bound(self):
        return list(self._bound)

    def links(self, now):
        return {peer: Link(1, mode) for peer, mode in self._links.items()}

    def may_move(self, now, at_rest):
        return self.is_free


def vehicle(eyed, plan, bound=(), links=(), is_free=True, is_alive=True):
    robot = SimpleNamespace(eyed=eyed, plan=plan, sensor_range=SIGHT, rho=0.195, limits=SimpleNamespace(radius=0.2),
                            protocol=Protocol(bound, links, is_free))
    return SimpleNamespace(eyed=eyed, robot=robot, is_alive=is_alive, clock=lambda now: now,
                           place=lambda now: positions([plan], np.array([now]))[0], solution=Solution(eyed, (plan,)))


def wall(height, contract_id=1, first_span=0, spans=12):
    """Return the contract whose owner stays above ``height`` [m], and its peer below."""
    return Contract(contract_id, first_span, np.tile([0.0, 1.0], (spans, 1)), np.full((spans, 4), float(height)))


def broken(*vehicles, now=0.0):
    invariant = Invariant(vehicles)
    invariant.check(vehicles[0], now)
    return [breach.what for breach in invariant.breaches]


# Geometry, against other people's


@given(four_points)
def test_the_distance_of_a_hull_is_shapely_s(points):
    assert hull_distance(points) == pytest.approx(MultiPoint(points).convex_hull.distance(Point(0, 0)), abs=1e-9)


def test_a_hull_around_the_origin_has_no_distance():
    square = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)], float)
    for order in ([0, 1, 2, 3], [0, 2, 1, 3], [3, 0, 2, 1]):
        assert hull_distance(square[order]) == 0.0


@given(st.lists(st.tuples(coordinates, coordinates), min_size=1, max_size=6), st.integers(-3, 3))
def test_positions_are_scipy_s(places, first_knot):
    plan = plan_through((0, 0), *places, first_knot=first_knot)
    times = np.linspace(first_knot * STEP, plan.end_knot * STEP, 50)
    spline = BSpline(np.arange(len(plan.points) + 4) - 3.0, plan.points, 3)
    # A plan of Bezier points is the same curve.
    assert positions([plan], times) == pytest.approx(spline(times / STEP - first_knot), abs=1e-9)


def test_a_body_drives_each_plan_until_the_next_one_begins():
    plans = [drive((0, 0), (4, 0)), rest((7, 7), first_knot=4), rest((9, 9), first_knot=6)]
    driven = positions(plans, np.array([0.0, 0.99, 1.0, 1.49, 1.5, 99.0]))
    assert driven[0] == pytest.approx((0, 0)) and 0 < driven[1, 0] < 2
    assert driven[2:].tolist() == [[7, 7], [7, 7], [9, 9], [9, 9]]


def test_before_its_first_knot_a_plan_stands_and_after_its_end_too():
    plan = drive((0, 0), (4, 0), first_knot=3)
    assert not curves(plan, 0, 3).any()
    assert (curves(plan, plan.end_knot, 2) == (4, 0)).all()


def test_a_plan_rests_from_the_knot_on_from_which_no_point_differs():
    assert rest_knot(rest((1, 2), 5)) == -np.inf
    plan = drive((0, 0), (4, 0), first_knot=2)
    times = np.linspace(0, 9, 901)
    still = positions([plan], times) == plan.end
    first = times[np.flatnonzero(~still.all(axis=1))[-1] + 1]
    assert rest_knot(plan) * STEP == pytest.approx(first, abs=0.02)


@given(st.integers(0, 2**32 - 1))
def test_distances_are_never_above_what_dense_samples_find(seed):
    rng = np.random.default_rng(seed)
    a, b = (plan_through(*np.cumsum(rng.normal(0, 0.5, (6, 2)), axis=0), first_knot=int(rng.integers(-2, 1)))
            for _ in range(2))
    times = np.linspace(0, 6, 601)
    apart = np.hypot(*(positions([a], times) - positions([b], times)).T)
    assert distance_of_plans(a, b, 0) <= apart.min() + 1e-9
    assert distance_of_point(a, b.end, 0) <= np.hypot(*(positions([a], times) - b.end).T).min() + 1e-9


def test_the_room_to_a_contract_is_what_is_left_beside_it():
    plan, line = drive((0, 1), (4, 1)), wall(0.5)
    assert contract_room(line, plan, 0, True, 0.2) == pytest.approx(0.3)
    assert contract_room(line, plan, 0, False, 0.2) == pytest.approx(-0.7)


def test_the_rest_counts_against_a_line_that_still_moves_and_against_the_last_one_for_ever():
    rising = Contract(1, 0, np.tile([0.0, 1.0], (20, 1)), np.repeat(np.arange(20.0), 4).reshape(20, 4))
    assert contract_room(rising, rest((0, 10)), 0, True, 0.0) == pytest.approx(-9.0)
    assert contract_room(rising, rest((0, 10)), 99, True, 0.0) == pytest.approx(-9.0)
    jump = Contract(1, 0, np.array([[0.0, 1.0]]), np.array([[0.0, 0.0, 0.0, 2.0]]))
    assert contract_room(jump, rest((0, 1)), 5, True, 0.0) == pytest.approx(-1.0)


def test_spans_that_are_past_and_those_before_a_contract_do_not_count():
    falling = Contract(1, 0, np.tile([0.0, 1.0], (5, 1)), np.repeat([9.0, 9, 0, 0, 0], 4).reshape(5, 4))
    assert contract_room(falling, rest((0, 1)), 2, True, 0.0) == pytest.approx(1.0)
    assert contract_room(falling, rest((0, 1)), 1, True, 0.0) == pytest.approx(-8.0)
    dive = plan_through((0, 5), (0, 5), (0, 5), (0, 5), (0, -5), (0, 5))
    assert contract_room(wall(0), dive, 0, True, 0.0) < 0 < contract_room(wall(0, first_span=8), dive, 0, True, 0.0)


# What is safe


def test_a_contract_of_both_that_both_obey_is_safe():
    line = wall(0)
    assert not broken(vehicle(1, drive((0, 1), (5, 1)), [(line, True)]),
                      vehicle(2, drive((5, -1), (0, -1)), [(line, False)]))


def test_an_equal_contract_is_as_good_as_the_same_one():
    assert not broken(vehicle(1, drive((0, 1), (5, 1)), [(wall(0), True)]),
                      vehicle(2, drive((5, -1), (0, -1)), [(wall(0), False)]))


@pytest.mark.parametrize('who', ['without a link', 'dead', 'without a lease'])
def test_a_robot_locked_at_rest_is_safe_where_the_other_stays_clear_of_it(who):
    locked = vehicle(2, rest((2, -1)), links={} if who == 'without a link' else {1: LinkMode.CON},
                     is_free=who == 'dead', is_alive=who != 'dead')
    assert not broken(vehicle(1, drive((0, 0), (5, 0)), links={2: LinkMode.STATIC}), locked)


@pytest.mark.parametrize('modes', [(LinkMode.FAR, LinkMode.FAR), (LinkMode.FAR, LinkMode.CON),
                                   (LinkMode.STATIC, LinkMode.FAR)])
def test_two_robots_out_of_sight_whose_plans_do_not_meet_are_safe(modes):
    assert not broken(vehicle(1, drive((0, 0), (1, 0)), links={2: modes[0]}),
                      vehicle(2, drive((9, 0), (8, 0)), [(wall(0), False)], {1: modes[1]}))


def test_two_robots_that_come_in_sight_and_may_not_set_out_are_safe():
    pair = (vehicle(1, drive((0, 0), (1, 0)), links={2: LinkMode.FAR}, is_free=False),
            vehicle(2, drive((4, 0), (3, 0)), links={1: LinkMode.FAR}, is_free=False))
    assert not broken(*pair)
    pair[1].robot.protocol.is_free = True
    assert broken(*pair)


# What is not


def moving_pair(owned=(), kept=(), modes=(LinkMode.CON, LinkMode.CON)):
    return (vehicle(1, drive((0, 1), (5, 1)), owned, {2: modes[0]}),
            vehicle(2, drive((5, -1), (0, -1)), kept, {1: modes[1]}))


@pytest.mark.parametrize('height, robot', [(0.85, 1), (-0.85, 2)])
def test_a_plan_that_breaks_the_contract_of_both_is_named(height, robot):
    line = wall(height)
    what, = broken(*moving_pair([(line, True)], [(line, False)]))
    assert what.startswith(f'robot {robot} breaks the contract of both: 1, by 5.00e-02')


def test_two_moving_robots_with_different_contracts_are_named():
    what, = broken(*moving_pair([(wall(0), True)], [(wall(0, contract_id=2), False)]))
    assert what.startswith('no contract of both')
    what, = broken(*moving_pair([(wall(0), True)], [(wall(0.1), False)]))
    assert what.startswith('no contract of both')


def test_an_owner_that_dropped_the_contract_of_a_moving_peer_is_named():
    what, = broken(*moving_pair([], [(wall(0), False)], (LinkMode.STATIC, LinkMode.CON)))
    assert what.endswith('STATIC and CON')


@pytest.mark.parametrize('modes', [(LinkMode.STATIC, LinkMode.FAR), (LinkMode.NONE, LinkMode.FAR),
                                   (LinkMode.STATIC, LinkMode.STATIC)])
def test_far_on_one_side_and_an_obstacle_on_the_other_is_named(modes):
    assert broken(*moving_pair(modes=modes))


def test_a_robot_locked_in_the_way_of_the_other_is_named():
    locked = vehicle(2, rest((2, 0.1)), is_free=False)
    what, = broken(vehicle(1, drive((0, 0), (5, 0)), links={2: LinkMode.STATIC}), locked)
    assert what.startswith('their plans in force collide')
    # The plans miss each other in time alone, for robot 1 comes to the place once the other one has left it.
    parting = vehicle(2, drive((3, 0), (9, 0)), links={1: LinkMode.NONE}, is_free=False)
    what, = broken(vehicle(1, drive((0, 0), (5, 0)), links={2: LinkMode.STATIC}), parting)
    assert what.startswith('no contract of both')


def test_a_robot_at_rest_that_may_set_out_is_not_locked():
    assert broken(vehicle(1, drive((0, 0), (5, 0)), links={2: LinkMode.STATIC}),
                  vehicle(2, rest((2, -1)), links={1: LinkMode.CON}, is_free=True))


def test_plans_that_collide_before_their_contract_begins_are_named():
    late = wall(0, first_span=20)
    up, down = plan_through((0, -1), (0, -1), (0, -1), (0, 1)), plan_through((0, 1), (0, 1), (0, 1), (0, -1))
    what, = broken(vehicle(1, up, [(late, True)]), vehicle(2, down, [(late, False)]))
    assert what.startswith('their plans in force collide')


def test_two_far_robots_whose_plans_collide_are_named():
    assert broken(vehicle(1, drive((0, 0), (5, 0)), links={2: LinkMode.FAR}),
                  vehicle(2, drive((5, 0), (0, 0)), links={1: LinkMode.FAR}))


def test_a_breach_says_when_and_between_whom_once():
    pair = moving_pair()
    invariant = Invariant(pair)
    for now in (1.25, 1.5, 1.75):
        invariant.check(pair[now == 1.5], now)
    breach, = invariant.breaches
    assert (breach.time, breach.robots, invariant.checks) == (1.25, (1, 2), 3)
    assert str(breach).startswith('robots 1 and 2 at 1.250 s: no contract of both')


def test_a_new_plan_or_a_new_bond_is_judged_anew():
    line = wall(0)
    low, high = moving_pair([(line, True)], [(line, False)])
    invariant = Invariant((low, high))
    invariant.check(low, 0.0)
    low.robot.plan = drive((0, 1), (5, -1))
    invariant.check(high, 0.1)
    assert not invariant.breaches                       # an event that touched the other
    invariant.check(low, 0.2)
    assert invariant.breaches[-1].what.startswith('robot 1 breaks')
    low.robot.plan = drive((0, 1), (5, 1))
    invariant.check(low, 0.3)
    high.robot.protocol = Protocol()
    invariant.check(high, 0.4)
    assert invariant.breaches[-1].what.startswith('no contract of both') and len(invariant.breaches) == 2


def test_a_lock_that_opens_is_noticed_though_plans_and_bonds_are_the_same():
    locked = vehicle(2, rest((2, -1)), links={1: LinkMode.CON}, is_free=False)
    invariant = Invariant((vehicle(1, drive((0, 0), (5, 0)), links={2: LinkMode.STATIC}), locked))
    invariant.check(locked, 0.0)
    locked.robot.protocol.is_free = True
    invariant.check(locked, 0.1)
    assert [breach.time for breach in invariant.breaches] == [0.1]


# The truth


def test_bodies_that_overlap_are_named_with_the_first_time():
    pair = vehicle(1, drive((0, 0), (4, 0), 16)), vehicle(2, drive((4, 0), (0, 0), 16))
    least, (breach,) = collisions(pair, 6.0)
    assert least < 0.1 and breach.robots == (1, 2) and breach.what.startswith('they collide')
    apart = np.hypot(*(positions([pair[0].robot.plan], np.array([breach.time]))
                       - positions([pair[1].robot.plan], np.array([breach.time])))[0])
    assert 0.3 < apart < 0.39


def test_clocks_that_are_off_make_a_collision_of_plans_that_miss():
    follower = vehicle(2, drive((-1, 0), (3, 0), 16))
    ahead = vehicle(1, drive((0, 0), (4, 0), 16))
    assert not collisions((ahead, follower), 9.0)[1]
    follower.clock = lambda now: now + 2.0
    assert collisions((ahead, follower), 9.0)[1]


def test_a_robot_alone_is_far_from_everybody():
    assert collisions((vehicle(1, rest((0, 0))),), 1.0) == (np.inf, [])
