"""Pictures of maps, fields and paths: arrays in, a matplotlib figure out.

Every function draws into given axes; `new_figure` makes some that need no display and share nothing with
``matplotlib.pyplot``.
"""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.transforms import Affine2D
from numpy.typing import ArrayLike

FREE_COLOUR = (1.0, 1.0, 1.0)
OCCUPIED_COLOUR = (0.13, 0.14, 0.16)
UNKNOWN_COLOUR = (0.80, 0.82, 0.84)
RED, PINK = (0.85, 0.15, 0.15), (1.0, 0.75, 0.80)
PATH_COLOUR = '#1f6fd6'
# Lines drawn on top of each other: a yellow dashed one on black stands out on any background.
STRIPED_LINE = ({'color': 'black', 'linewidth': 4}, {'color': 'yellow', 'linewidth': 3, 'linestyle': (0, (5, 5))})
STRIPED_REVERSE_LINE = ({'color': 'black', 'linewidth': 4}, {'color': 'red', 'linewidth': 3, 'linestyle': (0, (5, 5))})
START_MARKER = {'marker': 'o', 'markersize': 9, 'color': '#2ca02c', 'markeredgecolor': 'white', 'linestyle': 'none'}
GOAL_MARKER = {'marker': '*', 'markersize': 15, 'color': '#d62728', 'markeredgecolor': 'white', 'linestyle': 'none'}

ROBOT_MARKER = {'marker': 'o', 'markersize': 8, 'color': 'black', 'markeredgecolor': 'yellow', 'markeredgewidth': 1.5,
                'linestyle': 'none', 'zorder': 6}


def new_figure(width: float, height: float, title: str = '', *, unit: str = 'm') -> tuple[Figure, Axes]:
    """Return a figure for a world of ``width`` by ``height`` and its axes, both equally scaled.

    Parameters
    ----------
    width, height : float
        In ``unit``; what is drawn later sets the limits.
    title : str
    unit : str
        Of the axes.
    """
    figure = Figure(figsize=figure_size(width, height), layout='constrained')
    FigureCanvasAgg(figure)
    return figure, add_axes(figure, title, unit)


def figure_size(width: float, height: float) -> tuple[float, float]:
    """Return the size [inch] of a figure for a world of ``width`` by ``height``."""
    scale = min(9.5 / width, 8.0 / height)
    return max(width * scale, 4.0) + 0.8, max(height * scale, 2.0) + 1.1


def add_axes(figure: Figure, title: str = '', unit: str = 'm') -> Axes:
    """Return new axes of a figure, both equally scaled."""
    axes = figure.add_subplot(aspect='equal', xlabel=f'x [{unit}]', ylabel=f'y [{unit}]')
    axes.set_title(title, loc='left')
    return axes


def draw_map(axes: Axes, data: ArrayLike, resolution: float = 1.0, origin: ArrayLike = (0.0, 0.0, 0.0)) -> None:
    """Draw an occupancy grid: free cells white, occupied ones nearly black, unknown ones grey.

    Parameters
    ----------
    axes : Axes
        Its limits become the box around the grid.
    data : (h, w) array_like of int
        Cell values -1..100, row 0 at the lowest y.
    resolution : float [m]
    origin : (3,) array_like [m, m, rad]
        Pose of the lower-left corner of cell (0, 0).
    """
    data = np.asarray(data, np.int8)
    colours = np.empty((*data.shape, 3), np.uint8)
    for i, (free, occupied, unknown) in enumerate(zip(FREE_COLOUR, OCCUPIED_COLOUR, UNKNOWN_COLOUR)):
        ramp = np.append(np.linspace(free, occupied, 101), unknown)
        colours[..., i] = np.rint(255 * ramp).astype(np.uint8)[data]  # -1 is the ramp's last entry
    _show_cells(axes, colours, resolution, origin)


def draw_cells(axes: Axes, occupied: ArrayLike, grown: ArrayLike, resolution: float = 1.0,
               origin: ArrayLike = (0.0, 0.0, 0.0)) -> None:
    """Draw obstacles in red and the cells they were grown by in pink, on white.

    Parameters
    ----------
    axes : Axes
        Its limits become the box around the grid.
    occupied, grown : (h, w) array_like of bool
        Obstacles before and after they were inflated.
    resolution, origin
        As for `draw_map`.
    """
    colours = np.ones((*np.shape(occupied), 3))
    colours[np.asarray(grown, bool)] = PINK
    colours[np.asarray(occupied, bool)] = RED
    _show_cells(axes, colours, resolution, origin)


