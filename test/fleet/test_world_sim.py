"""Whole missions in logical time: repeatable, valid on any network, and safe whatever a robot fails to do."""
import json
from pathlib import Path

import numpy as np
import pytest
from missions import ROOM, SWAP, exchange, mission, robot, swap
from mobile_planning import Boundary, InvalidInput, Robot, RoundObstacle, UnicycleKineModel, WorldSim
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.channel import Cut, Partition
from mobile_planning.fleet.contract_robot import ContractRobot
from mobile_planning.fleet.faults import FaultKind, Faults, Join, Kill, SolveTime, draw_faults
from mobile_planning.fleet.scene_file import load_scene

SCENES = sorted((Path(__file__).parents[2] / 'config' / 'fleets').glob('*.yaml'))
CORNERS = [((1, 1, 0.8), (9, 5, 0.5)), ((9, 5, -2.4), (1, 1, -2.4)), ((9, 1, 2.4), (1, 5, 2.4)),
           ((1, 5, -0.8), (9, 1, -0.8))]


def nearest(solutions, radii):
    """Return the least room [m] between any two bodies, by dense samples of the solutions alone."""
    end = max(solution.end for solution in solutions.values())
    t = np.linspace(0, end, int(end * 500) + 1)
    places = {eyed: solution.states(t)[:, :2] for eyed, solution in solutions.items()}
    return min(np.linalg.norm(places[a] - places[b], axis=1).min() - radii[a] - radii[b]
               for a in places for b in places if a < b)


# The same to the byte


def bytes_of(simulation, report):
    plans = [(plan.first_knot, plan.points.tobytes(), plan.heading) for solution in simulation.solutions.values()
             for plan in solution.plans]
    # How long the sections took to plan on this machine is no part of the mission.
    said = {key: value for key, value in report.as_dict().items() if key != 'section_times'}
    return json.dumps(said), plans, simulation.episode.events, simulation.episode.message_bytes


def run_swap(**channel):
    simulation = swap()
    return bytes_of(simulation, simulation.run(**channel))


def test_one_seed_gives_one_mission_to_the_byte():
    assert run_swap(seed=5, loss=0.2, delay=0.2) == run_swap(seed=5, loss=0.2, delay=0.2)


def test_one_seed_gives_one_mission_to_the_byte_whatever_goes_wrong():
    def run(seed):
        simulation = crowd()
        return bytes_of(simulation, simulation.run(seed, 0.3, 0.3, 15.0, faults=draw_faults('all', range(1, 5), seed)))
    assert run(3) == run(3) != run(4)


def test_watching_changes_nothing():
    assert run_swap(seed=5, delay=0.2, check=False) == run_swap(seed=5, delay=0.2)


def test_another_seed_gives_another_mission():
    assert run_swap(seed=5, loss=0.2, delay=0.2) != run_swap(seed=6, loss=0.2, delay=0.2)


# Scenes and networks


@pytest.mark.parametrize('path', SCENES, ids=lambda path: path.stem)
def test_a_shipped_scene_loads_its_robots_fit_in_and_its_mission_is_valid(path):
    scene = load_scene(path)
    assert scene.name == path.stem and len(scene.robots) >= 2
    simulation = scene.world_sim()
    assert list(simulation.robots) == [spec.id for spec in scene.robots] == [body.eyed for body in scene.bodies()]
    assert scene.environment().bounds == simulation.environment.bounds
    report = simulation.run(timeout=scene.timeout, errands=scene.errands())
    assert report.valid, report.table()
    assert report.arrived == report.robots == len(scene.robots) and report.mission_time < scene.timeout
    assert report.arrivals == report.goals >= report.robots


@pytest.mark.parametrize('seed', range(6))
def test_robots_swap_places_on_a_network_that_loses_and_delays(seed):
    simulation = swap()
    report = simulation.run(seed, loss=0.3, delay=0.3)
    assert report.valid, report.table()
    assert nearest(simulation.solutions, {1: 0.2, 2: 0.2}) >= 0


