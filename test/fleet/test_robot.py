"""One robot at a time: what it refuses, says and drives, and that its clock may show any time."""
import numpy as np
import pytest
from joint_plans import joint_plan
from missions import ROOM, SWAP, drive_alone, exchange, robot, under_way
from mobile_planning import (
    Boundary, InvalidInput, NoPath, PolygonObstacle, Robot, RobotMsg, RoundObstacle, UnicycleKineModel)
from mobile_planning.fleet.bspline import MAX_POINTS, Plan
from mobile_planning.fleet.message import Mode
from mobile_planning.geometry import wrap_angle

WALL = PolygonObstacle([(4.9, -1), (5.1, -1), (5.1, 7), (4.9, 7)])


def largest_rates(solution):
    """Return the greatest speed, acceleration and turn rate, by differences of the sampled poses alone."""
    t = np.linspace(solution.t[0], solution.end, int(1000 * (solution.end - solution.t[0])) + 1)
    states = solution.states(t)
    velocity = np.diff(states[:, :2], axis=0) / np.diff(t)[:, None]
    acceleration = np.diff(velocity, axis=0) / np.diff(t)[1:, None]
    turn = wrap_angle(np.diff(states[:, 2])) / np.diff(t)
    return (np.linalg.norm(velocity, axis=1).max(), np.linalg.norm(acceleration, axis=1).max(), np.abs(turn).max())


# What is refused


@pytest.mark.parametrize('options, words', [
    ({'method': 'proposals'}, 'known are contracts'), ({'solver': 'simplex'}, 'simplex')])
def test_a_method_or_solver_that_is_not_known_is_refused(options, words):
    with pytest.raises(InvalidInput, match=words):
        robot(1, *SWAP[0], **options)


def test_who_leaves_out_the_method_is_told_where_planning_sim_s_options_belong():
    with pytest.raises(TypeError, match="N_s.*method='receding_horizon'"):
        robot(1, *SWAP[0], N_s=20)


@pytest.mark.parametrize('method', ['contracts', 'receding_horizon'])
@pytest.mark.parametrize('neigh', [[1], [2, 1], ['2'], [2.5]])
def test_a_neighbour_that_is_no_other_robot_is_refused(method, neigh):
    with pytest.raises(InvalidInput, match='neigh of robot 1'):
        robot(1, *SWAP[0], neigh=neigh, method=method)


def test_an_epoch_that_never_was_is_refused():
    with pytest.raises(InvalidInput, match='epoch 0'):
        robot(1, *SWAP[0], epoch=0)


@pytest.mark.parametrize('speeds', [{'u_init': (0.5, 0)}, {'u_final': (0.1, 0)}])
def test_a_robot_that_does_not_start_and_end_at_rest_is_refused(speeds):
    with pytest.raises(InvalidInput, match='from rest to rest'):
        Robot(1, UnicycleKineModel(*SWAP[0], **speeds), [], ROOM)


def test_a_goal_behind_a_wall_is_refused():
    with pytest.raises(NoPath):
        robot(1, *SWAP[0], obstacles=[WALL])


def test_a_robot_with_nowhere_to_look_for_a_path_is_refused():
    with pytest.raises(InvalidInput, match='boundary'):
        robot(1, *SWAP[0], boundary=None)


# What is driven


@pytest.mark.parametrize('start, goal', [
    ((1, 3, 0.0), (9, 3, 0.0)), ((1, 3, np.pi), (9, 5, -1.0)), ((1, 3, 0.0), (1.3, 3, 2.0)),
    ((1, 3, 0.0), (0.5, 3, 0.0)), ((1, 3, 1.0), (1, 3, 1.0)), ((1, 3, 1.0), (1, 3, -2.0)),
    ((1, 3, 1.0), (1.01, 3, 1.0)), ((5, 5.79, 0), (0.21, 0.21, 1))])
