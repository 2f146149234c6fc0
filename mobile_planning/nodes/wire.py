"""What all messages of the fleet have in common: layouts, frames, stamps and arrays, each checked in one place."""
from __future__ import annotations

from array import array
from collections.abc import Container, Mapping, Sequence

import numpy as np
from builtin_interfaces.msg import Time
from numpy.typing import ArrayLike

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.message import MAX_LINKS, Link
from mobile_planning.nodes.convert import check_frame

#: Layouts that this version of the package speaks, by kind of message.
LAYOUTS = {'RobotMsg': 5, 'Contracts': 2, 'JointPlan': 1}
#: Knots beyond this are no times of any clock, and sums of them would not fit 64 bits.
MAX_KNOT = 2**48


def layout(kind: type) -> int:
    """Return the number of the layout of a kind of message, for its field ``version``."""
    return LAYOUTS[kind.__name__]


def check_head(message, frame: str) -> None:
    """Refuse a message of another layout or in another frame than ``frame``.

    Raises
    ------
    InvalidInput
        Its layout is unknown here.
    UnknownFrame
    """
    kind = type(message).__name__
    if kind in LAYOUTS and message.version != LAYOUTS[kind]:
        raise InvalidInput(f'{kind} has version {message.version}, not {LAYOUTS[kind]}')
    check_frame(message.header.frame_id, frame, kind)


def stamp(time: float) -> Time:
    """Return ``time`` [s] as a stamp."""
    whole = int(np.floor(time))
    return Time(sec=whole, nanosec=min(int(round((time - whole) * 1e9)), 999_999_999))


def floats(values: ArrayLike) -> array:
    """Return numbers as a message holds them."""
    return array('d', np.ascontiguousarray(values, dtype=np.float64).tobytes())


def knot(number: int) -> int:
    """Return the number of a knot, if it can be one; raise InvalidInput if it cannot."""
    if abs(number) > MAX_KNOT:
        raise InvalidInput(f'a plan begins at knot {number}, which is no time')
    return int(number)


def link_columns(links: Mapping[int, Link], prefix: str = '') -> dict[str, array]:
    """Return the fields of a message that hold the links of one robot, entry by entry, in the order of the ids.

    Parameters
    ----------
    links : mapping of int to Link
        By the id of the peer.
    prefix : str
        Of the names of all fields: ``Contracts`` calls them ``answer_...``.
    """
    peers = sorted(links)
    entries = [links[peer] for peer in peers]
    mode = 'mode' if prefix else 'link_mode'
    epoch = 'epoch' if prefix else 'peer_epoch'
    columns = {'peer': array('I', peers), epoch: array('I', [link.epoch for link in entries]),
               mode: array('B', [int(link.mode) for link in entries]),
               'contract': array('I', [link.contract for link in entries]),
               'promised': array('I', [link.promised for link in entries]),
               'granted': array('q', [link.granted for link in entries])}
    return {prefix + name: column for name, column in columns.items()}


def links(peers: Sequence[int], *columns: Sequence[int], to: Container[int] | None = None) -> dict[int, Link]:
    """Return the links by peer, from one array for the peers and one for each field.

    Parameters
    ----------
    peers, *columns : sequence of int
    to : container of int, optional
        Links with others than these are passed over; by default none is.

    Raises
    ------
    InvalidInput
        The arrays differ in length, are too long, or name a peer twice; or a number is out of its range.
    """
    counts = [len(peers), *map(len, columns)]
    if len(set(counts)) != 1 or counts[0] > MAX_LINKS:
        raise InvalidInput(f'the arrays of the links have {counts} entries, not the same number up to {MAX_LINKS}')
    if len(set(peers)) != len(peers):
        raise InvalidInput('a message has two links with one robot')
    return {peer: Link(*link) for peer, *link in zip(peers, *columns) if to is None or peer in to}
