"""Fleets side by side: ``python -m benchmark.fleet [CASE ...] --seeds 0 10``.

A case is a family of scenarios with its parameters: ``forest``, ``corridor:robots=4,width=0.65``. Ours and ORCA drive
the same instances. "arrive" counts runs in which all robots arrive, "clean" those in which, besides, no two bodies, and
no body and wall, come into touch and no limit is broken. "ratio" is the time of the last arrival over the lower bound
(the longest way at full speed, speeding up and slowing down once): median and greatest over the runs in which all
arrive. ORCA has no limit on acceleration and may be below 1. "ms" is the computing time of one section, or of one of
ORCA's steps, of which there are five to a section: median, and the greatest median of a run.

``--planners slsqp osqp active_set`` drives the same instances by the receding horizon, on each of its solvers; a second
table then tells of their sections. The milliseconds are the processor time of one section, all its rounds and programs
together: of first and last sections the mean, of all the least, the mean, and the greatest. "MCT/Tc" is the greatest
over the time between two sections, first without and then with the last ones: below 1 a section is ready in time.
"infeasible" is the share of programs whose answer breaks a constraint at a sample by more than 2 cm or 2 cm/s, and
"refused" how many rounds of a section end without a proved one; neither is ever driven.

Wants pyrvo; without it ORCA is left out.
"""
import argparse
import platform
import sys
from importlib import metadata, util
from multiprocessing import Pool

import numpy as np

from benchmark import horizon_sections
from benchmark.cases import CASES, middle_and_most, scene_of, section_times
from mobile_planning.fleet.makespan import lower_bound

PACKAGES = ('numpy', 'scipy', 'numba', 'osqp', 'pyrvo')
#: Bodies that touch to less than this [m] are not counted as a collision of ORCA's.
TOUCH = 1e-4


def drive(task):
    """Return the row of one run."""
    case, seed, planner, loss, delay, solver = task
    scene, sections = scene_of(case, seed), None
    if planner == 'ORCA':
        from benchmark.orca import run_orca

        outcome = run_orca(scene, seed)
        seconds = [outcome.step_time]
        apart = min((a.radius + b.radius for a in scene.robots for b in scene.robots if a is not b), default=0.0)
        is_free = (outcome.min_separation >= apart - TOUCH) and outcome.min_obstacle_clearance >= -TOUCH
    else:
        is_ours = planner not in horizon_sections.PLANNERS
        simulation = scene.world_sim(solver=solver) if is_ours else horizon_sections.simulation_of(scene, planner)
        outcome = simulation.run(seed, loss, delay, scene.timeout)
        sections = None if is_ours else horizon_sections.records_of(simulation)
        seconds, is_free = section_times(simulation), not outcome.violations
    return {'case': case, 'seed': seed, 'planner': planner, 'robots': len(scene.robots), 'arrived': outcome.arrived,
            'separation': outcome.min_separation, 'clearance': outcome.min_obstacle_clearance, 'is_free': is_free,
            'ratio': outcome.mission_time / lower_bound(scene.bodies(), scene.environment()),
            'sections': sections, 'ms': 1e3 * float(np.median(seconds)) if seconds else np.nan}


def line(case, planner, rows):
    """Return the line of the table for the runs ``rows``."""
    home = [row for row in rows if row['arrived'] == row['robots']]
    ratio = middle_and_most([row['ratio'] for row in home])
    spent = middle_and_most([row['ms'] for row in rows], '{:.3f}')
    return (f'{case:<28} {planner:<10} {len(home):>4}/{len(rows):<4} {min(row["separation"] for row in rows):>9.3f} '
            f'{min(row["clearance"] for row in rows):>9.3f} {sum(row["is_free"] for row in home):>4}/{len(rows):<4} '
            f'{ratio:>13} {spent:>16}')


def verdict(case, rows):
    """Return the line that says whether ours are slower than ORCA on the seeds on which ORCA is clean."""
    ratios = {planner: {row['seed']: row['ratio'] for row in rows
                        if row['planner'] == planner and row['arrived'] == row['robots'] and row['is_free']}
              for planner in ('ours', 'ORCA')}
    clean = sorted(ratios['ORCA'])
    said = f'{case:<28} ORCA is clean on {len(clean)} seeds'
    if not clean:
        return f'{said}: nothing to compare'
    if not ratios['ours'].keys() >= ratios['ORCA'].keys():
        return f'{said}, ours are not on all of these: SLOWER'
    ours, theirs = (float(np.median([ratios[planner][seed] for seed in clean])) for planner in ('ours', 'ORCA'))
    return f'{said}, there ours {ours:.2f}, ORCA {theirs:.2f}: {"no slower" if ours <= theirs else "SLOWER"}'


def main():
    """Print the table, below it a verdict for each case, and each run that is not clean."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('cases', nargs='*', default=CASES)
    parser.add_argument('--seeds', type=int, nargs=2, default=(0, 10), metavar=('FIRST', 'END'))
    parser.add_argument('--loss', type=float, default=0.0, help='share of our messages lost')
    parser.add_argument('--delay', type=float, default=0.0, help='greatest delay of our messages [s]')
    parser.add_argument('--solver', default='active_set', help='of our programs')
    parser.add_argument('--workers', type=int, default=2)
    parser.add_argument('--planners', nargs='+', default=('ours', 'ORCA'),
                        choices=('ours', 'ORCA', *horizon_sections.PLANNERS))
    options = parser.parse_args()
    planners = [planner for planner in options.planners if planner != 'ORCA' or util.find_spec('pyrvo')]
    for case in options.cases:
        scene_of(case, options.seeds[0])
    installed = {item.metadata['Name'] for item in metadata.distributions()}
    print(f'Python {platform.python_version()},',
          ', '.join(f'{package} {metadata.version(package)}' for package in PACKAGES if package in installed))
    print(f'{"case":<28} {"by":<10} {"arrive":>9} {"apart [m]":>9} {"wall [m]":>9} {"clean":>9} '
          f'{"ratio":>13} {"ms":>16}')
    failures, verdicts, sections = [], [], []
    with Pool(options.workers) as pool:
        for case in options.cases:
            driven = []
            for planner in planners:
                tasks = [(case, seed, planner, options.loss, options.delay, options.solver)
                         for seed in range(*options.seeds)]
                rows = list(pool.imap(drive, tasks))
                failures += [row for row in rows if row['arrived'] < row['robots'] or not row['is_free']]
                driven += rows
                print(line(case, planner, rows), flush=True)
                if planner in horizon_sections.PLANNERS:
                    sections.append(horizon_sections.line(case, planner, rows))
            if {'ours', 'ORCA'} <= set(planners):
                verdicts.append(verdict(case, driven))
    for said in ['', horizon_sections.HEAD, *sections] if sections else []:
        print(said)
    for said in verdicts:
        print(said)
    for row in failures:
        print(f'{row["case"]} seed {row["seed"]}, {row["planner"]}: {row["arrived"]} of {row["robots"]} arrive, '
              f'{row["separation"]:.4f} m apart, {row["clearance"]:.4f} m from walls')


if __name__ == '__main__':
    sys.exit(main())
