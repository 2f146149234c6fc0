"""The executables: each a door that catches signals first and imports its node, with all of ROS, behind it."""
from __future__ import annotations

import sys
from importlib import import_module

from mobile_planning.nodes.spin import run
from mobile_planning.nodes.stop_signals import StopSignals


#: Between two turns of the executor of who hears robots [s]: each says some ten things a second.
_REST = 0.05


def _door(module: str, name: str, rest: float = 0.0):
    """Return the main function of the node that ``name`` makes in ``mobile_planning.nodes.<module>``."""
    def main(args: list[str] | None = None) -> int:
        """Run the node until a signal and return the exit code."""
        return run(lambda: getattr(import_module(f'mobile_planning.nodes.{module}'), name)(), args, rest)
    return main


map_server = _door('map_server', 'MapServer')
grid_planner = _door('grid_planner', 'GridPlanner')
sampling_planner = _door('sampling_planner', 'SamplingPlanner')
robot = _door('robots', 'make_robots', _REST)
world_sim = _door('world_sim', 'WorldSimNode', _REST)


def plan_path(args: list[str] | None = None) -> int:
    """Ask a planner node for a path, print it, and return the exit code."""
    with StopSignals() as stop:
        from mobile_planning.nodes.plan_path import main

        return main(sys.argv if args is None else args, stop)
