"""Smoothing: never longer, never less free, same ends."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mobile_planning import (
    RRT, Boundary, Environment, InvalidInput, MovingObstacle, PlanStatus, RoundObstacle, dubins_shortest, smooth)


def world(seed, moving=False):
    rng = np.random.default_rng(seed)
    trees = [RoundObstacle(rng.uniform((12, 2), (88, 98)), rng.uniform(1, 6)) for _ in range(20)]
    if moving:
        return Environment(Boundary((0, 100), (0, 100)), moving=[MovingObstacle(tree, (0.1, -0.2)) for tree in trees])
    return Environment(Boundary((0, 100), (0, 100)), trees)


@settings(max_examples=12)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 3.0]), st.booleans())
def test_a_path_gets_shorter_and_stays_free(seed, radius, moving):
    environment = world(seed % 5, moving)
    rrt = RRT(environment, (2, 2, 0.5), radius=radius)
    rrt.set_start((4, 50, 0))
    found = rrt.run((95, 50, 0), 5000, seed=seed)
    if not found.is_solved:
        return
    result = smooth(found.path, environment, radius, None, seed, nb_iteration=2000)
    assert result.status is PlanStatus.SOLVED
    assert result.cost <= found.cost + 1e-9 and result.history[0].cost == pytest.approx(found.cost, abs=1e-6)
    assert result.path[0] == pytest.approx(found.path[0]) and result.path[-1] == pytest.approx(found.path[-1])
    steps = np.hypot(*np.diff(result.path[:, :2], axis=0).T)
    assert steps.max() <= 0.05 + 1e-9
    assert environment.free_poses(result.path, np.append(0, np.cumsum(steps))).all()
    if radius:
        turns = np.abs(np.angle(np.exp(1j * np.diff(result.path[:, 2]))))
        assert (turns <= steps / radius * (1 + 1e-3) + 1e-9).all()


def test_in_the_open_a_detour_becomes_the_shortest_path():
    open_world = Environment(Boundary((0, 100), (0, 100)))
    detour = np.vstack([dubins_shortest((10, 10, 0), (50, 80, 2), 4).sample(0.05),
                        dubins_shortest((50, 80, 2), (90, 10, 0), 4).sample(0.05)[1:]])
    best = dubins_shortest((10, 10, 0), (90, 10, 0), 4).length
    assert best <= smooth(detour, open_world, 4, None, 1).cost + 1e-9 <= 1.001 * best


def test_the_same_seed_gives_the_same_path():
    detour = np.vstack([dubins_shortest((10, 10, 0), (50, 80, 2), 4).sample(0.5),
                        dubins_shortest((50, 80, 2), (90, 10, 0), 4).sample(0.5)[1:]])
    room = Environment(Boundary((0, 100), (0, 100)))
    first, second, other = (smooth(detour, room, 4, None, seed, nb_iteration=50) for seed in (1, 1, 2))
    assert first.path.tobytes() == second.path.tobytes() != other.path.tobytes()


def test_one_pose_is_a_path_too():
    assert smooth([(4, 50, 0)], world(0), 2, None, 1, nb_iteration=10).cost == 0


@pytest.mark.parametrize('path, radius', [
    ([(10, 10, 0), (10, 12, 0)], 4), ([(10, 10, np.nan)], 4), ([], 4), ([(10, 10)], 4), ([(10, 10, 0)], -1)])
def test_what_cannot_be_driven_is_refused(path, radius):
    with pytest.raises(InvalidInput):
        smooth(path, world(0), radius, None, 1)


def test_a_path_through_an_obstacle_is_refused():
    environment = Environment(Boundary((0, 10), (0, 10)), [RoundObstacle((5, 5), 1)])
    with pytest.raises(InvalidInput, match='pose 0'):
        smooth([(1, 5), (9, 5)], environment, 0, None, 1)
