"""A fleet as processes over ROS 2 on this host, and what each of them costs; for `fleet_load` and `fleet_soak`."""
from __future__ import annotations

import ctypes
import os
import signal
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import monotonic, sleep

import yaml

ROOT = Path(__file__).resolve().parent.parent
_TICK = os.sysconf('SC_CLK_TCK')
_PR_SET_PDEATHSIG = 1
#: Robots that do not start within so long [s] do not start at all.
GATHERING = 120.0
#: Processes that were asked to end are waited for so long [s].
_FAREWELL = 15.0


@dataclass(frozen=True)
class Cost:
    """What a process has used until now.

    Attributes
    ----------
    cpu : float [s]
        By all its threads.
    rss, pss : float [MB]
        Memory; in the second what it shares with others counts by its share.
    """

    cpu: float
    rss: float
    pss: float


class Fleet:
    """The processes of a mission, from entry to exit of a ``with``.

    Parameters
    ----------
    scene : mapping
        Content of a scene file.
    groups : sequence of sequence of int
        The robots of each process; a group of one is a process of its own.
    out : Path
        Folder for the scene and the logs.
    **parameters
        Of the robots.
    """

    def __init__(self, scene: Mapping, groups: Sequence[Sequence[int]], out: Path, **parameters: object):
        self._groups, self._out = [list(group) for group in groups], out.resolve()
        self._processes: dict[str, subprocess.Popen] = {}
        self._out.mkdir(parents=True, exist_ok=True)
        self._scene = self._out / 'scene.yaml'
        self._scene.write_text(yaml.safe_dump(dict(scene)))
        self._map = scene.get('map')
        self._parameters = [word for name, value in parameters.items() for word in ('-p', f'{name}:={value}')]

    def __enter__(self) -> Fleet:
        chosen = ['-p', f"scene:='{self._scene}'"]
        try:
            if self._map:
                self._start('map_server', 'map_server', '--ros-args', '-p', f"yaml_filename:='{self._map}'")
            for group in self._groups:
                name = f'robot_{group[0]}' if len(group) == 1 else f'robots_{group[0]}_{group[-1]}'
                which = (['-r', f'__node:={name}', '-p', f'robot_id:={group[0]}'] if len(group) == 1
                         else ['-p', f'robots:={group}'])
                self._start(name, 'robot', '--ros-args', *which, *chosen, *self._parameters)
            self._start('world_sim', 'world_sim', '--ros-args', '-p', f'discovery_timeout:={GATHERING}', *chosen)
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(self, *exception) -> None:
        self._end()

    @property
    def ended(self) -> list[str]:
        """Names of the processes that have ended by themselves."""
        return [name for name, process in self._processes.items() if process.poll() is not None]

    def costs(self) -> dict[str, Cost]:
        """Return what each process that lives has cost."""
        return {name: cost_of(process.pid) for name, process in self._processes.items() if process.poll() is None}

    def _start(self, name, *command):
        with open(self._out / f'{name}.log', 'wb') as log:
            self._processes[name] = subprocess.Popen(command, stdout=log, stderr=log, stdin=subprocess.DEVNULL,
                                                     preexec_fn=_die_with_parent)

    def _end(self):
        """Ask once, wait, then insist."""
        alive = [process for process in self._processes.values() if process.poll() is None]
        for process in alive:
            process.terminate()
        deadline = monotonic() + _FAREWELL
        while any(process.poll() is None for process in alive) and monotonic() < deadline:
            sleep(0.05)
        for process in alive:
            process.kill()
            process.wait()


def cost_of(pid: int) -> Cost:
    """Return what the process ``pid`` has cost."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    memory = dict(line.split(':') for line in Path(f'/proc/{pid}/smaps_rollup').read_text().splitlines()[1:])
    rss, pss = (float(memory[key].split()[0]) / 1024 for key in ('Rss', 'Pss'))
    return Cost((int(fields[11]) + int(fields[12])) / _TICK, rss, pss)


def _die_with_parent():
    """Whatever ends this script ends its processes."""
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
