"""Robots that drive at random, on real plans and contracts, over a network and a schedule that wish them ill.

    . launch/environment.sh; python benchmark/protocol_adversary.py [--events 1000000] [--seed 0]

In each episode a few robots take whatever plans their contracts allow. What happens next is drawn: time passes, a
robot's cycle or answer, a message that arrives late, twice or out of order, a message lost, a cut or a partition, the
end of a process, its new start, a certificate. Every other episode is wide and the robots see only so far, so that
contracts lapse. Whenever a plan has changed, it is sampled against all others from that instant until all rest: no
two discs may ever overlap. Prints what happened how often, and the least room that was ever left.
"""
from __future__ import annotations

import argparse
import time
from collections import Counter

import numpy as np

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import ROUNDING, build, room
from mobile_planning.fleet.link import V_REST
from mobile_planning.fleet.message import Death, LinkMode, RobotMsg
from mobile_planning.fleet.protocol import Protocol

STEP, SPANS, RADIUS, V_MAX = 0.25, 6, 0.2, 0.5
LEASE, REST_TIME = 1.0, (SPANS + 3) * STEP
GAP, MARGIN = 0.5, 2 * V_MAX * 0.5
SENSOR_RANGE = 2 * RADIUS + 2 * V_MAX * REST_TIME + 0.05
#: Samples of a span, as weights of its four control points.
_U = np.linspace(0, 1, 9)[:-1]
_WEIGHTS = np.stack([(1 - _U)**3, 3 * _U**3 - 6 * _U**2 + 4, -3 * _U**3 + 3 * _U**2 + 3 * _U + 1, _U**3]) / 6
#: Messages in flight or kept to be doubled.
_POOL = 300


class Collision(AssertionError):
    """Two plans in force overlap."""


