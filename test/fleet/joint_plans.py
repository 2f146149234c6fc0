"""A small joint plan for tests."""
from mobile_planning.fleet.joint_message import JointPlan

#: Two robots that have to pass each other's place, and one that is in nobody's way.
WAYS = ([(0, 0), (1, 0)], [(1, 0), (2, 0)], [(0, 5), (1, 5)])
NEEDS = ((((2, 1),),), ((),), ((),))


def joint_plan(epoch=1, proposer=1, members=(1, 2, 3), ways=WAYS, needs=NEEDS, robot_id=None):
    return JointPlan(proposer if robot_id is None else robot_id, 1, 1, epoch, proposer, members, ways, needs)
