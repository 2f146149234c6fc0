"""The executor: whatever rclpy's own one runs it runs, all that is ready at once, and it waits while nothing is."""
import threading
from time import monotonic

import pytest
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import QoSPolicyKind, QoSProfile, ReliabilityPolicy
from rclpy.timer import TimerInfo
from std_msgs.msg import Empty, Int32
from std_srvs.srv import Trigger

from mobile_planning.nodes import executor, qos
from mobile_planning.nodes.worker import Worker


def talk(ros, listener, depth=100, **options):
    """Return a publisher whose messages the listener gets."""
    ros.node.create_subscription(Int32, 'numbers', listener, QoSProfile(depth=depth), **options)
    publisher = ros.node.create_publisher(Int32, 'numbers', QoSProfile(depth=depth))
    ros.until(publisher.get_subscription_count)
    return publisher


def test_messages_that_queued_up_come_in_order_and_many_in_one_turn(ros):
    heard, turns = [], []
    publisher = talk(ros, lambda message: heard.append(message.data))
    for number in range(60):
        publisher.publish(Int32(data=number))
    publisher.wait_for_all_acked()
    ros.until(lambda: turns.append(len(heard)) or len(heard) == 60)
    assert heard == list(range(60))
    assert max(after - before for before, after in zip(turns, turns[1:])) > 10


def test_an_executor_that_rests_takes_what_comes_meanwhile_at_once_and_keeps_no_timer_waiting(ros, monkeypatch):
    heard, rung = [], []
    publisher = talk(ros, lambda message: heard.append(message.data))
    timer = ros.node.create_timer(0.01, lambda: rung.append(len(heard)))
    ros.executor.remove_node(ros.node)
    resting = executor.make_executor(1000.0, context=ros.context)
    resting.add_node(ros.node)
    try:
        publisher.publish(Int32(data=0))
        while not heard:
            resting.spin_once(10.0)
        for number in range(1, 5):
            publisher.publish(Int32(data=number))
        publisher.wait_for_all_acked()
        rung.clear()
        while len(rung) < 3:
            resting.spin_once(10.0)
        assert heard == [0] and rung == [1, 1, 1]
        monkeypatch.setattr(executor, 'monotonic', lambda: monotonic() + 1001.0)
        while len(heard) < 2:
            resting.spin_once(10.0)
        assert heard == [0, 1, 2, 3, 4]
    finally:
        resting.shutdown()
        ros.node.destroy_timer(timer)
        ros.executor.add_node(ros.node)


def test_a_callback_with_two_arguments_hears_who_published(ros):
    heard = []
    publisher = talk(ros, lambda message, info: heard.append((message.data, info['publisher_gid'])))
    publisher.publish(Int32(data=7))
    ros.until(lambda: heard)
    assert heard[0][0] == 7 and heard[0][1]


def test_entities_that_callbacks_make_and_destroy_are_noticed(ros):
    heard = []

    def once():
        timer.cancel()
        ros.node.destroy_timer(timer)
        subscription = ros.node.create_subscription(
            Empty, 'late', lambda _: (heard.append(1), ros.node.destroy_subscription(subscription)), qos.live())
    timer = ros.node.create_timer(0.001, once)
    publisher = ros.node.create_publisher(Empty, 'late', qos.live())
    ros.until(publisher.get_subscription_count)
    publisher.publish(Empty())
    ros.until(lambda: heard and not publisher.get_subscription_count())
    assert heard == [1]


def test_a_coroutine_that_waits_for_a_worker_holds_up_its_group_and_nobody_else(ros):
    gate, order = threading.Event(), []
    worker = Worker(ros.node)

    async def long(request, response):
        order.append('begins')
        await worker.submit(gate.wait, 30.0)
        order.append('ends')
        return response
    group = MutuallyExclusiveCallbackGroup()
    ros.node.create_service(Trigger, 'long', long, callback_group=group)
    publisher = talk(ros, lambda message: order.append(message.data), callback_group=group)
    free = ros.node.create_timer(0.005, lambda: order.append('tick'))
    answer = ros.send(Trigger, 'long')
    ros.until(lambda: 'begins' in order)
    publisher.publish(Int32(data=1))
    publisher.wait_for_all_acked()
    order.clear()
    ros.until(lambda: order.count('tick') > 5)
    assert set(order) == {'tick'}
    free.cancel()
    gate.set()
    ros.until(lambda: answer.done() and 1 in order)
    assert order.index('ends') < order.index(1)
    worker.close()


def test_nothing_to_do_is_waited_for_without_turning_round(ros):
    turns = []
    ros.executor.spin_once(0.0)
    ros.node.create_timer(0.2, lambda: turns.append('timer'))
    ros.until(lambda: turns.append('turn') or turns.count('timer') > 4)
    # Of 20 ms each, as the tester spins; and now and then one for the events of the middleware.
    assert turns.count('turn') < 200


def test_timers_may_be_coroutines_and_may_ask_for_their_times(ros):
    called = []

    async def later():
        called.append('coroutine')

    def asking(info: TimerInfo):
        called.append(info.actual_call_time >= info.expected_call_time)
    ros.node.create_timer(0.005, later)
    ros.node.create_timer(0.005, asking)
    ros.until(lambda: called.count('coroutine') > 2 and called.count(True) > 2)


@pytest.mark.parametrize('raised', [ValueError, SystemExit])
def test_what_a_callback_raises_comes_out_of_the_spin(ros, raised):
    def callback():
        raise raised('over')
    ros.node.create_timer(0.001, callback)
    with pytest.raises(raised, match='over'):
        ros.until(lambda: False)


def test_events_of_the_middleware_are_told(ros):
    told = []
    ros.node.create_subscription(
        Empty, 'asked', lambda _: None, QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE),
        event_callbacks=SubscriptionEventCallbacks(incompatible_qos=told.append))
    ros.node.create_publisher(Empty, 'asked', QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))
    ros.until(lambda: told)
    assert told[0].last_policy_kind == QoSPolicyKind.RELIABILITY


@pytest.mark.parametrize('known, kind', [('9.1.2', executor.QuickExecutor), ('9.2.0', SingleThreadedExecutor),
                                         ('7.1.4', SingleThreadedExecutor)])
def test_where_rclpy_is_not_the_version_known_its_own_executor_runs_the_nodes(ros, monkeypatch, known, kind):
    monkeypatch.setattr(executor, 'version', lambda _: known)
    made = executor.make_executor(context=ros.context)
    made.shutdown()
    assert type(made) is kind
