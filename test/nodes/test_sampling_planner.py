"""The sampling planner, in process: the action, the services, and what comes by topic."""
import signal
import time

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from builtin_interfaces.msg import Duration, Time
from mobile_planning_msgs.action import ComputePath
from mobile_planning_msgs.msg import ObstacleArray
from mobile_planning_msgs.srv import BuildRoadmap, PlanPath, RoadmapFile
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path
from rclpy.action import ActionClient
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from mobile_planning.errors import InvalidInput, LimitExceeded, NotBuilt, UnknownFrame
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import header, path_poses, pose_stamped
from mobile_planning.nodes.convert_map import map_message
from mobile_planning.nodes.convert_obstacles import MOST_OBSTACLES, graph_markers, obstacles
from mobile_planning.nodes.plan_path import parse
from mobile_planning.nodes.sampling_planner import SamplingPlanner
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import RoundObstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

START, GOAL = (1.0, 1.0, 0.0), (5.0, 1.0, 0.5)


@pytest.fixture
def grid():
    """Return a map of 6 m x 4 m with a wall that has a gap at its upper end, and a closed chamber."""
    data = np.zeros((40, 60), np.int8)
    data[:28, 30:32] = 100
    data[28, 48:58] = data[28:38, 48] = data[38, 48:58] = data[28:39, 57] = 100
    return OccupancyGrid(data, 0.1)


SEALED = (5.3, 3.4, 0.0)


@pytest.fixture
def planner(ros, grid):
    """Return a sampling planner that has the map."""
    planner = ros.add(SamplingPlanner, roadmap_nodes=500, turning_radius=0.3)
    publisher = ros.node.create_publisher(OccupancyGridMessage, '/map', qos.MAP)
    publisher.publish(map_message(grid, 'map', Time()))
    ros.until(lambda: planner._site.wanted.grid == grid)
    # Behind the loading of the kernels.
    assert ros.call(Trigger, '/sampling_planner/clear').success
    return planner


def request(start=START, goal=GOAL, frame='map', kind=PlanPath.Request, **fields):
    """Return a request for a path."""
    return kind(start=pose_stamped(start, frame), goal=pose_stamped(goal, frame), **fields)


def ask(ros, *args, **fields):
    """Return the answer to a request for a path."""
    fields.setdefault('planner', 'prm')
    return ros.call(PlanPath, '/sampling_planner/plan_path', request(*args, **fields))


def seconds_of(value):
    """Return a duration of so many seconds."""
    return Duration(sec=int(value), nanosec=int(value % 1 * 1e9))


def obstacle_array(frame='map', discs=(), corners=(), polygons=(), velocities=()):
    """Return a message of obstacles."""
    return ObstacleArray(header=header(frame), discs=[float(x) for x in discs], corners=list(corners),
                         polygons=[float(x) for x in polygons], velocities=[float(x) for x in velocities])


@pytest.mark.parametrize('name', ['prm', 'prm_dubins', 'prm_reeds_shepp', 'rrt', 'rrt_star'])
def test_every_planner_answers_by_its_id_and_keeps_out_of_the_wall(ros, planner, grid, name):
    # One makes the best of its time, the others need a busy machine's worst.
    answer = ask(ros, planner=name, deadline=seconds_of(2.0 if name == 'rrt_star' else 20.0), seed=3)
    assert answer.error_code == 0, answer.error_msg
    poses = path_poses(answer.path)
    assert np.allclose(poses[0], START) and np.allclose(poses[-1], GOAL, atol=0.1)
    assert Environment(grid=grid).free_poses(poses).all() and answer.cost > 5.43
    assert {entry.key: entry.value for entry in answer.statistics}['planner'] == name


def test_the_path_is_published_and_latched(ros, planner):
    answer = ask(ros)
    paths = ros.listen(Path, '/sampling_planner/path', qos.PATH)
    ros.until(lambda: paths)
    assert paths == [answer.path]


@pytest.mark.parametrize('fields, code', [
    ({'planner': 'teleport'}, 201), ({'frame': 'odom'}, 202), ({'start': (-1, 1, 0)}, 203), ({'goal': (9, 9, 0)}, 204),
    ({'start': (3.1, 1, 0)}, 205), ({'goal': (3.1, 1, 0)}, 206), ({'goal': (np.nan, 1, 0)}, 251),
    ({'goal': SEALED, 'deadline': Duration(sec=25)}, 208), ({'deadline': Duration(sec=-1)}, 251)])
def test_what_cannot_be_answered_has_a_code_and_a_sentence(ros, planner, fields, code):
    answer = ask(ros, **fields)
    assert answer.error_code == code and answer.error_msg and not answer.path.poses
    assert ask(ros).error_code == 0


def test_without_a_map_there_is_no_path(ros):
    ros.add(SamplingPlanner)
    assert ask(ros, deadline=Duration(sec=25)).error_code == PlanPath.Response.NO_MAP


