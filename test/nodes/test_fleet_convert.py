"""The fleet's messages into core objects and back; on the way they are serialised, so a wrong number would show."""
from array import array

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mobile_planning_msgs.msg import Contracts as ContractsMessage
from mobile_planning_msgs.msg import JointPlan as JointPlanMessage
from mobile_planning_msgs.msg import Mission, MissionReport, ObstacleArray
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from nav_msgs.msg import Odometry
from over_the_wire import sent
from visualization_msgs.msg import Marker, MarkerArray

from mobile_planning.errors import InvalidInput, LimitExceeded, UnknownFrame
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import MAX_SPANS, Contract
from mobile_planning.fleet.hold_up import HoldUp, Reason
from mobile_planning.fleet.joint_message import JointPlan, JointStatus
from mobile_planning.fleet.message import MAX_LINKS, Contracts, Death, Link, LinkMode, Mode, Offer, RobotMsg
from mobile_planning.fleet.postscript import Postscript
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.tether import Tether
from mobile_planning.fleet.verification import Body, Report
from mobile_planning.nodes import (
    convert_contracts,
    convert_joint_plan,
    convert_mission,
    convert_obstacles,
    convert_robot,
    convert_views,
    wire,
)
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle

uint32 = st.integers(0, 2**32 - 1)
places = st.floats(-1e6, 1e6, width=32)
angles = st.floats(-4, 4)
knots = st.integers(-2**48, 2**48)


@st.composite
def plans(draw, step=0.25, size=st.integers(1, 126)):
    """Draw a plan of 4 to 128 points that ends at rest."""
    count = max(2, draw(size))
    seed, scale = draw(st.integers(0, 2**32 - 1)), draw(st.sampled_from([1e-3, 1.0, 1e6]))
    points = np.random.default_rng(seed).uniform(-scale, scale, (count, 2))
    return Plan(draw(knots), step, np.concatenate([points, points[-1:], points[-1:]]), draw(angles),
                draw(angles | st.just(np.nan)), draw(st.booleans()))


links = st.dictionaries(uint32, st.builds(Link, uint32, st.sampled_from(LinkMode), uint32, uint32,
                                          st.integers(-1, 2**32 - 1)), max_size=20)


@st.composite
def offers(draw):
    """Draw a contract of 1 to 256 lines that is offered to somebody."""
    rng, spans = np.random.default_rng(draw(uint32)), draw(st.sampled_from([1, 2, 24, MAX_SPANS]))
    angles = rng.uniform(-np.pi, np.pi, spans)
    contract = Contract(draw(st.integers(1, 2**32 - 1)), draw(knots), np.column_stack([np.cos(angles), np.sin(angles)]),
                        rng.uniform(-1e6, 1e6, (spans, 4)),
                        draw(st.none() | st.just(Tether(3.5, rng.uniform(-1e6, 1e6, (spans, 4, 2))))))
    return Offer(draw(uint32), draw(uint32), draw(uint32), contract)


@st.composite
def robot_msgs(draw):
    """Draw anything that a robot may say."""
    step, count = draw(st.sampled_from([0.05, 0.25, 5])), draw(st.integers(0, 128))
    path = np.random.default_rng(count).uniform(-10, 10, (2, count))
    return RobotMsg(
        draw(st.booleans()), *path, np.array([draw(places), draw(places)]), robot_id=draw(uint32),
        boot_epoch=draw(uint32), sequence=draw(uint32), mode=draw(st.sampled_from(Mode)), plan=draw(plans(step)),
        plan_seq=draw(uint32),
        radius=draw(st.sampled_from([1, 0.2, 100])), v_max=draw(st.sampled_from([2, 0.5])), omega_max=3, a_max=4,
        goal=np.array([draw(places), draw(places)]),
        links=draw(links), joint=JointStatus(
            draw(uint32), draw(uint32), draw(st.booleans()), draw(st.dictionaries(uint32, uint32, max_size=5)),
            draw(st.floats(0, 1e6)), draw(st.booleans())))


def same_plan(one, other):
    """Return whether two plans are the same to the last bit."""
    return (one.first_knot == other.first_knot and one.step == other.step and np.array_equal(one.points, other.points)
            and one.reverse is other.reverse
            and np.array_equal([one.heading, one.final_heading], [other.heading, other.final_heading], equal_nan=True))


