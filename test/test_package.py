"""What the package says of itself: version, dependencies, executables, in each place where it must be said."""
import ast
import configparser
import json
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from xml.etree import ElementTree

import pytest

import mobile_planning

REPOSITORY = Path(__file__).resolve().parent.parent
MANIFEST = ElementTree.parse(REPOSITORY / 'package.xml').getroot()
MESSAGES = ElementTree.parse(REPOSITORY / 'msg_defs' / 'package.xml').getroot()


@pytest.fixture(scope='module')
def metadata():
    """Return what setup.py declares, as a dict of the options that are asked for."""
    code = (
        'import json, setuptools\n'
        'setuptools.setup = lambda **options: print(json.dumps(options))\n'
        'exec(open("setup.py").read())\n')
    done = subprocess.run([sys.executable, '-c', code], cwd=REPOSITORY, capture_output=True, text=True, timeout=60)
    return json.loads(done.stdout)


def imported_in_nodes():
    """Return the top-level names that the node files import."""
    names = set()
    for path in (REPOSITORY / 'mobile_planning' / 'nodes').glob('*.py'):
        for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
            if isinstance(node, ast.Import):
                names |= {alias.name.split('.')[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not node.level:
                names.add(node.module.split('.')[0])
    return names


def declared(manifest):
    """Return the packages on which a package.xml depends."""
    return {element.text for element in manifest if element.tag in ('depend', 'exec_depend')}


def test_one_version_is_told_everywhere(metadata):
    versions = {MANIFEST.findtext('version'), MESSAGES.findtext('version'), metadata['version']}
    assert versions == {mobile_planning.__version__}


def test_every_ros_package_that_a_node_imports_is_a_dependency():
    ros = {name for name in imported_in_nodes() if name == 'rclpy' or name.endswith(('_msgs', '_srvs', '_interfaces'))}
    assert ros <= declared(MANIFEST)


def test_every_package_that_a_message_uses_is_a_dependency():
    files = [file for kind in ('msg', 'srv', 'action') for file in (REPOSITORY / 'msg_defs').glob(f'{kind}/*.{kind}')]
    fields = [line.split()[0] for file in files for line in file.read_text().splitlines() if '/' in line.split('#')[0]]
    # Every action has fields of action_msgs beside those that are written.
    needed = {field.split('/')[0] for field in fields} | {'action_msgs'}
    assert needed == declared(MESSAGES) - {'rosidl_default_runtime'}


def test_every_executable_has_a_main(metadata):
    pytest.importorskip('rclpy', reason='the executables are ROS nodes')
    for entry in metadata['entry_points']['console_scripts']:
        module, function = entry.split(' = ')[1].split(':')
        assert callable(getattr(import_module(module), function)), entry


def test_every_file_of_the_configuration_is_installed(metadata):
    installed = {file for _, files in metadata['data_files'] for file in files}
    files = {str(path.relative_to(REPOSITORY)) for path in (REPOSITORY / 'config').rglob('*') if path.is_file()}
    assert files <= installed


def test_ros2_run_finds_the_executables_after_colcon_build():
    settings = configparser.ConfigParser(interpolation=None)
    settings.read(REPOSITORY / 'setup.cfg')
    assert settings['install']['install_scripts'] == '$base/lib/mobile_planning'


def test_every_requirement_is_pinned():
    lines = (REPOSITORY / 'requirements.txt').read_text(encoding='utf-8').splitlines()
    requirements = [line for line in lines if line and not line.startswith('#')]
    assert [line for line in requirements if '==' not in line.split(';')[0]] == []
