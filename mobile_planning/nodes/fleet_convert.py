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
from mobile_planning_msgs.msg import Contracts as ContractsMessage
from mobile_planning_msgs.msg import JointPlan as JointPlanMessage
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
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.joint_message import MAX_MEMBERS, JointPlan, JointStatus
from mobile_planning.fleet.message import MAX_LINKS, Contracts, Link, Mode, Offer, RobotMsg
from mobile_planning.fleet.solution import Solution
from mobile_planning.nodes.convert import check_frame, header, pose_message, seconds

if TYPE_CHECKING:
    from mobile_planning.fleet.verification import Body, Report

#: Layouts of RobotMsg, Contracts and JointPlan.
VERSION, CONTRACTS_VERSION, JOINT_PLAN_VERSION = 2, 1, 1
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
    plan, (peers, links) = message.plan, _sorted(message.links)
    return RobotMessage(
        header=header(frame, stamp(time)), version=VERSION, robot_id=int(message.robot_id),
        boot_epoch=int(message.boot_epoch), sequence=int(message.sequence), done_planning=bool(message.dp),
        intended_path_z1=_floats(message.ip_z1), intended_path_z2=_floats(message.ip_z2),
        latest_z=np.asarray(message.lz, np.float64), mode=int(message.mode), plan_seq=int(message.plan_seq),
        step=float(plan.step), first_knot=int(plan.first_knot), control_points=_floats(plan.points),
        heading=float(plan.heading), final_heading=float(plan.final_heading), reverse=bool(plan.reverse),
        radius=float(message.radius), v_max=float(message.v_max), omega_max=float(message.omega_max),
        a_max=float(message.a_max), goal=np.asarray(message.goal, np.float64), peer=array('I', peers),
        peer_epoch=array('I', [link.epoch for link in links]), link_mode=array('B', [int(link.mode) for link in links]),
        contract=array('I', [link.contract for link in links]), promised=array('I', [link.promised for link in links]),
        granted=array('q', [link.granted for link in links]), joint_epoch=message.joint.epoch,
        joint_proposer=message.joint.proposer, joint_followed=bool(message.joint.is_followed),
        joint_member=array('I', message.joint.progress), joint_progress=array('I', message.joint.progress.values()),
        stalled=float(message.joint.stalled), proposing=bool(message.joint.is_proposing))


def _sorted(links):
    """Return the robot ids and the links, in the order of the ids."""
    peers = sorted(links)
    return peers, [links[peer] for peer in peers]


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
    return RobotMsg(
        bool(message.done_planning), np.array(message.intended_path_z1), np.array(message.intended_path_z2),
        np.array(message.latest_z), robot_id=int(message.robot_id), boot_epoch=int(message.boot_epoch),
        sequence=int(message.sequence), mode=Mode(message.mode),
        plan=_plan(message), plan_seq=int(message.plan_seq),
        radius=message.radius, v_max=message.v_max, omega_max=message.omega_max, a_max=message.a_max,
        goal=np.array(message.goal),
        links=_links(message.peer, message.peer_epoch, message.link_mode, message.contract, message.promised,
                     message.granted), joint=_joint_status(message))


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
    return Plan(_knot(message.first_knot), message.step, np.array(values).reshape(-1, 2), message.heading,
                message.final_heading, bool(message.reverse))


def _knot(knot):
    if abs(knot) > MAX_KNOT:
        raise InvalidInput(f'a plan begins at knot {knot}, which is no time')
    return int(knot)


def _links(peers, *columns):
    """Return the links by peer, from one array for the peers and one for each field."""
    counts = [len(peers), *map(len, columns)]
    if len(set(counts)) != 1 or counts[0] > MAX_LINKS:
        raise InvalidInput(f'the arrays of the links have {counts} entries, not the same number up to {MAX_LINKS}')
    if len(set(peers)) != len(peers):
        raise InvalidInput('a message has two links with one robot')
    return {int(peer): Link(*map(int, link)) for peer, *link in zip(peers, *columns)}


def contracts_message(contracts: Contracts, time: float, frame: str) -> ContractsMessage:
    """Return the message to publish."""
    offers, (owners, answers) = contracts.offers, _sorted(contracts.answers)
    lines = [offer.contract for offer in offers]
    return ContractsMessage(
        header=header(frame, stamp(time)), version=CONTRACTS_VERSION, robot_id=contracts.robot_id,
        boot_epoch=contracts.boot_epoch, sequence=contracts.sequence,
        peer=array('I', [offer.peer_id for offer in offers]),
        peer_epoch=array('I', [offer.peer_epoch for offer in offers]),
        base_sequence=array('I', [offer.base_sequence for offer in offers]),
        contract=array('I', [contract.id for contract in lines]),
        first_span=array('q', [contract.first_span for contract in lines]),
        spans=array('H', [len(contract.normals) for contract in lines]),
        normals=_floats(np.concatenate([contract.normals.ravel() for contract in lines]) if lines else ()),
        offsets=_floats(np.concatenate([contract.offsets.ravel() for contract in lines]) if lines else ()),
        answer_peer=array('I', owners), answer_epoch=array('I', [link.epoch for link in answers]),
        answer_mode=array('B', [int(link.mode) for link in answers]),
        answer_contract=array('I', [link.contract for link in answers]),
        answer_promised=array('I', [link.promised for link in answers]),
        answer_granted=array('q', [link.granted for link in answers]))


