"""The spaces of roadmaps, against shapely and against points laid close together."""
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning import Boundary, Environment, OccupancyGrid
from mobile_planning.errors import InvalidInput
from mobile_planning.sampling.dubins import dubins_shortest
from mobile_planning.sampling.samplers import SampleStream, SamplingStrategy, beside_obstacles, bridges
from mobile_planning.sampling.spaces import ConstrainedSpace, JointSpace, free_between, joint_weights
from mobile_planning.sampling.spaces_environment import CarSpace, PlaneSpace
from mobile_planning.stop_flag import StopFlag
from prm_worlds import NARROW, SIZE, environments

seeds = st.integers(0, 2**32)


def shape(environment, margin):
    """Return the obstacles of an environment with a margin, and the walls around it, as one geometry."""
    parts = [shapely.Point(o.centroid).buffer(o.radius, 64) if hasattr(o, 'radius') else shapely.Polygon(o.vertices)
             for o in environment.obstacles]
    outer = shapely.box(-9, -9, SIZE + 9, SIZE + 9) - shapely.box(0, 0, SIZE, SIZE)
    # Each by itself: GEOS 3.14.1 grows a union by 0.1 m too much where a small disc lies in the corner of the walls.
    return shapely.union_all([part.buffer(environment.footprint.radius + margin) for part in (*parts, outer)])


def free_points(space, random, count):
    """Return points of a space that are free."""
    points = random.uniform(space.low, space.high, (count, len(space.low)))
    return points[space.free(points)]


@settings(max_examples=60)
@given(environments(footprint=st.sampled_from((0.0, 0.3))), seeds)
def test_a_line_is_free_just_if_it_keeps_out_of_the_shapes(environment, seed):
    space, random = PlaneSpace(environment), np.random.default_rng(seed)
    starts = free_points(space, random, 400)
    ends = np.clip(starts + random.normal(scale=random.choice([0.3, 3.0]), size=starts.shape), 0, SIZE)
    is_free = space.edges_free(starts, ends)
    lines = shapely.linestrings(np.stack([starts, ends], axis=1))
    assert not is_free[shapely.intersects(lines, shape(environment, -2e-3))].any()
    assert is_free[~shapely.intersects(lines, shape(environment, 2e-3))].all()


@settings(max_examples=30)
@given(environments(), seeds)
def test_points_are_free_just_if_they_are_outside_the_shapes(environment, seed):
    points = np.random.default_rng(seed).uniform(0, SIZE, (500, 2))
    is_free = PlaneSpace(environment).free(points)
    assert not is_free[shapely.intersects_xy(shape(environment, -2e-3), points)].any()
    assert is_free[~shapely.intersects_xy(shape(environment, 2e-3), points)].all()


def test_no_line_slips_through_a_wall_whatever_its_steps_are():
    space, random = PlaneSpace(NARROW), np.random.default_rng(3)
    starts = np.column_stack([random.uniform(29.0, 29.49, 100_000), random.uniform(2, 46, 100_000)])
    ends = np.column_stack([random.uniform(30.51, 31.0, 100_000), starts[:, 1] + random.uniform(-1, 1, 100_000)])
    assert not space.edges_free(starts, ends).any() and not space.edges_free(ends, starts).any()
    # One that did.
    assert not space.edges_free(np.array([[30.6040456, 38.87343217]]), np.array([[29.431262, 38.92470263]])).any()


@settings(max_examples=25)
@given(environments(footprint=st.sampled_from((0.0, 0.2))), seeds, st.sampled_from((0.3, 1.0)))
def test_a_curve_is_free_just_if_all_of_its_poses_are(environment, seed, radius):
    space, random = CarSpace(environment, radius), np.random.default_rng(seed)
    starts, ends = (free_points(space, random, 60) for _ in range(2))
    pairs = min(len(starts), len(ends))
    starts, ends = starts[:pairs], ends[:pairs]
    inside, near = (shape(environment, margin) for margin in (-2e-3, 2e-3))
    for start, end, said in zip(starts, ends, space.edges_free(starts, ends)):
        line = shapely.LineString(dubins_shortest(start, end, radius).sample(0.02)[:, :2])
        assert not (said and shapely.intersects(line, inside))
        assert said or shapely.intersects(line, near)


@given(seeds)
def test_points_between_lie_where_the_dubins_path_has_them(seed):
    space, random = CarSpace(Environment(Boundary((0, 10), (0, 10))), 0.7), np.random.default_rng(seed)
    starts, ends = (random.uniform(space.low, space.high, (10, 3)) for _ in range(2))
    shares = np.concatenate([[0.0, 1.0], random.uniform(size=8)])
    for start, end, share, pose in zip(starts, ends, shares, space.interpolate(starts, ends, shares)):
        path = dubins_shortest(start, end, 0.7)
        expected = np.array(path.pose_at(share * path.length))
        assert np.allclose(pose[:2], expected[:2], atol=1e-9)
        assert np.allclose(np.exp(1j * pose[2]), np.exp(1j * expected[2]), atol=1e-9)


def test_lengths_are_never_below_the_distance_of_the_coordinates():
    random, world = np.random.default_rng(0), Environment(Boundary((0, 9), (0, 5)))
    for space in (PlaneSpace(world), CarSpace(world, 1),
                  JointSpace([0, -1, 2], [1, 2, 3], lambda q: q[:, 0] > 0, weights=[1, 2, 0.1])):
        a, b = (random.uniform(space.low, space.high, (300, len(space.low))) for _ in range(2))
        distances = np.linalg.norm(space.coordinates(a) - space.coordinates(b), axis=1)
        assert (space.lengths(a, b) >= distances - 1e-9).all()