class Body:
    """A robot's body and executor, which outlive its process; to the process it is the geometry."""

    def __init__(self, place, clock):
        self.plan = Plan.at_rest(0, STEP, (*place, 0.0))
        self._clock = clock

    @property
    def span(self):
        """The span that is being driven."""
        return int(self._clock.now // STEP)

    def accepts(self, contract, is_owner):
        return room(contract, self.plan, self.span, is_owner, RADIUS) >= -ROUNDING

    def clear_of(self, place, radius):
        return nearest(self.ahead(), np.asarray(place)) >= RADIUS + radius - ROUNDING

    def is_ample(self, contract, heard):
        return False

    def offer(self, contract_id, heard):
        first = max(self.span, heard.plan.first_knot)
        contract = build(contract_id, self.plan, heard.plan, first, RADIUS, heard.radius)
        return contract if contract is not None and self.accepts(contract, True) else None

    def ahead(self, count=0):
        """Return the control points from the current span on, to the end of the plan or for ``count`` spans."""
        count = max(count, self.plan.end_knot - self.span, 1)
        return self.plan.control(self.span, count + 3)

    def state(self):
        """Return where the body is, (2,) [m], and its speed [m/s]."""
        u = self._clock.now / STEP - self.span
        a, b, c, d = self.plan.control(self.span, 4)
        place = ((1 - u)**3 * a + (3 * u**3 - 6 * u**2 + 4) * b + (1 + 3 * u + 3 * u**2 - 3 * u**3) * c + u**3 * d) / 6
        velocity = ((1 - u)**2 * (b - a) + (1 + 2 * u - 2 * u**2) * (c - b) + u**2 * (d - c)) / (2 * STEP)
        return place, float(np.hypot(*velocity))

    @property
    def rests(self):
        return not np.ptp(self.ahead(), axis=0).any()


def nearest(points, place):
    """Return the least distance [m] of a curve's convex hulls to ``place``: a lower bound of its own, by separation."""
    hulls = np.stack([points[:-3] + 4 * points[1:-2] + points[2:-1], 4 * points[1:-2] + 2 * points[2:-1],
                      2 * points[1:-2] + 4 * points[2:-1], points[1:-2] + 4 * points[2:-1] + points[3:]], axis=1) / 6
    hulls = hulls - place
    towards = hulls / np.maximum(np.linalg.norm(hulls, axis=-1, keepdims=True), 1e-12)
    return np.einsum('sid,sjd->sij', towards, hulls).min(axis=-1).max(axis=-1).min()


def sampled(points):
    """Return the places (S * 8 + 1, 2) [m] of a curve at eight instants of each span, and at its end."""
    spans = np.lib.stride_tricks.sliding_window_view(points, 4, axis=0)
    return np.concatenate([np.einsum('iu,sdi->sud', _WEIGHTS, spans).reshape(-1, 2), points[-1:]])


class Clock:
    """The time [s]."""

    now = 0.0


class Adversary:
    """One episode.

    Attributes
    ----------
    counts : Counter
        What happened how often.
    least : float [m]
        Room between any two plans in force at any sampled instant.
    """

    def __init__(self, seed):
        self.rng = rng = np.random.default_rng(seed)
        self.counts, self.least = Counter(), np.inf
        self.clock = Clock()
        self.is_wide = bool(seed % 2)
        self.size = 3.5 if self.is_wide else rng.uniform(0.8, 1.4)
        count = int(rng.integers(2, 5))
        self.bodies = [Body(place, self.clock) for place in self._places(count)]
        self.epochs = [1] * count
        self.robots = [None] * count
        self.wishes = [rng.uniform(-self.size, self.size, 2) for _ in range(count)]
        self.pool, self.cut = [], set()
        self.loss, self.hurry = rng.choice([0.0, 0.2, 0.5]), rng.choice([0.5, 0.8, 0.95])
        self.ill = rng.choice([0.0, 0.003, 0.01])
        late = {int(rng.integers(count))} if rng.random() < 0.3 else set()
        docks = {robot: (self.bodies[robot].plan.end, RADIUS) for robot in late}
        for robot in range(count):
            if robot not in late:
                self._boot(robot, docks)

    def _places(self, count):
        places = []
        while len(places) < count:
            place = self.rng.uniform(-self.size, self.size, 2)
            if all(np.linalg.norm(place - other) > 2.2 * RADIUS for other in places):
                places.append(place)
        return places

    def _boot(self, robot, docks):
        self.robots[robot] = Protocol(
            robot, self.epochs[robot], self.bodies[robot], lease=LEASE, rest_time=REST_TIME, margin=MARGIN, gap=GAP,
            sensor_range=SENSOR_RANGE if self.is_wide else np.inf, born=self.clock.now)
        self.robots[robot].join(range(len(self.bodies)), docks)

    def run(self, events):
        """Let ``events`` happen.

        Raises
        ------
        Collision
            Two plans in force overlap.
        """
        for _ in range(events):
            draw, robot = self.rng.random(), int(self.rng.integers(len(self.bodies)))
            if draw < self.ill:
                self._do_ill(robot)
            elif draw < 0.24:
                self._cycle(robot)
            elif draw < 0.34:
                self._answer(robot)
            elif draw < 0.5 or not self.pool:
                self.clock.now += self.rng.uniform(0, 0.5 / len(self.bodies))
            else:
                self._deliver()

    def _cycle(self, robot):
        protocol, body, now = self.robots[robot], self.bodies[robot], self.clock.now
        if protocol is None:
            return
        seen = {other: each.state() for other, each in enumerate(self.bodies) if other != robot}
        before = [link.mode for link in protocol.links(now).values()]
        protocol.observe(seen, now, body.state()[0])
        after = [link.mode for link in protocol.links(now).values()]
        self.counts['conversions'] += sum(is_disc(b) and not is_disc(a) for a, b in zip(before, after))
        self.counts['lapses'] += sum(b is LinkMode.FAR and a is not b for a, b in zip(before, after))
        self._commit(robot)
        protocol.committed(now)
        points = body.ahead()
        number = protocol.next_sequence()
        protocol.sent(number, now)
        self._say(robot, RobotMsg(False, [0.0], [0.0], body.state()[0], robot_id=robot, boot_epoch=protocol.epoch,
                                  sequence=number, plan=Plan(body.span, STEP, points), radius=RADIUS,
                                  links=protocol.links(now)))
        self._answer(robot)

    def _commit(self, robot):
        """Change the plan at random as far as all that binds the robot allows."""
        protocol, body, now = self.robots[robot], self.bodies[robot], self.clock.now
        knot = body.span + 1
        old = body.plan.control(knot, SPANS + 3)
        at_rest = np.linalg.norm(old[2] - old[0]) / (2 * STEP) < V_REST
        bound = protocol.bound()
        if not protocol.may_move(now, at_rest) or any(contract.first_span > knot for contract, _ in bound):
            self.counts['must stay'] += 1
            return
        new = self._wish(robot, old)
        for share in (1.0, 0.5, 0.2, 0.05):
            points = np.concatenate([body.plan.control(body.span, knot - body.span), old + share * (new - old)])
            points[-2:] = points[-3]
            plan = Plan(body.span, STEP, points)
            if (all(room(contract, plan, body.span, is_owner, RADIUS) >= -ROUNDING for contract, is_owner in bound)
                    and all(nearest(points, place) >= RADIUS + radius - ROUNDING
                            for place, radius in protocol.discs())):
                self.counts['departures'] += bool(at_rest)
                self.counts['commits'] += 1
                body.plan = plan
                self._check(robot)
                return

    def _wish(self, robot, old):
        """Return control points as ``old`` at first, then towards a place that changes now and then."""
        if self.rng.random() < 0.05 or np.linalg.norm(self.wishes[robot] - old[2]) < 0.1:
            self.wishes[robot] = self.rng.uniform(-self.size, self.size, 2)
        new = old.copy()
        if self.rng.random() < 0.1:
            new[3:] = old[2]
            return new
        for index in range(3, SPANS + 1):
            way = self.wishes[robot] - new[index - 1] + self.rng.normal(0, 0.05, 2)
            new[index] = new[index - 1] + way * min(1.0, V_MAX * STEP / max(np.linalg.norm(way), 1e-9))
        new[SPANS + 1:] = new[SPANS]
        return new

    def _check(self, robot):
        """Sample the new plan against all others, to the end of both."""
        ends = max(body.plan.end_knot for body in self.bodies) - self.bodies[robot].span
        own = sampled(self.bodies[robot].ahead(ends))
        for other, body in enumerate(self.bodies):
            if other != robot:
                least = np.linalg.norm(own - sampled(body.ahead(ends)), axis=1).min() - 2 * RADIUS
                self.least = min(self.least, least)
                if least < -1e-6:
                    raise Collision(f'robots {robot} and {other} at {self.clock.now:.2f} s overlap by {-least:.4f} m')

    def _answer(self, robot):
        protocol = self.robots[robot]
        if protocol is not None:
            message = protocol.due(self.clock.now)
            if message is not None:
                self.counts['offers'] += len(message.offers)
                self._say(robot, message)

    def _say(self, robot, message):
        """Hand a message to the network, which loses some for some."""
        self.counts['messages'] += 1
        for to in range(len(self.bodies)):
            if to != robot and (robot, to) not in self.cut and self.rng.random() >= self.loss:
                self.pool.append((to, message))
        while len(self.pool) > _POOL:
            self.pool.pop(int(self.rng.integers(len(self.pool))))

    def _deliver(self):
        """Let one message arrive: a new or an old one, and for the last time or not."""
        recent = min(len(self.pool), 12) if self.rng.random() < self.hurry else len(self.pool)
        index = len(self.pool) - 1 - int(self.rng.integers(recent))
        to, message = self.pool[index]
        if self.rng.random() < 0.7:
            self.pool.pop(index)
        if self.robots[to] is not None:
            self.counts['delivered'] += 1
            self.robots[to].hear(message, self.clock.now)

    def _do_ill(self, robot):
        """End, start or certify a process, cut links, or mend them."""
        kind = str(self.rng.choice(['kill', 'start', 'certify', 'cut', 'cut', 'part', 'mend']))
        everybody = range(len(self.bodies))
        if kind == 'kill' and self.robots[robot] is not None:
            self.robots[robot] = None
        elif kind == 'start' and self.robots[robot] is None and self.bodies[robot].rests:
            self.epochs[robot] += 1
            self._boot(robot, {})
        elif kind == 'certify' and self.robots[robot] is None and self.bodies[robot].rests:
            death = Death(robot, self.epochs[robot], self.bodies[robot].plan.end, self.clock.now, radius=RADIUS)
            self.pool += [(to, death) for to in everybody if to != robot]
        elif kind == 'cut':
            self.cut.add((robot, int(self.rng.integers(len(self.bodies)))))
        elif kind == 'part':
            some = set(self.rng.permutation(len(self.bodies))[:len(self.bodies) // 2].tolist())
            self.cut |= {(a, b) for a in everybody for b in everybody if (a in some) != (b in some)}
        elif kind == 'mend':
            self.cut.clear()
        else:
            return
        self.counts[kind] += 1


def is_disc(mode):
    return mode is LinkMode.STATIC


def run(events, seed=0, per_episode=4000):
    """Return what happened in episodes of together ``events`` events, and the least room [m] between two plans."""
    counts, least = Counter(), np.inf
    for episode in range(max(1, events // per_episode)):
        adversary = Adversary(seed + episode)
        adversary.run(per_episode)
        counts.update(adversary.counts, episodes=1, events=per_episode)
        least = min(least, adversary.least)
    return counts, least


def main():
    """Run episodes and print what happened."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--events', type=int, default=1_000_000)
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args()
    began = time.perf_counter()
    counts, least = run(options.events, options.seed)
    for what, count in sorted(counts.items()):
        print(f'{what:12s} {count:9d}')
    print(f'least room between two plans {least:.6f} m, {time.perf_counter() - began:.0f} s')


if __name__ == '__main__':
    main()
