"""Many missions, with and without faults: ``python -m benchmark.fleet_campaign --out out/campaign --seeds 0 20``.

Every case is run with every kind of faults and every seed, the invariant checked after each event and the result
judged by its plans alone. Each run adds a line to ``runs.jsonl`` in the folder, each failure one to ``failures.jsonl``;
a run whose line is there is not repeated, so that an interrupted campaign goes on. A failure is a broken limit, a
collision or a broken invariant ("unsafe"), a living robot that has not arrived ("late"), or an exception ("error").
A robot that a dead one cuts off from its goal, lying in its only way or on the goal itself, is not late but "cut off".
At the end the table of each case and kind is printed. "x none" is the time against that of the same seed without
faults, median and greatest; "a minute" the goals reached in a minute, median. ``--pictures N`` draws so many of the
failures, ``--picture SEED ...`` the runs of those seeds, and ``--film SEED ...`` films them; with the cases and kinds
named, a single one.

The kinds: nothing; 30 % of all messages lost; delays of up to 0.3 s; one robot dies, with a certificate; storm: two
partitions and two one-way cuts of some seconds, a cut and a partition of 16 s, silent radios, one robot that restarts
and one that is switched on late, clocks that are off, loss and delay. More kinds, if named: cuts, kill (a death that in
half of the runs nobody certifies), restart, join, all (a storm, and a death). All but the first three have doubled
messages, cycles of any phase and sections that come late, too.
"""
import argparse
import json
import signal
import sys
import time
import traceback
from itertools import product
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from benchmark.cases import middle_and_most, scene_of, section_times
from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.faults import Faults, draw_faults
from mobile_planning.fleet.makespan import lower_bound
from mobile_planning.outcome import film_mission, write_outcome

#: Every family, up to its full size.
CASES = ('heritage', 'swap:robots=2', 'swap:robots=4', 'swap:robots=8', 'swap:robots=16', 'swap:robots=32',
         'swap:robots=64', 'line_swap:robots=8', 'line_swap:robots=16', 'forest:robots=8', 'forest:robots=16',
         'doorway:robots=4', 'doorway:robots=8', 'doorway:robots=4,gap=0.6', 'doorway:robots=8,gap=0.6',
         'corridor:robots=4,width=0.65', 'corridor:robots=6,width=0.65', 'corridor:robots=8,width=0.65',
         'corridor:robots=8', 'intersection:robots=8', 'intersection:robots=16', 'maze:robots=8', 'rooms:robots=6',
         'rooms:robots=8', 'pockets:robots=4', 'pockets:robots=6', 'warehouse:robots=12', 'warehouse:robots=24',
         'depot:robots=8', 'depot:robots=24', 'depot:robots=8,endless=40', 'hall:robots=10')
#: By kind: the share of messages lost, the greatest delay [s], what is drawn by `draw_faults`, the clocks' error [s].
KINDS = {'none': (0.0, 0.0, None, 0.0), 'loss': (0.3, 0.0, None, 0.0), 'delay': (0.0, 0.3, None, 0.0),
         'death': (0.0, 0.05, 'death', 0.0), 'storm': (0.1, 0.1, 'storm', 0.004), 'cuts': (0.0, 0.05, 'net', 0.0),
         'kill': (0.0, 0.05, 'kill', 0.0), 'restart': (0.0, 0.05, 'restart', 0.0), 'join': (0.0, 0.05, 'join', 0.0),
         'all': (0.3, 0.3, 'all', 0.004)}
USUAL = ('none', 'loss', 'delay', 'death', 'storm')
#: A mission may take this [s] and so many times its lower bound.
TIMEOUT, TIMES = 60.0, 3.0
#: A run that takes longer than this [s] of wall time is an error.
PATIENCE = 1200


def mission(case, kind, seed):
    """Return scene, simulation and report of one run."""
    loss, delay, drawn, skew = KINDS[kind]
    scene = scene_of(case, seed)
    simulation = scene.world_sim()
    faults = Faults() if drawn is None else draw_faults(drawn, list(simulation.robots), seed, skew)
    timeout = TIMEOUT + scene.endless + TIMES * lower_bound(scene.bodies(), scene.environment())
    report = simulation.run(seed, loss, delay, timeout, faults=faults, errands=scene.errands(seed))
    return scene, simulation, report


