"""The fleet's messages into core objects and back; on the way they are serialised, so a wrong number would show."""
from array import array
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mobile_planning_msgs.msg import Mission, MissionReport
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from nav_msgs.msg import Odometry
from rclpy.serialization import deserialize_message, serialize_message
from visualization_msgs.msg import Marker, MarkerArray

from mobile_planning.errors import InvalidInput, UnknownFrame
from mobile_planning.fleet.announcement import Announcement, State
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.message import MAX_LINKS, Link, Mode, RobotMsg
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body, Report
from mobile_planning.nodes import fleet_convert

uint32 = st.integers(0, 2**32 - 1)
places = st.floats(-1e6, 1e6, width=32)
angles = st.floats(-4, 4)
knots = st.integers(-2**48, 2**48)


def sent(message):
    """Return the message after its way over the wire."""
    return deserialize_message(serialize_message(message), type(message))


@st.composite
def plans(draw, step=0.25, size=st.integers(1, 126)):
    """Draw a plan of 4 to 128 points that ends at rest."""
    count = max(2, draw(size))
    seed, scale = draw(st.integers(0, 2**32 - 1)), draw(st.sampled_from([1e-3, 1.0, 1e6]))
    points = np.random.default_rng(seed).uniform(-scale, scale, (count, 2))
    return Plan(draw(knots), step, np.concatenate([points, points[-1:], points[-1:]]), draw(angles),
                draw(angles | st.just(np.nan)))


@st.composite
def robot_msgs(draw):
    """Draw anything that a robot may say."""
    step, count = draw(st.sampled_from([0.05, 0.25, 5])), draw(st.integers(0, 128))
    path = np.random.default_rng(count).uniform(-10, 10, (2, count))
    proposal = draw(st.none() | plans(step))
    return RobotMsg(
        draw(st.booleans()), *path, np.array([draw(places), draw(places)]), robot_id=draw(uint32),
        boot_epoch=draw(uint32), sequence=draw(uint32), mode=draw(st.sampled_from(Mode)), plan=draw(plans(step)),
        plan_seq=draw(uint32), proposal=proposal,
        proposal_seq=0 if proposal is None else draw(st.integers(1, 2**32 - 1)),
        radius=draw(st.sampled_from([1, 0.2, 100])), v_max=draw(st.sampled_from([2, 0.5])), omega_max=3, a_max=4,
        goal=np.array([draw(places), draw(places)]),
        links=draw(st.dictionaries(uint32, st.builds(Link, uint32, uint32, uint32), max_size=20)))


def same_plan(one, other):
    """Return whether two plans are the same to the last bit, and none is one."""
    if one is None or other is None:
        return one is other
    return (one.first_knot == other.first_knot and one.step == other.step and np.array_equal(one.points, other.points)
            and np.array_equal([one.heading, one.final_heading], [other.heading, other.final_heading], equal_nan=True))


@given(robot_msgs())
def test_what_a_robot_says_arrives_as_it_was(message):
    received = fleet_convert.robot_msg(sent(fleet_convert.robot_message(message, 12.5, 'map')), 'map')
    fields, others = vars(message), vars(received)
    proposal = received.proposal
    if proposal is not None:
        # How a proposal is turned is not sent: nobody keeps clear of a heading.
        proposal = replace(proposal, heading=message.proposal.heading, final_heading=message.proposal.final_heading)
    assert same_plan(message.plan, received.plan) and same_plan(message.proposal, proposal)
    for name in ('dp', 'robot_id', 'boot_epoch', 'sequence', 'mode', 'plan_seq', 'proposal_seq', 'radius', 'v_max',
                 'omega_max', 'a_max', 'links'):
        assert fields[name] == others[name]
    for name in 'ip_z1', 'ip_z2', 'lz', 'goal':
        assert np.array_equal(fields[name], others[name])


@given(uint32, uint32, st.booleans(), st.lists(plans(0.5, st.integers(1, 20)), min_size=1, max_size=8),
       st.lists(st.floats(0, 10)))