@given(robot_msgs())
def test_what_a_robot_says_arrives_as_it_was(message):
    received = convert_robot.robot_msg(sent(convert_robot.robot_message(message, 12.5, 'map')), 'map')
    fields, others = vars(message), vars(received)
    assert same_plan(message.plan, received.plan)
    for name in ('dp', 'robot_id', 'boot_epoch', 'sequence', 'mode', 'plan_seq', 'radius', 'v_max', 'omega_max',
                 'a_max', 'links', 'joint'):
        assert fields[name] == others[name]
    for name in 'ip_z1', 'ip_z2', 'lz', 'goal':
        assert np.array_equal(fields[name], others[name])


@given(robot_msgs(), st.data())
def test_of_the_links_of_a_robot_only_those_asked_for_and_that_with_itself_are_looked_at(message, data):
    asked = set(data.draw(st.lists(st.sampled_from([*message.links, message.robot_id, 2**32 - 1]))))
    written = sent(convert_robot.robot_message(message, 12.5, 'map'))
    received = convert_robot.robot_msg(written, 'map', to=asked)
    known = asked | {message.robot_id}
    assert received.links == {peer: link for peer, link in message.links.items() if peer in known}
    assert received.method == message.method


peers = st.lists(st.integers(0, 2**32 - 1), max_size=4).map(tuple)


@given(links, st.data(), peers, st.none() | st.builds(HoldUp, st.floats(0, 9), st.sampled_from(Reason), peers),
       st.booleans())
def test_a_postscript_arrives_as_it_was(entries, data, without_word_of, held_up, is_where_left):
    plan = Plan(0, 1, [[1, 2]] * 4, 1, 2)
    lags = {peer: data.draw(st.floats(-10, 10)) for peer in entries if data.draw(st.booleans())}
    message = convert_robot.robot_message(RobotMsg(False, [1], [2], [3, 4], plan=plan, links=entries), 7, 'map',
                                          Postscript(1.8e9, 3, lags, without_word_of, held_up, is_where_left))
    received = convert_robot.postscript(sent(message))
    assert (received.without_word_of, received.held_up is None) == (without_word_of, held_up is None)
    assert received.is_where_left is is_where_left
    assert held_up is None or (received.held_up.reason, received.held_up.for_robots) == (
        held_up.reason, held_up.for_robots)
    assert (received.mission_start, received.goals_reached, set(received.lags)) == (1.8e9, 3, set(entries))
    assert {peer: lag for peer, lag in received.lags.items() if not np.isnan(lag)} == lags
    message.lag.append(0.0)
    with pytest.raises(InvalidInput, match='lags'):
        convert_robot.postscript(message)
    message.lag.pop()
    message.held_up = 9
    with pytest.raises(InvalidInput, match='held_up 9'):
        convert_robot.postscript(message)


coordinates = st.floats(-1e3, 1e3)


@given(st.lists(st.builds(RoundObstacle, st.tuples(coordinates, coordinates), st.floats(0, 9)), max_size=4),
       st.integers(0, 3))
def test_obstacles_arrive_as_they_were(discs, count):
    polygons = [PolygonObstacle([(k, 0), (k + 0.5, 0), (k + 0.5, 1 + k), (k, 1)][:3 + k % 2]) for k in range(count)]
    received = convert_mission.obstacles(sent(convert_obstacles.obstacles_message(discs + polygons, 1, 'map')), 'map')
    assert list(map(repr, received)) == list(map(repr, discs + polygons))


def test_robots_prove_their_ways_among_obstacles_that_stand():
    message = convert_obstacles.obstacles_message([RoundObstacle((1, 2), 0.5)], 1, 'map')
    message.velocities = [0.5, 0.0]
    with pytest.raises(InvalidInput, match='1 of the obstacles move'):
        convert_mission.obstacles(message, 'map')


@pytest.mark.parametrize('fields, error', [
    ({'discs': [1.0]}, InvalidInput), ({'discs': [0.0, 0.0, -1.0]}, InvalidInput),
    ({'discs': [0.0, float('nan'), 1.0]}, InvalidInput), ({'corners': [3]}, InvalidInput),
    ({'corners': [2], 'polygons': [0.0, 0.0, 1.0, 1.0]}, InvalidInput), ({'corners': [0]}, InvalidInput),
    ({'polygons': [0.0, 0.0]}, InvalidInput), ({'discs': [0.0] * 3 * 1001}, LimitExceeded)])
