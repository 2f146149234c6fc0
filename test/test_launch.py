"""The scripts that start a fleet: how they end, whatever happens, and that nothing stays behind."""
import json
import os
import shutil
import signal
import subprocess
import time
from itertools import count
from pathlib import Path

import numpy as np
import psutil
import pytest
from PIL import Image

REPOSITORY = Path(__file__).resolve().parent.parent
HEAD_ON = REPOSITORY / 'config' / 'fleets' / 'head_on.yaml'
CROSSING = REPOSITORY / 'config' / 'fleets' / 'crossing.yaml'
# Nothing takes as long on an idle machine as a busy one may need [s].
PATIENCE = 120.0

pytestmark = pytest.mark.skipif(not (REPOSITORY / '.venv' / 'stamps' / 'kernels').exists(),
                                reason='launch/setup.sh has not been run')
_runs = count(int(os.environ['ROS_DOMAIN_ID']))


class Launch:
    """A script in a session of its own, as in a terminal of its own."""

    def __init__(self, out, *arguments):
        self.out = out
        # Each run has a domain of its own, so that none meets what another leaves on the network.
        environment = {**os.environ, 'ROS_DOMAIN_ID': str(next(_runs) % 101)}
        self.popen = subprocess.Popen([REPOSITORY / 'launch' / arguments[0], *map(str, arguments[1:])], text=True,
                                      stdout=subprocess.PIPE, stderr=subprocess.PIPE, start_new_session=True,
                                      env=environment)

    def processes(self):
        """Return everything that runs in the script's session: the processes and their command lines."""
        found = {}
        for process in psutil.process_iter():
            try:
                if os.getsid(process.pid) == self.popen.pid:
                    found[process] = process.cmdline()
            except (ProcessLookupError, psutil.Error):
                # It has just ended.
                pass
        return found

    def node(self, name):
        """Return the process of a node, once there is one."""
        return self.until(lambda: next((process for process, words in self.processes().items() if any(
            word == f'__node:={name}' or Path(word).name == name for word in words)), None))

    def log(self, name):
        """Return what a node has written."""
        path = self.out / 'log' / f'{name}.log'
        return path.read_text() if path.exists() else ''

    def last_words(self):
        """Return the end of what each node has written, for whoever is to find out what happened."""
        return {log.name: log.read_text()[-300:] for log in sorted((self.out / 'log').glob('*.log'))}

    def until(self, condition):
        """Wait until the condition holds and return what it returned."""
        end = time.monotonic() + PATIENCE
        while not (result := condition()):
            assert self.popen.poll() is None, (self.result(), self.last_words())
            assert time.monotonic() < end, (f'not within {PATIENCE} s', self.last_words())
            time.sleep(0.05)
        return result

    def until_driving(self):
        """Wait until the mission has started and a robot knows it."""
        self.until(lambda: 'started' in self.log('world_sim') and 'started' in self.log('robot_1'))

    def result(self):
        """Return the exit code and both outputs once the script has ended."""
        out, err = self.popen.communicate(timeout=PATIENCE)
        return self.popen.returncode, out, err

    def assert_nothing_is_left(self):
        """Check that no process of the session lives on, and that no log shows a traceback."""
        assert self.processes() == {}
        for log in (self.out / 'log').glob('*.log'):
            assert 'Traceback' not in log.read_text() and 'terminate called' not in log.read_text()

    def kill(self):
        """End what still runs."""
        for process in self.processes():
            process.kill()
        self.popen.communicate(timeout=PATIENCE)


@pytest.fixture
def launch(tmp_path):
    """Return a function that starts a script with its output in a folder of this test; all is ended at the end."""
    launched = []

    def launch(*arguments):
        launched.append(Launch(tmp_path / 'out', *arguments, '--out', tmp_path / 'out'))
        return launched[-1]

    yield launch
    for one in launched:
        one.kill()


def test_the_demo_is_a_valid_mission_of_four_robots_with_a_report_and_a_picture(launch):
    demo = launch('demo.sh')
    demo.until_driving()
    names = {label for label in ('map_server', 'grid_planner', 'robot_1', 'robot_2', 'robot_3', 'robot_4', 'world_sim')
             if (demo.out / 'log' / f'{label}.log').exists()}
    assert len(names) == 7
    for process in demo.processes():
        # Nobody else hears of it, and no shared memory outlives a process that is killed.
        assert {connection.laddr.ip for connection in process.net_connections('udp')} <= {'127.0.0.1', '239.255.0.1'}
        assert '/dev/shm/fast' not in Path(f'/proc/{process.pid}/maps').read_text()
    code, out, err = demo.result()
    assert code == 0 and err == '' and 'arrived                 4 of 4 robots' in out
    report = json.loads((demo.out / 'report.json').read_text())
    assert report['valid'] and (report['robots'], report['arrived'], report['violations']) == (4, 4, [])
    assert report['min_separation'] > 0.4 and report['min_obstacle_clearance'] > 0 and report['mission_time'] < 80
    picture = np.asarray(Image.open(demo.out / 'mission.png').convert('RGB'))
    assert min(picture.shape[:2]) > 300 and len(np.unique(picture.reshape(-1, 3), axis=0)) > 20
    demo.assert_nothing_is_left()


def interrupt_script(fleet, number):
    """Signal the script alone, as another program would."""
    fleet.popen.send_signal(number)


def interrupt_terminal(fleet, number):
    """Signal every process, as a terminal does."""
    os.killpg(fleet.popen.pid, number)


@pytest.mark.parametrize('interrupt, number, code', [
    (interrupt_script, signal.SIGINT, 130), (interrupt_script, signal.SIGTERM, 143),
    (interrupt_terminal, signal.SIGINT, 130), (interrupt_terminal, signal.SIGHUP, 129)])
