"""What running nodes publish, hear and answer is what the policy for DDS-Security allows them."""
import pytest
from policy import allowances, is_allowed
from robot_fleet import Fleet

from mobile_planning.nodes.grid_planner import GridPlanner
from mobile_planning.nodes.map_server import MapServer
from mobile_planning.nodes.sampling_planner import SamplingPlanner
from mobile_planning.nodes.world_sim import WorldSimNode

#: What a node has only now and then: with simulated time, with tf2_ros, while it saves the map of a topic.
AT_TIMES = {'/clock', '/tf', '/tf_static'}
OFTEN_MISSING = {('robot', 'subscribe'): {'/robot*/odom'}, ('map_server', 'subscribe'): {'/map'}}


def names(pairs):
    """Return the names of a list of the graph."""
    return {name for name, _ in pairs}


def graph(node, name):
    """Return the names that a node uses, by deed, as another one sees them."""
    tell = {'publish': 'publisher', 'subscribe': 'subscriber', 'reply': 'service', 'request': 'client'}
    return {deed: names(getattr(node, f'get_{kind}_names_and_types_by_node')(name, '/'))
            for deed, kind in tell.items()}


@pytest.fixture
def running(ros, tmp_path):
    """Return the names of the nodes of each kind, with all that their parameters can add."""
    scene = tmp_path / 'two.yaml'
    scene.write_text('boundary: {x: [0, 4], y: [0, 4]}\nrobots: [{id: 1, start: [1, 1, 0], goal: [2, 1, 0]}]')
    fleet = Fleet(ros)
    fleet.robot(1), fleet.robot(2, simulate=False, takes_goal_pose=True, navigate_to_pose=True)
    for node, parameters in (MapServer, {}), (GridPlanner, {}), (SamplingPlanner, {}), (WorldSimNode, {'scene': scene}):
        ros.add(node, **{name: str(value) for name, value in parameters.items()})
    # The pilot of a real base is a process of its own.
    ros.until(lambda: 'robot_2_pilot' in ros.node.get_node_names()
              and ros.node.count_publishers('/robot_2/cmd_vel') and ros.node.count_subscribers('/robot_2/pose'))
    return {'robot': ['robot_1', 'robot_2', 'robot_2_pilot'],
            **{name: [name] for name in ('map_server', 'grid_planner', 'sampling_planner', 'world_sim')}}


def test_nodes_have_exactly_the_names_that_the_policy_gives_them(ros, running):
    granted = allowances()
    for enclave, nodes in running.items():
        used = [graph(ros.node, name) for name in nodes]
        for deed in 'publish', 'subscribe', 'reply', 'request':
            patterns = granted[enclave].get(deed, [])
            named = set().union(*(each[deed] for each in used))
            assert {name for name in named if not is_allowed(name, patterns)} == set(), f'{enclave} may not {deed}'
            unused = {pattern for pattern in patterns if not any(is_allowed(name, [pattern]) for name in named)}
            assert unused - AT_TIMES - OFTEN_MISSING.get((enclave, deed), set()) == set(), f'{enclave}: {deed}'