def test_a_robot_alone_arrives_and_keeps_its_limits(start, goal):
    agent = robot(1, start, goal)
    now = drive_alone(agent, 40.0)
    assert agent.is_done and agent.mode is Mode.DONE
    x, y, theta, v, omega = agent.state(now)
    assert np.hypot(x - goal[0], y - goal[1]) <= 0.02 and abs(wrap_angle(theta - goal[2])) <= 0.02
    assert v == pytest.approx(0, abs=1e-9) and omega == 0
    if agent.sol.end > 1:
        speed, acceleration, turn = largest_rates(agent.sol)
        assert speed <= 1.0 + 1e-6 and acceleration <= 2.0 + 1e-3 and turn <= 5.0 + 1e-2
    assert (agent.sol.states(agent.sol.t[:1])[0, :3] == pytest.approx(start))


@pytest.mark.parametrize('u_max, a_max', [
    ((0.3, 1.0), (0.5, 10.0)), ((2.0, 6.0), (4.0, 10.0)), ((1.0, 0.5), (1.0, 10.0))])
def test_each_robot_keeps_its_own_limits(u_max, a_max):
    agent = robot(1, (1, 3, np.pi), (9, 4, 1.0), u_max=u_max, a_max=a_max)
    drive_alone(agent, 60.0)
    assert agent.is_done
    speed, acceleration, turn = largest_rates(agent.sol)
    assert speed <= u_max[0] + 1e-6 and acceleration <= a_max[0] + 1e-3 and turn <= u_max[1] + 1e-2


def test_a_sluggish_robot_sets_out_too():
    agent = robot(1, (1, 3, 0.0), (2, 3, 0.0), u_max=(1.0, 5.0), a_max=(0.05, 10.0), Tc=0.1)
    drive_alone(agent, 40.0)
    assert agent.is_done and largest_rates(agent.sol)[1] <= 0.05 + 1e-3


@pytest.mark.parametrize('omega_max', np.pi / np.array([0.5, 0.75, 1.0, 1.25, 1.5, 1.75]))
def test_a_turn_that_takes_a_whole_number_of_spans_is_made(omega_max):
    agent = robot(1, (1, 3, np.pi), (5, 3, 0.0), u_max=(1.0, omega_max))
    drive_alone(agent, 30.0)
    assert agent.is_done and largest_rates(agent.sol)[2] <= omega_max + 1e-2


def test_a_robot_that_needs_longer_than_a_plan_to_turn_turns_first_and_arrives():
    # To turn around takes 6.3 s, a plan lasts 3 s.
    agent = robot(1, (1, 3, np.pi), (9, 3, 0.0), u_max=(1.0, 0.5))
    drive_alone(agent, 40.0)
    assert agent.is_done


def test_a_turn_at_the_goal_that_fills_many_plans_is_made():
    agent = robot(1, (5, 3, 0.0), (5, 3, 3.0), u_max=(1.0, 0.2), Tc=0.05, Tp=2.0)
    drive_alone(agent, 40.0)
    assert agent.is_done
    assert largest_rates(agent.sol)[2] <= 0.2 + 1e-3


@pytest.mark.parametrize('Tc, Tp', [(0.05, 1.0), (0.1, 3.0), (0.5, 4.0), (1.0, 8.0)])
def test_a_robot_arrives_with_any_cycle(Tc, Tp):
    agent = robot(1, *SWAP[0], Tc=Tc, Tp=Tp)
    drive_alone(agent, 40.0)
    assert agent.is_done


def test_the_body_fits_through_a_door_a_little_wider_than_itself():
    walls = [PolygonObstacle([(4.9, -1), (5.1, -1), (5.1, 2.7), (4.9, 2.7)]),
             PolygonObstacle([(4.9, 3.3), (5.1, 3.3), (5.1, 7), (4.9, 7)])]
    agent = robot(1, *SWAP[0], obstacles=walls)
    drive_alone(agent, 40.0)
    assert agent.is_done


def test_a_robot_waits_for_the_start_of_the_mission():
    agent = robot(1, *SWAP[0])
    agent.start([1], 5.0)
    for cycle in range(20):
        agent.step(0.25 * cycle)
        assert agent.mode is Mode.WAITING and len(agent.sol.plans) == 1
    agent.step(5.0)
    assert agent.mode is Mode.DRIVING and len(agent.sol.plans) == 2


