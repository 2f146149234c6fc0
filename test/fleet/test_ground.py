"""Ground: where a body has room in the static world, and who is refused where it has none."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from missions import ROOM, robot

from mobile_planning import (
    GoalOccupied, GoalOutside, NoPath, OccupancyGrid, PolygonObstacle, RoundObstacle, StartOccupied, StartOutside)
from mobile_planning.fleet.ground import Ground
from mobile_planning.world.environment import Environment

WORLD = Environment(ROOM, [RoundObstacle((5, 3), 0.5), PolygonObstacle([(1, 1), (2, 1), (2, 2)])])


@given(st.floats(0.0, 10.0), st.floats(0.0, 6.0))
def test_room_is_the_clearance_up_to_twice_the_radius(x, y):
    clearance = WORLD.clearance(np.array([(x, y)]))[0]
    found = Ground(WORLD, 0.4, 1).room((x, y))
    # Round obstacles are polygons around the circle, by a little.
    assert min(0.8, clearance) - 0.01 <= found <= min(0.8, clearance) + 1e-9 or clearance < 1e-9 >= found


@pytest.mark.parametrize('start, goal, error', [
    ((5, 3, 0), (9, 3, 0), StartOccupied), ((0.2049, 3, 0), (9, 3, 0), StartOccupied),
    ((-5, 3, 0), (9, 3, 0), StartOutside), ((1, 3, 0), (5, 3, 0), GoalOccupied),
    ((1, 3, 0), (9, 5.9, 0), GoalOccupied), ((1, 3, 0), (9, 99, 0), GoalOutside)])
def test_a_start_or_goal_without_room_for_the_body_is_refused(start, goal, error):
    with pytest.raises(error, match='robot 7'):
        robot(7, start, goal, obstacles=[RoundObstacle((5, 3), 0.5)])


def test_a_start_in_a_wall_of_the_map_is_refused():
    data = np.zeros((60, 100), int)
    data[:, 50] = 100
    grid = OccupancyGrid(data, 0.1)
    for start, goal, error in (((5.05, 3, 0), (9, 3, 0), StartOccupied), ((1, 3, 0), (5.05, 3, 0), GoalOccupied),
                               ((1, 3, 0), (9, 3, 0), NoPath)):
        with pytest.raises(error):
            robot(1, start, goal, boundary=None, grid=grid)
