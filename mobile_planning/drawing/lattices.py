"""Draw the graph of a lattice: its vertices as dots, its edges as curves."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import ArrayLike

from mobile_planning.drawing.maps import is_space

_EDGE_COLOUR, _VERTEX_COLOUR = '0.35', '#1f6fd6'


def draw_graph(axes: Axes, vertices: ArrayLike, curves: Sequence[ArrayLike]) -> None:
    """Draw a graph.

    Parameters
    ----------
    axes : Axes
        In three dimensions the third coordinate is drawn, otherwise the first two.
    vertices : (N, 3) array_like
    curves : sequence of (P, 3) array_like
        One an edge.
    """
    count = 3 if is_space(axes) else 2
    vertices = np.asarray(vertices, float)
    if is_space(axes):
        from mpl_toolkits.mplot3d.art3d import Line3DCollection

        axes.add_collection3d(Line3DCollection(list(curves), colors=_EDGE_COLOUR, linewidths=0.5, alpha=0.5))
    else:
        flat = [np.asarray(curve)[:, :2] for curve in curves]
        axes.add_collection(LineCollection(flat, colors=_EDGE_COLOUR, linewidths=0.6, alpha=0.6, zorder=1))
        axes.autoscale_view()
    size = 5 if len(vertices) < 2000 else 1.5
    axes.plot(*vertices[:, :count].T, '.', color=_VERTEX_COLOUR, markersize=size, zorder=2, linestyle='none')