def test_obstacles_that_make_no_sense_are_refused(fields, error):
    message = ObstacleArray(**fields)
    message.header.frame_id = 'map'
    with pytest.raises(error):
        convert_mission.obstacles(message, 'map')


@given(st.lists(st.builds(Death, uint32, uint32, st.tuples(coordinates, coordinates), st.floats(0, 2**31 - 2),
                          st.floats(0.01, 9)), max_size=4))
def test_certificates_of_death_arrive_as_they_were(certificates):
    received = convert_mission.deaths(sent(convert_mission.deaths_message(certificates, 1, 'map')), 'map')
    assert len(received) == len(certificates)
    for one, other in zip(certificates, received):
        assert (one.robot_id, one.boot_epoch, one.radius) == (other.robot_id, other.boot_epoch, other.radius)
        assert np.array_equal(one.place, other.place) and other.issued == pytest.approx(one.issued, abs=1e-6)


@pytest.mark.parametrize('fields', [
    {'robot_id': [1, 2]}, {'place': [1.0, float('nan')]}, {'radius': [0.0]}, {'boot_epoch': []}, {'issued': []},
    {'place': [1.0]}])
def test_certificates_of_death_that_make_no_sense_are_refused(fields):
    message = convert_mission.deaths_message([Death(1, 2, (3, 4), 5.0, 0.2)], 1, 'map')
    convert_mission.deaths(message, 'map')
    for field, value in fields.items():
        setattr(message, field, value)
    with pytest.raises(InvalidInput):
        convert_mission.deaths(message, 'map')


@settings(max_examples=50)
@given(uint32, uint32, uint32, st.lists(offers(), max_size=4), links)
def test_offers_and_answers_arrive_as_they_were(robot_id, epoch, sequence, offered, answers):
    message = Contracts(robot_id, epoch, sequence, tuple(offered), answers)
    received = convert_contracts.contracts(sent(convert_contracts.contracts_message(message, 12.5, 'map')), 'map')
    assert (received.robot_id, received.boot_epoch, received.sequence) == (robot_id, epoch, sequence)
    assert received.answers == answers and len(received.offers) == len(offered)
    for one, other in zip(offered, received.offers):
        for name in 'peer_id', 'peer_epoch', 'base_sequence':
            assert getattr(one, name) == getattr(other, name)
        assert (one.contract.id, one.contract.first_span) == (other.contract.id, other.contract.first_span)
        assert np.array_equal(one.contract.normals, other.contract.normals)
        assert np.array_equal(one.contract.offsets, other.contract.offsets)
        tethers = one.contract.tether, other.contract.tether
        assert (tethers == (None, None) or tethers[0].reach == tethers[1].reach
                and np.array_equal(tethers[0].middles, tethers[1].middles))


@st.composite
def joint_plans(draw):
    """Draw the ways of 1 to 5 robots, and for each move for which moves of the others it waits."""
    members, rng = draw(st.lists(uint32, min_size=1, max_size=5, unique=True)), np.random.default_rng(draw(uint32))
    moves = rng.integers(0, 6, len(members)) * rng.integers(0, 2, len(members))
    others = [[(other, int(rng.integers(1, count + 1))) for other, count in zip(members, moves)
               if other != member and count] for member in members]
    needs = [tuple(tuple(pair for pair in pairs if rng.random() < 0.4) for _ in range(count))
             for pairs, count in zip(others, moves)]
    return JointPlan(draw(uint32), draw(uint32), draw(uint32), draw(st.integers(1, 2**32 - 1)), members[0],
                     tuple(members), tuple(rng.uniform(-9, 9, (count + 1, 2)) for count in moves), tuple(needs))


@given(joint_plans())
def test_a_joint_plan_arrives_as_it_was(plan):
    received = convert_joint_plan.joint_plan(sent(convert_joint_plan.joint_plan_message(plan, 12.5, 'map')), 'map')
    for name in 'robot_id', 'boot_epoch', 'sequence', 'epoch', 'proposer', 'members', 'needs':
        assert getattr(received, name) == getattr(plan, name)
    assert all(map(np.array_equal, received.ways, plan.ways)) and len(received.ways) == len(plan.ways)


@given(uint32, uint32, st.booleans(), st.lists(plans(0.5, st.integers(1, 20)), min_size=1, max_size=8),
       st.lists(st.floats(0, 10)), st.lists(st.floats(-10, 1e9)), st.lists(st.tuples(*[st.floats(-9, 9)] * 3)))
