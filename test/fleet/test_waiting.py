"""Who has not arrived, and why: the report names the robots, whom they wait for, and who is cut off."""
import json
import math

import numpy as np
import pytest
from missions import SWAP, mission, robot
from mobile_planning import PolygonObstacle, RoundObstacle
from mobile_planning.fleet.channel import Cut
from mobile_planning.fleet.faults import Faults, Join, Kill
from mobile_planning.fleet.guidance import Guidance
from mobile_planning.fleet.joint_plan import Member, plan_jointly
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.neighbour import Neighbour
from mobile_planning.fleet.roadmap import Roadmap
from mobile_planning.fleet.robot import Robot
from mobile_planning.fleet.search_lattice import SearchLattice
from mobile_planning.fleet.waiting import is_cut_off
from mobile_planning.world.environment import Boundary, Environment

#: A door of 0.7 m in a wall through the middle of the room.
WALL = [PolygonObstacle([(4.9, y), (5.1, y), (5.1, y + 2.65), (4.9, y + 2.65)]) for y in (0.0, 3.35)]


def run(faults, robots=2, obstacles=(), timeout=25.0, **options):
    poses = [*SWAP, ((5, 1, 1.5), (5, 5, 1.5))][:robots]
    simulation = mission([robot(index + 1, *each, obstacles=obstacles, **options) for index, each in enumerate(poses)],
                         obstacles)
    return simulation, simulation.run(timeout=timeout, faults=faults)


def test_nobody_waits_when_all_have_arrived():
    _, report = run(Faults())
    assert report.valid and report.waiting == () and 'waiting' not in report.table()


def test_who_is_bound_to_a_dead_robot_says_so_and_whom():
    # Robot 2 took what robot 1 had offered, and nobody tells it of the death.
    _, report = run(Faults(kills=(Kill(1, 0.75),)))
    (waiting,) = report.waiting
    assert waiting.robot == 2 and waiting.bound_to_dead == (1,) and waiting.mode == 'driving'
    assert not waiting.is_cut_off and 1.0 < waiting.since < 12.0
    for words in ('robot 2, driving', 'contracts with robot 1, dead'):
        assert words in report.table()


def test_who_lacks_the_word_of_others_says_of_whom():
    _, report = run(Faults(interruptions=(Cut(1, 3, 0.0, 99.0), Cut(2, 3, 0.0, 99.0)),
                           joins=(Join(3, 0.5),)), robots=3, timeout=15.0)
    waiting = {each.robot: each for each in report.waiting}
    assert set(waiting[3].without_word_of) == {1, 2} and waiting[3].since == 0.0
    assert 'without word of robots 1, 2' in str(waiting[3])


def test_who_is_cut_off_by_the_dead_says_so():
    # Robot 1 dies where it has arrived, in the door, before robot 2 is switched on.
    simulation = mission([robot(1, (1, 3, 0.0), (5, 3, 0.0), obstacles=WALL), robot(2, *SWAP[1], obstacles=WALL)], WALL)
    faults = Faults(kills=(Kill(1, 8.0, is_certified=True),), joins=(Join(2, 9.0),))
    report = simulation.run(timeout=25.0, faults=faults)
    (waiting,) = report.waiting
    assert waiting.robot == 2 and waiting.is_cut_off and 'cut off from its goal by the dead' in str(waiting)
    assert report.violations == []


def past_a_body(room):
    """Return a corridor, and a body in it that leaves others ``room`` [m] more than they are wide."""
    corridor = Environment(Boundary((-4, 4), (-0.5, 0.5)))
    return corridor, (np.array((0.013, 0.5 - 3 * 0.205 - room)), 0.205)


@pytest.mark.parametrize('room', [0.0, 0.01, 0.02, 0.03, 0.036, 0.042, 0.05, 0.06])
def test_where_the_dead_leave_a_way_a_joint_plan_finds_it(room):
    corridor, body = past_a_body(room)
    member = Member((-2.5, 0.0), (2.5, 0.0), 0.205)
    ways = plan_jointly(Roadmap(corridor, 0.205), [member], np.random.default_rng(0), [body])
    leads_home = np.allclose(ways.ways[0][-1], member.goal)
    assert leads_home or is_cut_off(member.start, member.goal, member.radius, [body], corridor)
    if room <= 0.01:
        assert not leads_home
    if room >= 0.05:
        assert not is_cut_off(member.start, member.goal, member.radius, [body], corridor)


