"""The map server, in process: Nav2's checklist and beyond."""
import shutil
from pathlib import Path

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from mobile_planning_msgs.srv import SaveMap
from nav_msgs.msg import MapMetaData
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetMap, LoadMap
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import DescribeParameters, SetParametersAtomically

from mobile_planning.errors import InvalidInput, MapError
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert_map import map_message, occupancy_grid
from mobile_planning.nodes.map_paths import load_allowed, local_path
from mobile_planning.nodes.map_server import MapServer
from mobile_planning.world.map_io import load_map, save_map
from mobile_planning.world.occupancy_grid import OccupancyGrid


def listen(ros, topic='/map', kind=OccupancyGridMessage):
    """Return the list that fills with the maps of a topic."""
    return ros.listen(kind, topic, qos.MAP)


def load(ros, url):
    """Return the answer to a request to load a map."""
    return ros.call(LoadMap, '/map_server/load_map', LoadMap.Request(map_url=str(url)))


def save(ros, url, **fields):
    """Return whether the map was saved."""
    return ros.call(SaveMap, '/map_server/save_map', SaveMap.Request(map_url=str(url), **fields)).result


def held(ros):
    """Return the map that the server answers with."""
    return occupancy_grid(ros.call(GetMap, '/map_server/map').map)


def change_state(ros, transition):
    """Ask for a transition by its name and return whether it was made."""
    request = ChangeState.Request(transition=Transition(id=getattr(Transition, f'TRANSITION_{transition.upper()}')))
    return ros.call(ChangeState, '/map_server/change_state', request).success


def state(ros):
    """Return the name of the server's state."""
    return ros.call(GetState, '/map_server/get_state').current_state.label


def same(one, other):
    """Return whether two grids are the same but for rounding of the yaw on its way through a quaternion."""
    return (np.array_equal(one.data, other.data) and one.resolution == other.resolution
            and np.allclose(one.origin, other.origin, atol=1e-12))


@pytest.fixture
def other_map(tmp_path):
    """Return the YAML file of another map."""
    return save_map(OccupancyGrid([[0, 100]], 0.5, (0, 0, 0)), tmp_path / 'other')


def test_the_map_is_published_at_once_and_reaches_late_subscribers(ros, map_file, grid):
    ros.add(MapServer, yaml_filename=map_file)
    for _ in range(2):
        maps, metadata = listen(ros), listen(ros, '/map_metadata', MapMetaData)
        ros.until(lambda: maps and metadata)
        assert same(occupancy_grid(maps[0]), grid)
        assert maps[0].header.frame_id == 'map' and maps[0].info == metadata[0]


def test_topic_and_frame_are_parameters(ros, map_file):
    ros.add(MapServer, yaml_filename=map_file, topic_name='floor', frame_id='hall')
    maps, metadata = listen(ros, '/floor'), listen(ros, '/floor_metadata', MapMetaData)
    ros.until(lambda: maps and metadata)
    assert maps[0].header.frame_id == 'hall'


def test_get_map_answers_with_the_map(ros, map_file, grid):
    ros.add(MapServer, yaml_filename=map_file)
    assert same(held(ros), grid)


@pytest.mark.parametrize('prefix', ['', 'file://'])
def test_a_loaded_map_replaces_the_old_one_and_is_published(ros, map_file, other_map, prefix):
    ros.add(MapServer, yaml_filename=map_file)
    maps = listen(ros)
    ros.until(lambda: maps)
    answer = load(ros, prefix + other_map)
    assert answer.result == LoadMap.Response.RESULT_SUCCESS and same(occupancy_grid(answer.map), load_map(other_map))
    ros.until(lambda: len(maps) == 2)
    assert maps[1] == answer.map and same(held(ros), load_map(other_map))


