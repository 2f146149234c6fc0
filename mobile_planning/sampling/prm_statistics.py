"""Where the time of a run went, and what is in a roadmap."""
from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class TimeStatistics:
    """Where the time of the last run, a build or a query, went.

    Attributes
    ----------
    sampling, neighbours, collision, search, enhancement, total : float [s]
        Drawing nodes, finding neighbours, checking nodes and edges, shortest paths, adding nodes where no path was
        found (which has its share of the first three), and all of it.

    Examples
    --------
    >>> print(TimeStatistics(search=0.0015, total=0.002))
    sampling      0.000 ms
    neighbours    0.000 ms
    collision     0.000 ms
    search        1.500 ms
    enhancement   0.000 ms
    total         2.000 ms
    """

    sampling: float = 0.0
    neighbours: float = 0.0
    collision: float = 0.0
    search: float = 0.0
    enhancement: float = 0.0
    total: float = 0.0

    def __str__(self) -> str:
        return '\n'.join(f'{name:<12}{1e3 * value:7.3f} ms' for name, value in asdict(self).items())


@dataclass(frozen=True)
class RoadmapStatistics:
    """What is in a roadmap, and what is known of it.

    Attributes
    ----------
    nodes, edges : int
    checked_nodes, checked_edges : int
        Of which it is known whether they are free.
    blocked_nodes, blocked_edges : int
        Of which it is known that they are not.
    radius : float [m]
        The longest edge there may be.
    mean_neighbours : float
        Edges of a node, or out of it, on average.
    """

    nodes: int
    edges: int
    checked_nodes: int
    checked_edges: int
    blocked_nodes: int
    blocked_edges: int
    radius: float
    mean_neighbours: float


class Stopwatch:
    """Adds up the time of the parts of one run."""

    def __init__(self):
        self._began, self._spent = time.perf_counter(), {}

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Count the time of the ``with`` block for a part, a field of `TimeStatistics`."""
        began = time.perf_counter()
        try:
            yield
        finally:
            self._spent[name] = self._spent.get(name, 0.0) + time.perf_counter() - began

    @property
    def elapsed(self) -> float:
        """Time since it was made [s]."""
        return time.perf_counter() - self._began

    def statistics(self) -> TimeStatistics:
        """Return what was counted."""
        return TimeStatistics(**self._spent, total=self.elapsed)
