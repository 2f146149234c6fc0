"""Jams in whole missions: crowds on a map, places taken in turn, lanes that somebody died in or where nobody passes."""
import numpy as np
import pytest
from missions import mission, robot

from mobile_planning import Boundary, PolygonObstacle
from mobile_planning.fleet import scenarios
from mobile_planning.fleet.faults import Faults, Join, Kill

ROOM = Boundary((-4, 4), (-3, 3))


def box(x_min, y_min, x_max, y_max):
    return PolygonObstacle([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


def fleet(poses, walls, room=ROOM):
    """Return a mission of robots from start to goal (4,) [m], ids from 1 on, that look along x."""
    robots = [robot(eyed, (*pose[:2], 0.0), (*pose[2:], 0.0), obstacles=walls, boundary=room)
              for eyed, pose in enumerate(poses, 1)]
    return mission(robots, walls, room)


@pytest.mark.parametrize('seed', range(2))
def test_a_crowd_among_the_pillars_and_shelves_of_a_map_is_resolved(seed):
    report = scenarios.make('hall', robots=10, seed=seed).run(seed=seed, check=False)
    assert report.arrived == 10 and not report.violations


#: A bay 0.7 m wide that ends at x = 3.5, and places in it, the deepest first.
BAY = [box(0.0, -3.0, 4.0, -0.35), box(0.0, 0.35, 4.0, 3.0), box(3.5, -0.35, 4.0, 0.35)]
BERTHS = [(3.1, 0.0), (2.2, 0.0), (1.3, 0.0)]


@pytest.mark.parametrize('goals', [[(-2.0, 0.0), *BERTHS[:2]], BERTHS[::-1]])
def test_in_a_dead_end_where_each_stands_on_the_goal_of_another_all_leave_and_come_back_in_order(goals):
    world = fleet([(*start, *goal) for start, goal in zip(BERTHS, goals)], BAY)
    report = world.run(seed=1, timeout=60.0)
    assert report.arrived == 3 and not report.violations and report.joint_plans >= 1


def test_each_in_a_ring_stands_on_the_goal_of_the_next():
    angle = 2 * np.pi * np.arange(6) / 6
    places = 0.55 * np.column_stack([np.cos(angle), np.sin(angle)])
    report = fleet(np.column_stack([places, np.roll(places, -2, axis=0)]), [], Boundary((-1.5, 1.5), (-1.5, 1.5))).run()
    assert report.arrived == 6 and not report.violations


def test_past_one_that_died_in_a_lane_the_others_take_the_other_lane():
    # Robot 1 has its goal in the nearer door and dies there; the others are switched on later.
    walls = [box(-0.1, -3.0, 0.1, -0.325), box(-0.1, 0.325, 0.1, 1.6), box(-0.1, 2.25, 0.1, 3.0)]
    world = fleet([(-2.0, 0.0, 0.0, 0.0), (-2.0, -1.0, 2.0, -1.0), (2.0, -0.5, -2.0, -0.5)], walls)
    faults = Faults(kills=(Kill(1, 5.0, is_certified=True),), joins=(Join(2, 6.0), Join(3, 6.0)))
    report = world.run(seed=2, faults=faults)
    assert report.arrived == 3 and not report.violations


def test_of_two_who_must_change_places_where_nobody_can_pass_one_waits_and_is_named():
    report = fleet([(-2.0, 0.0, 2.0, 0.0), (2.0, 0.0, -2.0, 0.0)], [], Boundary((-4, 4), (-0.3, 0.3))).run(timeout=25.0)
    assert report.arrived <= 1 and not report.violations
    assert len(report.waiting) == 2 - report.arrived and not any(each.is_cut_off for each in report.waiting)
