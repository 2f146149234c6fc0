"""A picture of a tree in its environment."""
from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from mobile_planning.sampling.rrt_graph import curve_to
from mobile_planning.world.environment import Environment
from mobile_planning.world.obstacles import PolygonObstacle

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from mobile_planning.sampling.rrt import RRT

# Of the points on a drawn edge [m].
_SPACING = 0.5


def plot_tree(rrt: RRT, file_name: str | Path, close: bool, nodes: bool) -> Figure:
    """Draw the tree on the open figure and return that (see `RRT.plot`)."""
    from mobile_planning.drawing import maps, windows

    figure, axes = windows.current_axes()
    draw_tree_in(axes, rrt, nodes)
    if file_name:
        maps.save(figure, file_name)
    if close:
        windows.close(figure)
    return figure


def draw_tree_in(axes: Axes, rrt: RRT, nodes: bool = False, path: ArrayLike | None = None) -> None:
    """Draw the tree, its environment, root and goal, and perhaps its nodes and a path (n, 2 or more) [m]."""
    from mobile_planning.drawing import maps, trees

    draw_environment(axes, rrt.environment)
    tree = rrt._tree
    edges = [curve_to(tree, node, rrt._setting.car).sample(_SPACING) for node in range(1, tree.count)]
    trees.draw_tree(axes, edges, tree.poses[:tree.count] if nodes else None)
    if path is not None:
        maps.draw_path(axes, np.asarray(path)[:, :2])
    maps.draw_pose(axes, rrt.root, maps.START_MARKER)
    if rrt.goal is not None:
        maps.draw_pose(axes, rrt.goal, maps.GOAL_MARKER)
    trees.set_limits(axes, rrt.environment.bounds)


def draw_environment(axes: Axes, environment: Environment) -> None:
    """Draw obstacles where they are at time 0, and the grid."""
    from mobile_planning.drawing import maps, obstacles

    if environment.grid is not None:
        maps.draw_map(axes, environment.grid.data, environment.grid.resolution, environment.grid.origin)
    for shape in [*environment.obstacles, *(each.shape for each in environment.moving)]:
        if isinstance(shape, PolygonObstacle):
            obstacles.draw_polygon(axes, shape.vertices, shape.vertices)
        else:
            obstacles.draw_disc(axes, shape.centroid, shape.bounding_circle_radius)
