"""Joint plans in whole missions where messages and robots fail: whoever lives and has a way gets home, and unharmed."""
import numpy as np
import pytest
from missions import mission, robot

from mobile_planning import Boundary, PolygonObstacle
from mobile_planning.fleet import scenarios
from mobile_planning.fleet.faults import draw_faults


def through_a_door(kind, seed):
    """Return the report of four robots at a door; a tenth of the messages is lost, others come late or twice."""
    world = scenarios.make('doorway', robots=4, gap=0.65, seed=seed)
    return world.run(seed=seed, loss=0.1, delay=0.05, timeout=70.0,
                     faults=draw_faults(kind, list(world.robots), seed, 0.004))


@pytest.mark.parametrize('seed', range(2))
@pytest.mark.parametrize('kind', ['net', 'restart', 'join'])
def test_all_get_through_a_door_with_cuts_and_bursts_or_robots_that_start_anew_or_late(kind, seed):
    report = through_a_door(kind, seed)
    assert report.arrived == report.robots == 4 and not report.violations and report.joint_plans >= 1


@pytest.mark.parametrize('kind, seed', [('kill', 0), ('kill', 1), ('all', 1), ('all', 2)])
def test_where_one_dies_the_others_get_home_but_whom_the_dead_cut_off_or_bind_for_want_of_a_certificate(kind, seed):
    report = through_a_door(kind, seed)
    assert not report.violations and all(each.is_cut_off or each.bound_to_dead for each in report.waiting)
    assert report.arrived + len(report.waiting) >= 3


@pytest.mark.parametrize('robots, seed', [(4, 22), (8, 16)])
def test_those_who_live_are_led_past_one_that_died_in_their_midst(robots, seed):
    # The way bends around the dead one: drawn to what lies behind it, nobody would move.
    world = scenarios.make('swap', robots=robots, seed=seed)
    report = world.run(seed=seed, faults=draw_faults('death', list(world.robots), seed))
    assert report.arrived == robots - 1 and not report.violations and report.joint_plans >= 1


def test_who_stands_beside_another_sets_out_along_the_first_move_of_a_way_that_bends():
    # Drawn to where the way leads after the bend, its plan was drawn against its neighbour: three stood for ever.
    world = scenarios.make('line_swap', robots=8, seed=5)
    report = world.run(5, 0.1, 0.1, faults=draw_faults('storm', list(world.robots), 5, 0.004))
    assert report.arrived == 8 and not report.violations


def test_two_jams_at_once_are_both_resolved():
    def box(low, high):
        return PolygonObstacle([(-0.1, low), (0.1, low), (0.1, high), (-0.1, high)])
    walls, room = [box(-9.0, -4.325), box(-3.675, 3.675), box(4.325, 9.0)], Boundary((-4, 4), (-9, 9))
    robots = [robot(eyed, (-side * 1.5, y, 0.0 if side > 0 else np.pi), (side * 1.5, y, 0.0 if side > 0 else np.pi),
                    obstacles=walls, boundary=room)
              for eyed, (side, y) in enumerate([(1, -4.3), (-1, -3.7), (1, 4.3), (-1, 3.7)], 1)]
    report = mission(robots, walls, room).run(seed=3, loss=0.3)
    assert report.arrived == 4 and not report.violations and report.joint_plans >= 1