def run(task):
    """Return the record of one run, whatever becomes of it."""
    case, kind, seed = task
    record, began = {'case': case, 'kind': kind, 'seed': seed}, time.perf_counter()
    signal.signal(signal.SIGALRM, _give_up)
    signal.alarm(PATIENCE)
    try:
        record |= outcome(*mission(case, kind, seed))
    except Exception as error:
        record |= {'failure': 'error', 'violations': [repr(error)], 'traceback': traceback.format_exc()}
    finally:
        signal.alarm(0)
    record['wall_s'] = round(time.perf_counter() - began, 2)
    return record


def outcome(scene, simulation, report):
    """Return what is recorded of a run."""
    episode, times = simulation.episode, section_times(simulation)
    live = [vehicle for vehicle in episode.vehicles.values() if vehicle.is_alive]
    late = [each for each in report.waiting if not each.is_cut_off]
    return {
        'robots': len(scene.robots), 'live': len(live), 'arrived': sum(each.robot.is_done for each in live),
        'cut_off': len(report.waiting) - len(late), 'separation': _number(report.min_separation),
        'clearance': _number(report.min_obstacle_clearance), 'mission_time': report.mission_time,
        'ratio': report.mission_time / report.lower_bound, 'joint_plans': report.joint_plans,
        'goals': report.goals, 'arrivals': report.arrivals, 'throughput': report.throughput,
        'sections': len(times), 'section_ms': _number(1e3 * np.median(times)) if times else None,
        'section_ms_most': 1e3 * max(times, default=0.0), 'events': episode.events, 'checks': episode.checks,
        'messages': episode.messages, 'bytes': episode.message_bytes, 'violations': report.violations[:20],
        'waiting': [str(each) for each in report.waiting],
        'failure': 'unsafe' if report.violations else 'late' if late else None}


def _give_up(_signal, _frame):
    raise TimeoutError(f'the run has taken more than {PATIENCE} s')


def _number(value):
    return float(value) if np.isfinite(value) else None


def read(path):
    """Return the records of a file of JSON lines; a line cut off by an interruption is left out."""
    records = []
    for text in path.read_text().splitlines() if path.exists() else ():
        try:
            records.append(json.loads(text))
        except json.JSONDecodeError:
            continue
    return records


def carry_out(tasks, folder, workers):
    """Run ``tasks``, add their records to the files of ``folder`` and show how far they are."""
    began, failures = time.perf_counter(), 0
    with (Pool(workers) as pool, open(folder / 'runs.jsonl', 'a') as runs,
          open(folder / 'failures.jsonl', 'a') as failed):
        for count, record in enumerate(pool.imap_unordered(run, tasks), 1):
            print(json.dumps(record), file=runs, flush=True)
            if record['failure']:
                failures += 1
                print(json.dumps(record), file=failed, flush=True)
            left = (time.perf_counter() - began) / count * (len(tasks) - count)
            bar = '#' * int(40 * count / len(tasks))
            print(f'\r[{bar:.<40}] {count}/{len(tasks)}, {failures} failures, {left / 60:.0f} min left ',
                  end='', file=sys.stderr, flush=True)
    print(file=sys.stderr)


def print_table(records):
    """Print a line for each case and kind, and one for each kind over all cases."""
    print(f'{"case":<28} {"kind":<8} {"runs":>5} {"safe":>5} {"all home":>8} {"cut off":>7} {"errors":>6} '
          f'{"apart [m]":>9} {"wall [m]":>8} {"ratio":>13} {"x none":>13} {"a minute":>8} {"plans":>9} {"ms":>13}')
    alone = {(row['case'], row['seed']): row['ratio'] for row in records
             if row['kind'] == 'none' and not row['failure']}
    cases = sorted({record['case'] for record in records}, key=[record['case'] for record in records].index)
    for case in [*cases, 'all']:
        for kind in KINDS:
            rows = [row for row in records if row['kind'] == kind and case in (row['case'], 'all')]
            if rows:
                print(f'{case:<28} {kind:<8} {_summary(rows, alone)}')


