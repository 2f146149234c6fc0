"""Robots with an outline: every pose of a path, turned by shapely, keeps out of what shapely has as the world."""
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning import (
    RRT, Boundary, Environment, Footprint, MovingObstacle, OccupancyGrid, PolygonObstacle, PRMPlanner, RoundObstacle,
    smooth)

OUTLINES = [Footprint.rectangle(3.0, 1.2, ahead=2.3), Footprint(outline=[(-1.0, -0.8), (2.0, 0.0), (-1.0, 0.8)]),
            Footprint(outline=[(-1, -1), (1, -1), (1, 1), (0.6, 1), (0.6, -0.4), (-1, -0.4)])]
SIDE, START, GOAL = 40.0, (4.0, 20.0, 0.0), (36.0, 20.0, 0.0)
# How deep the robot may lie in something [m].
DEPTH = 2e-3


def shapes(rng):
    """Return discs and turned triangles between start and goal."""
    centres = rng.uniform((10, 1), (30, 39), (9, 2))
    corners = np.array([(2.0, 0.0), (-1.0, 1.5), (-1.0, -1.5)])
    return [RoundObstacle(centre, rng.uniform(0.5, 2.0)) if k % 2 else PolygonObstacle(corners * (-1) ** k + centre)
            for k, centre in enumerate(centres)]


def world_of(kind, footprint, rng):
    """Return an environment of shapes that stand or move, or of cells."""
    boundary = Boundary((0, SIDE), (0, SIDE))
    if kind == 'grid':
        cells = np.zeros((40, 40), np.int8)
        cells[rng.integers(0, 40, 25), rng.integers(10, 30, 25)] = 100
        return Environment(grid=OccupancyGrid(cells, 1.0), footprint=footprint)
    if kind == 'moving':
        return Environment(boundary, footprint=footprint,
                           moving=[MovingObstacle(each, rng.uniform(-0.3, 0.3, 2)) for each in shapes(rng)])
    return Environment(boundary, shapes(rng), footprint=footprint)


def assert_keeps_out(environment, path):
    """Check each pose, at speed 1, against shapes that are DEPTH smaller."""
    coarse = path[::4]
    outline = np.asarray(environment.footprint.outline)
    cosines, sines = np.cos(coarse[:, 2, None]), np.sin(coarse[:, 2, None])
    x = coarse[:, 0, None] + cosines * outline[:, 0] - sines * outline[:, 1]
    y = coarse[:, 1, None] + sines * outline[:, 0] + cosines * outline[:, 1]
    bodies = shapely.polygons(np.stack([x, y], axis=-1))
    assert shapely.within(bodies, shapely.box(-DEPTH, -DEPTH, SIDE + DEPTH, SIDE + DEPTH)).all()
    times = np.append(0, np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T)))[::4]
    still = [(each, (0.0, 0.0)) for each in environment.obstacles]
    for each, velocity in [*still, *((each.shape, each.velocity) for each in environment.moving)]:
        solid = (shapely.Point(each.centroid).buffer(each.radius - DEPTH, 64) if isinstance(each, RoundObstacle)
                 else shapely.Polygon(each.vertices).buffer(-DEPTH, join_style='mitre'))
        seen = shapely.polygons(np.stack([x - times[:, None] * velocity[0], y - times[:, None] * velocity[1]], axis=-1))
        assert not shapely.intersects(seen, solid).any()
    if environment.grid is not None:
        rows, columns = np.nonzero(environment.grid.data == 100)
        cells = shapely.box(columns + DEPTH, rows + DEPTH, columns + 1 - DEPTH, rows + 1 - DEPTH)
        assert not shapely.intersects(bodies[:, None], cells[None]).any()


@settings(max_examples=18)
@given(st.integers(0, 2**32 - 1), st.sampled_from(OUTLINES), st.sampled_from(['shapes', 'moving', 'grid']),
       st.booleans())
def test_a_tree_keeps_each_outline_out_of_everything(seed, footprint, kind, star):
    environment = world_of(kind, footprint, np.random.default_rng(seed))
    rrt = RRT(environment, precision=(1, 1, 0.4), radius=3.0)
    rrt.set_start(START)
    result = rrt.run(GOAL, 400, seed=seed, star=star)
    assert_keeps_out(environment, result.path)
    if result.is_solved and kind != 'moving':
        assert_keeps_out(environment, smooth(result.path, environment, 3.0, None, seed, nb_iteration=200).path)


@settings(max_examples=6)
@given(st.integers(0, 2**32 - 1), st.sampled_from(OUTLINES), st.sampled_from(['shapes', 'grid']),
       st.sampled_from(['dubins', 'reeds_shepp']))
def test_a_roadmap_keeps_each_outline_out_of_everything(seed, footprint, kind, steering):
    environment = world_of(kind, footprint, np.random.default_rng(seed))
    planner = PRMPlanner(environment, turning_radius=3.0, steering=steering, enhancements=1)
    planner.build_roadmap(300, seed=seed)
    result = planner.query(START, GOAL)
    if result.is_solved:
        assert_keeps_out(environment, result.path)


@pytest.mark.parametrize('kind', ['shapes', 'grid'])
def test_what_is_checked_here_is_solved_and_found_when_it_is_wrong(kind):
    environment = world_of(kind, OUTLINES[0], np.random.default_rng(1))
    rrt = RRT(environment, precision=(1, 1, 0.4), radius=3.0)
    rrt.set_start(START)
    assert rrt.run(GOAL, 20_000, seed=1).is_solved
    across = np.linspace((4, 20, 0), (36, 20, 0), 200)
    with pytest.raises(AssertionError):
        for shift in range(-15, 16, 3):
            assert_keeps_out(environment, across + (0, shift, 0))
