"""The invariant: it lets pass what is safe, and names whatever is not, by geometry of its own."""
import pytest
from staged import Protocol, drive, plan_through, rest, vehicle, wall

from mobile_planning.fleet.invariant import Invariant
from mobile_planning.fleet.message import LinkMode


def broken(*vehicles, now=0.0):
    invariant = Invariant(vehicles)
    invariant.check(vehicles[0], now)
    return [breach.what for breach in invariant.breaches]


# What is safe


def test_a_contract_of_both_that_both_obey_is_safe():
    line = wall(0)
    assert not broken(vehicle(1, drive((0, 1), (5, 1)), [line]),
                      vehicle(2, drive((5, -1), (0, -1)), [line]))


def test_an_equal_contract_is_as_good_as_the_same_one():
    assert not broken(vehicle(1, drive((0, 1), (5, 1)), [wall(0)]),
                      vehicle(2, drive((5, -1), (0, -1)), [wall(0)]))


@pytest.mark.parametrize('who', ['without a link', 'dead', 'without a lease'])
def test_a_robot_locked_at_rest_is_safe_where_the_other_stays_clear_of_it(who):
    locked = vehicle(2, rest((2, -1)), links={} if who == 'without a link' else {1: LinkMode.CON},
                     is_free=who == 'dead', is_alive=who != 'dead')
    assert not broken(vehicle(1, drive((0, 0), (5, 0)), links={2: LinkMode.STATIC}), locked)


@pytest.mark.parametrize('modes', [(LinkMode.FAR, LinkMode.FAR), (LinkMode.FAR, LinkMode.CON),
                                   (LinkMode.STATIC, LinkMode.FAR)])
def test_two_robots_out_of_sight_whose_plans_do_not_meet_are_safe(modes):
    assert not broken(vehicle(1, drive((0, 0), (1, 0)), links={2: modes[0]}),
                      vehicle(2, drive((9, 0), (8, 0)), [wall(0)], {1: modes[1]}))


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
    what, = broken(*moving_pair([line], [line]))
    assert what.startswith(f'robot {robot} breaks the contract of both: 1, by 5.00e-02')


def test_two_moving_robots_with_different_contracts_are_named():
    what, = broken(*moving_pair([wall(0)], [wall(0, contract_id=2)]))
    assert what.startswith('no contract of both')
    what, = broken(*moving_pair([wall(0)], [wall(0.1)]))
    assert what.startswith('no contract of both')


def test_an_owner_that_dropped_the_contract_of_a_moving_peer_is_named():
    what, = broken(*moving_pair([], [wall(0)], (LinkMode.STATIC, LinkMode.CON)))
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
    what, = broken(vehicle(1, up, [late]), vehicle(2, down, [late]))
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
    low, high = moving_pair([line], [line])
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
