"""Does memory stay flat: robots drive from goal to goal for minutes on end, each a process over ROS 2.

    launch/soak.sh [--minutes 10] [--robots 6] [--limit 100]

Prints once a minute what each process holds, and at the end by how much it has grown within a minute: the median of all
minutes after the warm-up, which is 2 minutes or half of the time, and beside it all its growth since then. The median
passes over what is loaded once, as the first joint plan does; what leaks does so every minute. Ends with 1 where a
process has ended, the mission has not started, or the median is above the limit [KB/min].
"""
from __future__ import annotations

import argparse
import signal
import sys
from time import monotonic, sleep

import numpy as np

from benchmark.fleet_processes import ROOT, Fleet

#: Between two looks [s]; what is held in the first minutes is not growth [min].
_LOOK, _WARM_UP = 5.0, 2.0
_LOGS = ROOT / 'out' / 'soak'
#: Plans that each robot keeps for the judge, those of a minute: the 8000 that it keeps by default take half an hour.
_KEPT = 240


def watched(fleet: Fleet, minutes: float) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return times (N,) [min] and what each process held then (N,) [KB]; prints a line a minute.

    Raises
    ------
    RuntimeError
        A process has ended.
    """
    began, times, held, told = monotonic(), [], {}, 0
    while (passed := (monotonic() - began) / 60.0) < minutes:
        if fleet.ended:
            raise RuntimeError(f'{fleet.ended} ended after {passed:.1f} min')
        costs = fleet.costs()
        times.append(passed)
        for name, cost in costs.items():
            held.setdefault(name, []).append(1024 * cost.rss)
        if passed >= told:
            told += 1
            print(f'{passed:5.1f} min  ' + '  '.join(f'{name} {cost.rss:.1f}' for name, cost in costs.items()) + ' MB',
                  flush=True)
        sleep(_LOOK)
    return np.array(times), {name: np.array(column) for name, column in held.items()}


def growth(times: np.ndarray, held: np.ndarray) -> tuple[float, float]:
    """Return by how much it grows within a minute [KB/min], and grew in all [KB], after the warm-up."""
    later = times >= min(_WARM_UP, times[-1] / 2)
    times, held = times[later], held[later]
    starts = np.nonzero(times <= max(times[-1] - 1.0, times[0]))[0]
    ends = np.minimum(np.searchsorted(times, times[starts] + 1.0), len(times) - 1)
    minutes = np.maximum(times[ends] - times[starts], 1e-9)
    return float(np.median((held[ends] - held[starts]) / minutes)), float(held[-1] - held[0])


def main() -> int:
    """Drive, watch, and judge."""
    parser = argparse.ArgumentParser(description='Whether memory stays flat while robots drive for minutes on end.')
    parser.add_argument('--minutes', type=float, default=10.0)
    parser.add_argument('--robots', type=int, default=6)
    parser.add_argument('--limit', type=float, default=100.0, help='growth that passes [KB/min]')
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    lasts = 60.0 * options.minutes + 120.0
    scene = {'name': 'soak', 'map': str(ROOT / 'config' / 'maps' / 'depot.yaml'), 'scenario': 'depot',
             'robots': options.robots, 'seed': 3, 'endless': lasts, 'timeout': lasts + 60.0}
    groups = [[robot] for robot in range(1, options.robots + 1)]
    try:
        with Fleet(scene, groups, _LOGS, plans_kept=_KEPT) as fleet:
            times, held = watched(fleet, options.minutes)
            told = (_LOGS / 'robot_1.log').read_text()
    except RuntimeError as error:
        print(f'soak: {error}; see {_LOGS}', file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    grown = {name: growth(times, column) for name, column in held.items()}
    for name, column in held.items():
        print(f'{name:<14}{column[-1] / 1024:8.1f} MB {grown[name][0]:+9.1f} KB/min, {grown[name][1]:+9.0f} KB in all')
    if 'started' not in told:
        print(f'soak: the mission did not start; see {_LOGS}', file=sys.stderr)
        return 1
    return 0 if max(median for median, _ in grown.values()) <= options.limit else 1


if __name__ == '__main__':
    sys.exit(main())
