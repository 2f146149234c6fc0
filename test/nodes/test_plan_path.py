"""The client ``plan_path`` against real servers of the depot: what it prints, draws and refuses."""
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]


@pytest.fixture(scope='module')
def depot(start_once):
    """Start a map server with the depot and a grid planner for all tests here: none of them alters what they serve."""
    path = REPOSITORY / 'config' / 'maps' / 'depot.yaml'
    start_once('map_server', '--ros-args', '-p', f'yaml_filename:={path}')
    start_once('grid_planner')


def rows(out):
    """Return the names and values that the client prints."""
    return dict(line.split(maxsplit=1) for line in out.splitlines())


def test_the_client_prints_the_path_and_draws_it(depot, start, tmp_path):
    picture = tmp_path / 'path.png'
    code, out, err = start('plan_path', '--planner', 'distance_transform', '--start', 2, 2, '--goal', 27, 13, 1.57,
                           '--plot', picture, '--timeout', 30).result()
    assert (code, err) == (0, '')
    assert np.hypot(25, 11) < float(rows(out)['cost'].split()[0]) < 40 and int(rows(out)['poses']) > 400
    assert picture.read_bytes().startswith(b'\x89PNG') and picture.stat().st_size > 10_000


@pytest.mark.parametrize('arguments, words', [
    (['--start', 2, 2, '--goal', 270, 13], 'error 204: goal (270, 13)'),
    (['--start', -2, 2, '--goal', 27, 13], 'error 203: start (-2, 2)'),
    (['--start', 2, 2, '--goal', 27, 13, '--frame', 'odom'], "error 202: start is in frame 'odom'"),
    (['--start', 2, 2, '--goal', 27, 13, '--planner', 'teleport'], "error 201: planner 'teleport'"),
    (['--start', 2, 2, '--goal', 'nan', 13], 'error 251: goal'),
    (['--start', 2, 2, '--goal', 27, 13, '--plot', '/nowhere/path.png'], '/nowhere/path.png'),
    (['--start', 2, 2, '--goal', 27, 13, '--plot', 'path.nothing'], 'nothing'),
])
def test_the_client_says_in_a_sentence_what_failed(depot, start, arguments, words):
    code, _, err = start('plan_path', *arguments, '--timeout', 30).result()
    assert code == 1 and err.startswith('plan_path: ') and words in err and 'Traceback' not in err


def test_the_client_takes_the_arguments_of_ros(depot, start):
    code, out, _ = start('plan_path', '--start', 2, 2, '--goal', 27, 13, '--node', 'other', '--timeout', 30,
                         '--ros-args', '-r', '/other/plan_path:=/grid_planner/plan_path').result()
    assert code == 0 and 'cost' in out
