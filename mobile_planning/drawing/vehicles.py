"""Outlines of vehicles that show where a configuration heads."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Polygon
from numpy.typing import ArrayLike

# One long, the nose at +x; a car turns about its rear axle, which is where its configuration is.
SHAPES = {
    'car': ((-0.25, -0.28), (0.50, -0.28), (0.68, -0.20), (0.75, 0.0), (0.68, 0.20), (0.50, 0.28), (-0.25, 0.28)),
    'triangle': ((-0.4, -0.3), (0.6, 0.0), (-0.4, 0.3)),
}
START_VEHICLE = {'shape': 'car', 'args': {'fill': False, 'edgecolor': '#1a7a1a', 'linewidth': 2}}
GOAL_VEHICLE = {'shape': 'car', 'args': {'fill': True, 'color': '#d62728', 'alpha': 0.5}}


def draw_vehicle(axes: Axes, configuration: ArrayLike, style: Mapping, *, label: str | None = None) -> None:
    """Draw a vehicle's outline.

    Parameters
    ----------
    axes : Axes
        Their limits are set: without a length of its own the vehicle is a twentieth of their width long.
    configuration : (3,) array_like
        x, y and the heading [rad].
    style : dict
        ``shape``, 'car' or 'triangle'; ``args``, matplotlib's properties of a polygon, with ``filled`` as another
        name of ``fill``; ``length`` in the unit of the axes.
    label : str, optional
        For the legend.

    Raises
    ------
    ValueError
        If the style has another key or an unknown shape.
    """
    unknown = {*style} - {'shape', 'args', 'length'}
    shape = style.get('shape', 'car')
    if unknown or shape not in SHAPES:
        wrong = f'shape {shape!r} is not one of {", ".join(SHAPES)}' if not unknown else f'unknown {sorted(unknown)}'
        raise ValueError(f'style of a vehicle: {wrong}')
    x, y, theta = np.asarray(configuration, float)
    length = style.get('length') or max(1.0, float(np.ptp(axes.get_xlim())) / 20)
    turn = np.array([[np.cos(theta), np.sin(theta)], [-np.sin(theta), np.cos(theta)]])
    properties = dict(style.get('args', {}))
    if 'filled' in properties:
        properties['fill'] = properties.pop('filled')
    outline = length * np.array(SHAPES[shape]) @ turn + (x, y)
    axes.add_patch(Polygon(outline, closed=True, **{'zorder': 5, **properties}, label=label))
