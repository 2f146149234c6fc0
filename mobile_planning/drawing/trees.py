"""Trees of curves, as matplotlib lines."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import ArrayLike

_EDGE_COLOUR, _NODE_COLOUR = '#5b8fd0', '#1f3f6f'


def draw_tree(axes: Axes, edges: Sequence[ArrayLike], nodes: ArrayLike | None = None) -> None:
    """Draw the edges of a tree as thin lines, and its nodes as dots.

    Parameters
    ----------
    axes : Axes
    edges : sequence of (n, 2 or more) array_like [m]
        Points along each edge.
    nodes : (m, 2 or more) array_like [m], optional
    """
    lines = [np.asarray(edge, float)[:, :2] for edge in edges]
    axes.add_collection(LineCollection(lines, colors=_EDGE_COLOUR, linewidths=0.6, alpha=0.8, zorder=2))
    if nodes is not None:
        axes.plot(*np.asarray(nodes, float)[:, :2].T, '.', color=_NODE_COLOUR, markersize=3, zorder=3)


def set_limits(axes: Axes, bounds: ArrayLike) -> None:
    """Show the world within x_min, y_min, x_max, y_max [m] and draw its border."""
    x_min, y_min, x_max, y_max = bounds
    axes.set(xlim=(x_min, x_max), ylim=(y_min, y_max), aspect='equal')
