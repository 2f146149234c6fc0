"""Run a scene in process, in logical time, without ROS.

``simulate config/fleets/crossing.yaml --out out/crossing``
"""
from __future__ import annotations

import argparse
import sys

from mobile_planning.errors import PlanningError
from mobile_planning.fleet.scenarios import load_scene
from mobile_planning.outcome import write_outcome


def main(args: list[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 valid, 1 not valid, 2 for bad input."""
    parser = argparse.ArgumentParser(prog='simulate', description=__doc__.splitlines()[0])
    parser.add_argument('scene', help='YAML file of the scene')
    parser.add_argument('--robots', type=int, help='drive with so many robots')
    parser.add_argument('--seed', type=int, default=0, help='of phases and channel')
    parser.add_argument('--loss', type=float, default=0.0, help='share of messages lost, 0 to 1')
    parser.add_argument('--delay', type=float, default=0.0, help='greatest extra delay of a message [s]')
    parser.add_argument('--out', help='folder for report.json and mission.png')
    parser.add_argument('--list', action='store_true', help='print the map and the robot ids of the scene, and end')
    options = parser.parse_args(args)
    try:
        scene = load_scene(options.scene, options.robots)
        if options.list:
            print(f'map {scene.map_path.resolve() if scene.map_path else ""}')
            print('robots', *(spec.id for spec in scene.robots))
            return 0
        simulation = scene.world_sim()
        report = simulation.run(options.seed, options.loss, options.delay, scene.timeout)
        print(report.table())
        if options.out:
            for path in write_outcome(options.out, report, simulation.solutions, scene.bodies(), scene.environment()):
                print(f'{"written":<24}{path}')
    except (PlanningError, OSError) as error:
        print(f'simulate: {error}', file=sys.stderr)
        return 2
    return 0 if report.valid else 1


if __name__ == '__main__':
    sys.exit(main())
