"""Faults: what goes wrong in a simulated mission, said in advance, or drawn from a seed."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.channel import Burst, Cut, Partition

#: Between two bursts of a radio, and how long one lasts [s], on average; they end after so long [s].
_GOOD, _BAD, _BURSTS_END = 8.0, 1.0, 40.0
#: The long interruptions of a storm [s].
_LONG = 16.0


@dataclass(frozen=True)
class SolveTime:
    """How long a robot thinks about a section.

    Attributes
    ----------
    least, most : float [s]
        Evenly drawn between them.
    late_share : float
        Share of the sections that take ``late`` instead, 0 to 1.
    late : float [s]
    """

    least: float = 0.001
    most: float = 0.06
    late_share: float = 0.0
    late: float = 0.4

    def __post_init__(self):
        if not (0.0 <= self.least <= self.most < np.inf and 0.0 <= self.late < np.inf):
            raise InvalidInput(f'solve times of {self.least} to {self.most} s, or {self.late} s, are out of range')
        if not 0.0 <= self.late_share <= 1.0:
            raise InvalidInput(f'late_share is {self.late_share}, not a share in 0..1')

    def draw(self, rng: np.random.Generator) -> float:
        """Return the time [s] that the next section takes."""
        late, share = rng.random(2).tolist()
        return self.late if late < self.late_share else self.least + share * (self.most - self.least)


@dataclass(frozen=True)
class Kill:
    """The end of one robot's process; its body drives the plan in force to its end.

    Attributes
    ----------
    robot : int
    time : float [s]
        From the start of the mission.
    restart_after : float [s]
        A new process starts so long after, but not before the body rests; infinite for never.
    is_certified : bool
        A supervisor tells the others of the death once the body must rest, and repeats it while the robot is dead.
    """

    robot: int
    time: float
    restart_after: float = np.inf
    is_certified: bool = False

    def __post_init__(self):
        if not (0.0 <= self.time < np.inf and self.restart_after > 0.0):
            raise InvalidInput(f'robot {self.robot} cannot die at {self.time} s and restart {self.restart_after} s '
                               'after')


@dataclass(frozen=True)
class Join:
    """A robot that is switched on late: until then it rests at its dock, and the others know."""

    robot: int
    time: float

    def __post_init__(self):
        if not 0.0 < self.time < np.inf:
            raise InvalidInput(f'robot {self.robot} cannot join at {self.time} s')


@dataclass(frozen=True)
class Faults:
    """What goes wrong in a mission, beside loss and delay.

    Attributes
    ----------
    skew : float [s]
        Greatest error of a robot's clock; each robot's is off by this much, by as much the other way, or not at all.
    duplicates : float
        Share of the messages that arrive twice.
    radio_range : float [m]
        Between two bodies; messages do not reach farther.
    interruptions : tuple of Cut, Partition or Burst
    solve : SolveTime
    is_threaded : bool
        A robot takes in messages while it plans; else they wait until it has committed.
    kills : tuple of Kill
    joins : tuple of Join
    any_phase : bool
        Cycles start at any time, instead of when it suits the robot, just in time for a knot of its clock.
    """

    skew: float = 0.0
    duplicates: float = 0.0
    radio_range: float = np.inf
    interruptions: tuple[Cut | Partition | Burst, ...] = ()
    solve: SolveTime = SolveTime()
    is_threaded: bool = True
    kills: tuple[Kill, ...] = ()
    joins: tuple[Join, ...] = ()
    any_phase: bool = False

    def __post_init__(self):
        if not (0.0 <= self.skew < np.inf and self.radio_range > 0.0):
            raise InvalidInput(f'a clock error of {self.skew} s or a radio range of {self.radio_range} m is none')

    def require_known(self, robot_ids: Sequence[int]) -> None:
        """Raise InvalidInput where a fault befalls a robot that is not there, or not there yet."""
        named = [fault.robot for fault in (*self.kills, *self.joins)]
        for each in self.interruptions:
            named += _named_by(each)
        if not set(named) <= set(robot_ids):
            raise InvalidInput(f'there are no robots {sorted(set(named) - set(robot_ids))} for faults to befall')
        since = {join.robot: join.time for join in self.joins}
        for kill in self.kills:
            if kill.time <= since.get(kill.robot, -1.0):
                raise InvalidInput(f'robot {kill.robot} is killed at {kill.time} s, before it joins')


class FaultKind(Enum):
    """Families of faults of the campaigns."""

    NONE = 'none'
    NET = 'net'
    DEATH = 'death'
    KILL = 'kill'
    RESTART = 'restart'
    JOIN = 'join'
    STORM = 'storm'
    ALL = 'all'


def draw_faults(kind: FaultKind | str, robot_ids: Sequence[int], seed: int, skew: float = 0.0) -> Faults:
    """Return faults of one ``kind``, drawn from ``seed``.

    All kinds have cycles at any phase, doubled messages, and sections of which one in a hundred comes late.

    Parameters
    ----------
    kind : FaultKind
        ``NET``: two partitions and two one-way cuts. ``DEATH``: one robot dies for good, and a supervisor certifies
        that. ``KILL``: the same, but half of the time nobody does. ``RESTART``: one dies and restarts. ``JOIN``: one is
        switched on late. ``STORM``: as ``NET``, and one cut and one partition of 16 s, and bursts of some second in
        which a radio is silent; one robot restarts and one joins. ``ALL``: as ``STORM``, and one robot dies for good,
        with a certificate. Each robot dies, restarts or joins but once, as far as there are robots for it.
    robot_ids : sequence of int
    seed : int
    skew : float [s]
        Greatest error of a clock.

    Raises
    ------
    InvalidInput
        There is no such kind, or the seed is below 0.
    """
    try:
        kind = FaultKind(kind)
    except ValueError:
        raise InvalidInput(f'faults {kind!r} are none of {", ".join(each.value for each in FaultKind)}') from None
    if seed < 0:
        raise InvalidInput(f'seed is {seed}, below 0')
    rng = np.random.default_rng(seed)
    ids = [int(each) for each in rng.permutation(robot_ids)]
    victims, kills, joins, interruptions = iter(ids), [], [], []
    storm = FaultKind.STORM, FaultKind.ALL
    if kind in (FaultKind.NET, *storm) and len(ids) > 1:
        interruptions = _interruptions(rng, ids)
    if kind in (FaultKind.DEATH, FaultKind.KILL, FaultKind.ALL):
        kills += [Kill(robot, rng.uniform(2.0, 8.0), is_certified=kind is not FaultKind.KILL or bool(rng.integers(2)))
                  for robot in _next(victims)]
    if kind in (FaultKind.RESTART, *storm):
        kills += [Kill(robot, rng.uniform(2.0, 8.0), rng.uniform(0.5, 5.0)) for robot in _next(victims)]
    if kind in (FaultKind.JOIN, *storm):
        joins += [Join(robot, rng.uniform(1.0, 8.0)) for robot in _next(victims)]
    if kind in storm and len(ids) > 1:
        interruptions += _long_interruptions(rng, ids) + _bursts(rng, ids)
    return Faults(skew, 0.1, interruptions=tuple(interruptions), solve=SolveTime(late_share=0.01),
                  is_threaded=bool(rng.integers(2)), kills=tuple(kills), joins=tuple(joins),
                  any_phase=True)


def _next(victims):
    """Return the next of ``victims`` in a list, or an empty one."""
    return [robot for robot in [next(victims, None)] if robot is not None]


def _named_by(interruption):
    if isinstance(interruption, Partition):
        return interruption.ids
    return (interruption.robot,) if isinstance(interruption, Burst) else (interruption.sender, interruption.receiver)


def _interruptions(rng, ids):
    found = []
    for _ in range(2):
        since = rng.uniform(0.5, 10.0)
        found.append(Partition(_half(rng, ids), since, since + 3.0))
        since, (sender, receiver) = rng.uniform(0.5, 10.0), rng.permutation(ids)[:2].tolist()
        found.append(Cut(sender, receiver, since, since + rng.uniform(2.0, 8.0)))
    return found


def _long_interruptions(rng, ids):
    (sender, receiver), (a, b) = rng.permutation(ids)[:2].tolist(), rng.uniform(0.5, 10.0, 2).tolist()
    return [Cut(sender, receiver, a, a + _LONG), Partition(_half(rng, ids), b, b + _LONG)]


def _half(rng, ids):
    return frozenset(rng.permutation(ids)[:len(ids) // 2].tolist())


def _bursts(rng, ids):
    """Return the silences of each robot's radio: good and bad times by turns (Gilbert), each of random length."""
    found = []
    for robot in ids:
        since = rng.exponential(_GOOD)
        while since < _BURSTS_END:
            until = since + rng.exponential(_BAD)
            found.append(Burst(robot, since, until))
            since = until + rng.exponential(_GOOD)
    return found