def test_without_a_mission_a_robot_stays_and_speaks():
    agent = robot(1, *SWAP[0])
    messages = [agent.step(0.25 * cycle)[0] for cycle in range(8)]
    assert [message.sequence for message in messages] == list(range(1, 9))
    assert not any(message.dp or np.ptp(message.plan.points, axis=0).any() for message in messages)


# What is said


def test_a_message_says_where_the_robot_is_and_how_it_goes_on():
    agent = robot(4, *SWAP[0], epoch=7, margin=0.01)
    agent.start([4], 0.0)
    for now in np.arange(0, 3, 0.25):
        message, = agent.step(now)
        assert isinstance(message, RobotMsg) and message.robot_id == 4 and message.boot_epoch == 7
        assert message.radius == pytest.approx(0.21) and message.goal == pytest.approx((9, 3))
        assert message.lz == pytest.approx(agent.state(now)[:2])
        t = now + np.linspace(0, 6, 61)
        assert message.plan.states(t)[:, :3] == pytest.approx(agent.sol.states(t)[:, :3], abs=1e-9)
        knots = np.arange(message.plan.first_knot, message.plan.end_knot + 1) * message.plan.step
        assert np.column_stack([message.ip_z1, message.ip_z2]) == pytest.approx(message.plan.states(knots)[:, :2])


def test_done_is_said_when_the_robot_is_at_its_goal_and_at_rest():
    agent = robot(1, (1, 3, 0), (2, 3, 0))
    agent.start([1], 0.0)
    for now in np.arange(0, 10, 0.25):
        message, = agent.step(now)
        at_goal = np.hypot(*(agent.state(now)[:2] - (2, 3))) < 0.02 and agent.state(now)[3] < 1e-9
        assert message.dp <= at_goal
    assert message.dp and message.mode is Mode.DONE


def test_what_peers_hear_is_what_is_driven():
    robots = [robot(1, (1, 1, 0), (9, 1, 0)), robot(2, (1, 5, 0), (9, 5, 0))]
    for one in robots:
        one.start([1, 2], 0.0)
    for now, sender, messages in exchange(robots, 12.0, delivers=lambda now: not 2.0 < now < 4.0):
        t = now + np.linspace(0, 8, 81)
        assert messages[0].plan.states(t)[:, :2] == pytest.approx(sender.sol.states(t)[:, :2], abs=1e-9)
    assert all(one.is_done for one in robots)


def test_all_numbers_of_messages_grow_in_the_order_in_which_they_are_sent():
    robots = [robot(index + 1, *poses) for index, poses in enumerate(SWAP)]
    for one in robots:
        one.start([1, 2], 0.0)
    said = {1: [], 2: []}
    for _, sender, messages in exchange(robots, 4.0):
        said[sender.eyed] += [message.sequence for message in messages]
    assert all(numbers == sorted(set(numbers)) for numbers in said.values())


@pytest.mark.parametrize('since', [0.0, 1.8e9 + 0.1])
def test_a_cycle_at_the_preferred_phase_is_just_in_time_for_a_knot(since):
    agent = robot(1, *SWAP[0], start_time=since, budget=0.08)
    assert 0 <= agent.phase < agent.Tc
    agent.start([1], since)
    now = np.ceil(since / agent.Tc) * agent.Tc + agent.phase
    section = agent.plan_section(now)
    left = section.first_knot * agent.plan.step - now
    assert 0.08 <= left <= 0.085


@pytest.mark.parametrize('options, knots', [({}, 1), ({'Tc': 0.5}, 1), ({'budget': 0.12}, 1), ({'budget': 0.125}, 2),
                                            ({'Tc': 0.1}, 2)])
def test_a_robot_with_moves_of_a_joint_plan_ahead_plans_for_each_knot_that_leaves_it_its_budget(options, knots):
    agent = robot(1, (1, 3, 0.0), (3, 3, 0.0), **options)
    agent.start([1], 0.0)
    assert agent.cycle == agent.Tc
    now = agent.phase
    agent.propose(joint_plan(members=(1,), ways=([(1, 3), (3, 3)],), needs=(((),),)), now)
    planned_for = []
    while now < 12.0 and not agent.is_done:
        section = agent.plan_section(now)
        assert section.first_knot * agent.plan.step - now >= agent.options.budget
        planned_for.append(section.first_knot)
        agent.commit(section, now)
        now += agent.until_cycle(now)
    assert agent.is_done and agent.cycle == agent.Tc
    assert set(np.diff(planned_for[:8])) == {knots}


