"""What a planner shows of its work: progress, a line about it, and moving pictures of its plan and its robot."""
from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from mobile_planning.grid.observer import film_of, with_progress
from mobile_planning.grid.planner_plots import PlannerPlots

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class PlannerFilms(PlannerPlots):
    """Draws a planner, tells how it works, and shows it in motion, in a window or as a film."""

    def _watch_plan(self, work, animate, progress, verbose, summary, movie, stop):
        """Do the work of planning and show it in all ways that are asked for."""
        film_of(movie)
        with_progress(work, progress, stop, type(self).__name__)
        if self.verbose or verbose:
            print(f'{type(self).__name__}: {self._facts()[-1]}')
        if summary:
            print(self)
        if animate or movie is not None:
            self._animate_plan(animate, movie)

    def _show_path(self, path, status, verbose, animate, movie):
        """Show a path in all ways that are asked for."""
        if self.verbose or verbose:
            print(f'{type(self).__name__}: {len(path)} points from {end_text(path[0])} to {end_text(path[-1])}'
                  f'{"" if status is None else f", cost {status.cost:g}"}')
        if animate or movie is not None:
            self._animate_path(path, animate, movie)

    def _animate_path(self, path, animate, movie):
        """Show the robot drive its path, in a window or a film."""
        from mobile_planning.drawing import animation, maps

        film, interval = film_of(movie)
        ax = self.plot(ax=self._axes(None, window=animate))
        _, curve, (_, directions) = self._drawn_path(path, None, False, True)
        (trail,) = ax.plot([], [], color=maps.PATH_COLOUR, linewidth=2.5, zorder=3)
        (robot,) = ax.plot([], [], **maps.ROBOT_MARKER)

        def show_share(share):
            passed = 1 + round(share * (len(curve) - 1))
            trail.set_data(curve[:passed, 0], curve[:passed, 1])
            robot.set_data(curve[passed - 1:passed, 0], curve[passed - 1:passed, 1])

        animation.play(ax.figure, show_share, len(curve) - 1, film=film, interval=interval, window=animate)

    def _animate_plan(self, animate, movie):
        """Show the plan spread, in a window or a film."""
        from mobile_planning.drawing import animation

        film, interval = film_of(movie)
        ax = self._axes(None, window=animate)
        show_share, steps = self._growth(ax)
        self._plot_ends(ax, [self.start, self.goal])
        animation.play(ax.figure, show_share, steps, film=film, interval=interval, window=animate)

    def _growth(self, ax: Axes) -> tuple[Callable[[float], None], int]:
        """Draw the whole plan and return what hides all but the first share of it, and of how many steps it is made."""
        field = getattr(self, 'distancemap', None)
        self.plot_bg(ax=ax)
        if field is None:
            return lambda share: None, 1
        image = ax.images[0]
        farthest = field[np.isfinite(field)].max()

        def show_share(share):
            image.set_data(np.ma.masked_where(~(field <= share * farthest), field))

        return show_share, int(farthest) + 1


def end_text(end: NDArray | None) -> str:
    """Return a start, a goal or another point of a path as text."""
    return 'none' if end is None else '({})'.format(', '.join(f'{value:g}' for value in end))
