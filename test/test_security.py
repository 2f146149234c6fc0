"""The policy for DDS-Security names what the nodes name, and its keys and signatures can be made as described."""
import re
import shutil
import subprocess
from pathlib import Path
from xml.etree import ElementTree

import pytest
from policy import DEEDS, POLICY, allowances, is_allowed

ROOT = Path(__file__).resolve().parent.parent
NODES = sorted((ROOT / 'mobile_planning' / 'nodes').glob('*.py'))
NAMES = 'map_server', 'grid_planner', 'sampling_planner', 'robot', 'world_sim'
GUIDE = (ROOT / 'docs' / 'security.md').read_text(encoding='utf-8')


def test_every_topic_and_service_that_the_code_of_the_nodes_names_is_in_the_policy():
    named = {name for path in NODES for name in re.findall(r"'(~?/[a-z_]+)'", path.read_text())}
    assert {'~/plan', '/robot_msgs', '~/declare_dead', '~/map', '/diagnostics'} <= named
    patterns = [pattern for enclave in NAMES
                for names in allowances()[enclave].values() for pattern in names]
    missing = [name for name in sorted(named)
               if not any(is_allowed(name.replace('~', owner), patterns)
                          for owner in ('/map_server', '/grid_planner', '/sampling_planner', '/robot_1', '/world_sim'))]
    assert missing == []


def test_the_policy_has_the_form_that_sros2_reads():
    policy = ElementTree.parse(POLICY).getroot()
    assert (policy.tag, policy.get('version')) == ('policy', '0.2.0')
    for group in policy.iterfind('enclaves/enclave/profiles/profile/*'):
        kind = group.tag[:-1]
        assert set(group.attrib) <= set(DEEDS[kind]) and set(group.attrib.values()) == {'ALLOW'}
        assert [each.tag for each in group] == [kind] * len(group)
        names = [each.text for each in group]
        assert len(set(names)) == len(names) > 0 and all(re.fullmatch(r'~?/[a-z_*/]+', name) for name in names)


def test_only_the_world_sim_says_who_drives_and_who_is_dead():
    for topic in '/mission', '/deaths':
        assert [enclave for enclave, deeds in allowances().items()
                if is_allowed(topic, deeds.get('publish', []))] == ['world_sim']


def test_an_operator_may_ask_for_every_service_of_ours():
    granted = allowances()
    asked = granted['operator']['request']
    for enclave in NAMES:
        # What only tools for types ask for stays closed.
        answers = {name for name in granted[enclave]['reply'] if '/_action/' not in name}
        assert answers - set(asked) == {
            f'/{"robot*" if enclave == "robot" else enclave}/get_type_description'}


@pytest.mark.skipif(shutil.which('openssl') is None, reason='openssl is not installed')
def test_a_keystore_is_made_by_the_commands_of_the_guide(tmp_path):
    (commands,) = re.findall(r'```sh\n(# A keystore.*?)```', GUIDE, re.DOTALL)
    permissions = tmp_path / 'permissions.xml'
    permissions.write_text('<dds><permissions/></dds>')
    done = subprocess.run(['bash', '-euc', commands], cwd=tmp_path, capture_output=True, text=True,
                          env={'PATH': '/usr/bin:/bin', 'REPOSITORY': str(ROOT), 'PERMISSIONS': str(permissions)})
    assert done.returncode == 0, done.stderr
    for enclave in sorted(allowances()):
        folder = tmp_path / 'keystore' / 'enclaves' / 'mobile_planning' / enclave
        names = {path.name for path in folder.iterdir()}
        assert names == {'identity_ca.cert.pem', 'permissions_ca.cert.pem', 'cert.pem', 'key.pem', 'governance.p7s',
                         'permissions.p7s', 'permissions.xml'}
        for signed in 'governance', 'permissions':
            subprocess.run(['openssl', 'smime', '-verify', '-in', folder / f'{signed}.p7s', '-CAfile',
                            folder / 'permissions_ca.cert.pem'], check=True, capture_output=True)
        subprocess.run(['openssl', 'verify', '-CAfile', folder / 'identity_ca.cert.pem', folder / 'cert.pem'],
                       check=True, capture_output=True)
        subject = subprocess.run(['openssl', 'x509', '-noout', '-subject', '-nameopt', 'multiline', '-in',
                                  folder / 'cert.pem'], check=True, capture_output=True, text=True).stdout
        assert f'/mobile_planning/{enclave}\n' in subject
        assert (folder / 'key.pem').stat().st_mode & 0o077 == 0
