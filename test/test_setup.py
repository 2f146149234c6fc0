"""The set-up script: what it asks of the machine, and which steps it runs when."""
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
TOOLS = (
    'bash', 'cat', 'chmod', 'cp', 'cut', 'date', 'dirname', 'find', 'flock', 'ln', 'mkdir', 'mkfifo', 'rm', 'sed',
    'sha256sum', 'sleep', 'sort', 'tail', 'touch', 'uname', 'xargs')
COMPILER = '#!/bin/sh\nexit 0\n'

# Runs the script's own question on this Python after a change to it.
CHANGED_PYTHON = '''#!/bin/sh
exec '{python}' -c '
import sys
{change}
exec(sys.argv[1])' "$2"
'''

# Answers as a Python 3.11 would, writes down what it is asked to do, and does it without a network.
STAND_IN = '''#!/bin/bash
if [[ $1 == -c ]]; then
    echo "3.11.7|{python}|"
    exit
fi
echo "${{0##*/}} $*" >> {calls}
case "$*" in
    '-m venv .venv')
        site=.venv/lib/python3.11/site-packages
        mkdir -p .venv/bin $site/mobile_planning/world $site/mobile_planning-0.1.0.dist-info
        cp {python} .venv/bin/python
        cp {python} .venv/bin/cmake
        echo 'robot = mobile_planning.nodes.robot:main' > $site/mobile_planning-0.1.0.dist-info/entry_points.txt
        ;;
    *'-r requirements.txt')
        if [[ -p {fault} ]]; then
            read -r < {fault}
        elif [[ -f {fault} ]]; then
            cat {fault}
            exit 3
        fi
        ;;
    *--force-reinstall*)
        cp mobile_planning/world/cost_to_go_kernels.py .venv/lib/python3.11/site-packages/mobile_planning/world
        ;;
    '-S msg_defs'*)
        mkdir -p .venv/build/msg_defs
        echo "$PWD/.venv/installed_message" > .venv/build/msg_defs/install_manifest.txt
        ;;
    '--build'*)
        if [[ -p {fault} ]]; then
            read -r < {fault}
            exit 4
        fi
        ;;
    *warm_up)
        if [[ -p {fault} ]]; then
            echo > {fault}
            sleep infinity
        fi
        compiled=.venv/lib/python3.11/site-packages/mobile_planning/world/__pycache__
        mkdir -p $compiled
        [[ -f $compiled/visible.nbi ]] || echo $RANDOM$RANDOM > $compiled/visible.nbi
        ;;
esac
'''


def executable(path, text):
    """Write the executable script ``path``."""
    path.write_text(text, encoding='utf-8')
    path.chmod(0o755)


class Machine:
    """A copy of the repository on a machine with the tools that a test gives it and nothing else."""

    def __init__(self, folder):
        self.root = folder / 'a copy'
        self.tools = folder / 'bin'
        self.calls = folder / 'calls'
        self.fault = folder / 'fault'
        self.root.mkdir()
        self.tools.mkdir()
        for name in ('launch', 'msg_defs', 'mobile_planning', 'config', 'resource'):
            shutil.copytree(REPOSITORY / name, self.root / name, ignore=shutil.ignore_patterns('__pycache__'))
        for name in ('package.xml', 'setup.py', 'setup.cfg', 'requirements.txt'):
            shutil.copy(REPOSITORY / name, self.root / name)
        for tool in TOOLS:
            (self.tools / tool).symlink_to(shutil.which(tool))

    def has(self, *compilers):
        """Give the machine compilers that take everything."""
        for name in compilers:
            executable(self.tools / name, COMPILER)

    def has_python(self, change):
        """Give the machine this Python as ``python3``, with the statement ``change`` run first."""
        executable(self.tools / 'python3', CHANGED_PYTHON.format(python=sys.executable, change=change))

    def has_stand_in(self):
        """Give the machine a ``python3`` that only writes down what it is asked to do."""
        python = self.tools / 'python3'
        executable(python, STAND_IN.format(python=python, calls=self.calls, fault=self.fault))

    def start(self, **variables):
        """Start the set-up from another folder, with nothing in the environment but ``variables``."""
        environment = {'PATH': str(self.tools), 'HOME': os.environ.get('HOME', '/'), **variables}
        return subprocess.Popen(
            [self.root / 'launch' / 'setup.sh'], cwd='/', env=environment, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE)

    def set_up(self, **variables):
        """Run the set-up; return its exit code and what it printed on each stream."""
        process = self.start(**variables)
        output, errors = process.communicate(timeout=60)
        return process.returncode, output, errors

    def steps(self):
        """Run the set-up, which must succeed, and return the titles of the steps it ran."""
        code, output, errors = self.set_up()
        assert (code, errors) == (0, '')
        return [line.split(':')[1].split()[0] for line in output.splitlines()]

    def compiled(self, folder):
        """Return what is compiled below ``folder``, by its path."""
        root = self.root / folder
        return {path.relative_to(root): path.read_text() for path in root.rglob('*.nbi')}


