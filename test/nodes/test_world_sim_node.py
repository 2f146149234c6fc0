"""The world sim, in process among robots that the tests play, and as a process."""
import json
import signal

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from mobile_planning_msgs.msg import Contracts as ContractsMessage
from mobile_planning_msgs.msg import Deaths, MissionReport
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from mobile_planning_msgs.srv import DeclareDead
from PIL import Image
from rcl_interfaces.srv import DescribeParameters
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from mobile_planning.errors import PlanningError
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.message import Contracts, Link, Mode, Offer, RobotMsg
from mobile_planning.fleet.postscript import Postscript
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.fleet.solution import Solution
from mobile_planning.nodes import convert_contracts, convert_mission, convert_robot, qos
from mobile_planning.nodes.convert import seconds
from mobile_planning.nodes.world_sim import WorldSimNode
from mobile_planning.nodes.world_sim_options import WorldSimOptions

IDS = (1, 2)
#: Of the boot of each robot.
EPOCH = 7


@pytest.fixture
def scene(tmp_path):
    """Return the YAML file of a scene in which two robots pass each other."""
    path = tmp_path / 'two robots.yaml'
    path.write_text('name: pass\nboundary: {x: [0, 4], y: [0, 4]}\ntimeout: 60\nrobots:\n'
                    '  - {id: 1, start: [1, 1, 0], goal: [2, 1, 0]}\n  - {id: 2, start: [2, 3, 0], goal: [1, 3, 0]}\n')
    return path


class Robots:
    """Robots that say what the test wants, over and over."""

    def __init__(self, ros, scene):
        self._ros, self._scene, self._count = ros, load_scene(scene), 0
        self.said, self.start, self.contract = {}, 0.0, 0
        self._messages = ros.node.create_publisher(RobotMessage, '/robot_msgs', qos.robot_messages())
        self._solutions = {robot_id: ros.node.create_publisher(SolutionMessage, '/solutions', qos.SOLUTION_WRITER)
                           for robot_id in IDS}
        self.missions = ros.listen(MissionMessage, '/mission', qos.MISSION)
        self.reports = ros.listen(MissionReport, '/world_sim/report', qos.latched())
        self.diagnostics = ros.listen(DiagnosticArray, '/diagnostics', qos.DIAGNOSTICS)
        ros.node.create_timer(0.05, self._speak)

    def _speak(self):
        self._count += 1
        for robot_id, (epoch, links, mode) in self.said.items():
            self.publish(robot_id, epoch, links, mode)

    def publish(self, robot_id, epoch=EPOCH, links=(), mode=Mode.WAITING, **spoilt):
        """Publish one message."""
        # They stand since 1970, each at a place of its own.
        place = np.array([robot_id, 2.0 * robot_id - 1.0])
        said = RobotMsg(
            False, place[:1], place[1:], place, robot_id=robot_id, boot_epoch=epoch, sequence=self._count, mode=mode,
            plan=Plan.at_rest(0, 0.25, (*place, 0)),
            links={peer: Link(EPOCH, 2 if self.contract else 1, self.contract) for peer in links})
        message = convert_robot.robot_message(said, self.now, 'map', Postscript(self.start))
        for field, value in spoilt.items():
            setattr(message, field, value)
        self._messages.publish(message)

    @property
    def now(self):
        """The robots' clock [s]."""
        return self._ros.node.get_clock().now().nanoseconds * 1e-9

    def gather(self):
        """Let all robots say that they hear all others."""
        self.said = {1: (EPOCH, [2], Mode.WAITING), 2: (EPOCH, [1], Mode.WAITING)}

    def announced(self, state):
        """Return the mission that the world sim announces in this state."""
        return self._ros.until(lambda: next((mission for mission in self.missions if mission.state == state), None))

    def solve(self, start):
        """Return what the robots would have driven from ``start`` [s]."""
        simulation = self._scene.world_sim()
        assert simulation.run(start_time=start).valid
        return simulation.solutions

    def hand_in(self, solution, epoch=EPOCH, **spoilt):
        """Publish a robot's solution."""
        message = convert_mission.solution_message(solution, epoch, 0.0, 'map')
        for field, value in spoilt.items():
            setattr(message, field, value)
        self._solutions[solution.eyed].publish(message)

    def diagnosis(self, condition):
        """Return the first status that meets the condition, with its facts."""
        def find():
            for array in self.diagnostics:
                status, facts = array.status[0], {entry.key: entry.value for entry in array.status[0].values}
                if condition(status, facts):
                    return status, facts
            return None
        return self._ros.until(find)

    def stand(self, start):
        """Hand in solutions of robots that did not move."""
        for robot_id in IDS:
            self.hand_in(Solution(robot_id, (Plan.at_rest(int(start * 4), 0.25, (robot_id, 2 * robot_id - 1, 0)),)))

    def end(self, node):
        """Return the code with which the world sim ends itself, and end it as a process would."""
        with pytest.raises(SystemExit) as end:
            self._ros.until(lambda: False)
        self._ros.remove(node)
        return end.value.code


