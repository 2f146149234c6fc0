"""The safety argument, against an adversary who owns the network, the robots' wishes and the power switch.

Robots stand on the cells of a small ring. A plan is the cells that a robot will
still be in, in order; two plans are apart if they share none. Whatever was ever
sent may arrive at any time, any number of times, or never. After each event the
plans in force must be apart. Each rule of the protocol is then left out in turn,
and the same adversary must find the collision.
"""
import random
from dataclasses import dataclass, replace

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from mobile_planning import RobotMsg
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.message import Link
from mobile_planning.fleet.protocol import Peer, Protocol

CELLS = 8


@dataclass(frozen=True)
class Route:
    """The cells that a robot will still be in, in order; it stays in the last one."""

    cells: tuple[int, ...]
    step: float = 1.0


def are_apart(own, other, radius):
    return not set(own.cells) & set(other.cells)


class Agent:
    """A robot that uses the protocol as its docstrings say."""

    protocol = Protocol

    def __init__(self, robot_id, cell, roster):
        self.sent, self.roster = 0, roster
        self.side = self.protocol(robot_id, 0, Route((cell,)))
        self.side.join(roster)

    def hear(self, message, is_bound):
        self.side.hear(message, are_apart, is_bound)

    def propose(self, at, moves):
        """Leave the plan at one of its cells, if that keeps apart from the plans that must be kept apart from."""
        side, cells = self.side, self.side.plan.cells
        route = [cells[at % len(cells)]]
        for move in moves:
            route.append((route[-1] + move) % CELLS)
        others = [plan for peer in side.peers.values() for plan in peer.plans()]
        if side.proposal is None and all(are_apart(Route(tuple(route)), other, 0.0) for other in others):
            side.propose(Route(tuple(route)))

    def commit(self):
        side = self.side
        if side.is_promised():
            cells = side.plan.cells
            side.commit(Route(cells[:cells.index(side.proposal.cells[0]) + 1] + side.proposal.cells[1:]))

    def withdraw(self):
        self.side.withdraw()

    def drive(self):
        """Leave the first cell of the plan, unless it leads there again or the open proposal starts from it."""
        side, cells = self.side, self.side.plan.cells
        if len(cells) > 1 and (side.proposal is None or side.proposal.cells[0] in cells[1:]):
            side.plan = Route(cells[1:])

    def restart(self):
        """Lose all memory; the body is where it was."""
        old = self.side
        self.sent = 0
        self.side = self.protocol(old.robot_id, old.epoch + 1, Route(old.plan.cells[:1]))
        self.side.join(self.roster)

    def message(self):
        side, self.sent = self.side, self.sent + 1
        return RobotMsg(False, [], [], [0.0, 0.0], robot_id=side.robot_id, boot_epoch=side.epoch, sequence=self.sent,
                        plan=side.plan, plan_seq=side.plan_seq, proposal=side.proposal,
                        proposal_seq=0 if side.proposal is None else side.proposal_seq, links=side.links())