def test_the_answer_comes_by_the_deadline_when_there_is_none(ros, planner):
    ask(ros)
    began = time.monotonic()
    answer = ask(ros, goal=SEALED, planner='rrt', deadline=seconds_of(0.3))
    assert answer.error_code == PlanPath.Response.TIMEOUT and time.monotonic() - began < 20


class Action:
    """A client of the action."""

    def __init__(self, ros):
        self._ros, self.feedback = ros, []
        self._client = ActionClient(ros.node, ComputePath, '/sampling_planner/compute_path')
        ros.until(self._client.server_is_ready)

    def send(self, **fields):
        """Return the handle of a goal that was accepted."""
        future = self._client.send_goal_async(request(kind=ComputePath.Goal, **fields),
                                              lambda message: self.feedback.append(message.feedback))
        self._ros.until(future.done)
        assert future.result().accepted
        return future.result()

    def result(self, handle):
        """Return status and result of a goal."""
        future = handle.get_result_async()
        self._ros.until(future.done)
        return future.result().status, future.result().result


def test_the_action_answers_as_the_service_does(ros, planner):
    status, result = (action := Action(ros)).result(action.send(planner='prm', seed=3))
    assert status == GoalStatus.STATUS_SUCCEEDED and result.error_code == 0
    answer = ask(ros, seed=3)
    assert result.cost == answer.cost and np.array_equal(path_poses(result.path), path_poses(answer.path))
    status, result = action.result(action.send(planner='prm', goal=SEALED, deadline=Duration(sec=25)))
    assert status == GoalStatus.STATUS_ABORTED and result.error_code == 208 and result.error_msg


def test_the_action_tells_how_far_it_is_and_is_withdrawn_at_once(ros, planner):
    action = Action(ros)
    handle = action.send(planner='rrt', goal=SEALED, deadline=Duration(sec=60))
    ros.until(lambda: len(action.feedback) >= 3)
    assert action.feedback[-1].nodes >= action.feedback[0].nodes and action.feedback[0].best_cost == np.inf
    waiting = action.send(planner='rrt', goal=SEALED, deadline=Duration(sec=60))
    for each in (waiting, handle):
        ros.until(each.cancel_goal_async().done)
        status, result = action.result(each)
        assert status == GoalStatus.STATUS_CANCELED and result.error_code == PlanPath.Response.CANCELLED
    # The worker is free again long before the deadline of what it was told to do.
    assert ask(ros).error_code == 0


def roadmap_file(ros, name, path, planner='prm'):
    """Return the answer to a request to save or load."""
    return ros.call(RoadmapFile, f'/sampling_planner/{name}', RoadmapFile.Request(planner=planner, path=str(path)))


def test_a_roadmap_is_built_saved_forgotten_and_loaded(ros, planner, tmp_path):
    file = tmp_path / 'roadmap.npz'
    assert roadmap_file(ros, 'save_roadmap', file).error_code == NotBuilt.code
    built = ros.call(BuildRoadmap, '/sampling_planner/build_roadmap', BuildRoadmap.Request(nodes=300, seed=5))
    assert (built.error_code, built.nodes) == (0, 300) and built.edges > 0 and built.radius > 0
    before = ask(ros)
    assert {entry.key: entry.value for entry in before.statistics}['roadmap'] == 'reused'
    assert roadmap_file(ros, 'save_roadmap', file).nodes == 300 and file.exists()
    assert ros.call(Trigger, '/sampling_planner/clear').success
    assert roadmap_file(ros, 'save_roadmap', file).error_code == NotBuilt.code
    assert roadmap_file(ros, 'load_roadmap', file).nodes == 300
    after = ask(ros)
    assert after.cost == before.cost and path_poses(after.path).tolist() == path_poses(before.path).tolist()


@pytest.mark.parametrize('name, path, planner_id, code', [
    ('load_roadmap', '', 'prm', 251), ('load_roadmap', '/nowhere/roadmap.npz', 'prm', 200),
    ('load_roadmap', __file__, 'prm', 251), ('save_roadmap', '', 'prm', 251), ('save_roadmap', 'x.npz', 'rrt', 201)])
def test_a_file_that_is_no_roadmap_is_refused(ros, planner, name, path, planner_id, code):
    answer = roadmap_file(ros, name, path, planner_id)
    assert answer.error_code == code and answer.error_msg and planner.guard.faults == 0


