"""Logbook: what a body has driven, where it is and where it goes, for the next process that is to drive it."""
from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.stage import Stage

#: Of a file that has become larger the older half is left out [bytes]: at four plans a second, some twenty minutes.
_LARGEST = 1 << 24
#: What a line with a stage begins with.
_STAGE = 'stage'


@dataclass(frozen=True)
class Entry:
    """A plan, when it was committed [s], NaN for one to begin with, and the boot epoch of the process."""

    plan: Plan
    commit: float
    epoch: int


class Logbook:
    """A file that holds the plans of one robot and the stages of its journey, under all its processes.

    Each is written before it is told to anybody, so that a process that is killed at any instant leaves what it stood
    by. The file outlives processes, not a loss of power.

    Parameters
    ----------
    path : path
        In a folder that exists; empty for no file, which is never written and holds nothing.
    give_up : callable, optional
        Told why the file cannot be written; it is not written on then.
    """

    def __init__(self, path: str | Path = '', give_up: Callable[[OSError], None] = lambda error: None):
        self._path, self._give_up = Path(path) if path else None, give_up
        self._is_written, self._is_whole = bool(path), False

    def write(self, entry: Entry) -> None:
        """Add a plan."""
        self._add(as_fields(entry))

    def note(self, stage: Stage) -> None:
        """Add a stage."""
        self._add({_STAGE: stage.as_fields()})

    def _add(self, fields):
        if not self._is_written:
            return
        try:
            self._mend()
            with self._path.open('a') as file:
                size = file.tell() + file.write(json.dumps(fields) + '\n')
            if size > _LARGEST:
                self._leave_out_half()
        except OSError as error:
            self._is_written = False
            self._give_up(error)

    def _mend(self):
        """Leave out, once, a last line that a process before has cut off: another one is not to go on from it."""
        if not self._is_whole and self._path.exists():
            text = self._path.read_bytes()
            os.truncate(self._path, text.rfind(b'\n') + 1)
        self._is_whole = True

    def _leave_out_half(self):
        """Keep the newer half and the newest stage: a process that is killed meanwhile leaves the whole file."""
        lines = self._path.read_text().splitlines(keepends=True)
        older, newer = lines[:len(lines) // 2], lines[len(lines) // 2:]
        if not any(map(_is_stage, newer)):
            newer = [*list(filter(_is_stage, older))[-1:], *newer]
        kept = self._path.with_name(self._path.name + '.new')
        kept.write_text(''.join(newer))
        kept.replace(self._path)

    def read(self) -> tuple[Entry, ...]:
        """Return all plans, the oldest first; a last line that was cut off is left out.

        Raises
        ------
        InvalidInput
            The file holds something else.
        """
        return self._read(lambda fields: None if _STAGE in fields else entry(fields))

    def stages(self) -> tuple[Stage, ...]:
        """Return all stages, likewise."""
        return self._read(lambda fields: Stage.of(fields[_STAGE]) if _STAGE in fields else None)

    def _read(self, content):
        """Return what ``content`` makes of each line, where that is something."""
        if self._path is None:
            return ()
        try:
            if self._path.stat().st_size > 2 * _LARGEST:
                raise InvalidInput(f'logbook {self._path} has more than {2 * _LARGEST} bytes')
            *lines, _ = self._path.read_text().split('\n')
            return tuple(filter(None, (content(json.loads(line)) for line in lines)))
        except FileNotFoundError:
            return ()
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            raise InvalidInput(f'logbook {self._path} cannot be read: {error}') from None


def _is_stage(line):
    return line.startswith(f'{{"{_STAGE}"')


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
