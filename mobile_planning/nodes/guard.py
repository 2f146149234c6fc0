"""Keeps a node alive: no callback raises out of spin, and every failure is logged and counted."""
from __future__ import annotations

import functools
import inspect
import time
import traceback
from collections import Counter
from collections.abc import Callable
from typing import Any

from rclpy.node import Node

from mobile_planning.errors import PlanningError

# Between two lines in the log about the same kind of failure [s].
QUIET = 1.0


def tell_code(response: Any, error: Exception) -> None:
    """Fail with the code and the sentence."""
    response.error_code, response.error_msg = int(getattr(error, 'code', PlanningError.code)), str(error)


def tell_sentence(response: Any, error: Exception) -> None:
    """Fail with the sentence."""
    response.success, response.message = False, str(error)


def tell_nothing(response: Any, error: Exception) -> None:
    """Fail with the response as it is made: there is no field for more."""


class Guard:
    """Wraps the callbacks of one node.

    A `PlanningError` is an answer: a bad map, an impossible request. It is logged as a warning with its sentence.
    Any other exception is a fault of ours, and logged as an error with its place in the source. Each kind of failure
    of each callback is logged at most once a second. SystemExit passes: that is how a node ends itself.

    Parameters
    ----------
    node : rclpy.node.Node

    Attributes
    ----------
    rejected : Counter of str
        How often each kind of `PlanningError` was met, by ``'<code> <kind>'``.
    faults : int
        How often anything else was raised.
    newest : str
        The sentence of the newest failure.
    """

    def __init__(self, node: Node):
        self._logger = node.get_logger()
        self._logged = {}
        self.rejected: Counter[str] = Counter()
        self.faults = 0
        self.newest = ''

    def callback(self, function: Callable[..., None]) -> Callable[..., None]:
        """Return the callback of a subscription or a timer that never raises.

        Parameters
        ----------
        function : callable
            Synchronous or a coroutine function.
        """
        return self._wrap(function, lambda args, error: None)

    def service(self, function: Callable[[Any, Any], Any], fail: Callable[[Any, Exception], None]
                ) -> Callable[[Any, Any], Any]:
        """Return the callback of a service that always answers.

        Parameters
        ----------
        function : callable (request, response) -> response
            Synchronous or a coroutine function.
        fail : callable (response, error)
            Writes the failure into a fresh response: one of the functions above, or the node's own.
        """
        def answer(args, error):
            response = type(args[-1])()
            fail(response, error)
            return response
        return self._wrap(function, answer)

    def note(self, error: Exception, where: str) -> None:
        """Log and count a failure that was met in ``where``.

        Parameters
        ----------
        error : Exception
        where : str
            Name of the callback.
        """
        if isinstance(error, PlanningError):
            self.rejected[f'{error.code} {type(error).__name__}'] += 1
            self.newest = str(error)
        else:
            self.faults += 1
            places = traceback.extract_tb(error.__traceback__)[-1:]
            self.newest = f'{where} failed with {type(error).__name__}: {error}' + ''.join(
                f' ({place.filename}:{place.lineno})' for place in places)
        kind, now = (where, type(error)), time.monotonic()
        if now - self._logged.get(kind, -QUIET) >= QUIET:
            self._logged[kind] = now
            log = self._logger.warning if isinstance(error, PlanningError) else self._logger.error
            log(self.newest)

    def _wrap(self, function, otherwise):
        """Return the function that notes an exception and then returns ``otherwise(args, error)``."""
        name = getattr(function, '__name__', repr(function)).lstrip('_')

        # rclpy asks for the callback's signature, and whether it is a coroutine function: both must stay.
        if inspect.iscoroutinefunction(function):
            @functools.wraps(function)
            async def wrapped(*args):
                try:
                    return await function(*args)
                except Exception as error:
                    self.note(error, name)
                    return otherwise(args, error)
        else:
            @functools.wraps(function)
            def wrapped(*args):
                try:
                    return function(*args)
                except Exception as error:
                    self.note(error, name)
                    return otherwise(args, error)
        return wrapped