def test_a_solution_arrives_as_it_was(robot_id, epoch, done, driven, times):
    solution = Solution(robot_id, tuple(driven), done, tuple(times))
    message = sent(fleet_convert.solution_message(solution, epoch, 1.0, 'hall'))
    received = fleet_convert.solution(message, 'hall')
    assert message.boot_epoch == epoch and (received.eyed, received.done) == (robot_id, done)
    assert received.section_times == tuple(times) and len(received.plans) == len(driven)
    assert all(map(same_plan, received.plans, solution.plans))


@given(st.text(st.characters(codec='ascii', exclude_characters='\0')), st.sampled_from(State),
       st.lists(uint32, min_size=1, max_size=256, unique=True), st.floats(0, 2**31 - 2))
def test_an_announcement_arrives_as_it_was(name, state, robot_ids, start):
    announcement = Announcement(name, state, tuple(robot_ids), start)
    received = fleet_convert.announcement(sent(fleet_convert.mission_message(announcement, 3)))
    assert (received.name, received.state, received.robot_ids) == (name, state, tuple(robot_ids))
    assert received.start == pytest.approx(start, abs=1e-6)


@given(st.floats(0, 2**31 - 2))
def test_a_time_is_a_valid_stamp_within_its_rounding(time):
    stamp = fleet_convert.stamp(time)
    assert 0 <= stamp.nanosec < 10**9
    assert abs(stamp.sec + stamp.nanosec * 1e-9 - time) <= 1e-9 + np.spacing(time)


def test_whole_numbers_arrive_as_the_same_numbers():
    plan = Plan(0, 1, [[1, 2]] * 4, 1, 2)
    message = RobotMsg(False, [1], [2], [3, 4], plan=plan, radius=1, v_max=2, omega_max=3, a_max=4, goal=[5, 6])
    received = sent(fleet_convert.robot_message(message, 7, 'map'))
    assert [received.radius, received.v_max, received.omega_max, received.a_max, received.step] == [1, 2, 3, 4, 1]
    assert list(received.control_points) == [1, 2] * 4 and list(received.goal) == [5, 6]
    assert received.header.stamp.sec == 7 and received.heading == 1
    odometry = sent(fleet_convert.odometry(np.array([1, 2, 0, 3, 4]), 5, 'map', 'base'))
    assert (odometry.pose.pose.position.x, odometry.twist.twist.linear.x, odometry.twist.twist.angular.z) == (1, 3, 4)
    report = sent(fleet_convert.report_message(Report('m', True, 2, 2, np.inf, 1, 9), 4))
    assert isinstance(report, MissionReport) and report.min_separation == np.inf and report.mission_time == 9


def good_robot_message():
    """Return a message with two links and a proposal."""
    plan = Plan(4, 0.25, [[1.0, 2.0]] * 5)
    return fleet_convert.robot_message(RobotMsg(
        False, [1.0, 1.0], [2.0, 2.0], [1.0, 2.0], robot_id=1, plan=plan, proposal=plan, proposal_seq=3,
        links={2: Link(5, 6, 7), 3: Link(0, 0, 0)}), 1.0, 'map')


def doubles(*values):
    """Return an array as messages hold it."""
    return array('d', values)


NAN, INF = float('nan'), float('inf')


