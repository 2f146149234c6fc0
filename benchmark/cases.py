"""Cases of the fleet's benchmarks: a family of scenarios with its parameters, as the command line names it."""
from dataclasses import replace

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet import scenarios

#: What a release must do, first the open scenes, then the narrow ones.
CASES = ('heritage', 'swap:robots=2', 'swap:robots=4', 'swap:robots=8', 'swap:robots=16', 'line_swap:robots=8',
         'forest:robots=8', 'doorway:robots=4', 'corridor:robots=2', 'intersection:robots=4', 'intersection:robots=8',
         'warehouse:robots=6', 'warehouse:robots=12', 'depot:robots=8', 'maze:robots=6', 'doorway:robots=4,gap=0.6')


def scene_of(case, seed):
    """Return the scene of ``case``, written ``family:parameter=number,...``.

    With ``endless=seconds`` among the parameters robots are given new goals for so long.

    Raises
    ------
    InvalidInput
        There is no such case.
    """
    family, _, listed = case.partition(':')
    parameters, endless = {}, 0.0
    for entry in filter(None, listed.split(',')):
        key, _, value = entry.partition('=')
        try:
            number = float(value)
        except ValueError:
            raise InvalidInput(f'{entry!r} of the case {case!r} is not parameter=number') from None
        if key == 'endless':
            endless = number
        else:
            parameters[key] = int(number) if number.is_integer() and key == 'robots' else number
    scene = scenarios.scene(family, seed, **parameters)
    return replace(scene, endless=endless, timeout=scene.timeout + endless)


def section_times(simulation):
    """Return how long each section of each robot took to plan [s]."""
    return [seconds for solution in simulation.solutions.values() for seconds in solution.section_times]


def middle_and_most(values, form='{:.2f}'):
    """Return median and greatest value as text."""
    return f'{form.format(np.median(values))} ({form.format(np.max(values))})' if len(values) else '-'
