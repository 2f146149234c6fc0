"""Obstacles on matplotlib axes, from plain numbers and arrays."""
from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon
from numpy.typing import ArrayLike


def circle(center: ArrayLike, radius: float, color: str = 'k', linestyle: str = 'solid', filled: bool = False,
           alpha: float = 1.0) -> Circle:
    """Return a circle that can be added to axes.

    Parameters
    ----------
    center : (2,) array_like [m]
    radius : float [m]
    color, linestyle, filled, alpha
        As matplotlib has them.

    Returns
    -------
    matplotlib.patches.Circle
    """
    return Circle(tuple(center), radius, color=color, linestyle=linestyle, fill=filled, alpha=alpha)


def draw_disc(ax: Axes, center: ArrayLike, radius: float, offset: float = 0.0) -> None:
    """Draw a grey disc and, for a positive offset, a dashed circle that much larger.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    center : (2,) array_like [m]
    radius, offset : float [m]
    """
    ax.add_patch(circle(center, radius, color='gray', filled=True, alpha=0.7))
    if offset > 0:
        ax.add_patch(circle(center, radius + offset, color='gray', linestyle='dashed'))


def draw_polygon(ax: Axes, vertices: ArrayLike, outline: ArrayLike) -> None:
    """Draw a grey polygon and, dashed, a second outline around it.

    Parameters
    ----------
    ax : matplotlib.axes.Axes
    vertices : (N, 2) array_like [m]
    outline : (M, 2) array_like [m]
    """
    ax.add_patch(Polygon(vertices, closed=True, color='gray', alpha=0.7))
    ax.add_patch(Polygon(outline, closed=True, color='gray', fill=False, linestyle='dashed'))