def draw_field(
    axes: Axes, field: ArrayLike, resolution: float = 1.0, origin: ArrayLike = (0.0, 0.0, 0.0), *,
    cmap: str | Colormap = 'gray', label: str = '', colorbar: bool = True,
) -> None:
    """Draw a field, small values in the first colours; occupied cells (NaN) are red, unreachable ones (inf) pink.

    Parameters
    ----------
    axes : Axes
        Its limits become the box around the grid.
    field : (h, w) array_like
    resolution, origin
        As for `draw_map`.
    cmap : str or Colormap
    label : str
        Of the colour bar.
    colorbar : bool
    """
    field = np.asarray(field, float)
    image = _show_cells(axes, np.where(np.isfinite(field), field, np.nan), resolution, origin, cmap=cmap)
    lost = np.zeros((*field.shape, 4))
    lost[np.isnan(field)] = (*RED, 1.0)
    lost[np.isinf(field)] = (*PINK, 1.0)
    _show_cells(axes, lost, resolution, origin)
    if colorbar:
        height, width = field.shape
        axes.figure.colorbar(image, ax=axes, label=label, fraction=0.05 * min(1.0, height / width), pad=0.02)


def draw_path(
    axes: Axes, points: ArrayLike, *,
    line: Sequence[Mapping] = ({'color': PATH_COLOUR, 'linewidth': 2.5},), label: str | None = None,
) -> None:
    """Draw a path as one or more lines on top of each other; the label belongs to the last.

    Parameters
    ----------
    axes : Axes
    points : (N, 2 or more) array_like
    line : sequence of dict
        Matplotlib line properties.
    label : str, optional
        For the legend.
    """
    coordinates = np.asarray(points, float).T[:3 if is_space(axes) else 2]
    for i, style in enumerate(line):
        last = i == len(line) - 1
        axes.plot(*coordinates, **{'solid_capstyle': 'round', 'solid_joinstyle': 'round', 'zorder': 3, **style},
                  label=label if last else None)


def draw_directed_path(
    axes: Axes, points: ArrayLike, direction: ArrayLike, *,
    line: Sequence[Mapping] = STRIPED_LINE, line_r: Sequence[Mapping] = STRIPED_REVERSE_LINE,
) -> None:
    """Draw a path of which parts are driven backwards, each part in its own style.

    Parameters
    ----------
    axes : Axes
    points : (N, 2 or more) array_like
    direction : (N,) array_like
        Below 0 where the robot arrives at a point backwards; the first is that of the second.
    line, line_r : sequence of dict
        Matplotlib line properties of the parts driven forwards and backwards.
    """
    points, backwards = np.asarray(points, float), np.asarray(direction) < 0
    ends = [*np.flatnonzero(np.diff(backwards[1:])) + 1, len(points) - 1]
    labelled, begin = set(), 0
    for end in ends:
        style, label = (line_r, 'path, backwards') if backwards[end] else (line, 'path')
        draw_path(axes, points[begin:end + 1], line=style, label=None if label in labelled else label)
        labelled.add(label)
        begin = end


def draw_points(axes: Axes, points: ArrayLike, style: Mapping) -> None:
    """Draw a marker on each point (N, 2 or more)."""
    coordinates = np.asarray(points, float).T[:3 if is_space(axes) else 2]
    axes.plot(*coordinates, **{'marker': '.', 'linestyle': 'none', 'zorder': 4, **style})


def is_space(axes: Axes) -> bool:
    """Return whether the axes have three dimensions."""
    return axes.name == '3d'


def draw_pose(axes: Axes, pose: ArrayLike, style: Mapping, *, label: str | None = None) -> None:
    """Draw a point by its marker, with an arrow in its heading if it has one.

    Parameters
    ----------
    axes : Axes
    pose : (2,) or (3,) array_like
        x, y and perhaps the heading [rad].
    style : dict
        Matplotlib marker properties, such as `START_MARKER`.
    label : str, optional
        For the legend.
    """
    x, y, *heading = np.asarray(pose, float)
    place = (x, y, *(heading or (0.0,))) if is_space(axes) else (x, y)
    axes.plot(*([value] for value in place), **{'zorder': 5, **style}, label=label)
    if heading and not is_space(axes):
        axes.quiver(x, y, np.cos(heading), np.sin(heading), units='inches', scale_units='inches', scale=2.5,
                    width=0.035, color=style.get('color', 'black'), zorder=4)


def draw_legend(axes: Axes) -> None:
    """Write a legend below the axes and their labels, where it covers nothing."""
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc='upper center', bbox_to_anchor=(0.5, 0.0), borderaxespad=4.0, ncols=6, frameon=False,
                    handletextpad=0.5, columnspacing=1.5)


def save(figure: Figure, path: str | Path, dpi: int = 130) -> None:
    """Write the figure to ``path``; its ending gives the format."""
    figure.savefig(path, dpi=dpi, bbox_inches='tight')


def _show_cells(axes, cells, resolution, origin, **options):
    """Show an (h, w) array of values or colours, row 0 at the lowest y, and set the limits to the box around it."""
    x, y, yaw = origin
    height, width = np.multiply(np.shape(cells)[:2], resolution)
    image = axes.imshow(cells, origin='lower', extent=(x, x + width, y, y + height), interpolation='nearest', zorder=0,
                        **options)
    turn = Affine2D().rotate_around(x, y, yaw)
    image.set_transform(turn + axes.transData)
    corners = turn.transform([(x, y), (x + width, y), (x + width, y + height), (x, y + height)])
    axes.set(xlim=(corners[:, 0].min(), corners[:, 0].max()), ylim=(corners[:, 1].min(), corners[:, 1].max()))
    return image
