"""A callback that raises ends nothing; a node that wants to end does."""
import pytest
from rclpy.callback_groups import ReentrantCallbackGroup
from std_msgs.msg import Empty
from std_srvs.srv import Trigger

from mobile_planning.errors import NoPath
from mobile_planning.nodes import qos
from mobile_planning.nodes.guard import Guard


def fail(response, error):
    """Write a failure into the answer of a Trigger."""
    response.success, response.message = False, str(error)


@pytest.fixture
def guard(ros):
    """Return the guard of the tester's own node."""
    return Guard(ros.node)


def raising(error):
    """Return a callback that raises."""
    def callback(*_):
        raise error
    return callback


def test_a_raising_subscription_or_timer_is_counted_and_the_node_lives_on(ros, guard):
    ros.node.create_subscription(Empty, 'in', guard.callback(raising(ValueError('odd'))), qos.live())
    ros.node.create_timer(0.01, guard.callback(raising(KeyError('lost'))))
    publisher = ros.node.create_publisher(Empty, 'in', qos.live())
    ros.until(publisher.get_subscription_count)
    publisher.publish(Empty())
    ros.until(lambda: guard.faults > 3 and ('callback', ValueError) in guard._logged)
    assert ('callback', KeyError) in guard._logged and not guard.rejected


def test_a_raising_service_answers(ros, guard):
    ros.node.create_service(Trigger, 'plain', guard.service(raising(NoPath('walled in')), fail))
    answer = ros.call(Trigger, 'plain')
    assert not answer.success and answer.message == 'walled in'
    assert guard.rejected == {'208 NoPath': 1} and guard.newest == 'walled in' and guard.faults == 0


def test_a_raising_coroutine_answers_and_what_it_had_written_is_gone(ros, guard):
    async def callback(request, response):
        response.success = True
        await ros.executor.create_task(lambda: None)
        raise RuntimeError('half done')
    ros.node.create_service(Trigger, 'later', guard.service(callback, fail), callback_group=ReentrantCallbackGroup())
    answer = ros.call(Trigger, 'later')
    assert not answer.success and answer.message == 'half done'
    assert guard.faults == 1 and 'test_guard.py:' in guard.newest


def test_each_kind_of_failure_is_logged_once_a_second_and_counted_every_time(guard, monkeypatch):
    lines, now = [], [100.0]
    monkeypatch.setattr(guard, '_logger', type('Logger', (), {'warning': lines.append, 'error': lines.append}))
    monkeypatch.setattr('time.monotonic', lambda: now[0])
    for step in range(30):
        now[0] = 100.0 + step * 0.1
        guard.note(NoPath(str(step)), 'plan')
        guard.note(NoPath(str(step)), 'other')
    assert lines == ['0', '0', '10', '10', '20', '20'] and guard.rejected['208 NoPath'] == 60


def test_a_node_may_end_itself_in_a_callback(ros, guard):
    ros.node.create_timer(0.01, guard.callback(raising(SystemExit(3))))
    with pytest.raises(SystemExit, match='3'):
        ros.until(lambda: False)
