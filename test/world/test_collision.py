"""Free poses and free motions, against shapely's exact shapes sampled finely, for every kind of robot and obstacle."""
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import affinity

from mobile_planning import (
    Boundary, Environment, Footprint, InvalidInput, MovingObstacle, OccupancyGrid, PolygonObstacle, RectangleObstacle,
    RoundObstacle)

SEEDS = st.integers(0, 2**32 - 1)
ROBOTS = st.sampled_from([
    Footprint(0.0), Footprint(0.4), Footprint.rectangle(1.6, 0.7, ahead=1.2),
    Footprint(outline=[(-0.5, -0.5), (0.8, -0.5), (0.8, 0.5), (0.3, 0.0), (-0.5, 0.5)])])
# Between a verdict and the oracle's distance there may be so much [m].
SLACK = 2e-3


def random_world(rng, footprint, moves=False, cells=False):
    """Return an environment with some of every kind of obstacle."""
    shapes = [RoundObstacle(rng.uniform(1, 11, 2), rng.uniform(0.1, 1)) for _ in range(4)]
    for _ in range(3):
        low = rng.uniform(0, 10, 2)
        shapes.append(RectangleObstacle(low, low + rng.uniform(0.3, 2.5, 2)))
        angles = np.sort(rng.uniform(0, 2 * np.pi, 7)) + np.arange(7) * 1e-3
        spokes = rng.uniform(0.2, 1.2, 7)
        star = rng.uniform(2, 10, 2) + np.column_stack([spokes * np.cos(angles), spokes * np.sin(angles)])
        if shapely.Polygon(star).is_valid:
            shapes.append(PolygonObstacle(star))
    moving = []
    if moves:
        moving = [MovingObstacle(shape, rng.uniform(-0.6, 0.6, 2)) for shape in shapes[::2]]
        shapes = shapes[1::2]
    grid = None
    if cells:
        grid = OccupancyGrid(rng.random((30, 34)) < 0.05, 0.4, (-0.5, 0.3, 0.2))
    return Environment(Boundary((0, 12), (0, 12)), shapes, grid, moving=moving, footprint=footprint)


def shape_of(obstacle):
    if isinstance(obstacle, RoundObstacle):
        return shapely.Point(obstacle.centroid).buffer(obstacle.radius, quad_segs=256)
    return shapely.Polygon(obstacle.vertices)


