"""Draw a mission: the map, what each robot drove, and where two came closest."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle
from numpy.typing import ArrayLike

#: Colours that people with colour blindness tell apart (Okabe and Ito), in turn.
COLOURS = ('#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9', '#000000', '#B8A800')


def draw_robot(axes: Axes, label: str, colour: str, radius: float, track: ArrayLike,
               start: ArrayLike, goal: ArrayLike) -> None:
    """Draw one robot's mission.

    Parameters
    ----------
    axes : Axes
    label : str
        For the legend.
    colour : str
    radius : float [m]
    track : (N, 2) array_like [m]
        What it drove.
    start, goal : (3,) array_like [m, m, rad]
        Drawn as the body with a line to its front, and as a star.
    """
    track = np.asarray(track, float).reshape(-1, 2)
    axes.plot(track[:, 0], track[:, 1], color=colour, linewidth=1.8, label=label, zorder=4)
    x, y, theta = start
    axes.add_patch(Circle((x, y), radius, facecolor=colour, edgecolor='black', alpha=0.85, zorder=5))
    axes.plot([x, x + radius * np.cos(theta)], [y, y + radius * np.sin(theta)], color='white', linewidth=1.5, zorder=6)
    axes.plot(goal[0], goal[1], marker='*', markersize=13, color=colour, markeredgecolor='black', zorder=6,
              linestyle='none')
    axes.add_patch(Circle(goal[:2], radius, fill=False, edgecolor=colour, linestyle=':', zorder=5))


def draw_via(axes: Axes, colour: str, places: ArrayLike) -> None:
    """Draw the goals (N, 2) [m] before the last one as small stars."""
    places = np.asarray(places, float).reshape(-1, 2)
    axes.plot(places[:, 0], places[:, 1], marker='*', markersize=8, color=colour, markeredgecolor='black', zorder=6,
              linestyle='none')


def draw_moving(axes: Axes, colours: Sequence[str], radii: Sequence[float], tracks: ArrayLike,
                goals: Sequence[ArrayLike]) -> Callable[[int], None]:
    """Draw bodies that can be moved, and their goals; return what moves all to the k-th pose of their tracks.

    Parameters
    ----------
    axes : Axes
    colours : sequence of str
        Taken in turn.
    radii : sequence of float [m]
    tracks : (R, N, 3) array_like [m, m, rad]
        Poses; what has been driven is drawn as well.
    goals : sequence of (3,) array_like [m, m, rad]
    """
    parts, tracks = [], np.asarray(tracks, float)
    for index, (radius, goal) in enumerate(zip(radii, goals)):
        colour = colours[index % len(colours)]
        axes.plot(goal[0], goal[1], marker='*', markersize=7, color=colour, markeredgecolor='black',
                  markeredgewidth=0.5, zorder=4, linestyle='none')
        disc = axes.add_patch(Circle((0.0, 0.0), radius, facecolor=colour, edgecolor='black', linewidth=0.6, zorder=5))
        (nose,), (trail,) = (axes.plot([], [], color=shade, linewidth=width, zorder=zorder)
                             for shade, width, zorder in (('white', 1.2, 6), (colour, 0.8, 3)))
        parts.append((disc, nose, trail, radius))

    def show(index):
        for (disc, nose, trail, radius), track in zip(parts, tracks):
            x, y, theta = track[index]
            disc.center = x, y
            nose.set_data([x, x + radius * np.cos(theta)], [y, y + radius * np.sin(theta)])
            trail.set_data(track[:index + 1, 0], track[:index + 1, 1])
    return show


def draw_closest(axes: Axes, places: ArrayLike, distance: float, time: float, radii: Sequence[float]) -> None:
    """Draw the two bodies (2, 2) [m] at their closest approach, ``time`` [s] after the start."""
    places = np.asarray(places, float)
    for place, radius in zip(places, radii):
        axes.add_patch(Circle(place, radius, fill=False, edgecolor='crimson', linewidth=1.2, zorder=7))
    axes.plot(places[:, 0], places[:, 1], color='crimson', linewidth=1.2, zorder=7,
              label=f'closest: {distance:.2f} m at {time:.1f} s')


def draw_obstacles(axes: Axes, circles: Sequence[tuple], polygons: Sequence[ArrayLike],
                   bounds: Mapping[str, float] | None) -> None:
    """Draw circles ((x, y), radius) [m], polygons (n, 2) [m] and the boundary x_min, x_max, y_min, y_max [m]."""
    for centre, radius in circles:
        axes.add_patch(Circle(centre, radius, facecolor='0.55', edgecolor='0.2', zorder=2))
    for polygon in polygons:
        axes.fill(*np.asarray(polygon, float).T, facecolor='0.55', edgecolor='0.2', zorder=2)
    if bounds is not None:
        x = [bounds['x_min'], bounds['x_max'], bounds['x_max'], bounds['x_min'], bounds['x_min']]
        y = [bounds['y_min'], bounds['y_min'], bounds['y_max'], bounds['y_max'], bounds['y_min']]
        axes.plot(x, y, color='0.2', linewidth=2, zorder=2)
