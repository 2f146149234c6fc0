"""Messages of the fleet to core objects and back; every scalar is cast, every array checked.

Beside ``convert``, which does the same for maps, poses and paths.
"""
from __future__ import annotations

from array import array
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import MissionReport
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from visualization_msgs.msg import Marker, MarkerArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.announcement import Announcement
from mobile_planning.fleet.bspline import MAX_POINTS, Plan
from mobile_planning.fleet.message import MAX_LINKS, Link, Mode, RobotMsg
from mobile_planning.fleet.solution import Solution
from mobile_planning.nodes.convert import check_frame, header, pose_message, seconds

if TYPE_CHECKING:
    from mobile_planning.fleet.verification import Body, Report

#: Layout of RobotMsg.
VERSION = 1
MAX_PLANS = 100_000
#: Knots beyond this are no times of any clock, and sums of them would not fit 64 bits.
MAX_KNOT = 2**48


def stamp(time: float) -> Time:
    """Return ``time`` [s] as a stamp."""
    whole = int(np.floor(time))
    return Time(sec=whole, nanosec=min(int(round((time - whole) * 1e9)), 999_999_999))


def _floats(values) -> array:
    return array('d', np.ascontiguousarray(values, dtype=np.float64).tobytes())


def robot_message(message: RobotMsg, time: float, frame: str) -> RobotMessage:
    """Return the message to publish."""
    plan, proposal = message.plan, message.proposal
    peers = sorted(message.links)
    return RobotMessage(
        header=header(frame, stamp(time)), version=VERSION, robot_id=int(message.robot_id),
        boot_epoch=int(message.boot_epoch), sequence=int(message.sequence), done_planning=bool(message.dp),
        intended_path_z1=_floats(message.ip_z1), intended_path_z2=_floats(message.ip_z2),
        latest_z=np.asarray(message.lz, np.float64), mode=int(message.mode), plan_seq=int(message.plan_seq),
        step=float(plan.step), first_knot=int(plan.first_knot), control_points=_floats(plan.points),
        heading=float(plan.heading), final_heading=float(plan.final_heading), proposal_seq=int(message.proposal_seq),
        proposal_first_knot=0 if proposal is None else int(proposal.first_knot),
        proposal_control_points=_floats(() if proposal is None else proposal.points),
        radius=float(message.radius), v_max=float(message.v_max), omega_max=float(message.omega_max),
        a_max=float(message.a_max), goal=np.asarray(message.goal, np.float64), peer=array('I', peers),
        peer_epoch=array('I', [int(message.links[peer].epoch) for peer in peers]),
        heard=array('I', [int(message.links[peer].heard) for peer in peers]),
        promised=array('I', [int(message.links[peer].promised) for peer in peers]))


def robot_msg(message: RobotMessage, frame: str) -> RobotMsg:
    """Return what a robot said.

    Raises
    ------
    InvalidInput
        The layout, an array's length or a number is not as it must be.
    UnknownFrame
        The message is not in ``frame``.
    """
    if message.version != VERSION:
        raise InvalidInput(f'RobotMsg has version {message.version}, not {VERSION}')
    check_frame(message.header.frame_id, frame, 'RobotMsg')
    if message.mode not in list(Mode):
        raise InvalidInput(f'RobotMsg has mode {message.mode}, not 0 to {max(Mode)}')
    if max(len(message.intended_path_z1), len(message.intended_path_z2)) > MAX_POINTS:
        raise InvalidInput(f'the intended path of a RobotMsg has {len(message.intended_path_z1)} and '
                           f'{len(message.intended_path_z2)} numbers, more than {MAX_POINTS}')
    proposal = None
    if message.proposal_seq:
        proposal = _plan(message, 'proposal_control_points', message.proposal_first_knot)
    return RobotMsg(
        bool(message.done_planning), np.array(message.intended_path_z1), np.array(message.intended_path_z2),
        np.array(message.latest_z), robot_id=int(message.robot_id), boot_epoch=int(message.boot_epoch),
        sequence=int(message.sequence), mode=Mode(message.mode),
        plan=_plan(message, 'control_points', message.first_knot, message.heading, message.final_heading),
        plan_seq=int(message.plan_seq), proposal=proposal, proposal_seq=int(message.proposal_seq),
        radius=message.radius, v_max=message.v_max, omega_max=message.omega_max, a_max=message.a_max,
        goal=np.array(message.goal), links=_links(message))


def _plan(message, name, first_knot, *headings):
    """Return the plan of the control points x0 y0 x1 y1 ... that the message holds as ``name``."""
    values = getattr(message, name)
    if len(values) % 2 or not 8 <= len(values) <= 2 * MAX_POINTS:
        raise InvalidInput(f'{name} has {len(values)} numbers, not an even count from 8 to {2 * MAX_POINTS}')
    return Plan(_knot(first_knot), message.step, np.array(values).reshape(-1, 2), *headings)


def _knot(knot):
    if abs(knot) > MAX_KNOT:
        raise InvalidInput(f'a plan begins at knot {knot}, which is no time')
    return int(knot)


