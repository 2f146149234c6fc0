"""Who is let in by a host that is to keep to itself, tried from another host."""
import os
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: nobody can be let in')

from hosts import Host, NoHosts, require_hosts  # noqa: E402
from switch import Switch  # noqa: E402

LAUNCH = Path(__file__).resolve().parents[2] / 'launch'
LOOPBACK = {'FASTDDS_DEFAULT_PROFILES_FILE': str(LAUNCH / 'loopback.xml'),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SYSTEM_DEFAULT'}
LOCALHOST = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
# Says its own name over and over, and writes down each name that it hears.
CHAT = '''
import sys, rclpy
from rclpy.node import Node
from std_msgs.msg import String
rclpy.init()
node, heard = Node(sys.argv[1]), set()
publisher = node.create_publisher(String, '/chat', 10)
def hear(message):
    if message.data not in heard:
        heard.add(message.data)
        print('heard', message.data, flush=True)
node.create_subscription(String, '/chat', hear, 10)
node.create_timer(0.1, lambda: publisher.publish(String(data=sys.argv[1])))
try:
    rclpy.spin(node)
except rclpy.executors.ExternalShutdownException:
    node.destroy_node()
'''


class Chat:
    """Processes that talk, each on its host in its environment."""

    def __init__(self, hosts, folder):
        self._hosts, self._folder, self.processes = hosts, folder, []

    def start(self, name, host, environment):
        inherited = {key: value for key, value in os.environ.items()
                     if key not in ('FASTDDS_DEFAULT_PROFILES_FILE', 'ROS_AUTOMATIC_DISCOVERY_RANGE')}
        self.processes.append(self._hosts[host].start([sys.executable, '-c', CHAT, name], {**inherited, **environment},
                                                      str(self._folder / name)))

    def heard(self, name):
        return {line.split()[1] for line in (self._folder / name).read_text().splitlines() if line.startswith('heard')}

    def until_heard(self, name, other):
        end = time.monotonic() + 60.0
        while other not in self.heard(name):
            assert time.monotonic() < end, f'{name} has not heard {other}: {(self._folder / name).read_text()}'
            time.sleep(0.05)


@pytest.fixture
def chat(tmp_path):
    """Return a `Chat` on two hosts, 10.77.0.1 and 10.77.0.2."""
    try:
        require_hosts()
    except NoHosts as reason:
        pytest.skip(f'this machine cannot play several hosts: {reason}')
    hosts = {number: Host(number) for number in (1, 2)}
    chat = Chat(hosts, tmp_path)
    try:
        with Switch(list(hosts.values())):
            yield chat
    finally:
        # Whoever is killed leaves its shared memory behind.
        for process in chat.processes:
            process.terminate()
        for process in chat.processes:
            assert process.wait(30.0) is not None
        for host in hosts.values():
            host.close()


def test_the_profile_keeps_out_whom_the_discovery_range_lets_in(chat):
    chat.start('closed', 1, LOOPBACK)
    chat.start('local', 1, LOCALHOST)
    chat.start('intruder', 2, {'ROS_STATIC_PEERS': '10.77.0.1'})
    # What is to be shown not to happen has had its time when the same has happened to others.
    chat.until_heard('intruder', 'local')
    chat.until_heard('closed', 'local')
    chat.until_heard('local', 'intruder')
    assert chat.heard('intruder') == {'intruder', 'local'}
    assert 'intruder' not in chat.heard('closed')


def test_the_profile_for_several_hosts_lets_them_meet(chat):
    environment = {'FASTDDS_DEFAULT_PROFILES_FILE': str(LAUNCH / 'hosts.xml'),
                   'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
    chat.start('one', 1, environment)
    chat.start('other', 2, environment)
    chat.until_heard('one', 'other')
    chat.until_heard('other', 'one')
