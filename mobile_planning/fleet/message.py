"""RobotMsg: what one robot tells all others, once a cycle."""
from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.bspline import Plan

MAX_LINKS = 256


class Mode(IntEnum):
    """What a robot is doing."""

    WAITING = 0
    DRIVING = 1
    DONE = 2
    STOPPED = 3


@dataclass(frozen=True)
class Link:
    """What a robot has heard from one peer, and what it promised to stay clear of."""

    epoch: int
    heard: int
    promised: int


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
    proposal : Plan or None
        Takes force at its first knot if everybody promises to stay clear of it in time.
    proposal_seq : int
        Number of ``proposal``; 0 for none.
    radius, v_max, omega_max, a_max : float [m, m/s, rad/s, m/s^2]
    goal : (2,) ndarray [m]
    links : dict of int to Link

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
    proposal: Plan | None = None
    proposal_seq: int = 0
    radius: float = 0.2
    v_max: float = 1.0
    omega_max: float = 5.0
    a_max: float = 2.0
    goal: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    links: dict[int, Link] = field(default_factory=dict)

    def __post_init__(self):
        for name, size in (('ip_z1', None), ('ip_z2', None), ('lz', 2), ('goal', 2)):
            object.__setattr__(self, name, _finite(name, getattr(self, name), size))
        if len(self.ip_z1) != len(self.ip_z2):
            raise InvalidInput(f'intended_path_z1 has {len(self.ip_z1)} numbers, intended_path_z2 {len(self.ip_z2)}')
        for name, limit in (('radius', 100.0), ('v_max', 100.0), ('omega_max', 1e3), ('a_max', 1e3)):
            value = getattr(self, name)
            if not 0.0 < value <= limit:
                raise InvalidInput(f'{name} is {value}, not in 0..{limit}')
        if len(self.links) > MAX_LINKS:
            raise InvalidInput(f'a message has {len(self.links)} links, more than {MAX_LINKS}')
        if self.proposal_seq < 0 or (self.proposal is None) != (self.proposal_seq == 0):
            raise InvalidInput(f'proposal_seq is {self.proposal_seq}, which does not fit the proposal')
        if self.proposal is not None and self.plan is not None and self.proposal.step != self.plan.step:
            raise InvalidInput(f'the proposal has the step {self.proposal.step} s, the plan {self.plan.step} s')

    @property
    def done_planning(self) -> bool:
        """The seed's name of ``dp`` on the wire."""
        return self.dp


def _finite(name: str, value: ArrayLike, size: int | None) -> NDArray[np.float64]:
    try:
        array = np.asarray(value, float)
    except (TypeError, ValueError):
        raise InvalidInput(f'{name} must be numbers, not {value!r}') from None
    if array.ndim != 1 or (size is not None and array.shape != (size,)) or not np.isfinite(array).all():
        raise InvalidInput(f'{name} must be finite numbers, {size or "any count"} of them')
    return array
