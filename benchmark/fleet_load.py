"""What a robot costs over ROS 2 in real time: processor, memory, messages, and whether it plans in time.

    . launch/environment.sh; python -m benchmark.fleet_load [--single 4 8 16] [--grouped 16 32 64] [--processes 4]
                                                            [--seconds 20]

Robots drive from goal to goal on the depot's map, each as a process of its own (``single``), or all of them in a few
(``grouped``). Processor time is of one core, of the robots' processes alone; beside it that of everything else, the
``world_sim``, the map server and the listener of this script. ``late`` sections were planned and came after their first
knot; in ``missed`` cycles the one before was still being planned.
"""
from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, process_time

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from mobile_planning_msgs.msg import Contracts, JointPlan, Mission, RobotMsg
from rclpy.node import Node

from benchmark.fleet_processes import GATHERING, ROOT, Fleet
from mobile_planning.nodes import qos
from mobile_planning.nodes.executor import make_executor

#: What is measured begins so long [s] after the start of the mission.
_SETTLING = 5.0
#: Between two turns of the executor that looks on [s].
_REST = 0.05
_FACTS = 'sections late', 'cycles missed', 'longest step [ms]'
_CYCLE = 0.25


@dataclass(frozen=True)
class Load:
    """What one fleet has used and done within ``seconds``."""

    robots: int
    processes: int
    seconds: float
    cpu: float
    others_cpu: float
    rss: float
    pss: float
    late: int
    missed: int
    longest: float
    messages: float
    kilobytes: float
    gathered: float

    def row(self) -> str:
        """Return it as a line of the table."""
        share = 100.0 / self.seconds
        return (f'{self.robots:>6}{self.processes:>6}{share * self.cpu / self.robots:>12.1f}{share * self.cpu:>8.0f}'
                f'{share * self.others_cpu:>8.0f}{self.rss / self.processes:>10.0f}{self.pss / self.robots:>10.1f}'
                f'{self.pss:>9.0f}{int(self.robots * self.seconds / _CYCLE):>9}{self.late:>6}{self.missed:>8}'
                f'{self.longest:>9.0f}{self.messages:>7.0f}{self.kilobytes:>7.0f}{self.gathered:>8.1f}')


HEADING = ('robots  proc  cpu/robot %  cpu %  others %  RSS/proc  PSS/robot  PSS MB   cycles  late  missed  step ms  '
           'msg/s   kB/s start s')


class Listener(Node):
    """Counts what is said, and keeps what the robots say of themselves."""

    def __init__(self, robots: int):
        super().__init__('load_listener', enable_rosout=False)
        self.count, self.bytes, self.facts, self.has_started = 0, 0, {}, False
        self.longest: Counter[str] = Counter()
        for kind, topic in ((RobotMsg, '/robot_msgs'), (Contracts, '/contracts'), (JointPlan, '/joint_plans')):
            self.create_subscription(kind, topic, self._on_message, qos.robot_messages(4 * robots), raw=True)
        self.create_subscription(DiagnosticArray, '/diagnostics', self._on_diagnostics, qos.live(4 * robots))
        self.create_subscription(Mission, '/mission', self._on_mission, qos.MISSION)

    def total(self, fact: str) -> int:
        """Return the sum of one number of all robots."""
        return sum(int(facts[fact]) for facts in self.facts.values())

    def _on_message(self, content):
        self.count, self.bytes = self.count + 1, self.bytes + len(content)

    def _on_diagnostics(self, message):
        for status in message.status:
            facts = {each.key: each.value for each in status.values}
            if _FACTS[0] in facts:
                self.facts[status.name] = facts
                self.longest[status.name] = max(self.longest[status.name], float(facts[_FACTS[2]]))

    def _on_mission(self, message):
        self.has_started = self.has_started or message.state == Mission.STARTED


def measure(robots: int, groups: list[list[int]], seconds: float, folder: Path) -> Load:
    """Return what a fleet costs in ``seconds`` of its mission.

    Raises
    ------
    RuntimeError
        The mission does not start, or a process ends.
    """
    scene = {'name': 'load', 'map': str(ROOT / 'config' / 'maps' / 'depot.yaml'), 'scenario': 'depot',
             'robots': robots, 'seed': 3, 'endless': seconds + 60.0, 'timeout': seconds + 120.0}
    rclpy.init()
    listener, executor = Listener(robots), make_executor(_REST)
    executor.add_node(listener)

    def spin(until, is_over=lambda: False):
        while monotonic() < until and not is_over():
            executor.spin_once(timeout_sec=0.1)

    try:
        with Fleet(scene, groups, folder) as fleet:
            began = monotonic()
            spin(began + GATHERING, lambda: listener.has_started or fleet.ended)
            gathered = monotonic() - began
            if not listener.has_started or fleet.ended:
                raise RuntimeError(f'{robots} robots did not start within {gathered:.0f} s, ended: {fleet.ended}; '
                                   f'see {folder}')
            spin(monotonic() + _SETTLING)
            listener.longest.clear()
            own, before, then = process_time(), fleet.costs(), monotonic()
            said = np.array([listener.count, listener.bytes, listener.total(_FACTS[0]), listener.total(_FACTS[1])])
            spin(then + seconds)
            after, passed = fleet.costs(), monotonic() - then
            own = process_time() - own
            said = np.array([listener.count, listener.bytes, listener.total(_FACTS[0]),
                             listener.total(_FACTS[1])]) - said
            if fleet.ended or len(listener.facts) != robots:
                raise RuntimeError(f'ended: {fleet.ended}, {len(listener.facts)} of {robots} robots were diagnosed')
    finally:
        executor.shutdown()
        listener.destroy_node()
        rclpy.try_shutdown()
    cpu = {name: after[name].cpu - before[name].cpu for name in after}
    of_robots = [name for name in after if name.startswith('robot')]
    return Load(robots, len(groups), passed, sum(cpu[name] for name in of_robots),
                own + sum(cpu[name] for name in cpu if name not in of_robots),
                sum(after[name].rss for name in of_robots), sum(after[name].pss for name in of_robots), int(said[2]),
                int(said[3]), max(listener.longest.values(), default=np.nan), said[0] / passed,
                said[1] / passed / 1000, gathered)


def main() -> int:
    """Measure each fleet, and print a line of the table for it."""
    parser = argparse.ArgumentParser(description='What robots cost over ROS 2 in real time.')
    parser.add_argument('--single', type=int, nargs='*', default=[4, 8, 16], help='robots, a process each')
    parser.add_argument('--grouped', type=int, nargs='*', default=[16, 32, 64], help='robots, in few processes')
    parser.add_argument('--processes', type=int, default=4, help='that the latter share')
    parser.add_argument('--seconds', type=float, default=20.0, help='of each measurement')
    parser.add_argument('--out', type=Path, help='folder for logs; a temporary one by default')
    options = parser.parse_args()
    print(HEADING, flush=True)
    with tempfile.TemporaryDirectory(prefix='fleet_load_') as temporary:
        folder, failed = options.out or Path(temporary), 0
        for kind, robots in (*(('single', each) for each in options.single),
                             *(('grouped', each) for each in options.grouped)):
            processes = robots if kind == 'single' else options.processes
            groups = [group.tolist() for group in np.array_split(np.arange(1, robots + 1), processes)]
            try:
                print(measure(robots, groups, options.seconds, folder / f'{kind}_{robots}').row(), flush=True)
            except RuntimeError as error:
                failed += 1
                print(f'{robots:>6}{processes:>6}  {error}', flush=True)
    return int(failed > 0)


if __name__ == '__main__':
    sys.exit(main())
