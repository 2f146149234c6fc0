"""Every executable as a process: it starts, answers, and ends as it should."""
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from builtin_interfaces.msg import Duration
from mobile_planning_msgs.msg import PlanProgress
from mobile_planning_msgs.srv import PlanPath
from nav_msgs.srv import GetMap
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.duration import Duration as ClockDuration

from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import pose_stamped
from mobile_planning.nodes.convert_map import occupancy_grid
from mobile_planning.world.map_io import save_map
from mobile_planning.world.occupancy_grid import OccupancyGrid

REPOSITORY = Path(__file__).resolve().parents[2]
SIGNALS = [signal.SIGINT, signal.SIGTERM]
NODES = {'map_server': GetMap, 'grid_planner': PlanPath}
SERVICES = {'map_server': '/map_server/map', 'grid_planner': '/grid_planner/plan_path'}
# What a process has loaded as its start goes on: our handlers, rclpy, the middleware.
STAGES = ['handlers', '_rclpy_pybind11', 'librmw_fastrtps_cpp']


def until(condition, limit=30.0):
    """Wait until the condition holds without a ROS to spin."""
    end = time.monotonic() + limit
    while not condition():
        assert time.monotonic() < end, f'not within {limit} s'


def assert_ended_well(process):
    """Check that the process ended with code 0 and without a word too many."""
    code, out, err = process.result()
    assert code == 0, err
    assert 'Traceback' not in out + err and 'rror' not in out + err


@pytest.mark.parametrize('number', SIGNALS)
def test_a_node_starts_answers_and_stops_on_a_signal(ros, start, number):
    processes = {name: start(name) for name in NODES}
    for name, process in processes.items():
        ros.call(NODES[name], SERVICES[name])
        process.signal(number)
    for process in processes.values():
        assert_ended_well(process)


@pytest.mark.parametrize('stage', STAGES)
@pytest.mark.parametrize('number', SIGNALS)
@pytest.mark.parametrize('name', NODES)
def test_a_signal_during_the_start_ends_it_too(start, name, number, stage):
    process = start(name)
    until(lambda: process.catches(signal.SIGTERM))
    if stage != 'handlers':
        until(lambda: stage in Path(f'/proc/{process.popen.pid}/maps').read_text())
    process.signal(number)
    assert_ended_well(process)


def test_both_signals_in_a_row_end_it_well(ros, start):
    process = start('map_server')
    ros.call(GetMap, '/map_server/map')
    process.signal(signal.SIGINT)
    process.signal(signal.SIGTERM)
    assert_ended_well(process)


def test_a_middleware_that_never_lets_go_does_not_keep_the_process():
    # By PyDLL a function of C keeps all of Python waiting, as the middleware's own do.
    ended = subprocess.run([sys.executable, '-c', """
import ctypes
from mobile_planning.nodes import spin
def make():
    from rclpy.node import Node
    class Stuck(Node):
        def destroy_node(self):
            print('about to go', flush=True)
            ctypes.PyDLL(None).sleep(1000)
    return Stuck('stuck')
spin.FAREWELL = 1
spin._spin = lambda executor, is_over: None
spin.run(make, ['stuck'])
"""], capture_output=True, text=True, timeout=60)
    assert (ended.returncode, ended.stdout, ended.stderr) == (-signal.SIGALRM, 'about to go\n', '')


@pytest.mark.parametrize('arguments, words', [
    (['--ros-args', '-p', 'autostrat:=true'], 'did you mean autostart?'),
    (['--ros-args', '-p', 'autostart:=3'], 'must be a bool'),
    (['--ros-args', '--params-file', 'nowhere.yaml'], 'nowhere.yaml'),
    (['--ros-args', '-r', '__node:=a b'], ''),
    (['--ros-args', '--nonsense'], 'nonsense'),
    (['map.yaml'], "unexpected argument 'map.yaml'"),
])
def test_bad_arguments_end_it_with_code_2_and_a_sentence(start, arguments, words):
    for name, process in [(name, start(name, *arguments)) for name in NODES]:
        code, out, err = process.result()
        assert code == 2 and 'Traceback' not in err and words in err
        assert err.splitlines()[-1].startswith(f'{name}: ')


def test_a_parameter_file_for_another_node_is_no_concern_of_this_one(ros, start, tmp_path):
    (tmp_path / 'fleet.yaml').write_text('robot_1:\n  ros__parameters: {radius: 0.3}\n'
                                         'map_server:\n  ros__parameters: {frame_id: hall}\n')
    process = start('map_server', '--ros-args', '--params-file', tmp_path / 'fleet.yaml')
    ros.call(GetMap, '/map_server/map')
    process.signal(signal.SIGTERM)
    assert_ended_well(process)


def test_a_parameter_under_the_wildcard_must_be_known_to_every_node(start, tmp_path):
    (tmp_path / 'all.yaml').write_text('/**:\n  ros__parameters: {radius: 0.3, use_sim_time: false}\n')
    code, _, err = start('map_server', '--ros-args', '--params-file', tmp_path / 'all.yaml').result()
    assert code == 2 and 'map_server has no parameter radius' in err