def test_a_map_is_a_plane_too():
    data = np.zeros((20, 30), np.int8)
    data[:15, 14] = 100
    space = PlaneSpace(Environment(grid=OccupancyGrid(data, 0.1)))
    starts, ends = np.array([[1.0, 0.5], [1.0, 1.8]]), np.array([[2.0, 0.5], [2.0, 1.8]])
    assert space.edges_free(starts, ends).tolist() == [False, True]


def test_joints_are_checked_at_points_no_further_apart_than_the_resolution():
    asked = []
    space = JointSpace([0, 0], [1, 1], lambda q: asked.append(q) or np.ones(len(q), bool), weights=[1, 3],
                       resolution=0.1)
    start, end = np.array([[0.1, 0.2]]), np.array([[0.9, 0.7]])
    assert space.edges_free(start, end).all()
    points = np.concatenate([start, *asked, end])
    points = points[np.argsort(points[:, 0])]
    assert (space.lengths(points[:-1], points[1:]) <= 0.1).all()


@given(st.floats(0.1, 0.5), st.floats(0.02, 0.4))
def test_the_check_between_two_points_finds_whatever_is_wider_than_the_resolution(low, width):
    space = JointSpace([0], [1], lambda q: np.ones(len(q), bool))
    free = free_between(space, lambda q: ~((q[:, 0] > low) & (q[:, 0] < low + width)), np.array([[0.0]]),
                        np.array([[1.0]]), 0.99 * width)
    assert not free.any()


def test_a_constraint_takes_away_what_it_forbids():
    plane = PlaneSpace(Environment(Boundary((0, 10), (0, 10))))
    space = ConstrainedSpace(plane, lambda points: points[:, 1] < 5, 0.1)
    assert space.free(np.array([[1.0, 1.0], [1.0, 6.0]])).tolist() == [True, False]
    starts, ends = np.array([[1.0, 1.0], [1.0, 1.0]]), np.array([[9.0, 4.0], [9.0, 9.0]])
    assert space.edges_free(starts, ends).tolist() == [True, False]


def test_weights_bound_the_motion_of_the_tool_of_a_two_link_arm():
    def tool(q):
        elbow, both = q[:, 0], q.sum(axis=1)
        return np.column_stack([2 * np.cos(elbow) + np.cos(both), 2 * np.sin(elbow) + np.sin(both)])

    weights = joint_weights(tool, [-3, -3], [3, 3], seed=2)
    # The first joint moves the tool by at most the reach of 3 m, the second by 1 m, for each radian.
    assert 2.9 < weights[0] <= 3 + 1e-6 and abs(weights[1] - 1) < 1e-6


def test_a_joint_that_moves_nothing_still_has_a_weight():
    assert (joint_weights(lambda q: q[:, :1], [0, 0], [1, 1]) > 0).all()
    with pytest.raises(InvalidInput):
        joint_weights(lambda q: np.zeros((len(q), 3)), [0, 0], [1, 1])


@pytest.mark.parametrize('make', [
    lambda free: JointSpace([0, 0], [1], free), lambda free: JointSpace([0], [0], free),
    lambda free: JointSpace([0], [np.inf], free), lambda free: JointSpace([], [], free),
    lambda free: JointSpace([0], [1], free, weights=[0]), lambda free: JointSpace([0], [1], free, weights=[1, 1]),
    lambda free: JointSpace([0], [1], free, resolution=0), lambda free: JointSpace([0], [1], free, lookahead=0),
    lambda free: JointSpace([0], [1], lambda q: 1).free(np.zeros((2, 1))),
    lambda free: JointSpace([0], [1], lambda q: q[:, 0]).free(np.zeros((2, 1))),
])
def test_what_makes_no_joints_is_refused(make):
    with pytest.raises(InvalidInput):
        make(lambda q: np.ones(len(q), bool))


def test_a_world_without_bounds_is_no_plane_and_a_car_turns_somehow():
    with pytest.raises(InvalidInput):
        PlaneSpace(Environment())
    with pytest.raises(InvalidInput):
        CarSpace(Environment(Boundary((0, 1), (0, 1))), 0.0)


def test_bridges_stand_in_narrow_passages():
    points = bridges(PlaneSpace(NARROW), np.random.default_rng(1), 200_000)
    gaps = (points[:, 1] > 48.8) & (np.abs(points[:, :1] - [18, 30, 42]).min(axis=1) <= 0.5)
    share_of_the_gaps = 3 * 1.2 / (54 * 50 - 3 * 48.8)
    assert PlaneSpace(NARROW).free(points).all() and gaps.mean() > 10 * share_of_the_gaps


def test_points_beside_obstacles_are_free_and_near_one():
    space = PlaneSpace(NARROW)
    points = beside_obstacles(space, np.random.default_rng(1), 20_000)
    even = free_points(space, np.random.default_rng(2), 20_000)
    assert space.free(points).all()
    assert np.median(NARROW.clearance(points)) < np.median(NARROW.clearance(even)) / 2


@settings(max_examples=30)
@given(st.lists(st.integers(1, 3000), min_size=1, max_size=4), st.sampled_from(SamplingStrategy), seeds, st.booleans())
def test_a_stream_does_not_depend_on_how_it_is_taken(counts, strategy, seed, only_free):
    space = PlaneSpace(NARROW)
    once, often = (SampleStream(space, strategy, seed, only_free) for _ in range(2))
    whole = once.take(sum(counts), StopFlag())
    assert np.array_equal(whole, np.concatenate([often.take(count, StopFlag()) for count in counts]))
    assert not only_free or space.free(whole).all()
