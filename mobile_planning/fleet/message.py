"""What robots tell each other: once a cycle where they drive, in between what they agree on."""
from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.contracts import Contract
from mobile_planning.fleet.fields import finite, whole
from mobile_planning.fleet.joint_message import JointStatus

MAX_LINKS = 256


class Mode(IntEnum):
    """What a robot is doing."""

    WAITING = 0
    DRIVING = 1
    DONE = 2
    STOPPED = 3


class LinkMode(IntEnum):
    """What a robot goes by towards another.

    NONE: nothing is agreed, so it stays where it is. STATIC: the other is at rest and will stay so; it is passed like
    an obstacle. CON: contracts hold. FAR: nothing is agreed, and the other is out of sight.
    """

    NONE = 0
    STATIC = 1
    CON = 2
    FAR = 3


_MODES = tuple(LinkMode)


@dataclass(frozen=True)
class Link:
    """What one robot says to another: its acknowledgement if its id is the higher, its grant if it is the lower.

    Attributes
    ----------
    epoch : int
        Boot epoch of the addressee as heard; 0 if not heard.
    mode : LinkMode
    contract : int
        Id of the contract in force; 0 for none.
    promised : int
        No contract up to this id will be taken any more, but for the one in force.
    granted : int
        Sequence of the newest message of the addressee that it may depart from rest on; -1 for none.

    Raises
    ------
    InvalidInput
        A number is out of its range.
    """

    epoch: int = 0
    mode: LinkMode = LinkMode.NONE
    contract: int = 0
    promised: int = 0
    granted: int = -1

    def __post_init__(self):
        if self.mode not in _MODES:
            raise InvalidInput(f'a link has no mode {self.mode}, only 0 to {max(LinkMode)}')
        object.__setattr__(self, 'mode', LinkMode(self.mode))
        for name, least in (('epoch', 0), ('contract', 0), ('promised', 0), ('granted', -1)):
            object.__setattr__(self, name, whole(name, getattr(self, name), least))

    @classmethod
    def of_side(cls, epoch: int, mode: LinkMode, contract: int, promised: int, granted: int = -1) -> Link:
        """Return what a side of a link says, whose numbers are right: there are as many in each message as robots."""
        link = object.__new__(cls)
        vars(link).update(epoch=epoch, mode=mode, contract=contract, promised=promised, granted=granted)
        return link


@dataclass(frozen=True, eq=False)
class RobotMsg:
    """One robot's intention; each message stands alone, only the newest of a sender counts.

    Attributes
    ----------
    dp : bool
        ``done_planning``: at the goal and at rest.
    ip_z1, ip_z2 : (n,) ndarray [m]
        ``intended_path_z1`` and ``_z2``: the plan in force, at its knots.
    lz : (2,) ndarray [m]
        ``latest_z``: where the robot is by its plan.
    robot_id, boot_epoch, sequence : int
        The sender, the start of its process, the message.
    mode : Mode
    plan : Plan
        In force from its first knot on; None in a message of the seed's four fields alone.
    plan_seq : int
        Number of ``plan``.
    radius, v_max, omega_max, a_max : float [m, m/s, rad/s, m/s^2]
    goal : (2,) ndarray [m]
    links : dict of int to Link
    joint : JointStatus

    Raises
    ------
    InvalidInput
        A field is not finite, out of its range or at odds with another.
    """

    dp: bool
    ip_z1: NDArray[np.float64]
    ip_z2: NDArray[np.float64]
    lz: NDArray[np.float64]
    robot_id: int = 0
    boot_epoch: int = 0
    sequence: int = 0
    mode: Mode = Mode.WAITING
    plan: Plan | None = None
    plan_seq: int = 0
    radius: float = 0.2
    v_max: float = 1.0
    omega_max: float = 5.0
    a_max: float = 2.0
    goal: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    links: dict[int, Link] = field(default_factory=dict)
    joint: JointStatus = field(default_factory=JointStatus)

    def __post_init__(self):
        for name, size in (('ip_z1', None), ('ip_z2', None), ('lz', 2), ('goal', 2)):
            object.__setattr__(self, name, finite(name, getattr(self, name), size))
        if len(self.ip_z1) != len(self.ip_z2):
            raise InvalidInput(f'intended_path_z1 has {len(self.ip_z1)} numbers, intended_path_z2 {len(self.ip_z2)}')
        for name, limit in (('radius', 100.0), ('v_max', 100.0), ('omega_max', 1e3), ('a_max', 1e3)):
            value = getattr(self, name)
            if not 0.0 < value <= limit:
                raise InvalidInput(f'{name} is {value}, not in 0..{limit}')
        if len(self.links) > MAX_LINKS:
            raise InvalidInput(f'a message has {len(self.links)} links, more than {MAX_LINKS}')
        for name in ('robot_id', 'boot_epoch', 'sequence', 'plan_seq'):
            object.__setattr__(self, name, whole(name, getattr(self, name), 0))

    @property
    def method(self) -> str:
        """By which the sender plans: by the receding horizon a robot has a link to itself, see `Exchange`."""
        return 'receding_horizon' if self.robot_id in self.links else 'contracts'

    @property
    def done_planning(self) -> bool:
        """The seed's name of ``dp`` on the wire."""
        return self.dp

    @property
    def intended_path_z1(self) -> NDArray[np.float64]:
        """The seed's name of ``ip_z1`` on the wire."""
        return self.ip_z1

    @property
    def intended_path_z2(self) -> NDArray[np.float64]:
        """The seed's name of ``ip_z2`` on the wire."""
        return self.ip_z2

    @property
    def latest_z(self) -> NDArray[np.float64]:
        """The seed's name of ``lz`` on the wire."""
        return self.lz


