"""Robots that plan by the receding horizon: whole missions, what goes wrong in them, and the document's names."""
import inspect

import numpy as np
import pytest
from missions import ROOM, SWAP, mission, robot

from mobile_planning import Boundary, InvalidInput, Robot, RobotMsg, RoundObstacle, UnicycleKineModel, WorldSim
from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.channel import Partition
from mobile_planning.fleet.faults import Faults, Join, Kill
from mobile_planning.fleet.message import Mode
from mobile_planning.fleet.nonlinear import SOLVERS
from mobile_planning.fleet.scene import RobotSpec, Scene

HORIZON = {'method': 'receding_horizon'}
#: Two robots whose ways cross.
CROSS = [((1, 3, 0.0), (6, 3, 0.0)), ((4, 0.8, np.pi / 2), (4, 5, np.pi / 2))]


def pair(ways=CROSS, obstacles=(), **options):
    return mission([robot(index + 1, *poses, obstacles=obstacles, **HORIZON, **options)
                    for index, poses in enumerate(ways)], obstacles)


def nearest(solutions):
    """Return the least distance [m] between any two centres, by dense samples of the solutions alone."""
    t = np.linspace(-1.0, max(solution.end for solution in solutions.values()), 4000)
    places = [solution.states(t)[:, :2] for solution in solutions.values()]
    return min(np.linalg.norm(a - b, axis=1).min() for i, a in enumerate(places) for b in places[:i])


# Missions


@pytest.mark.parametrize('solver', SOLVERS)
def test_robots_of_the_document_s_defaults_cross_and_never_overlap(solver):
    simulation = pair(solver=solver)
    report = simulation.run(timeout=30.0)
    assert report.valid, report.table()
    assert nearest(simulation.solutions) >= 2 * 0.2


def test_a_robot_that_has_finished_is_kept_off_by_both_radii():
    # The first ends where the second has to pass.
    simulation = pair([((3, 3, 0.0), (4, 3, 0.0)), ((1, 2.7, 0.0), (7, 3, 0.0))])
    report = simulation.run(timeout=40.0)
    assert report.valid, report.table()
    assert nearest(simulation.solutions) >= 2 * 0.2


def test_one_seed_gives_one_mission_to_the_byte():
    def run():
        simulation = pair()
        simulation.run(3, 0.2, 0.1, timeout=15.0)
        return [plan.points.tobytes() for solution in simulation.solutions.values() for plan in solution.plans]
    assert run() == run()


@pytest.mark.parametrize('seed', range(3))
def test_on_a_network_that_loses_and_delays_robots_are_slow_and_safe(seed):
    simulation = pair()
    report = simulation.run(seed, loss=0.3, delay=0.2, timeout=40.0)
    assert report.violations == [] and report.arrived == 2, report.table()
    assert nearest(simulation.solutions) >= 2 * 0.2


def test_a_dead_robot_does_not_block_the_others():
    simulation = pair([((2, 3, 0.0), (8, 3, 0.0)), ((8, 4, np.pi), (2, 4, np.pi))])
    report = simulation.run(timeout=40.0, faults=Faults(kills=(Kill(2, 1.5),)))
    assert report.violations == [] and simulation.robots[1].is_done, report.table()
    assert not simulation.solutions[2].done and nearest(simulation.solutions) >= 2 * 0.2


@pytest.mark.parametrize('seed', range(2))
def test_a_network_that_is_parted_for_less_than_the_patience_does_no_harm(seed):
    simulation = pair()
    cut = Faults(interruptions=(Partition(frozenset([1]), 0.5 + seed, 6.5 + seed),), any_phase=True)
    report = simulation.run(seed, loss=0.3, timeout=40.0, faults=cut)
    assert report.valid, report.table()


def test_a_robot_that_restarts_arrives_too():
    simulation = pair()
    report = simulation.run(timeout=40.0, faults=Faults(kills=(Kill(2, 1.5, restart_after=2.0),)))
    assert report.valid, report.table()


def test_a_robot_that_is_switched_on_late_is_driven_around_until_then():
    simulation = pair([((1, 3, 0.0), (6, 3, 0.0)), ((3.5, 3.1, np.pi / 2), (3.5, 5, np.pi / 2))])
    report = simulation.run(timeout=40.0, faults=Faults(joins=(Join(2, 3.0),)))
    assert report.valid, report.table()


def test_nobody_waits_for_a_robot_that_never_comes():
    one = robot(1, *CROSS[0], **HORIZON, patience=2.0)
    one.start([1, 9], 0.0)
    for now in np.arange(0.0, 14.0, 0.25):
        one.step(now + 0.002)
    assert one.is_done


