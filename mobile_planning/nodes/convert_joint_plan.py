"""JointPlan, the message, to a joint plan and back."""
from __future__ import annotations

from array import array

import numpy as np
from mobile_planning_msgs.msg import JointPlan as JointPlanMessage

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.nodes import wire
from mobile_planning.nodes.convert import header


def joint_plan_message(plan: JointPlan, time: float, frame: str) -> JointPlanMessage:
    """Return the message to publish."""
    needs = [need for each in plan.needs for need in each]
    needed = [pair for need in needs for pair in need]
    return JointPlanMessage(
        header=header(frame, wire.stamp(time)), version=wire.layout(JointPlanMessage), robot_id=plan.robot_id,
        boot_epoch=plan.boot_epoch, sequence=plan.sequence, epoch=plan.epoch, proposer=plan.proposer,
        members=array('I', plan.members), points=array('H', [len(way) for way in plan.ways]),
        ways=wire.floats(np.concatenate(plan.ways)), needs=array('H', [len(need) for need in needs]),
        needed_member=array('I', [member for member, _ in needed]),
        needed_moves=array('H', [moves for _, moves in needed]))


def joint_plan(message: JointPlanMessage, frame: str) -> JointPlan:
    """Return a joint plan.

    Raises
    ------
    InvalidInput
        The layout, an array's length or a number is not as it must be.
    UnknownFrame
        The message is not in ``frame``.
    """
    wire.check_head(message, frame)
    points, counts = np.array(message.points, int), np.array(message.needs, int)
    moves = np.maximum(points - 1, 0)
    expected = {'members': len(points), 'ways': 2 * points.sum(), 'needs': moves.sum(),
                'needed_member': counts.sum(), 'needed_moves': counts.sum()}
    for name, length in expected.items():
        if len(getattr(message, name)) != length:
            raise InvalidInput(f'{name} of a JointPlan has {len(getattr(message, name))} entries, not {length}')
    ways = np.split(np.array(message.ways).reshape(-1, 2), np.cumsum(points)[:-1])
    pairs = list(zip(map(int, message.needed_member), map(int, message.needed_moves)))
    ends = np.cumsum(counts).tolist()
    needs = [tuple(pairs[end - count:end]) for end, count in zip(ends, counts.tolist())]
    lasts = np.cumsum(moves).tolist()
    return JointPlan(int(message.robot_id), int(message.boot_epoch), int(message.sequence), int(message.epoch),
                     int(message.proposer), tuple(map(int, message.members)), tuple(ways),
                     tuple(tuple(needs[last - count:last]) for last, count in zip(lasts, moves.tolist())))
