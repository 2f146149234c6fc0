"""A node that other hosts could talk to, though they are not to, refuses to start."""
import socket
import subprocess
import sys
from ipaddress import ip_address
from pathlib import Path

import pytest

from mobile_planning.errors import PlanningError
from mobile_planning.nodes.reach import VARIABLE, listening, require_reach

NO_PROFILES = {'missing': None, 'broken': '<profiles><participant', 'empty': '<?xml version="1.0"?>\n<profiles/>',
               'misspelt': '<?xml version="1.0"?>\n<profiles><transport_descriptors><transport_descriptor>'
                           '<transport_id>a</transport_id><type>UDPv4</type><interfaceWhitelist>'
                           '<address>127.0.0.1</address></interfaceWhitelist></transport_descriptor>'
                           '</transport_descriptors></profiles>'}


@pytest.fixture
def bound():
    """Return a function that binds a socket until the end of the test and returns its port."""
    opened = []

    def bound(address, kind=socket.SOCK_DGRAM):
        family = socket.AF_INET6 if ip_address(address).version == 6 else socket.AF_INET
        try:
            opened.append(socket.socket(family, kind))
            opened[-1].bind((address, 0))
        except OSError as error:
            pytest.skip(f'{address} cannot be bound here: {error}')
        return opened[-1]

    yield bound
    for one in opened:
        one.close()


@pytest.mark.parametrize('address', ['127.0.0.1', '127.0.0.53', '239.255.0.1', '::1', '::ffff:127.0.0.1'])
def test_sockets_that_only_this_host_reaches_are_allowed(bound, monkeypatch, address):
    monkeypatch.setenv(VARIABLE, 'host')
    port = bound(address).getsockname()[1]
    assert any(where == ip_address(address) and name.endswith(f':{port}') for where, name in listening())
    require_reach()


@pytest.mark.parametrize('address', ['0.0.0.0', '::'])
def test_a_socket_that_all_hosts_reach_is_refused_and_named(bound, monkeypatch, address):
    monkeypatch.setenv(VARIABLE, 'host')
    port = bound(address).getsockname()[1]
    with pytest.raises(PlanningError, match=f'listens on udp6? {address}:{port}.* the profile .* did not take effect'):
        require_reach()


def test_connections_are_looked_at_only_where_they_are_taken(bound, monkeypatch):
    monkeypatch.setenv(VARIABLE, 'host')
    server = bound('0.0.0.0', socket.SOCK_STREAM)
    require_reach()
    server.listen()
    with pytest.raises(PlanningError, match='tcp 0.0.0.0'):
        require_reach()


def test_sockets_of_other_processes_do_not_count(monkeypatch):
    monkeypatch.setenv(VARIABLE, 'host')
    script = 'import socket; s = socket.socket(type=2); s.bind(("", 0)); print(s.getsockname()[1], flush=True); input()'
    with subprocess.Popen([sys.executable, '-c', script], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                          text=True) as other:
        port = other.stdout.readline().strip()
        assert port and not any(name.endswith(f':{port}') for _, name in listening())
        require_reach()
        other.communicate('\n')


@pytest.mark.parametrize('reach', [None, 'subnet'])
def test_nothing_is_refused_where_others_may_talk(bound, monkeypatch, reach):
    bound('0.0.0.0')
    monkeypatch.delenv(VARIABLE)
    if reach:
        monkeypatch.setenv(VARIABLE, reach)
    require_reach()


@pytest.mark.parametrize('reach', ['Host', '', 'localhost'])
def test_a_misspelt_reach_is_refused(monkeypatch, reach):
    monkeypatch.setenv(VARIABLE, reach)
    with pytest.raises(PlanningError, match=f"is '{reach}', not host or subnet"):
        require_reach()


@pytest.mark.parametrize('profile', NO_PROFILES)
def test_a_node_whose_profile_takes_no_effect_ends_with_2_and_a_sentence(start, monkeypatch, tmp_path, profile):
    path = tmp_path / 'profile.xml'
    if NO_PROFILES[profile] is not None:
        path.write_text(NO_PROFILES[profile])
    monkeypatch.setenv('FASTDDS_DEFAULT_PROFILES_FILE', str(path))
    code, _, err = start('map_server').result()
    assert code == 2 and 'Traceback' not in err
    assert 'map_server: other hosts could talk to this process' in err and f'{path} did not take effect' in err


def test_the_client_asks_nobody_where_others_could_answer(start, monkeypatch):
    monkeypatch.delenv('FASTDDS_DEFAULT_PROFILES_FILE')
    code, _, err = start('plan_path', '--start', 1, 1, '--goal', 2, 2).result()
    assert code == 1 and 'FASTDDS_DEFAULT_PROFILES_FILE is not set' in err


def test_nobody_asks_for_types_by_the_profile(ros):
    # In Fast DDS 3.2.2 the thread that takes the answers has ended processes.
    threads = [(task / 'comm').read_text().strip() for task in Path('/proc/self/task').iterdir()]
    assert any(name.startswith('dds.udp') for name in threads)
    assert not [name for name in threads if name.startswith('dds.tls')]
