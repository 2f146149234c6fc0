"""Logbook: what a body has driven and where it is, for the next process that is to drive it."""
from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan

#: Of a file that has become larger the older half is left out [bytes]: at four plans a second, some twenty minutes.
_LARGEST = 1 << 24


@dataclass(frozen=True)
class Entry:
    """A plan, when it was committed [s], NaN for one to begin with, and the boot epoch of the process."""

    plan: Plan
    commit: float
    epoch: int


class Logbook:
    """A file that holds the plans of one robot, under all its processes.

    Each is written before it is told to anybody, so that a process that is killed at any instant leaves what it stood
    by. The file outlives processes, not a loss of power.

    Parameters
    ----------
    path : path
        In a folder that exists.
    """

    def __init__(self, path: str | Path):
        self._path = Path(path)

    def write(self, entry: Entry) -> None:
        """Add an entry.

        Raises
        ------
        OSError
            The file cannot be written.
        """
        line = json.dumps(as_fields(entry))
        with self._path.open('a') as file:
            size = file.tell() + file.write(line + '\n')
        if size > _LARGEST:
            self._leave_out_half()

    def _leave_out_half(self):
        """Keep the newer half: a process that is killed meanwhile leaves the whole file."""
        lines = self._path.read_text().splitlines(keepends=True)
        kept = self._path.with_name(self._path.name + '.new')
        kept.write_text(''.join(lines[len(lines) // 2:]))
        kept.replace(self._path)

    def read(self) -> tuple[Entry, ...]:
        """Return all entries, the oldest first; a last line that was cut off is left out.

        Raises
        ------
        InvalidInput
            The file holds something else.
        """
        try:
            if self._path.stat().st_size > 2 * _LARGEST:
                raise InvalidInput(f'logbook {self._path} has more than {2 * _LARGEST} bytes')
            *lines, _ = self._path.read_text().split('\n')
            return tuple(entry(json.loads(line)) for line in lines)
        except FileNotFoundError:
            return ()
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            raise InvalidInput(f'logbook {self._path} cannot be read: {error}') from None


def as_fields(entry: Entry) -> dict[str, object]:
    """Return an entry as JSON can hold it."""
    plan = entry.plan
    return {'epoch': entry.epoch, 'commit': _or_none(entry.commit), 'first_knot': plan.first_knot, 'step': plan.step,
            'points': plan.points.tolist(), 'heading': plan.heading, 'final_heading': _or_none(plan.final_heading),
            'reverse': plan.reverse}


def entry(fields: Mapping[str, object]) -> Entry:
    """Return the entry that `as_fields` has taken apart."""
    plan = Plan(fields['first_knot'], fields['step'], fields['points'], fields['heading'],
                _or_nan(fields['final_heading']), fields['reverse'])
    return Entry(plan, _or_nan(fields['commit']), int(fields['epoch']))


def _or_none(number):
    return None if np.isnan(number) else float(number)


def _or_nan(number):
    return np.nan if number is None else float(number)
