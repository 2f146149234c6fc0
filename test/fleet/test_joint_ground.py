"""The grounds of joint plans: made once for all robots of a process that share a world."""
import gc
import weakref

import numpy as np
import pytest

from mobile_planning import Boundary
from mobile_planning.fleet.joint_ground import GroundStore, JointGround
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import RoundObstacle
from mobile_planning.world.occupancy_grid import OccupancyGrid

ROOM, PILLAR = Boundary((0, 4), (0, 3)), RoundObstacle((2, 1.5), 0.5)


def grid(occupied=()):
    """Return a map of 4 m x 3 m with some occupied cells."""
    data = np.zeros((30, 40), np.int8)
    for cell in occupied:
        data[cell] = 100
    return OccupancyGrid(data, 0.1)


def test_robots_of_one_world_share_what_was_made_and_each_knows_what_it_asked_for():
    mine, theirs = (GroundStore(Environment(ROOM, [PILLAR], grid([(3, 4)]))) for _ in range(2))
    mine.make((0.2, 0.2))
    assert not theirs.knows((0.2, 0.2))
    theirs.make((0.2, 0.2))
    theirs.make((0.2, 0.3))
    assert theirs.get((0.2, 0.2)) is mine.get((0.2, 0.2)) is not theirs.get((0.2, 0.3))


@pytest.mark.parametrize('other', [
    Environment(Boundary((0, 4), (0, 2)), [PILLAR], grid()), Environment(ROOM, [], grid()),
    Environment(ROOM, [RoundObstacle((2, 1.5), 0.6)], grid()), Environment(ROOM, [PILLAR, PILLAR], grid()),
    Environment(ROOM, [PILLAR]), Environment(ROOM, [PILLAR], grid([(3, 4)])),
    Environment(ROOM, [PILLAR], grid(), unknown_is_free=True), Environment(ROOM, [PILLAR], grid(), occupied_from=99)])
def test_another_world_has_a_ground_of_its_own(other):
    world = Environment(ROOM, [PILLAR], grid())
    ground = JointGround.of(world, 0.2, 0.2)
    assert JointGround.of(other, 0.2, 0.2) is not ground is JointGround.of(world, 0.2, 0.2)


def test_what_no_robot_uses_any_more_is_let_go():
    used = weakref.ref(JointGround.of(Environment(ROOM, [PILLAR], grid([(7, 7)])), 0.2, 0.2))
    gc.collect()
    assert used() is None


def test_a_world_without_extent_has_no_ground():
    store = GroundStore(Environment())
    store.make((0.2, 0.2))
    assert store.knows((0.2, 0.2)) and store.get((0.2, 0.2)) is None
