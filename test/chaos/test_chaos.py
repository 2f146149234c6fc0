"""The hosts, the switch between them, what is read from the recordings, and what is left of it all."""
import json
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path
from time import monotonic

import numpy as np
import psutil
import pytest
from history import History
from hosts import Host, NoHosts, require_hosts
from outcomes import Outcome, Rows, table
from storms import Blow, Storm, matrix
from switch import Switch, Weather

REPOSITORY = Path(__file__).resolve().parents[2]

#: Waits for one datagram more than 1 s, and prints how many came and how many of them were the same.
_LISTEN = '''
import collections, socket
bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
bound.bind(('10.77.0.2', 5000))
print('ready', flush=True)
bound.settimeout(8.0)
seen = collections.Counter()
try:
    while True:
        seen[bound.recv(100)] += 1
        bound.settimeout(1.0)
except TimeoutError:
    print(len(seen), sum(seen.values()), flush=True)
'''
_SPEAK = '''
import socket, time
speaker = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
for number in range(400):
    speaker.sendto(str(number).encode(), ('10.77.0.2', 5000))
    time.sleep(0.0005)
'''


@pytest.fixture
def hosts():
    try:
        require_hosts()
    except NoHosts as reason:
        pytest.skip(f'this machine cannot play several hosts: {reason}')
    made = [Host(1), Host(2)]
    yield made
    for host in made:
        host.close()


def heard(hosts, switch, weather, folder):
    """Return how many of 400 datagrams the second host heard, and how many it got with all copies."""
    switch.weather = weather
    log = folder / 'heard.log'
    log.unlink(missing_ok=True)
    listener = hosts[1].start([sys.executable, '-c', _LISTEN], os.environ, str(log))
    deadline = monotonic() + 30.0
    while not (log.exists() and 'ready' in log.read_text()):
        assert monotonic() < deadline and listener.poll() is None, log.read_text()
        threading.Event().wait(0.01)
    assert hosts[0].start([sys.executable, '-c', _SPEAK], os.environ, str(folder / 'spoke.log')).wait(30.0) == 0
    assert listener.wait(60.0) == 0
    different, all_of_them = map(int, log.read_text().split('\n')[1].split())
    return different, all_of_them


def test_the_switch_carries_everything_in_calm_weather_and_loses_and_doubles_its_share(hosts, tmp_path):
    with Switch(hosts, seed=1) as switch:
        assert heard(hosts, switch, Weather(), tmp_path)[0] == 400
        different, _ = heard(hosts, switch, Weather(loss=0.5), tmp_path)
        assert 140 < different < 270
        _, copies = heard(hosts, switch, Weather(duplicates=0.5), tmp_path)
        assert 540 < copies < 680
        assert switch.counters.lost > 100 and switch.counters.duplicated > 100


def test_a_host_behind_a_cut_hears_nothing(hosts, tmp_path):
    with Switch(hosts) as switch:
        assert heard(hosts, switch, Weather(), tmp_path)[0] == 400, 'so that they know each other\'s addresses'
        assert heard(hosts, switch, Weather(islands=(frozenset({2}),)), tmp_path)[0] == 0
        assert switch.counters.cut >= 400


def test_processes_of_a_host_and_its_network_are_gone_with_it(hosts, tmp_path):
    process = hosts[0].start(['sleep', '60'], os.environ, str(tmp_path / 'log'))
    deadline = monotonic() + 30.0
    while os.readlink(f'/proc/{process.pid}/ns/net') == os.readlink('/proc/self/ns/net'):
        assert monotonic() < deadline
        threading.Event().wait(0.01)
    process.kill()
    assert process.wait(10.0) == -9


def homes():
    """Return the network namespace of each process."""
    found = {}
    for process in psutil.process_iter():
        try:
            found[process] = os.readlink(f'/proc/{process.pid}/ns/net')
        except OSError:
            continue
    return found


def knows(process, folder):
    """Whether the folder is on the command line of a process."""
    try:
        return any(str(folder) in word for word in process.cmdline())
    except psutil.Error:
        return False


@pytest.mark.skipif(not (REPOSITORY / '.venv' / 'stamps' / 'kernels').exists(), reason='launch/setup.sh was not run')
@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_and_no_network_is_left_of_a_run_that_is_ended(hosts, tmp_path, number):
    scene = REPOSITORY / 'config' / 'fleets' / 'head_on.yaml'
    run = subprocess.Popen(
        ['bash', '-c', '. launch/environment.sh; exec python test/chaos/chaos.py "$@"', 'chaos', '--scene', scene,
         '--only', 'calm', '--out', tmp_path], cwd=REPOSITORY)
    deadline = monotonic() + 60.0
    made = set()
    while len(made) < 3:
        assert monotonic() < deadline and run.poll() is None
        made |= {home for process, home in homes().items() if knows(process, tmp_path)} - {homes()[psutil.Process()]}
        threading.Event().wait(0.05)
    run.send_signal(number)
    assert run.wait(30.0) == {signal.SIGINT: 130, signal.SIGTERM: 143, signal.SIGKILL: -9}[number]
    while left := [process for process, home in homes().items() if home in made or knows(process, tmp_path)]:
        assert monotonic() < deadline + 30.0, left
        threading.Event().wait(0.05)
    assert not (tmp_path / 'rows.jsonl').exists()


