"""Many missions, with and without faults: ``python -m benchmark.fleet_campaign --out out/campaign --seeds 0 10``.

Every case is run with every kind of faults and every seed, the invariant checked after each event and the result
judged by its plans alone. Each run adds a line to ``runs.jsonl`` in the folder, each failure one to ``failures.jsonl``;
a run whose line is there is not repeated, so that an interrupted campaign goes on. A failure is a broken limit, a
collision or a broken invariant ("unsafe"), a living robot that has not arrived ("late"), or an exception ("error").
At the end the table of each case and kind is printed, and ``--pictures`` draws so many of the failures.

The kinds: nothing; 30 % of all messages lost; delays of up to 0.3 s; two partitions and two one-way cuts; one robot
dies, in half of the runs with a certificate; one dies and restarts; one is switched on late; all of these together,
with clocks that are off. All but the first three have doubled messages and sections that come late, too.
"""
import argparse
import json
import signal
import sys
import time
import traceback
from multiprocessing import Pool
from pathlib import Path

import numpy as np

from benchmark.cases import CASES, middle_and_most, scene_of, section_times
from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.faults import Faults, draw_faults
from mobile_planning.fleet.makespan import lower_bound
from mobile_planning.outcome import write_outcome

#: By kind: the share of messages lost, the greatest delay [s], what is drawn by `draw_faults`, the clocks' error [s].
KINDS = {'none': (0.0, 0.0, None, 0.0), 'loss': (0.3, 0.0, None, 0.0), 'delay': (0.0, 0.3, None, 0.0),
         'cuts': (0.0, 0.05, 'net', 0.0), 'death': (0.0, 0.05, 'kill', 0.0), 'restart': (0.0, 0.05, 'restart', 0.0),
         'join': (0.0, 0.05, 'join', 0.0), 'all': (0.3, 0.3, 'all', 0.004)}
#: A run that takes longer than this [s] of wall time is an error.
PATIENCE = 600


def mission(case, kind, seed):
    """Return scene, simulation and report of one run."""
    loss, delay, drawn, skew = KINDS[kind]
    scene = scene_of(case, seed)
    simulation = scene.world_sim()
    faults = Faults() if drawn is None else draw_faults(drawn, list(simulation.robots), seed, skew)
    report = simulation.run(seed, loss, delay, scene.timeout, faults=faults)
    return scene, simulation, report


def run(task):
    """Return the record of one run, whatever becomes of it."""
    case, kind, seed = task
    record, began = {'case': case, 'kind': kind, 'seed': seed}, time.perf_counter()
    signal.signal(signal.SIGALRM, _give_up)
    signal.alarm(PATIENCE)
    try:
        scene, simulation, report = mission(case, kind, seed)
        episode, times = simulation.episode, section_times(simulation)
        record |= {
            'robots': len(scene.robots), 'dead': len(episode.dead), 'arrived': report.arrived,
            'separation': _number(report.min_separation), 'clearance': _number(report.min_obstacle_clearance),
            'mission_time': report.mission_time,
            'ratio': report.mission_time / lower_bound(scene.bodies(), scene.environment()),
            'sections': len(times), 'section_ms': _number(1e3 * np.median(times)) if times else None,
            'section_ms_most': 1e3 * max(times, default=0.0), 'events': episode.events, 'messages': episode.messages,
            'bytes': episode.message_bytes, 'violations': report.violations[:20]}
        is_home = record['arrived'] >= record['robots'] - record['dead']
        record['failure'] = 'unsafe' if report.violations else None if is_home else 'late'
    except Exception as error:
        record |= {'failure': 'error', 'violations': [repr(error)], 'traceback': traceback.format_exc()}
    finally:
        signal.alarm(0)
    record['wall_s'] = round(time.perf_counter() - began, 2)
    return record


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
    print(f'{"case":<28} {"kind":<8} {"runs":>5} {"safe":>5} {"all home":>8} {"errors":>6} {"apart [m]":>9} '
          f'{"wall [m]":>8} {"ratio":>13} {"ms":>13}')
    cases = sorted({record['case'] for record in records}, key=[record['case'] for record in records].index)
    for case in [*cases, 'all']:
        for kind in KINDS:
            rows = [row for row in records if row['kind'] == kind and case in (row['case'], 'all')]
            if rows:
                print(f'{case:<28} {kind:<8} {_summary(rows)}')


def _summary(rows):
    whole = [row for row in rows if row['failure'] != 'error']
    safe = [row for row in whole if not row['violations']]
    home = [row for row in whole if row['arrived'] >= row['robots'] - row['dead']]
    apart, wall = (min((row[key] for row in whole if row[key] is not None), default=np.nan)
                   for key in ('separation', 'clearance'))
    sections = [row['section_ms'] for row in whole if row['section_ms'] is not None]
    return (f'{len(rows):>5} {len(safe):>5} {len(home):>8} {len(rows) - len(whole):>6} {apart:>9.3f} {wall:>8.3f} '
            f'{middle_and_most([row["ratio"] for row in home]):>13} {middle_and_most(sections):>13}')


def main():
    """Run what is missing, and print the table of all that is there."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('cases', nargs='*', default=CASES)
    parser.add_argument('--seeds', type=int, nargs=2, default=(0, 10), metavar=('FIRST', 'END'))
    parser.add_argument('--kinds', nargs='+', default=list(KINDS), choices=list(KINDS))
    parser.add_argument('--out', type=Path, default=Path('out/campaign'))
    parser.add_argument('--workers', type=int, default=2)
    parser.add_argument('--pictures', type=int, default=0, help='draw so many of the failures')
    options = parser.parse_args()
    for case in options.cases:
        try:
            scene_of(case, 0)
        except InvalidInput as error:
            parser.error(str(error))
    options.out.mkdir(parents=True, exist_ok=True)
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
              f'{record.get("arrived", "-")} of {record.get("robots", "-")} arrived {record["violations"][:1]}')
    for record in [record for record in failures if record['failure'] != 'error'][:options.pictures]:
        scene, simulation, report = mission(record['case'], record['kind'], record['seed'])
        name = f'{record["case"]}_{record["kind"]}_{record["seed"]}'.replace(':', '_').replace(',', '_')
        write_outcome(options.out / name, report, simulation.solutions, scene.bodies(), scene.environment())
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
