"""One thread for the long work of a node, so that its executor goes on answering meanwhile."""
from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.task import Future

from mobile_planning.errors import Cancelled, LimitExceeded, PlanningTimeout

# How long the executor waits for a result before it turns to other things [s].
PATIENCE = 0.005
MAX_WAITING = 64
# How long after its deadline work is still waited for: it ends by itself and knows better what happened [s].
GRACE = 0.02


class Worker:
    """Runs functions one after the other, in the order they were given.

    What only its functions touch needs no lock.

    Parameters
    ----------
    node : rclpy.node.Node
        Whose coroutines wait for the results. They must be in a ReentrantCallbackGroup: the default group waits with
        them.

    Attributes
    ----------
    stop : (1,) ndarray of uint8
        ``stop[0]`` is set once the node ends; long work looks at it.
    """

    def __init__(self, node: Node):
        self._node = node
        self._jobs = queue.SimpleQueue()
        # An executor only looks at a waiting coroutine when something happens.
        self._bell = node.create_guard_condition(lambda: None, ReentrantCallbackGroup())
        self.stop = np.zeros(1, np.uint8)
        # A daemon, for work that does not look at `stop` must not keep the process.
        self._thread = threading.Thread(target=self._work, name=f'{node.get_name()} worker', daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> int:
        """Number of functions that wait for their turn."""
        return self._jobs.qsize()

    def require_room(self) -> None:
        """Raise LimitExceeded if too many wait."""
        if self.waiting >= MAX_WAITING:
            raise LimitExceeded(f'{self.waiting} requests are waiting: the limit is {MAX_WAITING}')

    def submit(self, function: Callable[..., Any], *args) -> Future:
        """Let the function run when its turn comes, and return the future of its result.

        Parameters
        ----------
        function : callable
        *args
        """
        future = Future()
        self._jobs.put((function, args, future))
        return future

    async def run(self, function: Callable[..., Any], *args, until: float | None = None) -> Any:
        """Return what the function returns, or raise what it raises, without holding up the executor for long.

        Parameters
        ----------
        function : callable
        *args
        until : float, optional [s]
            On the monotonic clock. Nobody waits longer, and a function whose turn has not come by then never runs.

        Raises
        ------
        PlanningTimeout
            If it had not returned by then.
        """
        return await self.wait(self.submit(function, *args), until)

    async def wait(self, future: Future, until: float | None = None) -> Any:
        """Return the result of a function that was submitted, or raise what it raises; see `run`."""
        done = threading.Event()
        future.add_done_callback(lambda _: done.set())
        # Most results are there at once, and to go round the executor for them takes longer than they do.
        done.wait(PATIENCE)
        if until is None or done.is_set():
            return await future
        late = PlanningTimeout('the deadline passed while other work was done')
        alarm = self._node.create_timer(max(0.0, until + GRACE - time.monotonic()),
                                        lambda: self._answer(future.set_exception, future, late),
                                        clock=Clock(clock_type=ClockType.STEADY_TIME))
        try:
            return await future
        finally:
            self._node.destroy_timer(alarm)

    def close(self, timeout: float = 1.0) -> None:
        """Stop the work under way and the thread.

        Parameters
        ----------
        timeout : float [s]
            How long work that does not stop is waited for.
        """
        self.stop[0] = 1
        self._jobs.put(None)
        self._thread.join(timeout)

    def _work(self):
        """Run the functions until `close`."""
        for function, args, future in iter(self._jobs.get, None):
            if future.done():
                continue
            try:
                if self.stop[0]:
                    raise Cancelled('the node is shutting down')
                self._answer(future.set_result, future, function(*args))
            except Exception as error:
                self._answer(future.set_exception, future, error)
                if self.stop[0]:
                    # Who waited may be gone with the executor: rclpy would complain that nobody asked for it.
                    future.exception()
            self._ring()

    @staticmethod
    def _answer(tell, future, answer):
        """Tell who waits, if somebody still does."""
        if not future.done():
            tell(answer)

    def _ring(self):
        """Wake the executor."""
        try:
            self._bell.trigger()
        except rclpy_implementation.InvalidHandle:
            pass  # the node has just been destroyed
