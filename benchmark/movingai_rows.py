"""Check the field against all rows of MovingAI scenarios: ``python benchmark/movingai_rows.py [FOLDER]``.

Without a folder the maps of ``test/data/movingai`` are taken. Prints a table; the exit code is 1 if a row differs.
"""
import lzma
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mobile_planning.world.cost_to_go import cost_to_go, descend

SHIPPED = Path(__file__).resolve().parent.parent / 'test' / 'data' / 'movingai'


@dataclass(frozen=True)
class Row:
    """One query of a scenario, and its shortest path's length as listed, which holds to ``precision``."""

    start: tuple
    goal: tuple
    listed: float
    precision: float


def read_text(path):
    """Return the text of a file, compressed with xz or not."""
    return lzma.decompress(path.read_bytes()).decode() if path.suffix == '.xz' else path.read_text()


def map_files(folder):
    """Return the map files of a folder."""
    return sorted([*folder.glob('*.map'), *folder.glob('*.map.xz')])


def read_map(path):
    """Return the (h, w) mask of occupied cells, row 0 first in the file."""
    lines = read_text(path).splitlines()
    rows = lines[lines.index('map') + 1:]
    return ~np.isin(np.array([list(row) for row in rows if row]), ['.', 'G'])


def read_rows(path):
    """Return the rows of the scenario that belongs to a map file."""
    scenario = path.with_name(path.name.replace('.map', '.map.scen'))
    columns = [line.split() for line in read_text(scenario).splitlines()[1:] if line.strip()]
    decimals = {len(c[8].partition('.')[2]) for c in columns}
    fixed = decimals.pop() if decimals in ({2}, {8}) else None
    return [Row((int(c[4]), int(c[5])), (int(c[6]), int(c[7])), float(c[8]), precision(float(c[8]), fixed))
            for c in columns]


def precision(listed, decimals=None):
    """Return how far a listed length may lie from the true one.

    That is half a unit of its last digit: of the given decimal in files with a fixed number of them (2 in the bg512
    set, 8 in the cities), elsewhere of the 6th significant digit, for trailing zeros are dropped there. And one step
    of a float32, because some lengths were summed up in single precision before they were rounded.
    """
    last_digit = 10.0 ** (-decimals if decimals else np.floor(np.log10(max(listed, 1.0))) - 5)
    return 0.5 * last_digit + np.spacing(np.float32(listed))


def path_length(path):
    """Return the length of a path of cells."""
    return np.hypot(*np.diff(path, axis=0).T).sum()


def misfits(occupied, rows):
    """Return the rows whose path or field value is not the listed length."""
    wrong = []
    for row in rows:
        field = cost_to_go(occupied, row.goal, corner_cutting=False)
        value = field[row.start[1], row.start[0]]
        length = path_length(descend(field, row.start, row.goal, corner_cutting=False)) if np.isfinite(value) else value
        if abs(value - row.listed) > row.precision or abs(length - value) > 1e-6:
            wrong.append((row, value, length))
    return wrong


def main(folder=SHIPPED):
    """Check every row of every map of the folder and print a table."""
    failed = 0
    print(f'{"map":<16} {"cells":>11} {"rows":>6} {"equal":>6} {"worst error":>12} {"time":>8}')
    for path in map_files(folder):
        occupied, rows = read_map(path), read_rows(path)
        began = time.perf_counter()
        wrong = misfits(occupied, rows)
        took = time.perf_counter() - began
        failed += len(wrong)
        worst = max((abs(value - row.listed) for row, value, _ in wrong), default=0.0)
        shape = '{1} x {0}'.format(*occupied.shape)
        name = path.name.split('.')[0]
        print(f'{name:<16} {shape:>11} {len(rows):>6} {len(rows) - len(wrong):>6} {worst:>12.2e} {took:>6.1f} s')
    return failed == 0


if __name__ == '__main__':
    sys.exit(not main(*map(Path, sys.argv[1:])))
