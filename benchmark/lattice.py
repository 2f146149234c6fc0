"""Lattices and Bug2 side by side with roboticstoolbox-python: ``python benchmark/lattice.py``.

Three tables. The graph of all that a root reaches, and ten queries in it, by both packages on small grids: their
vertices and edges are counted, the costs of the paths compared, and the motions counted that drive through an occupied
cell, which the toolbox allows because it looks at the end of a motion only. Then larger grids and more headings, which
the toolbox cannot do in minutes. Then Bug2 on maps of random boxes, each with a start and a goal that a flood fill
joins.

Ours are medians of several runs, the toolbox runs once. A ratio is its time over ours. Wants roboticstoolbox-python
1.5.0 beside this package's own requirements; where it is missing its columns stay empty.
"""
import argparse
import contextlib
import io
import platform
import time
from importlib import metadata, util

import numpy as np
from scipy.ndimage import label

from mobile_planning.errors import NoPath
from mobile_planning.grid.bug2 import Bug2
from mobile_planning.grid.lattice import LatticePlanner
from mobile_planning.grid.motion_primitives import motion_primitives
from mobile_planning.warm_up import warm_up

TOOLBOX = 'roboticstoolbox-python'
ROOT = (2, 2, 0.0)
QUARTER = np.pi / 2


def grid(side, crowd, room=5):
    """Return the occupied cells of a square grid, with some room around the root."""
    occupied = np.random.default_rng(0).random((side, side)) < crowd
    occupied[:room, :room] = False
    return occupied


def timed(function, repeats=1):
    """Return the median wall time of some runs [s] and the last result."""
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        result = function()
        times.append(time.perf_counter() - began)
    return float(np.median(times)), result


def timed_plan(make, repeats):
    """Return the median wall time of the plans of some new planners [s] and the last planner."""
    times = []
    for _ in range(repeats):
        planner = make()
        times.append(timed(lambda: planner.plan(progress=False))[0])
    return float(np.median(times)), planner


def quietly(function):
    """Return the result of a function that prints."""
    with contextlib.redirect_stdout(io.StringIO()):
        return function()


def toolbox_grid(occupied):
    """Return the toolbox's map of the occupied cells."""
    from roboticstoolbox.mobile import BinaryOccupancyGrid

    return BinaryOccupancyGrid(occupied.astype(int))


def hidden_hits(occupied, path, segments):
    """Return how many motions of a path of four headings cross an occupied cell."""
    motions = {(motion.heading, motion.code): motion for motion in motion_primitives(4)}
    count = 0
    for (x, y, theta), code in zip(path, segments):
        cells = motions[round(theta / QUARTER) % 4, code].swept_cells() + np.rint((x, y)).astype(int)
        count += bool(occupied[cells[:, 1], cells[:, 0]].any())
    return count


def goals_of(planner, count):
    """Return some of the graph's vertices."""
    chosen = np.random.default_rng(1).integers(len(planner.vertices), size=count)
    return planner.vertices[chosen]


def compare_graphs(side, crowd, has_toolbox):
    """Print the row of one small grid."""
    occupied = grid(side, crowd)
    time_of_ours, ours = timed_plan(lambda: LatticePlanner(root=ROOT, occgrid=occupied), 11)
    goals = goals_of(ours, 10)
    query_of_ours, found = timed(lambda: [ours.query(ROOT, goal) for goal in goals], 5)
    row = (f'{side:>5} {crowd:>5.0%} {len(ours.vertices):>8} {ours.nedges:>7} {time_of_ours * 1e3:>9.3f} '
           f'{query_of_ours / 10 * 1e3:>9.3f}')
    if not has_toolbox:
        print(row)
        return
    from roboticstoolbox import LatticePlanner as ToolboxLattice

    peer = ToolboxLattice(occgrid=toolbox_grid(occupied), root=ROOT)
    time_of_peer, _ = timed(lambda: quietly(peer.plan))
    query_of_peer, answers = timed(lambda: [peer.query(ROOT, goal) for goal in goals])
    more = [status.cost - answer.cost for (_, status), (_, answer) in zip(found, answers)]
    through = sum(hidden_hits(occupied, path, status.segments) for path, status in answers)
    own = sum(hidden_hits(occupied, path, status.segments) for path, status in found)
    print(f'{row} {peer.graph.n:>8} {peer.graph.ne:>7} '
          f'{time_of_peer * 1e3:>10.0f} {time_of_peer / time_of_ours:>8.0f}x '
          f'{query_of_peer / 10 * 1e3:>9.1f} {query_of_peer / query_of_ours:>7.0f}x {max(more):>9.2e} {own:>5} '
          f'{through:>7}', flush=True)


