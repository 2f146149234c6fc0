"""The grid planner, in process: every error code end to end, and a life that nothing ends."""
import threading

import numpy as np
import pytest
from builtin_interfaces.msg import Duration, Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseStamped
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from mobile_planning_msgs.msg import CostToGo, CostUpdates, PlanProgress
from mobile_planning_msgs.srv import PlanPath, UpdateCosts
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from rclpy.parameter import Parameter
from std_srvs.srv import Trigger

from mobile_planning.errors import PlanningError
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import header, path_poses, pose_stamped, seconds
from mobile_planning.nodes.convert_map import map_message
from mobile_planning.nodes.grid_planner import GridPlanner
from mobile_planning.nodes.progress import PATIENCE
from mobile_planning.nodes.worker import MAX_WAITING
from mobile_planning.path_server import PathServer
from mobile_planning.world.occupancy_grid import OccupancyGrid

START, GOAL = (0.15, 0.15, 1.0), (0.85, 0.15, -2.0)


@pytest.fixture
def grid():
    """Return a map of 1 m x 0.6 m: a wall with a gap at its upper end, an unknown cell, and a closed chamber."""
    data = np.zeros((6, 10), np.int8)
    data[:5, 4] = 100
    data[0, 0] = -1
    data[3, 7:10], data[3:, 7] = 100, 100
    return OccupancyGrid(data, 0.1)


class Maps:
    """Publishes maps as a map server does."""

    def __init__(self, ros, topic='/map'):
        self._ros = ros
        self._publisher = ros.node.create_publisher(OccupancyGridMessage, topic, qos.MAP)

    def publish(self, planner, grid, frame='map'):
        """Publish a map and wait until the planner plans on it."""
        self._publisher.publish(map_message(grid, frame, Time()))
        self._ros.until(lambda: planner._site._adopted.grid == grid and planner._site._adopted.frame == frame)

    def publish_bad(self, planner, message):
        """Publish a map that the planner refuses, and wait until it has."""
        before = planner.guard.rejected.total()
        self._publisher.publish(message)
        self._ros.until(lambda: planner.guard.rejected.total() > before)


@pytest.fixture
def maps(ros):
    """Return a publisher of maps."""
    return Maps(ros)


@pytest.fixture
def planner(ros, maps, grid):
    """Return a grid planner that has the map."""
    planner = ros.add(GridPlanner)
    maps.publish(planner, grid)
    return planner


def request(start=START, goal=GOAL, frame='map', **fields):
    """Return a request for a path."""
    start, goal = (pose if isinstance(pose, PoseStamped) else pose_stamped(pose, frame) for pose in (start, goal))
    return PlanPath.Request(start=start, goal=goal, **fields)


def ask(ros, *args, **fields):
    """Return the answer to a request for a path."""
    return ros.call(PlanPath, '/grid_planner/plan_path', request(*args, **fields))


def test_a_path_leads_from_start_to_goal_with_both_orientations(ros, planner, grid):
    answer = ask(ros, planner='distance_transform')
    assert (answer.error_code, answer.error_msg) == (PlanPath.Response.NONE, '')
    poses = path_poses(answer.path)
    assert np.allclose(poses[[0, -1]], [START, GOAL])
    assert not grid.occupied()[tuple(grid.world_to_cell(poses[:, :2]).T[::-1])].any()
    assert answer.path.header.frame_id == 'map' and answer.path.header.stamp != Time()
    assert answer.cost >= np.hypot(0.3, 0.4) + np.hypot(0.4, 0.4) and seconds(answer.planning_time) >= 0
    assert {entry.key: entry.value for entry in answer.statistics}['planner'] == 'distance_transform'


def test_the_answer_is_the_path_servers(ros, planner, grid):
    server = PathServer()
    server.set_map(grid)
    expected = server.plan_path('', START, GOAL)
    answer = ask(ros)
    assert np.allclose(path_poses(answer.path), expected.poses) and answer.cost == expected.cost


def test_the_path_is_published_and_latched(ros, planner):
    answer = ask(ros)
    paths = ros.listen(Path, '/grid_planner/path', qos.PATH)
    ros.until(lambda: paths)
    assert paths == [answer.path]


