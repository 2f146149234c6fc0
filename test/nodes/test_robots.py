"""Several robots in one process."""
import pytest
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import RobotStatus
from nav_msgs.msg import Odometry
from rclpy.node import Node
from robot_fleet import Fleet
from std_srvs.srv import Trigger

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.announcement import State
from mobile_planning.nodes import qos
from mobile_planning.nodes.robot import RobotNode
from mobile_planning.nodes.robots import make_robots

IDS = (2, 5, 7)


@pytest.fixture
def scene(tmp_path):
    """Return the YAML file of a scene in which three robots change their places."""
    path = tmp_path / 'three.yaml'
    path.write_text('boundary: {x: [0, 5], y: [0, 5]}\nrobots:\n  - {id: 2, start: [1, 1, 0], goal: [3, 3, 0]}\n'
                    '  - {id: 5, start: [3, 3, 0], goal: [1, 1, 0]}\n  - {id: 7, start: [1, 3, 0], goal: [3, 1, 0]}\n')
    return str(path)


@pytest.fixture
def fleet(ros):
    """Return the `Fleet` of this test."""
    return Fleet(ros)


def test_three_robots_of_one_process_change_their_places(ros, fleet, scene):
    nodes = ros.add(make_robots, scene=scene, robots=list(IDS))
    assert [node.get_name() for node in nodes] == ['robot_2', 'robot_5', 'robot_7']
    assert len({id(node.host) for node in nodes}) == 1
    statuses = ros.listen(RobotStatus, '/robot_7/status', qos.live(1))
    fleet.announce(State.STARTED, ids=IDS, start=fleet.now + 0.5)
    ros.until(lambda: len({solution.robot_id for solution in fleet.solutions if solution.done}) == 3)
    assert {message.robot_id for message in fleet.messages} == set(IDS)
    ros.until(lambda: statuses and statuses[-1].mode == RobotMessage.DONE)
    assert statuses[-1].robot_id == 7 and not statuses[-1].silent
    assert sum(node._guard.faults for node in nodes) == 0


def test_one_of_them_is_held_while_the_others_go_on(ros, fleet, scene):
    ros.add(make_robots, scene=scene, robots=[2, 7])
    bodies = {eyed: ros.listen(Odometry, f'/robot_{eyed}/odom', qos.live()) for eyed in (2, 7)}
    fleet.announce(State.STARTED, ids=(2, 7), start=fleet.now + 0.5)
    assert ros.call(Trigger, '/robot_2/pause').success
    ros.until(lambda: any(solution.robot_id == 7 and solution.done for solution in fleet.solutions))
    assert bodies[2][-1].pose.pose.position.x < 1.5
    ros.call(Trigger, '/robot_2/resume')
    ros.until(lambda: any(solution.robot_id == 2 and solution.done for solution in fleet.solutions))


def test_without_a_list_there_is_one_robot_with_the_name_that_it_is_given(ros, scene):
    (node,) = ros.add(make_robots, scene=scene, robot_id=5)
    assert node.robot_id == 5 and node.get_name() == 'robot'


def test_who_reads_the_parameters_goes_only_when_the_robots_are_there(ros, scene, monkeypatch):
    order = []

    class Reader(Node):
        def destroy_node(self):
            order.append('reader gone')
            super().destroy_node()

    monkeypatch.setattr('mobile_planning.nodes.robots.Node', Reader)
    made = RobotNode._make_agent
    monkeypatch.setattr(RobotNode, '_make_agent', lambda *args: (order.append('robot there'), made(*args))[1])
    ros.add(make_robots, scene=scene, robots=[2, 7])
    assert order == ['robot there', 'robot there', 'reader gone']


def test_one_that_is_not_in_the_scene_is_refused_and_none_is_left_behind(ros, scene):
    with pytest.raises(InvalidInput, match='not 9'):
        ros.add(make_robots, scene=scene, robots=[2, 9])
    ros.until(lambda: not [name for name in ros.node.get_node_names() if name.startswith('robot')])


def test_as_a_process_they_stop_on_a_signal(fleet, start, scene):
    process = start('robot', '--ros-args', '-p', f"scene:='{scene}'", '-p', 'robots:=[2, 5, 7]')
    for eyed in IDS:
        fleet.hear(lambda message, eyed=eyed: message.robot_id == eyed)
    process.signal(15)
    code, out, err = process.result()
    assert (code, out) == (0, '') and 'Traceback' not in err
