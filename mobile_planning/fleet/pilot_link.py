"""PilotLink: what a robot and the process that drives its base say to each other.

Both ends are local sockets that keep packets whole. What was sent arrives, though its sender dies the instant after.
Nobody waits for who is frozen or dead: a packet for which there is no room is an error at once.
"""
from __future__ import annotations

import json
import socket
from dataclasses import asdict, dataclass, field

from mobile_planning.fleet.logbook import Entry, as_fields, entry
from mobile_planning.fleet.pilot import PilotStatus
from mobile_planning.fleet.tracking import Tracker

#: No packet is longer [bytes].
_LONGEST = 1 << 17


@dataclass(frozen=True)
class PilotTask:
    """What a pilot has to know of its robot.

    Attributes
    ----------
    name, namespace : str
        Of the robot's node.
    domain : int
        Of the middleware.
    enclave : str
        Of the robot's process, for DDS-Security; empty for none.
    topics : dict of str to str
        Where ``~/pose``, ``~/odom`` and ``~/cmd_vel`` of the robot are.
    frame, child_frame : str
        Of all poses; of the base.
    localisation : str
        ``pose`` or ``tf``.
    rate : float [Hz]
        Of the tracking.
    tracker : Tracker
    most_drift : float [m]
        See `Pilot`.
    uses_sim_time : bool
    """

    name: str
    namespace: str
    domain: int
    enclave: str
    topics: dict[str, str]
    frame: str
    child_frame: str
    localisation: str
    rate: float
    tracker: Tracker
    most_drift: float
    uses_sim_time: bool


@dataclass(frozen=True)
class PilotNews:
    """What a pilot tells of itself.

    Attributes
    ----------
    status : PilotStatus
    pose : tuple of float or None
        Where the body was found, x, y, theta [m, m, rad], as long as there is no plan to drive.
    rejected : dict of str to int
        Messages that made no sense, by kind, so far.
    faults : int
        Of ours, so far.
    newest : str
        The sentence of the newest failure.
    """

    status: PilotStatus
    pose: tuple[float, float, float] | None = None
    rejected: dict[str, int] = field(default_factory=dict)
    faults: int = 0
    newest: str = ''


class PilotLink:
    """One end of the link.

    Parameters
    ----------
    end : socket.socket

    Examples
    --------
    >>> ours, theirs = PilotLink.pair()
    >>> ours.send(PilotNews(PilotStatus(drift=0.01)))
    >>> ours.close()
    >>> theirs.receive().status.drift, theirs.receive()
    (0.01, None)
    >>> theirs.close()
    """

    def __init__(self, end: socket.socket):
        self._end = end

    @classmethod
    def pair(cls) -> tuple[PilotLink, PilotLink]:
        """Return both ends of a new link."""
        one, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        return cls(one), cls(other)

    def fileno(self) -> int:
        """Return the descriptor of this end, to hand it to another process."""
        return self._end.fileno()

    def send(self, content: PilotTask | Entry | PilotNews) -> None:
        """Send one packet.

        Raises
        ------
        OSError
            Nobody is there to hear it, or has not listened for long.
        """
        fields = as_fields(content) if isinstance(content, Entry) else asdict(content)
        self._end.send(json.dumps([type(content).__name__, fields]).encode(), socket.MSG_DONTWAIT)

    def receive(self) -> PilotTask | Entry | PilotNews | None:
        """Wait for a packet and return what is in it; None once the other end is closed, by whatever means."""
        while True:
            try:
                packet = self._end.recv(_LONGEST)
            except ConnectionResetError:
                # The other has died with packets of ours unread; what it sent before is there all the same.
                continue
            except OSError:
                return None
            return _content(*json.loads(packet)) if packet else None

    def leave(self) -> None:
        """Close this end here, where another process has it."""
        self._end.close()

    def close(self) -> None:
        """Close this end; who waits in `receive` gets None."""
        try:
            self._end.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass  # the other end was closed before
        self._end.close()


def _content(kind, fields):
    if kind == 'Entry':
        return entry(fields)
    if kind == 'PilotTask':
        return PilotTask(**{**fields, 'tracker': Tracker(**fields['tracker'])})
    return PilotNews(**{**fields, 'status': PilotStatus(**fields['status'])})
