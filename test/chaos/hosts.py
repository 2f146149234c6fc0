"""Hosts: several machines on this one, as network namespaces without a name.

A host lives as long as somebody holds its file descriptor or runs in it, its network card as long as the switch that
opened it. So nothing is left behind, however a run ends.
"""
from __future__ import annotations

import ctypes
import fcntl
import os
import shutil
import struct
import subprocess
import threading
from collections.abc import Mapping, Sequence

_CLONE_NEWNET = 0x40000000
_TUNSETIFF, _IFF_TAP, _IFF_NO_PI = 0x400454ca, 0x0002, 0x1000
_TUN = '/dev/net/tun'
_TOOLS = 'ip', 'nsenter', 'setpriv'


class NoHosts(Exception):
    """This machine cannot play several."""


class Host:
    """One machine with the address 10.77.0.``number`` on its only network card, ``eth0``.

    Attributes
    ----------
    card : int
        File descriptor of the card: what the host sends is read from it, what is written to it the host receives,
        one Ethernet frame at a time; it does not block.

    Raises
    ------
    NoHosts
        Not root, or no /dev/net/tun, or a tool is missing.
    """

    def __init__(self, number: int):
        require_hosts()
        self.number, self.address = number, f'10.77.0.{number}'
        self._namespace = self.card = -1
        # The namespace of a thread is its own: this one moves out, makes the card, and ends.
        failures: list[BaseException] = []
        maker = threading.Thread(target=self._make, args=(failures,))
        maker.start()
        maker.join()
        if failures:
            self.close()
            raise NoHosts(f'no network namespace with a card could be made: {failures[0]}') from failures[0]

    def _make(self, failures):
        try:
            libc = ctypes.CDLL(None, use_errno=True)
            if libc.unshare(_CLONE_NEWNET):
                raise OSError(ctypes.get_errno(), 'unshare')
            self._namespace = os.open('/proc/thread-self/ns/net', os.O_RDONLY | os.O_CLOEXEC)
            self.card = os.open(_TUN, os.O_RDWR | os.O_NONBLOCK | os.O_CLOEXEC)
            fcntl.ioctl(self.card, _TUNSETIFF, struct.pack('16sH22x', b'eth0', _IFF_TAP | _IFF_NO_PI))
            for command in ('link set lo up', f'addr add {self.address}/24 dev eth0', 'link set eth0 up',
                            'route add 224.0.0.0/4 dev eth0'):
                subprocess.run(['ip', *command.split()], check=True, capture_output=True, text=True)
        except (OSError, subprocess.CalledProcessError) as error:
            failures.append(error)

    def start(self, command: Sequence[str], env: Mapping[str, str], log: str) -> subprocess.Popen:
        """Start ``command`` on this host, its output in the file ``log``; it is killed when this process ends.

        To be called in the main thread: a process is killed with the thread that has started it.
        """
        inside = ['nsenter', f'--net=/proc/{os.getpid()}/fd/{self._namespace}',
                  'setpriv', '--pdeathsig', 'KILL', *command]
        with open(log, 'ab') as out:
            return subprocess.Popen(inside, stdout=out, stderr=out, stdin=subprocess.DEVNULL, env=dict(env))

    def close(self) -> None:
        """Give up the card and the namespace."""
        for descriptor in (self.card, self._namespace):
            if descriptor >= 0:
                os.close(descriptor)
        self.card = self._namespace = -1


def require_hosts() -> None:
    """Raise NoHosts with the reason where this machine cannot play several."""
    missing = [tool for tool in _TOOLS if shutil.which(tool) is None]
    if os.geteuid() != 0:
        raise NoHosts('it needs root')
    if not os.access(_TUN, os.R_OK | os.W_OK):
        raise NoHosts(f'it needs {_TUN}')
    if missing:
        raise NoHosts(f'it needs the commands {" ".join(missing)}')