def larger_graphs(side, headings, radius):
    """Print the row of one large grid of which 5 % is occupied."""
    occupied = grid(side, 0.05, 32)
    seconds, planner = timed_plan(
        lambda: LatticePlanner(root=ROOT, occgrid=occupied, headings=headings, radius=radius), 3)
    goals = goals_of(planner, 5)
    once = LatticePlanner(occgrid=occupied, headings=headings, radius=radius)
    once.query(ROOT, ROOT)
    query, _ = timed(lambda: [once.query(ROOT, goal) for goal in goals])
    states = len(planner.vertices)
    print(f'{side:>5} {headings:>8} {radius:>6g} {states:>10} {planner.nedges / states:>11.1f} {seconds * 1e3:>9.1f} '
          f'{seconds / states * 1e9:>8.0f} {query / len(goals) * 1e3:>9.1f}', flush=True)


def boxes(seed, side):
    """Return a map of random boxes, with a start and a goal that a flood fill joins."""
    random = np.random.default_rng(seed)
    while True:
        occupied = np.zeros((side, side), bool)
        for _ in range(side // 4):
            x, y = random.integers(0, side, 2)
            width, height = random.integers(2, side // 4, 2)
            occupied[y:y + height, x:x + width] = True
        rooms, _ = label(~occupied, np.ones((3, 3)))
        free = np.argwhere(~occupied)[:, ::-1]
        (x, y), (to_x, to_y) = free[random.integers(len(free), size=2)].tolist()
        if rooms[y, x] == rooms[to_y, to_x] and (x, y) != (to_x, to_y):
            return occupied, (x, y), (to_x, to_y)


def compare_bugs(side, count, has_toolbox):
    """Print the row of Bug2 on many maps of one size."""
    scenes = [boxes(seed, side) for seed in range(count)]
    paths = {}

    def run(name, walk):
        began, arrived = time.perf_counter(), 0
        for i, scene in enumerate(scenes):
            try:
                paths[name, i] = walk(*scene)
                arrived += 1
            except (NoPath, RuntimeError, ValueError, IndexError):
                continue
        return arrived, (time.perf_counter() - began) / count

    arrived, seconds = run('ours', lambda occupied, start, goal: Bug2(occupied).run(start, goal))
    row = f'{side:>5} {count:>5} {arrived:>5} {seconds * 1e3:>9.3f}'
    if has_toolbox:
        from roboticstoolbox import Bug2 as ToolboxBug

        theirs, peer = run('toolbox', lambda occupied, start, goal: ToolboxBug(occgrid=toolbox_grid(occupied)).run(
            start, goal))
        both = [i for i in range(count) if ('toolbox', i) in paths and ('ours', i) in paths]
        steps = [sum(len(paths[name, i]) for i in both) for name in ('ours', 'toolbox')]
        row += f' {theirs:>7} {peer * 1e3:>9.2f} {peer / seconds:>7.0f}x {steps[0]:>7} {steps[1]:>7}'
    print(row, flush=True)


def main():
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--sides', type=int, nargs='+', default=[8, 12, 16, 20], help='of the grids for both packages')
    parser.add_argument('--large', type=int, nargs='+', default=[256, 512, 1024], help='of the grids for ours alone')
    options = parser.parse_args()
    has_toolbox = util.find_spec('roboticstoolbox') is not None
    versions = ', '.join(f'{name} {metadata.version(name)}' for name in ('numpy', 'numba'))
    print(f'Python {platform.python_version()}, {versions}, '
          + (f'{TOOLBOX} {metadata.version(TOOLBOX)}' if has_toolbox else f'{TOOLBOX} is missing'))
    warm_up()

    print('\nWhole graph and 10 queries, 4 headings; times in ms; "hits": motions through an occupied cell')
    print(f'{"side":>5} {"walls":>5} {"vertices":>8} {"edges":>7} {"graph":>9} {"query":>9} '
          f'{"toolbox:":>8} {"edges":>7} {"graph":>10} {"ratio":>9} {"query":>9} {"ratio":>8} '
          f'{"max more":>9} {"hits":>5} {"toolbox":>7}')
    for crowd in (0.0, 0.1):
        for side in options.sides:
            compare_graphs(side, crowd, has_toolbox)

    print('\nWhole graph and one-off queries on large grids, 5 % occupied; times in ms')
    print(f'{"side":>5} {"headings":>8} {"radius":>6} {"states":>10} {"edges/state":>11} {"graph":>9} {"ns/state":>8} '
          f'{"query":>9}')
    for side in options.large:
        for headings, radius in ((4, 1.0), (16, 1.0), (16, 4.0), (32, 8.0)):
            larger_graphs(side, headings, radius)

    print('\nBug2 on random boxes, all of them solvable; ms a run, steps where both arrive')
    print(f'{"side":>5} {"maps":>5} {"ours":>5} {"time":>9} {"toolbox":>7} {"time":>9} {"ratio":>8} {"steps":>7} '
          f'{"toolbox":>7}')
    for side in (16, 32, 64):
        compare_bugs(side, 60, has_toolbox)


if __name__ == '__main__':
    main()