def test_a_solution_arrives_as_it_was(robot_id, epoch, done, driven, times, commits, goals):
    solution = Solution(robot_id, tuple(driven), done, tuple(times), commits=tuple(commits), goals=tuple(goals))
    message = sent(convert_mission.solution_message(solution, epoch, 1.0, 'hall'))
    received = convert_mission.solution(message, 'hall')
    assert message.boot_epoch == epoch and (received.eyed, received.done) == (robot_id, done)
    assert received.section_times == tuple(times) and received.commits == tuple(commits)
    assert len(received.plans) == len(driven)
    assert all(map(same_plan, received.plans, solution.plans))
    assert [tuple(goal) for goal in received.goals] == goals


@given(st.text(st.characters(codec='ascii', exclude_characters='\0')), st.sampled_from(State),
       st.lists(uint32, min_size=1, max_size=256, unique=True), st.floats(0, 2**31 - 2), st.integers(0, 3))
def test_an_announcement_arrives_as_it_was(name, state, robot_ids, start, count):
    announcement = Announcement(name, state, tuple(robot_ids), start, tuple(robot_ids[:count]))
    received = convert_mission.announcement(sent(convert_mission.mission_message(announcement, 3)))
    assert (received.name, received.state, received.robot_ids) == (name, state, tuple(robot_ids))
    assert received.left_out == announcement.left_out
    assert received.start == pytest.approx(start, abs=1e-6)


@given(st.floats(0, 2**31 - 2))
def test_a_time_is_a_valid_stamp_within_its_rounding(time):
    stamp = wire.stamp(time)
    assert 0 <= stamp.nanosec < 10**9
    assert abs(stamp.sec + stamp.nanosec * 1e-9 - time) <= 1e-9 + np.spacing(time)


def test_whole_numbers_arrive_as_the_same_numbers():
    plan = Plan(0, 1, [[1, 2]] * 4, 1, 2)
    message = RobotMsg(False, [1], [2], [3, 4], plan=plan, radius=1, v_max=2, omega_max=3, a_max=4, goal=[5, 6])
    received = sent(convert_robot.robot_message(message, 7, 'map', Postscript(8, 9)))
    assert [received.radius, received.v_max, received.omega_max, received.a_max, received.step] == [1, 2, 3, 4, 1]
    assert list(received.control_points) == [1, 2] * 4 and list(received.goal) == [5, 6]
    assert received.header.stamp.sec == 7 and received.heading == 1
    assert (received.mission_start.sec, received.goals_reached) == (8, 9)
    odometry = sent(convert_views.odometry(np.array([1, 2, 0, 3, 4]), 5, 'map', 'base'))
    assert (odometry.pose.pose.position.x, odometry.twist.twist.linear.x, odometry.twist.twist.angular.z) == (1, 3, 4)
    report = sent(convert_mission.report_message(Report('m', True, 2, (1, 2), np.inf, 1, 9), 4))
    assert isinstance(report, MissionReport) and report.min_separation == np.inf and report.mission_time == 9
    assert np.isnan(report.lower_bound) and (report.messages, report.dead, len(report.section_times)) == (0, 0, 0)
    report = sent(convert_mission.report_message(Report('m', True, 2, (1, 2), 1, 1, 9, lower_bound=6,
                                                        section_times=(1, 2), messages=7, message_bytes=8, dead=1), 4))
    assert (report.lower_bound, report.messages, report.message_bytes, report.dead) == (6, 7, 8, 1)
    assert list(report.section_times) == [1, 2]


def good_robot_message():
    """Return a message with two links."""
    plan = Plan(4, 0.25, [[1.0, 2.0]] * 5)
    links = {2: Link(5, LinkMode.CON, 7), 3: Link()}
    return convert_robot.robot_message(
        RobotMsg(False, [1.0, 1.0], [2.0, 2.0], [1.0, 2.0], robot_id=1, plan=plan, links=links), 1.0, 'map')


def good_contracts_message():
    """Return a message with two offers, of 2 lines and of 1, and two answers."""
    offered = [Offer(peer, 5, 9, Contract(3, 40, [[1.0, 0.0]] * count, np.zeros((count, 4))))
               for peer, count in ((2, 2), (3, 1))]
    answers = {2: Link(5), 4: Link(6)}
    return convert_contracts.contracts_message(Contracts(1, 5, 8, tuple(offered), answers), 1.0, 'map')


