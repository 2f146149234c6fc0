"""Chaos: one mission over ROS 2 on three hosts of this machine, once for each storm, and a judge of what came of it.

    launch/chaos.sh [--scene FILE] [--seed N] [--only WORDS] [--out DIR]

Every run is recorded on each host; afterwards the independent judge reads the plans that were published and proves
them apart, whatever the processes say of themselves. Each row that has ended adds a line to ``rows.jsonl`` in DIR and
is not run again; without that file the matrix begins anew. Ends with 0 if nothing was violated and everybody arrived.
"""
from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep, time

import numpy as np

from history import History
from hosts import Host, NoHosts, require_hosts
from mobile_planning.fleet.scene import Scene
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.fleet.verification import verify
from outcomes import Outcome, Rows, table
from storms import Begin, Storm, matrix
from switch import Switch

_ROOT = Path(__file__).resolve().parents[2]
_HOSTS = 3
#: A mission that has not begun after so long [s] is given up; so are processes that do not stop.
_GATHERING, _FAREWELL = 120.0, 10.0
_LOOK = 0.05


class Run:
    """The processes of one mission on their hosts, under one storm."""

    def __init__(self, scene_path: Path, scene: Scene, storm: Storm, seed: int, out: Path):
        self._path, self._scene, self._storm, self._seed, self._out = scene_path, scene, storm, seed, out
        self._robots = [spec.id for spec in scene.robots]
        self._homes = {robot: index % _HOSTS + 1 for index, robot in enumerate(self._robots)}
        self._processes: dict[str, subprocess.Popen] = {}
        self._gone: dict[str, float] = {}
        self._born = self._healed = np.nan

    def outcome(self) -> Outcome:
        """Run the mission to its end and return what came of it."""
        self._out.mkdir(parents=True, exist_ok=True)
        for left in self._out.glob('*'):
            left.unlink()
        hosts = {number: Host(number) for number in range(1, _HOSTS + 1)}
        try:
            with Switch(list(hosts.values()), self._seed) as switch:
                self._hosts, self._switch = hosts, switch
                try:
                    self._drive()
                    self._stop_all()
                finally:
                    self._kill_all()
                counters = switch.counters
        finally:
            for host in hosts.values():
                host.close()
        return self._judged(f'{counters.sent}, {counters.lost} lost, {counters.cut} cut')

    # The processes

    def _commands(self):
        """Yield name, host and command of every process."""
        chosen = ['-p', f"scene:='{self._path}'", '-p', f'scene_robots:={len(self._robots)}']
        for host in range(1, _HOSTS + 1):
            homed = [str(robot) for robot, home in self._homes.items() if home == host]
            yield f'recorder_{host}', host, [sys.executable, str(Path(__file__).with_name('recorder.py')),
                                             str(self._out / f'host_{host}.jsonl'), *homed]
        if self._scene.map_path is not None:
            yield 'map_server', 1, ['map_server', '--ros-args', '-p', f"yaml_filename:='{self._scene.map_path}'"]
        for robot, home in self._homes.items():
            yield f'robot_{robot}', home, ['robot', '--ros-args', '-r', f'__node:=robot_{robot}', '-p',
                                           f'robot_id:={robot}', '-p', f"logbook:='{self._out}/robot_{{id}}.json'",
                                           *chosen]
        yield 'world_sim', 1, ['world_sim', '--ros-args', '-p', f'discovery_timeout:={_GATHERING}', *chosen]

    def _start(self, name):
        _, host, command = next(each for each in self._commands() if each[0] == name)
        self._processes[name] = self._hosts[host].start(command, self._environment(), str(self._out / f'{name}.log'))

    def _environment(self):
        profile = str(_ROOT / 'launch' / 'hosts.xml')
        return {**os.environ, 'MOBILE_PLANNING_REACH': 'subnet', 'FASTDDS_DEFAULT_PROFILES_FILE': profile,
                'ROS_AUTOMATIC_DISCOVERY_RANGE': 'SUBNET'}

    def _stop_all(self):
        """Ask everybody to end, and wait a while."""
        alive = [process for process in self._processes.values() if process.poll() is None]
        for process in alive:
            process.send_signal(signal.SIGCONT)
            process.terminate()
        deadline = monotonic() + _FAREWELL
        while any(process.poll() is None for process in alive) and monotonic() < deadline:
            sleep(_LOOK)

    def _kill_all(self):
        for process in self._processes.values():
            process.kill()
            process.wait()

    # The mission

    def _drive(self):
        """Start everybody, and let the storm blow until the mission ends."""
        self._born, begun, due = time(), np.inf, []
        if self._storm.begin is Begin.PROCESSES:
            due = self._outbreak(self._born)
        for name, _, _ in list(self._commands()):
            self._start(name)
        end = self._born + _GATHERING
        while time() < end and self._processes['world_sim'].poll() is None:
            if not np.isfinite(begun):
                begun = self._history().start
                end = max(end, self._latest(begun)) if np.isfinite(begun) else end
                if np.isfinite(begun) and self._storm.begin is Begin.MISSION:
                    due = self._outbreak(begun)
            while due and time() >= due[0][0]:
                due.pop(0)[1]()
            self._wait()

    def _outbreak(self, begun):
        """Let the storm begin at ``begun`` [s]; return what is to be done, and when [s]."""
        self._switch.weather = self._storm.weather
        return sorted(((begun + at, deed) for at, deed in self._deeds()), key=lambda due: due[0])

    def _latest(self, begun):
        """Return when a mission is given up that has begun [s]."""
        return begun + self._scene.timeout + max((cut.duration for cut in self._storm.cuts), default=0.0) + 30.0

    def _wait(self):
        """Let a moment pass; the end of the judge ends it at once."""
        try:
            self._processes['world_sim'].wait(_LOOK)
        except subprocess.TimeoutExpired:
            return

    def _deeds(self):
        """Yield when, after the storm began [s], and what is to be done."""
        for blow in self._storm.blows:
            if blow.frozen:
                yield blow.at, lambda name=blow.target: self._signal(name, signal.SIGSTOP)
                yield blow.at + blow.frozen, lambda name=blow.target: self._signal(name, signal.SIGCONT)
            else:
                yield blow.at, lambda name=blow.target: self._replace(name)
        for cut in self._storm.cuts:
            yield cut.at, lambda island=cut.island: self._cut((island,))
            yield cut.at + cut.duration, lambda: self._cut(())

    def _signal(self, name, number):
        if name in self._processes and self._processes[name].poll() is None:
            self._processes[name].send_signal(number)
            if number == signal.SIGSTOP:
                self._gone[name] = time()

    def _replace(self, name):
        if name in self._processes:
            self._gone[name] = time()
            self._processes[name].kill()
            self._processes[name].wait()
            self._start(name)

    def _cut(self, islands):
        self._switch.weather = replace(self._storm.weather, islands=islands)
        if not islands:
            self._healed = time()

    # The judgement

    def _history(self):
        files = ((host, self._out / f'host_{host}.jsonl') for host in range(1, _HOSTS + 1))
        return History.read((host, path) for host, path in files if path.exists())

    def _judged(self, frames):
        history = self._history()
        if not np.isfinite(history.start):
            return Outcome(self._storm.name, f'0/{len(self._robots)}', np.inf, *[np.nan] * 6, frames,
                           ('the mission did not start',))
        bodies = self._scene.bodies()
        report = verify(history.solutions(), bodies, self._scene.environment(), history.start, self._storm.name)
        violations, gap = list(report.violations), history.least_gap()
        need = min(a.radius + b.radius for a in bodies for b in bodies if a is not b)
        if gap < need:
            violations.append(f'two bodies came as near as {gap:.4f} m, their radii need {need:.4f} m')
        noticed, back = [], []
        witnesses = [robot for robot in self._robots if f'robot_{robot}' not in self._gone]
        for name, gone in self._gone.items():
            # Nobody misses a robot before the mission: those are the ones that it waits for.
            if name.startswith('robot_') and gone >= history.start:
                robot = int(name.removeprefix('robot_'))
                noticed += [history.noticed(robot, gone, witnesses)] if witnesses else []
                if not any(blow.frozen for blow in self._storm.blows if blow.target == name):
                    back.append(history.back(robot, gone))
        healed = history.heard_again(self._healed, self._homes) if np.isfinite(self._healed) else np.nan
        return Outcome(self._storm.name, f'{report.arrived}/{report.robots}', history.start - self._born,
                       report.mission_time, report.min_separation, gap, max(noticed, default=np.nan),
                       max(back, default=np.nan), healed, frames, tuple(violations))