@pytest.fixture
def machine(tmp_path):
    """Return a machine without Python and compilers."""
    return Machine(tmp_path)


@pytest.fixture
def ready(machine):
    """Return a machine whose Python is a stand-in, so that nothing is downloaded."""
    machine.has('cc', 'c++')
    machine.has_stand_in()
    return machine


def complaints(machine, **variables):
    """Return the sentences with which the set-up refuses, and check that it left nothing behind."""
    code, output, errors = machine.set_up(**variables)
    assert (code, output) == (1, '')
    assert not (machine.root / '.venv').exists()
    return errors.splitlines()


def test_a_machine_without_python_is_told_the_versions_that_will_do(machine):
    machine.has('cc', 'c++')
    sentence, = complaints(machine)
    assert 'Python 3.10, 3.11 or 3.12' in sentence
    assert 'Debian package python3' in sentence


def test_a_python_that_was_asked_for_is_not_replaced_by_another(ready):
    sentence, = complaints(ready, PYTHON='python3.12')
    assert 'there is no python3.12' in sentence


def test_another_python_makes_the_environment_anew(ready):
    ready.steps()
    other = ready.tools / 'other'
    executable(other, STAND_IN.format(python=other, calls=ready.calls, fault=ready.fault))
    code, output, _ = ready.set_up(PYTHON=str(other))
    assert (code, len(output.splitlines())) == (0, 4)
    assert ready.steps() == []


@pytest.mark.parametrize('version', [(2, 7, 18), (3, 9, 18), (3, 13, 0)])
def test_a_wrong_python_is_named_with_its_version(machine, version):
    machine.has('cc', 'c++')
    machine.has_python(f'sys.version_info = {version}')
    sentence, = complaints(machine)
    assert 'python3 is {}.{}.{}'.format(*version) in sentence


def test_a_python_without_ensurepip_is_told_the_package_to_install(machine):
    machine.has('cc', 'c++')
    machine.has_python(
        'import importlib.util as u; find = u.find_spec; u.find_spec = lambda n: None if n == "ensurepip" else find(n)')
    sentence, = complaints(machine)
    assert 'python{}.{}-venv'.format(*sys.version_info) in sentence


def test_a_python_without_headers_is_told_the_package_to_install(machine):
    machine.has('cc', 'c++')
    machine.has_python('import sysconfig; sysconfig.get_path = lambda name: "/nowhere"')
    sentence, = complaints(machine)
    assert 'Python.h' in sentence
    assert 'python{}.{}-dev'.format(*sys.version_info) in sentence


def test_each_missing_compiler_is_named(machine):
    machine.has_stand_in()
    c, cpp = complaints(machine)
    assert c.endswith('A working C compiler is missing: install the Debian package gcc.')
    assert cpp.endswith('A working C++ compiler is missing: install the Debian package g++.')


def test_everything_that_is_missing_is_named_at_once(machine):
    machine.has_python('import sysconfig; sysconfig.get_path = lambda name: "/nowhere"')
    assert len(complaints(machine)) == 3


def test_a_second_set_up_has_nothing_to_do(ready):
    assert ready.steps() == ['wheels', 'package', 'messages', 'kernels']
    calls = ready.calls.read_text()
    assert ready.steps() == []
    assert ready.calls.read_text() == calls


