"""How a robot gets from one pose to the next."""
from __future__ import annotations

from enum import Enum
from typing import NamedTuple

from mobile_planning.errors import InvalidInput


class Steering(Enum):
    """Which curves a car with a turning radius drives."""

    #: Forwards only: the shortest of Dubins' six words.
    DUBINS = 'dubins'
    #: Forwards and backwards: the shortest of the words of Reeds and Shepp.
    REEDS_SHEPP = 'reeds_shepp'

    @classmethod
    def _missing_(cls, value: object) -> None:
        raise InvalidInput(f'steering {value!r} is none of {", ".join(each.value for each in cls)}')


#: The kinds of ways, as kernels number them: straight lines, Dubins paths, Reeds-Shepp paths.
LINES, DUBINS, REEDS_SHEPP = range(3)


class Car(NamedTuple):
    """What kernels know of how a robot gets from pose to pose."""

    #: `LINES`, `DUBINS` or `REEDS_SHEPP`.
    kind: int
    #: Least turning radius [m]; 1 where nothing but lines is driven, where it means nothing.
    radius: float


def car_of(radius: float, steering: Steering = Steering.DUBINS) -> Car:
    """Return the car of a turning radius [m]; a robot of radius 0 turns on the spot and goes in straight lines.

    Examples
    --------
    >>> car_of(4.0, Steering.REEDS_SHEPP), car_of(0.0)
    (Car(kind=2, radius=4.0), Car(kind=0, radius=1.0))
    """
    if radius == 0:
        return Car(LINES, 1.0)
    return Car(REEDS_SHEPP if steering is Steering.REEDS_SHEPP else DUBINS, float(radius))