@pytest.mark.parametrize('options', [{'Tc': 0.02, 'Tp': 1.0, 'budget': 0.2}, {'Tc': 0.1, 'Tp': 5.0}])
def test_the_longest_plan_fits_into_a_message(options):
    agent = robot(1, (1, 3, 0), (9, 3, 2), u_max=(1.0, 0.5), **options)
    agent.start([1], 0.0)
    longest = 0
    for cycle in range(30):
        message, = agent.step(cycle * agent.Tc)
        longest = max(longest, len(message.plan.points))
    assert 100 < longest <= MAX_POINTS


def test_a_robot_whose_way_is_lost_stands_and_speaks_on(monkeypatch):
    agent = robot(1, *SWAP[0])
    agent.start([1], 0.0)
    monkeypatch.setattr(agent._course.guidance, 'path', lambda *_: (_ for _ in ()).throw(NoPath('the way is lost')))
    for now in (0.0, 0.25, 0.5):
        assert len(agent.step(now)) == 1
    assert len(agent.sol.plans) == 1


# What is heard


def test_messages_that_do_not_count_are_ignored_and_counted():
    agent, peer = robot(1, *SWAP[0]), robot(2, *SWAP[1])
    agent.start([1, 2], 0.0)
    word = peer.step(0.0)[0]
    assert agent.receive(word, 0.0) and not agent.receive(word, 0.1)
    own = agent.step(0.0)[0]
    assert not agent.receive(own, 0.1)
    stranger = robot(9, *SWAP[1]).step(0.0)[0]
    assert not agent.receive(stranger, 0.1)
    assert agent.ignored == 3 and list(agent.heard()) == [2]


def test_a_robot_does_not_move_before_it_has_an_agreement_with_all():
    one, two = robot(1, *SWAP[0]), robot(2, (9, 5, 0), (1, 5, 0))
    one.start([1, 2, 3], 0.0)
    two.start([1, 2, 3], 0.0)
    list(exchange([one, two], 6.0))
    assert len(one.sol.plans) == len(two.sol.plans) == 1


def test_a_stopped_robot_comes_to_rest_and_stays():
    agent = robot(1, *SWAP[0])
    agent.start([1], 0.0)
    for now in np.arange(0, 3, 0.25):
        agent.step(now)
    agent.stop()
    end = agent.plan.end
    for now in np.arange(3, 9, 0.25):
        message, = agent.step(now)
        assert message.mode is Mode.STOPPED and message.plan.end == pytest.approx(end)
    assert agent.state(9.0)[:2] == pytest.approx(end) and agent.state(9.0)[3] == pytest.approx(0, abs=1e-9)
    assert not agent.is_done


def test_a_stopped_robot_still_makes_room_for_others_by_its_contracts():
    one, two = robot(1, (1, 5, 0), (9, 5, 0)), robot(2, *SWAP[0])
    for agent in (one, two):
        agent.start([1, 2], 0.0)
    two.stop()
    list(exchange([one, two], 14.0))
    assert one.is_done and not two.is_done


# Backwards


def test_a_robot_that_may_reverse_backs_up_to_a_goal_behind_it():
    agent = robot(1, (5, 3, 0.0), (4, 3, 0.0), reverse=True)
    drive_alone(agent, 20.0)
    states = agent.sol.states(agent.sol.t)
    assert agent.is_done and states[:, 3].min() < -0.5 and states[:, 3].max() < 1e-9
    assert np.abs(wrap_angle(states[:, 2])).max() < 0.05
    assert largest_rates(agent.sol)[2] <= 5.0 + 1e-2


@pytest.mark.parametrize('heading', [0.3, 1.3, 2.0, 3.0])
def test_a_robot_that_may_reverse_keeps_its_limits_and_its_heading_never_jumps(heading):
    agent = robot(1, (1, 3, heading), (9, 4, 1.0), reverse=True, obstacles=[RoundObstacle((5, 3), 0.6)])
    drive_alone(agent, 40.0)
    speed, acceleration, turn = largest_rates(agent.sol)
    assert agent.is_done and speed <= 1.0 + 1e-6 and acceleration <= 2.0 + 1e-3 and turn <= 5.0 + 1e-2