def doubles(*values):
    """Return an array as messages hold it."""
    return array('d', values)


NAN, INF = float('nan'), float('inf')


@pytest.mark.parametrize('field, value, words', [
    ('version', 4, 'version 4, not 5'), ('version', 0, 'version 0'), ('mode', 4, 'mode 4'),
    ('control_points', doubles(), '0 numbers'), ('control_points', doubles(*[1.0] * 7), '7 numbers'),
    ('control_points', doubles(*[1.0] * 9), '9 numbers'), ('control_points', doubles(*[1.0] * 6), '6 numbers'),
    ('control_points', doubles(*[1.0] * 258), '258 numbers'),
    ('control_points', doubles(*[1.0] * 10**6), '1000000 numbers'),
    ('control_points', doubles(*[NAN] * 8), 'finite'), ('control_points', doubles(*[1e7] * 8), 'within'),
    ('control_points', doubles(*range(8)), 'at rest'),
    ('first_knot', -2**63, 'no time'), ('first_knot', 2**63 - 1, 'no time'),
    ('step', 0.0, 'step'), ('step', NAN, 'step'), ('step', -1.0, 'step'), ('heading', NAN, 'heading'),
    ('final_heading', INF, 'heading'), ('radius', 0.0, 'radius'), ('radius', NAN, 'radius'), ('v_max', -1.0, 'v_max'),
    ('omega_max', INF, 'omega_max'), ('a_max', NAN, 'a_max'), ('goal', np.array([NAN, 0.0]), 'goal'),
    ('latest_z', np.array([INF, 0.0]), 'lz'), ('intended_path_z1', doubles(1.0), 'intended_path_z1 has 1'),
    ('intended_path_z1', doubles(*[0.0] * 10**6), 'more than 128'), ('intended_path_z2', doubles(NAN, NAN), 'ip_z2'),
    ('peer', array('I', [2]), 'arrays of the links'), ('promised', array('I'), 'arrays of the links'),
    ('granted', array('q', range(10**6)), 'arrays of the links'), ('granted', array('q', [-2, 0]), 'granted'),
    ('joint_member', array('I', [1]), 'joint_member'), ('joint_member', array('I', range(10**6)), 'joint_member'),
    ('stalled', NAN, 'stalled'), ('stalled', -1.0, 'stalled'), ('link_mode', array('B', [4, 0]), 'mode 4'),
    ('peer', array('I', [2, 2]), 'two links')])
def test_a_message_that_makes_no_sense_is_refused_with_a_sentence(field, value, words):
    message = good_robot_message()
    convert_robot.robot_msg(message, 'map')
    setattr(message, field, value)
    with pytest.raises(InvalidInput, match=words):
        convert_robot.robot_msg(message, 'map')


def test_more_links_than_there_are_robots_are_refused():
    message, many = good_robot_message(), array('I', range(MAX_LINKS + 1))
    message.peer = message.peer_epoch = message.contract = message.promised = many
    message.link_mode, message.granted = array('B', bytes(len(many))), array('q', many)
    with pytest.raises(InvalidInput, match='links'):
        convert_robot.robot_msg(message, 'map')


@pytest.mark.parametrize('frame', ['', 'odom', '/map', 'x' * 10**6])
def test_another_frame_is_refused(frame):
    message = good_robot_message()
    message.header.frame_id = frame
    with pytest.raises(UnknownFrame) as refusal:
        convert_robot.robot_msg(message, 'map')
    assert len(str(refusal.value)) < 200
    with pytest.raises(UnknownFrame):
        convert_mission.solution(SolutionMessage(header=message.header), 'map')
    with pytest.raises(UnknownFrame):
        convert_contracts.contracts(ContractsMessage(header=message.header, version=2), 'map')
    with pytest.raises(UnknownFrame):
        convert_joint_plan.joint_plan(JointPlanMessage(header=message.header, version=1), 'map')


