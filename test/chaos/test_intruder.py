"""Who is let in by a host that is to keep to itself, tried from another host; and that whoever is to be, is."""
import os
import sys
import time
from pathlib import Path

import pytest

pytest.importorskip('rclpy', reason='rclpy is not installed: nobody can be let in')

from hosts import Host, NoHosts, require_hosts  # noqa: E402
from switch import Switch, Weather  # noqa: E402

LAUNCH = Path(__file__).resolve().parents[2] / 'launch'
LOOPBACK = {'FASTDDS_DEFAULT_PROFILES_FILE': str(LAUNCH / 'loopback.xml'),
            'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SYSTEM_DEFAULT'}
LOCALHOST = {'ROS_AUTOMATIC_DISCOVERY_RANGE': 'LOCALHOST'}
SUBNET = {'FASTDDS_DEFAULT_PROFILES_FILE': str(LAUNCH / 'hosts.xml'), 'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}
# Says its own name over and over, or once at great length for all who come later, and writes down each that it hears.
CHAT = '''
import signal, sys, rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
rclpy.init()
node, heard, length = Node(sys.argv[1]), set(), int(sys.argv[2])
profile = QoSProfile(depth=1 if length else 10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
publisher = node.create_publisher(String, '/chat', profile)
def hear(message):
    if message.data not in heard:
        heard.add(message.data)
        print('heard', message.data.strip(), flush=True)
node.create_subscription(String, '/chat', hear, profile)
def say():
    publisher.publish(String(data=sys.argv[1].ljust(length)))
say() if length else node.create_timer(0.1, say)
try:
    rclpy.spin(node)
except rclpy.executors.ExternalShutdownException:
    signal.alarm(10)
    node.destroy_node()
'''


class Chat:
    """Processes that talk, each on its host in its environment."""

    def __init__(self, hosts, switch, folder):
        self._hosts, self.switch, self._folder, self.processes = hosts, switch, folder, []

    def start(self, name, host, environment, length=0):
        inherited = {key: value for key, value in os.environ.items()
                     if key not in ('FASTDDS_DEFAULT_PROFILES_FILE', 'ROS_AUTOMATIC_DISCOVERY_RANGE')}
        command = [sys.executable, '-c', CHAT, name, str(length)]
        self.processes.append(self._hosts[host].start(command, {**inherited, **environment},
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
    processes = []
    try:
        with Switch(list(hosts.values())) as switch:
            chat = Chat(hosts, switch, tmp_path)
            processes = chat.processes
            yield chat
    finally:
        # Whoever is killed leaves its shared memory behind. Only where Fast DDS never comes to an end, SIGALRM does, as
        # with nodes.
        for process in processes:
            process.terminate()
        for process in processes:
            assert process.wait(30.0) is not None
        for host in hosts.values():
            host.close()


def test_the_profile_keeps_out_whom_the_discovery_range_lets_in(chat):
    chat.start('closed', 1, LOOPBACK)
    chat.start('local', 1, LOCALHOST)
    chat.start('intruder', 2, {'ROS_STATIC_PEERS': '10.77.0.1'})
    # What is to be shown not to happen has had its time when the same has happened to others.
    for name, other in (('intruder', 'local'), ('local', 'intruder'), ('closed', 'local'), ('local', 'closed')):
        chat.until_heard(name, other)
    assert 'closed' not in chat.heard('intruder')
    assert 'intruder' not in chat.heard('closed')


def test_the_profile_for_several_hosts_lets_them_meet(chat):
    chat.start('one', 1, SUBNET)
    chat.start('other', 2, SUBNET)
    chat.until_heard('one', 'other')
    chat.until_heard('other', 'one')


def test_what_is_as_large_as_a_map_arrives_where_one_packet_in_five_is_lost(chat):
    chat.switch.weather = Weather(loss=0.2)
    chat.start('server', 1, SUBNET, 180_000)
    chat.start('robot', 2, SUBNET, 180_000)
    chat.until_heard('robot', 'server')
    chat.until_heard('server', 'robot')
    assert chat.switch.counters.lost > 30
