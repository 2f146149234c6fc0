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


class Car(NamedTuple):
    """What kernels know of how a robot gets from pose to pose."""

    #: Whether it turns in place, and so drives straight lines.
    turns_in_place: bool
    #: Whether it drives backwards too, by Reeds-Shepp paths, not by Dubins paths.
    reverses: bool
    #: Least turning radius [m]; 1 where it turns in place, where it means nothing.
    radius: float


def car_of(radius: float, steering: Steering = Steering.DUBINS) -> Car:
    """Return the car of a turning radius [m]; a robot of radius 0 turns on the spot and goes in straight lines.

    Examples
    --------
    >>> car_of(4.0, Steering.REEDS_SHEPP), car_of(0.0)
    (Car(turns_in_place=False, reverses=True, radius=4.0), Car(turns_in_place=True, reverses=False, radius=1.0))
    """
    if radius == 0:
        return Car(True, False, 1.0)
    return Car(False, steering is Steering.REEDS_SHEPP, float(radius))
