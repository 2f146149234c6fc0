"""Goals given while running, and pauses: what a robot takes on, refuses, and keeps to meanwhile."""
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from missions import SWAP, exchange, robot
from mobile_planning import GoalOccupied, GoalOutside, InvalidInput, NoPath, PolygonObstacle, RoundObstacle
from mobile_planning.fleet.contracts import ROUNDING, room
from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.message import Mode
from mobile_planning.geometry import wrap_angle

#: A room of its own in the corner that no way leads to.
CELL = [PolygonObstacle([(0, 1.9), (2, 1.9), (2, 2), (0, 2)]), PolygonObstacle([(1.9, 0), (2, 0), (2, 2), (1.9, 2)])]


def drive(agent, now, until):
    """Step a robot without peers until it is done or time is up; return the time."""
    while now < until - 1e-9 and not agent.is_done:
        agent.step(now)
        now += agent.Tc
    return now


def on_its_way(seconds=3.0, obstacles=()):
    agent = robot(1, (1, 3, 0.0), (9, 3, 0.0), obstacles=obstacles)
    agent.start([1], 0.0)
    return agent, drive(agent, 0.0, seconds)


def is_at(agent, now, goal):
    x, y, theta, v, omega = agent.state(now)
    return (np.hypot(x - goal[0], y - goal[1]) <= 0.02 and abs(wrap_angle(theta - goal[2])) <= 0.02
            and v == pytest.approx(0, abs=1e-9) and omega == 0)


# A new goal


@pytest.mark.parametrize('goal', [(9, 5, 1.0), (1, 1, -2.0), (4, 3, 3.0), (3, 3, 0.0)])
def test_a_robot_on_its_way_drives_to_the_new_goal_and_turns_to_its_heading(goal):
    agent, now = on_its_way()
    agent.set_goal(goal, now)
    now = drive(agent, now, 40.0)
    assert agent.is_done and is_at(agent, now, goal) and agent.goal.tolist() == list(map(float, goal))


def test_a_robot_at_its_goal_drives_on_to_the_next_one():
    agent, now = on_its_way(40.0)
    assert agent.is_done
    for goal in [(9, 1, 0.5), (1, 1, 0.5), (1, 1, 2.5)]:
        agent.set_goal(goal, now)
        assert agent.mode is Mode.DRIVING and not agent.is_done
        now = drive(agent, now, now + 40.0)
        assert agent.is_done and is_at(agent, now, goal)


def test_the_peers_hear_of_the_new_goal_with_the_next_message():
    agent, now = on_its_way()
    agent.set_goal((9, 5, 1.0), now)
    assert agent.step(now)[0].goal.tolist() == [9, 5]


def test_a_new_goal_does_not_move_a_robot_that_waits_for_its_mission():
    agent = robot(1, *SWAP[0])
    agent.set_goal((9, 5, 1.0), 0.0)
    for now in np.arange(0.0, 2.0, 0.25):
        agent.step(now)
    assert agent.mode is Mode.WAITING and agent.plan.end.tolist() == [1, 3]


@pytest.mark.parametrize('seconds, mode', [(3.0, Mode.STOPPED), (40.0, Mode.STOPPED)])
def test_a_new_goal_does_not_move_a_robot_that_was_stopped(seconds, mode):
    agent, now = on_its_way(seconds)
    agent.stop()
    agent.set_goal((5, 1, 0.0), now)
    end = agent.plan.end.tolist()
    drive(agent, now, now + 6.0)
    assert agent.plan.end.tolist() == end and agent.mode is mode


def test_progress_counts_anew_from_a_new_goal_on():
    agent, now = on_its_way()
    for _ in range(3):
        agent.set_goal((1, 3, 0.0) if agent.goal[0] > 5 else (9, 3, 0.0), now)
        for _ in range(12):
            agent.step(now)
            now += agent.Tc
        assert agent.step(now)[0].joint.stalled < 1.5


def test_a_joint_plan_to_the_old_goal_is_left():
    # A plan that leads around the room the long way is told by a peer, then the goal changes.
    agents = [robot(1, (1, 3, 0.0), (9, 3, 0.0)), robot(2, (9, 1, np.pi), (9, 5, np.pi))]
    for agent in agents:
        agent.start([1, 2], 0.0)
    for _ in exchange(agents, 2.0):
        pass
    way = np.array([agents[0].plan.end, (9.0, 3.0)])
    agents[0].receive(JointPlan(2, 1, 1, 5, 2, (1, 2), (way, np.array([(9.0, 1.0)])), (((),), ())), 2.0)
    assert agents[0].step(2.0)[0].joint.is_followed
    agents[0].set_goal((1, 1, 0.0), 2.25)
    assert not agents[0].step(2.25)[0].joint.is_followed


@pytest.mark.parametrize('goal, error', [
    ((5, 3, 0.0), GoalOccupied), ((5, 0.1, 0.0), GoalOccupied), ((11, 3, 0.0), GoalOutside),
    ((5, -1e9, 0.0), GoalOutside), ((1e300, 3, 0.0), GoalOutside), ((1, 1, 0.0), NoPath),
    ((np.nan, 3, 0.0), InvalidInput), ((5, 3, np.inf), InvalidInput), ((5, 3), InvalidInput), (None, InvalidInput),
    ('here', InvalidInput)])
