"""The pictures of a lattice: its graph, and paths as the curves that are driven."""
from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from mobile_planning.grid.planner_films import PlannerFilms

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Beyond this the edges of a graph are not drawn: one would see a grey sheet.
_MOST_DRAWN = 30_000


class LatticePlots(PlannerFilms):
    """Draws a lattice planner."""

    def _drawn_curve(self, path):
        return self.curve(path) if path.shape[1] == 3 else super()._drawn_curve(path)

    def _plot_background(self, ax: Axes, configspace: bool, options: dict) -> None:
        """Draw the grid, and the graph unless it is too large."""
        from mobile_planning.drawing.lattices import draw_graph

        super()._plot_background(ax, configspace, options)
        if self._planned is not None and self._planned.edges <= _MOST_DRAWN:
            draw_graph(ax, self.vertices, self._edge_curves(self._planned))

    def _edge_curves(self, lattice):
        """Return the curve (P, 3) of every edge."""
        curves = []
        for motion, begin in lattice.edges_by_motion():
            curves += list(lattice.motions.primitives[motion].points()[None] + np.insert(begin, 2, 0, axis=1)[:, None])
        return curves

    def _growth(self, ax):
        """Draw the grid and return what shows the first share of the vertices."""
        self.plot_bg(ax=ax)
        vertices = self.vertices[:, :2]
        (dots,) = ax.plot(*vertices.T, '.', color='#1f6fd6', markersize=4, zorder=2, linestyle='none')
        return lambda share: dots.set_data(*vertices[:1 + round(share * (len(vertices) - 1))].T), len(vertices)
