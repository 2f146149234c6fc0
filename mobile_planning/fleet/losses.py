"""Losses: whether messages get lost on their way, told by the numbers that are missing among those that arrive."""
from __future__ import annotations

from dataclasses import dataclass, field
from math import inf

#: What is missing for so long [s] was not only overtaken.
_OVERTAKEN = 0.5
#: A loss counts for so long [s].
_LATELY = 5.0
#: Until so long [s] after the first message nothing is known yet, and losses are expected.
_UNKNOWN = 1.0
#: Of one gap so many numbers are looked out for.
_MOST = 64


@dataclass
class _Sender:
    """What was heard of one process of a robot."""

    epoch: int
    newest: int
    missing: dict[int, float] = field(default_factory=dict)


class Losses:
    """What of the numbered messages of many senders has not arrived.

    Examples
    --------
    >>> losses = Losses()
    >>> for number in (1, 2, 4, 5):
    ...     losses.note(7, 1, number, now=0.1 * number)
    >>> [losses.are_any(now) for now in (0.5, 1.0, 7.0)]
    [True, True, False]
    """

    def __init__(self):
        self._senders: dict[int, _Sender] = {}
        self._newest, self._began = -inf, inf

    def note(self, sender: int, epoch: int, number: int, now: float) -> None:
        """Take in at ``now`` [s] that a message has arrived; those of one ``epoch`` of a sender are numbered on."""
        self._began = min(self._began, now)
        known = self._senders.get(sender)
        if known is None or known.epoch != epoch:
            self._senders[sender] = _Sender(epoch, number)
            return
        known.missing.pop(number, None)
        for each in range(max(known.newest + 1, number - _MOST), number):
            known.missing[each] = now
        known.newest = max(known.newest, number)

    def are_any(self, now: float) -> bool:
        """Return whether something was lost lately, as seen at ``now`` [s], or it is too early to tell."""
        for known in self._senders.values():
            lost = [number for number, since in known.missing.items() if now - since > _OVERTAKEN]
            for number in lost:
                self._newest = max(self._newest, known.missing.pop(number) + _OVERTAKEN)
        return now - self._newest <= _LATELY or now - self._began < _UNKNOWN
