"""How an RRT grows."""
from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from mobile_planning.errors import InvalidInput
from mobile_planning.sampling.steering import Steering


@dataclass(frozen=True)
class RRTOptions:
    """What may be chosen of a tree.

    Parameters
    ----------
    radius : float [m]
        Least turning radius of the car; 0 is a robot that turns on the spot, whose poses have no heading.
    steering : Steering or str
        Of a car: forwards only (``DUBINS``), or backwards too (``REEDS_SHEPP``).
    speed : float [m/s]
        At which obstacles that move are met.
    nb_options : int, optional
        How many nodes are tried for a sample; the first free way is taken. By default 10, or 3 for a robot that turns
        on the spot.
    max_extension : float [m], optional
        A longer way is cut there; infinite goes all the way to each sample. By default 4 radii, or three tenths of
        the world's extent for a robot that turns on the spot.
    scouts : bool
        Whether, beside the tree that is improved, fresh ones look for entirely different ways.
    two_trees : bool
        Whether a second tree grows from the goal until both meet: for a point or a disc, where nothing moves, the goal
        itself is free and ``goal_rate`` is not 0. Without it the tree grows from the start alone, as the seed has it.

    Raises
    ------
    InvalidInput
        If a number is out of its range.
    """

    radius: float = 4.0
    steering: Steering = Steering.DUBINS
    speed: float = 1.0
    nb_options: int | None = None
    max_extension: float | None = None
    scouts: bool = True
    two_trees: bool = True

    def __post_init__(self):
        if not (_is_number(self.radius) and isfinite(self.radius) and self.radius >= 0):
            raise InvalidInput(f'turning radius {self.radius!r} m is not a finite number of at least 0')
        object.__setattr__(self, 'steering', Steering(self.steering))
        if self.radius == 0 and self.steering is not Steering.DUBINS:
            raise InvalidInput(f'a robot of turning radius 0 goes in straight lines: steering {self.steering.value!r} '
                               'needs a radius')
        if not (_is_number(self.speed) and isfinite(self.speed) and self.speed > 0):
            raise InvalidInput(f'speed {self.speed!r} m/s is not a finite number above 0')
        if self.nb_options is None:
            object.__setattr__(self, 'nb_options', 10 if self.radius > 0 else 3)
        if not (_is_whole(self.nb_options) and 1 <= self.nb_options <= 1000):
            raise InvalidInput(f'nb_options {self.nb_options!r} is not a whole number from 1 to 1000')
        if self.max_extension is not None and not (_is_number(self.max_extension) and self.max_extension > 0):
            raise InvalidInput(f'max_extension {self.max_extension!r} m is not a number above 0')


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _is_whole(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)
