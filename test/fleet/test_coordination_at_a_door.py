"""Coordination of robots that are stuck on both sides of a door, with messages that are lost now and then."""
import numpy as np
import pytest
from partners import CYCLE, RADIUS, doorway, message

from mobile_planning.fleet.coordination import Coordination


class Body:
    """A robot that does at once what its coordination says, as fast as it drives, as far as nobody is in its way."""

    def __init__(self, robot_id, environment, place, goal):
        self.coordination = Coordination(robot_id, environment, RADIUS, 1.0)
        self.id, self.place, self.goal = robot_id, np.array(place, float), np.array(goal, float)
        self.stalled, self.is_dead = 0.0, False

    @property
    def is_home(self):
        return np.linalg.norm(self.place - self.goal) < 0.02

    def step(self, now):
        own = self.coordination
        said = own.update(now, self.place, self.place, self.goal, self.is_home and not own.calls, self.stalled)
        request = own.take_request()
        if request is not None:
            said += own.propose(request.plan(), now)
        self.stalled = 0.0 if own.is_following else self.stalled + CYCLE
        way, left = own.way(self.place), CYCLE
        for point in () if way is None else way[1:] if len(way) > 1 else way:
            leg = point - self.place
            length = np.linalg.norm(leg)
            self.place = self.place + leg * min(1.0, left / max(length, 1e-9))
            left -= length
            if left <= 0:
                break
        return said


def drive(bodies, seconds, loss=0.0, seed=0):
    """Let the bodies drive with messages that are lost now and then; return the least distance of two of them."""
    rng, least, now = np.random.default_rng(seed), np.inf, 0.0
    while now < seconds and not all(body.is_home or body.is_dead for body in bodies):
        now += CYCLE
        for body in rng.permutation([body for body in bodies if not body.is_dead]):
            before = body.place
            said = body.step(now)
            if any(np.linalg.norm(body.place - other.place) < min(2 * RADIUS, np.linalg.norm(before - other.place))
                   for other in bodies if other is not body and not other.is_dead):
                # What a plan says is guidance: it is contracts that keep robots apart.
                body.place = before
            said = [*said, message(body.id, body.place, body.goal, body.coordination.status)]
            for other in bodies:
                for each in said if other is not body and not other.is_dead else ():
                    if rng.random() >= loss:
                        other.coordination.hear(each, now)
        places = np.array([body.place for body in bodies])
        gaps = np.linalg.norm(places[:, None] - places, axis=2)[np.triu_indices(len(bodies), 1)]
        least = min(least, gaps.min(initial=np.inf))
    return least


def through_the_door():
    world = doorway()
    places = [(-1.5, -0.5), (1.5, 0.5), (-1.5, 0.5), (1.5, -0.5)]
    return [Body(10 + i, world, place, (-place[0], place[1])) for i, place in enumerate(places)]


def test_robots_that_are_stuck_on_both_sides_of_a_door_get_through_without_touching():
    bodies = through_the_door()
    drive(bodies, 60.0)
    assert all(body.is_home for body in bodies)


@pytest.mark.parametrize('seed', range(6))
def test_they_get_through_when_a_third_of_the_messages_is_lost(seed):
    bodies = through_the_door()
    drive(bodies, 90.0, loss=0.3, seed=seed)
    assert all(body.is_home for body in bodies)


def test_the_others_get_home_past_one_that_falls_silent():
    bodies = through_the_door()
    bodies[0].place[:] = -2.2, -1.6
    drive(bodies, 0.5)
    bodies[0].is_dead = True
    drive(bodies, 90.0)
    assert all(body.is_home for body in bodies[1:])


def test_all_follow_the_plan_of_one():
    bodies = through_the_door()
    for body in bodies:
        body.stalled = 10.0
    drive(bodies, 1.5)
    assert {body.coordination.status.version for body in bodies} == {(1, -10)}
