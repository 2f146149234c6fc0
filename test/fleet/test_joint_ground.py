"""The grounds of joint plans: made once for all robots of a process that share a world."""
import gc
import weakref

import numpy as np
import pytest

from mobile_planning import Boundary
from mobile_planning.fleet.joint_ground import GroundStore
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


def test_robots_of_one_world_share_what_was_made():
    mine = GroundStore.of(Environment(ROOM, [PILLAR], grid([(3, 4)])))
    mine.make((0.2, 0.2))
    theirs = GroundStore.of(Environment(ROOM, [PILLAR], grid([(3, 4)])))
    assert theirs is mine and theirs.knows((0.2, 0.2)) and not theirs.knows((0.2, 0.3))


@pytest.mark.parametrize('other', [
    Environment(Boundary((0, 4), (0, 2)), [PILLAR], grid()), Environment(ROOM, [], grid()),
    Environment(ROOM, [RoundObstacle((2, 1.5), 0.6)], grid()), Environment(ROOM, [PILLAR, PILLAR], grid()),
    Environment(ROOM, [PILLAR]), Environment(ROOM, [PILLAR], grid([(3, 4)])),
    Environment(ROOM, [PILLAR], grid(), unknown_is_free=True), Environment(ROOM, [PILLAR], grid(), occupied_from=99)])
def test_another_world_has_a_store_of_its_own(other):
    store = GroundStore.of(Environment(ROOM, [PILLAR], grid()))
    assert GroundStore.of(other) is not store and GroundStore.of(store.environment) is store


def test_what_no_robot_uses_any_more_is_let_go():
    used = weakref.ref(GroundStore.of(Environment(ROOM, [PILLAR], grid([(7, 7)]))))
    gc.collect()
    assert used() is None
