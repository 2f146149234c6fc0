"""Who can talk to the nodes of this process, and a start that refuses where that is more than was asked for.

Fast DDS that finds no profile, or one that it cannot read, prints so and goes on with sockets that every host can
reach. So what counts is not what was set, but where the process listens.
"""
from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from enum import Enum
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path

from mobile_planning.errors import PlanningError

#: The environment variable that says how far the nodes are to reach; without it nothing is checked.
VARIABLE = 'MOBILE_PLANNING_REACH'
_TABLES = 'udp', 'udp6', 'tcp', 'tcp6'
_LISTENS = '0A'         # the state of a TCP socket that takes connections


class Reach(Enum):
    """How far nodes are to reach."""

    HOST = 'host'
    SUBNET = 'subnet'


def require_reach() -> None:
    """Refuse to go on where other hosts can talk to this process, and the environment says that they are not to.

    To be called once there is a node: the middleware opens its sockets with the first one. Takes a millisecond.

    Raises
    ------
    PlanningError
        The process listens where other hosts can reach it, or the variable has no known value.
    """
    asked = os.environ.get(VARIABLE)
    if asked is None or asked == Reach.SUBNET.value:
        return
    if asked != Reach.HOST.value:
        raise PlanningError(f'{VARIABLE} is {asked!r}, not {Reach.HOST.value} or {Reach.SUBNET.value}')
    exposed = [name for address, name in listening() if not _is_of_this_host(address)]
    if exposed:
        profile = os.environ.get('FASTDDS_DEFAULT_PROFILES_FILE')
        told = f'the profile {profile} did not take effect' if profile else 'FASTDDS_DEFAULT_PROFILES_FILE is not set'
        raise PlanningError(f'other hosts could talk to this process, which listens on {", ".join(exposed)}, but '
                            f'{VARIABLE} is {asked}: {told}')


def listening() -> list[tuple[IPv4Address | IPv6Address, str]]:
    """Return where this process takes datagrams or connections: each address, and as text with table and port.

    Raises
    ------
    PlanningError
        The kernel does not tell.

    Examples
    --------
    >>> import socket
    >>> with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as open_to_all:
    ...     open_to_all.bind(('0.0.0.0', 0))
    ...     f'udp 0.0.0.0:{open_to_all.getsockname()[1]}' in [name for _, name in listening()]
    True
    """
    try:
        own = set(_own_sockets())
        rows = [(table, line.split()) for table in _TABLES for line in _lines(Path('/proc/self/net', table))]
    except OSError as error:
        raise PlanningError(f'it cannot be told where this process listens: {error}') from None
    found = []
    for table, row in rows:
        local, state, inode = row[1], row[3], row[9]
        if inode in own and (table.startswith('udp') or state == _LISTENS):
            number, port = local.split(':')
            address = _address(number)
            found.append((address, f'{table} {address}:{int(port, 16)}'))
    return found


def _lines(table: Path) -> list[str]:
    """Return the rows of a table; a kernel without IPv6 lacks two of them."""
    return table.read_text().splitlines()[1:] if table.exists() else []


def _own_sockets() -> Iterator[str]:
    """Yield the inodes of all sockets of this process."""
    for link in Path('/proc/self/fd').iterdir():
        try:
            kind, _, inode = os.readlink(link).partition(':')
        except FileNotFoundError:
            # It was closed meanwhile, as is the one that lists the others.
            continue
        if kind == 'socket':
            yield inode.strip('[]')


def _address(number: str) -> IPv4Address | IPv6Address:
    """Return an address of a table: words of 32 bits, each in this machine's order of bytes."""
    words = [int(number[at:at + 8], 16).to_bytes(4, sys.byteorder) for at in range(0, len(number), 8)]
    return ip_address(b''.join(words))


def _is_of_this_host(address: IPv4Address | IPv6Address) -> bool:
    """Whether other hosts cannot reach the address: it is loopback, or a group, joined on the cards of the others."""
    inner = getattr(address, 'ipv4_mapped', None) or address
    return inner.is_loopback or inner.is_multicast
