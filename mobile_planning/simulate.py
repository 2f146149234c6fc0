"""Run a scene in process, in logical time, without ROS.

``simulate config/fleets/crossing.yaml --out out/crossing --film out/crossing.gif``
"""
from __future__ import annotations

import argparse
import sys

from mobile_planning.errors import PlanningError
from mobile_planning.fleet.faults import FaultKind, Faults, draw_faults
from mobile_planning.fleet.scene import METHODS
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.outcome import check_film, film_mission, write_outcome


def main(args: list[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 valid, 1 not valid, 2 for bad input."""
    parser = argparse.ArgumentParser(prog='simulate', description=__doc__.splitlines()[0])
    parser.add_argument('scene', help='YAML file of the scene')
    parser.add_argument('--robots', type=int, help='drive with so many robots')
    parser.add_argument('--method', choices=METHODS, help='by which the robots plan, instead of the scene\'s')
    parser.add_argument('--seed', type=int, default=0, help='of all that is random')
    parser.add_argument('--loss', type=float, default=0.0, help='share of messages lost, 0 to 1')
    parser.add_argument('--delay', type=float, default=0.0, help='greatest extra delay of a message [s]')
    parser.add_argument('--skew', type=float, default=0.0, help='greatest error of a clock [s]')
    parser.add_argument('--faults', default='none', choices=[kind.value for kind in FaultKind],
                        help='what else goes wrong, drawn from the seed')
    parser.add_argument('--any-phase', action='store_true', help='cycles start at any time, not when it suits a robot')
    parser.add_argument('--no-check', action='store_true', help='do not check the invariant after every event')
    parser.add_argument('--out', help='folder for report.json and mission.png')
    parser.add_argument('--film', help='file for a film of the mission, .gif or .mp4')
    parser.add_argument('--list', action='store_true', help='print the map and the robot ids of the scene, and end')
    options = parser.parse_args(args)
    try:
        scene = load_scene(options.scene, options.robots)
        if options.list:
            print(f'map {scene.map_path.resolve() if scene.map_path else ""}')
            print('robots', *(spec.id for spec in scene.robots))
            return 0
        if options.film:
            check_film(options.film)
        faults = Faults(options.skew, any_phase=options.any_phase)
        if options.faults != 'none':
            faults = draw_faults(options.faults, [spec.id for spec in scene.robots], options.seed, options.skew)
        simulation = scene.world_sim(margin=_margin(scene, options.skew), method=options.method or scene.method)
        report = simulation.run(options.seed, options.loss, options.delay, scene.timeout, faults=faults,
                                errands=scene.errands(options.seed), check=not options.no_check)
        print(report.table())
        if options.out:
            for path in write_outcome(options.out, report, simulation.solutions, simulation.bodies,
                                      simulation.environment):
                print(f'{"written":<24}{path}')
        if options.film:
            film_mission(report, simulation.solutions, simulation.bodies, simulation.environment, options.film)
            print(f'{"written":<24}{options.film}')
    except (PlanningError, OSError) as error:
        print(f'simulate: {error}', file=sys.stderr)
        return 2
    return 0 if report.valid else 1


def _margin(scene, skew):
    """Return what to add to the radii [m] so that they allow for clocks that are off by ``skew`` [s]."""
    return 0.005 + skew * max(spec.u_max[0] for spec in scene.robots)


if __name__ == '__main__':
    sys.exit(main())
