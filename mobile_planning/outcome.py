"""What a mission leaves behind: ``report.json`` and ``mission.png`` in a folder, and a film."""
from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.solution import Solution
from mobile_planning.fleet.verification import Body, Report
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import PolygonObstacle, RoundObstacle

#: Of a film: so many frames after the first, the size of one against a picture's, and the least time that it stays [s].
_FRAMES, _FILM_SCALE, _LEAST_INTERVAL = 120, 0.6, 0.04


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
    figure, axes = _world(environment, f'{report.name}: {report.arrived} of {report.robots} arrived in '
                                       f'{report.mission_time:.1f} s, {"valid" if report.valid else "NOT VALID"}')
    for body, colour in zip(bodies, missions.COLOURS * len(bodies)):
        solution = solutions.get(body.eyed)
        track = np.empty((0, 2)) if solution is None else np.column_stack([solution.x, solution.y])
        missions.draw_robot(axes, f'robot {body.eyed}', colour, body.radius, track, body.start, body.goal)
        missions.draw_via(axes, colour, [goal[:2] for goal in body.via])
    if report.closest is not None:
        radii = {body.eyed: body.radius for body in bodies}
        missions.draw_closest(axes, report.closest['places'], report.min_separation, report.closest['time'],
                              [radii[eyed] for eyed in report.closest['robots']])
    maps.draw_legend(axes)
    maps.save(figure, path)


def check_film(path: str | Path) -> None:
    """Raise InvalidInput unless a film can be written to ``path``: a .gif, or a .mp4 where ffmpeg is installed."""
    from mobile_planning.drawing import animation
    try:
        animation.check_film(path)
    except (ValueError, RuntimeError) as error:
        raise InvalidInput(f'{error}') from None


def film_mission(report: Report, solutions: Mapping[int, Solution], bodies: Sequence[Body],
                 environment: Environment, path: str | Path) -> None:
    """Write a film of the mission to ``path``, whose folder is made: at least twice as fast as it was.

    Raises
    ------
    InvalidInput
        See `check_film`.
    OSError
        The file cannot be written.
    """
    from mobile_planning.drawing import animation, missions
    check_film(path)
    driven = [body for body in bodies if body.eyed in solutions]
    end = max((float(solutions[body.eyed].t[-1]) for body in driven), default=0.0)
    times = np.linspace(0.0, end, _FRAMES + 1)
    tracks = np.array([_poses(solutions[body.eyed], times) for body in driven]).reshape(len(driven), len(times), 3)
    figure, axes = _world(environment, ' ')
    figure.set_size_inches(_FILM_SCALE * figure.get_size_inches())
    show = missions.draw_moving(axes, missions.COLOURS, [body.radius for body in driven], tracks,
                                [body.goal for body in driven])

    def show_share(share):
        index = round(share * _FRAMES)
        show(index)
        axes.set_title(f'{report.name}  {times[index]:.1f} s', loc='left')

    Path(path).parent.mkdir(parents=True, exist_ok=True)
    animation.play(figure, show_share, _FRAMES, film=path, interval=max(end / _FRAMES / 2, _LEAST_INTERVAL))


def _poses(solution, times):
    """Return x, y, theta (N, 3) [m, m, rad] at ``times`` (N,) [s] since the start of the mission."""
    index = np.searchsorted(solution.t, times).clip(max=len(solution.t) - 1)
    return np.column_stack([solution.x[index], solution.y[index], solution.theta[index]])


def _world(environment, title):
    """Return a figure of the static world and its axes."""
    from mobile_planning.drawing import maps, missions
    x_min, y_min, x_max, y_max = environment.bounds
    figure, axes = maps.new_figure(x_max - x_min, y_max - y_min, title)
    if environment.grid is not None:
        grid = environment.grid
        maps.draw_map(axes, grid.data, grid.resolution, grid.origin)
    missions.draw_obstacles(
        axes, [((o.x, o.y), o.radius) for o in environment.obstacles if isinstance(o, RoundObstacle)],
        [o.vertices for o in environment.obstacles if isinstance(o, PolygonObstacle)],
        None if environment.boundary is None else vars(environment.boundary))
    return figure, axes
