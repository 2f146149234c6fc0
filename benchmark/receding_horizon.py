"""The receding horizon with both of its solvers: ``python -m benchmark.receding_horizon [CASE ...] --seeds 0 3``.

"arrive" counts runs in which all robots arrive, "clean" those in which, besides, the independent verifier finds nothing
wrong, and "bad" what it finds. "ratio" is the time of the last arrival over the lower bound: median and greatest over
the runs in which all arrive. The columns of milliseconds are the processor time of one section, all its rounds and
programs together: of first and last sections the mean, of all the least, the mean, and the greatest. "MCT/Tc" is the
greatest over the time between two sections, first without and then with the last ones: below 1 a section is ready in
time. "infeasible" is the share of programs whose answer breaks a constraint at a sample by more than 2 cm or 2 cm/s;
none of them is driven.

Cases are those of ``benchmark.fleet``; ``heritage`` has the values of the first script.
"""
import argparse
import platform
import sys
from dataclasses import replace
from importlib import metadata
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from benchmark.cases import middle_and_most, scene_of
from mobile_planning.fleet.nonlinear import SOLVERS
from mobile_planning.fleet.receding_horizon import Kind
from mobile_planning.fleet.scene_file import load_scene

CASES = 'heritage', 'swap:robots=2', 'swap:robots=4', 'swap:robots=8', 'forest:robots=8'
HERITAGE = Path(__file__).resolve().parent.parent / 'config' / 'fleets' / 'heritage.yaml'


def drive(task):
    """Return the row of one run."""
    case, seed, solver = task
    scene = load_scene(HERITAGE) if case == 'heritage' else scene_of(case, seed)
    simulation = replace(scene, method='receding_horizon').world_sim(solver=solver)
    report = simulation.run(seed, timeout=scene.timeout)
    records = [record for vehicle in simulation.episode.vehicles.values() for record in vehicle.robot.sections]
    return {'robots': report.robots, 'arrived': report.arrived, 'valid': report.valid, 'ratio': report.ratio,
            'separation': report.min_separation, 'clearance': report.min_obstacle_clearance,
            'violations': len(report.violations), 'records': records,
            'Tc': next(iter(simulation.robots.values())).Tc}


def line(case, solver, rows):
    """Return the line of the table for the runs ``rows``."""
    records = [record for row in rows for record in row['records']]
    of = {kind: [1e3 * record.seconds for record in records if record.kind is kind] for kind in Kind}
    every, early, tc = sum(of.values(), []), of[Kind.FIRST] + of[Kind.INTERMEDIATE], 1e3 * rows[0]['Tc']
    solves = sum(record.solves for record in records)
    infeasible = sum(record.infeasible for record in records) / max(solves, 1)
    home = [row for row in rows if row['arrived'] == row['robots']]
    clean = sum(row['valid'] for row in rows)
    return (f'{case:<16} {solver:<6} {len(home):>3}/{len(rows):<3} {clean:>3}/{len(rows):<3} '
            f'{sum(row["violations"] for row in rows):>4} {min(row["separation"] for row in rows):>7.3f} '
            f'{min(row["clearance"] for row in rows):>7.3f} {middle_and_most([row["ratio"] for row in home]):>12} '
            f'{np.mean(of[Kind.FIRST] or np.nan):>7.1f} {np.mean(of[Kind.LAST] or np.nan):>7.1f} {min(every):>7.1f} '
            f'{np.mean(every):>7.1f} {max(every):>8.1f} {max(early, default=np.nan) / tc:>6.2f} '
            f'{max(every) / tc:>6.2f} {100 * infeasible:>6.1f} %')


def main():
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('cases', nargs='*', default=CASES)
    parser.add_argument('--seeds', type=int, nargs=2, default=(0, 3), metavar=('FIRST', 'END'))
    parser.add_argument('--solvers', nargs='+', choices=SOLVERS, default=SOLVERS)
    parser.add_argument('--workers', type=int, default=1)
    options = parser.parse_args()
    print(f'Python {platform.python_version()},',
          ', '.join(f'{package} {metadata.version(package)}' for package in ('numpy', 'scipy', 'osqp')))
    print(f'{"case":<16} {"solver":<6} {"arrive":>7} {"clean":>7} {"bad":>4} {"apart":>7} {"wall":>7} {"ratio":>12} '
          f'{"first":>7} {"last":>7} {"min":>7} {"mean":>7} {"max [ms]":>8} {"MCT/Tc":>13} {"infeasible":>8}')
    with Pool(options.workers) as pool:
        for case in options.cases:
            seeds = [0] if case == 'heritage' else range(*options.seeds)
            for solver in options.solvers:
                rows = list(pool.imap(drive, [(case, seed, solver) for seed in seeds]))
                print(line(case, solver, rows), flush=True)


if __name__ == '__main__':
    sys.exit(main())
