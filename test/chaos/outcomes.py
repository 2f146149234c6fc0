"""Outcomes: what came of each storm, as rows of a table and as lines of a file."""
from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from storms import Storm


@dataclass(frozen=True)
class Outcome:
    """One row of the table; times [s] are infinite for never, NaN where nothing is to be said.

    Attributes
    ----------
    storm : str
    arrived : str
        How many robots, of how many.
    gathered : float [s]
        From the start of the processes to that of the mission.
    mission_time : float [s]
    separation, body_gap : float [m]
        Least distance of two centres, by the plans and by odometry.
    noticed : float [s]
        After which the last of the others had called a robot silent that was killed or frozen.
    back : float [s]
        After which a robot that was killed drove again.
    healed : float [s]
        After a cut, until each host had heard each robot of the others.
    frames : str
    violations : tuple of str
    """

    storm: str
    arrived: str
    gathered: float
    mission_time: float
    separation: float
    body_gap: float
    noticed: float
    back: float
    healed: float
    frames: str
    violations: tuple[str, ...]

    @property
    def is_good(self) -> bool:
        """Whether nothing was violated and everybody arrived."""
        done, of = self.arrived.split('/')
        return not self.violations and done == of


class Rows:
    """The rows that have ended, in a file, a line of JSON each.

    Parameters
    ----------
    path : Path
    mission : str
        Rows of other missions, or of storms that were otherwise, are passed over.
    """

    def __init__(self, path: Path, mission: str):
        self._path, self._mission = path, mission
        lines = path.read_text(encoding='utf-8').splitlines() if path.exists() else []
        self._outcomes = {key: Outcome(**{**row, 'violations': tuple(row['violations'])})
                          for key, row in map(json.loads, lines)}

    def __contains__(self, storm: Storm) -> bool:
        return self._key(storm) in self._outcomes

    def __getitem__(self, storm: Storm) -> Outcome:
        return self._outcomes[self._key(storm)]

    def add(self, storm: Storm, outcome: Outcome) -> None:
        """Write a row down."""
        self._outcomes[self._key(storm)] = outcome
        with open(self._path, 'a', encoding='utf-8') as file:
            file.write(json.dumps([self._key(storm), asdict(outcome)]) + '\n')

    def _key(self, storm):
        return f'{self._mission}, {storm}'


def table(outcomes: Sequence[Outcome]) -> str:
    """Return the outcomes as lines of text."""
    calm = next((outcome.mission_time for outcome in outcomes if outcome.storm == 'calm'), np.nan)
    lines = [f'{"storm":<20}{"arrived":>8}{"start":>7}{"time":>7}{"x calm":>8}{"apart":>8}{"bodies":>8}{"noticed":>9}'
             f'{"back":>7}{"healed":>8}  frames']
    for each in outcomes:
        numbers = [f'{value:{width}.{digits}f}' if not np.isnan(value) else ' ' * (width - 1) + '-'
                   for value, width, digits in ((each.gathered, 7, 1), (each.mission_time, 7, 1),
                                                (each.mission_time / calm, 8, 2), (each.separation, 8, 3),
                                                (each.body_gap, 8, 3), (each.noticed, 9, 2), (each.back, 7, 2),
                                                (each.healed, 8, 2))]
        lines.append(f'{each.storm:<20}{each.arrived:>8}{"".join(numbers)}  {each.frames}')
        lines.extend(f'    {violation}' for violation in each.violations)
    return '\n'.join(lines)