@pytest.mark.parametrize('fields, words', [
    ({'version': 1}, 'version 1, not 2'), ({'version': 0}, 'version 0'), ({'reach': doubles(3.0)}, 'arrays of the'),
    ({'reach': doubles(3.0, 0.0)}, 'for its middles'), ({'middles': doubles(*[0.0] * 10**6)}, 'for its middles'),
    ({'reach': doubles(0.0, -1.0), 'middles': doubles(*[0.0] * 8)}, 'reach'),
    ({'reach': doubles(0.0, NAN), 'middles': doubles(*[0.0] * 8)}, 'reach'),
    ({'reach': doubles(0.0, 3.0), 'middles': doubles(*[NAN] * 8)}, 'middles must'),
    ({'spans': array('H', [2])}, 'arrays of the offers'), ({'peer': array('I', range(10**6))}, 'arrays of the offers'),
    ({'first_span': array('q')}, 'arrays of the offers'), ({'spans': array('H', [3, 1])}, 'for its lines'),
    ({'spans': array('H', [65535, 65535])}, 'for its lines'), ({'spans': array('H', [3, 0])}, 'L from 1'),
    ({'normals': doubles()}, 'for its lines'), ({'normals': doubles(*[0.0] * 10**6)}, 'for its lines'),
    ({'offsets': doubles(*[0.0] * 11)}, 'for its lines'), ({'normals': doubles(*[0.0] * 6)}, 'length 1'),
    ({'normals': doubles(*[NAN] * 6)}, 'length 1'), ({'normals': doubles(*[2.0, 0.0] * 3)}, 'length 1'),
    ({'normals': doubles(*[INF, 0.0] * 3)}, 'length 1'), ({'offsets': doubles(*[NAN] * 12)}, 'offsets'),
    ({'offsets': doubles(*[1e8] * 12)}, 'offsets'), ({'contract': array('I', [0, 1])}, 'id 0'),
    ({'first_span': array('q', [2**62, 0])}, 'no time'), ({'first_span': array('q', [-2**63, 0])}, 'no time'),
    ({'answer_peer': array('I', [2])}, 'arrays of the links'), ({'answer_peer': array('I', [2, 2])}, 'two links'),
    ({'answer_mode': array('B', [200, 0])}, 'mode 200'), ({'answer_granted': array('q', [-2**63, 0])}, 'granted')])
def test_contracts_that_make_no_sense_are_refused_with_a_sentence(fields, words):
    message = good_contracts_message()
    convert_contracts.contracts(message, 'map')
    for field, value in fields.items():
        setattr(message, field, value)
    with pytest.raises(InvalidInput, match=words) as refusal:
        convert_contracts.contracts(message, 'map')
    assert refusal.value.code == 251 and len(str(refusal.value)) < 300


@given(st.sets(st.integers(1, 6)))
def test_of_contracts_only_what_is_for_those_who_are_asked_for_is_read(to):
    message = good_contracts_message()
    whole, part = convert_contracts.contracts(message, 'map'), convert_contracts.contracts(message, 'map', to)
    assert [offer.peer_id for offer in part.offers] == [each.peer_id for each in whole.offers if each.peer_id in to]
    assert part.answers == {peer: link for peer, link in whole.answers.items() if peer in to}
    assert whole.offers and whole.answers


def good_joint_message():
    """Return a plan in which robot 2 makes two moves and robot 3 one, which waits for the first of them."""
    ways = np.array([(0, 0), (1, 0), (2, 0)], float), np.array([(1, 1), (1, 0)], float)
    return convert_joint_plan.joint_plan_message(
        JointPlan(2, 5, 1, 4, 2, (2, 3), ways, (((), ()), (((2, 2),),))), 1.0, 'map')


@pytest.mark.parametrize('fields, words', [
    ({'version': 2}, 'version 2, not 1'), ({'members': array('I', [2])}, 'members'),
    ({'members': array('I', [2, 2])}, 'all different'), ({'proposer': 9}, 'proposer 9'), ({'epoch': 0}, 'epoch'),
    ({'points': array('H', [0, 5])}, 'needs'), ({'points': array('H', [65535, 65535])}, 'ways'),
    ({'ways': doubles()}, 'ways'), ({'ways': doubles(*[NAN] * 10)}, 'finite'),
    ({'ways': doubles(*[0.0] * 10**6)}, 'ways'),
    ({'needs': array('H', [0, 0, 65535])}, 'needed_member'), ({'needs': array('H')}, 'needs'),
    ({'needed_member': array('I', [3])}, 'cannot wait'), ({'needed_member': array('I', [8])}, 'cannot wait'),
    ({'needed_moves': array('H', [3])}, 'cannot wait'), ({'needed_moves': array('H', [0])}, 'moves'),
    ({'members': array('I'), 'points': array('H'), 'ways': doubles(), 'needs': array('H'), 'needed_member': array('I'),
      'needed_moves': array('H')}, 'members')])
