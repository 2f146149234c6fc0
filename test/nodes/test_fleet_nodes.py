"""Robots and world sim together, in process: they may come, go and come again in any order before the start."""
from functools import partial
from itertools import count

import numpy as np
import pytest
from mobile_planning_msgs.msg import MissionReport
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from std_srvs.srv import Trigger

from mobile_planning.fleet.message import Mode
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.nodes import qos
from mobile_planning.nodes.map_server import MapServer
from mobile_planning.nodes.robot import RobotNode
from mobile_planning.nodes.robots import make_robots
from mobile_planning.nodes.world_sim import WorldSimNode
from mobile_planning.world.map_io import save_map
from mobile_planning.world.occupancy_grid import OccupancyGrid


class Fleet:
    """Nodes that are started and ended by name."""

    def __init__(self, ros, folder):
        self._ros, self._nodes = ros, {}
        self._map = save_map(OccupancyGrid(np.zeros((50, 50), np.int8), 0.1), folder / 'hall')
        self._scene = folder / 'scene.yaml'
        self._scene.write_text('map: hall.yaml\nrobots:\n  - {id: 1, start: [1, 2, 0], goal: [1.7, 2, 0]}\n'
                               '  - {id: 2, start: [2, 3, 3.1], goal: [1.3, 3, 3.1]}\n')
        self.messages = ros.listen(RobotMessage, '/robot_msgs', qos.robot_messages(100))
        self.reports = ros.listen(MissionReport, '/world_sim/report', qos.latched())

    def start(self, name):
        """Start a node, and end the one that has its name."""
        self.end(name)
        if name == 'map_server':
            self._nodes[name] = self._ros.add(MapServer, yaml_filename=str(self._map))
        elif name == 'world_sim':
            self._nodes[name] = self._ros.add(WorldSimNode, scene=str(self._scene), autostart=False)
        else:
            named = partial(RobotNode, cli_args=['--ros-args', '-r', f'__node:={name}'])
            self._nodes[name] = self._ros.add(named, scene=str(self._scene), robot_id=int(name[-1]), Tc=0.1, Tp=1.0)

    def end(self, name):
        """End a node if there is one of this name."""
        if name in self._nodes:
            self._ros.remove(self._nodes.pop(name))

    def heard(self, condition):
        """Wait for a message that meets the condition."""
        self.messages.clear()
        self._ros.until(lambda: any(map(condition, self.messages)))

    def drive(self):
        """Ask for the start."""
        assert self._ros.call(Trigger, '/world_sim/start').success

    def result(self):
        """Return the exit code and the report of the world sim."""
        with pytest.raises(SystemExit) as end:
            self._ros.until(lambda: False)
        self.end('world_sim')
        return end.value.code, self._ros.until(lambda: self.reports)[-1]


@pytest.fixture
def fleet(ros, tmp_path, monkeypatch):
    """Return a `Fleet` whose nodes are restarted more often than once a second."""
    seconds = count(1000)
    monkeypatch.setattr('mobile_planning.nodes.robot.time', lambda: next(seconds))
    return Fleet(ros, tmp_path)


def test_the_map_and_the_world_sim_may_come_after_the_robots(fleet):
    for name in 'robot_2', 'world_sim', 'robot_1', 'map_server':
        fleet.start(name)
    fleet.drive()
    code, report = fleet.result()
    assert code == 0 and report.valid and not report.violations


def test_everything_may_be_restarted_before_the_mission_starts(fleet):
    for name in 'world_sim', 'robot_1', 'robot_2', 'map_server':
        fleet.start(name)
    fleet.heard(lambda message: message.robot_id == 1 and 2 in message.peer)
    for name in 'robot_2', 'map_server', 'world_sim':
        fleet.start(name)
    fleet.drive()
    code, report = fleet.result()
    assert code == 0 and report.valid and not report.violations


def test_a_world_sim_restarted_on_the_way_disturbs_nobody_and_brings_the_mission_to_its_end(fleet):
    for name in 'world_sim', 'robot_1', 'robot_2', 'map_server':
        fleet.start(name)
    fleet.drive()
    fleet.heard(lambda message: message.mode == Mode.DRIVING)
    fleet.start('world_sim')
    code, report = fleet.result()
    assert code == 0 and report.valid and report.arrived == 2 and 0.5 < report.mission_time < 30.0