def test_rows_that_have_ended_are_known_again_and_others_are_not(tmp_path):
    rows, storm = Rows(tmp_path / 'rows.jsonl', 'scene, seed 1'), Storm('loss', Weather(loss=0.1))
    ended = Outcome('loss', '2/2', 3.0, 9.5, 0.51, np.inf, 1.25, 4.5, np.inf, '9 frames', ('one', 'two'))
    rows.add(storm, ended)
    again = Rows(tmp_path / 'rows.jsonl', 'scene, seed 1')
    assert storm in again and again[storm] == ended
    assert Storm('loss', Weather(loss=0.2)) not in again
    assert storm not in Rows(tmp_path / 'rows.jsonl', 'scene, seed 2')
    assert '1.25' in table([again[storm]]) and 'two' in table([again[storm]])


@pytest.mark.parametrize('wrong', [{'loss': 1.5}, {'duplicates': -0.1}, {'delay': -1.0}, {'rate': 0.0}])
def test_weather_that_cannot_be_is_refused(wrong):
    with pytest.raises(ValueError, match='out of range'):
        Weather(**wrong)


def test_islands_part_hosts_from_all_others():
    weather = Weather(islands=(frozenset({1, 2}), frozenset({3})))
    assert [weather.parts(a, b) for a, b in ((1, 2), (1, 3), (3, 4), (4, 5))] == [False, True, True, False]


def test_one_seed_draws_one_matrix_and_every_blow_hits_a_process_that_runs():
    robots, rows = [3, 5, 9], matrix([3, 5, 9], 7)
    assert rows == matrix(robots, 7) and rows != matrix(robots, 8)
    assert len({row.name for row in rows}) == len(rows)
    targets = {f'robot_{robot}' for robot in robots} | {'world_sim', 'map_server'}
    assert all(isinstance(blow, Blow) and blow.target in targets for row in rows for blow in row.blows)


def record(kind, heard, **fields):
    return json.dumps({'kind': kind, 'heard': heard, **fields})


def said(heard, robot, epoch, plan, x, sequence, **fields):
    """A robot that rests at (x, 0)."""
    return record('robot', heard, robot=robot, epoch=epoch, sequence=sequence, plan=plan, mode=1, step=0.25,
                  first_knot=4 * int(heard), points=[x, 0.0] * 4, heading=0.0, final_heading=float('nan'),
                  reverse=False, done=False, **fields)


def history(tmp_path, *hosts):
    files = []
    for number, lines in enumerate(hosts, 1):
        files.append((number, tmp_path / f'host_{number}.jsonl'))
        files[-1][1].write_text('\n'.join(lines) + '\n{"kind": "robot", "hea')
    return History.read(files)


def test_recordings_of_all_hosts_make_one_solution_for_each_robot(tmp_path):
    found = history(tmp_path, [record('mission', 1.0, state=1, start=3.0), said(4.0, 1, 10, 0, 0.0, 1)],
                    [said(6.0, 1, 10, 0, 0.0, 3), said(7.0, 1, 10, 1, 0.0, 4), said(9.0, 1, 12, 0, 0.0, 1),
                     said(4.1, 2, 10, 0, 5.0, 1)])
    assert found.start == 3.0
    solutions = found.solutions()
    assert [plan.first_knot for plan in solutions[1].plans] == [16, 28, 36], 'each plan by its first message'
    assert np.isnan(solutions[1].commits).all() and len(solutions[2].plans) == 1


def test_a_history_tells_when_somebody_was_missed_and_came_back(tmp_path):
    found = history(tmp_path, [record('status', 10.5, robot=2, silent=[]),
                               record('status', 11.25, robot=2, silent=[1])],
                    [record('status', 11.5, robot=3, silent=[1]), said(14.0, 1, 10, 0, 0.0, 1),
                     said(14.5, 2, 1, 0, 0, 9)])
    assert found.noticed(1, 10.0, by=[2, 3]) == 1.5
    assert found.noticed(1, 10.0, by=[2, 3, 4]) == np.inf
    assert found.back(1, 10.0) == 4.0
    assert found.heard_again(13.0, {1: 1, 2: 2}) == np.inf, 'robot 2 was not heard on host 1'


def test_the_least_distance_between_bodies_is_taken_between_their_samples_too(tmp_path):
    found = history(tmp_path, [record('body', 0.0, robot=1, time=0.0, x=0.0, y=0.0),
                               record('body', 0.0, robot=1, time=2.0, x=2.0, y=0.0)],
                    [record('body', 0.0, robot=2, time=1.0, x=1.0, y=0.5),
                     record('body', 0.0, robot=2, time=3.0, x=1.0, y=0.5)])
    assert found.least_gap() == pytest.approx(0.5)
