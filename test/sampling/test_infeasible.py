"""What cannot be reached is never answered by a path, whichever planner is asked."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning import (
    RRT, Boundary, Environment, OccupancyGrid, PlanStatus, PRMPlanner, RectangleObstacle, dubins_shortest)
from mobile_planning.sampling.rrt_kernels import STOPPED, grow
from mobile_planning.sampling.rrt_star_kernels import grow_star
from mobile_planning.sampling.tree import planted, with_room

SEALED = [RectangleObstacle((60, 40), (80, 42)), RectangleObstacle((60, 58), (80, 60)),
          RectangleObstacle((60, 42), (62, 58)), RectangleObstacle((78, 42), (80, 58))]
NARROW = [RectangleObstacle((49, 0), (51, 49.6)), RectangleObstacle((49, 50.4), (51, 100))]


def rrt_on(environment, radius=4.0):
    rrt = RRT(environment, precision=(1, 1, 0.5), radius=radius)
    rrt.set_start((10, 50, 0))
    return rrt


@pytest.mark.parametrize('shapes, footprint', [(SEALED, 0.0), (NARROW, 0.5)])
@pytest.mark.parametrize('radius', [0.0, 4.0])
def test_a_roadmap_has_no_way_where_there_is_none(shapes, footprint, radius):
    world = Environment(Boundary((0, 100), (0, 100)), shapes, footprint=footprint)
    options = {'turning_radius': radius} if radius else {}
    start, goal = ((10, 50, 0), (70, 50, 0)) if radius else ((10, 50), (70, 50))
    planner = PRMPlanner(world, **options)
    planner.build_roadmap(300, seed=1)
    result = planner.query(start, goal, deadline=0.3)
    assert result.status in (PlanStatus.NO_PATH, PlanStatus.TIMEOUT)
    assert not np.isfinite(result.cost)


@pytest.mark.parametrize('star', [False, True])
def test_a_goal_behind_a_wall_of_cells_is_not_reached_and_one_beside_it_is(star):
    cells = np.zeros((100, 100), np.int8)
    cells[:, 50] = 100
    rrt = rrt_on(Environment(grid=OccupancyGrid(cells, 1.0)))
    assert rrt.run((80, 50, 0), 400, seed=1, star=star).status is PlanStatus.APPROXIMATE
    cells[45:55, 50] = 0
    world = Environment(grid=OccupancyGrid(cells, 1.0))
    result = rrt_on(world).run((80, 50, 0), 5000, seed=1)
    assert result.is_solved and world.free_poses(result.path).all()
    x, y = result.path[:, 0], result.path[:, 1]
    within = (x > 50) & (x < 51)
    assert within.any() and ((y[within] >= 45 - 1e-3) & (y[within] <= 55 + 1e-3)).all()


@pytest.mark.parametrize('star', [False, True])
def test_once_the_flag_stands_no_sample_is_drawn(star):
    rrt, stop = rrt_on(Environment(Boundary((0, 100), (0, 100)), SEALED)), np.ones(1, np.uint8)
    goal = np.array((70.0, 50.0, 0.0))
    world, task = rrt._setting.world_about(goal, 0.0), rrt._setting.task(goal, 0.0, 0.1, 'local')
    tree, random = with_room(planted((10, 50, 0), rrt.environment.bounds), 100), np.array([7], np.uint64)
    if star:
        reason, made = grow_star(world, tree, task, random, np.zeros(9, np.int64), np.inf, 0.5, 10**9, stop)
    else:
        reason, _, made = grow(world, tree, task, random, 10**9, stop)
    assert (reason, made, tree.count, random[0]) == (STOPPED, 0, 1, 7)


def test_a_deadline_of_nothing_draws_nothing():
    result = rrt_on(Environment(Boundary((0, 100), (0, 100)), SEALED)).run((70, 50, 0), deadline=0.0, seed=1)
    assert result.status is PlanStatus.TIMEOUT and result.iterations == 0


@settings(max_examples=8)
@given(st.integers(0, 2**32 - 1), st.booleans())
def test_obstacles_never_lower_the_cost_below_the_optimum_of_the_open_world(seed, star):
    rng = np.random.default_rng(seed)
    lows = rng.uniform((20, 5), (75, 85), (rng.integers(0, 12), 2))
    shapes = [RectangleObstacle(low, low + rng.uniform(2, 12, 2)) for low in lows]
    rrt = RRT(Environment(Boundary((0, 100), (0, 100)), shapes), precision=(0, 0, 0))
    start, goal = (8, 50, float(rng.uniform(-3, 3))), (92, 50, float(rng.uniform(-3, 3)))
    rrt.set_start(start)
    result = rrt.run(goal, 400, seed=seed, star=star)
    if result.is_solved:
        assert result.cost >= dubins_shortest(start, goal, 4.0).length - 1e-9