@pytest.mark.parametrize('seed', range(4))
def test_four_robots_meet_on_a_network_that_loses_and_delays(seed):
    simulation = crowd()
    report = simulation.run(seed, loss=0.3, delay=0.3)
    assert report.violations == [] and report.arrived == 4, report.table()
    assert nearest(simulation.solutions, dict.fromkeys(range(1, 5), 0.2)) >= 0


def test_on_a_network_that_loses_everything_nobody_moves():
    report = swap().run(loss=1.0, timeout=10.0)
    assert not report.valid and report.arrived == 0 and report.violations == []
    assert report.min_separation == pytest.approx(8.0)


@pytest.mark.parametrize('seed', range(3))
def test_with_delays_of_a_second_robots_are_slow_and_safe(seed):
    simulation = swap()
    report = simulation.run(seed, loss=0.1, delay=1.0, timeout=40.0)
    assert report.violations == [] and nearest(simulation.solutions, {1: 0.2, 2: 0.2}) >= 0


def test_robots_of_different_sizes_and_limits_pass_each_other():
    simulation = mission([robot(1, *SWAP[0], rho=0.5, u_max=(0.5, 1.0), a_max=(0.5, 5.0)),
                          robot(2, *SWAP[1], rho=0.1, u_max=(1.5, 5.0), a_max=(3.0, 10.0), margin=0.02)])
    report = simulation.run(timeout=90.0)
    assert report.valid, report.table()
    assert report.min_separation >= 0.6 and nearest(simulation.solutions, {1: 0.5, 2: 0.1}) >= 0


def test_a_neighbour_that_is_not_of_the_mission_is_refused():
    with pytest.raises(InvalidInput, match='not 7, in whose range robot 1'):
        mission([robot(1, *SWAP[0], neigh=[7, 2]), robot(2, *SWAP[1])])


def test_a_robot_alone_needs_no_network():
    report = mission([robot(1, *SWAP[0])]).run(loss=1.0)
    assert report.valid and report.min_separation == np.inf


def test_without_messages_in_time_plans_start_later():
    # Everything takes longer than the first proposals look ahead; they learn to look further.
    report = swap().run(delay=0.6, timeout=60.0)
    assert report.violations == [] and report.arrived == 2, report.table()


@pytest.mark.parametrize('since', [1.8e9, 123456.75])
def test_a_mission_in_seconds_since_1970_is_the_same_mission(since):
    early, late = swap(), swap(start_time=since)
    reports = early.run(3, delay=0.1), late.run(3, delay=0.1, start_time=since)
    assert all(report.valid for report in reports)
    assert reports[0].mission_time == pytest.approx(reports[1].mission_time, abs=1e-6)
    assert reports[0].min_separation == pytest.approx(reports[1].min_separation, abs=1e-6)
    for eyed, solution in early.solutions.items():
        assert all((before.points == after.points).all()
                   for before, after in zip(solution.plans, late.solutions[eyed].plans))


@pytest.mark.parametrize('Tc', [0.1, 0.3])
def test_knots_that_are_no_round_numbers_do_no_harm_since_1970(Tc):
    report = swap(start_time=1.8e9, Tc=Tc).run(1, loss=0.1, delay=0.1, start_time=1.8e9 + 0.123)
    assert report.valid, report.table()


# What goes wrong


def crowd(**options):
    """Return four robots that meet around a pillar."""
    pillar = [RoundObstacle((5, 3), 0.4)]
    return mission([robot(index + 1, *poses, obstacles=pillar, **options) for index, poses in enumerate(CORNERS)],
                   pillar)


@pytest.mark.parametrize('kind', FaultKind)
@pytest.mark.parametrize('seed', range(3))
def test_whatever_goes_wrong_nothing_breaks(kind, seed):
    simulation = crowd(margin=0.01)
    faults = draw_faults(kind, list(simulation.robots), seed, skew=0.005)
    report = simulation.run(seed, loss=0.3, delay=0.3, timeout=20.0, faults=faults)
    assert report.violations == [] and simulation.breaches == [] and simulation.episode.checks > 1000
    assert nearest(simulation.solutions, dict.fromkeys(range(1, 5), 0.2)) >= 0


