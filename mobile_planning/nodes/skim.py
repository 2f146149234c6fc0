"""What can be told of a serialised message at first sight: who says it and when, and whom it concerns.

Most of what a robot of a large fleet hears is between others. To make an object of a message, field by field, takes
several times as long as to look at it where it lies.
"""
from __future__ import annotations

from collections.abc import Container
from struct import Struct, error
from typing import NamedTuple

from mobile_planning.errors import InvalidInput

#: Plain CDR, its numbers with the lowest byte first: what is on the wire among machines that ROS 2 has packages for.
_PLAIN = b'\x00\x01'
#: Alignment counts from the end of these bytes, which are a multiple of 4 but not of 8.
_START = 4
_STAMP, _VERSION, _SPEAKER, _COUNT = Struct('<iII'), Struct('<H'), Struct('<III'), Struct('<I')
#: Bytes of an entry of each array of Contracts, from ``peer`` to ``answer_peer``.
_CONTRACTS = 4, 4, 4, 4, 8, 2, 8, 8, 8, 8, 4
_FIRST, _LAST = 0, len(_CONTRACTS) - 1


class Head(NamedTuple):
    """What all messages of robots begin with.

    Attributes
    ----------
    stamp : float [s]
    frame : str
    version, robot_id, boot_epoch, sequence : int
    size : int [bytes]
        Of all this.
    """

    stamp: float
    frame: str
    version: int
    robot_id: int
    boot_epoch: int
    sequence: int
    size: int


def head(content: bytes) -> Head:
    """Return the head of a RobotMsg, Contracts or JointPlan.

    Raises
    ------
    InvalidInput
        It is cut off, or written in another way.
    """
    if len(content) < _START:
        raise _cut_off(content)
    if content[:2] != _PLAIN:
        raise InvalidInput(f'a message is written in the encoding {content[:2].hex()}, which is not plain CDR')
    try:
        seconds, nanoseconds, length = _STAMP.unpack_from(content, _START)
        name = _START + _STAMP.size
        at = _aligned(name + length, 2)
        (version,) = _VERSION.unpack_from(content, at)
        at = _aligned(at + _VERSION.size, 4)
        speaker = _SPEAKER.unpack_from(content, at)
    except error:
        raise _cut_off(content) from None
    # A text ends with a zero.
    frame = content[name:name + length - 1].decode(errors='replace') if length else ''
    return Head(seconds + 1e-9 * nanoseconds, frame, version, *speaker, at + _SPEAKER.size)


def concerns(content: bytes, size: int, ids: Container[int]) -> bool:
    """Return whether Contracts offers or answers something to one of ``ids``.

    Parameters
    ----------
    content : bytes
    size : int [bytes]
        Of its `head`.
    ids : container of int

    Raises
    ------
    InvalidInput
        It is cut off.
    """
    at = size
    for number, width in enumerate(_CONTRACTS):
        at = _aligned(at, 4)
        try:
            (count,) = _COUNT.unpack_from(content, at)
        except error:
            raise _cut_off(content) from None
        begin = _aligned(at + _COUNT.size, width) if count else at + _COUNT.size
        at = begin + count * width
        if at > len(content):
            raise _cut_off(content)
        if number in (_FIRST, _LAST) and any(peer in ids for (peer,) in _COUNT.iter_unpack(content[begin:at])):
            return True
    return False


def _aligned(at, width):
    """Return where an entry of ``width`` bytes begins that comes after ``at`` bytes."""
    return at + (_START - at) % width


def _cut_off(content):
    return InvalidInput(f'a message is cut off after {len(content)} bytes')
