"""Logbook: where a body is by its last committed plan, for the next process that is to drive it."""
from __future__ import annotations

import json
import os
from pathlib import Path

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan

#: A larger file is no logbook [bytes].
_LARGEST = 65536


class Logbook:
    """A file that holds the newest plan of one robot.

    It is written before the plan is told to anybody, as a whole or not at all, so that a process that is killed at any
    instant leaves what it stood by. It outlives processes, not a loss of power.

    Parameters
    ----------
    path : path
        In a folder that exists.
    """

    def __init__(self, path: str | Path):
        self._path = Path(path)

    def write(self, plan: Plan, epoch: int) -> None:
        """Keep ``plan``, and the boot epoch of the process that drives it.

        Raises
        ------
        OSError
            The file cannot be written.
        """
        content = {'epoch': epoch, 'first_knot': plan.first_knot, 'step': plan.step, 'points': plan.points.tolist(),
                   'heading': plan.heading, 'reverse': plan.reverse,
                   'final_heading': None if np.isnan(plan.final_heading) else plan.final_heading}
        fresh = self._path.with_name(self._path.name + '.new')
        fresh.write_text(json.dumps(content))
        os.replace(fresh, self._path)

    def read(self) -> tuple[Plan, int] | None:
        """Return the plan and the epoch that were kept; None if there are none.

        Raises
        ------
        InvalidInput
            The file holds something else.
        """
        try:
            if self._path.stat().st_size > _LARGEST:
                raise InvalidInput(f'logbook {self._path} has more than {_LARGEST} bytes')
            content = json.loads(self._path.read_text())
            final = content['final_heading']
            plan = Plan(content['first_knot'], content['step'], content['points'], content['heading'],
                        np.nan if final is None else final, content['reverse'])
            return plan, int(content['epoch'])
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            raise InvalidInput(f'logbook {self._path} cannot be read: {error}') from None
