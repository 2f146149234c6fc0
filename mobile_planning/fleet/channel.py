"""A seeded channel that loses, delays, doubles and so reorders messages, and that can be cut for a while."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from functools import cache

import numpy as np

from mobile_planning.errors import InvalidInput


@dataclass(frozen=True)
class Cut:
    """One direction of one link that carries nothing for a while.

    Attributes
    ----------
    sender, receiver : int
        Robot ids.
    since, until : float [s]
        From the start of the mission.
    """

    sender: int
    receiver: int
    since: float
    until: float

    def __post_init__(self):
        _require_span(self.since, self.until)

    def stops(self, sender: int, receiver: int, now: float) -> bool:
        """Return whether a message sent at ``now`` [s] is lost to it."""
        return self.since <= now < self.until and (self.sender, self.receiver) == (sender, receiver)


@dataclass(frozen=True)
class Partition:
    """Two groups of robots that do not hear each other for a while.

    Attributes
    ----------
    ids : frozenset of int
        One group; the other is everybody else.
    since, until : float [s]
        From the start of the mission.
    """

    ids: frozenset[int]
    since: float
    until: float

    def __post_init__(self):
        _require_span(self.since, self.until)
        object.__setattr__(self, 'ids', frozenset(self.ids))

    def stops(self, sender: int, receiver: int, now: float) -> bool:
        """Return whether a message sent at ``now`` [s] is lost to it."""
        return self.since <= now < self.until and (sender in self.ids) != (receiver in self.ids)


@dataclass(frozen=True)
class Burst:
    """A robot whose radio neither sends nor receives for a while.

    Attributes
    ----------
    robot : int
    since, until : float [s]
        From the start of the mission.
    """

    robot: int
    since: float
    until: float

    def __post_init__(self):
        _require_span(self.since, self.until)

    def stops(self, sender: int, receiver: int, now: float) -> bool:
        """Return whether a message sent at ``now`` [s] is lost to it."""
        return self.since <= now < self.until and self.robot in (sender, receiver)


@dataclass(frozen=True)
class Channel:
    """How messages fare on their way to one receiver.

    Attributes
    ----------
    loss : float
        Share of the messages that never arrive, 0 to 1.
    delay : float [s]
        Each message takes between ``least`` and ``least + delay``, evenly drawn.
    least : float [s]
        Shortest time on the way.
    duplicates : float
        Share of the messages that arrive that arrive twice, each after a time of its own.
    interruptions : tuple of Cut, Partition or Burst

    Raises
    ------
    InvalidInput
        A number is out of its range.
    """

    loss: float = 0.0
    delay: float = 0.0
    least: float = 0.002
    duplicates: float = 0.0
    interruptions: tuple[Cut | Partition | Burst, ...] = ()

    def __post_init__(self):
        for name in ('loss', 'duplicates'):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise InvalidInput(f'{name} is {getattr(self, name)}, not a share in 0..1')
        if not (0.0 <= self.delay < np.inf and 0.0 <= self.least < np.inf):
            raise InvalidInput(f'delays of {self.delay} s and {self.least} s must be finite and not negative')

    def travel_times(self, rng: np.random.Generator, sender: int | None, receivers: Sequence[int],
                     now: float) -> list[list[float]]:
        """Return for each of the ``receivers`` how long each copy of a message takes [s]; none if it is lost.

        Parameters
        ----------
        rng : numpy.random.Generator
            Asked for as many numbers whatever becomes of the message.
        sender : int or None
            None is no robot, and is cut off by nothing.
        receivers : sequence of int
        now : float [s]
            When it is sent, from the start of the mission.
        """
        times = []
        for receiver, (lost, doubled, *shares) in zip(receivers, rng.random((len(receivers), 4)).tolist()):
            is_cut = self.interruptions and sender is not None and any(
                each.stops(sender, receiver, now) for each in self.interruptions)
            copies = 0 if is_cut or lost < self.loss else 2 if doubled < self.duplicates else 1
            times.append([self.least + share * self.delay for share in shares[:copies]])
        return times


def wire_size(content: object) -> int:
    """Return about how many bytes ``content`` takes on the wire, without the headers of the transport.

    Counted as CDR would without its padding: 8 bytes for a real number, 4 for a whole one, 1 for a yes or no,
    4 for the length of an array, list or table before its entries.

    Examples
    --------
    >>> wire_size([1, 2.0, True, np.zeros((5, 2))])
    101
    """
    return _measure(type(content))(content)


@cache
def _measure(kind):
    """Return the function that measures what is of this ``kind``."""
    for kinds, size in (((type(None), bool, np.bool_), 1), ((int, np.integer), 4), ((float, np.floating), 8)):
        if issubclass(kind, kinds):
            return lambda content: size
    if issubclass(kind, np.ndarray):
        return lambda content: 4 + 8 * content.size
    if is_dataclass(kind):
        names = [each.name for each in fields(kind)]
        return lambda content: sum([wire_size(getattr(content, name)) for name in names])
    if issubclass(kind, Mapping):
        return lambda content: 4 + sum([wire_size(key) + wire_size(value) for key, value in content.items()])
    return lambda content: 4 + sum([wire_size(entry) for entry in content])


def _require_span(since, until):
    if not 0.0 <= since < until < np.inf:
        raise InvalidInput(f'an interruption from {since} s to {until} s is none')