def test_paths_asked_for_together_are_published_one_by_one_as_they_were_answered(ros, planner):
    paths = ros.listen(Path, '/grid_planner/path', qos.live(100))
    client = ros.node.create_client(PlanPath, '/grid_planner/plan_path', qos_profile=qos.REQUESTS)
    ros.until(lambda: client.service_is_ready() and ros.node.count_publishers('/grid_planner/path'))
    ask(ros)
    ros.until(lambda: paths)
    pending = [client.call_async(request(start=(0.15, y, 0))) for y in (0.15, 0.25, 0.35, 0.45, 0.55)]
    ros.until(lambda: all(future.done() for future in pending) and len(paths) == 6)
    # A request whose result was there at once may be answered before one that had to wait for its own.
    answered = sorted((future.result().path for future in pending), key=lambda path: seconds(path.header.stamp))
    assert paths[1:] == answered


def test_get_plan_answers_with_the_same_path(ros, planner):
    answer = ros.call(GetPlan, '/grid_planner/get_plan', GetPlan.Request(
        start=pose_stamped(START, 'map'), goal=pose_stamped(GOAL, 'map')))
    assert np.allclose(path_poses(answer.plan), path_poses(ask(ros).path))


def test_get_plan_answers_a_failure_with_an_empty_plan(ros, planner):
    answer = ros.call(GetPlan, '/grid_planner/get_plan', GetPlan.Request(
        start=pose_stamped(START, 'map'), goal=pose_stamped((9, 9, 0), 'map')))
    assert not answer.plan.poses and planner.guard.rejected['204 GoalOutside'] == 1


PLANNERS = PathServer().planners


def test_every_planner_answers_by_its_id(ros, planner, grid):
    planner.set_parameters([Parameter('turning_radius', value=0.05)])
    costs = {}
    for name in PLANNERS:
        answer = ask(ros, (0.15, 0.15, 1.5), (0.85, 0.15, -1.5), planner=name)
        assert answer.error_code == 0, answer.error_msg
        poses = path_poses(answer.path)
        assert np.allclose(poses[[0, -1]], [(0.15, 0.15, 1.5), (0.85, 0.15, -1.5)])
        assert not grid.occupied()[tuple(grid.world_to_cell(poses[:, :2]).T[::-1])].any()
        assert {entry.key: entry.value for entry in answer.statistics}['planner'] == name
        costs[name] = answer.cost
    assert np.isclose(costs['dstar'], costs['distance_transform']) and np.isclose(costs['astar'], costs['dstar'])


def statistics(answer):
    """Return the statistics of an answer."""
    assert answer.error_code == 0, answer.error_msg
    return {entry.key: entry.value for entry in answer.statistics}


# The gap at the upper end of the wall.
GAP = 4 + 5 * 10


def update(ros, cells=(GAP,), costs=(float('inf'),), frame='map'):
    """Return the answer to a request to change costs."""
    updates = CostUpdates(header=header(frame), cells=cells, costs=costs)
    return ros.call(UpdateCosts, '/grid_planner/update_costs', UpdateCosts.Request(updates=updates))


@pytest.mark.parametrize('name', PLANNERS)
def test_an_update_counts_from_the_next_request_on_and_until_the_next_map(ros, planner, maps, grid, name):
    planner.set_parameters([Parameter('turning_radius', value=0.05)])
    ends = {'start': (0.15, 0.15, 1.5), 'goal': (0.85, 0.15, -1.5), 'planner': name}
    before = ask(ros, **ends)
    assert before.error_code == 0 and update(ros).error_code == 0
    assert ask(ros, **ends).error_code == PlanPath.Response.NO_PATH
    assert update(ros, costs=[1.0]).error_code == 0
    assert np.array_equal(path_poses(ask(ros, **ends).path), path_poses(before.path))
    assert update(ros).error_code == 0
    maps.publish(planner, OccupancyGrid(grid.data, grid.resolution))
    ros.until(lambda: planner._site.wanted is planner._site._adopted)
    assert ask(ros, **ends).cost == pytest.approx(before.cost)