def test_a_robot_that_is_switched_on_late_waits_for_others_from_then_on():
    # On a network that loses all it hears nobody: what it waits for begins when it runs, not when it was made.
    one = robot(2, *CROSS[1], **HORIZON, patience=3.0)
    one.start([1, 2], 0.0)
    for now in np.arange(100.0, 102.9, 0.25):
        one.step(now + 0.002)
    assert len(one.sol.plans) == 1
    for now in np.arange(103.0, 106.0, 0.25):
        one.step(now + 0.002)
    assert len(one.sol.plans) > 1


def test_obstacles_are_seen_from_detec_rho_on_and_never_touched():
    obstacles = [RoundObstacle((5.0, 3.1), 0.5)]
    simulation = mission([robot(1, (1, 3, 0.0), (9, 3, 0.0), obstacles=obstacles, **HORIZON, detec_rho=3.0)], obstacles)
    report = simulation.run(timeout=40.0)
    assert report.valid, report.table()
    # Before the obstacle was seen nothing made the robot leave its line.
    states = simulation.solutions[1].states(np.linspace(0.0, simulation.solutions[1].end, 2000))
    unseen = states[:, 0] < 5.0 - 0.5 - 3.0
    assert np.abs(states[unseen, 1] - 3).max() < 0.02 < np.abs(states[:, 1] - 3).max()


@pytest.mark.parametrize('room', [1e-4, 3e-3])
@pytest.mark.parametrize('aside', [-0.4, 0.0, 0.4])
def test_a_robot_that_all_but_touches_an_obstacle_sets_out_along_it(room, aside):
    # The way leads straight through the obstacle, whose nearest point the robot faces.
    obstacle, away = RoundObstacle((4.0, 3.0), 0.5), np.array([np.cos(np.pi + aside), np.sin(np.pi + aside)])
    x, y = np.array([4.0, 3.0]) + (0.5 + 0.2 + 0.005 + room) * away
    simulation = pair([((x, y, aside), (6.5, 3, 0.0))], (obstacle,))
    report = simulation.run(timeout=30.0)
    assert report.valid, report.table()


def test_neighbours_stay_within_range_of_the_radio():
    # Alone, the first would be out of range before the second, which waits, sets out.
    ways = [((1, 2, 0.0), (17, 2, 0.0)), ((1, 4, 0.0), (17, 4, 0.0))]
    room = Boundary((0, 18), (0, 6))
    robots = [robot(1, *ways[0], boundary=room, neigh=[2], com_range=11.0, solver='osqp', **HORIZON),
              robot(2, *ways[1], boundary=room, neigh=[1], com_range=11.0, t_init=12.5, **HORIZON)]
    simulation = mission(robots, boundary=room)
    report = simulation.run(timeout=60.0)
    assert report.valid, report.table()
    t = np.linspace(0.0, 40.0, 4000)
    first, second = (solution.states(t)[:, :2] for solution in simulation.solutions.values())
    apart = np.linalg.norm(first - second, axis=1)
    assert 10.0 < apart.max() <= 11.0


def company(*ways, **options):
    """Return a mission of two that are to stay within 7 m of each other."""
    quick = {'com_range': 7.0, 'Tc': 0.5, 'Tp': 2.0, 'Td': 2.0, 'patience': 2.0, 'solver': 'active_set'}
    room = Boundary((0, 14), (0, 6))
    return mission([robot(index, *way, boundary=room, neigh=[3 - index], **HORIZON, **quick, **options)
                    for index, way in enumerate(ways, 1)], boundary=room)


def test_a_dead_neighbour_does_not_hold_its_neighbour_back():
    simulation = company(((1, 2, 0.0), (11, 2, 0.0)), ((1, 4, 0.0), (11, 4, 0.0)))
    report = simulation.run(timeout=40.0, faults=Faults(kills=(Kill(2, 1.0),)))
    assert report.violations == [] and simulation.robots[1].is_done, report.table()
    assert simulation.solutions[2].x[-1] < 11 - 7.0


def test_neighbours_that_start_out_of_range_drive_and_stay_in_range_once_there():
    simulation = company(((1, 2, 0.0), (7, 2, 0.0)), ((12, 4, np.pi), (8, 4, np.pi)))
    assert simulation.run(timeout=40.0).valid
    t = np.linspace(0.0, 20.0, 2000)
    one, other = (solution.states(t)[:, :2] for solution in simulation.solutions.values())
    in_range = np.linalg.norm(one - other, axis=1) <= 7.0
    assert not in_range[0] and in_range[-1] and (np.diff(in_range.astype(int)) >= 0).all()


