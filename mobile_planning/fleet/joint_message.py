"""What robots tell each other of joint plans: the plan itself, and how far each member is."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.fields import whole

#: Members of a plan, moves of one of them, and all that its moves wait for.
MAX_MEMBERS, MAX_MOVES, MAX_NEEDS = 64, 512, 1 << 14
_FAR = 1e6


@dataclass(frozen=True)
class JointStatus:
    """How a robot stands to the newest joint plan that it has taken part in.

    Attributes
    ----------
    epoch, proposer : int
        Version of that plan; epoch 0 for none. A greater epoch is newer, of two with one epoch that of the lower id.
    is_followed : bool
        Whether the robot still follows it.
    progress : dict of int to int
        Moves of the plan that each member's own plan in force completes, as far as the robot knows.
    stalled : float [s]
        How long the robot has made no progress.
    is_proposing : bool
        Whether it is about to propose a plan.

    Raises
    ------
    InvalidInput
        A field is out of its range.
    """

    epoch: int = 0
    proposer: int = 0
    is_followed: bool = False
    progress: Mapping[int, int] = field(default_factory=dict)
    stalled: float = 0.0
    is_proposing: bool = False

    def __post_init__(self):
        for name in ('epoch', 'proposer'):
            object.__setattr__(self, name, whole(name, getattr(self, name), 0))
        if len(self.progress) > MAX_MEMBERS:
            raise InvalidInput(f'a status tells of {len(self.progress)} members, more than {MAX_MEMBERS}')
        object.__setattr__(self, 'progress', {whole('member', member, 0): whole('moves', moves, 0)
                                              for member, moves in self.progress.items()})
        if not 0.0 <= self.stalled < np.inf:
            raise InvalidInput(f'stalled is {self.stalled} s, not a time')

    @property
    def version(self) -> tuple[int, int]:
        """Of two plans the one with the greater version counts."""
        return self.epoch, -self.proposer


@dataclass(frozen=True, eq=False)
class JointPlan:
    """The ways of a group through a jam, and which move waits for which.

    Attributes
    ----------
    robot_id, boot_epoch, sequence : int
        Who says it, the start of its process, and the how manieth of its joint plans it is.
    epoch, proposer : int
        Version; see `JointStatus`.
    members : tuple of int
        Ids.
    ways : tuple of (K + 1, 2) ndarray [m]
        Of each member; move k leads from point k to point k + 1.
    needs : tuple of tuple of tuple of (int, int)
        For each move of each member the (member id, moves) that must be over before it begins, without those that an
        earlier move has waited for.

    Raises
    ------
    InvalidInput
        A field is out of its range or at odds with another.
    """

    robot_id: int
    boot_epoch: int
    sequence: int
    epoch: int
    proposer: int
    members: tuple[int, ...]
    ways: tuple[NDArray[np.float64], ...]
    needs: tuple[tuple[tuple[tuple[int, int], ...], ...], ...]

    def __post_init__(self):
        for name, least in (('robot_id', 0), ('boot_epoch', 0), ('sequence', 0), ('epoch', 1), ('proposer', 0)):
            object.__setattr__(self, name, whole(name, getattr(self, name), least))
        members = tuple(whole('member', member, 0) for member in self.members)
        if not 1 <= len(members) <= MAX_MEMBERS or len(set(members)) != len(members):
            raise InvalidInput(f'a joint plan has 1 to {MAX_MEMBERS} members, all different, not {members[:99]}')
        if self.proposer not in members or not len(members) == len(self.ways) == len(self.needs):
            raise InvalidInput(f'a joint plan has {len(members)} members with the proposer {self.proposer} among '
                               f'them, but {len(self.ways)} ways and {len(self.needs)} lists of needs')
        object.__setattr__(self, 'members', members)
        object.__setattr__(self, 'ways', tuple(map(_way, self.ways)))
        object.__setattr__(self, 'needs', self._checked_needs())

    def _checked_needs(self):
        moves = {member: len(way) - 1 for member, way in zip(self.members, self.ways)}
        needs = tuple(tuple(tuple((whole('member', other, 0), whole('moves', count, 1)) for other, count in need)
                            for need in each) for each in self.needs)
        if sum(len(need) for each in needs for need in each) > MAX_NEEDS:
            raise InvalidInput(f'the moves of a joint plan wait for more than {MAX_NEEDS} others')
        for member, each in zip(self.members, needs):
            if len(each) != moves[member]:
                raise InvalidInput(f'robot {member} has {moves[member]} moves, but needs for {len(each)}')
            for other, count in (pair for need in each for pair in need):
                if other == member or count > moves.get(other, 0):
                    raise InvalidInput(f'robot {member} cannot wait for {count} moves of robot {other}')
        return needs

    @property
    def version(self) -> tuple[int, int]:
        """Of two plans the one with the greater version counts."""
        return self.epoch, -self.proposer

    def moves(self, member: int) -> int:
        """Return how many moves a member has."""
        return len(self.ways[self.members.index(member)]) - 1


def _way(points):
    try:
        way = np.array(points, float)
    except (TypeError, ValueError):
        raise InvalidInput('a way has numbers only') from None
    if way.ndim != 2 or way.shape[1] != 2 or not 1 <= len(way) <= MAX_MOVES + 1 or not (np.abs(way) <= _FAR).all():
        raise InvalidInput(f'a way has 1 to {MAX_MOVES + 1} finite points (x, y), not an array of shape {way.shape}')
    way.flags.writeable = False
    return way
