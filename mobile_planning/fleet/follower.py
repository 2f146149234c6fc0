"""Follower: one robot's part in a joint plan that is in force."""
from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from mobile_planning.fleet.joint_message import JointPlan
from mobile_planning.fleet.roadmap import distances

#: So near to a move [m] a robot is on it; so near to its end it has completed it.
_BESIDE, _REACHED = 0.3, 0.15
#: After this [s] without progress it goes back to the line of its move.
_BACK = 1.0
#: A move is led to when whoever goes before it has no more than so many moves to go, for these will be over.
_SOON = 1


class Follower:
    """How far a robot is on its way, and how far it may go.

    Parameters
    ----------
    plan : JointPlan
    robot_id : int
        Of the member.
    now : float [s]

    Attributes
    ----------
    done : int
        Moves that the body has completed; -1 as long as it is not on its way.
    progress : dict of int to int
        Moves that each member's own plan in force completes, as far as is known. It is always driven to its end, so
        that whoever waits for it may set out earlier; earlier still where the next plan will complete what is waited
        for. Should it not, the contracts keep the two apart.
    """

    def __init__(self, plan: JointPlan, robot_id: int, now: float):
        self.plan, self.done = plan, -1
        self.progress = dict.fromkeys(plan.members, 0)
        self._id, index = robot_id, plan.members.index(robot_id)
        self._way, self._needs = plan.ways[index], plan.needs[index]
        self._moved_at = self._waiting_since = self._now = now

    @property
    def moves(self) -> int:
        """Moves of the way."""
        return len(self._needs)

    @property
    def released(self) -> int:
        """Up to which move the robot may go now."""
        count = max(self.done, 0)
        while count < self.moves and not self.waits_for(count):
            count += 1
        return count

    def waits_for(self, move: int) -> list[int]:
        """Return the members that must go on before a move may begin; none where there is no such move."""
        return [other for other, count in self._needs[move] if not self._soon_over(other, count)
                ] if move < self.moves else []

    def _soon_over(self, other, count):
        """Whether a member's plan in force completes so many moves, or its next one will, as nobody is before it."""
        known = self.progress[other]
        if known >= count or known == 0 or known < count - _SOON:
            return known >= count
        needs = self.plan.needs[self.plan.members.index(other)][known:count]
        return all(third == self._id or self.progress[third] >= moves for need in needs for third, moves in need)

    @property
    def has_finished(self) -> bool:
        """Whether the robot has completed all its moves."""
        return self.done >= self.moves or not self.moves

    @property
    def stuck(self) -> float:
        """How long [s] the robot could go on and does not."""
        return self._now - self._moved_at

    @property
    def waiting(self) -> float:
        """How long [s] the robot has completed no move, whyever; 0 when it has completed all."""
        return self._now - self._waiting_since

    def learn(self, progress: Mapping[int, int]) -> None:
        """Take in what another knows of the members' progress."""
        for member, moves in progress.items():
            if member in self.progress and member != self._id:
                self.progress[member] = max(self.progress[member], moves)

    def advance(self, position: NDArray[np.float64], plan_end: NDArray[np.float64], now: float) -> None:
        """Note where the body is and where its plan in force ends, (2,) [m] each, at ``now`` [s]."""
        before, released, self._now = self.done, self.released, now
        self.done = self._completed(position, self.done, released)
        promised = max(self.progress[self._id], self.done)
        self.progress[self._id] = max(promised, self._completed(plan_end, promised, released), 0)
        if self.done != before or released <= self.done:
            self._moved_at = now
        if self.done != before or self.has_finished:
            self._waiting_since = now

    def _completed(self, place, count, released):
        """Return how many moves are completed at ``place`` by who has completed ``count``.

        It is on the last of the nearest moves. To leave some out is right: whoever is released waits for nobody.
        """
        first = max(count, 0)
        if released <= first:
            is_there = np.linalg.norm(place - self._way[0]) < _BESIDE
            return 0 if count < 0 and is_there else count
        gaps = distances(self._way[first:released], self._way[first + 1:released + 1], place)[:, 0]
        if gaps.min() > _BESIDE:
            return count
        on = first + int(np.flatnonzero(gaps <= gaps.min() + 0.02)[-1])
        return on + 1 if np.linalg.norm(place - self._way[on + 1]) < _REACHED else on

    def way(self, position: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return way-points (W, 2) [m] from ``position`` to where the robot may go now."""
        released = self.released
        ahead = self._way[min(self.done + 1, released):released + 1]
        if self.stuck > _BACK and 0 <= self.done < released:
            ahead = np.concatenate([_nearest(position, *self._way[self.done:self.done + 2])[None], ahead])
        way = np.concatenate([np.asarray(position, float)[None], ahead])
        moves = np.linalg.norm(np.diff(way, axis=0), axis=1) > 1e-6
        # The end stays exactly where it is: it may be the goal.
        return np.concatenate([way[:1], way[1:][moves]]) if moves.any() else way[-1:]

    def is_over(self, gone: Collection[int]) -> bool:
        """Return whether all members but those that are ``gone`` have finished."""
        return self.has_finished and all(self.progress[member] >= self.plan.moves(member)
                                         for member in self.plan.members if member != self._id and member not in gone)


def _nearest(point, a, b):
    """Return the point (2,) of the segment from a to b that is nearest."""
    along = b - a
    return a + np.clip((point - a) @ along / max(along @ along, 1e-18), 0.0, 1.0) * along
