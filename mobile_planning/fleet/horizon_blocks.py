"""Blocks of constraints of a section of the receding horizon: each gives values that must not be negative, and slopes.

A section is composed of the blocks it needs: speed, turn rate and acceleration always, obstacles where some are seen,
collision, communication and deviation where other robots are heeded. All values are in metres, metres per second or
metres per second squared, so that one accuracy fits all.

Source: planning_sim's document, section 1.2, which names the blocks; its source code for collision, communication and
deviation, which the document leaves open.
"""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from mobile_planning.world.convex_pieces import ConvexPieces

#: Where another robot is: times (S,) [s] from the start of the section to positions and velocities, (S, 2) each.
Path = Callable[[NDArray], tuple[NDArray, NDArray]]
#: Nearer than this [m], two places have no direction between them.
_NEAREST = 1e-9
#: Lengths below this are rounded off, so that they have slopes at 0.
_ROUND = 1e-3
#: Slower than this [m/s], turn rates are not bounded here but by the proof afterwards.
_CREEPS = 0.03


@dataclass(frozen=True, eq=False)
class Samples:
    """A section at its sample times, and how it changes with its variables.

    Attributes
    ----------
    u : (S,) ndarray
        Times as shares of the duration.
    duration : float [s]
    z, v, a : (S, 2) ndarray [m, m/s, m/s^2]
    dz, dv, da : (S, 2, X) ndarray
        Slopes by the X variables.
    is_free : bool
        The last variable is the duration.
    """

    u: NDArray[np.float64]
    duration: float
    z: NDArray[np.float64]
    v: NDArray[np.float64]
    a: NDArray[np.float64]
    dz: NDArray[np.float64]
    dv: NDArray[np.float64]
    da: NDArray[np.float64]
    is_free: bool


class Block(Protocol):
    """Some of the constraints of a section."""

    def __call__(self, at: Samples) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the values (m,), not negative where kept, and their slopes (m, X)."""


@dataclass(frozen=True)
class Speed:
    """``|z'| <= most`` [m/s]."""

    most: float

    def __call__(self, at: Samples) -> tuple[NDArray, NDArray]:
        return _within(self.most, at.v, at.dv)


@dataclass(frozen=True)
class Acceleration:
    """``|z''| <= most`` [m/s^2]."""

    most: float

    def __call__(self, at: Samples) -> tuple[NDArray, NDArray]:
        return _within(self.most, at.a, at.da)


def _within(most, vector, slope):
    length = np.sqrt((vector**2).sum(axis=1) + _ROUND**2)
    return most - length, -np.einsum('sd,sdx->sx', vector / length[:, None], slope)


@dataclass(frozen=True)
class TurnRate:
    """``|omega| <= most`` [rad/s], written ``|z'|^2 -/+ z' x z'' / most >= 0``, which has a meaning at rest too.

    There it would leave a solver no room at all, so that it is loosened for motion slower than a few centimetres per
    second.
    """

    most: float

    def __call__(self, at: Samples) -> tuple[NDArray, NDArray]:
        (vx, vy), (ax, ay) = at.v.T, at.a.T
        cross = (vx * ay - vy * ax) / self.most
        turned, quarter = np.column_stack([ay, -ax]), np.column_stack([-vy, vx])
        slope = (np.einsum('sd,sdx->sx', turned, at.dv) + np.einsum('sd,sdx->sx', quarter, at.da)) / self.most
        square, square_slope = (at.v**2).sum(axis=1) + _CREEPS**2, 2 * np.einsum('sd,sdx->sx', at.v, at.dv)
        return (np.concatenate([square - cross, square + cross]),
                np.concatenate([square_slope - slope, square_slope + slope]))


@dataclass(frozen=True, eq=False)
class Obstacles:
    """``pt_2_obst(z, radius) >= 0`` for each convex piece of what is seen, and likewise for the walls.

    A radius that is greater than the body's, to spare something, is cut to the room that there is at the start.

    Attributes
    ----------
    pieces : ConvexPieces
    members, walls : (K,), (H,) ndarray of int
        The pieces that count, and the walls.
    least : (K + H,) ndarray [m]
        The radius for each.
    """

    pieces: ConvexPieces
    members: NDArray[np.int64]
    walls: NDArray[np.int64]
    least: NDArray[np.float64]

    @classmethod
    def around(cls, pieces: ConvexPieces, place: NDArray, reach: float, radius: float, spare: float) -> Obstacles:
        """Return the block of what is within ``reach`` [m] of a start ``place`` (2,), for a body of ``radius`` [m]."""
        _, members = pieces.near(place[None] - reach, place[None] + reach)
        walls = np.flatnonzero(pieces.wall_normals @ place - pieces.wall_offsets < reach)
        block = cls(pieces, np.sort(members), walls, np.zeros(len(members) + len(walls)))
        return replace(block, least=np.clip(block.room(place[None])[0], radius, radius + spare))

    def room(self, places: NDArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return distances [m] from ``places`` (n, 2), and the directions in which they grow, piece by piece."""
        count, members = len(places), self.members
        normals, _, distances = self.pieces.lines(places[:, None], np.tile(np.arange(count), len(members)),
                                                  np.repeat(members, count))
        walls = self.pieces.wall_normals[self.walls]
        from_walls = walls @ places.T - self.pieces.wall_offsets[self.walls, None]
        return (np.concatenate([distances, from_walls.ravel()]),
                np.concatenate([normals, np.repeat(walls, count, axis=0)]))

    def __call__(self, at: Samples) -> tuple[NDArray, NDArray]:
        room, directions = self.room(at.z)
        slopes = np.tile(at.dz, (len(self.least), 1, 1))
        return room - np.repeat(self.least, len(at.z)), np.einsum('sd,sdx->sx', directions, slopes)


@dataclass(frozen=True, eq=False)
class Collision:
    """``|z - z_p| >= least`` [m] from where another robot is."""

    path: Path
    least: float

    def __call__(self, at: Samples) -> tuple[NDArray, NDArray]:
        distance, slope = _distances(at, self.path)
        return distance - self.least, slope


@dataclass(frozen=True, eq=False)
class Communication:
    """``|z - z_p| <= most`` [m] from where another robot is; from where the own intention is, it is the deviation."""

    path: Path
    most: float

    def __call__(self, at: Samples) -> tuple[NDArray, NDArray]:
        distance, slope = _distances(at, self.path)
        return self.most - distance, -slope


def _distances(at, path):
    places, velocities = path(at.u * at.duration)
    away, slope = at.z - places, at.dz
    if at.is_free:
        slope = slope.copy()
        slope[:, :, -1] -= velocities * at.u[:, None]
    distance = np.linalg.norm(away, axis=1)
    # On top of each other any direction leads away; one is as good as another.
    units = np.where(distance[:, None] > _NEAREST, away / np.maximum(distance, _NEAREST)[:, None], (1.0, 0.0))
    return distance, np.einsum('sd,sdx->sx', units, slope)