@pytest.fixture
def robots(ros, scene):
    """Return the `Robots` of this test."""
    return Robots(ros, scene)


def test_a_mission_is_announced_started_judged_drawn_and_reported(ros, robots, scene, tmp_path, capfd):
    # The robots of this test stand since 1970.
    markers = ros.listen(MarkerArray, '/world_sim/markers', qos.live())
    node = ros.add(WorldSimNode, scene=str(scene), out=str(tmp_path / 'deep' / 'out'))
    waiting = robots.announced(MissionMessage.WAITING)
    assert (waiting.name, list(waiting.robot_ids)) == ('pass', [1, 2])
    robots.gather()
    start = seconds(robots.announced(MissionMessage.STARTED).start)
    kinds = {'robots', 'intents', 'goals'}
    ros.until(lambda: any({marker.ns for marker in array.markers} == kinds for array in markers))
    for solution in robots.solve(start).values():
        robots.hand_in(solution)
    assert robots.end(node) == 0
    ros.until(lambda: robots.reports)
    assert robots.announced(MissionMessage.STOPPED)
    report = robots.reports[0]
    assert report.valid and (report.robots, report.arrived) == (2, 2) and 1.0 < report.mission_time < 10.0
    written = json.loads((tmp_path / 'deep' / 'out' / 'report.json').read_text())
    assert report.watched_since == written['watched_since'] == written['judged_since'] == 0.0
    assert written['valid'] and written['min_separation'] == report.min_separation
    picture = np.asarray(Image.open(tmp_path / 'deep' / 'out' / 'mission.png').convert('RGB'))
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 20
    assert 'valid                   yes' in capfd.readouterr().out


@pytest.mark.parametrize('said, lack', [
    ({1: (EPOCH, [2], Mode.WAITING)}, 'robots [2] are not there'),
    ({1: (EPOCH, [2], Mode.WAITING), 2: (EPOCH, [], Mode.WAITING)}, 'robot 2 does not hear robots [1]'),
    ({1: (EPOCH, [2], Mode.WAITING), 2: (EPOCH + 1, [1], Mode.WAITING)}, 'robot 1 does not hear robots [2]'),
    ({1: (EPOCH, [2], Mode.DONE), 2: (EPOCH, [1], Mode.WAITING)}, 'robots [1] have had their mission')])
def test_it_says_what_is_lacking_gives_up_in_the_end_and_starts_nobody(ros, robots, scene, capfd, said, lack):
    node = ros.add(WorldSimNode, scene=str(scene), discovery_timeout=0.5)
    robots.said = said
    assert robots.end(node) == 1
    assert lack in capfd.readouterr().out
    assert {mission.state for mission in robots.missions} == {MissionMessage.WAITING}


