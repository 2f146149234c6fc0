"""The world changes while robots drive: they go around, brake, wait, and say what they stand by."""
from dataclasses import replace

import numpy as np
import pytest

from mobile_planning.fleet.contracts import build
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.link import Held
from mobile_planning.fleet.message import LinkMode
from mobile_planning.fleet.robot import Robot
from mobile_planning.world.environment import Boundary, Environment
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

ROOM = Boundary((0, 10), (0, 4))
STEP = 0.125


def robot(eyed=1, start=(1, 2, 0), goal=(9, 2, 0), **options):
    """Return a robot in a free room."""
    return Robot(eyed, UnicycleKineModel(start, goal), [], ROOM, **options)


def drive(robots, begin, end, watch=lambda now: None):
    """Let robots talk and drive for a while [s]; return their places (N, T, 2) at each knot."""
    places = []
    for now in np.arange(begin, end, STEP):
        for rank, each in enumerate(robots):
            messages = each.step(now) if rank % 2 == round(now / STEP) % 2 else each.answers(now)
            for _ in range(5):
                for message in messages:
                    for other in robots:
                        if other is not each:
                            other.receive(message, now)
                messages = [message for other in robots if other is not each for message in other.answers(now)]
        places.append([each.state(now)[:2] for each in robots])
        watch(now)
    return np.array(places).transpose(1, 0, 2)


def wall_ahead(state, distance):
    """Return a wall across the room, so far [m] ahead of a robot that drives along x."""
    return PolygonObstacle([(state[0] + distance + x, y) for x, y in ((0, 0), (0.2, 0), (0.2, 4), (0, 4))])


def world(*obstacles):
    """Return the room with obstacles."""
    return Environment(ROOM, obstacles)


def started(**options):
    """Return a robot on its way at full speed, after 3 s."""
    one = robot(**options)
    one.start([1], 0.0)
    drive([one], 0.0, 3.0)
    assert one.state(3.0)[3] > 0.95
    return one


def room_of(places, obstacle):
    """Return the least room [m] between the body and an obstacle."""
    return float(obstacle.distance(places).min()) - 0.2


def test_an_obstacle_that_appears_on_the_way_is_driven_around():
    one = started()
    disc = RoundObstacle(one.state(3.0)[:2] + (2.5, 0.1), 0.5)
    one.enter(world(disc), 3.0)
    (places,) = drive([one], 3.0, 20.0)
    assert one.is_done and room_of(places, disc) >= 0.0 and one.world_trouble == ''


def test_one_that_appears_on_the_plan_in_force_is_braked_for_in_time():
    one = started()
    wall = wall_ahead(one.state(3.0), 1.3)
    assert one.plan.end[0] > one.state(3.0)[0] + 1.3
    one.enter(world(wall), 3.0)
    assert 'leads into what is occupied' in one.world_trouble
    (places,) = drive([one], 3.0, 12.0)
    assert room_of(places, wall) >= 0.0 and one.state(12.0)[3] < 1e-6 and not one.is_done
    assert 'no path' in one.world_trouble and one.broken == ()
    one.enter(world(), 12.0)
    drive([one], 12.0, 30.0)
    assert one.is_done and one.world_trouble == ''


def test_a_goal_that_becomes_occupied_is_said_and_waited_for():
    one = started()
    disc = RoundObstacle((9, 2), 0.3)
    one.enter(world(disc), 3.0)
    (places,) = drive([one], 3.0, 12.0)
    assert 'goal (9.000, 2.000)' in one.world_trouble and room_of(places, disc) >= 0.0
    assert one.state(12.0)[3] < 1e-6
    one.enter(world(), 12.0)
    drive([one], 12.0, 30.0)
    assert one.is_done


def test_another_goal_ends_the_trouble_with_the_one_before():
    one = started()
    disc = RoundObstacle((9, 2), 0.3)
    one.enter(world(disc), 3.0)
    assert 'goal (9.000, 2.000)' in one.world_trouble
    one.set_goal((8, 1, 0), 3.0)
    assert one.world_trouble == ''
    (places,) = drive([one], 3.0, 12.0)
    assert one.is_done and room_of(places, disc) >= 0.0


