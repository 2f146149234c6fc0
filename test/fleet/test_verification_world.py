"""The judge: what is wrong with the world on the way of a robot."""
import numpy as np
import pytest
from judged_drives import ALONG, HALL, TC, drive, is_caught, judged

from mobile_planning import Boundary, Environment, OccupancyGrid, PolygonObstacle, RoundObstacle
from mobile_planning.fleet.bspline import Plan


@pytest.mark.parametrize('obstacle', [
    RoundObstacle((3, 0.5), 0.31), RoundObstacle((3, 0), 0.01), PolygonObstacle([(3, -0.19), (4, -0.19), (3.5, -1)]),
    PolygonObstacle([(2, -1), (4, -1), (4, 1), (2, 1)])])
def test_an_obstacle_that_is_hit_is_caught(obstacle):
    assert is_caught(judged(ALONG, world=Environment(HALL, [obstacle])), 'static world')


def test_an_obstacle_touched_between_two_samples_is_caught():
    # The tip of a needle, 10 um deep in the body's edge for some milliseconds.
    for tip in np.arange(3.0, 3.005, 0.0007):
        needle = PolygonObstacle([(tip, 0.2 - 1e-5), (tip - 0.01, 1), (tip + 0.01, 1)])
        assert is_caught(judged(ALONG, world=Environment(HALL, [needle])), 'static world')


@pytest.mark.parametrize('boundary', [Boundary((-0.1, 21), (-5, 5)), Boundary((-1, 5.7), (-5, 5)),
                                      Boundary((-1, 21), (-5, 0.19)), Boundary((10, 21), (-5, 5))])
def test_a_drive_out_of_the_boundary_is_caught(boundary):
    assert is_caught(judged(ALONG, world=Environment(boundary)), 'static world')


@pytest.mark.parametrize('yaw', [0.0, 0.4])
@pytest.mark.parametrize('cell, is_hit', [((30, 20), True), ((30, 23), True), ((30, 24), False), ((70, 20), False)])
def test_an_occupied_cell_that_is_hit_is_caught(cell, is_hit, yaw):
    # The drive is along the middle of row 20; its body reaches 0.15 m into the rows above and below.
    data = np.zeros((41, 80), int)
    data[cell[1], cell[0]] = 100
    grid = OccupancyGrid(data, 0.1, (2.0, 1.0, yaw))
    (start, towards) = grid.cell_to_world([(5, 20), (65, 20)])
    heading = np.arctan2(*(towards - start)[::-1])
    plan = drive(start, heading, (0.1, 0.2, *[0.25] * 16, 0.2, 0.1))
    # A hair nearer to the cell of row 23, whose edge is 0.25 m away; to that of row 22 the bodies touch.
    report = judged((1, (*start, heading), (*plan.end, heading), plan), world=Environment(grid=grid))
    expected = is_hit if cell[1] != 23 else False
    assert is_caught(report, 'static world') == expected and report.valid != expected


def test_the_clearance_to_occupied_cells_is_that_to_their_squares():
    rng = np.random.default_rng(3)
    data = np.where(rng.random((40, 60)) < 0.03, 100, 0)
    data[15:25, 5:55] = 0
    grid = OccupancyGrid(data, 0.1)
    plan = drive((1.0, 2.0), 0.0, (0.1, 0.2, *[0.25] * 12, 0.2, 0.1))
    report = judged((1, (1, 2, 0), (*plan.end, 0), plan), world=Environment(grid=grid))
    places = plan.states(np.linspace(0, plan.end_knot * TC, 5001))[:, :2]
    low = np.argwhere(data == 100)[:, ::-1] * 0.1
    gap = np.maximum(np.maximum(low - places[:, None], places[:, None] - low - 0.1), 0)
    least = min(np.linalg.norm(gap, axis=-1).min(), 1.0)
    assert report.min_obstacle_clearance == pytest.approx(least - 0.2, abs=1e-4)


def test_cells_on_an_arc_around_the_robot_are_all_looked_at():
    # More squares than a dozen lie as near as the nearest centre; the nearest square is none of the nearest centres.
    y, x = np.indices((101, 101)) - 50
    ring = (np.hypot(x, y) > 40) & (np.hypot(x, y) < 44)
    grid = OccupancyGrid(np.where(ring, 100, 0), 0.1)
    centre = np.array([5.05, 5.05])
    report = judged((1, (*centre, 0), (*centre, 0), Plan.at_rest(0, TC, (*centre, 0))), world=Environment(grid=grid))
    low = np.argwhere(ring)[:, ::-1] * 0.1
    gap = np.maximum(np.maximum(low - centre, centre - low - 0.1), 0)
    assert report.min_obstacle_clearance == pytest.approx(np.linalg.norm(gap, axis=1).min() - 0.2, abs=1e-9)


def test_a_drive_out_of_the_map_is_caught():
    grid = OccupancyGrid(np.zeros((40, 40), int), 0.1, (-1.0, -2.0, 0.0))
    assert is_caught(judged(ALONG, world=Environment(grid=grid)), 'static world')