@pytest.mark.parametrize('url, result', [
    ('', LoadMap.Response.RESULT_MAP_DOES_NOT_EXIST),
    ('missing.yaml', LoadMap.Response.RESULT_INVALID_MAP_METADATA),
    ('no_image.yaml', LoadMap.Response.RESULT_INVALID_MAP_DATA),
    ('bad_image.yaml', LoadMap.Response.RESULT_INVALID_MAP_DATA),
    ('bad_yaml.yaml', LoadMap.Response.RESULT_INVALID_MAP_METADATA),
    ('folder.yaml', LoadMap.Response.RESULT_INVALID_MAP_METADATA),
    ('package://maps/wall.yaml', LoadMap.Response.RESULT_UNDEFINED_FAILURE),
    ('http://host/wall.yaml', LoadMap.Response.RESULT_UNDEFINED_FAILURE),
    ('file://host/wall.yaml', LoadMap.Response.RESULT_UNDEFINED_FAILURE),
    ('wall.yaml\0', LoadMap.Response.RESULT_INVALID_MAP_METADATA),
])
def test_a_failed_load_has_nav2s_code_and_keeps_the_old_map(ros, map_file, grid, tmp_path, url, result):
    text = Path(map_file).read_text()
    (tmp_path / 'no_image.yaml').write_text(text.replace('wall.png', 'nowhere.png'))
    (tmp_path / 'bad_image.yaml').write_text(text.replace('wall.png', 'bad_image.yaml'))
    (tmp_path / 'bad_yaml.yaml').write_text('image: [')
    (tmp_path / 'folder.yaml').mkdir()
    server = ros.add(MapServer, yaml_filename=map_file)
    maps = listen(ros)
    answer = load(ros, url if not url or '://' in url else tmp_path / url)
    # A string ends at its first zero on the way.
    assert answer.result == (LoadMap.Response.RESULT_SUCCESS if '\0' in url else result)
    assert same(held(ros), grid)
    if '\0' not in url:
        assert len(answer.map.data) == 0 and server.guard.rejected.total() == 1 and server.guard.newest
        ros.until(lambda: maps)
        assert len(maps) == 1


def test_without_a_map_it_starts_says_so_and_loads_one_later(ros, map_file, grid):
    server = ros.add(MapServer)
    assert server.is_active and len(ros.call(GetMap, '/map_server/map').map.data) == 0
    maps = listen(ros)
    assert load(ros, map_file).result == 0
    ros.until(lambda: maps)
    assert same(occupancy_grid(maps[0]), grid)


def test_the_whole_life_cycle(ros, map_file, grid):
    ros.add(MapServer, autostart=False, yaml_filename=map_file)
    maps = listen(ros)
    assert state(ros) == 'unconfigured' and load(ros, map_file).result == 255
    assert change_state(ros, 'configure') and state(ros) == 'inactive'
    assert load(ros, map_file).result == 255 and not save(ros, '/nowhere/at/all')
    assert len(ros.call(GetMap, '/map_server/map').map.data) == 0 and not maps
    assert change_state(ros, 'activate') and load(ros, map_file).result == 0
    ros.until(lambda: maps)
    assert change_state(ros, 'deactivate') and load(ros, map_file).result == 255
    assert change_state(ros, 'cleanup') and state(ros) == 'unconfigured'
    late = listen(ros)
    assert change_state(ros, 'configure') and change_state(ros, 'activate')
    ros.until(lambda: late)
    assert len(late) == 1 and same(held(ros), grid)
    assert change_state(ros, 'active_shutdown') and state(ros) == 'finalized'
    assert load(ros, map_file).result == 255


def test_a_failed_start_leaves_the_node_alive_and_unconfigured(ros, tmp_path, map_file):
    diagnostics = ros.listen(DiagnosticArray, '/diagnostics', qos.DIAGNOSTICS)
    server = ros.add(MapServer, yaml_filename=str(tmp_path / 'missing.yaml'))
    assert state(ros) == 'unconfigured' and load(ros, map_file).result == 255
    ros.until(lambda: diagnostics)
    status = diagnostics[0].status[0]
    assert status.level == DiagnosticStatus.ERROR and 'missing.yaml' in status.message
    server.set_parameters([rclpy_parameter('yaml_filename', map_file)])
    assert change_state(ros, 'configure') and change_state(ros, 'activate') and state(ros) == 'active'


def rclpy_parameter(name, value):
    """Return a parameter as a node takes it."""
    from rclpy.parameter import Parameter

    return Parameter(name, value=value)


def test_diagnostics_show_the_map_and_count_what_was_rejected(ros, map_file):
    ros.add(MapServer, yaml_filename=map_file)
    messages = ros.listen(DiagnosticArray, '/diagnostics', qos.DIAGNOSTICS)
    load(ros, '')
    ros.until(lambda: messages)
    status = messages[0].status[0]
    values = {entry.key: entry.value for entry in status.values}
    assert status.name == 'map_server' and status.level == DiagnosticStatus.WARN and 'empty' in status.message
    assert values['map'] == '10 x 6 cells' and values['rejected 1 MapNotFound'] == '1'
    ros.until(lambda: len(messages) > 1)
    assert messages[1].status[0].level == DiagnosticStatus.OK and messages[1].status[0].message == 'active'


