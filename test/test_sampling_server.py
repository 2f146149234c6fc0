"""The sampling server: planners by their id, roadmaps that outlive a map, obstacles that move."""
import numpy as np
import pytest

from mobile_planning.errors import Cancelled, InvalidInput, InvalidPlanner, NoMap, NoPath, PlanningTimeout
from mobile_planning.sampling_options import PLANNERS, ROADMAPS, SamplingOptions
from mobile_planning.sampling_server import Progress, SamplingServer
from mobile_planning.world.environment import Environment
from mobile_planning.world.moving_obstacle import MovingObstacle
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

START, GOAL = (0.5, 1.0, 0.2), (3.5, 1.0, -0.4)
OPEN = OccupancyGrid(np.zeros((20, 40), np.int8), 0.1)
WALL = OccupancyGrid(np.pad(np.full((14, 1), 100, np.int8), ((0, 6), (20, 19))), 0.1)
SHUT = OccupancyGrid(np.pad(np.full((20, 1), 100, np.int8), ((0, 0), (20, 19))), 0.1)


@pytest.fixture
def server():
    """Return a server on an empty map."""
    server = SamplingServer(SamplingOptions(roadmap_nodes=300, turning_radius=0.2, robot_radius=0.1))
    server.set_map(OPEN)
    return server


@pytest.mark.parametrize('planner', PLANNERS)
def test_every_planner_keeps_the_robots_disc_out_of_the_wall(server, planner):
    server.set_map(WALL)
    progress = Progress()
    plan = server.plan(planner, START, GOAL, deadline=20.0 if planner != 'rrt_star' else 1.0, seed=1,
                       progress=progress)
    assert Environment(grid=WALL, footprint=0.1).free_poses(plan.poses).all()
    assert np.allclose(plan.poses[0], START) and np.allclose(plan.poses[-1], GOAL, atol=0.1)
    steps = np.hypot(*np.diff(plan.poses[:, :2], axis=0).T)
    assert steps.max() <= 0.05 + 1e-9 and plan.cost >= steps.sum() - 1e-6
    assert progress.nodes > 1 and progress.began is not None and plan.statistics['planner'] == planner


@pytest.mark.parametrize('planner', ROADMAPS)
def test_a_roadmap_outlives_the_map_and_is_checked_on_the_new_one(server, planner):
    plan = {}
    for name, grid in (('open', OPEN), ('wall', WALL), ('again', OPEN)):
        server.set_map(grid)
        plan[name] = server.plan(planner, START, GOAL, deadline=20.0, seed=1)
    assert plan['open'].statistics['roadmap'] == 'built'
    assert {plan[name].statistics['roadmap'] for name in ('wall', 'again')} == {'reused'}
    assert plan['wall'].cost > plan['again'].cost == plan['open'].cost
    server.set_map(OccupancyGrid(np.zeros((30, 40), np.int8), 0.1))
    assert server.plan(planner, START, GOAL, deadline=20.0).statistics['roadmap'] == 'built'


def test_a_roadmap_meets_moving_obstacles_where_they_are_and_a_tree_where_they_will_be(server):
    # It crosses the way while the robot is still far from there.
    moving = [MovingObstacle(PolygonObstacle([(1.9, -9), (2.1, -9), (2.1, 2.0), (1.9, 2.0)]), (0.0, -5.0))]
    server.set_obstacles((), moving, since=100.0)
    with pytest.raises(NoPath):
        server.plan('prm', START, GOAL, now=100.0, deadline=20.0)
    assert server.plan('prm', START, GOAL, now=101.0, deadline=20.0).cost == pytest.approx(3.0)
    assert server.plan('rrt', START, GOAL, now=100.0, deadline=20.0, seed=1).cost < 10


def test_fixed_obstacles_replace_each_other(server):
    before = server.plan('prm', START, GOAL, deadline=20.0)
    server.set_obstacles([RoundObstacle((2.0, 1.0), 0.3)])
    around = server.plan('prm', START, GOAL, deadline=20.0)
    assert (np.hypot(*(around.poses[:, :2] - (2.0, 1.0)).T) >= 0.4 - 2e-3).all()
    server.set_obstacles(())
    assert server.plan('prm', START, GOAL, deadline=20.0).cost == before.cost


@pytest.mark.parametrize('planner', PLANNERS)
def test_no_way_is_told_as_what_it_is(server, planner):
    server.set_map(SHUT)
    with pytest.raises((NoPath, PlanningTimeout)):
        server.plan(planner, START, GOAL, deadline=0.3)
    with pytest.raises(Cancelled):
        server.plan(planner, START, GOAL, deadline=20.0, stop=np.ones(1, np.uint8))


@pytest.mark.parametrize('planner', ['rrt', *ROADMAPS])
def test_one_seed_is_one_path_of_those_that_do_not_go_on_until_the_deadline(server, planner):
    paths = []
    for _ in range(2):
        fresh = SamplingServer(server.options)
        fresh.set_map(WALL)
        paths.append(fresh.plan(planner, START, GOAL, deadline=60.0, seed=5).poses.tobytes())
    assert paths[0] == paths[1]


def test_the_newest_graph_is_shown(server):
    assert server.newest_graph().shape == (0, 2, 2)
    server.build_roadmap('prm', 100, seed=1)
    assert len(server.newest_graph()) > 100
    server.plan('rrt', START, GOAL, deadline=20.0, seed=1)
    assert server.newest_graph().shape[1:] == (2, 2) and len(server.newest_graph()) > 0
    server.clear()
    assert len(server.newest_graph()) == 0


def test_what_makes_no_sense_is_refused(server):
    for call, error in ((lambda: server.plan('walk', START, GOAL), InvalidPlanner),
                        (lambda: server.build_roadmap('rrt'), InvalidPlanner),
                        (lambda: server.plan('prm', START, GOAL, deadline=0.0), InvalidInput),
                        (lambda: server.plan('prm', (1, 1), GOAL), InvalidInput),
                        (lambda: SamplingServer(server.options).plan('prm', START, GOAL), NoMap)):
        with pytest.raises(error):
            call()


@pytest.mark.parametrize('options', [
    {'turning_radius': 0.0}, {'robot_radius': -1.0}, {'speed': np.inf}, {'precision': (1, 1)}, {'roadmap_nodes': 0},
    {'precision': (1, 1, -1)}, {'default_planner': 'dstar'}])
def test_bad_options_are_refused(options):
    with pytest.raises((InvalidInput, InvalidPlanner)):
        SamplingOptions(**options)
