"""Body and Report: what a robot is held to, and what a mission came to, for a person and for JSON."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field

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
    """

    eyed: int
    radius: float
    start: NDArray[np.float64]
    goal: NDArray[np.float64]
    v_max: float
    omega_max: float
    a_max: float


@dataclass(frozen=True)
class Report:
    """What a mission came to.

    Attributes
    ----------
    name : str
    valid : bool
        All arrived and nothing was violated.
    robots, arrived : int
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
        Before that nobody could have ended the mission, however alone in the world; None if unknown.
    section_times : sequence of float [s]
        To plan each section, of all robots.
    messages, message_bytes : int or None
        What was said, each message counted once; None if unknown.
    dead : int
        Robots whose process did not run at the end.
    """

    name: str
    valid: bool
    robots: int
    arrived: int
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
        """Return the fields and the ratio for JSON, which has no infinity: None stands for it.

        The section times are summed up: how many, their median and their 99th percentile [s].
        """
        fields = {**asdict(self), 'ratio': self.ratio, 'section_times': self.section_summary}
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
        rows += [('violation', sentence) for sentence in self.violations]
        return '\n'.join(f'{name:<24}{value}' for name, value in rows)