def test_without_autostart_it_starts_when_it_is_asked_to_and_stops_too(ros, robots, scene):
    node = ros.add(WorldSimNode, scene=str(scene), autostart=False)
    status, _ = robots.diagnosis(lambda status, facts: facts['lack'] == 'robots [1, 2] are not there')
    assert status.level == DiagnosticStatus.WARN
    robots.gather()
    robots.diagnosis(lambda status, facts: facts['lack'] == '' and 'waiting' in status.message)
    assert ros.call(Trigger, '/world_sim/start').success
    start = seconds(robots.announced(MissionMessage.STARTED).start)
    refused = ros.call(Trigger, '/world_sim/start')
    assert not refused.success and 'started already' in refused.message
    assert ros.call(Trigger, '/world_sim/stop').success
    robots.announced(MissionMessage.STOPPED)
    refused = ros.call(Trigger, '/world_sim/stop')
    assert not refused.success and 'over' in refused.message
    robots.stand(start)
    assert robots.end(node) == 1
    assert ros.until(lambda: robots.reports)[0].violations == ['the mission ended: it was stopped by ~/stop']


def test_garbage_is_counted_and_the_mission_goes_on(ros, robots, scene):
    node = ros.add(WorldSimNode, scene=str(scene))
    robots.publish(1, version=2)
    robots.publish(1, control_points=[1.0] * 9)
    robots.publish(2, step=float('nan'))
    ros.until(lambda: node._guard.rejected.total() == 3)
    robots.gather()
    start = seconds(robots.announced(MissionMessage.STARTED).start)
    good = robots.solve(start)
    for count, spoilt in enumerate([{'sizes': [4]}, {'step': 0.0}, {'control_points': []}, {'first_knots': [2**62]},
                                    {'headings': [float('nan')] * len(good[1].plans)}], 4):
        robots.hand_in(good[1], **spoilt)
        ros.until(lambda: node._guard.rejected.total() == count)
    late = [plan.first_knot + 10**7 for plan in good[1].plans]
    robots.hand_in(good[1], first_knots=late)
    robots.diagnosis(lambda status, facts: facts['rejected'] == '9' and facts['faults'] == '0'
                     and 'drives until' in status.message)
    for solution in good.values():
        robots.hand_in(solution)
    assert robots.end(node) == 0


def test_a_robot_that_falls_silent_on_its_way_is_named_and_takes_part_again_when_it_is_started_anew(ros, robots, scene):
    node = ros.add(WorldSimNode, scene=str(scene))
    robots.gather()
    good = robots.solve(seconds(robots.announced(MissionMessage.STARTED).start))
    del robots.said[2]
    status, _ = robots.diagnosis(lambda status, facts: facts['silent'] == '[2]' and 'started' in status.message)
    assert status.level == DiagnosticStatus.WARN
    robots.said[2] = EPOCH + 1, [1], Mode.WAITING
    robots.diagnostics.clear()
    robots.diagnosis(lambda status, facts: facts['silent'] == '[]' and 'started' in status.message)
    robots.hand_in(good[2])
    robots.hand_in(good[1])
    robots.hand_in(good[2], epoch=EPOCH + 1)
    assert robots.end(node) == 0


def test_it_takes_up_a_mission_that_another_process_has_started_and_says_since_when(
        ros, robots, scene, capfd, monkeypatch):
    # On a busy machine it may take a while until it hears them.
    monkeypatch.setattr('mobile_planning.nodes.world_sim._LISTEN', 20.0)
    robots.start = robots.now - 5.0
    robots.said = {1: (EPOCH, [2], Mode.DRIVING), 2: (EPOCH, [1], Mode.DRIVING)}
    node = ros.add(WorldSimNode, scene=str(scene), autostart=False)
    assert seconds(robots.announced(MissionMessage.STARTED).start) == pytest.approx(robots.start, abs=1e-6)
    assert all(mission.state != MissionMessage.WAITING for mission in robots.missions)
    for solution in robots.solve(robots.start).values():
        robots.hand_in(solution)
    assert robots.end(node) == 0
    ros.until(lambda: robots.reports)
    # All plans are judged at the end; what was said before it ran it has not heard.
    assert robots.reports[0].judged_since == 0.0 and 5.0 <= robots.reports[0].watched_since < 30.0
    assert f'watched                 from {robots.reports[0].watched_since:.2f} s on' in capfd.readouterr().out


