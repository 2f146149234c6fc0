"""What every test stands on: a ROS of its own, the public data, and one way to draw examples."""
import os
import tempfile
from importlib.util import find_spec
from pathlib import Path

import hypothesis
import pytest

# Before anything imports rclpy. Above 101 the ports of a domain meet those that the kernel hands out.
os.environ['ROS_DOMAIN_ID'] = str(os.getpid() % 100 + 1)
os.environ['MOBILE_PLANNING_REACH'] = 'host'
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'SYSTEM_DEFAULT'
os.environ['FASTDDS_DEFAULT_PROFILES_FILE'] = str(Path(__file__).resolve().parent.parent / 'launch' / 'loopback.xml')
os.environ['ROS_PYTHON_CHECK_FIELDS'] = '1'
# The recorder is a node: where ROS is missing it is not even looked at.
collect_ignore = [] if find_spec('rclpy') and find_spec('mobile_planning_msgs') else ['chaos/recorder.py']
_LOGS = tempfile.TemporaryDirectory(prefix='mobile_planning_test_log_')
os.environ['ROS_LOG_DIR'] = _LOGS.name

hypothesis.settings.register_profile(
    'mobile_planning', deadline=None, print_blob=True, derandomize=bool(os.environ.get('CI')))
hypothesis.settings.load_profile('mobile_planning')


# Where tests run in several processes, one of them has all that wait for messages and processes: beside the
# computing of the others they keep a core, and no two of them load the machine at once.
_WAITING = ('test/chaos/', 'test/nodes/', 'test/test_launch.py', 'test/test_security.py', 'test/test_setup.py')


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config, log):
    """Give the tests that wait to one process, the others to whoever is free."""
    from xdist.scheduler import LoadScopeScheduling

    class Scheduling(LoadScopeScheduling):
        def _split_scope(self, nodeid):
            return 'waiting' if nodeid.startswith(_WAITING) else nodeid

    return Scheduling(config, log)


@pytest.fixture(scope='session')
def data_folder():
    """Return the folder of the larger public maps, or skip the test."""
    folder = os.environ.get('MOBILE_PLANNING_DATA')
    if not folder:
        pytest.skip('MOBILE_PLANNING_DATA names no folder of public maps')
    folder = Path(folder)
    if not folder.is_dir():
        pytest.skip(f'MOBILE_PLANNING_DATA={folder} is no folder')
    return folder
