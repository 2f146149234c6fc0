"""What the timing of the protocol buys: ``python -m benchmark.fleet_tuning [CASE ...] --seeds 10 14 --loss 0 0.3``.

One table per loss: median and greatest time of the last arrival over the lower bound, over the runs in which all
arrive, for each setting and case; how many of the runs those are, where it is not all. One setting differs from the
default in each row: when an offer is said again, from which room on a contract is renewed, and at which phase a cycle
starts. In lock-step all cycles start together and a section takes no time.
"""
import argparse
from contextlib import contextmanager
from dataclasses import dataclass, field
from multiprocessing import Pool

from benchmark.cases import middle_and_most, scene_of
from mobile_planning.fleet import plan_in_force, repetition
from mobile_planning.fleet.faults import Faults, SolveTime
from mobile_planning.fleet.makespan import lower_bound

CASES = ('swap:robots=8', 'intersection:robots=8', 'warehouse:robots=12')


@dataclass(frozen=True)
class Setting:
    """What is replaced, ``(module or class, name, value)`` each, and how cycles run."""

    name: str
    values: tuple = ()
    faults: Faults = field(default_factory=Faults)


SETTINGS = (
    Setting('default'),
    Setting('nothing said again at once', ((repetition, 'TIMES', 1),)),
    Setting('said again after 0.03 s', ((repetition, 'SOON', 0.03),)),
    Setting('said again after 0.08 s', ((repetition, 'SOON', 0.08),)),
    Setting('renewed below 0.75 s of room', ((plan_in_force, '_AMPLE', 0.75),)),
    Setting('renewed below 3 s of room', ((plan_in_force, '_AMPLE', 3.0),)),
    Setting('renewed always', ((plan_in_force, '_AMPLE', float('inf')),)),
    Setting('any phase', faults=Faults(any_phase=True)),
    Setting('lock-step', faults=Faults(solve=SolveTime(0.0, 0.0))),
)


@contextmanager
def applied(setting):
    """Put the setting's values in place for a while."""
    before = [(module, name, getattr(module, name)) for module, name, _ in setting.values]
    try:
        for module, name, value in setting.values:
            setattr(module, name, value)
        yield
    finally:
        for module, name, value in before:
            setattr(module, name, value)


def drive(setting, case, seed, loss):
    """Return the ratio of one run with a setting, None if not all arrive."""
    scene = scene_of(case, seed)
    with applied(setting):
        report = scene.world_sim().run(seed, loss, timeout=scene.timeout, faults=setting.faults, check=False)
    if report.arrived < len(scene.robots):
        return None
    return report.mission_time / lower_bound(scene.bodies(), scene.environment())


def run(task):
    """Return the ratio of one run; ``task`` has the index of its setting first."""
    index, *rest = task
    return drive(SETTINGS[index], *rest)


def print_tables(run, settings, cases, summary, first=10, losses=(0.0, 0.3)):
    """Print a table for each loss of what ``run`` returns, as the command line wishes."""
    parser = argparse.ArgumentParser(description=summary)
    parser.add_argument('cases', nargs='*', default=cases)
    parser.add_argument('--seeds', type=int, nargs=2, default=(first, first + 4), metavar=('FIRST', 'END'))
    parser.add_argument('--loss', type=float, nargs='+', default=losses)
    parser.add_argument('--workers', type=int, default=2)
    options = parser.parse_args()
    for case in options.cases:
        scene_of(case, options.seeds[0])
    seeds = range(*options.seeds)
    with Pool(options.workers) as pool:
        for loss in options.loss:
            print(f'loss {loss:g}\n{"setting":<36}', *(f'{case:>28}' for case in options.cases))
            for index, setting in enumerate(settings):
                cells = []
                for case in options.cases:
                    ratios = pool.map(run, [(index, case, seed, loss) for seed in seeds], chunksize=1)
                    home = [ratio for ratio in ratios if ratio is not None]
                    lacking = '' if len(home) == len(ratios) else f' {len(home)}/{len(ratios)}'
                    cells.append(middle_and_most(home) + lacking)
                print(f'{setting.name:<36}', *(f'{cell:>28}' for cell in cells), flush=True)


if __name__ == '__main__':
    print_tables(run, SETTINGS, CASES, __doc__.splitlines()[0])
