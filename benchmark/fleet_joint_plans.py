"""How long a fleet's joint plans take: ``python -m benchmark.fleet_joint_plans [CASE ...] --seeds 0 6``.

Every joint plan that the robots ask for in a mission is made again, alone, three times over: the least thread time
counts, beside it the parts of it. A roadmap is made once for a map and the radii that are about, with what is in whose
way there, and is not part of a plan's time. ``--all`` drives nothing, and plans once for all robots together from their
starts.
"""
import argparse
import sys
from collections import defaultdict
from contextlib import contextmanager
from time import thread_time

import numpy as np

from benchmark.cases import scene_of
from mobile_planning.fleet import joint_plan, joint_request, pebble_refinement
from mobile_planning.fleet.joint_message import MAX_MOVES
from mobile_planning.fleet.joint_plan import Member
from mobile_planning.fleet.makespan import lower_bound
from mobile_planning.fleet.mouths import finer_at_mouths
from mobile_planning.fleet.roadmap import Roadmap

CASES = ('maze:robots=8', 'depot:robots=24')
REPEATS = 3
#: Where each part of a plan is made: module, and the name that it is called by.
PARTS = {'beside': (joint_plan.Roadmap, 'beside'), 'instance': (joint_plan, 'make_instance'),
         'conflicts': (joint_plan, 'with_gap'), 'solve': (pebble_refinement, 'solve'),
         'searches': (pebble_refinement, 'search'), 'replan': (pebble_refinement, 'refined'),
         'clearing': (joint_plan, 'by_open_ground'), 'order': (joint_plan, 'order_moves')}


def requests_of(case, seed):
    """Return the requests for joint plans of one mission, and its time over the lower bound."""
    scene, found, plan = scene_of(case, seed), [], joint_request.JointRequest.plan

    def recorded(request):
        found.append(request)
        return plan(request)

    joint_request.JointRequest.plan = recorded
    try:
        report = scene.world_sim().run(seed, timeout=scene.timeout, check=False)
    finally:
        joint_request.JointRequest.plan = plan
    home = report.arrived == len(scene.robots)
    return found, report.mission_time / lower_bound(scene.bodies(), scene.environment()) if home else np.nan


def request_for_all(case, seed):
    """Return a request for all robots of a mission, where they start, and no ratio."""
    scene = scene_of(case, seed)
    robots = scene.world_sim().robots.values()
    radii = [robot.limits.radius for robot in robots]
    roadmap = Roadmap(scene.environment(), min(radii), max(radii))
    members = [Member(robot.plan.end, robot.goal[:2], robot.limits.radius) for robot in robots]
    return [joint_request.JointRequest(finer_at_mouths(roadmap, 2 * roadmap.widest + joint_plan.WIDE), 1, 1, 1,
                                       tuple(range(1, len(members) + 1)), tuple(members), (), MAX_MOVES)], np.nan


@contextmanager
def parted(spent):
    """Add to ``spent`` the thread time of each part, what it calls not counted twice."""
    kept, inner = {name: getattr(*place) for name, place in PARTS.items()}, []

    def timed(name, call):
        def part(*args, **kwargs):
            inner.append(0.0)
            began = thread_time()
            try:
                return call(*args, **kwargs)
            finally:
                passed = thread_time() - began
                spent[name] += passed - inner.pop()
                if inner:
                    inner[-1] += passed
        return part

    try:
        for name, place in PARTS.items():
            setattr(*place, timed(name, kept[name]))
        yield
    finally:
        for name, place in PARTS.items():
            setattr(*place, kept[name])


def time_of(request):
    """Return the least thread time [ms] of a plan, and that of its parts by name."""
    best, parts = np.inf, {}
    for _ in range(REPEATS):
        spent = defaultdict(float)
        with parted(spent):
            began = thread_time()
            request.plan()
            passed = thread_time() - began
        if passed < best:
            best, parts = passed, spent
    return 1e3 * best, {name: 1e3 * seconds for name, seconds in parts.items()}


def main():
    """Print a line for each joint plan, and one for each case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('cases', nargs='*', default=CASES)
    parser.add_argument('--seeds', type=int, nargs=2, default=(0, 6), metavar=('FIRST', 'END'))
    parser.add_argument('--all', action='store_true', help='plan for all robots from their starts')
    options = parser.parse_args()
    ask = request_for_all if options.all else requests_of
    print(f'{"case":<28} {"seed":>4} {"ratio":>6} {"robots":>6} {"places":>6} {"ms":>6}',
          *(f'{name:>9}' for name in PARTS))
    for case in options.cases:
        times = []
        for seed in range(*options.seeds):
            requests, ratio = ask(case, seed)
            for request in requests:
                spent, parts = time_of(request)
                times.append((spent, len(request.ids)))
                print(f'{case:<28} {seed:>4} {ratio:>6.3f} {len(request.ids):>6} {len(request.roadmap.places):>6} '
                      f'{spent:>6.1f}', *(f'{parts.get(name, 0.0):>9.1f}' for name in PARTS), flush=True)
            if not requests:
                print(f'{case:<28} {seed:>4} {ratio:>6.3f} no joint plan', flush=True)
        if times:
            print(f'{case}: {len(times)} joint plans, median {np.median([spent for spent, _ in times]):.1f} ms, '
                  f'greatest {max(times)[0]:.1f} ms for {max(times)[1]} robots')


if __name__ == '__main__':
    sys.exit(main())