def test_updates_on_the_topic_repair_the_plan_of_dstar(ros, planner):
    publisher = ros.node.create_publisher(CostUpdates, '/grid_planner/cost_updates', qos.REQUESTS)
    ros.until(publisher.get_subscription_count)
    assert statistics(ask(ros, planner='dstar'))['plan'] == 'computed'
    publisher.publish(CostUpdates(header=header('map'), cells=[GAP], costs=[3.0]))
    ros.until(lambda: len(planner._site._server.updates[1]) == 1)
    facts = statistics(ask(ros, planner='dstar'))
    assert facts['plan'] == 'repaired' and int(facts['expansions']) > 0 and facts['full_replan'] == 'false'
    assert statistics(ask(ros, planner='dstar'))['plan'] == 'reused'
    publisher.publish(CostUpdates(header=header('map'), cells=[60], costs=[3.0]))
    ros.until(lambda: planner.guard.rejected['251 InvalidInput'] == 1)


def test_updates_outlive_a_change_of_parameters(ros, planner):
    update(ros)
    planner.set_parameters([Parameter('corner_cutting', value=True)])
    assert ask(ros).error_code == PlanPath.Response.NO_PATH


@pytest.mark.parametrize('fields, code, words', [
    ({'frame': 'odom'}, PlanPath.Response.UNKNOWN_FRAME, "'odom'"),
    ({'frame': ''}, PlanPath.Response.UNKNOWN_FRAME, 'empty'),
    ({'cells': [60]}, PlanPath.Response.INVALID_INPUT, '(0, 6)'),
    ({'cells': [2**32 - 1]}, PlanPath.Response.INVALID_INPUT, 'not a cell'),
    ({'costs': [0.0]}, PlanPath.Response.INVALID_INPUT, 'cost 0.0'),
    ({'costs': [float('nan')]}, PlanPath.Response.INVALID_INPUT, 'nan'),
    ({'costs': [1.0, 2.0]}, PlanPath.Response.INVALID_INPUT, '(2,)'),
    ({'cells': [0] * 1_000_001, 'costs': [1.0] * 1_000_001}, PlanPath.Response.LIMIT_EXCEEDED, '1000000')])
def test_a_bad_update_is_refused_with_a_reason_and_changes_nothing(ros, planner, fields, code, words):
    answer = update(ros, **fields)
    assert answer.error_code == code and words in answer.error_msg, answer.error_msg
    assert planner.guard.faults == 0 and len(planner._site._server.updates[1]) == 0
    assert ask(ros).error_code == 0


def test_an_update_without_a_map_is_refused(ros):
    ros.add(GridPlanner)
    assert update(ros).error_code == PlanPath.Response.NO_MAP


def test_a_start_within_the_inflation_is_left(ros, planner):
    planner.set_parameters([Parameter('inflation_radius', value=0.1)])
    answer = ask(ros, start=(0.35, 0.25, 0), goal=(0.15, 0.25, 0))
    assert statistics(answer)['left_inflation'] == '0.100 m'
    assert ask(ros, start=(0.45, 0.25, 0), goal=(0.15, 0.25, 0)).error_code == PlanPath.Response.START_OCCUPIED


def test_the_field_of_the_newest_goal_is_published_on_request_and_latched(ros, planner, grid):
    answer = ros.call(Trigger, '/grid_planner/publish_cost_to_go')
    assert not answer.success and 'no path' in answer.message
    update(ros, costs=[2.0])
    for name in PLANNERS[:2]:
        ask(ros, planner=name)
        answer = ros.call(Trigger, '/grid_planner/publish_cost_to_go')
        assert answer.success and name in answer.message
        fields = ros.listen(CostToGo, '/grid_planner/cost_to_go', qos.PATH)
        ros.until(lambda: fields)
        message = fields[0]
        assert (message.planner, message.header.frame_id) == (name, 'map')
        assert (message.info.width, message.info.height) == (10, 6)
        assert np.isclose(message.goal.position.x, GOAL[0])
        field = np.reshape(message.cells, (6, 10))
        assert np.array_equal(np.isnan(field), grid.occupied()) and field[1, 8] == 0.0
        assert np.isclose(field[1, 1], ask(ros, planner=name).cost) and np.isinf(field[5, 9])