def test_a_map_may_change_as_well():
    one = started()
    cells = np.zeros((40, 100), np.int8)
    cells[:25, 60:62] = 100
    one.enter(Environment(ROOM, (), OccupancyGrid(cells, 0.1)), 3.0)
    (places,) = drive([one], 3.0, 25.0)
    assert one.is_done
    assert not (((np.abs(places[:, 0] - 6.1) < 0.1) & (places[:, 1] < 2.5)).any())


def test_an_obstacle_that_appears_on_the_robot_itself_keeps_it_where_it_is():
    one = robot()
    one.start([1], 0.0)
    one.enter(world(RoundObstacle((1.1, 2), 0.3)), 0.0)
    (places,) = drive([one], 0.0, 5.0)
    assert np.ptp(places, axis=0).max() < 1e-9 and one.world_trouble


def test_one_that_follows_closely_does_not_run_into_it():
    pair = [robot(1, (1.8, 2, 0), (9, 2, 0)), robot(2, (1.38, 2, 0), (8.5, 2, 0))]
    for each in pair:
        each.start([1, 2], 0.0)
    drive(pair, 0.0, 3.0)
    wall = wall_ahead(pair[0].state(3.0), 1.1)
    for each in pair:
        each.enter(world(wall), 3.0)
    places = drive(pair, 3.0, 10.0)
    assert all(room_of(each, wall) >= -1e-6 for each in places)
    assert np.linalg.norm(places[0] - places[1], axis=1).min() >= 0.4 and all(each.broken == () for each in pair)


def test_where_its_contract_would_drive_it_into_a_wall_it_brakes_against_it_and_says_with_whom_it_holds_no_more():
    one = started()
    # Robot 2 is to follow half a centimetre behind, so that any braking would break the contract.
    follower = replace(one.plan, points=one.plan.points - (2 * one.limits.radius + 0.005, 0.0))
    span = int(3.0 / STEP)
    contract = build(1, one.plan, follower, span, one.limits.radius, one.limits.radius)
    one.protocol.join([1, 2])
    side = one.protocol._sides[2]
    held = Held(contract, 3.0)
    one.protocol._sides[2] = replace(side, mode=LinkMode.CON, contracts=(held,), acknowledged=1, promised=1)
    wall = wall_ahead(one.state(3.0), 1.1)
    one.enter(world(wall), 3.0)
    said = set()
    (places,) = drive([one], 3.0, 8.0, watch=lambda now: said.add(one.broken))
    assert room_of(places, wall) >= -1e-6
    assert (2,) in said


@pytest.mark.parametrize('seed', range(4))
def test_four_robots_among_which_something_falls_touch_neither_it_nor_each_other(seed):
    rng = np.random.default_rng(seed)
    ends = [((1, 1, 0), (9, 3, 0)), ((9, 1, np.pi), (1, 3, 0)), ((1, 3, 0), (9, 1, 0)), ((9, 3, np.pi), (1, 1, 0))]
    fleet = [robot(eyed, *pair) for eyed, pair in enumerate(ends, 1)]
    for each in fleet:
        each.start([1, 2, 3, 4], 0.0)
    drive(fleet, 0.0, 4.0)
    # It falls where it hits nobody who can still brake.
    places = np.array([each.state(4.0)[:2] for each in fleet])
    disc = next(disc for disc in (RoundObstacle(rng.uniform((2, 1), (8, 3)), 0.3) for _ in range(1000))
                if disc.distance(places).min() > 1.0)
    for each in fleet:
        each.enter(world(disc), 4.0)
    places = drive(fleet, 4.0, 45.0)
    assert min(room_of(each, disc) for each in places) >= -1e-6
    apart = [np.linalg.norm(places[i] - places[j], axis=1).min() for i in range(4) for j in range(i)]
    assert min(apart) >= 0.4 and all(each.is_done for each in fleet)
