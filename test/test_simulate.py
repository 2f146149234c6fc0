"""The command line of ``simulate``: what it prints, writes and exits with."""
import json
import subprocess
import sys
from pathlib import Path

import pytest

from mobile_planning.simulate import main

FLEETS = Path(__file__).parents[1] / 'config' / 'fleets'
HEAD_ON = str(FLEETS / 'head_on.yaml')


def test_a_valid_mission_exits_with_0_and_leaves_its_outcome(tmp_path, capsys):
    assert main([HEAD_ON, '--out', str(tmp_path / 'out')]) == 0
    printed = capsys.readouterr().out
    assert '2 of 2 robots' in printed and str(tmp_path / 'out' / 'mission.png') in printed
    assert json.loads((tmp_path / 'out' / 'report.json').read_text())['valid']
    assert (tmp_path / 'out' / 'mission.png').stat().st_size > 5000


def test_a_mission_that_is_not_valid_exits_with_1(capsys):
    assert main([HEAD_ON, '--loss', '1.0']) == 1
    assert 'NO' in capsys.readouterr().out


def test_channel_and_seed_are_options(capsys):
    def table(*options):
        assert main([HEAD_ON, '--loss', '0.3', '--delay', '0.2', *options]) == 0
        # How long it takes to plan a section is no matter of the seed.
        return [row for row in capsys.readouterr().out.splitlines() if not row.startswith('sections')]
    assert table('--seed', '4') == table('--seed', '4') != table('--seed', '5')


@pytest.mark.parametrize('options', [['--faults', 'net'], ['--skew', '0.02'], ['--any-phase'], ['--no-check'],
                                     ['--faults', 'join', '--skew', '0.005', '--loss', '0.1']])
def test_faults_clocks_and_cycles_are_options(options, capsys):
    assert main([HEAD_ON, *options]) == 0
    assert '2 of 2 robots' in capsys.readouterr().out


def test_a_film_is_an_option_and_an_impossible_one_is_refused_at_once(tmp_path, capsys):
    assert main([HEAD_ON, '--film', str(tmp_path / 'mission.gif')]) == 0
    assert (tmp_path / 'mission.gif').stat().st_size > 5000
    assert str(tmp_path / 'mission.gif') in capsys.readouterr().out
    assert main([HEAD_ON, '--film', str(tmp_path / 'mission.avi')]) == 2
    printed = capsys.readouterr()
    assert '.gif' in printed.err and printed.out == ''


def test_a_scene_with_lists_of_goals_is_driven_to_the_last_of_them(capsys):
    assert main([str(FLEETS / 'rounds.yaml'), '--no-check']) == 0
    assert '8 of 8 reached' in capsys.readouterr().out


def test_a_robot_that_dies_leaves_a_mission_that_is_not_valid(capsys):
    assert main([HEAD_ON, '--faults', 'kill']) == 1
    assert 'violation' not in capsys.readouterr().out


def test_as_many_robots_as_asked_for_drive(capsys):
    assert main([str(FLEETS / 'depot.yaml'), '--robots', '2']) == 0
    assert '2 of 2 robots' in capsys.readouterr().out


def test_the_robots_of_a_scene_are_listed_without_driving(capsys):
    assert main([str(FLEETS / 'crossing.yaml'), '--list']) == 0
    map_line, robots_line = capsys.readouterr().out.splitlines()
    assert Path(map_line.removeprefix('map ')).is_file() and robots_line == 'robots 1 2 3 4'


@pytest.mark.parametrize('arguments, word', [
    (['nowhere.yaml'], 'nowhere.yaml'), ([HEAD_ON, '--robots', '5'], '5 robots'),
    ([HEAD_ON, '--robots', '0'], '0 robots'), ([HEAD_ON, '--loss', '2'], 'loss'),
    ([HEAD_ON, '--delay', '-1'], 'delay'), ([HEAD_ON, '--delay', 'nan'], 'delay'), ([HEAD_ON, '--seed', '-1'], 'seed'),
    ([HEAD_ON, '--skew', '-1'], 'clock')])
def test_bad_input_exits_with_2_and_one_sentence(arguments, word, capsys):
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert said.startswith('simulate: ') and word in said and len(said.splitlines()) == 1


@pytest.mark.parametrize('arguments', [[], [HEAD_ON, '--robots', 'many'], [HEAD_ON, '--speed', '3'],
                                       [HEAD_ON, '--faults', 'plague']])
def test_a_command_line_that_is_not_understood_exits_with_2(arguments):
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2


def test_a_scene_that_cannot_be_driven_exits_with_2(tmp_path, capsys):
    scene = tmp_path / 'wall.yaml'
    scene.write_text('boundary: {x: [0, 10], y: [0, 6]}\nobstacles: [{vertices: [[4, -1], [5, -1], [5, 7], [4, 7]]}]\n'
                     'robots: [{id: 1, start: [1, 3, 0], goal: [9, 3, 0]}]\n')
    assert main([str(scene)]) == 2
    assert 'no path' in capsys.readouterr().err


def test_an_outcome_that_cannot_be_written_exits_with_2(tmp_path, capsys):
    (tmp_path / 'file').write_text('')
    assert main([HEAD_ON, '--out', str(tmp_path / 'file')]) == 2
    assert 'simulate: ' in capsys.readouterr().err


def test_it_runs_as_a_module():
    run = subprocess.run([sys.executable, '-m', 'mobile_planning.simulate', HEAD_ON], capture_output=True, text=True,
                         cwd=Path(__file__).parents[1], timeout=120)
    assert run.returncode == 0 and 'valid' in run.stdout and run.stderr == ''