def test_masks_forbid_cells_and_slow_them_and_nothing_is_planned_without_them(ros, maps, grid):
    planner = ros.add(GridPlanner, keepout_topic='keepout', speed_topic='speed')
    publishers = [ros.node.create_publisher(OccupancyGridMessage, topic, qos.MAP) for topic in ('/keepout', '/speed')]
    maps._publisher.publish(map_message(grid, 'map', Time()))
    ros.until(lambda: planner._site.wanted.grid)
    free, gap = np.zeros((6, 10), np.int8), np.zeros((6, 10), np.int8)
    gap[5, 4] = 100

    def publish(i, name, data, frame='map'):
        known = planner._site.wanted
        publishers[i].publish(map_message(OccupancyGrid(data, 0.1), frame, Time()))
        ros.until(lambda: planner._site.wanted is not known)

    answer = ask(ros)
    assert answer.error_code == PlanPath.Response.NO_MAP and 'no keepout mask' in answer.error_msg
    publish(0, 'keepout', gap)
    assert 'no speed mask' in ask(ros).error_msg
    publish(1, 'speed', free)
    assert ask(ros).error_code == PlanPath.Response.NO_PATH
    publish(0, 'keepout', free)
    before = ask(ros, planner='dstar').cost
    publish(1, 'speed', gap // 2)
    # The steps into the cell and out of it are straight, and half of each is in the cell.
    assert np.isclose(ask(ros, planner='dstar').cost, before + 0.1) and np.isclose(ask(ros).cost, before)
    publish(0, 'keepout', free, 'odom')
    answer = ask(ros)
    assert answer.error_code == PlanPath.Response.UNKNOWN_FRAME and 'keepout mask' in answer.error_msg


def zero_quaternion():
    """Return a pose whose orientation was never filled in."""
    pose = pose_stamped(START, 'map')
    pose.pose.orientation.w = pose.pose.orientation.z = 0.0
    return pose


NAN = float('nan')


@pytest.mark.parametrize('fields, code, words', [
    ({'planner': 'a_star'}, PlanPath.Response.INVALID_PLANNER, "'a_star'"),
    ({'frame': 'odom'}, PlanPath.Response.UNKNOWN_FRAME, "'odom'"),
    ({'frame': ''}, PlanPath.Response.UNKNOWN_FRAME, 'frame_id is empty'),
    ({'frame': '/map'}, PlanPath.Response.UNKNOWN_FRAME, 'leading slash'),
    ({'start': (-0.1, 0.1, 0)}, PlanPath.Response.START_OUTSIDE, '-0.1'),
    ({'goal': (0.1, 0.7, 0)}, PlanPath.Response.GOAL_OUTSIDE, '0.7'),
    ({'goal': (1e300, 0.7, 0)}, PlanPath.Response.GOAL_OUTSIDE, '1e'),
    ({'start': (0.45, 0.15, 0)}, PlanPath.Response.START_OCCUPIED, '0.45'),
    ({'start': (0.05, 0.05, 0)}, PlanPath.Response.START_OCCUPIED, 'unknown'),
    ({'goal': (0.45, 0.15, 0)}, PlanPath.Response.GOAL_OCCUPIED, '0.45'),
    ({'goal': (0.85, 0.55, 0)}, PlanPath.Response.NO_PATH, '0.85'),
    ({'start': (NAN, 0.1, 0)}, PlanPath.Response.INVALID_INPUT, 'nan'),
    ({'goal': (0.1, float('inf'), 0)}, PlanPath.Response.INVALID_INPUT, 'inf'),
    ({'start': zero_quaternion}, PlanPath.Response.INVALID_INPUT, 'all zero'),
    ({'tolerance': NAN}, PlanPath.Response.INVALID_INPUT, 'tolerance'),
    ({'tolerance': -1.0}, PlanPath.Response.INVALID_INPUT, '-1'),
    ({'deadline': Duration(sec=-1)}, PlanPath.Response.INVALID_INPUT, 'negative'),
    ({'deadline': Duration(nanosec=1)}, PlanPath.Response.TIMEOUT, 'deadline'),
])
def test_a_failure_is_answered_with_its_code_and_a_sentence_and_the_next_request_succeeds(
        ros, planner, fields, code, words):
    answer = ask(ros, **{name: value() if callable(value) else value for name, value in fields.items()})
    assert answer.error_code == code and words in answer.error_msg, answer.error_msg
    assert not answer.path.poses and answer.cost == 0.0
    assert planner.guard.rejected.total() == 1 and planner.guard.faults == 0
    assert ask(ros).error_code == 0


def test_without_a_map_the_answer_is_no_map(ros):
    ros.add(GridPlanner)
    answer = ask(ros)
    assert answer.error_code == PlanPath.Response.NO_MAP and 'no map' in answer.error_msg


def test_the_map_topic_is_a_parameter(ros, grid):
    planner = ros.add(GridPlanner, map_topic='floor')
    Maps(ros, '/floor').publish(planner, grid)
    assert ask(ros).error_code == 0


def test_an_occupied_goal_may_be_replaced_within_the_tolerance(ros, planner):
    answer = ask(ros, goal=(0.45, 0.15, 0.5), tolerance=0.2)
    assert answer.error_code == 0
    end = path_poses(answer.path)[-1]
    assert np.hypot(*(end[:2] - (0.45, 0.15))) <= 0.2 and np.isclose(end[2], 0.5)


def test_the_frame_is_the_maps(ros, planner, maps, grid):
    maps.publish(planner, grid, 'hall')
    assert ask(ros).error_code == PlanPath.Response.UNKNOWN_FRAME
    assert ask(ros, frame='hall').path.header.frame_id == 'hall'


def test_a_new_map_replaces_the_old_one(ros, planner, maps, grid):
    around = ask(ros).cost
    maps.publish(planner, OccupancyGrid(np.zeros((6, 10), np.int8), 0.1))
    assert np.isclose(ask(ros).cost, 0.7) and around > 0.7


def test_a_bad_map_is_counted_and_the_old_one_stays(ros, planner, maps, grid):
    before = ask(ros).cost
    message = map_message(OccupancyGrid(np.zeros((6, 10), np.int8), 0.1), 'map', Time())
    message.data = message.data[:-1]
    maps.publish_bad(planner, message)
    message = map_message(OccupancyGrid(np.zeros((6, 10), np.int8), 0.1), '', Time())
    maps.publish_bad(planner, message)
    assert ask(ros).cost == before
    assert planner.guard.rejected == {'251 InvalidInput': 1, '202 UnknownFrame': 1}


def test_parameters_change_what_is_planned_from_the_next_request_on(ros, planner):
    assert ask(ros, start=(0.05, 0.05, 0)).error_code == PlanPath.Response.START_OCCUPIED
    planner.set_parameters([Parameter('unknown_is_free', value=True)])
    assert ask(ros, start=(0.05, 0.05, 0)).error_code == 0
    planner.set_parameters([Parameter('inflation_radius', value=1)])
    answer = ask(ros)
    assert answer.error_code == PlanPath.Response.GOAL_OCCUPIED and 'inflation radius of 1 m' in answer.error_msg


@pytest.mark.parametrize('name, value', [('inflation_radius', -1.0), ('inflation_radius', NAN),
                                         ('default_planner', 'a_star'), ('default_deadline', 0.0),
                                         ('corner_cutting', 'yes'), ('map_topic', 'other')])
def test_a_bad_parameter_is_refused_with_a_reason(ros, planner, name, value):
    before = planner.options
    (result,) = planner.set_parameters([Parameter(name, value=value)])
    assert not result.successful and result.reason and planner.options == before
    assert ask(ros).error_code == 0


@pytest.mark.parametrize('name, value', [('inflation_radius', -1.0), ('default_planner', 'a_star')])
def test_a_bad_parameter_at_the_start_is_refused(ros, name, value):
    with pytest.raises(PlanningError, match=str(value)):
        ros.add(GridPlanner, **{name: value})


class Gate:
    """Stands in for a path server whose planning takes as long as the test wants."""

    def __init__(self, planner, monkeypatch):
        self.entered, self._open, self._plan_path = threading.Semaphore(0), threading.Event(), PathServer.plan_path
        self.stops, self.counts = [], []

        def plan_path(server, *args, stop, done, **fields):
            self.stops.append(stop)
            self.counts.append(done)
            self.entered.release()
            while not (self._open.is_set() or stop[0]):
                self._open.wait(0.01)
            return self._plan_path(server, *args, stop=stop, done=done, **fields)
        monkeypatch.setattr(PathServer, 'plan_path', plan_path)

    def open(self):
        """Let planning go on."""
        self._open.set()


@pytest.fixture
def gate(planner, monkeypatch):
    """Return the gate that every planning now waits at."""
    return Gate(planner, monkeypatch)


def test_a_map_that_arrives_while_planning_counts_from_the_next_request_on(ros, planner, maps, gate, grid):
    first = ros.send(PlanPath, '/grid_planner/plan_path', request())
    ros.until(lambda: gate.entered.acquire(blocking=False))
    empty = OccupancyGrid(np.zeros((6, 10), np.int8), 0.1)
    maps._publisher.publish(map_message(empty, 'hall', Time()))
    ros.until(lambda: planner._site.wanted.grid == empty)
    second = ros.send(PlanPath, '/grid_planner/plan_path', request(frame='hall'))
    ros.until(lambda: planner._worker.waiting >= 2)
    gate.open()
    ros.until(lambda: first.done() and second.done())
    assert first.result().cost > 0.7 and first.result().path.header.frame_id == 'map'
    assert np.isclose(second.result().cost, 0.7) and second.result().path.header.frame_id == 'hall'


def test_the_node_answers_others_while_it_plans(ros, planner, gate):
    pending = ros.send(PlanPath, '/grid_planner/plan_path', request())
    ros.until(lambda: gate.entered.acquire(blocking=False))
    diagnostics = ros.listen(DiagnosticArray, '/diagnostics', qos.DIAGNOSTICS)
    ros.until(lambda: diagnostics)
    assert diagnostics[0].status[0].level == DiagnosticStatus.OK and not pending.done()
    gate.open()
    ros.until(pending.done)
    assert pending.result().error_code == 0


def test_a_plan_that_takes_long_tells_how_far_it_is_until_it_is_answered(ros, planner, gate):
    told = ros.listen(PlanProgress, '/grid_planner/progress', qos.PROGRESS)
    pending = ros.send(PlanPath, '/grid_planner/plan_path', request())
    ros.until(lambda: gate.entered.acquire(blocking=False))
    ros.until(lambda: told)
    assert (told[0].planner, told[0].header.frame_id) == ('distance_transform', 'map') and np.isnan(told[0].share)
    assert (told[0].goal.position.x, told[0].goal.position.y) == GOAL[:2] and seconds(told[0].elapsed) >= PATIENCE
    for done, share in ((25, 0.25), (50, 0.5), (120, 1.0)):
        gate.counts[0][:] = done, 100
        ros.until(lambda: told[-1].share == share)
    gate.open()
    ros.until(pending.done)
    assert pending.result().error_code == 0
    ros.until(planner._progress._timer.is_canceled)


def test_a_plan_that_is_there_at_once_tells_nothing(ros, planner):
    told = ros.listen(PlanProgress, '/grid_planner/progress', qos.PROGRESS)
    ros.until(lambda: ros.node.count_publishers('/grid_planner/progress'))
    assert ask(ros).error_code == 0 and ask(ros, planner='teleport').error_code == PlanPath.Response.INVALID_PLANNER
    ros.until(planner._progress._timer.is_canceled)
    assert told == [] and planner._site.under_way is None


def test_a_request_that_waits_does_not_pass_for_the_one_that_is_planned(ros, planner, gate):
    told = ros.listen(PlanProgress, '/grid_planner/progress', qos.PROGRESS)
    pending = [ros.send(PlanPath, '/grid_planner/plan_path', request(planner=name)) for name in ('dstar', 'astar')]
    ros.until(lambda: planner._worker.waiting and len(told) > 1)
    assert {message.planner for message in told} == {'dstar'}
    gate.open()
    ros.until(lambda: all(future.done() for future in pending))


def test_waiting_counts_towards_the_deadline(ros, planner, gate):
    first = ros.send(PlanPath, '/grid_planner/plan_path', request())
    ros.until(lambda: gate.entered.acquire(blocking=False))
    second = ros.send(PlanPath, '/grid_planner/plan_path', request(deadline=Duration(nanosec=1)))
    ros.until(second.done)
    assert second.result().error_code == PlanPath.Response.TIMEOUT and not first.done()
    gate.open()
    ros.until(first.done)
    assert first.result().error_code == 0 and len(gate.stops) == 1


def test_nobody_waits_beyond_the_deadline_for_planning_that_does_not_heed_it(ros, planner, gate):
    pending = ros.send(PlanPath, '/grid_planner/plan_path', request(deadline=Duration(nanosec=10 ** 7)))
    ros.until(pending.done)
    assert pending.result().error_code == PlanPath.Response.TIMEOUT and not gate._open.is_set()
    gate.open()
    assert ask(ros).error_code == 0 and planner.guard.faults == 0


def test_too_many_waiting_requests_are_refused_and_the_others_answered(ros, planner, gate):
    # All answers pass through the reader of every client: one of the default depth would lose its own among them.
    client = ros.node.create_client(PlanPath, '/grid_planner/plan_path', qos_profile=qos.REQUESTS)
    ros.until(client.service_is_ready)
    pending = [client.call_async(request())]
    ros.until(lambda: gate.entered.acquire(blocking=False))
    for number in range(MAX_WAITING):
        pending.append(client.call_async(request()))
        ros.until(lambda: planner._worker.waiting == number + 1)
    refused = ask(ros)
    assert refused.error_code == PlanPath.Response.LIMIT_EXCEEDED and str(MAX_WAITING) in refused.error_msg
    gate.open()
    ros.until(lambda: all(future.done() for future in pending))
    assert {future.result().error_code for future in pending} == {0}


def test_planning_stops_when_the_node_ends(ros, planner, gate):
    ros.send(PlanPath, '/grid_planner/plan_path', request())
    ros.until(lambda: gate.entered.acquire(blocking=False))
    ros.remove(planner)
    assert gate.stops[0][0] and not planner._worker._thread.is_alive()


def test_a_planner_that_breaks_is_answered_and_the_node_lives_on(ros, planner, monkeypatch):
    with monkeypatch.context() as broken:
        broken.setattr(PathServer, 'plan_path', lambda *_, **__: 1 / 0)
        answer = ask(ros)
    assert answer.error_code == PlanPath.Response.UNKNOWN and 'division' in answer.error_msg
    assert planner.guard.faults == 1 and ask(ros).error_code == 0


def change_state(ros, transition):
    """Ask for a transition by its name and return whether it was made."""
    id = getattr(Transition, f'TRANSITION_{transition.upper()}')
    return ros.call(ChangeState, '/grid_planner/change_state',
                    ChangeState.Request(transition=Transition(id=id))).success


def test_the_whole_life_cycle(ros, maps, grid):
    planner = ros.add(GridPlanner, autostart=False)
    assert ask(ros).error_code == PlanPath.Response.UNKNOWN and 'unconfigured' in ask(ros).error_msg
    assert change_state(ros, 'configure')
    maps.publish(planner, grid)
    assert 'inactive' in ask(ros).error_msg
    assert change_state(ros, 'activate') and ask(ros).error_code == 0
    assert change_state(ros, 'deactivate') and 'inactive' in ask(ros).error_msg
    assert change_state(ros, 'activate') and ask(ros).error_code == 0
    assert change_state(ros, 'deactivate') and change_state(ros, 'cleanup') and 'unconfigured' in ask(ros).error_msg
    # The map is latched: after another start it is there again.
    assert change_state(ros, 'configure') and change_state(ros, 'activate')
    ros.until(lambda: planner._site.wanted.frame)
    assert ask(ros).error_code == 0