@pytest.mark.parametrize('image_format', ['pgm', 'png', 'bmp'])
@pytest.mark.parametrize('mode', ['trinary', 'raw'])
def test_a_saved_map_loads_as_it_was(ros, map_file, grid, tmp_path, image_format, mode):
    ros.add(MapServer, yaml_filename=map_file)
    assert save(ros, tmp_path / 'saved', image_format=image_format, map_mode=mode)
    assert (tmp_path / f'saved.{image_format}').exists()
    assert same(load_map(tmp_path / 'saved.yaml'), grid)
    assert load(ros, tmp_path / 'saved.yaml').result == 0 and same(held(ros), grid)


def test_all_defaults_save_a_trinary_pgm_in_the_current_folder(ros, map_file, grid, tmp_path, monkeypatch):
    folder = tmp_path / 'here'
    folder.mkdir()
    monkeypatch.chdir(folder)
    ros.add(MapServer, yaml_filename=map_file)
    assert save(ros, '')
    (written,) = folder.glob('map_*.yaml')
    assert written.with_suffix('.pgm').exists() and same(load_map(written), grid)


def test_mode_scale_is_a_png_by_default_and_keeps_the_thresholds_of_the_request(ros, map_file, tmp_path):
    ros.add(MapServer, yaml_filename=map_file)
    assert save(ros, f'file://{tmp_path}/scaled', map_mode='scale', occupied_thresh=0.8, free_thresh=0.1)
    text = (tmp_path / 'scaled.yaml').read_text()
    assert 'image: scaled.png' in text and 'occupied_thresh: 0.8\n' in text and 'free_thresh: 0.1\n' in text


@pytest.mark.parametrize('fields', [{'image_format': 'invalid_format'}, {'map_mode': 'invalid_mode'}])
def test_unknown_format_and_mode_fall_back_and_succeed(ros, map_file, grid, tmp_path, fields):
    ros.add(MapServer, yaml_filename=map_file)
    assert save(ros, tmp_path / 'saved', **fields)
    assert same(load_map(tmp_path / 'saved.yaml'), grid) and (tmp_path / 'saved.pgm').exists()


@pytest.mark.parametrize('fields', [
    {'free_thresh': 2.0, 'occupied_thresh': 2.0}, {'free_thresh': -2.0, 'occupied_thresh': -2.0},
    {'free_thresh': 0.7, 'occupied_thresh': 0.2}, {'free_thresh': float('nan')}, {'map_topic': 'not a topic'}])
def test_bad_thresholds_and_topics_fail(ros, map_file, tmp_path, fields):
    server = ros.add(MapServer, yaml_filename=map_file)
    assert not save(ros, tmp_path / 'saved', **fields)
    assert not (tmp_path / 'saved.yaml').exists() and server.guard.faults == 0


def test_an_unwritable_target_fails(ros, map_file, tmp_path):
    server = ros.add(MapServer, yaml_filename=map_file)
    assert not save(ros, tmp_path / 'nowhere' / 'saved') and server.guard.faults == 0


def test_the_map_of_another_topic_is_saved_and_the_server_answers_meanwhile(ros, map_file, grid, tmp_path):
    server = ros.add(MapServer, yaml_filename=map_file)
    pending = ros.send(SaveMap, '/map_server/save_map',
                       SaveMap.Request(map_topic='/elsewhere', map_url=str(tmp_path / 'saved')))
    ros.until(lambda: ros.node.count_subscribers('/elsewhere'))
    assert same(held(ros), grid) and not pending.done()
    other = OccupancyGrid([[0, 100, -1]], 0.25, (0, 0, 0))
    publisher = ros.node.create_publisher(OccupancyGridMessage, '/elsewhere', qos.MAP)
    publisher.publish(map_message(other, 'map', server.get_clock().now().to_msg()))
    ros.until(pending.done)
    assert pending.result().result and same(load_map(tmp_path / 'saved.yaml'), other)
    ros.until(lambda: not ros.node.count_subscribers('/elsewhere'))


def test_a_topic_without_a_map_fails_after_the_timeout_and_not_the_next_request(ros, map_file, tmp_path):
    ros.add(MapServer, yaml_filename=map_file, save_map_timeout=0.05)
    assert not save(ros, tmp_path / 'saved', map_topic='/nobody')
    assert save(ros, tmp_path / 'saved')


