"""Motion: what is planned changes nothing, and what is committed is proved, whatever it comes from."""
from dataclasses import replace

import numpy as np
import pytest
from missions import SWAP, drive_alone, exchange, mission, robot, under_way

from mobile_planning import RoundObstacle
from mobile_planning.fleet import qp
from mobile_planning.fleet.contracts import ROUNDING, room
from mobile_planning.fleet.message import Contracts


def test_planning_changes_nothing_until_it_is_committed():
    agent, now = under_way()
    before = agent.plan, len(agent.sol.plans)
    section = agent.plan_section(now)
    assert section.new is not None and (agent.plan, len(agent.sol.plans)) == before
    agent.commit(section, now)
    assert agent.plan is not before[0] and len(agent.sol.plans) == before[1] + 1


def test_a_section_that_comes_too_late_is_dropped_and_the_robot_speaks_on():
    agent, now = under_way()
    section, plans = agent.plan_section(now), len(agent.sol.plans)
    late = section.first_knot * agent.plan.step
    message, = agent.commit(section, late)
    assert len(agent.sol.plans) == plans and message.plan.states(np.array([late + 1]))[0] == pytest.approx(
        agent.state(late + 1))
    agent.step(late)
    assert len(agent.sol.plans) == plans + 1


def test_nothing_is_answered_between_planning_and_commit():
    robots = [robot(index + 1, *poses) for index, poses in enumerate(SWAP)]
    for one in robots:
        one.start([1, 2], 0.0)
    owner, peer = robots
    owner.receive(peer.step(0.0)[0], 0.0)
    section = owner.plan_section(0.1)
    assert not owner.has_answers and owner.answers(0.1) == []
    message = owner.commit(section, 0.15)[1]
    assert isinstance(message, Contracts) and message.offers


def test_a_section_planned_before_a_contract_was_bound_keeps_to_it_when_it_is_committed():
    # Each drives towards the other; the section is planned alone and committed among contracts.
    robots = [robot(index + 1, *poses) for index, poses in enumerate(SWAP)]
    for one in robots:
        one.start([1, 2], 0.0)
    for now, sender, _ in exchange(robots, 12.0):
        bound = sender.protocol.bound
        sender.protocol.bound = lambda: []
        section = sender.plan_section(now + 0.05)
        sender.protocol.bound = bound
        sender.commit(section, now + 0.06)
        assert_contracts_hold(sender, now + 0.06)
        for message in sender.answers(now + 0.06):
            for peer in robots:
                peer.receive(message, now + 0.06)


@pytest.mark.parametrize('angle, is_driven', [(0.0, True), (0.01, False), (1.0, False), (np.pi, False)])
def test_a_section_that_would_set_out_sideways_is_dropped(angle, is_driven):
    agent = robot(1, *SWAP[0])
    agent.start([1], 0.0)
    section = agent.plan_section(0.0)
    way = np.cumsum([0, 0, 0, *np.full(len(section.old) - 6, 0.005), 0, 0, 0])
    new = section.old[0] + way[:, None] * np.array([np.cos(angle), np.sin(angle)])
    agent.commit(replace(section, new=new), 0.0)
    assert (len(agent.sol.plans) == 2) is is_driven


def assert_contracts_hold(agent, now):
    """Check that the plan in force keeps to every contract that binds the robot, from now on and for ever."""
    span = int(np.floor(now / agent.plan.step))
    for contract, is_owner in agent.protocol.bound():
        assert room(contract, agent.plan, max(span, agent.plan.first_knot), is_owner, agent.limits.radius) >= -ROUNDING


def garbage(kind):
    """Return what replaces ``QuadraticProgram.solve``: a solver that gives no good answer, at least now and then."""
    rng, honest = np.random.default_rng(5), qp.QuadraticProgram.solve

    def solve(program, gradient, rows, bounds, *rest):
        count = len(gradient)
        result = honest(program, gradient, rows, bounds, *rest)
        if kind == 'none':
            return qp.QPResult(None, 'infeasible')
        if kind == 'now and then none':
            return result if rng.random() < 0.5 else qp.QPResult(None, 'limit')
        if kind == 'noise':
            return qp.QPResult(rng.normal(size=count) * 10.0**rng.integers(-3, 4), 'solved')
        if kind == 'a little wrong' and result.x is not None:
            return qp.QPResult(result.x + rng.normal(size=count) * 0.01, 'limit')
        if kind == 'without constraints':
            return honest(program, gradient, np.zeros((0, count)), np.zeros(0))
        return qp.QPResult(np.full(count, {'nan': np.nan, 'inf': np.inf, 'huge': 1e300}.get(kind, 0.0)), 'solved')
    return solve


@pytest.mark.parametrize('kind', ['none', 'now and then none', 'noise', 'a little wrong', 'without constraints', 'nan',
                                  'inf', 'huge', 'zero'])
def test_whatever_the_solver_answers_no_contract_and_no_limit_is_broken(monkeypatch, kind):
    pillar = RoundObstacle((5, 3.4), 0.5)
    ways = [*SWAP, ((5, 1, 1.5), (5, 5, 1.5))]
    simulation = mission([robot(index + 1, *poses, obstacles=[pillar]) for index, poses in enumerate(ways)], [pillar])
    monkeypatch.setattr(qp.QuadraticProgram, 'solve', garbage(kind))
    report = simulation.run(seed=1, timeout=6.0)
    assert not simulation.breaches
    assert [violation for violation in report.violations if 'goal' not in violation and 'arrive' not in violation] == []
    assert report.messages > 3 * 6 / 0.25 * 0.8, 'they speak on'


def test_after_bad_answers_of_the_solver_it_drives_on():
    agent, now = under_way()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(qp.QuadraticProgram, 'solve', garbage('nan'))
        for cycle in range(30):
            agent.step(now + cycle * agent.Tc)
    assert not agent.is_done and agent.state(now + 8)[3] == pytest.approx(0, abs=1e-9)
    drive_alone(agent, 30.0, now + 30 * agent.Tc)
    assert agent.is_done


def test_with_osqp_it_arrives_as_well():
    agent = robot(1, (1, 3, 0), (3, 4, 0), solver='osqp')
    drive_alone(agent, 40.0)
    assert agent.is_done