@pytest.mark.parametrize('is_world_sim_restarted', [False, True])
def test_a_robot_restarted_where_it_began_is_left_out_and_moves_no_more_while_the_other_arrives(
        fleet, is_world_sim_restarted):
    for name in 'world_sim', 'robot_1', 'robot_2', 'map_server':
        fleet.start(name)
    fleet.drive()
    # Its plan leads away from where it began.
    fleet.heard(lambda message: message.robot_id == 2 and np.ptp(message.control_points[::2]) > 0.3)
    fleet.start('robot_2')
    if is_world_sim_restarted:
        fleet.heard(lambda message: message.robot_id == 2 and message.held_up == RobotMessage.LEFT_OUT)
        fleet.start('world_sim')
    code, report = fleet.result()
    assert code == 1 and report.arrived == 1 and not report.valid
    assert any('robot 2 was started anew' in violation for violation in report.violations)
    fleet.heard(lambda message: message.robot_id == 2 and message.plan_seq == 0)


#: Scenes by what is asked of robots: one goal, by both methods; several in turn, drawn ones for a while, one that
#: cannot be reached.
SCENES = {
    'crossing': """
boundary: {x: [0, 5], y: [0, 5]}
robots:
  - {id: 1, start: [1, 2.5, 0], goal: [4, 2.5, 0]}
  - {id: 2, start: [2.5, 1, 1.57], goal: [2.5, 4, 1.57]}
""",
    'receding horizon': """
method: receding_horizon
boundary: {x: [0, 5], y: [0, 5]}
robots:
  - {id: 1, start: [1, 2.5, 0], goal: [4, 2.5, 0]}
  - {id: 2, start: [2.5, 1, 1.57], goal: [2.5, 4, 1.57]}
""",
    'rounds': """
boundary: {x: [0, 5], y: [0, 5]}
robots:
  - {id: 1, start: [1, 1, 0], goals: [[2.5, 1, 0], [2.5, 2.5, 1.57]]}
  - {id: 2, start: [4, 4, 3.14], goals: [[4, 2.5, -1.57], [4, 4, 1.57], [1.5, 4, 3.14]]}
""",
    'endless': """
boundary: {x: [0, 5], y: [0, 5]}
endless: 4.0
robots:
  - {id: 1, start: [1, 1, 0], goal: [2, 1, 0]}
  - {id: 2, start: [4, 4, 3.14], goal: [3, 4, 3.14]}
""",
    'no way past': """
boundary: {x: [0, 5], y: [0, 0.6]}
timeout: 4.0
robots:
  - {id: 1, start: [1.5, 0.3, 0], goal: [4, 0.3, 0]}
  - {id: 2, start: [2.5, 0.3, 3.14], goal: [0.5, 0.3, 3.14]}
"""}


@pytest.mark.parametrize('name', SCENES)
def test_a_scene_comes_to_the_same_verdict_in_process_and_over_ros(ros, tmp_path, name):
    path = tmp_path / f'{name}.yaml'
    path.write_text(SCENES[name])
    scene = load_scene(path)
    expected = scene.world_sim(margin=0.025).run(seed=1, timeout=scene.timeout, errands=scene.errands(1))
    reports = ros.listen(MissionReport, '/world_sim/report', qos.latched())
    ros.add(make_robots, scene=str(path), robots=[1, 2])
    ros.add(WorldSimNode, scene=str(path))
    with pytest.raises(SystemExit) as end:
        ros.until(lambda: False)
    report = ros.until(lambda: reports)[-1]
    assert (report.valid, report.arrived) == (expected.valid, expected.arrived) and end.value.code == (not report.valid)
    assert [each.split(',')[0] for each in report.waiting] == [f'robot {each.robot}' for each in expected.waiting]
    assert [kind_of(each) for each in report.violations if 'the mission ended' not in each] == \
        [kind_of(each) for each in expected.violations]
    if name != 'endless':
        assert (report.goals, report.goals_reached) == (expected.goals, expected.arrivals)
    else:
        assert report.goals == report.goals_reached > 2 and report.throughput > 0.0


def kind_of(violation):
    """Return what a violation is about, without its numbers."""
    return violation.split(' at ')[0]
