"""Missions, solutions, reports, certificates of death and what robots know of obstacles: messages to core and back."""
from __future__ import annotations

from array import array
from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from mobile_planning_msgs.msg import Deaths, MissionReport, ObstacleArray
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage

from mobile_planning.errors import InvalidInput, LimitExceeded
from mobile_planning.fleet.announcement import Announcement
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.message import MAX_LINKS, Death
from mobile_planning.fleet.solution import Solution
from mobile_planning.nodes import convert_obstacles, wire
from mobile_planning.nodes.convert import header, seconds
from mobile_planning.world.obstacles import Obstacle

if TYPE_CHECKING:
    from mobile_planning.fleet.verification import Report

MAX_PLANS, MAX_GOALS_TOLD = 100_000, 100_000
#: Of /obstacles; more belong on the map.
MAX_OBSTACLES, MAX_CORNERS = 1000, 10_000


def mission_message(announcement: Announcement, now: float) -> MissionMessage:
    """Return the announcement to publish."""
    return MissionMessage(
        header=header('', wire.stamp(now)), name=announcement.name, state=int(announcement.state),
        start=wire.stamp(announcement.start),
        robot_ids=array('I', [int(robot_id) for robot_id in announcement.robot_ids]),
        left_out=array('I', [int(robot_id) for robot_id in announcement.left_out]))


def announcement(message: MissionMessage) -> Announcement:
    """Return what is announced of a mission.

    Raises
    ------
    InvalidInput
        There is no such state, or the robots are none, too many or not all different.
    """
    return Announcement(str(message.name), message.state, tuple(message.robot_ids), seconds(message.start),
                        tuple(message.left_out))


def solution_message(solution: Solution, epoch: int, time: float, frame: str) -> SolutionMessage:
    """Return the message that carries every plan of ``solution``."""
    plans = solution.plans
    return SolutionMessage(
        header=header(frame, wire.stamp(time)), robot_id=int(solution.eyed), boot_epoch=int(epoch),
        done=bool(solution.done), step=float(plans[0].step),
        first_knots=array('q', [plan.first_knot for plan in plans]),
        sizes=array('I', [len(plan.points) for plan in plans]),
        control_points=wire.floats(np.concatenate([plan.points for plan in plans])),
        headings=wire.floats([plan.heading for plan in plans]),
        final_headings=wire.floats([plan.final_heading for plan in plans]),
        reverse=[bool(plan.reverse) for plan in plans],
        section_times=wire.floats(solution.section_times), commits=wire.floats(solution.commits),
        goals=wire.floats(np.reshape(solution.goals, -1)), reached_before=int(solution.reached_before))


def solution(message: SolutionMessage, frame: str) -> Solution:
    """Return a robot's solution.

    Raises
    ------
    InvalidInput
        The arrays do not fit each other or a plan is not valid.
    UnknownFrame
        The message is not in ``frame``.
    """
    wire.check_head(message, frame)
    count, sizes = len(message.first_knots), np.array(message.sizes, dtype=np.int64)
    columns = message.headings, message.final_headings, message.reverse
    if not 1 <= count <= MAX_PLANS or any(len(column) != count for column in (sizes, *columns)):
        raise InvalidInput(f'a solution has 1 to {MAX_PLANS} plans with one entry each in every array')
    if 2 * sizes.sum() != len(message.control_points):
        raise InvalidInput(f'a solution has {len(message.control_points)} numbers for {sizes.sum()} control points')
    if len(message.goals) % 3 or len(message.goals) > 3 * MAX_GOALS_TOLD or not np.isfinite(message.goals).all():
        raise InvalidInput(f'a solution has {len(message.goals)} numbers for its goals, not three finite ones for each')
    points = np.array(message.control_points).reshape(-1, 2)
    plans = [Plan(wire.knot(knot), message.step, part, *fields) for knot, part, *fields in
             zip(message.first_knots, np.split(points, np.cumsum(sizes)[:-1]), *columns)]
    return Solution(int(message.robot_id), tuple(plans), bool(message.done), tuple(message.section_times),
                    commits=tuple(message.commits), goals=tuple(np.array(message.goals).reshape(-1, 3)),
                    reached_before=int(message.reached_before))


def report_message(report: Report, time: float, proofs: int = 0, unchecked: int = 0) -> MissionReport:
    """Return the report to publish, and what was proved while the robots drove, see `Watch`."""
    return MissionReport(
        header=header('', wire.stamp(time)), name=str(report.name), valid=bool(report.valid), robots=int(report.robots),
        arrived=int(report.arrived), min_separation=float(report.min_separation),
        min_obstacle_clearance=float(report.min_obstacle_clearance), mission_time=float(report.mission_time),
        lower_bound=float('nan' if report.lower_bound is None else report.lower_bound), dead=int(report.dead),
        section_times=wire.floats(report.section_times), messages=int(report.messages or 0),
        message_bytes=int(report.message_bytes or 0), goals=int(report.goals), goals_reached=int(report.arrivals),
        judged_since=float(report.judged_since), watched_since=float(report.watched_since),
        throughput=float('nan' if report.throughput is None else report.throughput), proofs=int(proofs),
        unchecked=int(unchecked), waiting=[str(each) for each in report.waiting],
        violations=[str(sentence) for sentence in report.violations])


def deaths_message(deaths: Iterable[Death], time: float, frame: str) -> Deaths:
    """Return the message that vouches for ``deaths``, each with a radius."""
    deaths = list(deaths)
    return Deaths(
        header=header(frame, wire.stamp(time)), robot_id=array('I', [death.robot_id for death in deaths]),
        boot_epoch=array('I', [death.boot_epoch for death in deaths]),
        place=wire.floats([coordinate for death in deaths for coordinate in death.place]),
        radius=wire.floats([death.radius for death in deaths]), issued=[wire.stamp(death.issued) for death in deaths])


def deaths(message: Deaths, frame: str) -> list[Death]:
    """Return the certificates in a message.

    Raises
    ------
    InvalidInput
        The arrays differ in length, or a number is not as it must be.
    UnknownFrame
        The message is not in ``frame``.
    """
    wire.check_head(message, frame)
    count = len(message.robot_id)
    columns = message.boot_epoch, message.radius, message.issued
    if count > MAX_LINKS or len(message.place) != 2 * count or any(len(column) != count for column in columns):
        raise InvalidInput(f'Deaths has {count} robots, {len(message.place)} coordinates and '
                           f'{[len(column) for column in columns]} other entries: they must fit, up to {MAX_LINKS}')
    places = np.array(message.place).reshape(-1, 2)
    return [Death(int(robot_id), int(epoch), place, seconds(issued), float(radius))
            for robot_id, epoch, place, radius, issued in zip(message.robot_id, message.boot_epoch, places,
                                                              message.radius, message.issued)]


def obstacles(message: ObstacleArray, frame: str) -> tuple[Obstacle, ...]:
    """Return the obstacles in a message.

    Raises
    ------
    InvalidInput
        The arrays do not fit each other, an obstacle is none, or moves.
    LimitExceeded
        They are too many.
    UnknownFrame
        The message is not in ``frame``.
    """
    found = convert_obstacles.obstacles(message, frame)
    if found.moving:
        raise InvalidInput(f'{len(found.moving)} of the obstacles move: robots prove their ways among those that stand')
    count, corners = len(found.fixed), len(message.polygons) // 2
    if count > MAX_OBSTACLES or corners > MAX_CORNERS:
        raise LimitExceeded(f'there are {count} obstacles with {corners} corners, the limit is {MAX_OBSTACLES} with '
                            f'{MAX_CORNERS}: what stands for long belongs on the map')
    return found.fixed
