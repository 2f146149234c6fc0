"""What is said in a mission holds; whatever is bent is found, and what was not heard is not claimed."""
from dataclasses import replace

import numpy as np
import pytest

from mobile_planning.fleet.message import Contracts, LinkMode, RobotMsg
from mobile_planning.fleet.report import Report
from mobile_planning.fleet.scenarios import scene
from mobile_planning.fleet.watch import Watch


@pytest.fixture(scope='module')
def said():
    """Return all that four robots say that swap their places, each with its time, and their radii."""
    robots = {robot.eyed: robot for robot in scene('swap', 1, robots=4).world_sim().robots.values()}
    history = []
    for robot in robots.values():
        robot.start(list(robots), 0.0)

    def deliver(messages, now):
        for message in messages:
            history.append((message, now))
            for other in robots.values():
                if other.eyed != message.robot_id:
                    other.receive(message, now)

    for now in np.arange(-1.0, 20.0, 0.125):
        for rank, robot in enumerate(robots.values()):
            if rank % 2 == round(now / 0.125) % 2:
                deliver(robot.step(now), now)
        for _ in range(3):
            for robot in robots.values():
                deliver(robot.answers(now + 0.03), now + 0.03)
        if all(robot.is_done for robot in robots.values()):
            break
    assert all(robot.is_done for robot in robots.values())
    return history, {robot.eyed: robot.rho for robot in robots.values()}


def listened(history, radii, forge=lambda message: message):
    """Return a watch that has heard it all."""
    watch = Watch(radii)
    for message, now in history:
        watch.hear(forge(message), now)
        watch.look(now)
    return watch


def test_a_mission_that_goes_well_is_proved_as_it_goes(said):
    watch = listened(*said)
    assert watch.violations == [] and watch.proofs > 100 and watch.unchecked == 0


def test_messages_may_be_lost_doubled_or_late_without_a_false_alarm(said):
    history, radii = said
    rng, watch = np.random.default_rng(5), Watch(radii)
    order = sorted(range(len(history)), key=lambda index: index + rng.uniform(0, 40))
    for index in order:
        for _ in range(rng.integers(0, 3)):
            watch.hear(*history[index])
    assert watch.violations == [] and watch.proofs > 50 and watch.unchecked > 0


def test_a_plan_that_leaves_its_side_is_found(said):
    def forge(message):
        if not (isinstance(message, RobotMsg) and message.robot_id == 2 and message.plan_seq > 3):
            return message
        points = message.plan.points.copy()
        points[3:] -= 0.6 * np.sign(points[3:])
        points[-3:] = points[-1]
        return replace(message, plan=replace(message.plan, points=points))
    watch = listened(*said, forge)
    assert any('contract' in sentence and 'of robot 2 breaks' in sentence for sentence in watch.violations)


def test_bodies_that_overlap_are_found_though_nobody_speaks_of_a_link(said):
    def forge(message):
        if isinstance(message, Contracts):
            return message
        shifted = replace(message.plan, points=message.plan.points * 0.05)
        return replace(message, links={}, plan=shifted)
    watch = listened(*said, forge)
    assert watch.proofs == 0 and any('their radii need' in sentence for sentence in watch.violations)
    assert len(watch.violations) <= 6


def test_a_plan_through_a_robot_at_rest_is_found(said):
    history, radii = said
    resting = next(message for message, _ in history if isinstance(message, RobotMsg) and message.robot_id == 1)
    moving = next(message for message, _ in history if isinstance(message, RobotMsg) and message.robot_id == 3
                  and message.plan_seq)
    link = replace(moving.links[1], mode=LinkMode.STATIC)
    for place, count in ((moving.plan.end, 1), (moving.plan.end + 5.0, 0)):
        watch = Watch(radii)
        watch.hear(replace(resting, plan=replace(resting.plan, points=np.tile(place, (4, 1)))), 0.0)
        watch.hear(replace(moving, links={1: link}), 0.0)
        assert len(watch.violations) == count and watch.proofs == 1 - count


def test_what_it_has_not_heard_is_said_in_the_report(said):
    history, radii = said
    report = Report('m', True, 4, (1, 2, 3, 4), 1.0, 1.0, 9.0)
    watch = Watch(radii)
    assert watch.summed_up(report, 1.0).watched_since == 0.0
    for message, stamp in history:
        if stamp >= 6.0:
            watch.hear(message, stamp)
    late = watch.summed_up(report, 1.0)
    assert 5.0 <= late.watched_since < 6.0 and late.as_dict()['watched_since'] == late.watched_since
    assert f'from {late.watched_since:.2f} s on' in late.table() and 'watched' not in report.table()
    assert watch.summed_up(report, 100.0).watched_since == 0.0
