"""Storms: what goes wrong in a run, and when."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from switch import Weather


class Begin(Enum):
    """When a storm begins."""

    MISSION = 'with the mission'
    PROCESSES = 'before the processes: they find each other in it'


@dataclass(frozen=True)
class Blow:
    """One process is hit.

    Attributes
    ----------
    at : float [s]
        After the storm began.
    target : str
        Name of the process.
    frozen : float [s]
        For so long it is stopped; 0: it is killed, and started again at once.
    """

    at: float
    target: str
    frozen: float = 0.0


@dataclass(frozen=True)
class Cut:
    """The hosts ``island`` hear no other from ``at`` [s] after the storm began, for ``duration`` [s]."""

    at: float
    duration: float
    island: frozenset[int] = frozenset({3})


@dataclass(frozen=True)
class Storm:
    """One row of the matrix.

    Attributes
    ----------
    weather : Weather
    blows : tuple of Blow
    cuts : tuple of Cut
    begin : Begin
    """

    name: str
    weather: Weather = Weather()
    blows: tuple[Blow, ...] = ()
    cuts: tuple[Cut, ...] = ()
    begin: Begin = Begin.MISSION


def matrix(robots: Sequence[int], seed: int) -> list[Storm]:
    """Return all rows; times and victims are drawn from the seed."""
    rng = np.random.default_rng(seed)

    def blow(target, frozen=0.0):
        return Blow(float(rng.uniform(1.0, 6.0)), target, frozen)

    def robot():
        return f'robot_{rng.choice(robots)}'
    rough = Weather(loss=0.2, delay=0.1, jitter=0.05, duplicates=0.1)
    weathers = {'loss 10 %': Weather(loss=0.1), 'loss 20 %': Weather(loss=0.2), 'loss 35 %': Weather(loss=0.35),
                'loss 50 %': Weather(loss=0.5), 'delay 100 ms': Weather(delay=0.1), 'delay 300 ms': Weather(delay=0.3),
                'jitter 100 ms': Weather(jitter=0.1), 'duplicates 30 %': Weather(duplicates=0.3),
                'rate 4 Mbit/s': Weather(rate=4e6), 'rough': rough}
    return [
        Storm('calm'), *(Storm(name, weather) for name, weather in weathers.items()),
        Storm('start: loss 40 %', Weather(loss=0.4), begin=Begin.PROCESSES),
        Storm('start: rough', rough, begin=Begin.PROCESSES),
        *(Storm(f'cut {duration} s', cuts=(Cut(float(rng.uniform(1.0, 4.0)), duration),)) for duration in (3, 15, 60)),
        Storm('robot killed', blows=(blow(robot()),)),
        Storm('three killed', blows=tuple(blow(f'robot_{each}') for each in rng.permutation(robots)[:3])),
        Storm('robot frozen 4 s', blows=(blow(robot(), 4.0),)),
        Storm('robot frozen 15 s', blows=(blow(robot(), 15.0),)),
        *(Storm(f'{target} {what}', blows=(blow(target, frozen),)) for target in ('world_sim', 'map_server')
          for what, frozen in (('killed', 0.0), ('frozen 4 s', 4.0))),
        Storm('start: all killed', blows=tuple(blow(each) for each in (robot(), 'world_sim', 'map_server')),
              begin=Begin.PROCESSES),
        Storm('all of it', Weather(loss=0.2, delay=0.05, jitter=0.05, duplicates=0.1),
              (blow(robot()), blow(robot(), 3.0), blow('world_sim')), (Cut(float(rng.uniform(1.0, 4.0)), 5.0),))]
