"""Scene files: the shipped ones load; a mistake in a file is refused with the name of its key."""
from pathlib import Path

import numpy as np
import pytest
import yaml

from mobile_planning import InvalidInput, PlanningError
from mobile_planning.fleet import scenarios
from mobile_planning.fleet.scene import RobotSpec, Scene
from mobile_planning.fleet.scene_file import load_scene

FLEETS = Path(__file__).parents[2] / 'config' / 'fleets'
SCENES = sorted(FLEETS.glob('*.yaml'))
ONE = {'id': 1, 'start': [1, 1, 0], 'goal': [8, 4, 0]}
GOOD = {'name': 'good', 'boundary': {'x': [0, 10], 'y': [0, 6]}, 'robots': [ONE]}


def load(tmp_path, content, robots=None):
    path = tmp_path / 'scene.yaml'
    path.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
    return load_scene(path, robots)


def test_the_four_scenes_are_shipped():
    assert {path.stem for path in SCENES} >= {'crossing', 'depot', 'four_corners', 'head_on'}


def test_a_scene_says_all_that_a_mission_needs(tmp_path):
    scene = load(tmp_path, {
        **GOOD, 'timeout': 12, 'obstacles': [{'position': [3, 3], 'radius': 0.5},
                                             {'vertices': [[5, 0], [6, 0], [6, 1]]}],
        'robots': [{**ONE, 'radius': 0.3, 'u_max': [0.5, 2], 'a_max': [1, 3]}]})
    assert scene.name == 'good' and scene.timeout == 12.0 and len(scene.obstacles) == 2 and not scene.on_map
    robot, (body,) = scene.robot(1), scene.bodies()
    assert robot.rho == body.radius == 0.3 and (body.v_max, body.omega_max, body.a_max) == (0.5, 2.0, 1.0)
    assert (robot.limits.v_max, robot.limits.omega_max, robot.limits.a_max) == (0.5, 2.0, 1.0)
    assert body.start.tolist() == [1, 1, 0] and body.goal.tolist() == [8, 4, 0]
    assert robot.environment.clearance([(3, 3)])[0] == -0.5


def test_a_robot_may_have_a_list_of_goals(tmp_path):
    goals = [[8, 4, 0], [8, 1, 1.5], [1, 1, 0]]
    scene = load(tmp_path, {**GOOD, 'robots': [{'id': 1, 'start': [1, 1, 0], 'goals': goals}]})
    assert scene.robot(1).goal.tolist() == goals[0] and [g.tolist() for g in scene.bodies()[0].goals] == goals
    errands = scene.errands()
    assert [errands.next_goal(1, 0.0, []).tolist() for _ in range(2)] == goals[1:]
    assert load(tmp_path, GOOD).errands() is None
    report = scene.world_sim().run(errands=scene.errands())
    assert report.valid and report.arrivals == report.goals == 3


def test_an_endless_mission_is_asked_for_with_any_scene(tmp_path):
    for content in (GOOD, {'scenario': 'swap', 'robots': 3}):
        scene = load(tmp_path, {**content, 'endless': 20, 'timeout': 50})
        assert scene.endless == 20.0
        first, again, other = (scene.errands(seed).next_goal(1, 0.0, []).tolist() for seed in (1, 1, 2))
        assert first == again != other and scene.errands().next_goal(1, 20.0, []) is None


def test_a_goal_of_a_list_that_nobody_can_reach_is_refused_before_the_mission(tmp_path):
    scene = load(tmp_path, {**GOOD, 'robots': [{'id': 1, 'start': [1, 1, 0], 'goals': [[8, 4, 0], [8, 9, 0]]}]})
    with pytest.raises(PlanningError, match='outside'):
        scene.world_sim()


def test_robots_that_would_end_at_one_place_are_refused_and_those_that_pass_through_it_are_not(tmp_path):
    def scene(*goals):
        return load(tmp_path, {**GOOD, 'robots': [{'id': index, 'start': [1, index, 0], 'goals': list(listed)}
                                                  for index, listed in enumerate(goals, 1)]})
    a, b, c = [8, 4, 0], [8, 1, 0], [5, 5, 0]
    with pytest.raises(InvalidInput, match='overlap at their goals'):
        scene((a, b), (c, b)).world_sim()
    assert len(scene((a, b), (b, a)).world_sim().robots) == 2


def test_options_go_to_the_robot(tmp_path):
    robot = load(tmp_path, GOOD).robot(1, margin=0.05, Tc=0.5)
    assert robot.Tc == 0.5 and robot.limits.radius == pytest.approx(0.25)
    with pytest.raises(InvalidInput, match='not 9'):
        load(tmp_path, GOOD).robot(9)


def test_a_file_without_a_name_is_called_after_itself(tmp_path):
    assert load(tmp_path, {key: value for key, value in GOOD.items() if key != 'name'}).name == 'scene'