def test_a_joint_plan_that_makes_no_sense_is_refused_with_a_sentence(fields, words):
    message = good_joint_message()
    convert_joint_plan.joint_plan(message, 'map')
    for field, value in fields.items():
        setattr(message, field, value)
    with pytest.raises(InvalidInput, match=words):
        convert_joint_plan.joint_plan(message, 'map')


@given(st.data())
def test_no_joint_plan_does_worse_than_to_be_refused(data):
    message, small = good_joint_message(), st.integers(0, 4)
    for field, strategy in {
            'members': st.lists(uint32, max_size=3), 'epoch': uint32, 'proposer': small,
            'points': st.lists(small, max_size=3), 'ways': st.lists(st.floats(width=64), min_size=10, max_size=10),
            'needs': st.lists(small, max_size=4), 'needed_member': st.lists(small, max_size=3),
            'needed_moves': st.lists(small, max_size=3)}.items():
        if data.draw(st.booleans()):
            setattr(message, field, data.draw(strategy))
    try:
        convert_joint_plan.joint_plan(sent(message), 'map')
    except InvalidInput:
        pass


def test_a_contract_of_too_many_lines_or_too_many_contracts_are_refused():
    message, lines = good_contracts_message(), MAX_SPANS + 1
    message.spans = array('H', [lines, 1])
    message.normals, message.offsets = doubles(*[1.0, 0.0] * (lines + 1)), doubles(*[0.0] * 4 * (lines + 1))
    with pytest.raises(InvalidInput, match='L from 1 to 256'):
        convert_contracts.contracts(message, 'map')
    message, many = good_contracts_message(), array('I', range(1, MAX_LINKS + 2))
    message.peer = message.peer_epoch = message.base_sequence = message.contract = many
    message.first_span, message.spans = array('q', many), array('H', [1] * len(many))
    message.normals, message.offsets = doubles(*[1.0, 0.0] * len(many)), doubles(*[0.0] * 4 * len(many))
    with pytest.raises(InvalidInput, match='arrays of the offers'):
        convert_contracts.contracts(message, 'map')


@given(st.data())
def test_no_robot_message_does_worse_than_to_be_refused(data):
    message = good_robot_message()
    numbers = st.floats(width=64) | st.sampled_from([0.0, 1.0])
    for field, strategy in {
            'version': st.just(3) | st.integers(0, 2**16 - 1), 'mode': st.integers(0, 255), 'step': numbers,
            'first_knot': st.integers(-2**63, 2**63 - 1), 'radius': numbers,
            'control_points': st.lists(numbers, max_size=12), 'intended_path_z1': st.lists(numbers, max_size=3),
            'peer': st.lists(uint32, max_size=4), 'link_mode': st.lists(st.integers(0, 255), min_size=2, max_size=2),
            'heading': numbers, 'final_heading': numbers, 'goal': st.lists(numbers, min_size=2, max_size=2)}.items():
        if data.draw(st.booleans()):
            setattr(message, field, data.draw(strategy))
    try:
        convert_robot.robot_msg(sent(message), 'map')
    except InvalidInput:
        pass


@given(st.data())
def test_no_contracts_message_does_worse_than_to_be_refused(data):
    message = good_contracts_message()
    numbers = st.floats(width=64) | st.sampled_from([0.0, 1.0])
    for field, strategy in {
            'version': st.just(2) | st.integers(0, 2**16 - 1), 'peer': st.lists(uint32, max_size=3),
            'contract': st.lists(uint32, min_size=2, max_size=2),
            'spans': st.lists(st.integers(0, 4), max_size=3) | st.lists(st.integers(0, 2**16 - 1), max_size=3),
            'first_span': st.lists(st.integers(-2**63, 2**63 - 1), min_size=2, max_size=2),
            'normals': st.lists(numbers, max_size=8), 'offsets': st.lists(numbers, min_size=12, max_size=12),
            'reach': st.lists(numbers, min_size=2, max_size=2), 'middles': st.lists(numbers, min_size=24, max_size=24),
            'answer_granted': st.lists(st.integers(-2**63, 2**63 - 1), min_size=2, max_size=2)}.items():
        if data.draw(st.booleans()):
            setattr(message, field, data.draw(strategy))
    try:
        convert_contracts.contracts(sent(message), 'map')
    except InvalidInput:
        pass