def _links(message):
    peers = list(message.peer)
    if not len(peers) == len(message.peer_epoch) == len(message.heard) == len(message.promised) <= MAX_LINKS:
        raise InvalidInput(f'a RobotMsg has {len(peers)}, {len(message.peer_epoch)}, {len(message.heard)} and '
                           f'{len(message.promised)} entries for its links, not up to {MAX_LINKS} in each array')
    if len(set(peers)) != len(peers):
        raise InvalidInput('a RobotMsg has two links with one robot')
    return {int(peer): Link(int(epoch), int(heard), int(promised)) for peer, epoch, heard, promised
            in zip(peers, message.peer_epoch, message.heard, message.promised)}


def mission_message(announcement: Announcement, now: float) -> MissionMessage:
    """Return the announcement to publish."""
    return MissionMessage(
        header=header('', stamp(now)), name=announcement.name, state=int(announcement.state),
        start=stamp(announcement.start), robot_ids=array('I', [int(robot_id) for robot_id in announcement.robot_ids]))


def announcement(message: MissionMessage) -> Announcement:
    """Return what is announced of a mission.

    Raises
    ------
    InvalidInput
        There is no such state, or the robots are none, too many or not all different.
    """
    return Announcement(str(message.name), message.state, tuple(message.robot_ids), seconds(message.start))


def solution_message(solution: Solution, epoch: int, time: float, frame: str) -> SolutionMessage:
    """Return the message that carries every plan of ``solution``."""
    plans = solution.plans
    return SolutionMessage(
        header=header(frame, stamp(time)), robot_id=int(solution.eyed), boot_epoch=int(epoch), done=bool(solution.done),
        step=float(plans[0].step), first_knots=array('q', [plan.first_knot for plan in plans]),
        sizes=array('I', [len(plan.points) for plan in plans]),
        control_points=_floats(np.concatenate([plan.points for plan in plans])),
        headings=_floats([plan.heading for plan in plans]),
        final_headings=_floats([plan.final_heading for plan in plans]),
        section_times=_floats(solution.section_times))


def solution(message: SolutionMessage, frame: str) -> Solution:
    """Return a robot's solution.

    Raises
    ------
    InvalidInput
        The arrays do not fit each other or a plan is not valid.
    UnknownFrame
        The message is not in ``frame``.
    """
    check_frame(message.header.frame_id, frame, 'Solution')
    count, sizes = len(message.first_knots), np.array(message.sizes, dtype=np.int64)
    if not 1 <= count <= MAX_PLANS or not count == len(sizes) == len(message.headings) == len(message.final_headings):
        raise InvalidInput(f'a solution has 1 to {MAX_PLANS} plans with one entry each in every array')
    if 2 * sizes.sum() != len(message.control_points):
        raise InvalidInput(f'a solution has {len(message.control_points)} numbers for {sizes.sum()} control points')
    points = np.array(message.control_points).reshape(-1, 2)
    plans = [Plan(_knot(knot), message.step, part, heading, final) for knot, part, heading, final in
             zip(message.first_knots, np.split(points, np.cumsum(sizes)[:-1]), message.headings,
                 message.final_headings)]
    return Solution(int(message.robot_id), tuple(plans), bool(message.done), tuple(message.section_times))


def report_message(report: Report, time: float) -> MissionReport:
    """Return the report to publish."""
    return MissionReport(
        header=header('', stamp(time)), name=str(report.name), valid=bool(report.valid), robots=int(report.robots),
        arrived=int(report.arrived), min_separation=float(report.min_separation),
        min_obstacle_clearance=float(report.min_obstacle_clearance), mission_time=float(report.mission_time),
        violations=[str(sentence) for sentence in report.violations])


def odometry(state: NDArray, time: float, frame: str, child_frame: str) -> Odometry:
    """Return the state x, y, theta, v, omega (5,) as odometry."""
    message = Odometry(header=header(frame, stamp(time)), child_frame_id=str(child_frame))
    message.pose.pose = pose_message(state[:3])
    message.twist.twist.linear.x, message.twist.twist.angular.z = float(state[3]), float(state[4])
    return message


def fleet_markers(bodies: Sequence[Body], messages: Mapping[int, RobotMsg], colours: Sequence[str], time: float,
                  frame: str) -> MarkerArray:
    """Return one disc, one intended path and one goal for each robot heard."""
    markers = []
    for index, body in enumerate(bodies):
        heard = messages.get(body.eyed)
        if heard is None:
            continue
        red, green, blue = (int(colours[index % len(colours)][at:at + 2], 16) / 255 for at in (1, 3, 5))
        path = [Point(x=float(x), y=float(y), z=0.0) for x, y in zip(heard.ip_z1, heard.ip_z2)]
        for kind, pose, scale, points in (
                ('robots', pose_message((*heard.lz, heard.plan.heading)), (2 * body.radius, 2 * body.radius, 0.2), []),
                ('intents', pose_message((0, 0, 0)), (0.04, 0.0, 0.0), path),
                ('goals', pose_message(body.goal), (body.radius, 0.05, 0.05), [])):
            marker = Marker(header=header(frame, stamp(time)), ns=kind, id=int(body.eyed), pose=pose, points=points)
            marker.type = {'robots': Marker.CYLINDER, 'intents': Marker.LINE_STRIP, 'goals': Marker.ARROW}[kind]
            marker.scale.x, marker.scale.y, marker.scale.z = map(float, scale)
            marker.color.r, marker.color.g, marker.color.b, marker.color.a = red, green, blue, 0.9
            marker.lifetime.sec = 2
            markers.append(marker)
    return MarkerArray(markers=markers)