def test_t_init_and_t_sup_say_when_a_robot_plans():
    late = mission([robot(1, *CROSS[0], **HORIZON, t_init=3.0)])
    assert late.run(timeout=20.0).valid
    assert late.solutions[1].plans[1].first_knot * 0.125 == pytest.approx(3.0)
    short = mission([robot(1, (1, 3, 0.0), (9, 3, 0.0), **HORIZON, t_sup=2.0)])
    report = short.run(timeout=20.0)
    assert report.arrived == 0 and report.violations == []
    assert short.solutions[1].plans[-1].first_knot * 0.125 == pytest.approx(2.0)


def test_whatever_a_solver_returns_nothing_unproved_is_driven(monkeypatch):
    from mobile_planning.fleet import nonlinear
    rng = np.random.default_rng(0)

    def garbage(program, start, *arguments):
        return nonlinear.Answer(start + rng.normal(0, 0.3, len(start)), 0.0, 1)
    monkeypatch.setattr(nonlinear, 'solve', garbage)
    simulation = pair(obstacles=[RoundObstacle((2.5, 3.0), 0.3)])
    report = simulation.run(timeout=15.0)
    assert report.violations == [], report.table()


# One mission, one method


def test_robots_of_different_methods_are_refused_in_one_mission():
    with pytest.raises(InvalidInput, match='1 by contracts, 2 by receding_horizon'):
        mission([robot(1, *SWAP[0]), robot(2, *SWAP[1], **HORIZON)])


def test_a_message_of_another_method_is_refused():
    horizon, contracts = robot(1, *SWAP[0], **HORIZON), robot(2, *SWAP[1])
    with pytest.raises(InvalidInput, match='robot 2 does not plan by receding_horizon'):
        horizon.receive(contracts.step(0.0)[0], 0.0)
    scene = Scene('m', (RobotSpec(1, (1, 1, 0), (2, 1, 0)), RobotSpec(2, (1, 3, 0), (2, 3, 0))), boundary=ROOM)
    agents = [Agent(scene, 1, 5, 0.0), Agent(scene, 2, 5, 0.0, **HORIZON)]
    for one in agents:
        one.follow(Announcement('m', State.STARTED, (1, 2), 0.0), 0.0)
    with pytest.raises(InvalidInput, match='by one method'):
        agents[0].receive(agents[1].step(lambda: 0.0)[0], 0.0)


def test_robots_with_other_knots_are_refused():
    slow, quick = robot(1, *SWAP[0], **HORIZON), robot(2, *SWAP[1], **HORIZON, Tc=0.6)
    with pytest.raises(InvalidInput, match='knots'):
        slow.receive(quick.step(0.0)[0], 0.0)


# The document's names


def test_the_document_s_signature_holds_in_its_order_and_with_its_defaults():
    from mobile_planning.fleet.horizon_robot import HorizonRobot
    said = {'N_s': 20, 'n_knots': 6, 't_init': 0.0, 't_sup': 1e10, 'Tc': 1.0, 'Tp': 3.0, 'Td': 3.0, 'rho': 0.2,
            'detec_rho': 3.0, 'com_range': 15.0, 'def_epsilon': 0.5, 'safe_epsilon': 0.1, 'ls_time_opt_scale': 1.0,
            'dist_opt_offset': 100.0, 'ls_min_dist': 0.5}
    names = list(inspect.signature(HorizonRobot).parameters)
    assert names[:20] == ['eyed', 'kine_model', 'obstacles', 'phy_boundary', 'neigh', *said]
    one = Robot(1, UnicycleKineModel((1, 1, 0), (2, 1, 0)), [], ROOM, [], 20, 6, method='receding_horizon')
    assert {name: getattr(one.options, name) for name in said if name != 'rho'} | {'rho': one.rho} == said