def test_a_robot_drives_past_the_dead_as_close_as_joint_plans_lead():
    corridor, body = past_a_body(0.034)
    member = Member((-2.5, 0.0), (2.5, 0.0), 0.205)
    own = Robot(1, UnicycleKineModel((-2.5, 0.0, 0.0), (2.5, 0.0, 0.0)), (), corridor.boundary, [2], rho=0.2)
    own.start([1, 2], 0.5, {2: body})
    assert own.limits.radius == pytest.approx(member.radius)
    now = 0.0
    while now < 25.0 and not own.is_done:
        own.observe({2: (body[0], 0.0)}, now)
        own.step(now)
        now += own.cycle
    assert own.is_done


def test_who_stands_close_to_the_dead_sees_the_first_move_of_its_joint_plan():
    room = Environment(Boundary((-2, 2), (-2, 2)))
    roadmap, rng = Roadmap(room, 0.205), np.random.default_rng(0)
    for _ in range(100):
        body, angles, gap = rng.uniform(-0.5, 0.5, 2), rng.uniform(0, 2 * np.pi, (2, 1)), rng.uniform(0.0, 0.01)
        start, goal = body + np.array([[0.41 + gap], [1.1]]) * np.column_stack([np.cos(angles), np.sin(angles)])
        (way,) = plan_jointly(roadmap, [Member(start, goal, 0.205)], rng, [(body, 0.205)]).ways
        drawn = Guidance(SearchLattice(room, 0.205), goal, 1.0).follow(
            way[:2], [start] * 8, 0.125, [Neighbour(body, body, body, 0.205, True)])
        assert np.allclose(way[-1], goal) and np.linalg.norm(drawn[-1] - start) > 0.02


def test_a_paused_robot_is_called_so_and_where():
    robots = [robot(1, *SWAP[0])]
    simulation = mission(robots)
    robots[0].pause(0.0)
    report = simulation.run(timeout=3.0)
    (waiting,) = report.waiting
    assert waiting.mode == 'paused' and waiting.place == pytest.approx((1.0, 3.0)) and waiting.since == 0.0


def test_the_report_with_those_who_wait_is_json():
    _, report = run(Faults(kills=(Kill(1, 0.75),)))
    said = json.loads(json.dumps(report.as_dict(), allow_nan=False))
    assert said['waiting'][0]['robot'] == 2 and said['waiting'][0]['bound_to_dead'] == [1]


LANE = Environment(Boundary((0, 8), (0, 0.6)))
ROOM = Environment(Boundary((0, 8), (0, 4)))


@pytest.mark.parametrize('world, place, goal, dead, expected', [
    (LANE, (1, 0.3), (7, 0.3), [], False), (LANE, (1, 0.3), (7, 0.3), [(4, 0.3)], True),
    (LANE, (1, 0.3), (3, 0.3), [(4, 0.3)], False), (LANE, (1, 0.3), (3.7, 0.3), [(4, 0.3)], True),
    (ROOM, (1, 2), (7, 2), [(4, 2)], False),
    (ROOM, (1, 2), (7, 2), [(4, y) for y in (0.3, 1.0, 1.7, 2.4, 3.1, 3.8)], True),
    (ROOM, (1, 2), (7, 2), [(4, y) for y in (0.3, 1.2, 1.7, 2.4, 3.1, 3.8)], False)])
def test_the_dead_cut_off_who_cannot_pass_them(world, place, goal, dead, expected):
    assert is_cut_off(place, goal, 0.2, [(each, 0.2) for each in dead], world) == expected


def test_dead_bodies_add_to_the_obstacles_there_are():
    world = Environment(Boundary((0, 8), (0, 4)), [RoundObstacle((4, 1.0), 1.0)])
    assert is_cut_off((1, 2), (7, 2), 0.2, [((4, 2.5), 0.3), ((4, 3.4), 0.3)], world)
    assert not is_cut_off((1, 2), (7, 2), 0.2, [((4, 2.5), 0.3)], world)
    assert math.isclose(world.clearance([(4, 4)])[0], 0.0)