def test_executables_are_linked_where_ros2_run_looks(ready):
    ready.steps()
    link = ready.root / '.venv' / 'lib' / 'mobile_planning' / 'robot'
    assert os.readlink(link) == '../../bin/robot'


def test_a_changed_message_is_built_and_nothing_else(ready):
    ready.steps()
    with open(ready.root / 'msg_defs' / 'msg' / 'RobotMsg.msg', 'a', encoding='utf-8') as file:
        file.write('bool more\n')
    assert ready.steps() == ['messages']


def test_files_of_an_older_message_do_not_linger(ready):
    ready.steps()
    stale = ready.root / '.venv' / 'installed_message'
    stale.touch()
    (ready.root / 'msg_defs' / 'msg' / 'RobotMsg.msg').rename(ready.root / 'msg_defs' / 'msg' / 'Other.msg')
    ready.steps()
    assert not stale.exists()


@pytest.mark.parametrize('file', ['mobile_planning/errors.py', 'config/maps/depot.yaml', 'package.xml', 'setup.py'])
def test_a_changed_file_of_the_package_installs_the_package(ready, file):
    ready.steps()
    with open(ready.root / file, 'a', encoding='utf-8') as changed:
        changed.write('\n')
    assert ready.steps() == ['package', 'kernels']


def test_compiled_kernels_serve_the_tests_too_and_outlive_changes_of_other_files(ready):
    def compiled_after_a_change_of(file):
        with open(ready.root / 'mobile_planning' / file, 'a', encoding='utf-8') as changed:
            changed.write('\n')
        ready.steps()
        installed = ready.compiled('.venv/lib/python3.11/site-packages/mobile_planning')
        assert len(installed) == 1 and ready.compiled('mobile_planning') == installed
        return installed

    first = compiled_after_a_change_of('errors.py')
    assert compiled_after_a_change_of('errors.py') == first
    assert compiled_after_a_change_of('world/cost_to_go_kernels.py') != first


def test_changed_requirements_make_the_environment_anew(ready):
    ready.steps()
    leftover = ready.root / '.venv' / 'leftover'
    leftover.touch()
    with open(ready.root / 'requirements.txt', 'a', encoding='utf-8') as file:
        file.write('# more\n')
    assert ready.steps() == ['wheels', 'package', 'messages', 'kernels']
    assert not leftover.exists()


def test_a_moved_repository_makes_its_environment_anew(ready):
    ready.steps()
    ready.root = ready.root.rename(ready.root.with_name('moved'))
    assert ready.steps() == ['wheels', 'package', 'messages', 'kernels']


def test_a_failed_step_shows_the_end_of_its_log_and_is_done_again(ready):
    ready.fault.write_text('\n'.join(f'line {number} of the log' for number in range(50)) + '\n', encoding='utf-8')
    code, output, errors = ready.set_up()
    assert code == 1
    assert 'messages' not in output
    assert errors.splitlines()[:20] == [f'line {number} of the log' for number in range(30, 50)]
    assert 'step wheels failed with code 3' in errors
    ready.fault.unlink()
    assert ready.steps() == ['wheels', 'package', 'messages', 'kernels']


def test_a_step_beside_one_that_failed_is_ended_and_done_again(ready):
    assert ready.steps() == ['wheels', 'package', 'messages', 'kernels']
    os.mkfifo(ready.fault)
    for file in 'msg_defs/msg/RobotMsg.msg', 'mobile_planning/errors.py':
        with open(ready.root / file, 'a', encoding='utf-8') as changed:
            changed.write('\n')
    # The messages fail as soon as the kernels are under way, which would never end.
    code, output, errors = ready.set_up()
    assert (code, 'kernels' in output) == (1, False) and 'step messages failed with code 4' in errors
    ready.fault.unlink()
    assert ready.steps() == ['messages', 'kernels']


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_step_is_done_again(ready, number):
    os.mkfifo(ready.fault)
    process = ready.start()
    # Opens when the step that is to be interrupted has opened the other end.
    with open(ready.fault, 'w', encoding='utf-8'):
        process.send_signal(number)
        _, errors = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert 'interrupted' in errors
    ready.fault.unlink()
    assert ready.steps() == ['wheels', 'package', 'messages', 'kernels']