@pytest.mark.parametrize('kind', ['net', 'restart', 'join', 'storm'])
def test_robots_arrive_after_cuts_and_after_a_restart_and_when_one_joins_late(kind):
    simulation = crowd(margin=0.01)
    faults = draw_faults(kind, list(simulation.robots), 0, skew=0.005)
    report = simulation.run(0, loss=0.1, delay=0.1, faults=faults)
    assert report.violations == [] and report.arrived == 4, report.table()


@pytest.mark.parametrize('seed', range(3))
def test_when_one_robot_has_died_and_that_is_certified_all_others_arrive(seed):
    simulation = crowd()
    report = simulation.run(seed, loss=0.1, faults=draw_faults('death', list(simulation.robots), seed))
    assert report.violations == [] and report.arrived >= 3 and report.dead == 1, report.table()


FALLING_SILENT = {
    'from the beginning': Faults(joins=(Join(1, 99.0),)),
    'on its way': Faults(kills=(Kill(1, 4.0),)),
    'and hears everything': Faults(interruptions=(Cut(1, 2, 0.0, 99.0), Cut(1, 3, 0.0, 99.0))),
    'and hears nothing': Faults(interruptions=(Partition({1}, 0.0, 99.0),)),
    'and hears nothing from 4 s on': Faults(interruptions=(Partition({1}, 4.0, 99.0),))}


@pytest.mark.parametrize('faults', FALLING_SILENT.values(), ids=FALLING_SILENT)
@pytest.mark.parametrize('seed', range(2))
def test_a_robot_that_falls_silent_harms_nobody(faults, seed):
    robots = [robot(1, *SWAP[0]), robot(2, *SWAP[1]), robot(3, (5, 1, 1.5), (5, 5, 1.5))]
    simulation = mission(robots)
    report = simulation.run(seed, loss=0.2, delay=0.2, timeout=15.0, faults=faults)
    assert report.violations == [] and simulation.breaches == []
    assert nearest(simulation.solutions, dict.fromkeys((1, 2, 3), 0.2)) >= 0


def test_once_a_death_is_certified_the_others_arrive():
    robots = [robot(1, (5, 1, 1.5), (5, 5, 1.5)), robot(2, *SWAP[0]), robot(3, *SWAP[1])]
    simulation = mission(robots)
    report = simulation.run(faults=Faults(kills=(Kill(1, 0.1, is_certified=True),)))
    assert report.violations == [] and report.arrived == 2 and simulation.episode.dead == [1]


def test_a_robot_restarted_during_the_mission_stays_and_the_others_stay_clear_of_its_plan():
    simulation = swap()
    # Nobody hears the successor, which knows nothing.
    faults = Faults(kills=(Kill(2, 5.0, restart_after=1.0),), interruptions=(Partition({2}, 5.0, 99.0),))
    report = simulation.run(timeout=15.0, faults=faults)
    assert report.violations == []
    successor = simulation.episode.vehicles[2].robot
    assert len(successor.sol.plans) == 1 and successor.protocol.epoch == 2
    assert nearest(simulation.solutions, {1: 0.2, 2: 0.2}) >= 0


@pytest.mark.parametrize('faults', [Faults(any_phase=True), Faults(solve=SolveTime(0.0, 0.0))])
def test_cycles_at_any_phase_and_in_lock_step_are_missions_too(faults):
    report = swap().run(faults=faults)
    assert report.valid, report.table()


class Reckless(ContractRobot):
    """Commits what it likes from 2 s on: straight through the other."""

    def commit(self, section, now):
        said = super().commit(section, now)
        if now > 2.0 and not hasattr(self, 'has_jumped'):
            self.has_jumped = True
            first = self.plan.first_knot
            points = np.concatenate([self.plan.control(first, 8), np.linspace(self.plan.control(first + 8, 1)[0],
                                                                              (9, 3), 60)])
            self._in_force.plan = Plan(first, self.plan.step, np.concatenate([points, points[-1:], points[-1:]]))
        return said


