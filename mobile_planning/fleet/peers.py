"""Peers: from whom a robot takes messages at all, how late they come, and what the clocks of the others show.

Nothing on a topic without authentication is proof of who speaks. What can be had is that nobody takes the place of a
robot that still speaks, that nobody drowns the others, and that whatever was turned away is counted.
"""
from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from math import inf, isnan, nan

from mobile_planning.errors import InvalidInput

#: Robots that are kept in the table.
MAX_PEERS = 512
#: The least lag of so long [s], and of as long before, counts.
_WINDOW = 10.0


@dataclass
class _Peer:
    """One robot as heard."""

    participant: bytes | None
    epoch: int
    heard_at: float
    tokens: float
    filled_at: float
    spoke_at: float = -inf
    told: float = nan
    lags: list[float] = field(default_factory=lambda: [inf, inf])
    lags_since: float = -inf


class PeerTable:
    """Who speaks as which robot.

    Robot ids are bound to the first process that is heard with them, and to its boot epoch. Another process may take
    over with a greater epoch, once the one before is silent.

    Parameters
    ----------
    silent_after : float [s]
        A robot that was not heard for so long is silent.
    most_age : float [s]
        What was said longer ago, or is said to come from as far ahead, is stale.
    rate, burst : float [1/s], int
        A robot may say so much, and so much at once.

    Attributes
    ----------
    refused : Counter of str
        How often messages were turned away, by why.

    Raises
    ------
    InvalidInput
        A number is not positive.

    Examples
    --------
    >>> table = PeerTable()
    >>> table.admit(7, 3, b'one process', stamp=100.0, time=100.1, now=5.0)
    >>> table.admit(7, 4, b'another', stamp=100.2, time=100.3, now=5.2)
    Traceback (most recent call last):
        ...
    mobile_planning.errors.InvalidInput: robot 7 speaks, and another process speaks as robot 7: it is not listened to
    """

    def __init__(self, *, silent_after: float = 1.0, most_age: float = 2.0, rate: float = 150.0, burst: int = 100):
        if not (silent_after > 0 and most_age > 0 and rate > 0 and burst >= 1):
            raise InvalidInput(f'silent_after {silent_after} s, most_age {most_age} s, rate {rate} 1/s or burst '
                               f'{burst} is out of range')
        self.refused: Counter[str] = Counter()
        self._silent_after, self._most_age, self._rate, self._burst = silent_after, most_age, rate, burst
        self._peers: dict[int, _Peer] = {}

    def admit(self, robot_id: int, epoch: int, participant: bytes | None, *, stamp: float, time: float,
              now: float) -> None:
        """Let a message in, or say why not.

        Parameters
        ----------
        robot_id, epoch : int
            As the message says.
        participant : bytes or None
            The process that it came from; None where the middleware does not tell.
        stamp : float [s]
            When it was said, by the clock of the sender.
        time : float [s]
            By the own one.
        now : float [s]
            By a clock that nobody sets.

        Raises
        ------
        InvalidInput
            It is not to be listened to.
        """
        peer = self._peers.get(robot_id)
        if peer is None:
            peer = self._newcomer(robot_id, epoch, participant, now)
        elif participant != peer.participant:
            if epoch <= peer.epoch or now - peer.heard_at <= self._silent_after:
                self._refuse('spoofed', f'robot {robot_id} speaks, and another process speaks as robot {robot_id}: '
                                        'it is not listened to')
            peer = self._newcomer(robot_id, epoch, participant, now)
        peer.tokens = min(float(self._burst), peer.tokens + self._rate * (now - peer.filled_at))
        peer.filled_at = now
        if peer.tokens < 1.0:
            self._refuse('flooding', f'robot {robot_id} says more than {self._rate:g} things a second')
        peer.tokens -= 1.0
        if epoch < peer.epoch:
            self._refuse('replayed', f'robot {robot_id} was started anew: what comes from its life before, '
                                     f'{epoch}, says nothing any more')
        if not abs(time - stamp) <= self._most_age:
            self._refuse('stale', f'what robot {robot_id} says is stamped {stamp - time:+.3f} s from now, '
                                  f'beyond {self._most_age:g} s')
        peer.epoch, peer.heard_at = epoch, now

    def note(self, robot_id: int, lag: float, told: float, now: float) -> None:
        """Take in what a RobotMsg that was let in says of the clocks.

        Parameters
        ----------
        robot_id : int
        lag : float [s]
            From its stamp to its arrival, by the own clock.
        told : float [s]
            The least lag of this robot's messages there, as the peer says; NaN for unknown.
        now : float [s]
        """
        peer = self._peers[robot_id]
        if now - peer.lags_since > _WINDOW:
            peer.lags, peer.lags_since = [peer.lags[1], inf], now
        peer.lags[1] = min(peer.lags[1], lag)
        peer.told, peer.spoke_at = told, now

    def lag(self, robot_id: int) -> float:
        """Return the least lag [s] lately of what a robot said, by the own clock; NaN for unknown."""
        peer = self._peers.get(robot_id)
        least = inf if peer is None else min(peer.lags)
        return least if least < inf else nan

    def clock_error(self, robot_id: int) -> float:
        """Return by how much [s] the clock of a robot differs from the own one at least; 0 where they may agree.

        A message cannot arrive before it is sent: the clock of the other is ahead by no less than minus the lag of
        what it says, and by no more than the lag of what it hears.
        """
        peer, lag = self._peers.get(robot_id), self.lag(robot_id)
        if peer is None or isnan(lag):
            return 0.0
        behind = 0.0 if isnan(peer.told) else -peer.told
        return max(0.0, -lag, behind)

    def silent(self, roster: Iterable[int], now: float) -> list[int]:
        """Return who of ``roster`` has sent no RobotMsg lately."""
        return [robot_id for robot_id in roster if robot_id not in self._peers
                or now - self._peers[robot_id].spoke_at > self._silent_after]

    def is_silent(self, robot_id: int, now: float) -> bool:
        """Return whether a robot has said nothing lately."""
        peer = self._peers.get(robot_id)
        return peer is None or now - peer.heard_at > self._silent_after

    def _newcomer(self, robot_id, epoch, participant, now):
        if robot_id not in self._peers and len(self._peers) >= MAX_PEERS:
            oldest = min(self._peers, key=lambda known: self._peers[known].heard_at)
            if now - self._peers[oldest].heard_at <= self._silent_after:
                self._refuse('crowded out', f'{MAX_PEERS} robots are heard: robot {robot_id} is not listened to')
            del self._peers[oldest]
        peer = self._peers[robot_id] = _Peer(participant, epoch, now, float(self._burst), now)
        return peer

    def _refuse(self, reason, sentence):
        self.refused[reason] += 1
        raise InvalidInput(sentence)
