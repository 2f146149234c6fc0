"""What a mission leaves behind: ``report.json`` and ``mission.png`` in a folder."""
from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body, Report
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle


def write_outcome(folder: str | Path, report: Report, solutions: Mapping[int, Solution],
                  bodies: Sequence[Body], environment: Environment) -> tuple[Path, Path]:
    """Write ``report.json`` and ``mission.png`` into ``folder``, which is made, and return their paths.

    Raises
    ------
    OSError
        The folder cannot be written.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(report.as_dict(), indent=2, allow_nan=False) + '\n'
    (folder / 'report.json').write_text(text)
    draw_mission(report, solutions, bodies, environment, folder / 'mission.png')
    return folder / 'report.json', folder / 'mission.png'


def draw_mission(report: Report, solutions: Mapping[int, Solution], bodies: Sequence[Body],
                 environment: Environment, path: str | Path) -> None:
    """Draw the map, what each robot drove, its start and goal, and the closest approach, to ``path``."""
    from mobile_planning.drawing import maps, missions
    x_min, y_min, x_max, y_max = environment.bounds
    title = (f'{report.name}: {report.arrived} of {report.robots} arrived in {report.mission_time:.1f} s, '
             f'{"valid" if report.valid else "NOT VALID"}')
    figure, axes = maps.new_figure(x_max - x_min, y_max - y_min, title)
    if environment.grid is not None:
        grid = environment.grid
        maps.draw_map(axes, grid.data, grid.resolution, grid.origin)
    missions.draw_obstacles(
        axes, [((o.x, o.y), o.radius) for o in environment.obstacles if isinstance(o, RoundObstacle)],
        [o.vertices for o in environment.obstacles if isinstance(o, PolygonObstacle)],
        None if environment.boundary is None else vars(environment.boundary))
    for body, colour in zip(bodies, missions.COLOURS * len(bodies)):
        solution = solutions.get(body.eyed)
        track = np.empty((0, 2)) if solution is None else np.column_stack([solution.x, solution.y])
        missions.draw_robot(axes, f'robot {body.eyed}', colour, body.radius, track, body.start, body.goal)
    if report.closest is not None:
        radii = {body.eyed: body.radius for body in bodies}
        missions.draw_closest(axes, report.closest['places'], report.min_separation, report.closest['time'],
                              [radii[eyed] for eyed in report.closest['robots']])
    maps.draw_legend(axes)
    maps.save(figure, path)
