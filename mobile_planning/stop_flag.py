"""The flag that ends long planning: kernels poll it, a deadline or a cancelled query sets it."""
from __future__ import annotations

import threading
import time
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import Cancelled, PlanningError, PlanningTimeout

# How late a cancelled query may be noticed [s].
_PERIOD = 0.01


class StopFlag:
    """Watches the clock and the caller while its ``with`` block runs, and sets ``array[0]`` when it must end.

    A kernel stopped that way raises `Cancelled`; the block then raises what really happened.

    Parameters
    ----------
    deadline : float, optional [s]
        From now on; without one the block may last for ever.
    cancelled : (1,) ndarray of uint8, optional
        The caller's own flag: set ``cancelled[0]`` to withdraw the query.

    Attributes
    ----------
    array : (1,) ndarray of uint8
        What kernels poll.

    Raises
    ------
    PlanningTimeout, Cancelled
        At the end of the block, in place of the `Cancelled` of the work inside it.
    """

    def __init__(self, deadline: float | None = None, cancelled: NDArray[np.uint8] | None = None):
        self.array = np.zeros(1, np.uint8)
        self._allowed = deadline
        self._end = None if deadline is None else time.monotonic() + deadline
        self._cancelled = cancelled
        self._over = self._watcher = None

    def check(self) -> None:
        """Raise PlanningTimeout or Cancelled if the block must end."""
        if self._reason() is not None:
            raise self._reason()

    def __enter__(self) -> StopFlag:
        self.check()
        self._over = threading.Event()
        if self._end is not None or self._cancelled is not None:
            self._watcher = threading.Thread(target=self._watch, name='stop flag', daemon=True)
            self._watcher.start()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 trace: TracebackType | None) -> None:
        self._over.set()
        if self._watcher is not None:
            self._watcher.join()
        # A name for the reason would be a cycle of it and this frame, which keeps the memory of the work alive.
        if isinstance(error, Cancelled) and self._reason() is not None:
            raise self._reason() from None

    def _watch(self):
        while self._reason() is None:
            if self._over.wait(_PERIOD if self._end is None else min(_PERIOD, max(0.0, self._end - time.monotonic()))):
                return
        self.array[0] = 1

    def _reason(self) -> PlanningError | None:
        if self._cancelled is not None and self._cancelled[0]:
            return Cancelled('the query was withdrawn')
        if self._end is not None and time.monotonic() >= self._end:
            return PlanningTimeout(f'the deadline of {self._allowed:g} s passed before a path was found')
        return None
