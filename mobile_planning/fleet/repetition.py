"""Repetition: what seems lost on its way is said again, a few times soon and then more rarely."""
from __future__ import annotations

from collections.abc import Iterable, Iterator, Set
from math import inf

from mobile_planning.fleet.link import Held

#: What seems lost is said so many times, this [s] apart; an open offer then each time that something is heard after
#: this [s].
TIMES, SOON, REPEAT = 3, 0.05, 0.2
#: An owner who has built an offer on a plan so long ago [s] at most is taken to need each new one.
_LIVELY = 1.0


class Repetition:
    """How many times a robot has said its newest offers and its newest plan, and whether to say them once more.

    Times are of the own clock. Only when something is said is decided here, never what.

    Attributes
    ----------
    expects_losses : bool
        Whether messages get lost; where none does, what has no answer yet is not said again soon.
    """

    def __init__(self):
        self.expects_losses = True
        self._offered: dict[int, int] = {}
        self._offered_at: dict[int, float] = {}
        self._plan, self._told, self._told_at = 0, TIMES, -inf

    # Offers, by the peer's id

    def forget_offer(self, other: int) -> None:
        """The newest offer to a peer has its answer, or there is a newer one, which was never said."""
        self._offered.pop(other, None)

    @property
    def offered(self) -> Set[int]:
        """The peers to whom the newest offer was said, and has no answer."""
        return self._offered.keys()

    def offers_again(self, other: int, now: float) -> bool:
        """Return whether the newest offer to a peer is to be said at ``now`` [s], and count it as said then."""
        times = self._offered.get(other, 0)
        if times and now - self._offered_at[other] < (SOON if times < self._times else REPEAT):
            return False
        self._offered_at[other], self._offered[other] = now, times + 1
        return True

    def seldom_offered(self) -> Iterator[int]:
        """Return the peers to whom the newest offer was not said as often yet as what seems lost."""
        return (other for other, times in self._offered.items() if times < self._times)

    # The own plan

    def told(self, sequence: int, now: float) -> None:
        """The newest own plan goes out at ``now`` [s] in the message ``sequence``."""
        self._plan, self._told, self._told_at = sequence, 1, now

    def tells_again(self, now: float, newest: Iterable[Held | None]) -> bool:
        """Return whether to say the own plan again at ``now`` [s], and count it as said then; see `is_plan_awaited`."""
        if now - self._told_at < SOON or not self.is_plan_awaited(newest):
            return False
        self._told, self._told_at = self._told + 1, now
        return True

    def is_plan_awaited(self, newest: Iterable[Held | None]) -> bool:
        """Return whether an owner who lately built offers on the own plans has built none on the newest.

        Parameters
        ----------
        newest : iterable of Held or None
            Of each owner the newest offer.
        """
        if self._told >= self._times:
            return False
        since = self._told_at - _LIVELY
        return any(held is not None and held.base_sequence < self._plan and held.since > since for held in newest)

    @property
    def _times(self):
        """So many times something is said before it is said rarely, or no more."""
        return TIMES if self.expects_losses else 1
