"""Scenarios: every family draws missions that are free, apart and possible, the same for one seed."""
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from mobile_planning import InvalidInput
from mobile_planning.fleet import scenarios

REPOSITORY = Path(__file__).parents[2]
#: Every family as it comes, and at its most crowded.
CASES = [(name, {}) for name in scenarios.families()] + [
    ('swap', {'robots': 64}), ('swap', {'robots': 8, 'jitter': 0.0}), ('swap', {'robots': 2, 'radius': 1.0}),
    ('line_swap', {'robots': 16}), ('forest', {'robots': 16}), ('doorway', {'robots': 8, 'gap': 0.6}),
    ('corridor', {'robots': 4}), ('corridor', {'robots': 8, 'width': 0.65}), ('intersection', {'robots': 16}),
    ('maze', {'robots': 10}), ('rooms', {'robots': 8}), ('pockets', {'robots': 8}),
    ('warehouse', {'robots': 24, 'aisle': 1.0}), ('depot', {'robots': 24}), ('hall', {'robots': 16})]


def places(scene):
    """Return starts and goals (N, 2), (N, 2) [m]."""
    return (np.array([getattr(spec, what) for spec in scene.robots])[:, :2] for what in ('start', 'goal'))


def content(scene):
    return ([vars(spec) for spec in scene.robots], scene.environment().bounds, scene.timeout,
            [repr(vars(obstacle)) for obstacle in scene.obstacles])


@pytest.mark.parametrize('name, parameters', CASES)
@pytest.mark.parametrize('seed', [0, 7])
def test_starts_and_goals_are_free_apart_and_joined_by_ways(name, parameters, seed):
    scene = scenarios.scene(name, seed, **parameters)
    environment, (starts, goals) = scene.environment(), places(scene)
    for points in (starts, goals):
        assert environment.clearance(points).min() >= 0.2 + 0.1
        apart = np.linalg.norm(points[:, None] - points, axis=-1) + 10 * np.eye(len(points))
        assert apart.min() >= 2 * 0.225 - 1e-9
    # The cells where a robot with 25 mm of margin fits, by another resolution and another search.
    x_min, y_min, x_max, y_max = environment.bounds
    cells = np.stack(np.meshgrid(np.arange(x_min, x_max, 0.03), np.arange(y_min, y_max, 0.03)), axis=-1)
    parts, _ = ndimage.label(environment.clearance(cells) >= 0.225)
    part = [[parts[tuple(np.round((point - (x_min, y_min)) / 0.03).astype(int)[::-1])] for point in points]
            for points in (starts, goals)]
    assert 0 not in part[0] and part[0] == part[1]


@pytest.mark.parametrize('name, parameters', CASES)
def test_one_seed_gives_one_scene_and_another_seed_another(name, parameters):
    first, again, other = (content(scenarios.scene(name, seed, **parameters)) for seed in (3, 3, 4))
    assert first == again
    assert (first == other) == (name == 'heritage' or parameters.get('jitter') == 0.0)


@pytest.mark.parametrize('name', [name for name in scenarios.families() if name != 'heritage'])
def test_as_many_robots_drive_as_asked_for_and_look_towards_their_goals(name):
    scene = scenarios.scene(name, 1, robots=2)
    assert [spec.id for spec in scene.robots] == [1, 2]
    for spec in scene.robots:
        way = np.subtract(spec.goal, spec.start)
        assert spec.start[2] == spec.goal[2] == pytest.approx(np.arctan2(way[1], way[0]))
        assert (spec.radius, spec.u_max, spec.a_max[0]) == (0.2, (1.0, 5.0), 2.0)


@pytest.mark.parametrize('name', scenarios.families())
def test_a_made_mission_is_ready_to_run(name):
    simulation = scenarios.make(name, seed=2)
    scene = scenarios.scene(name, seed=2)
    assert simulation.name == name and list(simulation.robots) == [spec.id for spec in scene.robots]
    assert simulation.environment.bounds == scene.environment().bounds


def test_the_circle_of_a_swap_grows_with_its_robots_and_has_the_radius_asked_for():
    for parameters, radius in (({'robots': 8}, 3.0), ({'robots': 32}, 8.0), ({'robots': 4, 'radius': 1.5}, 1.5)):
        starts, goals = places(scenarios.scene('swap', jitter=0.0, **parameters))
        assert np.linalg.norm(starts, axis=1) == pytest.approx(radius) and goals == pytest.approx(-starts)


@settings(max_examples=20)
@given(st.integers(2, 12), st.integers(0, 10**6))
def test_the_jitter_of_a_swap_is_bounded(robots, seed):
    exact, shaken = (np.concatenate(list(places(scenarios.scene('swap', seed, robots=robots, jitter=jitter))))
                     for jitter in (0.0, 0.15))
    assert 0.0 < np.abs(exact - shaken).max() <= 0.15


def test_the_rows_of_a_line_swap_change_places():
    starts, goals = places(scenarios.scene('line_swap', 3, robots=6))
    assert sorted(map(tuple, starts)) == sorted(map(tuple, goals)) and (starts[:, 0] * goals[:, 0] < 0).all()


@pytest.mark.parametrize('name', ['doorway', 'corridor', 'pockets'])
def test_everybody_has_to_pass(name):
    starts, goals = places(scenarios.scene(name, 5, robots=8))
    assert (starts[:, 0] * goals[:, 0] < 0).all() and (starts[:, 0] < 0).sum() == 4


