"""Robots that coordinate: one under test, and what it hears of the others."""
import numpy as np

from mobile_planning import Boundary, Environment, PolygonObstacle
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.coordination import Coordination
from mobile_planning.fleet.joint_message import JointStatus
from mobile_planning.fleet.message import Mode, RobotMsg

RADIUS, CYCLE = 0.205, 0.25


def box(x_min, y_min, x_max, y_max):
    return PolygonObstacle([(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)])


def doorway():
    walls = [box(-0.1, -2, 0.1, -0.325), box(-0.1, 0.325, 0.1, 2)]
    return Environment(Boundary((-2.5, 2.5), (-2, 2)), walls)


def message(robot_id, place=(0.0, 0.0), goal=(0.0, 0.0), status=JointStatus(), mode=Mode.DRIVING, v_max=1.0):
    place = np.asarray(place, float)
    return RobotMsg(False, place[:1], place[1:], place, robot_id=robot_id, boot_epoch=1, mode=mode,
                    plan=Plan.at_rest(0, 0.125, (*place, 0.0)), radius=RADIUS, goal=np.asarray(goal, float),
                    v_max=v_max, joint=status)


def follows(plan, **progress):
    return JointStatus(plan.epoch, plan.proposer, True, {int(key[1:]): moves for key, moves in progress.items()})


def coordination(robot_id=2, others=(), now=0.0, environment=None):
    own = Coordination(robot_id, environment or Environment(Boundary((-5, 5), (-5, 5))), RADIUS, 1.0)
    for other in others:
        own.hear(other, now)
    own.prepare()
    return own
