"""The client ``plan_path``: asks a planner node for a path, prints what came, and draws it on the map."""
from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

import numpy as np
import rclpy
from mobile_planning_msgs.srv import PlanPath
from numpy.typing import NDArray
from rclpy.node import Node

from mobile_planning.errors import PlanningError
from mobile_planning.nodes.client import Client
from mobile_planning.nodes.convert import duration_message, path_poses, pose_stamped, seconds
from mobile_planning.nodes.progress_bar import ProgressBar
from mobile_planning.nodes.reach import require_reach
from mobile_planning.nodes.spin import start_ros, without_ros
from mobile_planning.nodes.stop_signals import StopSignals
from mobile_planning.sampling_options import PLANNERS as SAMPLING_PLANNERS
from mobile_planning.world.occupancy_grid import OccupancyGrid


def parse(args: Sequence[str]) -> argparse.Namespace:
    """Return the options of the command line; a wrong one ends the process with usage and code 2.

    Parameters
    ----------
    args : sequence of str
        Without the executable's name and without what is for ROS.

    Returns
    -------
    argparse.Namespace
    """
    parser = argparse.ArgumentParser(
        prog='plan_path', description='Ask a planner node for a path. Exit code 0: a path came; 1: none did.')
    pose = {'nargs': '+', 'type': float, 'required': True, 'metavar': ('X', 'Y')}
    parser.add_argument('--start', help='x y [theta] in the map frame [m, m, rad]', **pose)
    parser.add_argument('--goal', help='x y [theta] [m, m, rad]', **pose)
    parser.add_argument('--planner', default='', help="id of the planner; the node's default otherwise")
    parser.add_argument('--deadline', type=float, default=0.0, metavar='S', help="time to plan in [s]; 0: the node's")
    parser.add_argument('--tolerance', type=float, default=0.0, metavar='M',
                        help='an occupied goal may be replaced by a free cell this near [m]')
    parser.add_argument('--seed', type=int, default=0, help='of planners that draw at random')
    parser.add_argument('--frame', default='map', help='frame of start and goal (map)')
    parser.add_argument('--node', help='name of the planner node (sampling_planner for a planner of its own: '
                        f'{", ".join(SAMPLING_PLANNERS)}; else grid_planner)')
    parser.add_argument('--timeout', type=float, default=10.0, metavar='S',
                        help='how long to wait for the node, and for its answer beyond the deadline [s] (10)')
    parser.add_argument('--plot', metavar='FILE', help='draw the path on the map into this file, e.g. path.png')
    parser.add_argument('--progress', action='store_true',
                        help='draw a bar on stderr if planning takes long, also where that is no terminal')
    parser.add_argument('--map', default='map', help='topic of the map to draw on (map)')
    options = parser.parse_args(args)
    options.node = options.node or ('sampling_planner' if options.planner in SAMPLING_PLANNERS else 'grid_planner')
    for name in ('start', 'goal'):
        if len(getattr(options, name)) not in (2, 3):
            parser.error(f'argument --{name}: x y or x y theta, not {len(getattr(options, name))} numbers')
    if not 0 <= options.deadline < 1e9 or not 0 < options.timeout < 1e9:
        parser.error('--deadline must be at least 0 and --timeout above 0')
    if not -2**63 <= options.seed < 2**63:
        parser.error('--seed must fit into 64 bits')
    return options


def request_for(options: argparse.Namespace) -> PlanPath.Request:
    """Return the request that the options make."""
    start, goal = ((*pose, 0.0)[:3] for pose in (options.start, options.goal))
    return PlanPath.Request(
        planner=options.planner, start=pose_stamped(start, options.frame), goal=pose_stamped(goal, options.frame),
        deadline=duration_message(options.deadline), seed=options.seed, tolerance=options.tolerance)


def table(response: PlanPath.Response, poses: NDArray[np.float64]) -> str:
    """Return the answer as lines of a name and a value."""
    length = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).sum()
    rows = {'cost': f'{response.cost:.3f} m', 'length': f'{length:.3f} m', 'poses': len(poses),
            'planning time': f'{seconds(response.planning_time) * 1e3:.2f} ms',
            **{entry.key: entry.value for entry in response.statistics}}
    return '\n'.join(f'{name:<20}{value}' for name, value in rows.items())


def draw(grid: OccupancyGrid, poses: NDArray[np.float64], title: str, path: str) -> None:
    """Draw the path on the map into a file.

    Parameters
    ----------
    grid : OccupancyGrid
    poses : (N, 3) ndarray [m, m, rad]
    title : str
    path : str
        The extension says which kind of file.

    Raises
    ------
    OSError, ValueError
        If the file cannot be written, or no such kind is known.
    """
    from mobile_planning.drawing import maps

    corners = grid.grid_to_world([(0, 0), (grid.width, 0), (grid.width, grid.height), (0, grid.height)])
    figure, axes = maps.new_figure(*np.ptp(corners, axis=0), title)
    maps.draw_map(axes, grid.data, grid.resolution, grid.origin)
    maps.draw_path(axes, poses[:, :2], label='path')
    maps.draw_pose(axes, poses[0], maps.START_MARKER, label='start')
    maps.draw_pose(axes, poses[-1], maps.GOAL_MARKER, label='goal')
    maps.draw_legend(axes)
    maps.save(figure, path)


def main(args: Sequence[str], stop: StopSignals) -> int:
    """Ask, print and draw; return 0 with a path, else 1 with one sentence on stderr.

    Parameters
    ----------
    args : sequence of str
        The command line with the executable's name.
    stop : StopSignals
    """
    options = parse(without_ros(args))
    client = node = None
    try:
        start_ros(args)
        node = Node(f'plan_path_{os.getpid()}', enable_rosout=False, start_parameter_services=False)
        require_reach()
        client = Client(node, stop)
        request = request_for(options)
        with ProgressBar(request, options.progress or sys.stderr.isatty()) as bar:
            response = client.ask(options.node, request, options.timeout, bar.show)
        if response.error_code:
            raise PlanningError(f'error {response.error_code}: {response.error_msg}')
        poses = path_poses(response.path)
        print(table(response, poses))
        if options.plot:
            grid = client.map(options.map, options.timeout)
            draw(grid, poses, f'{options.planner or "default planner"}: {response.cost:.2f} m', options.plot)
            print(f'{"plot":<20}{options.plot}')
        return 0
    except (PlanningError, OSError, ValueError) as error:
        print(f'plan_path: {error}', file=sys.stderr)
        return 1
    finally:
        if client is not None:
            client.close()
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