def _summary(rows, alone):
    whole = [row for row in rows if row['failure'] != 'error']
    safe = [row for row in whole if not row['violations']]
    home = [row for row in whole if row['arrived'] + row['cut_off'] >= row['live']]
    cut_off = sum(row['cut_off'] > 0 for row in whole)
    times = [row for row in home if not row['cut_off']]
    apart, wall = (min((row[key] for row in whole if row[key] is not None), default=np.nan)
                   for key in ('separation', 'clearance'))
    against = [row['ratio'] / alone[row['case'], row['seed']] for row in times if (row['case'], row['seed']) in alone]
    sections = [row['section_ms'] for row in whole if row['section_ms'] is not None]
    paces = [row['throughput'] for row in whole if row.get('throughput')]
    pace = f'{np.median(paces):.1f}' if paces else '-'
    plans = middle_and_most([row['joint_plans'] for row in whole], '{:.0f}')
    return (f'{len(rows):>5} {len(safe):>5} {len(home):>8} {cut_off:>7} {len(rows) - len(whole):>6} {apart:>9.3f} '
            f'{wall:>8.3f} {middle_and_most([row["ratio"] for row in times]):>13} {middle_and_most(against):>13} '
            f'{pace:>8} {plans:>9} {middle_and_most(sections):>13}')


def draw(case, kind, seed, folder):
    """Drive one run again and write its report and picture into a folder of its own; return that."""
    scene, simulation, report = mission(case, kind, seed)
    home = _home(case, kind, seed, folder)
    write_outcome(home, report, simulation.solutions, scene.bodies(), scene.environment())
    return home


def film(case, kind, seed, folder):
    """Drive one run again and write a film of it into a folder of its own; return its path."""
    scene, simulation, report = mission(case, kind, seed)
    path = _home(case, kind, seed, folder) / 'mission.gif'
    film_mission(report, simulation.solutions, scene.bodies(), scene.environment(), path)
    return path


def _home(case, kind, seed, folder):
    return folder / f'{case}_{kind}_{seed}'.replace(':', '_').replace(',', '_')


def arguments():
    """Return what the command line asks for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('cases', nargs='*', default=CASES)
    parser.add_argument('--seeds', type=int, nargs=2, default=(0, 20), metavar=('FIRST', 'END'))
    parser.add_argument('--kinds', nargs='+', default=USUAL, choices=list(KINDS))
    parser.add_argument('--out', type=Path, default=Path('out/campaign'))
    parser.add_argument('--workers', type=int, default=2)
    parser.add_argument('--pictures', type=int, default=0, help='draw so many of the failures')
    parser.add_argument('--picture', type=int, nargs='+', default=(), metavar='SEED', help='draw these runs, and end')
    parser.add_argument('--film', type=int, nargs='+', default=(), metavar='SEED', help='film these runs, and end')
    options = parser.parse_args()
    for case in options.cases:
        try:
            scene_of(case, 0)
        except InvalidInput as error:
            parser.error(str(error))
    return options


def main():
    """Run what is missing, and print the table of all that is there."""
    options = arguments()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.picture or options.film:
        for show, seeds in ((draw, options.picture), (film, options.film)):
            for case, kind, seed in product(options.cases, options.kinds, seeds):
                print(show(case, kind, seed, options.out), flush=True)
        return 0
    wanted = [(case, kind, seed) for seed in range(*options.seeds) for case in options.cases for kind in options.kinds]
    known = {(record['case'], record['kind'], record['seed']) for record in read(options.out / 'runs.jsonl')}
    tasks = [task for task in wanted if task not in known]
    if tasks:
        carry_out(tasks, options.out, options.workers)
    records = [record for record in read(options.out / 'runs.jsonl')
               if (record['case'], record['kind'], record['seed']) in set(wanted)]
    print_table(records)
    failures = [record for record in records if record['failure']]
    for record in failures:
        print(f'{record["failure"]}: {record["case"]} {record["kind"]} seed {record["seed"]}: '
              f'{record.get("arrived", "-")} of {record.get("live", "-")} arrived')
        for sentence in [*record['violations'][:3], *record.get('waiting', [])[:3]]:
            print(f'    {sentence}')
    for record in [record for record in failures if record['failure'] != 'error'][:options.pictures]:
        print(draw(record['case'], record['kind'], record['seed'], options.out))
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
