"""The pictures of a planner: its grid, its plan, its path."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Cell centres lie on the integers.
_CORNER = (-0.5, -0.5, 0.0)


class PlannerPlots:
    """Draws a planner; no figure of it belongs to pyplot unless a window is asked for with ``block`` or ``animate``."""

    def plot(
        self,
        path: ArrayLike | None = None,
        line: Sequence[Mapping] | Mapping | None = None,
        line_r: Sequence[Mapping] | Mapping | None = None,
        configspace: bool = False,
        unwrap: bool = True,
        direction: ArrayLike | None = None,
        background: bool = True,
        path_marker: Mapping | None = None,
        path_marker_reverse: Mapping | None = None,
        start_marker: Mapping | None = None,
        goal_marker: Mapping | None = None,
        start_vehicle: Mapping | None = None,
        goal_vehicle: Mapping | None = None,
        start: ArrayLike | Mapping | None = None,
        goal: ArrayLike | Mapping | None = None,
        ax: Axes | None = None,
        block: bool | None = None,
        bgargs: Mapping | None = None,
    ) -> Axes:
        """Draw grid or plan, path, start and goal.

        Parameters
        ----------
        path : (N, 2) or (N, 3) array_like, optional
            Points (x, y) or configurations (x, y, theta).
        line, line_r : dict or sequence of dict, optional
            Matplotlib line properties of motion forwards and backwards, one line drawn on the other; striped yellow
            and striped red on black if not given.
        configspace : bool
            Whether to draw the path in three dimensions, with theta upwards.
        unwrap : bool
            Whether theta goes on beyond pi instead of jumping, where it is drawn.
        direction : (N,) array_like, optional
            Above 0 where the robot arrives at a point forwards, below 0 where backwards.
        background : bool
            Whether to call `plot_bg`.
        path_marker, path_marker_reverse : dict, optional
            Matplotlib properties of a marker on each point; none if not given.
        start_marker, goal_marker : dict, optional
            Matplotlib properties that differ from those of the circle and the star of a point.
        start_vehicle, goal_vehicle : dict, optional
            Of configurations: ``shape``, 'car' or 'triangle'; ``args``, matplotlib's properties of a polygon;
            ``length`` in cells. The outline of a car and a transparent car if not given.
        start, goal : (2,) or (3,) array_like, or dict, optional
            The planner's own if not given; a dict stands for ``start_marker`` or ``goal_marker``.
        ax : Axes, optional
            A new figure's if not given.
        block : bool, optional
            Shows a window, and waits until it is closed if True. None shows nothing.
        bgargs : dict, optional
            Further arguments of `plot_bg`.

        Returns
        -------
        Axes
            Write the picture with ``ax.figure.savefig``.

        Raises
        ------
        InvalidInput
            If the path has no headings and ``configspace`` wants them, or shapes do not match.
        """
        from mobile_planning.drawing import maps, windows

        if isinstance(start, Mapping):
            start, start_marker = None, start
        if isinstance(goal, Mapping):
            goal, goal_marker = None, goal
        ax = self._axes(ax, space='theta [rad]' if configspace else None, window=block is not None)
        if background:
            self._plot_background(ax, configspace, dict(bgargs or {}))
        ends = [_ends_of(self.start if start is None else start), _ends_of(self.goal if goal is None else goal)]
        if path is not None and len(path):
            points, curve, directions = self._drawn_path(path, direction, configspace, unwrap)
            maps.draw_directed_path(ax, curve, directions[1], line=_layers(line, maps.STRIPED_LINE),
                                    line_r=_layers(line_r, maps.STRIPED_REVERSE_LINE))
            for marker, chosen in ((path_marker, directions[0] >= 0), (path_marker_reverse, directions[0] < 0)):
                if marker is not None and chosen.any():
                    maps.draw_points(ax, points[chosen], marker)
            if configspace and ends[1] is not None:
                # The goal stands where the path arrives, after however many turns.
                ends[1] = np.append(ends[1][:2], points[-1, 2])
        self._plot_ends(ax, ends, (start_marker, goal_marker), (start_vehicle, goal_vehicle))
        maps.draw_legend(ax)
        if block is not None:
            windows.show(block)
        return ax

    def plot_bg(
        self,
        distance: ArrayLike | None = None,
        cmap: str = 'gray',
        ax: Axes | None = None,
        inflated: bool = True,
        colorbar: bool = True,
        block: bool | None = None,
    ) -> Axes:
        """Draw what is planned on: the cost-to-go field of a plan if there is one, else the grid.

        Free cells are white, occupied ones red, inflated ones pink; over a field all that is occupied is red, and what
        cannot be reached is pink.

        Parameters
        ----------
        distance : (h, w) array_like, optional
            Drawn in place of the planner's own ``distancemap``.
        cmap : str or Colormap
            Of the field; small values are its first colours.
        ax : Axes, optional
            A new figure's if not given.
        inflated : bool
            Whether to tell the cells that inflation occupied from free ones, where there is no field.
        colorbar : bool
        block : bool, optional
            Shows a window, and waits until it is closed if True. None shows nothing.

        Returns
        -------
        Axes
        """
        from mobile_planning.drawing import maps, windows

        ax = self._axes(ax, window=block is not None)
        distance = getattr(self, 'distancemap', None) if distance is None else distance
        if distance is not None:
            maps.draw_field(ax, distance, 1.0, _CORNER, cmap=cmap, label='distance to goal [cells]', colorbar=colorbar)
        elif self._occupied is not None:
            maps.draw_cells(ax, self._obstacles, self._occupied if inflated else self._obstacles, 1.0, _CORNER)
        if block is not None:
            windows.show(block)
        return ax

    def plot_3d(self, path: ArrayLike | None = None, ls: Mapping | None = None, *, ax: Axes | None = None,
                block: bool | None = None) -> Axes:
        """Draw the distance to the goal as a surface, and a path on it.

        Parameters
        ----------
        path : (N, 2) array_like, optional
            Cells (x, y).
        ls : dict, optional
            Matplotlib line properties of the path.
        ax : Axes, optional
            Three-dimensional; a new figure's if not given.
        block : bool, optional
            Shows a window, and waits until it is closed if True. None shows nothing.

        Returns
        -------
        Axes

        Raises
        ------
        RuntimeError
            If there is no plan with a distance map.
        """
        from mobile_planning.drawing import maps, space, windows

        field = getattr(self, 'distancemap', None)
        if field is None:
            raise RuntimeError('no distance map to draw: call plan() first')
        ax = self._axes(ax, space='distance to goal [cells]', window=block is not None)
        space.draw_floor(ax, self._occupied, 0.0, maps.RED)
        space.draw_surface(ax, field)
        if path is not None and len(path):
            cells = np.rint(np.asarray(path, float)[:, :2]).astype(int)
            # A little above the surface, or the surface would hide it.
            heights = field[cells[:, 1], cells[:, 0]] + 0.02 * np.nanmax(field[np.isfinite(field)])
            maps.draw_path(ax, np.column_stack([cells, heights]), label='path',
                           line=({'color': 'red', 'linewidth': 3, 'zorder': 10, **(ls or {})},))
        if block is not None:
            windows.show(block)
        return ax

    def _plot_background(self, ax, configspace, options):
        """Draw what lies under a path."""
        from mobile_planning.drawing import maps, space

        if not configspace:
            self.plot_bg(ax=ax, **options)
        elif self._occupied is not None:
            space.draw_floor(ax, self._occupied, -np.pi, maps.RED)

    def _plot_ends(self, ax, ends, markers=(None, None), vehicles=(None, None)):
        """Draw start and goal, each a marker or a vehicle."""
        from mobile_planning.drawing import maps
        from mobile_planning.drawing.vehicles import GOAL_VEHICLE, START_VEHICLE, draw_vehicle

        defaults = ((maps.START_MARKER, START_VEHICLE), (maps.GOAL_MARKER, GOAL_VEHICLE))
        for name, end, marker, vehicle, (usual_marker, usual_vehicle) in zip(
                ('start', 'goal'), ends, markers, vehicles, defaults):
            if end is None:
                continue
            if len(end) == 3 and not maps.is_space(ax):
                draw_vehicle(ax, end, vehicle or usual_vehicle, label=name)
            else:
                maps.draw_pose(ax, end, {**usual_marker, **(marker or {})}, label=name)

    def _drawn_curve(self, path: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the points that a path passes, perhaps closer than its own, and the direction of arrival at each."""
        return path, np.ones(len(path))

    def _drawn_path(self, path, direction, configspace, unwrap):
        """Return the path's points, its curve, and the directions at both."""
        points = np.asarray(path, float)
        if points.ndim != 2 or points.shape[1] not in (2, 3):
            raise InvalidInput(f'a path of shape {points.shape} is not (N, 2) or (N, 3)')
        if configspace and points.shape[1] == 2:
            raise InvalidInput('configspace needs a path of configurations (x, y, theta)')
        if direction is not None and np.shape(direction) != (len(points),):
            raise InvalidInput(f'direction of shape {np.shape(direction)} does not belong to {len(points)} points')
        at_points = np.ones(len(points))
        if direction is None:
            curve, at_curve = self._drawn_curve(points)
        else:
            at_points = at_curve = np.asarray(direction, float)
            curve = points
        if points.shape[1] == 3 and unwrap:
            points, curve = (np.column_stack([each[:, :2], np.unwrap(each[:, 2])]) for each in (points, curve))
        return points, curve, (at_points, at_curve)

    def _axes(self, ax, *, space=None, window=False):
        """Return the given axes, or those of a new figure around the grid."""
        from mobile_planning.drawing import maps, windows
        from mobile_planning.drawing import space as spaces

        if ax is not None:
            return ax
        height, width = (10, 10) if self._occupied is None else self._occupied.shape
        title = type(self).__name__
        if window:
            figure = windows.new_window(maps.figure_size(width, height) if space is None else (9.0, 8.0))
            return maps.add_axes(figure, title, 'cells') if space is None else spaces.add_space(
                figure, title, 'cells', space)
        if space is not None:
            return spaces.new_space(title, unit='cells', height=space)
        return maps.new_figure(width, height, title, unit='cells')[1]


def _ends_of(end):
    """Return an end as an array of 2 or 3 numbers, or None."""
    if end is None:
        return None
    end = np.asarray(end, float)
    if end.shape not in ((2,), (3,)):
        raise InvalidInput(f'{end.tolist()} is not a point (x, y) or a configuration (x, y, theta)')
    return end


def _layers(line, usual):
    """Return line styles as a sequence."""
    if line is None:
        return usual
    return (line,) if isinstance(line, Mapping) else tuple(line)
