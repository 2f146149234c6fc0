"""RobotMsg to what a robot says and back."""
from __future__ import annotations

from array import array
from collections.abc import Collection
from math import nan

import numpy as np
from mobile_planning_msgs.msg import RobotMsg as RobotMessage

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import MAX_POINTS, Plan
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.joint_message import MAX_MEMBERS, JointStatus
from mobile_planning.fleet.message import MAX_LINKS, Mode, RobotMsg
from mobile_planning.fleet.postscript import Postscript
from mobile_planning.nodes import wire
from mobile_planning.nodes.convert import header, seconds

#: In the order of their numbers in a RobotMsg, from 1 on.
_REASONS = Reason.TURN, Reason.STALLED, Reason.BLOCKED, Reason.LEFT_OUT
#: By their numbers.
_MODES = tuple(Mode)


def robot_message(message: RobotMsg, time: float, frame: str, postscript: Postscript = Postscript()) -> RobotMessage:
    """Return the message to publish."""
    plan = message.plan
    return RobotMessage(
        header=header(frame, wire.stamp(time)), version=wire.layout(RobotMessage),
        robot_id=int(message.robot_id), boot_epoch=int(message.boot_epoch), sequence=int(message.sequence),
        done_planning=bool(message.dp), intended_path_z1=wire.floats(message.ip_z1),
        intended_path_z2=wire.floats(message.ip_z2), latest_z=np.asarray(message.lz, np.float64),
        mode=int(message.mode), plan_seq=int(message.plan_seq), step=float(plan.step),
        first_knot=int(plan.first_knot), control_points=wire.floats(plan.points), heading=float(plan.heading),
        final_heading=float(plan.final_heading), reverse=bool(plan.reverse), radius=float(message.radius),
        v_max=float(message.v_max), omega_max=float(message.omega_max), a_max=float(message.a_max),
        goal=np.asarray(message.goal, np.float64), mission_start=wire.stamp(postscript.mission_start),
        goals_reached=int(postscript.goals_reached), where_left=bool(postscript.is_where_left),
        **wire.link_columns(message.links),
        lag=wire.floats([postscript.lags.get(peer, np.nan) for peer in sorted(message.links)]),
        joint_epoch=message.joint.epoch, joint_proposer=message.joint.proposer,
        joint_followed=bool(message.joint.is_followed), joint_member=array('I', message.joint.progress),
        joint_progress=array('I', message.joint.progress.values()), stalled=float(message.joint.stalled),
        proposing=bool(message.joint.is_proposing), **_hold_up_fields(postscript))


def robot_msg(message: RobotMessage, frame: str, to: Collection[int] | None = None) -> RobotMsg:
    """Return what a robot said.

    Parameters
    ----------
    message : RobotMessage
    frame : str
        That it must be in.
    to : collection of int, optional
        Links with others than these robots and the sender itself are passed over, and not looked at; by default none
        is.

    Raises
    ------
    InvalidInput
        The layout, an array's length or a number is not as it must be.
    UnknownFrame
        The message is not in ``frame``.
    """
    wire.check_head(message, frame)
    if message.mode >= len(_MODES):
        raise InvalidInput(f'RobotMsg has mode {message.mode}, not 0 to {len(_MODES) - 1}')
    if max(len(message.intended_path_z1), len(message.intended_path_z2)) > MAX_POINTS:
        raise InvalidInput(f'the intended path of a RobotMsg has {len(message.intended_path_z1)} and '
                           f'{len(message.intended_path_z2)} numbers, more than {MAX_POINTS}')
    sender = int(message.robot_id)
    return RobotMsg(
        bool(message.done_planning), np.array(message.intended_path_z1), np.array(message.intended_path_z2),
        np.array(message.latest_z), robot_id=sender, boot_epoch=int(message.boot_epoch),
        sequence=int(message.sequence), mode=_MODES[message.mode], plan=_plan(message), plan_seq=int(message.plan_seq),
        radius=message.radius, v_max=message.v_max, omega_max=message.omega_max, a_max=message.a_max,
        goal=np.array(message.goal),
        links=wire.links(message.peer, message.peer_epoch, message.link_mode, message.contract, message.promised,
                         message.granted, to=None if to is None else {sender, *to}), joint=_joint_status(message))


def postscript(message: RobotMessage) -> Postscript:
    """Return what a robot said beside its intention.

    Raises
    ------
    InvalidInput
        There is not one lag for each link, or nothing can hold up a robot so.
    """
    if len(message.lag) != len(message.peer):
        raise InvalidInput(f'a RobotMsg has {len(message.lag)} lags for {len(message.peer)} links')
    if message.held_up > len(_REASONS) or max(len(message.without_word_of), len(message.waits_for)) > MAX_LINKS:
        raise InvalidInput(f'a RobotMsg is held_up {message.held_up} by {len(message.waits_for)} robots, without word '
                           f'of {len(message.without_word_of)}: known are 0 to {len(_REASONS)}, by up to {MAX_LINKS}')
    held_up = HoldUp(nan, _REASONS[message.held_up - 1], tuple(message.waits_for)) if message.held_up else None
    return Postscript(seconds(message.mission_start), int(message.goals_reached),
                      dict(zip(map(int, message.peer), map(float, message.lag))), tuple(message.without_word_of),
                      held_up, bool(message.where_left))


def _hold_up_fields(postscript):
    """Return the fields that say why a robot does not go on."""
    held_up = postscript.held_up
    reason, others = (0, ()) if held_up is None else (_REASONS.index(held_up.reason) + 1, held_up.for_robots)
    return {'without_word_of': array('I', postscript.without_word_of), 'held_up': reason,
            'waits_for': array('I', others)}


def _joint_status(message):
    """Return how a robot stands to its joint plan."""
    members, progress = list(message.joint_member), list(message.joint_progress)
    if len(members) != len(progress) or len(members) > MAX_MEMBERS or len(set(members)) != len(members):
        raise InvalidInput(f'a RobotMsg has {len(members)} joint_member, {len(progress)} joint_progress: they must be '
                           f'different robots, one number for each, up to {MAX_MEMBERS}')
    return JointStatus(int(message.joint_epoch), int(message.joint_proposer), bool(message.joint_followed),
                       dict(zip(members, progress)), float(message.stalled), bool(message.proposing))


def _plan(message):
    """Return the plan in a message, whose control points are x0 y0 x1 y1 ..."""
    values = message.control_points
    if len(values) % 2 or not 8 <= len(values) <= 2 * MAX_POINTS:
        raise InvalidInput(f'control_points has {len(values)} numbers, not an even count from 8 to {2 * MAX_POINTS}')
    return Plan(wire.knot(message.first_knot), message.step, np.array(values).reshape(-1, 2), message.heading,
                message.final_heading, bool(message.reverse))