def main():
    """Run the matrix."""
    parser = argparse.ArgumentParser(description='A fleet over ROS 2 on three hosts, and what networks and processes '
                                                 'do to it.')
    parser.add_argument('--scene', type=Path, default=_ROOT / 'config' / 'fleets' / 'depot.yaml')
    parser.add_argument('--seed', type=int, default=0)
    parser.add_argument('--only', default='', help='rows whose name has these words')
    parser.add_argument('--out', type=Path, default=_ROOT / 'out' / 'chaos')
    options = parser.parse_args()
    try:
        require_hosts()
    except NoHosts as reason:
        print(f'chaos: this machine cannot play several hosts, {reason}; '
              'the faults of the in-process channel are run by: python -m benchmark.fleet_campaign', file=sys.stderr)
        return 2
    # Whatever ends this script, the processes end with it.
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    scene = load_scene(str(options.scene))
    storms = [storm for storm in matrix([spec.id for spec in scene.robots], options.seed) if options.only in storm.name]
    options.out.mkdir(parents=True, exist_ok=True)
    rows = Rows(options.out.resolve() / 'rows.jsonl', f'{scene.name}, seed {options.seed}')
    for storm in storms:
        if storm in rows:
            continue
        folder = options.out.resolve() / re.sub(r'\W+', '_', storm.name).strip('_')
        outcome = Run(options.scene.resolve(), scene, storm, options.seed, folder).outcome()
        rows.add(storm, outcome)
        print(table([outcome]), flush=True)
    outcomes = [rows[storm] for storm in storms]
    print('\n' + table(outcomes))
    return 0 if all(outcome.is_good for outcome in outcomes) else 1


if __name__ == '__main__':
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