def oracle_room(environment, poses, times):
    """Return how far each robot is from the union of all obstacles, or minus how deep it can be pushed in."""
    still = [shape_of(each) for each in environment.obstacles]
    if environment.grid is not None:
        rows, columns = np.nonzero(environment.occupied)
        squares = [shapely.Polygon(environment.grid.grid_to_world([(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]))
                   for i, j in zip(columns, rows)]
        still += squares
        size = (environment.grid.width, environment.grid.height)
        floor = shapely.Polygon(environment.grid.grid_to_world([(0, 0), (size[0], 0), size, (0, size[1])]))
        still.append(shapely.box(-90, -90, 90, 90).difference(floor))
    box = environment.boundary
    still.append(shapely.box(-90, -90, 90, 90).difference(shapely.box(box.x_min, box.y_min, box.x_max, box.y_max)))
    still = shapely.union_all(still)
    shapely.prepare(still)
    rooms = []
    for (x, y, heading), t in zip(poses, times):
        parts = [still, *(affinity.translate(shape_of(each.shape), *(t * np.array(each.velocity)))
                          for each in environment.moving)]
        rooms.append(min(robot_room(environment.footprint, part, (x, y, heading)) for part in parts))
    return np.array(rooms)


def robot_room(footprint, shape, pose):
    if footprint.outline is None:
        place = shapely.Point(pose[:2])
        distance = shape.distance(place)
        return (distance or -shape.boundary.distance(place)) - footprint.radius
    body = shapely.Polygon(footprint.at(pose))
    return shape.distance(body) or -np.sqrt(shape.intersection(body).area)


@settings(max_examples=25)
@given(SEEDS, ROBOTS, st.booleans(), st.booleans())
def test_a_pose_is_free_exactly_where_the_robot_enters_nothing(seed, footprint, moves, cells):
    rng = np.random.default_rng(seed)
    environment = random_world(rng, footprint, moves, cells)
    poses, times = rng.uniform((-0.5, -0.5, -4), (12.5, 12.5, 4), (40, 3)), rng.uniform(0, 5, 40)
    rooms = oracle_room(environment, poses, times)
    clear = np.abs(rooms + 1e-3) > SLACK + (0.05 if footprint.outline is not None else 0) * (rooms < 0)
    free = environment.free_poses(poses, times)
    assert (free == (rooms >= -1e-3))[clear].all()


@settings(max_examples=25)
@given(SEEDS, ROBOTS, st.booleans(), st.booleans())
def test_clearance_never_promises_more_than_there_is(seed, footprint, moves, cells):
    rng = np.random.default_rng(seed)
    environment = random_world(rng, footprint, moves, cells)
    poses, times = rng.uniform((0, 0, -4), (12, 12, 4), (30, 3)), rng.uniform(0, 5, 30)
    rooms = oracle_room(environment, poses, times)
    clearance = environment.clearance(poses, times)
    assert (clearance <= np.maximum(rooms, 0) + SLACK).all()
    if not cells:
        assert (clearance >= rooms - SLACK).all()


def driven(start, turn, length, radius, places):
    """Return the poses of an arc or line by the sums of small steps."""
    heading = start[2] + turn * places * np.sign(length) / radius
    middle = (heading[:-1] + heading[1:]) / 2
    step = np.diff(places) * np.sign(length)
    if turn:
        step = step * np.sinc(np.diff(heading) / 2 / np.pi)
    x = start[0] + np.append(0, np.cumsum(step * np.cos(middle)))
    y = start[1] + np.append(0, np.cumsum(step * np.sin(middle)))
    return np.column_stack([x, y, heading])


@settings(max_examples=10)
@given(SEEDS, ROBOTS, st.booleans(), st.booleans())
def test_a_motion_is_free_exactly_if_every_pose_on_it_is(seed, footprint, moves, cells):
    from mobile_planning.world.motion_kernels import segment_is_free

    rng = np.random.default_rng(seed)
    environment = random_world(rng, footprint, moves, cells)
    for _ in range(12):
        start, begin = rng.uniform((0, 0, -3), (12, 12, 3)), rng.uniform(0, 4)
        if not environment.free_poses(start, begin):
            continue
        turn, length, radius = rng.integers(-1, 2), rng.uniform(-6, 6), rng.uniform(0.5, 3)
        speed = rng.uniform(0.5, 2)
        places = np.linspace(0, abs(length), int(abs(length) / 0.02) + 2)
        poses = driven(start, turn, length, radius, places)
        rooms = oracle_room(environment, poses, begin + places / speed)
        free = segment_is_free(environment.space(1e-3), *start, turn, length, radius, begin, speed)
        # Between the oracle's poses 0.02 m apart the room changes by at most this.
        if rooms.min() < -SLACK - (0.05 if footprint.outline is not None else 0):
            assert not free
        if rooms.min() > 0.02 + 0.02 * 1.2:
            assert free


@pytest.mark.parametrize('y', [36.209890, 36.0, 31.5, 43.0])
@pytest.mark.parametrize('heading', [0.0, -2.9e-8, 1e-12])
def test_nothing_tunnels_through_a_wall_that_it_meets_head_on(y, heading):
    from mobile_planning.world.motion_kernels import segment_is_free

    wall = RectangleObstacle((43, 30), (45, 44))
    for footprint in (0.0, 0.3):
        space = Environment(Boundary((0, 60), (0, 60)), [wall], footprint=footprint).space(1e-9)
        assert not segment_is_free(space, 42.5, y, heading, 0, 6.0, 1.0, 0.0, 1.0)


def test_a_thin_obstacle_is_met_by_long_steps():
    from mobile_planning.world.motion_kernels import segment_is_free

    hair = PolygonObstacle([(5, 0), (5.0005, 0), (5.0005, 10), (5, 10)])
    for footprint in (Footprint(), Footprint(0.2), Footprint.rectangle(1, 0.4)):
        space = Environment(Boundary((0, 10), (0, 10)), [hair], footprint=footprint).space(1e-9)
        for turn in (-1, 0, 1):
            assert not segment_is_free(space, 3.0, 5.0, 0.0, turn, 4.0, 20.0, 0.0, 1.0)


def test_touching_is_allowed_and_entering_is_not():
    world = Environment(Boundary((0, 10), (0, 10)), [RectangleObstacle((4, 4), (6, 6))])
    assert world.free_poses([(4, 5), (0, 0), (5, 6.0), (4.0009, 5)]).all()
    assert not world.free_poses([(4.002, 5), (5, 5), (-0.002, 5)]).any()
    car = Environment(Boundary((0, 10), (0, 10)), [RectangleObstacle((4, 4), (6, 6))],
                      footprint=Footprint.rectangle(2, 1))
    assert car.free_poses([(3, 5, 0), (3.0005, 5, 0), (5, 3.5, 0)]).all()
    assert not car.free_poses([(3.01, 5, 0), (3, 5, 0.3)]).any()


def test_no_path_leads_along_the_seam_of_two_obstacles():
    from mobile_planning.world.motion_kernels import segment_is_free

    halves = [RectangleObstacle((2, 2), (5, 8)), RectangleObstacle((5, 2), (8, 8))]
    world = Environment(Boundary((0, 10), (0, 10)), halves)
    assert not world.free_poses((5, 5))
    assert not segment_is_free(world.space(1e-9), 5.0, 1.0, np.pi / 2, 0, 8.0, 1.0, 0.0, 1.0)


def test_a_robot_may_be_inside_a_ring_but_not_around_an_island():
    walls = [RectangleObstacle((1, 1), (9, 2)), RectangleObstacle((1, 8), (9, 9)), RectangleObstacle((1, 2), (2, 8)),
             RectangleObstacle((8, 2), (9, 8))]
    outline = Footprint.rectangle(3, 3)
    assert Environment(Boundary((0, 10), (0, 10)), walls, footprint=outline).free_poses((5, 5, 0.3))
    island = [RectangleObstacle((4.9, 4.9), (5.1, 5.1))]
    assert not Environment(Boundary((0, 10), (0, 10)), island, footprint=outline).free_poses((5, 5, 0.3))
    inside = [RoundObstacle((5, 5), 4)]
    assert not Environment(Boundary((0, 10), (0, 10)), inside, footprint=outline).free_poses((5, 5, 0.3))


def test_what_is_no_pose_time_or_footprint_is_refused():
    world = Environment(Boundary((0, 1), (0, 1)), footprint=Footprint.rectangle(0.1, 0.1))
    for call in (lambda: world.free_poses((0.5, 0.5)), lambda: world.free_poses((0.5, 0.5, np.nan)),
                 lambda: world.free_poses((0.5, 0.5, 0), np.inf), lambda: Footprint(-1), lambda: Footprint('wide'),
                 lambda: Footprint(1, [(0, 0), (1, 0), (0, 1)]), lambda: Footprint(outline=[(0, 0), (1, 1)]),
                 lambda: MovingObstacle(RoundObstacle((0, 0), 1), (1, np.nan)),
                 lambda: RectangleObstacle((1, 1), (0, 2)),
                 lambda: Environment(footprint=Footprint.rectangle(1, 1e-4)).space()):
        with pytest.raises(InvalidInput):
            call()
