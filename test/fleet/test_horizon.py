"""Horizon: how a robot at rest sets out where that is not straightforward."""
import numpy as np
import pytest

from mobile_planning import Boundary, Robot, RoundObstacle, UnicycleKineModel


def driven(start, goal, obstacles=(), seconds=8.0):
    """Return the robot after it has had some time, alone."""
    robot = Robot(1, UnicycleKineModel(start, goal), obstacles, Boundary((-3, 3), (-3, 3)))
    robot.start([1], 0.0)
    for now in np.arange(0.0, seconds, robot.Tc):
        if not robot.is_done:
            robot.step(now)
    return robot


@pytest.mark.parametrize('heading', (0.0, 1.0, 2.0, 3.0))
@pytest.mark.parametrize('distance', (0.021, 0.024, 0.03, 0.05))
def test_the_last_centimetres_are_driven_whatever_the_heading(distance, heading):
    assert driven((0.0, 0.0, heading), (distance, 0.0, 0.0)).is_done


@pytest.mark.parametrize('gap', (1e-4, 4e-3))
@pytest.mark.parametrize('aside, turn', ((0.1, -0.1), (0.1, 0.1), (0.2, 0.25), (0.2, 0.34), (0.02, -0.34)))
def test_a_robot_beside_an_obstacle_that_its_heading_leads_into_turns_and_departs(gap, aside, turn):
    place = (np.sqrt((0.405 + gap)**2 - aside**2), aside)
    assert driven((0.0, 0.0, np.pi / 2 + turn), (0.0, 2.0, np.pi / 2), [RoundObstacle(place, 0.2)]).is_done