@pytest.mark.parametrize('name, key, width', [('doorway', 'gap', 0.9), ('doorway', 'gap', 0.6),
                                              ('corridor', 'width', 0.65)])
def test_the_narrow_place_is_as_wide_as_asked_for(name, key, width):
    environment = scenarios.scene(name, **{key: width}).environment()
    assert environment.clearance([(0.0, 0.0)])[0] == pytest.approx(width / 2)


def test_nobody_leaves_a_crossing_by_his_own_arm():
    starts, goals = places(scenarios.scene('intersection', 2, robots=16))
    arm = [np.round(np.arctan2(points[:, 1], points[:, 0]) / (np.pi / 2)) % 4 for points in (starts, goals)]
    assert (arm[0] != arm[1]).all() and np.bincount(arm[1].astype(int)).tolist() == [4, 4, 4, 4]


@pytest.mark.parametrize('name, seed', [*(('maze', seed) for seed in range(10)), ('rooms', 0)])
def test_a_maze_has_one_way_only_between_two_rooms(name, seed):
    environment = scenarios.scene(name, seed).environment()
    for closed in environment.obstacles:
        # A tree: nine rooms joined by eight doors, so four of twelve walls have none.
        assert np.ptp(closed.vertices, axis=0).min() == pytest.approx(0.2)
    cells = np.stack(np.meshgrid(np.arange(0.02, 7.8, 0.05), np.arange(0.02, 7.8, 0.05)), axis=-1)
    free = environment.clearance(cells) > 0.0
    assert ndimage.label(free)[1] == 1
    # Without loops, what is not free hangs together with the outer wall.
    assert ndimage.label(np.pad(~free, 1, constant_values=True), np.ones((3, 3)))[1] == 1


def test_the_lane_between_the_traps_has_three_pockets_that_hold_one_robot_each():
    environment = scenarios.scene('pockets').environment()
    assert environment.clearance([(-1.8, 0.6), (1.8, 0.6), (0.0, -0.6)]).min() >= 0.3
    assert environment.clearance([(-1.8, 1.2), (1.8, 1.2), (0.0, -1.2), (0.9, 0.6), (-3.9, 0.0), (3.9, 0.0)]).max() < 0
    assert environment.clearance([(0.9, 0.0)])[0] == pytest.approx(0.325)


# What is refused


@pytest.mark.parametrize('name, parameters, word', [
    ('desert', {}, "'desert', none of heritage, swap"), (3, {}, 'none of'), (None, {}, 'none of'), ([], {}, 'none of'),
    ('swap', {'gap': 1.0}, 'robots, jitter, radius, not gap'), ('heritage', {'robots': 2}, 'not robots'),
    ('swap', {'robots': 0}, 'robots is 0, not a whole number in 1..256'), ('swap', {'robots': 257}, '257'),
    ('swap', {'robots': 2.5}, 'whole'), ('swap', {'robots': 'two'}, 'two'), ('swap', {'robots': True}, 'True'),
    ('swap', {'robots': None}, 'None'), ('swap', {'jitter': -0.1}, 'jitter'), ('swap', {'jitter': np.nan}, 'nan'),
    ('swap', {'radius': np.inf}, 'inf'), ('swap', {'radius': 0.0}, 'radius'), ('swap', {'radius': 'wide'}, 'wide'),
    ('swap', {'robots': 32, 'radius': 1.0}, '32 robots on a circle of radius 1 m are 0.196 m apart'),
    ('swap', {'robots': 8, 'radius': 1.0, 'jitter': 0.5}, 'they need'), ('line_swap', {'robots': 5}, 'even'),
    ('doorway', {'gap': 0.4}, 'gap is 0.4, not a number in 0.6..5.0'), ('doorway', {'robots': 40}, 'robots'),
    ('corridor', {'robots': 9}, r'1\.\.8'), ('corridor', {'width': 0.3}, 'width'),
    ('warehouse', {'aisle': 0.1}, 'aisle'), ('depot', {'robots': 255, 'seed': 1.5}, 'seed'),
    ('maze', {'seed': -1}, 'seed is -1'), ('maze', {'seed': 'x'}, 'seed'), ('maze', {'seed': True}, 'seed')])
def test_what_is_impossible_is_refused_with_the_value_and_the_limit(name, parameters, word):
    with pytest.raises(InvalidInput, match=word):
        scenarios.scene(name, **parameters)


def test_whole_numbers_of_numpy_are_numbers():
    assert content(scenarios.scene('swap', np.int64(1), robots=np.int32(4), radius=np.float32(3))) == \
        content(scenarios.scene('swap', 1, robots=4, radius=3))


# Installed


@pytest.mark.parametrize('home', ['lib/python3.11/site-packages', 'local/lib/python3.12/dist-packages'])
def test_an_installed_package_finds_the_map_of_the_depot(tmp_path, home):
    site, share = tmp_path / home, tmp_path / home.split('lib/')[0] / 'share' / 'mobile_planning'
    site.mkdir(parents=True)
    # With all that is compiled: its cache stands beside it.
    shutil.copytree(REPOSITORY / 'mobile_planning', site / 'mobile_planning')
    shutil.copytree(REPOSITORY / 'config', share / 'config')
    program = 'from mobile_planning.fleet import scenarios; print(scenarios.scene("depot").map_path)'
    printed = subprocess.run([sys.executable, '-c', program], cwd=tmp_path, env={'PYTHONPATH': str(site)}, timeout=120,
                             capture_output=True, text=True, check=True).stdout
    assert Path(printed.strip()).samefile(share / 'config' / 'maps' / 'depot.yaml')
