"""How an executable of this package lives: it starts, spins its node, and ends with the right exit code.

Nothing of ROS is imported before the handlers of `stop_signals` stand, since the imports take longest of all.
"""
from __future__ import annotations

import gc
import signal
import sys
import time
from collections.abc import Callable, Sequence
from os.path import basename
from typing import TYPE_CHECKING

from mobile_planning.errors import InvalidInput, PlanningError
from mobile_planning.nodes.reach import require_reach
from mobile_planning.nodes.stop_signals import StopSignals

if TYPE_CHECKING:
    from rclpy.executors import Executor
    from rclpy.node import Node

# The longest that a signal waits for the loop, while nothing else happens [s].
PERIOD = 0.2
# After which a node has loaded what it needs [s].
SETTLING = 5.0
# What takes longer to clean up is ended by SIGALRM [s]: in Fast DDS 3.2.2 a participant that goes while others do may
# wait for ever, in a loop that lets nothing of Python run.
FAREWELL = 10


def run(make_node: Callable[[], Node | Sequence[Node]], args: Sequence[str] | None = None, rest: float = 0.0) -> int:
    """Spin one node, or several, until SIGINT, SIGTERM or their own wish, and return the exit code.

    A node ends itself by ``raise SystemExit(code)`` in any callback.

    Parameters
    ----------
    make_node : callable
        Imports what is needed and returns a node, or several. A `PlanningError` means that the user gave it something
        wrong.
    args : sequence of str, optional
        The command line with the executable's name; ``sys.argv`` by default.
    rest : float [s]
        Of the executor between two turns.

    Returns
    -------
    int
        0 after a signal, the node's own code, or 2 when the arguments or parameters are refused, or other hosts can
        reach the node though they are not to, with one sentence on stderr.
    """
    args = sys.argv if args is None else args
    with StopSignals() as stop:
        try:
            return _live(make_node, args, stop, rest)
        except PlanningError as error:
            print(f'{basename(args[0])}: {error}', file=sys.stderr)
            return 2


def without_ros(args: Sequence[str]) -> list[str]:
    """Return the arguments that are not for ROS, without the executable's name in front.

    Parameters
    ----------
    args : sequence of str
        The command line with the executable's name.

    Raises
    ------
    InvalidInput
        If an argument after ``--ros-args`` is not understood.
    """
    from rclpy.utilities import remove_ros_args

    try:
        return remove_ros_args(list(args))[1:]
    except RuntimeError as error:
        raise InvalidInput(_sentence(error)) from None


def start_ros(args: Sequence[str]) -> None:
    """Initialise rclpy without its signal handlers.

    Parameters
    ----------
    args : sequence of str
        The command line with the executable's name.

    Raises
    ------
    InvalidInput
        If an argument after ``--ros-args`` is not understood.
    """
    import rclpy
    from rclpy.signals import SignalHandlerOptions

    try:
        rclpy.init(args=list(args), signal_handler_options=SignalHandlerOptions.NO)
    except RuntimeError as error:
        raise InvalidInput(_sentence(error)) from None


def _sentence(error):
    """Return what rcl has to say, without the places in its own source."""
    return str(error).split(', at /')[0]


def _live(make_node, args, stop, rest):
    """Start, spin and clean up, whatever happens between; return the exit code."""
    # What is loaded stays: to look through all of it for garbage, again and again, is a tenth of the start.
    gc.disable()
    import rclpy
    from rclpy.exceptions import NameValidationException

    from mobile_planning.nodes.executor import make_executor

    executor, nodes = None, []
    try:
        unexpected = without_ros(args)
        if unexpected:
            raise InvalidInput(f'unexpected argument {unexpected[0]!r}: parameters are given as '
                               '--ros-args -p name:=value or --ros-args --params-file FILE')
        start_ros(args)
        made = make_node()
        nodes = list(made) if isinstance(made, Sequence) else [made]
        require_reach()
        executor = make_executor(rest)
        for node in nodes:
            executor.add_node(node)
        _spin(executor, lambda: stop.received is not None or not rclpy.ok())
        return 0
    except NameValidationException as error:
        raise InvalidInput(str(error).splitlines()[0]) from None
    except SystemExit as end:
        return int(end.code or 0)
    finally:
        _clean_up(executor, nodes)


def _clean_up(executor, nodes):
    """End everything, or the process."""
    import rclpy

    gc.enable()
    signal.alarm(FAREWELL)
    try:
        if executor is not None:
            executor.shutdown()
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    finally:
        signal.alarm(0)


def spin_until(executor: Executor, is_over: Callable[[], object], timeout: float = float('inf'),
               period: float = PERIOD) -> bool:
    """Spin until it is over, and return whether it came to that in time.

    Parameters
    ----------
    executor : rclpy.executors.Executor
    is_over : callable
        Asked at least every ``period`` [s].
    timeout, period : float [s]
    """
    end = time.monotonic() + timeout
    while not is_over():
        if time.monotonic() > end:
            return False
        executor.spin_once(timeout_sec=period)
    return True


def _spin(executor, is_over):
    """Spin until it is over."""
    if not spin_until(executor, is_over, SETTLING):
        # What is there by now stays. Without this, every full collection walks through all of it, numba above all:
        # 50 ms, now and then, in the middle of a request.
        gc.collect()
        gc.freeze()
        gc.enable()
        spin_until(executor, is_over)
