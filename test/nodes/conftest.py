"""Nodes under test: in process with a context and an executor of their own, and as processes."""
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: the nodes are not tested')
pytest.importorskip('mobile_planning_msgs', reason='msg_defs is not built: the nodes are not tested')

import rclpy  # noqa: E402
from mobile_planning.nodes.executor import make_executor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402

from mobile_planning.world.map_io import save_map  # noqa: E402
from mobile_planning.world.occupancy_grid import OccupancyGrid  # noqa: E402

# Nothing here takes as long on an idle machine as a busy one may need [s].
PATIENCE = 30.0


def spin_until(executor, condition, limit=PATIENCE):
    """Spin until the condition holds, and fail after ``limit`` [s]; return what the condition returned."""
    end = time.monotonic() + limit
    while not (result := condition()):
        assert time.monotonic() < end, f'not within {limit} s'
        executor.spin_once(timeout_sec=0.02)
    return result


class Ros:
    """A ROS context, an executor, a node to ask from, and what a test does with them."""

    def __init__(self):
        self.context = rclpy.Context()
        self.context.init([])
        self.executor = make_executor(context=self.context)
        self._nodes = []
        self.node = self.add(Node, name='tester')

    def add(self, make, name=None, **parameters):
        """Return the node, or the list of nodes, made by ``make`` with these parameters, spun by the executor."""
        arguments = {'context': self.context,
                     'parameter_overrides': [Parameter(key, value=value) for key, value in parameters.items()]}
        made = make(name, **arguments) if name else make(**arguments)
        for node in made if isinstance(made, list) else [made]:
            self._nodes.append(node)
            self.executor.add_node(node)
        return made

    def remove(self, node):
        """End one node."""
        self.executor.remove_node(node)
        self._nodes.remove(node)
        node.destroy_node()

    def until(self, condition, limit=PATIENCE):
        """Spin until the condition holds."""
        return spin_until(self.executor, condition, limit)

    def send(self, kind, name, request=None):
        """Return the future of a request."""
        client = self.node.create_client(kind, name)
        self.until(client.service_is_ready)
        return client.call_async(request or kind.Request())

    def call(self, kind, name, request=None):
        """Return the answer to a request."""
        future = self.send(kind, name, request)
        self.until(future.done)
        return future.result()

    def call_restarted(self, kind, name):
        """Return the answer of a server that took the place of a killed one.

        The dead one seems to be there for seconds, and takes requests with it: the request is repeated.
        """
        client, sent = self.node.create_client(kind, name), []

        def answered():
            if not sent or time.monotonic() > sent[-1][0] + 1.0:
                sent.append((time.monotonic(), client.call_async(kind.Request())))
            return next((future for _, future in sent if future.done()), None)

        return self.until(answered).result()

    def listen(self, kind, topic, profile):
        """Return a list that fills with the messages of a topic."""
        messages = []
        self.node.create_subscription(kind, topic, messages.append, profile)
        return messages

    def close(self):
        """End everything."""
        for node in self._nodes:
            node.destroy_node()
        self.executor.shutdown()
        self.context.try_shutdown()


@pytest.fixture
def ros():
    """Return a `Ros` for this test alone."""
    ros = Ros()
    yield ros
    ros.close()


@pytest.fixture
def grid():
    """Return a map of 1 m x 0.6 m with a wall that has a gap, not square, turned and moved."""
    data = np.zeros((6, 10), np.int8)
    data[:4, 5] = 100
    data[0, 0] = -1
    return OccupancyGrid(data, 0.1, (2.0, 3.0, 0.5))


@pytest.fixture
def map_file(grid, tmp_path):
    """Return the YAML file of the map."""
    return save_map(grid, tmp_path / 'wall', 'png')


class Process:
    """An executable as a process of its own, in the group of the tests: what ends them all ends it too."""

    def __init__(self, name, *arguments):
        executable = Path(sys.executable).parent / name
        if not executable.exists():
            pytest.skip(f'{executable} is not installed')
        self.popen = subprocess.Popen([executable, *map(str, arguments)], stdout=subprocess.PIPE,
                                      stderr=subprocess.PIPE, text=True)

    def catches(self, number):
        """Return whether the process has a handler for a signal by now."""
        assert self.popen.poll() is None, self.result()
        status = Path(f'/proc/{self.popen.pid}/status').read_text()
        caught = int(status.split('SigCgt:')[1].split()[0], 16)
        return bool(caught >> (number - 1) & 1)

    def signal(self, number):
        """Send a signal."""
        self.popen.send_signal(number)

    def result(self, timeout=PATIENCE):
        """Return the exit code and both outputs once the process has ended."""
        try:
            out, err = self.popen.communicate(timeout=timeout)
        except subprocess.TimeoutExpired:
            self.kill()
            raise
        return self.popen.returncode, out, err

    def kill(self):
        """End the process if it still runs."""
        self.popen.kill()
        self.popen.communicate(timeout=10)


@contextmanager
def started():
    """Give a function that starts an executable; all are killed at the end."""
    processes = []

    def start(name, *arguments):
        processes.append(Process(name, *arguments))
        return processes[-1]

    try:
        yield start
    finally:
        for process in processes:
            process.kill()


@pytest.fixture
def start():
    """Return a function that starts an executable for this test alone."""
    with started() as start:
        yield start


@pytest.fixture(scope='module')
def start_once():
    """Return a function that starts an executable for all tests of a file."""
    with started() as start:
        yield start