def test_a_script_as_the_document_has_it_runs():
    obstacles = [RoundObstacle((0.55, 1.91), 0.314), RoundObstacle((-0.08, 3.65), 0.325)]
    boundary = Boundary([-4.0, 4.0], [-2.0, 9.0])
    robots = []
    for eyed, (start, goal) in enumerate([((-0.05, 0.0, np.pi / 2), (0.1, 5.0, np.pi / 2)),
                                          ((0.6, 0.0, np.pi / 2), (-0.6, 5.0, np.pi / 2))]):
        one = Robot(eyed, UnicycleKineModel(start, goal, [0.0, 0.0], [0.0, 0.0], [1.0, 5.0], [2.0, 10.0]), obstacles,
                    boundary, [1 - eyed], N_s=14, n_knots=5, Tc=0.5, Tp=2.0, Td=2.0, def_epsilon=5.0, detec_rho=6.0,
                    method='receding_horizon')
        for name, value in (('acc', 1e-3), ('fs_maxit', 40), ('maxit', 15), ('ls_maxit', 20)):
            one.set_option(name, value)
        robots.append(one)
    simulation = WorldSim('0', robots, obstacles, boundary)
    assert simulation.run().valid
    for one in robots:
        assert one.eyed in (0, 1) and one.rho == 0.2 and one.k_mod.z_dim == 2 and one.planning_process is None
        assert len(one.ctime) == len(one.sections) > 5 and min(one.ctime) > 0
        assert one.rtime.shape == one.sol.x.shape == one.sol.y.shape == one.sol.theta.shape
        assert (one.sol.x[-1], one.sol.y[-1]) == pytest.approx(one.k_mod.z_final, abs=0.02)


def test_a_message_carries_the_seed_s_four_fields():
    one = robot(1, *SWAP[0], **HORIZON)
    one.start([1], 0.0)
    (message,) = one.step(-0.9)
    assert not message.done_planning and message.lz == pytest.approx((1, 3))
    assert len(message.ip_z1) == len(message.ip_z2) > 5 and message.ip_z1[-1] > 2.0
    assert message.method == 'receding_horizon' and message.joint.progress == {}
    bare = RobotMsg(True, [1.0, 2.0], [3.0, 4.0], [2.0, 4.0])
    assert bare.dp and bare.ip_z1.tolist() == [1, 2] and bare.ip_z2.tolist() == [3, 4] and bare.lz.tolist() == [2, 4]


@pytest.mark.parametrize('options, match', [
    ({'detec_rho': 1.0}, 'detec_rho'), ({'com_range': 5.0}, 'com_range'), ({'rho': 0.0}, 'rho'),
    ({'margin': -1.0}, 'margin'), ({'u_max': (1.0, 1.0)}, 'omega_max'),
    ({'Tc': 6.0, 'Td': 7.9, 'Tp': 7.9}, 'detec_rho'),
    ({'Tc': 6.0, 'Td': 7.9, 'Tp': 7.9, 'detec_rho': 50.0, 'com_range': 99.0}, 'omega_max'),
    ({'patience': 0.0}, 'patience'), ({'epoch': 0}, 'epoch'), ({'solver': 'newton'}, 'newton'), ({'N_s': 1}, 'N_s')])
def test_an_option_out_of_its_range_is_refused(options, match):
    with pytest.raises(InvalidInput, match=match):
        robot(1, *SWAP[0], **HORIZON, **options)


def test_what_is_no_option_is_refused():
    with pytest.raises(TypeError):
        robot(1, *SWAP[0], **HORIZON, budgett=1)
    with pytest.raises(InvalidInput, match='tolerance'):
        robot(1, *SWAP[0], **HORIZON).set_option('tolerance', 1e-3)
    with pytest.raises(InvalidInput, match='rest to rest'):
        Robot(1, UnicycleKineModel((1, 1, 0), (2, 1, 0), u_init=(1, 0)), [], ROOM, **HORIZON)


def test_a_scene_gives_accuracy_and_iterations_too_and_a_new_process_keeps_them():
    said = {'acc': 1e-3, 'fs_maxit': 41, 'maxit': 15, 'ls_maxit': 21}
    scene = Scene('m', (RobotSpec(1, (1, 1, 0), (2, 1, 0)),), boundary=ROOM, method='receding_horizon', horizon=said)
    one = scene.robot(1)
    one.set_option('maxit', 16)
    assert [getattr(each.options, name) for each in (one, one.restarted(2, 0.0)) for name in said] == [
        1e-3, 41, 16, 21] * 2


def test_a_goal_that_was_asked_for_is_a_copy():
    one = robot(1, *SWAP[0], **HORIZON)
    one.goal[0] = 5.0
    assert one.goal.tolist() == [9.0, 3.0, 0.0]


def test_a_robot_that_is_stopped_ends_its_plan_and_stays():
    one = robot(1, (1, 3, 0.0), (9, 3, 0.0), **HORIZON)
    one.start([1], 0.0)
    for now in np.arange(-1.0, 3.0, 0.25):
        one.step(now + 0.002)
    one.stop()
    plans = one.sol.plans
    for now in np.arange(3.0, 8.0, 0.25):
        one.step(now + 0.002)
    assert one.mode is Mode.STOPPED and one.sol.plans == plans and one.state(8.0)[3] == pytest.approx(0.0, abs=1e-9)
