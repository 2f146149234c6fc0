"""Switch: the network between the hosts, and what goes wrong in it."""
from __future__ import annotations

import heapq
import os
import selectors
import threading
from collections.abc import Sequence
from dataclasses import dataclass, field
from time import monotonic

import numpy as np

from hosts import Host

_BROADCAST = 1          # the lowest bit of the first byte: the frame is for many
_LONGEST = 65_536       # bytes of a frame
_QUEUE = 0.5            # seconds that a frame waits for a slow line; longer queues drop it
_AT_ONCE = 64           # frames that are read from one card before the next one's turn


@dataclass(frozen=True)
class Weather:
    """What befalls every frame.

    Attributes
    ----------
    loss, duplicates : float
        Shares.
    delay, jitter : float [s]
        A frame takes ``delay`` and up to ``jitter`` more: frames overtake each other.
    rate : float [bit/s]
        Of what each host receives.
    islands : tuple of frozenset of int
        Hosts that hear only each other; one in no island hears all that are in none.
    """

    loss: float = 0.0
    duplicates: float = 0.0
    delay: float = 0.0
    jitter: float = 0.0
    rate: float = np.inf
    islands: tuple[frozenset[int], ...] = ()

    def __post_init__(self):
        if not (0 <= self.loss <= 1 and 0 <= self.duplicates <= 1 and self.delay >= 0 and self.jitter >= 0
                and self.rate > 0):
            raise ValueError(f'{self} is out of range: shares from 0 to 1, times from 0, a positive rate')

    def parts(self, a: int, b: int) -> bool:
        """Whether the hosts ``a`` and ``b`` do not hear each other."""
        return self._island(a) != self._island(b)

    def _island(self, host):
        return next((number for number, island in enumerate(self.islands) if host in island), -1)


@dataclass
class Counters:
    """Frames so far."""

    received: int = 0
    sent: int = 0
    lost: int = 0
    cut: int = 0
    duplicated: int = 0
    dropped: int = 0


@dataclass(order=True)
class _Due:
    time: float
    order: int
    card: int = field(compare=False)
    frame: bytes = field(compare=False)


class Switch:
    """Carries frames between hosts, in a thread of its own, until it is closed.

    The same seed draws the same fates; which frame meets which is up to real time.

    Parameters
    ----------
    hosts : sequence of Host
    seed : int

    Attributes
    ----------
    weather : Weather
        May be set at any time.
    counters : Counters
    """

    def __init__(self, hosts: Sequence[Host], seed: int = 0):
        self.weather, self.counters = Weather(), Counters()
        self._cards = {host.number: host.card for host in hosts}
        self._rng, self._order = np.random.default_rng(seed), 0
        self._home: dict[bytes, int] = {}
        self._due: list[_Due] = []
        self._free_at = dict.fromkeys(self._cards, 0.0)
        self._selector = selectors.DefaultSelector()
        for number, card in self._cards.items():
            self._selector.register(card, selectors.EVENT_READ, number)
        self._bell, self._rope = os.pipe()
        self._selector.register(self._bell, selectors.EVENT_READ, None)
        self._thread = threading.Thread(target=self._run, name='switch', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Stop; frames under way are lost."""
        os.write(self._rope, b'.')
        self._thread.join()
        self._selector.close()
        os.close(self._bell)
        os.close(self._rope)

    def __enter__(self) -> Switch:
        return self

    def __exit__(self, *exception) -> None:
        self.close()

    def _run(self):
        while True:
            wait = None if not self._due else max(0.0, self._due[0].time - monotonic())
            for key, _ in self._selector.select(wait):
                if key.data is None:
                    return
                self._read(key.fd, key.data)
            now = monotonic()
            while self._due and self._due[0].time <= now:
                due = heapq.heappop(self._due)
                self._write(due.card, due.frame)

    def _read(self, card, source):
        """Take in what the host ``source`` sends, and decide on its fate."""
        for _ in range(_AT_ONCE):
            try:
                frame = os.read(card, _LONGEST)
            except BlockingIOError:
                return
            self.counters.received += 1
            target, self._home[frame[6:12]] = self._home.get(frame[:6]), source
            if frame[0] & _BROADCAST or target is None:
                for other in self._cards:
                    if other != source:
                        self._carry(frame, source, other)
            elif target != source:
                self._carry(frame, source, target)

    def _carry(self, frame, source, target):
        weather, counters = self.weather, self.counters
        if weather.parts(source, target):
            counters.cut += 1
            return
        is_lost, is_doubled, *late = self._rng.random(4)
        if is_lost < weather.loss:
            counters.lost += 1
            return
        self._queue(frame, target, weather.delay + late[0] * weather.jitter)
        if is_doubled < weather.duplicates:
            counters.duplicated += 1
            self._queue(frame, target, weather.delay + late[1] * weather.jitter)

    def _queue(self, frame, target, delay):
        now = monotonic()
        begins = max(now, self._free_at[target])
        if begins - now > _QUEUE:
            self.counters.dropped += 1
            return
        self._free_at[target] = begins + 8 * len(frame) / self.weather.rate
        due = self._free_at[target] + delay
        if due <= now:
            self._write(self._cards[target], frame)
            return
        self._order += 1
        heapq.heappush(self._due, _Due(due, self._order, self._cards[target], frame))

    def _write(self, card, frame):
        try:
            os.write(card, frame)
            self.counters.sent += 1
        except (BlockingIOError, InterruptedError):
            self.counters.dropped += 1
