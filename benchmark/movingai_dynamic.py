"""Check D* against a map that changes: ``python -m benchmark.movingai_dynamic FOLDER``.

The folder holds a dynamic set of MovingAI, ``*.scen`` with its ``*.patch``: queries between patches that are pasted
onto a map which starts empty. One planner keeps the map and plans each query; a second one keeps its goal, and after
every patch its costs are compared with scipy's Dijkstra. The exit code is 1 if anything differs.
"""
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmark.dijkstra import cost_field
from mobile_planning.errors import PlanningError
from mobile_planning.grid.dstar import DstarPlanner


@dataclass(frozen=True, eq=False)
class Patch:
    """A rectangle of cells to paste: rows (x, y, new cost) for `DstarPlanner.update`."""

    rows: np.ndarray


@dataclass(frozen=True)
class Query:
    """A start, a goal, and the listed length of the shortest path without corner cutting."""

    start: tuple
    goal: tuple
    listed: float


def read_patches(path):
    """Return the occupied cells (h, w) of each patch of a file."""
    lines = path.read_text().split('\n')
    patches, i = [], lines.index('patch 0')
    while i < len(lines) and lines[i].startswith('patch'):
        height = int(lines[i + 1].split()[1])
        rows = lines[i + 4:i + 4 + height]
        patches.append(np.array([list(row) for row in rows]) != '.')
        i += 4 + height
    return patches


def read_set(path):
    """Return the (height, width) of the map of a ``.scen`` file and its patches and queries in their order."""
    head, _, body = path.read_text().partition('commands\n')
    facts = dict(line.split(maxsplit=1) for line in head.splitlines())
    patches = read_patches(path.with_name(facts['patch']))
    commands = []
    for kind, _, *values in map(str.split, body.splitlines()):
        if kind == 'P':
            number, left, top = map(int, values)
            y, x = np.indices(patches[number].shape)
            costs = np.where(patches[number], np.inf, 1.0)
            commands.append(Patch(np.column_stack([x.ravel() + left, y.ravel() + top, costs.ravel()])))
        else:
            sx, sy, gx, gy = map(int, values[:4])
            commands.append(Query((sx, sy), (gx, gy), float(values[4])))
    return (int(facts['height']), int(facts['width'])), commands


def cost_of(planner, start):
    """Return the cost of the path that the planner finds, inf if there is none."""
    try:
        return planner.query(start)[1].cost
    except PlanningError:
        return np.inf


def wrong_queries(shape, commands):
    """Return the queries whose cost is not the listed length, by one planner that keeps the map up to date."""
    planner = DstarPlanner(np.ones(shape), corner_cutting=False)
    wrong = []
    for command in commands:
        if isinstance(command, Patch):
            planner.update(command.rows)
            continue
        planner.plan(command.goal)
        cost = cost_of(planner, command.start)
        if abs(cost - command.listed) > 1e-6:
            wrong.append((command, cost))
    return wrong


def errors_of_a_fixed_goal(shape, commands, starts, goal, every=1):
    """Yield the largest difference from a fresh Dijkstra over the starts, after every so many patches."""
    planner = DstarPlanner(np.ones(shape), goal=goal, corner_cutting=False)
    planner.plan()
    patches = [command for command in commands if isinstance(command, Patch)]
    for i, patch in enumerate(patches):
        planner.update(patch.rows)
        found = np.array([cost_of(planner, start) for start in starts])
        if i % every == 0:
            x, y = np.transpose(starts)
            exact = cost_field(planner.costmap, goal, corner_cutting=False)[y, x]
            reached = np.isfinite(exact)
            error = np.abs(found[reached] - exact[reached]).max(initial=0.0)
            yield error if np.isinf(found[~reached]).all() else np.inf


def main(folder):
    """Check every set of the folder; return whether nothing differs."""
    differs = False
    for path in sorted(Path(folder).glob('*.scen')):
        shape, commands = read_set(path)
        queries = [command for command in commands if isinstance(command, Query)]
        began = time.perf_counter()
        wrong = wrong_queries(shape, commands)
        took = time.perf_counter() - began
        print(f'{path.stem}: {len(queries) - len(wrong)} of {len(queries)} queries equal to 1e-6, {took:.1f} s')
        goal, starts = queries[0].goal, sorted({query.start for query in queries})[::97]
        errors = list(errors_of_a_fixed_goal(shape, commands, starts, goal))
        print(f'{path.stem}: goal {goal} kept through {len(errors)} patches, {len(starts)} starts after each, '
              f'largest difference from a fresh Dijkstra {max(errors):.1e}')
        differs = differs or bool(wrong) or not max(errors) < 1e-9
    return not differs


if __name__ == '__main__':
    sys.exit(not main(*sys.argv[1:]))
