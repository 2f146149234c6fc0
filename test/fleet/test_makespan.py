"""The lower bound of a mission's time: exact where the way is straight, and a way around where it is not."""
import numpy as np
import pytest
from mobile_planning import Boundary, OccupancyGrid, PolygonObstacle, RoundObstacle
from mobile_planning.fleet.makespan import least_time, lower_bound, way
from mobile_planning.fleet.verification import Body
from mobile_planning.world.environment import Environment

ROOM = Boundary((0, 10), (0, 6))


def test_a_straight_way_is_its_length_to_the_last_digit():
    assert way((1, 1), (4, 5), 0.2, Environment(ROOM)) == pytest.approx(5.0, abs=1e-12)


def test_around_a_circle_it_is_the_tangents_and_the_arc_or_a_little_more():
    radius, reach = 1.2, 4.0
    tangent = np.sqrt(reach**2 - radius**2)
    exact = 2 * tangent + radius * (np.pi - 2 * np.arccos(radius / reach))
    found = way((1, 3), (9, 3), 0.2, Environment(ROOM, [RoundObstacle((5, 3), 1.0)]))
    assert exact - 0.15 <= found <= 1.04 * exact


def test_through_the_only_door_it_leads_even_if_the_disc_just_fits():
    walls = [PolygonObstacle([(4.9, -1), (5.1, -1), (5.1, 4.0), (4.9, 4.0)]),
             PolygonObstacle([(4.9, 4.41), (5.1, 4.41), (5.1, 7), (4.9, 7)])]
    exact = 2 * np.hypot(4, 4.205 - 1)
    assert way((1, 1), (9, 1), 0.2, Environment(ROOM, walls)) == pytest.approx(exact, rel=0.03)


def test_on_a_map_occupied_cells_are_gone_around():
    data = np.zeros((60, 100), np.int8)
    data[:40, 48:52] = 100
    found = way((1, 1), (9, 1), 0.2, Environment(grid=OccupancyGrid(data, 0.1)))
    assert 2 * np.hypot(3.8, 3.0) - 0.1 < found < 2 * np.hypot(4.0, 3.4) + 0.4


def test_where_the_grid_knows_no_way_the_straight_line_counts():
    wall = PolygonObstacle([(4.9, -1), (5.1, -1), (5.1, 7), (4.9, 7)])
    assert way((1, 1), (9, 1), 0.2, Environment(ROOM, [wall])) == pytest.approx(8.0)
    assert way((1, 1), (9, 1), 0.2, Environment(None, [wall])) == pytest.approx(8.0)


@pytest.mark.parametrize('length, seconds', [(8.0, 8.5), (0.5, 1.0), (0.125, 0.5), (0.0, 0.0)])
def test_the_least_time_is_that_of_full_acceleration_speed_and_braking(length, seconds):
    assert least_time(length, 1.0, 2.0) == pytest.approx(seconds)


def test_the_longest_time_counts_not_the_longest_way():
    def body(eyed, goal, v_max):
        return Body(eyed, 0.2, np.array([1.0, 1, 0]), np.array([goal, 1.0, 0]), v_max, 5.0, 2.0)
    assert lower_bound([body(1, 9.0, 2.0), body(2, 4.0, 0.5)], Environment(ROOM)) == pytest.approx(6.25)