def test_a_mission_is_paused_and_goes_on(ros, robots, scene):
    ros.add(WorldSimNode, scene=str(scene))
    refused = ros.call(Trigger, '/world_sim/pause')
    assert not refused.success and 'waiting, not started' in refused.message
    robots.gather()
    start = robots.announced(MissionMessage.STARTED).start
    assert ros.call(Trigger, '/world_sim/pause').success
    assert robots.announced(MissionMessage.PAUSED).start == start
    robots.missions.clear()
    assert ros.call(Trigger, '/world_sim/resume').success
    assert robots.announced(MissionMessage.STARTED).start == start


def test_who_is_declared_dead_is_told_to_all_and_the_others_end_the_mission(ros, robots, scene, monkeypatch):
    monkeypatch.setattr('mobile_planning.fleet.mission._QUIET', 2.0)
    deaths = ros.listen(Deaths, '/deaths', qos.latched())
    node = ros.add(WorldSimNode, scene=str(scene))
    robots.gather()
    good = robots.solve(seconds(robots.announced(MissionMessage.STARTED).start))
    # While that was computed nobody spoke.
    robots.diagnostics.clear()
    robots.diagnosis(lambda status, facts: facts['silent'] == '[]')
    answer = ros.call(DeclareDead, '/world_sim/declare_dead', DeclareDead.Request(robot_id=2))
    assert not answer.success and 'its body may move' in answer.message
    del robots.said[2]
    robots.diagnosis(lambda status, facts: facts['silent'] == '[2]')
    for place, words in (([1.0], 'two coordinates'), ([1.0, float('nan')], 'place')):
        request = DeclareDead.Request(robot_id=2, place=place)
        answer = ros.call(DeclareDead, '/world_sim/declare_dead', request)
        assert not answer.success and words in answer.message
    assert ros.call(DeclareDead, '/world_sim/declare_dead', DeclareDead.Request(robot_id=2)).success
    told = ros.until(lambda: next((each for each in deaths if len(each.robot_id)), None))
    assert (list(told.robot_id), list(told.boot_epoch), list(told.place)) == ([2], [EPOCH], [2.0, 3.0])
    robots.hand_in(good[1])
    assert robots.end(node) == 1
    report = ros.until(lambda: robots.reports)[0]
    assert (report.dead, report.arrived) == (1, 1) and 'those that died, [2]' in report.violations[-1]


def test_a_plan_that_breaks_its_contract_is_an_error_at_once_and_in_the_report(ros, robots, scene):
    node = ros.add(WorldSimNode, scene=str(scene))
    contracts = ros.node.create_publisher(ContractsMessage, '/contracts', qos.robot_messages())
    ros.until(contracts.get_subscription_count)
    robots.gather()
    start = seconds(robots.announced(MissionMessage.STARTED).start)
    for offset, level in ((2.5, DiagnosticStatus.OK), (1.1, DiagnosticStatus.ERROR)):
        # The line keeps robot 1 below and robot 2 above y = offset; robot 1 stands at y = 1.
        number = int(10 * offset)
        contract = Contract(number, 0, [[0.0, -1.0]], np.full((1, 4), -offset))
        contracts.publish(convert_contracts.contracts_message(
            Contracts(1, EPOCH, number, (Offer(2, EPOCH, 1, contract),)), robots.now, 'map'))
        robots.contract = number
        robots.diagnostics.clear()
        status, facts = robots.diagnosis(lambda status, facts: status.level == level and facts['proofs'] != '0')
    assert 'contract 11 that the plan 0 of robot 1 breaks by 0.1' in status.message and facts['violations'] == '1'
    robots.contract = 0
    for solution in robots.solve(start).values():
        robots.hand_in(solution)
    assert robots.end(node) == 1
    report = ros.until(lambda: robots.reports)[0]
    assert not report.valid and report.arrived == 2 and report.proofs > 0 and len(report.violations) == 1