def test_a_signal_in_mid_mission_ends_everything(launch, interrupt, number, code):
    fleet = launch('fleet.sh', HEAD_ON)
    fleet.until_driving()
    interrupt(fleet, number)
    assert fleet.result()[0] == code
    fleet.assert_nothing_is_left()


@pytest.mark.parametrize('interrupt, number, code', [
    (interrupt_script, signal.SIGTERM, 143), (interrupt_terminal, signal.SIGINT, 130)])
def test_a_signal_during_the_start_ends_everything(launch, interrupt, number, code):
    fleet = launch('fleet.sh', CROSSING, '--robots', 2)
    fleet.node('robot_2')
    interrupt(fleet, number)
    got, _, err = fleet.result()
    assert got == code and 'Traceback' not in err
    assert not (fleet.out / 'log' / 'robot_3.log').exists()
    fleet.assert_nothing_is_left()


@pytest.mark.skipif(shutil.which('setpriv') is None, reason='setpriv of util-linux is not installed')
def test_a_script_that_is_killed_leaves_nothing_behind(launch):
    fleet = launch('fleet.sh', HEAD_ON)
    fleet.until_driving()
    fleet.popen.kill()
    fleet.popen.wait()
    end = time.monotonic() + PATIENCE
    while fleet.processes() and time.monotonic() < end:
        time.sleep(0.05)
    fleet.assert_nothing_is_left()


@pytest.mark.parametrize('stage', ['start', 'mission'])
def test_a_robot_that_dies_is_reported_and_ends_everything(launch, stage):
    fleet = launch('fleet.sh', HEAD_ON)
    victim = fleet.node('robot_2')
    if stage == 'mission':
        fleet.until_driving()
    victim.kill()
    code, _, err = fleet.result()
    assert code == 1 and 'fleet: robot_2 ended early with exit code 137' in err
    fleet.assert_nothing_is_left()


def test_a_world_sim_that_ends_before_it_has_judged_is_no_success(launch):
    fleet = launch('fleet.sh', HEAD_ON)
    fleet.until(lambda: 'waiting' in fleet.log('world_sim'))
    fleet.node('world_sim').terminate()
    code, _, err = fleet.result()
    assert code == 1 and 'world_sim ended early with exit code 0' in err
    fleet.assert_nothing_is_left()


def test_a_mission_that_is_not_valid_ends_with_1_and_its_report(launch, tmp_path):
    scene = tmp_path / "it's #1: hopeless.yaml"
    scene.write_text(HEAD_ON.read_text().replace('timeout: 40.0', 'timeout: 0.5'))
    fleet = launch('fleet.sh', scene)
    code, out, _ = fleet.result()
    assert code == 1 and 'valid                   NO' in out and 'not finished within 0.5 s' in out
    assert not json.loads((fleet.out / 'report.json').read_text())['valid'] and (fleet.out / 'mission.png').exists()
    fleet.assert_nothing_is_left()


def test_a_robot_without_room_ends_it_with_2_and_the_reason(launch, tmp_path):
    scene = tmp_path / 'wall.yaml'
    scene.write_text('boundary: {x: [0, 4], y: [0, 4]}\nobstacles: [{position: [1, 1], radius: 0.5}]\n'
                     'robots: [{id: 5, start: [1, 1, 0], goal: [2, 3, 0]}]')
    fleet = launch('fleet.sh', scene)
    code, _, err = fleet.result()
    assert code == 2 and 'start (1.000, 1.000) of robot 5' in err
    fleet.assert_nothing_is_left()


@pytest.mark.parametrize('arguments, words', [
    (['demo.sh', 'extra'], 'usage'), (['fleet.sh'], 'usage'), (['fleet.sh', HEAD_ON, HEAD_ON], 'usage'),
    (['fleet.sh', HEAD_ON, '--robots', 'x'], 'usage'), (['fleet.sh', HEAD_ON, '--robots', '0'], 'usage'),
    (['fleet.sh', HEAD_ON, '--fast'], 'usage'), (['fleet.sh', 'nowhere.yaml'], 'there is no scene nowhere.yaml'),
    (['fleet.sh', HEAD_ON, '--robots', '3'], '3 robots are asked for'),
    (['fleet.sh', REPOSITORY / 'setup.cfg'], 'is not YAML')])
def test_bad_usage_and_bad_scenes_end_with_2_and_a_sentence(launch, arguments, words):
    fleet = launch(*arguments)
    code, out, err = fleet.result()
    assert (code, out) == (2, '') and words in err and 'Traceback' not in err
    assert not fleet.out.exists()


def test_a_profile_that_takes_no_effect_ends_it_with_2_and_the_reason(launch, tmp_path):
    broken = tmp_path / 'broken'
    shutil.copytree(REPOSITORY / 'launch', broken / 'launch')
    (broken / '.venv').symlink_to(REPOSITORY / '.venv')
    # What is set up is the original.
    (broken / 'launch' / 'setup.sh').write_text('#!/bin/sh\n')
    profile = broken / 'launch' / 'loopback.xml'
    profile.write_text(profile.read_text().replace('</profiles>', '</profile>'))
    fleet = launch(broken / 'launch' / 'fleet.sh', HEAD_ON)
    code, _, err = fleet.result()
    assert code == 2 and 'other hosts could talk to this process' in err and f'{profile} did not take effect' in err
    fleet.assert_nothing_is_left()


def test_a_folder_that_cannot_be_made_ends_it_with_2(launch, tmp_path):
    (tmp_path / 'out').write_text('a file')
    code, _, err = launch('fleet.sh', HEAD_ON).result()
    assert code == 2 and str(tmp_path / 'out') in err