def test_a_bad_goal_is_refused_and_the_old_one_stands(goal, error):
    obstacles = [*CELL, RoundObstacle((5, 3), 0.3)]
    agent, now = on_its_way(obstacles=obstacles)
    untouched, _ = on_its_way(obstacles=obstacles)
    with pytest.raises(error):
        agent.set_goal(goal, now)
    for each in (agent, untouched):
        drive(each, now, 40.0)
    assert agent.is_done and is_at(agent, 40.0, (9, 3, 0.0))
    assert [plan.points.tobytes() for plan in agent.sol.plans] == [
        plan.points.tobytes() for plan in untouched.sol.plans]


def test_a_restarted_robot_drives_to_the_newest_goal():
    agent, now = on_its_way()
    agent.set_goal((9, 5, 1.0), now)
    assert agent.restarted(2, agent.plan.end_knot * agent.plan.step).goal.tolist() == [9, 5, 1]


# A pause


@pytest.mark.parametrize('seconds', [0.25, 0.5, 1.0, 3.0, 3.1])
@pytest.mark.parametrize('obstacles, within', [((), 1.5), ((RoundObstacle((5, 3), 0.5),), 3.0)],
                         ids=['open', 'curve'])
def test_a_paused_robot_comes_to_rest_soon_and_goes_on_later(seconds, obstacles, within):
    agent, since = on_its_way(seconds, obstacles)
    agent.pause(since)
    now = drive(agent, since, since + 6.0)
    # From full speed it takes half a second, and the first knots can be changed no more; in a curve, where it could
    # not turn fast enough to brake, it drives on to the end of its plan.
    assert agent.plan.end_knot * agent.plan.step <= since + within
    assert agent.mode is Mode.STOPPED and agent.is_paused and not agent.is_done
    assert np.linalg.norm(agent.state(since + within)[:2] - agent.state(now)[:2]) < 1e-6
    agent.resume(now)
    now = drive(agent, now, now + 40.0)
    assert agent.is_done and is_at(agent, now, (9, 3, 0.0))


def test_a_goal_given_in_a_pause_is_driven_to_after_it():
    agent, now = on_its_way()
    agent.pause(now)
    agent.set_goal((2, 5, 0.0), now)
    now = drive(agent, now, now + 5.0)
    assert not agent.is_done and not is_at(agent, now, (2, 5, 0.0))
    agent.resume(now)
    now = drive(agent, now, now + 40.0)
    assert is_at(agent, now, (2, 5, 0.0))


def test_a_pause_before_the_mission_and_at_the_goal_changes_nothing_but_that():
    agent = robot(1, *SWAP[0])
    agent.pause(0.0)
    agent.start([1], 0.0)
    drive(agent, 0.0, 2.0)
    assert agent.plan.end.tolist() == [1, 3]
    agent.resume(2.0)
    now = drive(agent, 2.0, 40.0)
    agent.pause(now)
    assert agent.is_done and agent.mode is Mode.STOPPED
    agent.resume(now)
    assert agent.is_done and agent.mode is Mode.DONE


def test_peers_drive_past_a_paused_robot_and_it_goes_on_when_resumed():
    agents = [robot(index + 1, *poses) for index, poses in enumerate(SWAP)]
    for agent in agents:
        agent.start([1, 2], 0.0)
    for now, agent, _ in exchange(agents, 60.0):
        if agent is agents[0] and now == 2.0:
            agent.pause(now)
        if agents[1].is_done and agents[0].is_paused:
            assert now < 20.0
            agents[0].resume(now)
        if all(each.is_done for each in agents):
            break
    assert all(agent.is_done for agent in agents)


@settings(max_examples=12, deadline=None)
@given(st.lists(st.tuples(st.integers(0, 40), st.sampled_from(['goal', 'pause', 'resume']), st.integers(0, 1),
                          st.floats(0.5, 9.5), st.floats(0.5, 5.5)), max_size=6))
def test_whatever_is_asked_of_robots_no_contract_is_broken_and_they_stay_apart(requests):
    agents = [robot(index + 1, *poses) for index, poses in enumerate(SWAP)]
    for agent in agents:
        agent.start([1, 2], 0.0)
    asked = sorted(requests)
    for now, agent, _ in exchange(agents, 12.0):
        while asked and asked[0][0] * 0.25 <= now:
            _, what, index, x, y = asked.pop(0)
            if what == 'goal':
                agents[index].set_goal((x, y, 0.0), now)
            else:
                getattr(agents[index], what)(now)
        span = int(now / agent.plan.step)
        for contract, is_owner in agent.protocol.bound():
            if contract.first_span <= span + 2:
                assert room(contract, agent.plan, span, is_owner, agent.limits.radius) >= -2 * ROUNDING
    t = np.linspace(0.0, 12.0, 1201)
    a, b = (agent.sol.states(t)[:, :2] for agent in agents)
    assert np.linalg.norm(a - b, axis=1).min() >= 0.4
