"""Joint ground: the roadmap on which robots of some radii plan jointly, and its lanes.

It takes from ten to some hundred milliseconds to make: too long for a cycle, so it is asked for like a joint plan.
"""
from __future__ import annotations

from operator import is_
from threading import Lock
from typing import ClassVar
from weakref import WeakSet

from mobile_planning.errors import PlanningError
from mobile_planning.fleet.joint_plan import WIDE
from mobile_planning.fleet.lanes import LaneFinder
from mobile_planning.fleet.mouths import finer_at_mouths
from mobile_planning.fleet.roadmap import Roadmap
from mobile_planning.world.environment import Environment


class JointGround:
    """A static world, as robots of some radii plan jointly in it; the robots of a process share it, see `of`.

    Parameters
    ----------
    environment : Environment
    least, most : float [m]
        Radii of the smallest and of the largest body.

    Attributes
    ----------
    lanes : LaneFinder
    roadmap : Roadmap
        For plans, with more places at the mouths of the lanes.

    Raises
    ------
    InvalidInput
        If the world has no extent.
    """

    _in_use: ClassVar[WeakSet[JointGround]] = WeakSet()
    _lock: ClassVar[Lock] = Lock()

    def __init__(self, environment: Environment, least: float, most: float):
        self._environment, self._radii = environment, (least, most)
        roadmap = Roadmap(environment, least, most)
        self.lanes = LaneFinder(roadmap)
        self.roadmap = finer_at_mouths(roadmap, 2 * roadmap.widest + WIDE)

    @classmethod
    def of(cls, environment: Environment, least: float, most: float) -> JointGround:
        """Return the ground that a robot of this process has made of the same world for the same radii, or a new one.

        Raises
        ------
        InvalidInput
            If the world has no extent.
        """
        with cls._lock:
            ground = next((each for each in cls._in_use if each._radii == (least, most)
                           and _is_same(each._environment, environment)), None)
            if ground is None:
                ground = cls(environment, least, most)
                cls._in_use.add(ground)
            return ground


class GroundStore:
    """The grounds of one static world, by the least and the greatest radius; a world without extent has none.

    One thread may `make` them while another asks.

    Examples
    --------
    >>> from mobile_planning import Boundary
    >>> grounds = GroundStore(Environment(Boundary((0, 3), (0, 2))))
    >>> grounds.knows((0.2, 0.2)), grounds.get((0.2, 0.2))
    (False, None)
    >>> grounds.make((0.2, 0.2))
    >>> grounds.knows((0.2, 0.2)), len(grounds.get((0.2, 0.2)).roadmap.places)
    (True, 22)
    """

    def __init__(self, environment: Environment):
        self.environment = environment
        self._made: dict[tuple[float, float], JointGround | None] = {}

    def knows(self, radii: tuple[float, float]) -> bool:
        """Return whether the ground for bodies of these ``radii`` [m] was made, or cannot be."""
        return radii in self._made

    def get(self, radii: tuple[float, float]) -> JointGround | None:
        """Return the ground for bodies of these ``radii`` [m], None if there is none; this takes no time."""
        return self._made.get(radii)

    def make(self, radii: tuple[float, float]) -> None:
        """Make the ground for bodies of these ``radii`` [m] if it is not known."""
        if radii in self._made:
            return
        try:
            ground = JointGround.of(self.environment, *radii)
        except PlanningError:
            ground = None
        self._made[radii] = ground


def _is_same(a, b):
    """Return whether two static worlds are the same: of the same things, their grids cell by cell."""
    return (a.boundary is b.boundary
            and len(a.obstacles) == len(b.obstacles) and all(map(is_, a.obstacles, b.obstacles))
            and (a.occupied_from, a.unknown_is_free) == (b.occupied_from, b.unknown_is_free)
            and (a.grid is b.grid or a.grid is not None and a.grid == b.grid))
