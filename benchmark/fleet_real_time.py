"""Whether two cores plan faster than a fleet drives: ``python -m benchmark.fleet_real_time [CASE ...] [--seed 0]``.

One mission on the simulator, unjudged, and the processor time that its robots take in it, all on one core: "sections"
to plan and to put in force, "talk" to hear all messages and to say the own ones, "joint plans" to make them.
"simulator" is everything else, the channel above all, which no robot would have to pay for. "real time" is the time of
the mission over what two cores need for the robots' work, evenly shared: above 1 they plan faster than they drive. Over
ROS there are, besides, the transport and the conversion of messages, which ``fleet_load`` measures.
"""
import argparse
from collections import Counter
from multiprocessing import Pool
from time import process_time

from benchmark.cases import scene_of
from mobile_planning.fleet.contract_robot import ContractRobot
from mobile_planning.fleet.joint_request import GroundRequest, JointRequest

CASES = 'swap:robots=16', 'swap:robots=32', 'swap:robots=64'
CORES = 2
#: What is measured, by what it is for. None of these calls another one but for the answers in a commit.
_WORK = {'sections': ((ContractRobot, 'plan_section'), (ContractRobot, 'commit')),
         'talk': ((ContractRobot, 'receive'), (ContractRobot, 'answers'), (ContractRobot, 'propose')),
         'joint plans': ((JointRequest, 'plan'), (GroundRequest, 'plan'))}


class Clock:
    """Counts processor time [s] by purpose; what is measured within something else counts for the inner one alone."""

    def __init__(self):
        self.seconds: Counter[str] = Counter()
        self._inner = 0.0

    def measuring(self, purpose, function):
        """Return ``function``, whose time counts for ``purpose``."""
        def measured(*args, **kwargs):
            outer, self._inner, began = self._inner, 0.0, process_time()
            try:
                return function(*args, **kwargs)
            finally:
                spent = process_time() - began
                self.seconds[purpose] += spent - self._inner
                self._inner = outer + spent
        return measured


def measure(case, seed):
    """Return the line of one mission. The classes of this process are altered for it."""
    scene, clock = scene_of(case, seed), Clock()
    simulation = scene.world_sim()
    for purpose, methods in _WORK.items():
        for owner, name in methods:
            setattr(owner, name, clock.measuring(purpose, getattr(owner, name)))
    ContractRobot.has_answers = property(clock.measuring('talk', ContractRobot.has_answers.fget))
    began = process_time()
    report = simulation.run(seed, timeout=max(60.0, scene.timeout), check=False)
    total, seconds, spent = process_time() - began, clock.seconds, sum(clock.seconds.values())
    return (f'{case:<20}{report.arrived:>8}{report.mission_time:>11.1f}{seconds["sections"]:>12.1f}'
            f'{seconds["talk"]:>8.1f}{seconds["joint plans"]:>15.1f}{total - spent:>13.1f}'
            f'{CORES * report.mission_time / spent:>11.2f}')


def main():
    """Print a line for each case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('cases', nargs='*', default=CASES)
    parser.add_argument('--seed', type=int, default=0)
    options = parser.parse_args()
    print(f'{"case":<20}{"arrived":>8}{"mission s":>11}{"sections s":>12}{"talk s":>8}{"joint plans s":>15}'
          f'{"simulator s":>13}{"real time":>11}', flush=True)
    with Pool(1, maxtasksperchild=1) as pool:
        for case in options.cases:
            print(pool.apply(measure, (case, options.seed)), flush=True)


if __name__ == '__main__':
    main()
