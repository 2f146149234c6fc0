"""History: what was recorded on all hosts, and what can be said of it afterwards."""
from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.solution import Solution

#: `Mission.STARTED`, `RobotMsg.DRIVING`.
_STARTED, _DRIVING = 1, 1


@dataclass(frozen=True)
class History:
    """The lines of all recorders, in the order of their time.

    Attributes
    ----------
    records : tuple of dict
        Each with ``host``, where it was written down.
    """

    records: tuple[dict, ...]

    @classmethod
    def read(cls, files: Iterable[tuple[int, Path]]) -> History:
        """Return what the recorder of each host has written; a last line that was cut off is left out."""
        records = []
        for host, path in files:
            for line in path.read_text(encoding='utf-8').splitlines():
                try:
                    records.append({'host': host, **json.loads(line)})
                except json.JSONDecodeError:
                    continue
        return cls(tuple(sorted(records, key=lambda record: record['heard'])))

    def of(self, kind: str) -> Iterator[dict]:
        """Yield the records of one kind."""
        return (record for record in self.records if record['kind'] == kind)

    @property
    def start(self) -> float:
        """When the mission started [s]; infinite if it never did."""
        return min((record['start'] for record in self.of('mission') if record['state'] == _STARTED), default=np.inf)

    def solutions(self) -> dict[int, Solution]:
        """Return what each robot has published that it drives, under all its processes."""
        said: dict[int, dict[tuple[int, int], tuple[int, Plan, float]]] = {}
        whole: dict[int, dict[tuple[int, int], tuple[int, Plan, float]]] = {}
        done: dict[int, bool] = {}
        for record in self.of('robot'):
            # Later messages hold less of the same plan: its beginning is past.
            key, known = (record['epoch'], record['plan']), said.setdefault(record['robot'], {})
            if key not in known or record['sequence'] < known[key][0]:
                known[key] = record['sequence'], _plan(record), np.nan
            done[record['robot']] = record['done']
        for record in self.of('plan'):
            whole.setdefault(record['robot'], {})[record['epoch'], record['plan']] = 0, _plan(record), record['commit']
        solutions = {}
        for robot, known in said.items():
            # What a process hands in at its end is whole, and has what the processes before it have driven.
            latest = max((epoch for epoch, _ in whole.get(robot, {})), default=-1)
            known = {**{key: of for key, of in whole.get(robot, {}).items() if key[0] == latest},
                     **{key: of for key, of in known.items() if key[0] > latest}}
            _, driven, commits = zip(*(known[key] for key in sorted(known)))
            solutions[robot] = Solution(robot, driven, done[robot], start_time=self.start, commits=commits)
        return solutions

    def least_gap(self) -> float:
        """Return the least distance [m] that two bodies had, by their own odometry; infinite for one body."""
        tracks = {}
        for record in self.of('body'):
            tracks.setdefault(record['robot'], []).append((record['time'], record['x'], record['y']))
        tracks = {robot: np.array(sorted(track)) for robot, track in tracks.items()}
        least = np.inf
        for a, b in combinations(tracks.values(), 2):
            times = np.union1d(a[:, 0], b[:, 0])
            times = times[(times >= max(a[0, 0], b[0, 0])) & (times <= min(a[-1, 0], b[-1, 0]))]
            if len(times):
                at = [np.column_stack([np.interp(times, track[:, 0], track[:, k]) for k in (1, 2)]) for track in (a, b)]
                least = min(least, float(np.linalg.norm(at[0] - at[1], axis=1).min()))
        return least

    def noticed(self, robot: int, gone: float, by: Sequence[int]) -> float:
        """Return after how long [s] the last of the robots ``by`` said that ``robot``, gone since then, is silent."""
        first = {}
        for record in self.of('status'):
            if record['heard'] >= gone and record['robot'] in by and robot in record['silent']:
                first.setdefault(record['robot'], record['heard'] - gone)
        return max(first.values()) if set(first) == set(by) else np.inf

    def back(self, robot: int, gone: float) -> float:
        """Return after how long [s] a process of ``robot`` that was born since spoke, and drove or was done."""
        born = int(gone)
        return min((record['heard'] - gone for record in self.of('robot')
                    if record['robot'] == robot and record['heard'] > gone and record['epoch'] >= born
                    and (record['mode'] == _DRIVING or record['done'])), default=np.inf)

    def heard_again(self, healed: float, homes: dict[int, int]) -> float:
        """Return after how long [s] every host had heard every robot of another host; ``homes`` has each one's."""
        hosts, first = set(homes.values()), {}
        for record in self.of('robot'):
            if record['heard'] >= healed and homes[record['robot']] != record['host']:
                first.setdefault((record['host'], record['robot']), record['heard'] - healed)
        pairs = {(host, robot) for robot, home in homes.items() for host in hosts if host != home}
        return max(first.values()) if pairs <= set(first) else np.inf


def _plan(record):
    return Plan(record['first_knot'], record['step'], np.array(record['points']).reshape(-1, 2), record['heading'],
                record['final_heading'], record['reverse'])