def test_an_outcome_that_cannot_be_written_is_a_sentence_and_code_1(ros, robots, scene, tmp_path, capfd):
    (tmp_path / 'file').write_text('')
    node = ros.add(WorldSimNode, scene=str(scene), out=str(tmp_path / 'file' / 'out'))
    robots.gather()
    for solution in robots.solve(seconds(robots.announced(MissionMessage.STARTED).start)).values():
        robots.hand_in(solution)
    assert robots.end(node) == 1
    out, err = capfd.readouterr()
    assert 'valid                   yes' in out and 'cannot be written' in err and 'Traceback' not in err


def test_a_judge_that_fails_ends_the_node_all_the_same(ros, robots, scene, monkeypatch):
    node = ros.add(WorldSimNode, scene=str(scene), discovery_timeout=0.1)
    monkeypatch.setattr(node._mission, 'report', lambda *_: 1 / 0)
    assert robots.end(node) == 1 and node._guard.faults == 1


@pytest.mark.parametrize('text, words', [
    ('robots: [', 'is not YAML'), ('[]', 'mapping'), ('robots: []\nboundary: {x: [0, 1], y: [0, 1]}', 'robots'),
    ('boundary: {x: [0, 4], y: [0, 4]}\nspeed: 3', 'keys'), ('map: nowhere.yaml\nrobots: []', 'nowhere'),
    ('boundary: {x: [0, 4], y: [0, 4]}\nrobots: [{id: 1, start: [1, 1, 0], goal: [2, 1, 0]}, '
     '{id: 2, start: [1.1, 1, 0], goal: [2, 3, 0]}]', 'overlap')])
def test_an_impossible_scene_is_refused_with_a_sentence(ros, tmp_path, text, words):
    (tmp_path / 'scene.yaml').write_text(text)
    with pytest.raises(PlanningError, match=words):
        ros.add(WorldSimNode, scene=str(tmp_path / 'scene.yaml'))


@pytest.mark.parametrize('parameters, words', [
    ({}, 'needs the parameter scene'), ({'scene': 'nowhere.yaml'}, 'nowhere.yaml'),
    ({'scene': 'x.yaml', 'discovery_timeout': 0.0}, 'within 0.1 to'), ({'scen': 'x'}, 'did you mean scene')])
def test_impossible_parameters_are_refused_with_a_sentence(ros, parameters, words):
    with pytest.raises(PlanningError, match=words):
        ros.add(WorldSimNode, **parameters)


def test_every_parameter_has_a_description_and_every_number_a_range(ros, scene):
    ros.add(WorldSimNode, scene=str(scene))
    names = list(WorldSimOptions.__dataclass_fields__)
    answer = ros.call(DescribeParameters, '/world_sim/describe_parameters', DescribeParameters.Request(names=names))
    assert all(entry.description and entry.read_only for entry in answer.descriptors)
    assert all(entry.integer_range or entry.floating_point_range for entry in answer.descriptors
               if entry.type in (2, 3))


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_as_a_process_interrupted_before_it_judged_it_ends_with_0(robots, start, scene, number):
    process = start('world_sim', '--ros-args', '-p', f"scene:='{scene}'")
    robots.announced(MissionMessage.WAITING)
    process.signal(number)
    code, out, err = process.result()
    assert (code, out) == (0, '') and 'Traceback' not in err


def test_as_a_process_it_gives_up_with_code_1_naming_the_robots_that_are_not_there(start, scene):
    process = start('world_sim', '--ros-args', '-p', f"scene:='{scene}'", '-p', 'discovery_timeout:=0.1')
    code, out, err = process.result()
    assert code == 1 and 'robots [1, 2] are not there' in out and 'Traceback' not in err


@pytest.mark.parametrize('arguments, words', [
    ([], 'needs the parameter scene'), (['-p', 'scnee:=x'], 'did you mean scene'),
    (['-p', 'scene:=3'], 'must be a str'), (['-p', 'scene:=/nowhere/x.yaml'], '/nowhere/x.yaml')])
def test_as_a_process_it_ends_with_2_and_a_sentence_for_bad_parameters(start, arguments, words):
    code, out, err = start('world_sim', '--ros-args', *arguments).result()
    assert (code, out) == (2, '') and err.startswith('world_sim: ') and words in err and 'Traceback' not in err