class Fleet:
    """Robots, and everything that was ever said."""

    def __init__(self, agent=Agent, robots=3, is_bound=True):
        cells = [index * CELLS // robots for index in range(robots)]
        self.agents = [agent(index + 1, cell, list(range(1, robots + 1))) for index, cell in enumerate(cells)]
        self.said, self.is_bound, self.commits = [], is_bound, 0

    def collision(self):
        """Return the plans in force of two robots that are not apart, None if all are."""
        plans = [agent.side.plan for agent in self.agents]
        return next(((a, b) for i, a in enumerate(plans) for b in plans[:i] if not are_apart(a, b, 0.0)), None)

    def event(self, rng, restarts):
        """Let the adversary do one thing."""
        agent = rng.choice(self.agents)
        chance = rng.random()
        if chance < restarts:
            agent.restart()
        elif chance < 0.25:
            self.said.append(agent.message())
        elif chance < 0.75 and self.said:
            # Mostly what was said of late, sometimes anything.
            recent = self.said[-12:] if rng.random() < 0.8 else self.said
            agent.hear(rng.choice(recent), self.is_bound)
        elif chance < 0.83:
            agent.propose(rng.randrange(9), [rng.choice((-1, 1)) for _ in range(rng.randrange(1, 4))])
        elif chance < 0.92:
            before = agent.side.plan
            agent.commit()
            self.commits += agent.side.plan is not before
        elif chance < 0.94:
            agent.withdraw()
        else:
            agent.drive()


def first_collision(agent, seeds, events=600, **fleet):
    """Return (seed, event) at which two plans in force are no longer apart, None if that never happens."""
    for seed in seeds:
        rng, world = random.Random(seed), Fleet(agent, **fleet)
        restarts = rng.choice([0.0, 0.002, 0.01])
        for event in range(events):
            world.event(rng, restarts)
            if world.collision():
                return seed, event
    return None


@pytest.mark.parametrize('robots', [2, 3, 4])
@pytest.mark.parametrize('is_bound', [True, False])
def test_no_adversary_brings_two_plans_in_force_together(robots, is_bound):
    assert first_collision(Agent, range(60), robots=robots, is_bound=is_bound) is None


def test_the_adversary_lets_robots_get_somewhere():
    world, rng = Fleet(), random.Random(1)
    for _ in range(8000):
        world.event(rng, 0.0)
    assert world.commits > 20


class Machine(RuleBasedStateMachine):
    """The same adversary, led by hypothesis, which shrinks what it finds."""

    agents = st.integers(0, 2)

    def __init__(self):
        super().__init__()
        self.fleet = Fleet()

    @rule(who=agents)
    def speak(self, who):
        self.fleet.said.append(self.fleet.agents[who].message())

    @precondition(lambda self: self.fleet.said)
    @rule(who=agents, back=st.integers(0, 30), everyone=st.booleans())
    def deliver(self, who, back, everyone):
        message = self.fleet.said[max(len(self.fleet.said) - 1 - back, 0)]
        for agent in self.fleet.agents if everyone else [self.fleet.agents[who]]:
            agent.hear(message, True)

    @rule(who=agents, at=st.integers(0, 8), moves=st.lists(st.sampled_from([-1, 1]), min_size=1, max_size=3))
    def propose(self, who, at, moves):
        self.fleet.agents[who].propose(at, moves)

    @rule(who=agents)
    def commit(self, who):
        self.fleet.agents[who].commit()

    @rule(who=agents)
    def withdraw(self, who):
        self.fleet.agents[who].withdraw()

    @rule(who=agents)
    def drive(self, who):
        self.fleet.agents[who].drive()

    @rule(who=agents)
    def restart(self, who):
        self.fleet.agents[who].restart()

    @invariant()
    def plans_in_force_are_apart(self):
        assert self.fleet.collision() is None


Machine.TestCase.settings = settings(max_examples=60, stateful_step_count=50, deadline=None)
TestMachine = Machine.TestCase


# What is left out must be missed


class PromisesWithoutLookingAtItsProposal(Protocol):
    def _can_promise(self, message, apart):
        return apart(self.plan, message.proposal, message.radius)


class PromisesWithoutLookingAtItsPlan(Protocol):
    def _can_promise(self, message, apart):
        return self.proposal is None or apart(self.proposal, message.proposal, message.radius)


class CommitsWithoutPromises(Protocol):
    def is_promised(self):
        return self.proposal is not None


class CommitsOnTheFirstPromise(Protocol):
    def is_promised(self):
        return self.proposal is not None and self.proposal_seq in self.promised_by.values()


class CommitsOnPromisesOfOtherProposals(Protocol):
    def is_promised(self):
        return self.proposal is not None and all(self.promised_by.get(peer) for peer in self.peers)


class ForgetfulPeer(Peer):
    def plans(self):
        return [] if self.message is None else [self.message.plan]


class ForgetsItsPromisesAndNeverGivesWay(Protocol):
    """Either rule alone would do; both spare the robots proposals that nobody can promise."""

    def join(self, roster):
        self.peers = {peer: ForgetfulPeer() for peer in roster if peer != self.robot_id}

    def withdraw(self):
        pass


def agent_with(rules):
    return type(rules.__name__, (Agent,), {'protocol': rules})


class IgnoresEpochs(Agent):
    """Takes a promise to the robot that ran before its restart for its own."""

    def hear(self, message, is_bound):
        links = {peer: Link(self.side.epoch, link.heard, link.promised) for peer, link in message.links.items()}
        super().hear(replace(message, links=links), is_bound)


class CommitsWhatItHasWithdrawn(Agent):
    """Remembers a withdrawn proposal and drives it when the last promise comes in."""

    lapsed = None

    def withdraw(self):
        if self.side.proposal is not None:
            self.lapsed = self.side.proposal
        super().withdraw()

    def commit(self):
        side = self.side
        if side.proposal is None and self.lapsed is not None and self.lapsed.cells[0] in side.plan.cells:
            side.proposal = self.lapsed
            super().commit()
            side.proposal = None
        super().commit()


WEAK = [*map(agent_with, (
    PromisesWithoutLookingAtItsProposal, PromisesWithoutLookingAtItsPlan, CommitsWithoutPromises,
    CommitsOnTheFirstPromise, CommitsOnPromisesOfOtherProposals, ForgetsItsPromisesAndNeverGivesWay)),
    IgnoresEpochs, CommitsWhatItHasWithdrawn]


@pytest.mark.parametrize('agent', WEAK, ids=lambda agent: agent.__name__)
def test_without_one_of_its_rules_the_adversary_wins(agent):
    assert first_collision(agent, range(300)) is not None


# Single rules


def robot(robot_id, cell, epoch=0):
    side = Protocol(robot_id, epoch, Route((cell,)))
    side.join([1, 2])
    return side


def said(side, sequence):
    return RobotMsg(False, [], [], [0.0, 0.0], robot_id=side.robot_id, boot_epoch=side.epoch, sequence=sequence,
                    plan=side.plan, proposal=side.proposal,
                    proposal_seq=0 if side.proposal is None else side.proposal_seq, links=side.links())


def exchange(one, two, sequence):
    """Let two robots hear each other's newest word; return whether each was news."""
    words = said(one, sequence), said(two, sequence)
    return one.hear(words[1], are_apart, True), two.hear(words[0], are_apart, True)


def test_a_proposal_that_keeps_apart_is_promised_and_committed():
    one, two = robot(1, 0), robot(2, 4)
    one.propose(Route((0, 1)))
    exchange(one, two, 1)
    assert not one.is_promised()
    exchange(one, two, 2)
    assert one.is_promised()
    one.commit(Route((0, 1)))
    assert one.plan.cells == (0, 1) and one.plan_seq == 1 and one.proposal is None and not one.is_promised()


def test_a_proposal_into_another_s_place_is_never_promised():
    one, two = robot(1, 0), robot(2, 2)
    one.propose(Route((0, 1, 2)))
    for sequence in range(1, 5):
        exchange(one, two, sequence)
    assert not one.is_promised()


@pytest.mark.parametrize('sequence', [1, 2])
def test_of_two_clashing_proposals_the_lower_id_s_stands(sequence):
    one, two = robot(1, 0), robot(2, 2)
    one.propose(Route((0, 1)))
    two.propose(Route((2, 1)))
    exchange(one, two, 1)
    assert two.proposal is None and one.proposal is not None
    exchange(one, two, 2)
    assert one.is_promised() and not two.is_promised()


def test_a_promise_is_kept_until_a_newer_message_shows_that_the_proposal_has_lapsed():
    one, two = robot(1, 0), robot(2, 4)
    one.propose(Route((0, 1)))
    exchange(one, two, 1)
    assert [plan.cells for plan in two.peers[1].plans()] == [(0,), (0, 1)]
    one.withdraw()
    assert len(two.peers[1].plans()) == 2
    exchange(one, two, 2)
    assert [plan.cells for plan in two.peers[1].plans()] == [(0,)]


def test_own_stale_and_foreign_messages_and_those_without_a_plan_are_ignored_and_counted():
    one, two, three = robot(1, 0), robot(2, 4), Protocol(3, 0, Route((7,)))
    newer = said(two, 5)
    assert one.hear(newer, are_apart, True)
    for message in (newer, said(two, 4), said(one, 9), said(three, 1), RobotMsg(False, [], [], [0, 0], robot_id=2),
                    replace(newer, sequence=6, plan=replace(newer.plan, step=0.5))):
        assert not one.hear(message, are_apart, True)
    assert one.ignored == 6 and one.peers[2].message is newer


def test_a_restarted_peer_is_heard_before_the_mission_and_ignored_during_it():
    one = robot(1, 0)
    assert one.hear(said(robot(2, 4), 8), are_apart, True)
    assert not one.hear(said(robot(2, 5, epoch=1), 1), are_apart, True)
    assert one.hear(said(robot(2, 5, epoch=1), 1), are_apart, False)
    assert not one.hear(said(robot(2, 4, epoch=0), 9), are_apart, False)


def test_a_promise_to_a_peer_does_not_outlive_its_restart():
    one, two = robot(1, 0), robot(2, 4)
    two.propose(Route((4, 5)))
    one.hear(said(two, 1), are_apart, False)
    assert one.peers[2].promised == 1
    again = robot(2, 4, epoch=1)
    again.propose(Route((4, 5, 6, 7, 8, 0)))
    one.hear(said(again, 1), are_apart, False)
    assert one.peers[2].promised == 0 and one.links()[2] == Link(1, 1, 0)


def test_a_promise_to_the_robot_before_its_restart_is_not_taken_for_one_s_own():
    one, two = robot(1, 0), robot(2, 4)
    two.propose(Route((4, 5)))
    one.hear(said(two, 1), are_apart, True)
    again = robot(2, 4, epoch=1)
    again.propose(Route((4, 3, 2, 1, 0)))
    again.hear(said(one, 2), are_apart, True)
    assert not again.is_promised()


def test_a_commit_needs_the_promise_of_everybody_on_the_roster():
    one, two = robot(1, 0), robot(2, 4)
    one.join([1, 2, 3])
    one.propose(Route((0, 1)))
    exchange(one, two, 1)
    exchange(one, two, 2)
    assert not one.is_promised()
    one.join([1, 2])
    assert one.is_promised()


def test_a_robot_alone_needs_nobody_s_promise():
    side = Protocol(7, 0, Plan.at_rest(0, 0.25, (0, 0, 0)))
    side.join([7])
    assert not side.is_promised()
    side.propose(Plan.at_rest(3, 0.25, (0, 0, 0)))
    assert side.is_promised()
