"""Body, Waiting, Report: what a robot is held to, and what a mission came to, for a person and for JSON."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from math import isnan

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Body:
    """What a robot is held to: its size, its mission, its limits.

    Attributes
    ----------
    eyed : int
    radius : float [m]
        Of the body alone, without margins.
    start, goal : (3,) ndarray [m, m, rad]
    v_max, omega_max, a_max : float [m/s, rad/s, m/s^2]
        Of the acceleration as a vector; that of the turn rate is not judged.
    via : tuple of (3,) ndarray [m, m, rad]
        Goals to be reached before the last one, ``goal``, in order.
    is_under_way : bool
        It moves at its start: its first plan is taken as it begins, and only what follows must go on from it.
    """

    eyed: int
    radius: float
    start: NDArray[np.float64]
    goal: NDArray[np.float64]
    v_max: float
    omega_max: float
    a_max: float
    via: tuple[NDArray[np.float64], ...] = ()
    is_under_way: bool = False

    @property
    def goals(self) -> tuple[NDArray[np.float64], ...]:
        """All goals in order."""
        return *self.via, self.goal


@dataclass(frozen=True)
class Waiting:
    """A living robot that had not arrived when its mission ended, and was not about to by the plan in force.

    Attributes
    ----------
    robot : int
    mode : str
        What it was doing, in lower case.
    since : float [s]
        When it last came nearer to its goal, from the start of the mission on; NaN if unknown.
    place : tuple of float [m]
        Where it was.
    without_word_of : tuple of int
        Peers whose word it lacked to set out: no agreement, or no answer for too long.
    bound_to_dead : tuple of int
        Dead peers with whom its contracts still hold, for nobody has told it of their death.
    behind : tuple of int
        Members of its joint plan that must move first.
    blocked_by : tuple of int
        Robots that stand between it and its goal: no joint plan leads past them.
    is_cut_off : bool
        Whether dead bodies left no way to its goal, or lay on it.
    """

    robot: int
    mode: str
    since: float
    place: tuple[float, float]
    without_word_of: tuple[int, ...] = ()
    bound_to_dead: tuple[int, ...] = ()
    behind: tuple[int, ...] = ()
    blocked_by: tuple[int, ...] = ()
    is_cut_off: bool = False

    def __str__(self) -> str:
        """Return one sentence for a person."""
        whys = [f'may not set out without word of {_robots(self.without_word_of)}'] if self.without_word_of else []
        whys += [f'is bound by contracts with {_robots(self.bound_to_dead)}, dead'] if self.bound_to_dead else []
        whys += [f'lets {_robots(self.behind)} go first by its joint plan'] if self.behind else []
        whys += [f'finds no way past {_robots(self.blocked_by)}'] if self.blocked_by else []
        whys += ['is cut off from its goal by the dead'] if self.is_cut_off else []
        x, y = self.place
        since = '' if isnan(self.since) else f', has come no nearer since {self.since:.1f} s'
        return (f'robot {self.robot}, {self.mode}, at ({x:.2f}, {y:.2f}){since}'
                + ''.join(f'; it {why}' for why in whys))


def _robots(ids):
    return f'robot {ids[0]}' if len(ids) == 1 else f'robots {", ".join(map(str, ids))}'


@dataclass(frozen=True)
class Report:
    """What a mission came to.

    Attributes
    ----------
    name : str
    valid : bool
        All arrived and nothing was violated.
    robots : int
    at_goal : tuple of int
        Robots that had reached all their goals and rest at the last one, or come to rest there by the plan in force.
    min_separation : float [m]
        Between two centres; infinite for one robot.
    min_obstacle_clearance : float [m]
        Between the edge of a body and the static world; infinite where there is none.
    mission_time : float [s]
        From the start to the last arrival.
    violations : list of str
        One sentence each.
    closest : dict or None
        The pair of robots, the time [s] since the start and the two places [m] of the closest approach.
    lower_bound : float or None [s]
        What the mission would take, were each robot alone in the world; None if unknown. Around corners the ways are
        measured some 3 % too long at most, so that a mission may end a little before it; see `makespan.way`.
    section_times : sequence of float [s]
        To plan each section, of all robots.
    messages, message_bytes : int or None
        What was said, each message counted once; None if unknown.
    dead : int
        Robots whose process did not run at the end.
    waiting : tuple of Waiting
        The living robots that are not ``at_goal``, and what is known of why.
    joint_plans : int or None
        That were told; None if unknown.
    goals, arrivals : int
        Goals that the robots were given, and that they reached, each after those before it.
    throughput : float or None [1/min]
        Arrivals until the last one; None without any.
    judged_since : float [s]
        From when on what was driven is judged, since the start of the mission; plans that are older are not known.
    watched_since : float [s]
        From when on what the robots said was checked while they drove, since the start of the mission; before, the
        judge's process did not run.
    """

    name: str
    valid: bool
    robots: int
    at_goal: tuple[int, ...]
    min_separation: float
    min_obstacle_clearance: float
    mission_time: float
    violations: list[str] = field(default_factory=list)
    closest: dict | None = None
    lower_bound: float | None = None
    section_times: Sequence[float] = ()
    messages: int | None = None
    message_bytes: int | None = None
    dead: int = 0
    waiting: tuple[Waiting, ...] = ()
    joint_plans: int | None = None
    goals: int = 0
    arrivals: int = 0
    throughput: float | None = None
    judged_since: float = 0.0
    watched_since: float = 0.0

    @property
    def arrived(self) -> int:
        """Number of robots that are ``at_goal``."""
        return len(self.at_goal)

    @property
    def ratio(self) -> float | None:
        """The mission time over its lower bound; None unless there is one and all have arrived."""
        if not self.lower_bound or self.arrived < self.robots:
            return None
        return self.mission_time / self.lower_bound

    @property
    def section_summary(self) -> dict[str, float] | None:
        """Number, median and 99th percentile [s] of the section times; None without any."""
        times = np.asarray(self.section_times, float)
        if not len(times):
            return None
        return {'count': len(times), 'median': float(np.median(times)), 'p99': float(np.percentile(times, 99))}

    def as_dict(self) -> dict:
        """Return the fields, arrivals and ratio for JSON, which has no infinity: None stands for it.

        The section times are summed up: how many, their median and their 99th percentile [s].
        """
        fields = {**asdict(self), 'arrived': self.arrived, 'ratio': self.ratio, 'section_times': self.section_summary}
        return {key: None if isinstance(value, float) and not np.isfinite(value) else value
                for key, value in fields.items()}

    def table(self) -> str:
        """Return the report for a person."""
        rows = [('mission', self.name), ('valid', 'yes' if self.valid else 'NO'),
                ('arrived', f'{self.arrived} of {self.robots} robots' + (f', {self.dead} dead' if self.dead else '')),
                ('mission time', f'{self.mission_time:.2f} s'),
                ('min separation', f'{self.min_separation:.3f} m between centres'),
                ('min obstacle clearance', f'{self.min_obstacle_clearance:.3f} m')]
        if self.lower_bound is not None:
            times = '' if self.ratio is None else f', the mission took {self.ratio:.2f} times as long'
            rows.append(('lower bound', f'{self.lower_bound:.2f} s{times}'))
        sections = self.section_summary
        if sections is not None:
            rows.append(('sections', f'{sections["count"]}, median {1e3 * sections["median"]:.2f} ms, '
                                     f'99 % within {1e3 * sections["p99"]:.2f} ms'))
        if self.messages is not None:
            size = '' if self.message_bytes is None else f', {self.message_bytes / 1e3:.1f} kB'
            rows.append(('messages', f'{self.messages}{size}'))
        if self.goals > self.robots:
            pace = '' if self.throughput is None else f', {self.throughput:.1f} a minute'
            rows.append(('goals', f'{self.arrivals} of {self.goals} reached{pace}'))
        if self.judged_since > 0.0:
            rows.append(('judged', f'from {self.judged_since:.2f} s on; what was driven before is not known any more'))
        if self.watched_since > 0.0:
            rows.append(('watched', f'from {self.watched_since:.2f} s on; what was said before was not heard'))
        if self.joint_plans:
            rows.append(('joint plans', f'{self.joint_plans}'))
        rows += [('waiting', f'{each}') for each in self.waiting]
        rows += [('violation', sentence) for sentence in self.violations]
        return '\n'.join(f'{name:<24}{value}' for name, value in rows)