@pytest.mark.parametrize('field, value, words', [
    ('version', 2, 'version 2, not 1'), ('version', 0, 'version 0'), ('mode', 4, 'mode 4'),
    ('control_points', doubles(), '0 numbers'), ('control_points', doubles(*[1.0] * 7), '7 numbers'),
    ('control_points', doubles(*[1.0] * 9), '9 numbers'), ('control_points', doubles(*[1.0] * 6), '6 numbers'),
    ('control_points', doubles(*[1.0] * 258), '258 numbers'),
    ('control_points', doubles(*[1.0] * 10**6), '1000000 numbers'),
    ('control_points', doubles(*[NAN] * 8), 'finite'), ('control_points', doubles(*[1e7] * 8), 'within'),
    ('control_points', doubles(*range(8)), 'at rest'),
    ('proposal_control_points', doubles(), 'proposal_control_points has 0'),
    ('proposal_control_points', doubles(*range(8)), 'at rest'), ('proposal_first_knot', 2**62, 'no time'),
    ('first_knot', -2**63, 'no time'), ('first_knot', 2**63 - 1, 'no time'),
    ('step', 0.0, 'step'), ('step', NAN, 'step'), ('step', -1.0, 'step'), ('heading', NAN, 'heading'),
    ('final_heading', INF, 'heading'), ('radius', 0.0, 'radius'), ('radius', NAN, 'radius'), ('v_max', -1.0, 'v_max'),
    ('omega_max', INF, 'omega_max'), ('a_max', NAN, 'a_max'), ('goal', np.array([NAN, 0.0]), 'goal'),
    ('latest_z', np.array([INF, 0.0]), 'lz'), ('intended_path_z1', doubles(1.0), 'intended_path_z1 has 1'),
    ('intended_path_z1', doubles(*[0.0] * 10**6), 'more than 128'), ('intended_path_z2', doubles(NAN, NAN), 'ip_z2'),
    ('peer', array('I', [2]), 'entries for its links'), ('promised', array('I'), 'entries for its links'),
    ('heard', array('I', range(10**6)), 'entries for its links'), ('peer', array('I', [2, 2]), 'two links')])
def test_a_message_that_makes_no_sense_is_refused_with_a_sentence(field, value, words):
    message = good_robot_message()
    fleet_convert.robot_msg(message, 'map')
    setattr(message, field, value)
    with pytest.raises(InvalidInput, match=words):
        fleet_convert.robot_msg(message, 'map')


def test_more_links_than_there_are_robots_are_refused():
    message, many = good_robot_message(), array('I', range(MAX_LINKS + 1))
    message.peer = message.peer_epoch = message.heard = message.promised = many
    with pytest.raises(InvalidInput, match='links'):
        fleet_convert.robot_msg(message, 'map')


@pytest.mark.parametrize('frame', ['', 'odom', '/map', 'x' * 10**6])
def test_another_frame_is_refused(frame):
    message = good_robot_message()
    message.header.frame_id = frame
    with pytest.raises(UnknownFrame) as refusal:
        fleet_convert.robot_msg(message, 'map')
    assert len(str(refusal.value)) < 200
    with pytest.raises(UnknownFrame):
        fleet_convert.solution(SolutionMessage(header=message.header), 'map')


@given(st.data())
def test_no_robot_message_does_worse_than_to_be_refused(data):
    message = good_robot_message()
    numbers = st.floats(width=64) | st.sampled_from([0.0, 1.0])
    for field, strategy in {
            'version': st.just(1) | st.integers(0, 2**16 - 1), 'mode': st.integers(0, 255), 'step': numbers,
            'first_knot': st.integers(-2**63, 2**63 - 1), 'proposal_seq': uint32, 'radius': numbers,
            'control_points': st.lists(numbers, max_size=12), 'intended_path_z1': st.lists(numbers, max_size=3),
            'proposal_control_points': st.lists(numbers, max_size=12), 'peer': st.lists(uint32, max_size=4),
            'heading': numbers, 'final_heading': numbers, 'goal': st.lists(numbers, min_size=2, max_size=2)}.items():
        if data.draw(st.booleans()):
            setattr(message, field, data.draw(strategy))
    try:
        fleet_convert.robot_msg(sent(message), 'map')
    except InvalidInput:
        pass


def good_solution_message():
    """Return a solution of two plans."""
    plans = Plan(0, 0.25, [[1.0, 2.0]] * 4), Plan(2, 0.25, [[1.0, 2.0]] * 5)
    return fleet_convert.solution_message(Solution(1, plans), 5, 1.0, 'map')


