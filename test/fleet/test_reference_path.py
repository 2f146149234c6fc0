"""A way from elsewhere is driven along, and refused where the body does not fit, with all as it was."""
import numpy as np
import pytest

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.kinematics import UnicycleKineModel
from mobile_planning.fleet.robot import Robot
from mobile_planning.world.environment import Boundary
from mobile_planning.world.obstacles import RoundObstacle

#: Around the other side of the room than the shortest way.
DETOUR = np.array([(1, 1, 0), (1, 5, 0), (5, 5.5, 0), (9, 5, 0), (9, 1, 0)], float)


def robot():
    """Return a robot in a room with a pillar, under way to the other side."""
    one = Robot(1, UnicycleKineModel((1, 1, 0), (5, 1, 0)), [RoundObstacle((5, 3), 0.8)], Boundary((0, 10), (0, 6)))
    one.start([1], 0.0)
    return one


def drive(one, begin, end):
    """Let a robot drive for a while [s]; return its places (N, 2)."""
    return np.array([(one.step(now), one.state(now)[:2])[1] for now in np.arange(begin, end, 0.25)])


def test_a_given_way_is_driven_along_to_its_end():
    one = robot()
    one.follow_path(DETOUR, 0.0)
    places = drive(one, 0.0, 40.0)
    assert one.is_done and places[-1] == pytest.approx((9, 1), abs=0.03)
    # Corners are cut as far as the robot sees.
    for corner in DETOUR[1:4, :2]:
        assert np.linalg.norm(places - corner, axis=1).min() < 0.5


def test_another_goal_ends_it():
    one = robot()
    one.follow_path(DETOUR, 0.0)
    drive(one, 0.0, 3.0)
    one.set_goal((5, 1, 0), 3.0)
    places = drive(one, 3.0, 20.0)
    assert one.is_done and places[:, 1].max() < 5.0


@pytest.mark.parametrize('path, error, words', [
    (DETOUR[1:], InvalidInput, 'begins 4.000 m away'), (DETOUR[:1], InvalidInput, '2 to 10000'),
    (DETOUR[:, :2], InvalidInput, 'finite poses'), (DETOUR * np.nan, InvalidInput, 'finite poses'),
    ([(1, 1, 0), (5, 3, 0), (9, 5, 0)], InvalidInput, r'from \(1.000, 1.000\) on where robot 1 does not fit, by'),
    ([(1, 1, 0), (1, 7, 0)], InvalidInput, 'does not fit')])
def test_what_is_no_way_for_the_body_is_refused_and_the_old_one_stands(path, error, words):
    one = robot()
    with pytest.raises(error, match=words):
        one.follow_path(path, 0.0)
    assert one.goal.tolist() == [5, 1, 0]
    drive(one, 0.0, 15.0)
    assert one.is_done