def test_only_files_in_the_allowed_folders_are_read_and_written(ros, map_file, tmp_path):
    inside, outside = tmp_path / 'inside', tmp_path / 'outside'
    inside.mkdir(), outside.mkdir()
    for suffix in 'yaml', 'png':
        shutil.copy(Path(map_file).with_suffix(f'.{suffix}'), inside)
    (inside / 'link.yaml').symlink_to(map_file)
    (inside / 'image.yaml').write_text((inside / 'wall.yaml').read_text().replace('wall.png', '../wall.png'))
    ros.add(MapServer, map_roots=[str(inside)])
    assert load(ros, inside / 'wall.yaml').result == 0
    for path in map_file, inside / 'link.yaml', inside / '..' / 'wall.yaml', inside / 'image.yaml', '/dev/zero':
        assert load(ros, path).result == 255
    assert save(ros, inside / 'saved') and not save(ros, outside / 'saved') and not save(ros, inside / '..' / 'saved')
    assert not list(outside.iterdir())


def test_a_request_that_breaks_the_server_is_answered_and_the_node_lives_on(ros, map_file, grid, monkeypatch):
    server = ros.add(MapServer, yaml_filename=map_file)
    monkeypatch.setattr('mobile_planning.nodes.map_server.load_allowed', lambda *_: 1 / 0)
    assert load(ros, map_file).result == 255
    assert server.guard.faults == 1 and 'ZeroDivisionError' in server.guard.newest
    assert same(held(ros), grid)


def set_parameters(ros, **values):
    """Set parameters together through the service and return the result."""
    kinds = {str: ('string_value', ParameterType.PARAMETER_STRING),
             float: ('double_value', ParameterType.PARAMETER_DOUBLE),
             int: ('integer_value', ParameterType.PARAMETER_INTEGER)}
    parameters = []
    for name, value in values.items():
        field, kind = kinds[type(value)]
        parameters.append(ParameterMessage(name=name, value=ParameterValue(type=kind, **{field: value})))
    return ros.call(SetParametersAtomically, '/map_server/set_parameters_atomically',
                    SetParametersAtomically.Request(parameters=parameters)).result


def test_parameters_change_together_or_not_at_all(ros):
    server = ros.add(MapServer)
    before = server.options
    refused = set_parameters(ros, save_map_timeout=3.0, free_thresh_default=0.9)
    assert not refused.successful and '0.9' in refused.reason and server.options == before
    assert server.get_parameter('save_map_timeout').value == 2.0
    assert set_parameters(ros, occupied_thresh_default=0.95, free_thresh_default=0.9).successful
    assert server.options.free_thresh_default == 0.9


@pytest.mark.parametrize('values', [{'save_map_timeout': 0.0}, {'save_map_timeout': float('nan')},
                                    {'save_map_timeout': 'long'}, {'frame_id': 'odom'}, {'unknown': 1.0}])
def test_a_bad_parameter_is_refused_with_a_reason(ros, values):
    server = ros.add(MapServer)
    result = set_parameters(ros, **values)
    assert not result.successful and result.reason and server.options.save_map_timeout == 2.0


def test_an_integer_is_taken_for_a_float(ros):
    server = ros.add(MapServer, save_map_timeout=3)
    assert server.options.save_map_timeout == 3.0
    assert set_parameters(ros, save_map_timeout=4).successful and server.options.save_map_timeout == 4.0


@pytest.mark.parametrize('parameters, words', [
    ({'yaml_filenam': 'x'}, 'did you mean yaml_filename'), ({'zzz': 1}, 'has no parameter zzz: it has'),
    ({'save_map_timeout': -1.0}, 'within 0.01 to 60.0, not -1.0'), ({'save_map_timeout': 'x'}, 'must be a float'),
    ({'autostart': 1}, 'must be a bool'), ({'topic_name': ''}, 'must not be empty'),
    ({'free_thresh_default': 0.7}, 'must be below')])
def test_a_bad_parameter_at_the_start_is_refused_with_a_sentence(ros, parameters, words):
    with pytest.raises(InvalidInput, match=words):
        ros.add(MapServer, **parameters)


def test_every_parameter_has_a_description(ros):
    server = ros.add(MapServer)
    names = list(server.options.__dataclass_fields__)
    answer = ros.call(DescribeParameters, '/map_server/describe_parameters', DescribeParameters.Request(names=names))
    assert len(answer.descriptors) == len(names) and all(entry.description for entry in answer.descriptors)


@pytest.mark.parametrize('url', ['ftp://a/b.yaml', 'file://b.yaml', 'package://b/c.yaml'])
def test_an_url_that_is_no_file_here_is_refused(url):
    with pytest.raises(MapError, match='file'):
        local_path(url)


def test_without_roots_every_path_is_allowed(map_file, grid):
    assert same(load_allowed(f'file://{map_file}', ()), grid)