def good_solution_message():
    """Return a solution of two plans."""
    plans = Plan(0, 0.25, [[1.0, 2.0]] * 4), Plan(2, 0.25, [[1.0, 2.0]] * 5)
    return convert_mission.solution_message(Solution(1, plans), 5, 1.0, 'map')


@pytest.mark.parametrize('fields', [
    {'first_knots': array('q')}, {'first_knots': array('q', [1])}, {'sizes': array('I')}, {'sizes': array('I', [4, 4])},
    {'sizes': array('I', [8, 1])}, {'sizes': array('I', [0, 9])}, {'sizes': array('I', [2**32 - 1, 2**32 - 1])},
    {'reverse': []}, {'reverse': [True]}, {'goals': doubles(1.0)}, {'goals': doubles(NAN, 0.0, 0.0)},
    {'headings': doubles(0.0)},
    {'headings': doubles(NAN, 0.0)}, {'final_headings': doubles()},
    {'final_headings': doubles(INF, 0.0)}, {'control_points': doubles()}, {'control_points': doubles(*[0.0] * 17)},
    {'control_points': doubles(*[NAN] * 18)}, {'step': 0.0}, {'step': NAN}, {'first_knots': array('q', [0, 2**63 - 1])},
    {'first_knots': array('q', [1]), 'sizes': array('I', [0]), 'headings': doubles(0.0), 'final_headings': doubles(0.0),
     'control_points': doubles()}])
def test_a_solution_that_makes_no_sense_is_refused(fields):
    message = good_solution_message()
    convert_mission.solution(message, 'map')
    for field, value in fields.items():
        setattr(message, field, value)
    with pytest.raises(InvalidInput):
        convert_mission.solution(message, 'map')


@pytest.mark.parametrize('fields', [
    {'left_out': array('I', [3])},
    {'state': 4}, {'robot_ids': array('I')}, {'robot_ids': array('I', [1, 1])}, {'robot_ids': array('I', range(300))}])
def test_an_announcement_that_makes_no_sense_is_refused(fields):
    message = convert_mission.mission_message(Announcement('m', State.STARTED, (1, 2), 3.0), 1.0)
    for field, value in fields.items():
        setattr(message, field, value)
    with pytest.raises(InvalidInput):
        convert_mission.announcement(message)


def test_the_states_of_a_mission_and_the_modes_of_a_robot_are_those_of_the_messages():
    assert {state.name: state.value for state in State} == {
        name: getattr(Mission, name) for name in ('WAITING', 'STARTED', 'STOPPED', 'PAUSED')}
    assert {mode.name: mode.value for mode in Mode} == {
        name: getattr(RobotMessage, name) for name in ('WAITING', 'DRIVING', 'DONE', 'STOPPED')}


def test_odometry_is_the_pose_and_the_speeds_of_the_base():
    message = sent(convert_views.odometry(np.array([1.0, 2.0, np.pi / 2, 0.5, -0.1]), 3.25, 'map', 'robot_1/base_link'))
    assert isinstance(message, Odometry)
    assert (message.header.frame_id, message.child_frame_id) == ('map', 'robot_1/base_link')
    turn = message.pose.pose.orientation
    assert [turn.z, turn.w] == pytest.approx([np.sqrt(0.5)] * 2) and message.twist.twist.linear.x == 0.5


def test_markers_show_the_body_the_way_and_the_goal_of_each_robot_heard():
    bodies = [Body(eyed, 0.2, np.zeros(3), np.array([5.0, 6.0, 0.0]), 1.0, 5.0, 2.0) for eyed in (1, 2, 9)]
    heard = {1: convert_robot.robot_msg(good_robot_message(), 'map')}
    assert convert_views.fleet_markers(bodies, {}, ('#ff0000',), 1.0, 'map') == MarkerArray()
    markers = sent(convert_views.fleet_markers(bodies, heard, ('#ff8000',), 1.0, 'map')).markers
    disc, way, goal = markers
    assert [(marker.ns, marker.id, marker.type) for marker in markers] == [
        ('robots', 1, Marker.CYLINDER), ('intents', 1, Marker.LINE_STRIP), ('goals', 1, Marker.ARROW)]
    assert (disc.pose.position.x, disc.pose.position.y, disc.scale.x) == (1.0, 2.0, 0.4)
    assert [(point.x, point.y) for point in way.points] == [(1.0, 2.0)] * 2 and goal.pose.position.y == 6.0
    assert disc.color.r == 1.0 and disc.color.g == pytest.approx(0.5, abs=0.01) and disc.lifetime.sec
