"""Pictures in three dimensions: cost surfaces, and paths in configuration space."""
from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

# More faces than this along a side are not seen, and cost seconds.
_MOST_FACES = 120


def new_space(title: str = '', *, unit: str = 'm', height: str = '') -> Axes:
    """Return the axes of a new figure with x, y in ``unit`` and a third axis named ``height``."""
    figure = Figure(figsize=(9.0, 8.0), layout='constrained')
    FigureCanvasAgg(figure)
    return add_space(figure, title, unit, height)


def add_space(figure: Figure, title: str = '', unit: str = 'm', height: str = '') -> Axes:
    """Return new axes in three dimensions of a figure."""
    axes = figure.add_subplot(projection='3d', xlabel=f'x [{unit}]', ylabel=f'y [{unit}]', zlabel=height)
    axes.set_title(title, loc='left')
    return axes


def draw_surface(axes: Axes, field: ArrayLike, cmap: str = 'viridis') -> None:
    """Draw a field (h, w) over its cells; where it is not finite there is a hole."""
    field = np.asarray(field, float)
    y, x = (np.unique(np.linspace(0, side - 1, min(side, _MOST_FACES)).round().astype(int)) for side in field.shape)
    sampled = field[np.ix_(y, x)]
    heights = np.ma.masked_invalid(sampled)
    if min(sampled.shape) > 1 and heights.count():
        axes.plot_surface(*np.meshgrid(x, y), np.where(heights.mask, np.nan, sampled), cmap=cmap, rstride=1, cstride=1,
                          vmin=heights.min(), vmax=heights.max(), linewidth=0, alpha=0.9)


def draw_floor(axes: Axes, occupied: ArrayLike, level: float, colour: tuple) -> None:
    """Draw the occupied cells (h, w) as flat squares at a height."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    y, x = np.nonzero(occupied)
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    squares = np.stack([x, y], axis=-1)[:, None] + corners
    level = np.full((len(x), 4, 1), float(level))
    axes.add_collection3d(Poly3DCollection(np.concatenate([squares, level], axis=-1), facecolor=colour, alpha=0.5))
    height, width = np.shape(occupied)
    axes.set(xlim=(-0.5, width - 0.5), ylim=(-0.5, height - 0.5))