@pytest.mark.parametrize('fields', [
    {'first_knots': array('q')}, {'first_knots': array('q', [1])}, {'sizes': array('I')}, {'sizes': array('I', [4, 4])},
    {'sizes': array('I', [8, 1])}, {'sizes': array('I', [0, 9])}, {'sizes': array('I', [2**32 - 1, 2**32 - 1])},
    {'headings': doubles(0.0)}, {'headings': doubles(NAN, 0.0)}, {'final_headings': doubles()},
    {'final_headings': doubles(INF, 0.0)}, {'control_points': doubles()}, {'control_points': doubles(*[0.0] * 17)},
    {'control_points': doubles(*[NAN] * 18)}, {'step': 0.0}, {'step': NAN}, {'first_knots': array('q', [0, 2**63 - 1])},
    {'first_knots': array('q', [1]), 'sizes': array('I', [0]), 'headings': doubles(0.0), 'final_headings': doubles(0.0),
     'control_points': doubles()}])
def test_a_solution_that_makes_no_sense_is_refused(fields):
    message = good_solution_message()
    fleet_convert.solution(message, 'map')
    for field, value in fields.items():
        setattr(message, field, value)
    with pytest.raises(InvalidInput):
        fleet_convert.solution(message, 'map')


@pytest.mark.parametrize('fields', [
    {'state': 3}, {'robot_ids': array('I')}, {'robot_ids': array('I', [1, 1])}, {'robot_ids': array('I', range(300))}])
def test_an_announcement_that_makes_no_sense_is_refused(fields):
    message = fleet_convert.mission_message(Announcement('m', State.STARTED, (1, 2), 3.0), 1.0)
    for field, value in fields.items():
        setattr(message, field, value)
    with pytest.raises(InvalidInput):
        fleet_convert.announcement(message)


def test_the_states_of_a_mission_and_the_modes_of_a_robot_are_those_of_the_messages():
    assert {state.name: state.value for state in State} == {
        name: getattr(Mission, name) for name in ('WAITING', 'STARTED', 'STOPPED')}
    assert {mode.name: mode.value for mode in Mode} == {
        name: getattr(RobotMessage, name) for name in ('WAITING', 'DRIVING', 'DONE', 'STOPPED')}


def test_odometry_is_the_pose_and_the_speeds_of_the_base():
    message = sent(fleet_convert.odometry(np.array([1.0, 2.0, np.pi / 2, 0.5, -0.1]), 3.25, 'map', 'robot_1/base_link'))
    assert isinstance(message, Odometry)
    assert (message.header.frame_id, message.child_frame_id) == ('map', 'robot_1/base_link')
    turn = message.pose.pose.orientation
    assert [turn.z, turn.w] == pytest.approx([np.sqrt(0.5)] * 2) and message.twist.twist.linear.x == 0.5


def test_markers_show_the_body_the_way_and_the_goal_of_each_robot_heard():
    bodies = [Body(eyed, 0.2, np.zeros(3), np.array([5.0, 6.0, 0.0]), 1.0, 5.0, 2.0) for eyed in (1, 2, 9)]
    heard = {1: fleet_convert.robot_msg(good_robot_message(), 'map')}
    assert fleet_convert.fleet_markers(bodies, {}, ('#ff0000',), 1.0, 'map') == MarkerArray()
    markers = sent(fleet_convert.fleet_markers(bodies, heard, ('#ff8000',), 1.0, 'map')).markers
    disc, way, goal = markers
    assert [(marker.ns, marker.id, marker.type) for marker in markers] == [
        ('robots', 1, Marker.CYLINDER), ('intents', 1, Marker.LINE_STRIP), ('goals', 1, Marker.ARROW)]
    assert (disc.pose.position.x, disc.pose.position.y, disc.scale.x) == (1.0, 2.0, 0.4)
    assert [(point.x, point.y) for point in way.points] == [(1.0, 2.0)] * 2 and goal.pose.position.y == 6.0
    assert disc.color.r == 1.0 and disc.color.g == pytest.approx(0.5, abs=0.01) and disc.lifetime.sec