def test_obstacles_stand_in_the_way_from_the_next_request_on(ros, planner):
    publisher = ros.node.create_publisher(ObstacleArray, '/obstacles', qos.MAP)
    before = ask(ros, goal=(2.5, 1.0, 0.0))
    assert before.cost == pytest.approx(1.5)
    publisher.publish(obstacle_array(discs=(1.8, 1.0, 0.3)))
    ros.until(lambda: planner._site.wanted.obstacles.fixed)
    for name in ('prm', 'rrt'):
        poses = path_poses(ask(ros, goal=(2.5, 1.0, 0.0), planner=name, deadline=seconds_of(5)).path)
        assert len(poses) and (np.hypot(*(poses[:, :2] - (1.8, 1.0)).T) >= 0.3 - 2e-3).all()
    publisher.publish(obstacle_array())
    ros.until(lambda: not planner._site.wanted.obstacles.fixed)
    assert ask(ros, goal=(2.5, 1.0, 0.0)).cost == before.cost


def test_a_tree_waits_for_no_obstacle_that_will_have_moved_on(ros, planner):
    publisher = ros.node.create_publisher(ObstacleArray, '/obstacles', qos.MAP)
    # It stands on the start's right and drives away faster than the robot.
    publisher.publish(obstacle_array(discs=(1.5, 1.0, 0.3), velocities=(0.0, -5.0)))
    ros.until(lambda: planner._site.wanted.obstacles.moving)
    answer = ask(ros, goal=(2.5, 1.0, 0.0), planner='rrt', deadline=seconds_of(5))
    assert answer.error_code == 0, answer.error_msg


def test_bad_obstacles_change_nothing(ros, planner):
    publisher = ros.node.create_publisher(ObstacleArray, '/obstacles', qos.MAP)
    publisher.publish(obstacle_array(discs=(1.8, 1.0, -0.3)))
    ros.until(lambda: planner.guard.rejected.total() == 1)
    publisher.publish(obstacle_array(frame='odom', discs=(1.8, 1.0, 0.3)))
    ros.until(lambda: planner.guard.rejected.total() == 2)
    assert ask(ros, goal=(2.5, 1.0, 0.0)).cost == pytest.approx(1.5)


def test_the_tree_is_published_when_it_is_asked_for(ros, planner):
    trees = ros.listen(MarkerArray, '/sampling_planner/tree', qos.PATH)
    ask(ros)
    assert ros.call(Trigger, '/sampling_planner/publish_tree').success
    ros.until(lambda: trees)
    marker = trees[0].markers[0]
    assert len(marker.points) > 100 and marker.header.frame_id == 'map'


def test_the_executable_starts_answers_and_stops_on_a_signal(ros, start):
    process = start('sampling_planner')
    assert ask(ros, deadline=Duration(sec=25)).error_code == PlanPath.Response.NO_MAP
    process.signal(signal.SIGTERM)
    code, _, err = process.result()
    assert code == 0 and 'Traceback' not in err


@pytest.mark.parametrize('arguments, node', [
    (['--planner', 'prm'], 'sampling_planner'), (['--planner', 'rrt_star'], 'sampling_planner'),
    (['--planner', 'dstar'], 'grid_planner'), ([], 'grid_planner'), (['--planner', 'rrt', '--node', 'mine'], 'mine')])
def test_the_client_asks_the_node_that_has_the_planner(arguments, node):
    assert parse(['--start', '0', '0', '--goal', '1', '1', *arguments]).node == node


@pytest.mark.parametrize('fields, error', [
    ({'discs': (1, 2)}, InvalidInput), ({'corners': (3,), 'polygons': (0, 0, 1, 0)}, InvalidInput),
    ({'corners': (2,), 'polygons': (0, 0, 1, 0)}, InvalidInput), ({'discs': (1, 2, np.nan)}, InvalidInput),
    ({'discs': (1, 2, 3), 'velocities': (1,)}, InvalidInput), ({'frame': ''}, UnknownFrame),
    ({'discs': (1, 2, 3), 'velocities': (1, np.inf)}, InvalidInput),
    ({'discs': (0, 0, 1) * (MOST_OBSTACLES + 1)}, LimitExceeded)])
def test_an_obstacle_array_that_makes_no_obstacles_is_refused(fields, error):
    with pytest.raises(error):
        obstacles(obstacle_array(**fields), 'map')


def test_obstacles_with_a_velocity_move():
    message = obstacle_array(discs=(1, 2, 0.5, 3, 4, 0.5), corners=(3, 4),
                             polygons=(0, 0, 1, 0, 0, 1, 0, 5, 1, 5, 1, 6, 0, 6), velocities=(0, 0, 1, 2, 0, 0, -1, 0))
    message.header.stamp = Time(sec=7)
    found = obstacles(message, 'map')
    assert [type(each) for each in found.fixed][0] is RoundObstacle and len(found.fixed) == 2 == len(found.moving)
    assert [each.velocity for each in found.moving] == [(1.0, 2.0), (-1.0, 0.0)] and found.since == 7.0


def test_a_graph_without_edges_takes_the_old_one_away():
    assert graph_markers(np.empty((0, 2, 2)), 'map', Time()).markers[0].action == 2
    assert len(graph_markers(np.zeros((5, 2, 2)), 'map', Time()).markers[0].points) == 10
