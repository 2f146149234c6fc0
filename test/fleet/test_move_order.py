"""The order of moves: how long a group takes by it."""
import numpy as np
import pytest

from mobile_planning import Boundary, Environment, PolygonObstacle
from mobile_planning.fleet.joint_plan import GAP, Member, make_instance
from mobile_planning.fleet.move_order import finish_times, order_moves
from mobile_planning.fleet.pebble_search import solve
from mobile_planning.fleet.roadmap import Roadmap

RADIUS = 0.205


@pytest.fixture(scope='module')
def doorway():
    """Two rooms, a wall and a door of 0.65 m."""
    walls = [PolygonObstacle([(-0.1, y), (0.1, y), (0.1, y + 1.7), (-0.1, y + 1.7)]) for y in (-2.025, 0.325)]
    return Roadmap(Environment(Boundary((-2.5, 2.5), (-2, 2)), walls), RADIUS)


def pebbles_of(roadmap, members):
    """Return instance, places, steps and radii of some members."""
    instance, places = make_instance(roadmap, members)
    steps = solve(instance, [0.0] * len(members), np.random.default_rng(0))
    assert steps.is_solved
    return instance, places, steps, [member.radius for member in members]


def earliest(ways, needs, leads):
    """Return when each robot is home if it begins each move as soon as its needs allow, by repetition."""
    over = [[lead] + [np.inf] * len(need) for lead, need in zip(leads, needs)]
    for _ in range(sum(map(len, needs))):
        for i, way in enumerate(ways):
            for k, need in enumerate(needs[i]):
                begins = max([over[i][k], *(over[j][count] for j, count in need)])
                over[i][k + 1] = begins + np.linalg.norm(way[k + 1] - way[k])
    return np.array([each[-1] for each in over])


def test_a_lone_robot_is_home_after_its_way_and_what_it_drives_before(doorway):
    instance, places, steps, radii = pebbles_of(doorway, [Member((-1.5, 1.0), (1.5, -1.0), RADIUS)])
    ways, _ = order_moves(instance, places, steps, radii, GAP)
    length = np.linalg.norm(np.diff(ways[0], axis=0), axis=1).sum()
    assert finish_times(instance, places, steps, radii, GAP, [0.7]) == pytest.approx([length + 0.7])


@pytest.mark.parametrize('seed', range(6))
def test_the_times_agree_with_the_order_but_for_what_a_finer_cut_changes(doorway, seed):
    rng = np.random.default_rng(seed)
    sides = rng.permutation([-1, -1, 1, 1])
    starts = np.column_stack([1.6 * sides, 0.8 * np.arange(4) - 1.2])
    members = [Member(start, start * (-1, 1), RADIUS) for start in starts]
    instance, places, steps, radii = pebbles_of(doorway, members)
    leads = rng.uniform(0.0, 2.0, 4)
    ways, needs = order_moves(instance, places, steps, radii, GAP)
    times, by_needs = finish_times(instance, places, steps, radii, GAP, leads), earliest(ways, needs, leads)
    alone = leads + [np.linalg.norm(np.diff(way, axis=0), axis=1).sum() for way in ways]
    assert (times >= alone - 1e-9).all()
    # Who waits, waits for a piece of a move at a time: for less where the pieces are shorter.
    assert times.max() <= by_needs.max() + 0.3 and times.max() >= 0.7 * by_needs.max()
