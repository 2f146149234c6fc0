"""QuickExecutor: runs the callbacks of nodes in one thread, for a fraction of what rclpy's own executor costs.

That one gathers all entities of all nodes anew before each wait, twice for each callback, and makes a task of each
callback: a millisecond of processor time for a message that takes a tenth of it to read. Here the entities are gathered
when one is added or gone, callbacks that are no coroutines are called where they stand, and what has queued up is taken
at once. All that is rare is left to rclpy's code: services, clients, actions, coroutines.

It stands on inner parts of rclpy, so `make_executor` takes rclpy's own executor where rclpy is another version.
"""
from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from math import inf
from time import monotonic

from rclpy.event_handler import EventHandler
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.subscription import Subscription

from mobile_planning.nodes.entities import Entities, may_run

#: Whose inner parts are as they are used here.
_KNOWN = '9.1.'
#: Of one topic so many messages are taken before the others have their turn.
_AT_ONCE = 32
#: So often events of the middleware are looked at, which only warn [s].
_EVENTS = 1.0
#: What is not kept waiting while the executor rests.
_URGENT = 'timer', 'guard_condition'

_InvalidHandle = rclpy_implementation.InvalidHandle


def make_executor(rest: float = 0.0, **kwargs) -> SingleThreadedExecutor:
    """Return the executor for nodes: a `QuickExecutor`, or rclpy's own where its version is not known to fit.

    Parameters
    ----------
    rest : float [s]
        See `QuickExecutor`.
    **kwargs
        For ``rclpy.executors.SingleThreadedExecutor``.
    """
    try:
        fits = version('rclpy').startswith(_KNOWN)
    except PackageNotFoundError:
        fits = False
    return QuickExecutor(rest, **kwargs) if fits else SingleThreadedExecutor(**kwargs)


class QuickExecutor(SingleThreadedExecutor):
    """Runs callbacks in the thread that calls `spin_once`.

    Parameters
    ----------
    rest : float [s]
        When messages were taken none is looked for so long, and what comes meanwhile is taken at once; timers and
        guard conditions are not kept waiting. Where many processes share a machine, to wake for a message costs more
        than the message.
    **kwargs
        For ``rclpy.executors.SingleThreadedExecutor``.
    """

    def __init__(self, rest: float = 0.0, **kwargs):
        self._rest, self._rests_until = rest, -inf
        self._entities: Entities | None = None
        self._urgent: Entities | None = None
        self._may_have_changed, self._events_due = True, monotonic() + _EVENTS
        super().__init__(**kwargs)

    def wake(self) -> None:
        """Wake the executor: an entity was created or destroyed."""
        self._may_have_changed = True
        super().wake()

    def add_node(self, node: Node) -> bool:
        """Run the callbacks of a node too."""
        self._may_have_changed = True
        return super().add_node(node)

    def remove_node(self, node: Node) -> None:
        """Run the callbacks of a node no more."""
        self._may_have_changed = True
        super().remove_node(node)

    def shutdown(self, timeout_sec: float | None = None) -> bool:
        """Let go of all nodes."""
        self._let_go()
        return super().shutdown(timeout_sec)

    def spin_once(self, timeout_sec: float | None = None) -> None:
        """Wait until something is ready, ``timeout_sec`` [s] at most, and run the callbacks of all that is."""
        if monotonic() >= self._events_due:
            self._events_due = monotonic() + _EVENTS
            self._look_at_events()
        self._look_for_changes()
        if self._is_shutdown:
            return
        ready = self._wait(timeout_sec)
        if not self._context.ok():
            raise ExternalShutdownException
        for timer in ready['timer']:
            self._run_timer(timer)
        for subscription in ready['subscription']:
            self._run_subscription(subscription)
        for kind, take in (('guard_condition', self._take_guard_condition), ('client', self._take_client),
                           ('service', self._take_service), ('waitable', self._take_waitable)):
            for entity in ready[kind]:
                self._begin(entity, take)
        self._go_on()

    def _wait(self, timeout):
        """Return who is ready, by kind, within ``timeout`` [s]; None for as long as it takes."""
        rest = self._rests_until - monotonic()
        if rest > 0.0:
            timeout = rest if timeout is None else min(rest, timeout)
            return self._urgent.wait(int(1e9 * timeout), not self._tasks)
        ready = self._entities.wait(-1 if timeout is None else int(1e9 * timeout), not self._tasks)
        if self._rest and ready['subscription']:
            self._rests_until = monotonic() + self._rest
        return ready

    def _look_for_changes(self):
        """Gather the entities, if they are others than before."""
        if self._may_have_changed or self._entities is None:
            self._may_have_changed = False
            self._let_go()
            nodes = self.get_nodes()
            waitables = [each for node in nodes for each in node.waitables if not isinstance(each, EventHandler)]
            alarms = [self._guard, self._sigint_gc]
            self._entities = Entities(self._context, nodes, waitables, alarms)
            self._urgent = Entities(self._context, nodes, [], alarms, _URGENT)

    def _look_at_events(self):
        handlers = [each for node in self.get_nodes() for each in node.waitables if isinstance(each, EventHandler)]
        events = Entities(self._context, [], handlers, [])
        for handler in events.wait(0, not self._tasks)['waitable']:
            self._begin(handler, self._take_waitable)
        events.release()

    def _let_go(self):
        if self._entities is not None:
            self._entities.release()
            self._urgent.release()
            self._entities = self._urgent = None

    def _run_timer(self, timer):
        if timer not in self._entities.simple:
            self._begin(timer, self._take_timer)
            return
        if not may_run(timer):
            return
        try:
            with timer.handle:
                if not timer.handle.is_timer_ready():
                    return
                timer.handle.call_timer_with_info()
        except (_InvalidHandle, rclpy_implementation.TimerCancelledError):
            return
        timer.callback()

    def _run_subscription(self, subscription):
        if subscription not in self._entities.simple:
            self._begin(subscription, self._take_subscription)
            return
        length = 1 if subscription._callback_type is Subscription.CallbackType.MessageOnly else 2
        for _ in range(_AT_ONCE):
            if not may_run(subscription):
                return
            try:
                with subscription.handle:
                    taken = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            except _InvalidHandle:
                return
            if taken is None:
                return
            subscription.callback(*taken[:length])

    def _begin(self, entity, take):
        """Leave a callback to rclpy's tasks."""
        if may_run(entity):
            self._make_handler(entity, None, take)

    def _go_on(self):
        """Let all tasks go on as far as they can; raise what one of them raises."""
        if not self._tasks:
            return
        with self._tasks_lock:
            tasks = [task for task, _, _ in self._tasks]
        for task in tasks:
            task()
        with self._tasks_lock:
            self._tasks = [each for each in self._tasks if not (each[0].done() or each[0].cancelled())]
        for task in tasks:
            if task.done() and task.exception() is not None:
                raise task.exception()