def test_the_shipped_parameter_files_are_understood(ros, start):
    processes = {name: start(name, '--ros-args', '--params-file', REPOSITORY / 'config' / f'{name}.yaml')
                 for name in NODES}
    for name, process in processes.items():
        ros.call(NODES[name], SERVICES[name])
        process.signal(signal.SIGTERM)
        assert_ended_well(process)


def test_the_client_says_what_to_start_where_nobody_answers(start):
    code, out, err = start('plan_path', '--start', 2, 2, '--goal', 3, 3, '--timeout', 0.1).result()
    assert (code, out) == (1, '') and len(err.splitlines()) == 1
    assert 'grid_planner' in err and f'ROS_DOMAIN_ID {os.environ["ROS_DOMAIN_ID"]}' in err


def test_the_client_shows_its_usage_when_misused(start):
    misused = [['--start', 2, '--goal', 3, 3], ['--start', 2, 2, 2, 2, '--goal', 3, 3], ['--start', 2, 2],
               ['--start', 'a', 2], ['--start', 2, 2, '--goal', 3, 3, '--seed', 2**63],
               ['--start', 2, 2, '--goal', 3, 3, '--deadline', -1]]
    for process in [start('plan_path', *arguments) for arguments in misused]:
        code, _, err = process.result()
        assert code == 2 and 'usage: plan_path' in err and 'Traceback' not in err, process.popen.args


@pytest.mark.parametrize('number', SIGNALS)
def test_the_client_stops_waiting_on_a_signal(start, number):
    process = start('plan_path', '--start', 2, 2, '--goal', 3, 3, '--timeout', 100)
    until(lambda: process.catches(signal.SIGTERM))
    process.signal(number)
    code, out, err = process.result()
    assert (code, out, err) == (1, '', 'plan_path: interrupted\n')


class SlowPlanner:
    """Stands in for a planner node that has told how far it is before it answers."""

    def __init__(self, ros):
        self._ros, self._asked, self._released = ros, [], ros.executor.create_future()
        self._publisher = ros.node.create_publisher(PlanProgress, '/slow/progress', qos.PROGRESS)

        async def answer(request, response):
            self._asked.append(request)
            await self._released
            return response
        ros.node.create_service(PlanPath, '/slow/plan_path', answer, callback_group=ReentrantCallbackGroup())

    def tell(self, *messages):
        """Tell this once somebody listens and has asked, then answer."""
        self._ros.until(lambda: self._asked and self._publisher.get_subscription_count())
        for x, share in messages:
            goal = pose_stamped((x, 3, 0), 'map').pose
            self._publisher.publish(PlanProgress(planner='dstar', goal=goal, elapsed=Duration(sec=2), share=share))
        assert self._publisher.wait_for_all_acked(ClockDuration(seconds=20))
        self._released.set_result(None)


@pytest.mark.parametrize('arguments, drawn', [
    (['--progress'], [f'dstar |{"#" * 10:<40}|  25% 2.0 s', f'dstar |{"":<40}|   ?% 2.0 s']), ([], [])])
def test_the_client_draws_how_far_its_plan_is_where_somebody_sees_it(ros, start, arguments, drawn):
    slow = SlowPlanner(ros)
    client = start('plan_path', '--start', 2, 2, '--goal', 3, 3, '--node', 'slow', '--timeout', 30, *arguments)
    # The one to x = 4 is for somebody else.
    slow.tell((3.0, 0.25), (4.0, 0.5), (3.0, float('nan')))
    ros.until(lambda: client.popen.poll() is not None)
    code, _, err = client.result()
    # Each line is drawn over the one before.
    assert code == 0 and [line for line in err.splitlines() if line] == drawn


def test_a_restarted_map_server_brings_its_map_to_the_planner(ros, start, tmp_path):
    first = save_map(OccupancyGrid(np.zeros((4, 4), np.int8)), tmp_path / 'first')
    second = save_map(OccupancyGrid(np.zeros((4, 40), np.int8)), tmp_path / 'second')
    start('grid_planner')

    def outcome(x):
        return ros.call(PlanPath, '/grid_planner/plan_path', PlanPath.Request(
            start=pose_stamped((0.5, 0.5, 0), 'map'), goal=pose_stamped((x, 0.5, 0), 'map'))).error_code

    server = start('map_server', '--ros-args', '-p', f'yaml_filename:={first}')
    ros.until(lambda: outcome(3.5) == 0)
    assert outcome(30.5) == PlanPath.Response.GOAL_OUTSIDE
    server.popen.kill()
    server.result()
    assert outcome(3.5) == 0
    start('map_server', '--ros-args', '-p', f'yaml_filename:={second}')
    ros.until(lambda: outcome(30.5) == 0)
    assert occupancy_grid(ros.call_restarted(GetMap, '/map_server/map').map).shape == (4, 40)