def contracts(message: ContractsMessage, frame: str) -> Contracts:
    """Return what a robot offers and answers.

    Raises
    ------
    InvalidInput
        The layout, an array's length or a number is not as it must be.
    UnknownFrame
        The message is not in ``frame``.
    """
    if message.version != CONTRACTS_VERSION:
        raise InvalidInput(f'Contracts has version {message.version}, not {CONTRACTS_VERSION}')
    check_frame(message.header.frame_id, frame, 'Contracts')
    columns = (message.peer, message.peer_epoch, message.base_sequence, message.contract, message.first_span,
               message.spans)
    counts, spans = list(map(len, columns)), np.array(message.spans, int)
    if len(set(counts)) != 1 or counts[0] > MAX_LINKS:
        raise InvalidInput(f'the arrays of the offers have {counts} entries, not the same number up to {MAX_LINKS}')
    if len(message.normals) != 2 * spans.sum() or len(message.offsets) != 4 * spans.sum():
        raise InvalidInput(f'Contracts has {len(message.normals)} and {len(message.offsets)} numbers for its lines, '
                           f'not 2 and 4 for each of {spans.sum()}')
    ends = np.cumsum(spans)[:-1]
    normals = np.split(np.array(message.normals).reshape(-1, 2), ends)
    offsets = np.split(np.array(message.offsets).reshape(-1, 4), ends)
    offers = tuple(
        Offer(peer, epoch, base, Contract(number, _knot(first_span), *lines))
        for peer, epoch, base, number, first_span, _, *lines in zip(*(map(int, column) for column in columns),
                                                                    normals, offsets))
    return Contracts(int(message.robot_id), int(message.boot_epoch), int(message.sequence), offers,
                     _links(message.answer_peer, message.answer_epoch, message.answer_mode, message.answer_contract,
                            message.answer_promised, message.answer_granted))


def joint_plan_message(plan: JointPlan, time: float, frame: str) -> JointPlanMessage:
    """Return the message to publish."""
    needs = [need for each in plan.needs for need in each]
    needed = [pair for need in needs for pair in need]
    return JointPlanMessage(
        header=header(frame, stamp(time)), version=JOINT_PLAN_VERSION, robot_id=plan.robot_id,
        boot_epoch=plan.boot_epoch, sequence=plan.sequence, epoch=plan.epoch, proposer=plan.proposer,
        members=array('I', plan.members), points=array('H', [len(way) for way in plan.ways]),
        ways=_floats(np.concatenate(plan.ways)), needs=array('H', [len(need) for need in needs]),
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
    if message.version != JOINT_PLAN_VERSION:
        raise InvalidInput(f'JointPlan has version {message.version}, not {JOINT_PLAN_VERSION}')
    check_frame(message.header.frame_id, frame, 'JointPlan')
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
        reverse=[bool(plan.reverse) for plan in plans],
        section_times=_floats(solution.section_times),
        commits=_floats(solution.commits))


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
    columns = message.headings, message.final_headings, message.reverse
    if not 1 <= count <= MAX_PLANS or any(len(column) != count for column in (sizes, *columns)):
        raise InvalidInput(f'a solution has 1 to {MAX_PLANS} plans with one entry each in every array')
    if 2 * sizes.sum() != len(message.control_points):
        raise InvalidInput(f'a solution has {len(message.control_points)} numbers for {sizes.sum()} control points')
    points = np.array(message.control_points).reshape(-1, 2)
    plans = [Plan(_knot(knot), message.step, part, *fields) for knot, part, *fields in
             zip(message.first_knots, np.split(points, np.cumsum(sizes)[:-1]), *columns)]
    return Solution(int(message.robot_id), tuple(plans), bool(message.done), tuple(message.section_times),
                    commits=tuple(message.commits))


def report_message(report: Report, time: float) -> MissionReport:
    """Return the report to publish."""
    return MissionReport(
        header=header('', stamp(time)), name=str(report.name), valid=bool(report.valid), robots=int(report.robots),
        arrived=int(report.arrived), min_separation=float(report.min_separation),
        min_obstacle_clearance=float(report.min_obstacle_clearance), mission_time=float(report.mission_time),
        lower_bound=float('nan' if report.lower_bound is None else report.lower_bound), dead=int(report.dead),
        section_times=_floats(report.section_times), messages=int(report.messages or 0),
        message_bytes=int(report.message_bytes or 0), violations=[str(sentence) for sentence in report.violations])


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