def test_the_first_robots_of_a_list_can_be_asked_for(tmp_path):
    two = {**GOOD, 'robots': [ONE, {'id': 5, 'start': [1, 4, 0], 'goal': [8, 1, 0]}]}
    assert [spec.id for spec in load(tmp_path, two, 1).robots] == [1]
    assert [spec.id for spec in load(tmp_path, two).robots] == [1, 5]
    for count in (0, 3, -1):
        with pytest.raises(InvalidInput, match='robots'):
            load(tmp_path, two, count)


def test_as_many_robots_of_a_family_as_wanted_can_be_asked_for():
    assert len(load_scene(FLEETS / 'depot.yaml').robots) == 6
    assert len(load_scene(FLEETS / 'depot.yaml', 9).robots) == 9
    for count in (0, -2, 1000):
        with pytest.raises(InvalidInput, match='robots'):
            load_scene(FLEETS / 'depot.yaml', count)


# Families


def missions(scene):
    return [vars(spec) for spec in scene.robots]


def test_a_file_can_ask_for_a_family_with_its_parameters(tmp_path):
    scene = load(tmp_path, {'scenario': 'corridor', 'robots': 4, 'seed': 3, 'width': 0.7, 'timeout': 33})
    asked = scenarios.scene('corridor', 3, robots=4, width=0.7)
    assert missions(scene) == missions(asked) and scene.boundary.x_max == asked.boundary.x_max
    assert [obstacle.vertices.tolist() for obstacle in scene.obstacles] == \
        [obstacle.vertices.tolist() for obstacle in asked.obstacles]
    assert (scene.name, scene.timeout) == ('scene', 33.0)


def test_a_family_has_defaults_for_all_but_its_name(tmp_path):
    scene = load(tmp_path, 'scenario: swap')
    assert missions(scene) == missions(scenarios.scene('swap')) and scene.timeout == scenarios.scene('swap').timeout


def test_the_depot_brings_its_map(tmp_path):
    scene = load(tmp_path, 'scenario: depot')
    shipped = load_scene(FLEETS / 'depot.yaml')
    assert scene.on_map and scene.map_path.is_file() and scene.grid.shape == shipped.grid.shape
    assert missions(load(tmp_path, 'scenario: depot\nrobots: 6\nseed: 3')) == missions(shipped)


def test_random_missions_can_be_asked_for_in_a_world_of_one_s_own(tmp_path):
    asked = {'scenario': 'depot', 'robots': 3, 'seed': 1, 'boundary': {'x': [0, 12], 'y': [0, 9]},
             'obstacles': [{'position': [6, 4], 'radius': 1.0}]}
    scene = load(tmp_path, asked)
    assert not scene.on_map and scene.environment().bounds == (0, 0, 12, 9)
    places = np.array([pose[:2] for spec in scene.robots for pose in (spec.start, spec.goal)])
    assert scene.environment().clearance(places).min() >= 0.4
    assert missions(scene) == missions(load(tmp_path, asked)) != missions(load(tmp_path, {**asked, 'seed': 2}))


# What is refused


@pytest.mark.parametrize('changed, word', [
    ({'speed': 3}, 'speed'), ({'timeout': 'long'}, 'timeout'), ({'timeout': -1}, 'timeout'),
    ({'timeout': True}, 'timeout'),
    ({'timeout': float('nan')}, 'timeout'), ({'timeout': float('inf')}, 'timeout'), ({'timeout': None}, 'timeout'),
    ({'boundary': None}, 'boundary'), ({'boundary': 5}, 'boundary'), ({'boundary': {'x': [0, 10]}}, 'boundary y'),
    ({'boundary': {'x': [0, 10], 'y': [6, 0]}}, 'boundary y'), ({'boundary': {'x': 'a', 'y': [0, 6]}}, 'boundary x'),
    ({'boundary': {'x': [0, 10], 'y': [0, 6], 'z': [0, 1]}}, 'z'), ({'map': 5}, 'map'), ({'map': ['a']}, 'map'),
    ({'obstacles': 5}, 'obstacles'), ({'obstacles': None}, 'obstacles'), ({'obstacles': ['round']}, 'obstacle'),
    ({'obstacles': [{'position': [1, 2]}]}, 'radius'), ({'obstacles': [{'radius': 2}]}, 'obstacle'),
    ({'obstacles': [{'position': [1, 2], 'radius': -1}]}, 'radius'),
    ({'obstacles': [{'position': [1, 2], 'radius': 'x'}]}, 'radius'),
    ({'obstacles': [{'position': [1, 2], 'radius': 1, 'colour': 'red'}]}, 'colour'),
    ({'obstacles': [{'vertices': [[0, 0], [1, 1]]}]}, 'vertices'), ({'obstacles': [{'vertices': 7}]}, 'polygon|points'),
    ({'robots': None}, 'robots'), ({'robots': 3}, 'robots'), ({'robots': []}, 'robots'), ({'robots': ['one']}, 'robot'),
    ({'robots': [ONE, ONE]}, 'ids'), ({'scenario': 'desert', 'robots': 3}, 'desert'),
    ({'scenario': 'depot', 'robots': 'many'}, 'robots'), ({'scenario': 'depot', 'robots': True}, 'robots'),
    ({'scenario': 'depot', 'robots': 0}, 'robots'), ({'scenario': 'depot', 'robots': 3, 'seed': 'x'}, 'seed'),
    ({'scenario': 'depot', 'robots': 3, 'seed': -3}, 'seed'), ({'scenario': 'depot', 'robots': 3, 'seed': 1.5}, 'seed'),
    ({'scenario': 'depot', 'robots': 200}, 'no room for 200'), ({'scenario': ['depot'], 'robots': 2}, 'scenario'),
    ({'scenario': 'swap', 'robots': 2}, 'world of its own: boundary'), ({'seed': 3}, 'seed'), ({'gap': 0.9}, 'gap'),
    ({'scenario': 'depot', 'robots': 2, 'gap': 0.9}, 'gap'),
    ({'endless': 'yes'}, 'endless'), ({'endless': -1}, 'endless'),
    ({'endless': float('nan')}, 'endless'), ({'endless': 60.0}, 'endless is 60.0 s'), ({'endless': None}, 'endless')])
