"""What shows a planner's work to a person: a progress bar or callback, and animations of plans and paths.

The algorithms know nothing of it: they count what they have done in an array, and hand back plans and paths.
"""
from __future__ import annotations

import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as NotYet
from math import isnan
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput

Result = TypeVar('Result')

# Between two reports [s].
_PERIOD = 0.1
# What is over sooner needs no bar [s].
_PATIENCE = 0.5
_BAR = 40


def with_progress(
    work: Callable[[NDArray[np.uint8], NDArray[np.int64]], Result],
    progress: bool | Callable[[float], None] | NDArray[np.int64],
    stop: NDArray[np.uint8] | None,
    title: str,
) -> Result:
    """Return what ``work(stop, done)`` returns, reporting its progress meanwhile.

    Parameters
    ----------
    work : callable
        Ends early when ``stop[0]`` is set, and has finished ``done[0]`` of ``done[1]`` parts.
    progress : bool, callable or (2,) ndarray of int64
        Called from this thread with the share that is done, from 0 to 1, ten times a second and at the end; it may
        raise to give up. True is a bar on the terminal, if there is one and the work lasts. An array becomes ``done``.
    stop : (1,) ndarray of uint8, optional
        The caller's flag.
    title : str
        In front of the bar.
    """
    stop = np.zeros(1, np.uint8) if stop is None else stop
    if isinstance(progress, np.ndarray):
        return work(stop, progress)
    done = np.zeros(2, np.int64)
    if progress is True:
        progress = _Bar(title) if sys.stderr is not None and sys.stderr.isatty() else None
    if not progress:
        return work(stop, done)
    # The work goes to another thread, so that the report is made in the caller's and Ctrl-C ends both.
    with ThreadPoolExecutor(1, thread_name_prefix='planner') as worker:
        future = worker.submit(work, stop, done)
        try:
            while not future.done():
                progress(min(1.0, float(done[0]) / max(1, int(done[1]))))
                try:
                    future.result(timeout=_PERIOD)
                except NotYet:
                    if future.done():
                        raise  # the work's own
            result = future.result()
            progress(1.0)
            return result
        except BaseException:
            stop[0] = 1
            raise
        finally:
            if isinstance(progress, _Bar):
                progress.close()


def bar(share: float) -> str:
    """Return a bar that is filled by a share from 0 to 1, and empty for NaN.

    Examples
    --------
    >>> bar(0.25)
    '|##########                              |  25%'
    >>> bar(float('nan'))
    '|                                        |   ?%'
    """
    if isnan(share):
        return f'|{"":{_BAR}}|   ?%'
    return f'|{"#" * round(share * _BAR):<{_BAR}}| {share:4.0%}'


class _Bar:
    """A line on the terminal that fills."""

    def __init__(self, title):
        self._title = title
        self._begun = time.monotonic()
        self._shown = False

    def __call__(self, share):
        if self._shown or time.monotonic() - self._begun > _PATIENCE:
            self._shown = True
            sys.stderr.write(f'\r{self._title} {bar(share)}')
            sys.stderr.flush()

    def close(self):
        if self._shown:
            sys.stderr.write('\n')


def film_of(movie: str | Path | tuple | None) -> tuple[Path | None, float]:
    """Return the file to write and the time [s] between its frames.

    Parameters
    ----------
    movie : path, or tuple of path and float [s], optional

    Raises
    ------
    InvalidInput
        If the file ends neither in .gif nor in .mp4, or the time is not above 0.
    RuntimeError
        If it is an .mp4 and ffmpeg is not installed.
    """
    if movie is None:
        return None, 0.05
    from mobile_planning.drawing.animation import check_film

    path, interval = movie if isinstance(movie, tuple) else (movie, 0.05)
    if not (np.isfinite(interval) and interval > 0):
        raise InvalidInput(f'interval {interval} s between frames is not a finite number above 0')
    try:
        check_film(path)
    except ValueError as error:
        raise InvalidInput(str(error)) from None
    return Path(path), float(interval)