@dataclass(frozen=True)
class Offer:
    """A contract that the sender, its owner, is bound to and offers to one peer.

    Attributes
    ----------
    peer_id, peer_epoch : int
        To whom, and to which life of its process.
    base_sequence : int
        Of the peer's message that the contract was built on.
    contract : Contract
    """

    peer_id: int
    peer_epoch: int
    base_sequence: int
    contract: Contract

    def __post_init__(self):
        for name in ('peer_id', 'peer_epoch', 'base_sequence'):
            object.__setattr__(self, name, whole(name, getattr(self, name), 0))
        if not isinstance(self.contract, Contract):
            raise InvalidInput(f'an offer has a contract, not {self.contract!r}')


@dataclass(frozen=True)
class Contracts:
    """What one robot has to say about contracts between two of its cycles, to all peers at once.

    Attributes
    ----------
    robot_id, boot_epoch, sequence : int
        The sender, the start of its process, the message; counted together with its `RobotMsg`.
    offers : tuple of Offer
    answers : dict of int to Link
        What the sender says now to those whose offers came.
    """

    robot_id: int
    boot_epoch: int
    sequence: int
    offers: tuple[Offer, ...] = ()
    answers: dict[int, Link] = field(default_factory=dict)

    def __post_init__(self):
        for name in ('robot_id', 'boot_epoch', 'sequence'):
            object.__setattr__(self, name, whole(name, getattr(self, name), 0))
        object.__setattr__(self, 'offers', tuple(self.offers))
        for name in ('offers', 'answers'):
            if len(getattr(self, name)) > MAX_LINKS:
                raise InvalidInput(f'a message has {len(getattr(self, name))} {name}, more than {MAX_LINKS}')

    @cached_property
    def addressees(self) -> frozenset[int]:
        """To whom something in it is said; all hear it."""
        return frozenset(self.answers).union(offer.peer_id for offer in self.offers)


@dataclass(frozen=True, eq=False)
class Death:
    """A certificate: when it was issued, no process of the robot lived, and its body had come to rest.

    Attributes
    ----------
    robot_id, boot_epoch : int
        Who, and the last start of its process.
    place : (2,) ndarray [m]
        Where the body is.
    issued : float [s]
        On the robots' common clock.
    radius : float [m] or None
        Of the body; None: only those use the certificate who know it.
    """

    robot_id: int
    boot_epoch: int
    place: NDArray[np.float64]
    issued: float
    radius: float | None = None

    def __post_init__(self):
        if self.radius is not None and not 0.0 < self.radius <= 100.0:
            raise InvalidInput(f'radius is {self.radius}, not in 0..100.0')
        for name in ('robot_id', 'boot_epoch'):
            object.__setattr__(self, name, whole(name, getattr(self, name), 0))
        object.__setattr__(self, 'place', finite('place', self.place, 2))
        object.__setattr__(self, 'issued', float(finite('issued', [self.issued], 1)[0]))