def test_a_mistake_in_a_scene_is_refused_by_its_key(tmp_path, changed, word):
    with pytest.raises(InvalidInput, match=word):
        load(tmp_path, {**GOOD, **changed})


@pytest.mark.parametrize('changed, word', [
    ({'id': 'one'}, 'id'), ({'id': -1}, 'id'), ({'id': True}, 'id'), ({'id': 1.0}, 'id'), ({'id': 2**32}, 'id'),
    ({'id': None}, 'id'), ({'start': [1, 1]}, 'start'), ({'start': 'here'}, 'start'), ({'start': '110'}, 'start'),
    ({'start': [1, 1, None]}, 'start'), ({'start': [1, [1, 2], 3]}, 'start'), ({'start': 5}, 'start'),
    ({'start': [1, 1, float('nan')]}, 'q_init|start'), ({'goal': [1, float('inf'), 0]}, 'q_final|goal'),
    ({'goal': None}, 'goal'), ({'radius': 0}, 'radius'), ({'radius': 'big'}, 'radius'), ({'radius': True}, 'radius'),
    ({'radius': float('nan')}, 'radius'), ({'u_max': [1]}, 'u_max'), ({'u_max': [0, 1]}, 'u_max'),
    ({'u_max': 'fast'}, 'u_max'), ({'a_max': [1, -1]}, 'a_max'), ({'a_max': [1, float('inf')]}, 'a_max'),
    ({'colour': 'red'}, 'colour'), ({'goals': [[1, 1, 0]]}, 'a goal or a list of goals'), ({'via': []}, 'via')])
def test_a_mistake_in_a_robot_is_refused_by_its_key(tmp_path, changed, word):
    with pytest.raises(InvalidInput, match=word):
        load(tmp_path, {**GOOD, 'robots': [{**ONE, **changed}]})


@pytest.mark.parametrize('goals', [[], None, 5, 'all', [[1, 1]], [[1, 1, 0], 'there'], [[1, 1, 0]] * 1001,
                                   [[1, 1, float('nan')], [2, 2, 0]]])
def test_a_list_of_goals_that_is_none_is_refused(tmp_path, goals):
    with pytest.raises(InvalidInput, match='goal'):
        load(tmp_path, {**GOOD, 'robots': [{'id': 1, 'start': [1, 1, 0], 'goals': goals}]})


@pytest.mark.parametrize('key', ['id', 'start', 'goal'])
def test_a_robot_that_lacks_a_key_is_refused(tmp_path, key):
    with pytest.raises(InvalidInput, match=key):
        load(tmp_path, {**GOOD, 'robots': [{other: value for other, value in ONE.items() if other != key}]})


@pytest.mark.parametrize('text', ['', '[1, 2]', '5', 'a: [', 'name: "\\x"', '{: }', '\t',
                                  'name: !!python/object:os.system x', '[' * 3000])
def test_a_file_that_is_no_scene_is_refused(tmp_path, text):
    with pytest.raises(InvalidInput, match='scene.yaml'):
        load(tmp_path, text)


def test_a_file_that_is_no_text_or_not_there_is_refused(tmp_path):
    (tmp_path / 'scene.yaml').write_bytes(b'\xff\xfe\x00\x80')
    for path in (tmp_path / 'scene.yaml', tmp_path / 'none.yaml', tmp_path):
        with pytest.raises(InvalidInput, match=path.name):
            load_scene(path)


def test_a_scene_whose_map_is_missing_names_it(tmp_path):
    with pytest.raises(PlanningError, match='nowhere.yaml'):
        load(tmp_path, {**GOOD, 'map': 'nowhere.yaml'})


def test_a_scene_without_a_world_is_refused():
    with pytest.raises(InvalidInput, match='map or a boundary'):
        Scene('void', (RobotSpec(1, (1, 1, 0), (2, 2, 0)),))