def test_a_robot_that_breaks_its_contract_is_named_with_the_time_and_the_other():
    simulation = mission([robot(1, *SWAP[0], kind=Reckless), robot(2, *SWAP[1])])
    report = simulation.run(timeout=10.0)
    breach = simulation.breaches[0]
    assert breach.robots == (1, 2) and 2.0 < breach.time < 2.6 and breach.what.startswith('robot 1 breaks')
    assert not report.valid and str(breach) in report.violations


def test_a_stopped_fleet_comes_to_rest_without_a_violation():
    simulation = swap()
    robots = list(simulation.robots.values())
    for agent in robots:
        agent.start([1, 2], 0.0)
    for now, agent, _ in exchange(robots, 12.0):
        if now > 4.0 and agent.mode.name == 'DRIVING':
            agent.stop()
    report = simulation.verify(0.0)
    assert report.violations == [] and not report.valid and report.arrived == 0


# What is refused


@pytest.mark.parametrize('poses', [
    [((1, 3, 0), (9, 3, 0)), ((1.3, 3, 0), (9, 1, 0))], [((1, 3, 0), (9, 3, 0)), ((1, 1, 0), (9, 3.2, 0))],
    [((1, 3, 0), (9, 3, 0)), ((1, 3, 0), (9, 1, 0))], [((1, 3, 0), (9, 3, 0)), ((1.405, 3, 0), (9, 1, 0))]])
def test_robots_that_overlap_at_their_starts_or_goals_are_refused(poses):
    with pytest.raises(InvalidInput, match='robots 1 and 2 overlap'):
        mission([robot(index + 1, *pose) for index, pose in enumerate(poses)])


def test_two_robots_with_one_id_and_no_robots_at_all_are_refused():
    with pytest.raises(InvalidInput, match='ids must differ'):
        mission([robot(1, *SWAP[0]), robot(1, *SWAP[1])])
    with pytest.raises(InvalidInput, match='one robot'):
        mission([])


@pytest.mark.parametrize('options', [{'seed': -1}, {'timeout': 0.0}, {'timeout': np.nan}, {'timeout': np.inf},
                                     {'start_time': np.nan}, {'loss': 2.0}, {'delay': -1.0}])
def test_a_number_out_of_its_range_is_refused(options):
    with pytest.raises(InvalidInput):
        swap().run(**options)


@pytest.mark.parametrize('faults', [Faults(kills=(Kill(3, 1.0),)), Faults(joins=(Join(0, 1.0),)), Faults(skew=0.02)])
def test_faults_that_do_not_fit_the_robots_are_refused(faults):
    with pytest.raises(InvalidInput):
        swap().run(faults=faults)


def test_robots_drive_one_mission():
    simulation = swap()
    simulation.run(timeout=0.5)
    with pytest.raises(InvalidInput, match='one mission'):
        simulation.run(timeout=0.5)


def test_the_mission_ends_at_its_timeout():
    report = swap().run(timeout=3.0)
    assert not report.valid and report.arrived == 0 and report.violations == []


def test_the_seed_s_call_is_understood():
    boundary = Boundary((0.0, 10.0), (0.0, 6.0))
    obstacles = [RoundObstacle((5.0, 3.0), 0.3)]
    robots = [Robot(i, UnicycleKineModel(*SWAP[i]), obstacles, boundary, [1 - i], Tc=0.5, Tp=4.0) for i in range(2)]
    simulation = WorldSim('swap', robots, obstacles, boundary)
    report = simulation.run()
    assert report.valid and report.name == 'swap' and set(simulation.solutions) == {0, 1}
    assert simulation.environment.bounds == (ROOM.x_min, ROOM.y_min, ROOM.x_max, ROOM.y_max)