# A process that is started again


def test_a_restarted_robot_is_another_one_where_the_body_rests():
    agent, now = under_way()
    end = agent.plan.end_knot * agent.plan.step
    other = agent.restarted(2, end + 1)
    assert other.state(end + 1) == pytest.approx([*agent.plan.end, agent.state(end)[2], 0, 0], abs=1e-9)
    assert other.protocol.epoch == 2 and other.mode is Mode.WAITING and not other.heard()
    assert (other.limits, other.Tc) == (agent.limits, agent.Tc)
    assert (other.k_mod.q_final == agent.k_mod.q_final).all()
    drive_alone(other, 30.0, end + 1)
    assert other.is_done


def test_a_restarted_robot_keeps_its_options():
    agent = robot(1, *SWAP[0], rho=0.3, margin=0.02, Tc=0.5, Tp=4.0, reverse=True, sensor_range=40.0)
    other = agent.restarted(3, 1.0)
    assert (other.rho, other.limits.radius, other.Tc, other.sensor_range) == (0.3, 0.32, 0.5, 40.0)
    assert other.plan.step == agent.plan.step and other.options.reverse


# Any clock


@pytest.mark.parametrize('since', [1.8e9, 1.8e9 + 0.1234567, -1000.0])
def test_a_mission_at_another_time_is_the_same_mission(since):
    def drive(start):
        agent = robot(1, (1, 3, 1.0), (9, 4, -2.0), start_time=start,
                      obstacles=[RoundObstacle((5, 3), 0.6)])
        drive_alone(agent, 40.0, since=np.ceil(start * 4) / 4)
        assert agent.is_done
        return agent.sol
    early, late = drive(0.0), drive(since)
    shift = 2 * int(np.ceil(since * 4))
    assert [plan.first_knot + shift for plan in early.plans][1:] == [plan.first_knot for plan in late.plans][1:]
    for before, after in zip(early.plans, late.plans):
        assert (before.points == after.points).all()
        assert before.heading == pytest.approx(after.heading, abs=1e-6)


def test_the_solution_is_sampled_from_switch_on_to_rest():
    agent = robot(1, *SWAP[0])
    drive_alone(agent, 30.0)
    solution = agent.sol
    assert solution.t[0] == 0 and solution.t[-1] == pytest.approx(solution.end) and np.diff(solution.t).max() < 0.0101
    assert len(solution.x) == len(solution.y) == len(solution.theta) == len(solution.v) == len(solution.omega)
    assert (solution.x[-1], solution.y[-1]) == pytest.approx((9, 3), abs=0.02)
    assert len(agent.ctime) == len(solution.section_times) > 0


def test_the_boundary_is_kept_by_the_body_not_by_its_centre():
    agent = robot(1, (1, 0.3, 0), (9, 0.3, 0), boundary=Boundary((0, 10), (0, 1)))
    drive_alone(agent, 30.0)
    assert agent.is_done and agent.sol.y.min() >= 0.205 - 1e-6


@pytest.mark.parametrize('start, goal', [
    ((0.2011, 3, 0), (9, 5.7989, 0)), ((0.2, 3, 0), (9, 5.8, 0)), ((1, 0.2, 0), (9, 0.2, 0)),
    ((9.8, 0.2, 2), (0.2, 5.8, 1))])
def test_a_robot_with_hardly_any_room_at_start_and_goal_arrives(start, goal):
    agent = robot(1, start, goal, margin=0.0)
    drive_alone(agent, 40.0)
    assert agent.is_done


def test_the_seed_s_names_are_there():
    agent = Robot(3, UnicycleKineModel((1, 3, 0), (9, 3, 0)), [], ROOM, [1, 2], rho=0.3, Tc=0.5, Tp=4.0)
    assert agent.eyed == 3 and agent.rho == 0.3 and agent.neigh == (1, 2) and agent.k_mod.q_final[0] == 9
    assert isinstance(agent.plan, Plan)
