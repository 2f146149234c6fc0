"""How long ``plan_path`` takes over ROS, on the depot map, to a goal whose field is there, from process to process.

    . launch/environment.sh; python benchmark/service_latency.py [--calls 1000] [--checks]

Prints, for paths of several lengths, the time until the answer has arrived at the client, and the time until a client
in Python has made its objects of it, which are a dozen for each pose. Beside it: what planning took, and what the
answer takes to build anew, to write into existing messages, and to serialise. An answer of nothing but a Trigger shows
what two processes cost on this machine at this moment.
"""
from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from rclpy.impl.implementation_singleton import rclpy_implementation

DEPOT = Path(__file__).resolve().parent.parent / 'config' / 'maps' / 'depot.yaml'
GOAL = (27.0, 13.0, 0.0)
STARTS = {'30 m': (2.0, 2.0, 0.0), '15 m': (14.0, 8.0, 0.0), '1 m': (26.0, 13.0, 0.0)}
PERCENTILES = (50, 90, 99, 100)
WARM_UP = 50


def serve_trigger():
    """Answer Trigger requests until the process is ended: the least that a service can do."""
    from rclpy.node import Node
    from std_srvs.srv import Trigger

    from mobile_planning.nodes.spin import run

    def make_node():
        node = Node('trigger')
        node.create_service(Trigger, '~/trigger', lambda request, response: response)
        return node
    return run(make_node, ['trigger'])


def call(node, client, request):
    """Return the answer, and after how long it had arrived and was a Python object [s]."""
    began = time.perf_counter()
    future = client.call_async(request)
    with node.context.handle, client.handle:
        wait_set = rclpy_implementation.WaitSet(0, 0, 0, 1, 0, 0, node.context.handle)
        wait_set.clear_entities()
        wait_set.add_client(client.handle)
        wait_set.wait(30_000_000_000)
        arrived = time.perf_counter()
        _, answer = client.handle.take_response(client.srv_type.Response)
    client.remove_pending_request(future)
    assert answer is not None, 'no answer within 30 s'
    return answer, arrived - began, time.perf_counter() - began


def measure(node, client, request, calls):
    """Return the times of many calls, (calls, 2) ndarray [ms]."""
    return np.array([call(node, client, request)[1:] for _ in range(WARM_UP + calls)])[WARM_UP:] * 1e3


def message_times(path, repeats=50):
    """Return how long the message of a path takes to build, to write again and to serialise, medians [ms]."""
    from rclpy.serialization import serialize_message

    from mobile_planning.nodes.convert import path_message, path_poses

    poses, reuse, times = path_poses(path), [], []
    for _ in range(repeats):
        began = time.perf_counter()
        path_message(poses, 'map', path.header.stamp)
        built = time.perf_counter()
        message = path_message(poses, 'map', path.header.stamp, reuse)
        written = time.perf_counter()
        serialize_message(message)
        times.append((built - began, written - built, time.perf_counter() - written))
    return np.median(times, axis=0) * 1e3


def table(node, calls):
    """Measure and print."""
    from mobile_planning_msgs.srv import PlanPath
    from std_srvs.srv import Trigger

    from mobile_planning.errors import NoMap
    from mobile_planning.nodes.convert import pose_stamped, seconds

    print(f'{calls} calls each, milliseconds, field checks {"on" if checks_are_on() else "off"}')
    print(f'{"":<12}{"":>7}{"arrived":>32}{"Python objects":>32}{"of it":>9}{"message of the path":>27}')
    heads = ('poses', *2 * [f'p{percent}' for percent in PERCENTILES], 'planning', 'build', 'write', 'serialise')
    print(f'{"":<12}{heads[0]:>7}' + ''.join(f'{head:>8}' for head in heads[1:-4])
          + ''.join(f'{head:>9}' for head in heads[-4:]))

    client = node.create_client(Trigger, '/trigger/trigger')
    assert client.wait_for_service(30), 'the trigger did not start'
    row('Trigger', '', measure(node, client, Trigger.Request(), calls))

    client = node.create_client(PlanPath, '/grid_planner/plan_path')
    assert client.wait_for_service(30), 'grid_planner did not start'
    for name, start in STARTS.items():
        request = PlanPath.Request(start=pose_stamped(start, 'map'), goal=pose_stamped(GOAL, 'map'))
        while (answer := call(node, client, request)[0]).error_code == NoMap.code:
            pass
        assert answer.error_code == 0, answer.error_msg
        times, answer = measure(node, client, request, calls), call(node, client, request)[0]
        row(name, len(answer.path.poses), times, seconds(answer.planning_time) * 1e3, *message_times(answer.path))


def row(name, poses, times, *others):
    """Print one row of the table."""
    waits = np.percentile(times, PERCENTILES, axis=0).T.ravel()
    print(f'{name:<12}{poses:>7}' + ''.join(f'{number:>8.2f}' for number in waits)
          + ''.join(f'{number:>9.2f}' for number in others), flush=True)


def checks_are_on():
    """Return whether messages check their fields."""
    return os.environ.get('ROS_PYTHON_CHECK_FIELDS') == '1'


def main():
    """Start the servers, measure, and end them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--calls', type=int, default=1000, help='of each kind (1000)')
    parser.add_argument('--checks', action='store_true', help='with the field checks of messages, as in the tests')
    parser.add_argument('--serve-trigger', action='store_true', help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve_trigger:
        return serve_trigger()
    os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1' if options.checks else '0'

    import rclpy

    from mobile_planning.nodes.spin import SETTLING

    bin_folder = Path(sys.executable).parent
    servers = [subprocess.Popen(command, stderr=subprocess.DEVNULL) for command in (
        [bin_folder / 'map_server', '--ros-args', '-p', f'yaml_filename:={DEPOT}'],
        [bin_folder / 'grid_planner'],
        [sys.executable, __file__, '--serve-trigger'])]
    time.sleep(SETTLING + 1.0)
    rclpy.init()
    node = rclpy.create_node('service_latency')
    try:
        table(node, options.calls)
    finally:
        for server in servers:
            server.terminate()
        for server in servers:
            server.wait(10)
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == '__main__':
    sys.exit(main())
