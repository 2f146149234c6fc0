"""Mouths of lanes: where those who come out meet those who wait, and a few decimetres decide how long it takes."""
from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mobile_planning.fleet.roadmap import MARGIN, Roadmap

#: Samples along an edge, to find where a lane ends.
_SAMPLES = 17
#: Edges of a lattice lead out of a lane askew by no more than this [rad].
_SKEW = 0.8
#: Rows of places before a mouth, and on each side of its middle line.
_ROWS, _ASIDE = 3, 3
#: A new place is no nearer to another than this part of the distance of rows; it is joined to those within so many.
_NEAR, _REACH = 0.4, 2.3


def finer_at_mouths(roadmap: Roadmap, need: float) -> Roadmap:
    """Return the roadmap with more places before the lanes' mouths.

    Half of what two bodies ``need`` [m] between their middles lies between two places: so whoever waits for those in
    the lane finds a place beside their way that is just far enough, and near to the mouth.

    Examples
    --------
    >>> from mobile_planning import Boundary, Environment, PolygonObstacle
    >>> wall = [PolygonObstacle([(-0.1, y), (0.1, y), (0.1, y + 1.7), (-0.1, y + 1.7)]) for y in (-2.0, 0.3)]
    >>> roadmap = Roadmap(Environment(Boundary((-2, 2), (-2, 2)), wall), 0.2)
    >>> len(finer_at_mouths(roadmap, 0.5).places) > len(roadmap.places)
    True
    """
    if not roadmap.has_lanes:
        return roadmap
    spacing = need / 2 + 1e-3
    ahead, aside = np.meshgrid(spacing * np.arange(_ROWS + 1), spacing * np.arange(-_ASIDE, _ASIDE + 1), indexing='ij')
    found = [np.empty((0, 2))]
    for mouth, outwards in mouths(roadmap, need):
        across = np.array([-outwards[1], outwards[0]])
        places = mouth + ahead.reshape(-1, 1) * outwards + aside.reshape(-1, 1) * across
        # Not on the other side of a wall.
        in_sight = roadmap.room_along(np.broadcast_to(mouth + spacing * outwards, places.shape), places)[0] > 0.0
        found.append(places[in_sight & (roadmap.environment.clearance(places) >= roadmap.radius + MARGIN)])
    kept = list(roadmap.places)
    for place in np.concatenate([np.empty((0, 2)), *found]):
        if np.linalg.norm(np.array(kept) - place, axis=1).min() >= _NEAR * spacing:
            kept.append(place)
    return roadmap.with_places(np.array(kept[len(roadmap.places):]).reshape(-1, 2), _REACH * spacing)


def mouths(roadmap: Roadmap, apart: float) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Return where (2,) [m] lanes end and which way (2,) leads out of them; of those not ``apart`` [m] the first."""
    ends = roadmap.places[roadmap.edges]
    shares = np.linspace(0.0, 1.0, _SAMPLES)[:, None]
    along = ends[:, :1] + shares * (ends[:, 1:] - ends[:, :1])
    lanes = roadmap.lane_at(along).reshape(len(ends), -1)
    edge, at = np.nonzero((lanes[:, 1:] > 0) != (lanes[:, :-1] > 0))
    if not len(edge):
        return []
    sign = np.where(lanes[edge, at] > 0, 1.0, -1.0)
    places = along[edge, at + (sign < 0)]
    headings = sign[:, None] * (ends[edge, 1] - ends[edge, 0])
    headings /= np.linalg.norm(headings, axis=1)[:, None]
    rooms = roadmap.environment.clearance(places)
    found = []
    # The middle of a mouth has the most room.
    for first in np.argsort(-rooms.round(3), kind='stable'):
        if all(np.linalg.norm(places[first] - place) >= apart or headings[first] @ outwards < 0.0
               for place, outwards in found):
            near = cKDTree(places).query_ball_point(places[first], apart / 2)
            outwards = headings[near][headings[near] @ headings[first] > 0.0].sum(axis=0)
            outwards = _straight(roadmap, places[first], outwards, apart)
            # An edge may also graze the border of what is narrow: behind a mouth lies its lane, and none before it.
            ahead, behind = roadmap.lane_at(places[first] + apart / 2 * np.outer((1, -1), outwards)) > 0
            if behind and not ahead:
                found.append((places[first], outwards))
    return found


def _straight(roadmap, mouth, outwards, length):
    """Return the unit vector (2,) near ``outwards`` along which there is most room, in the lane and before it."""
    angles = np.arctan2(outwards[1], outwards[0]) + np.linspace(-_SKEW, _SKEW, _SAMPLES)
    headings = np.column_stack([np.cos(angles), np.sin(angles)])
    along = mouth + np.linspace(-length, length, _SAMPLES)[:, None, None] * headings
    return headings[roadmap.environment.clearance(along).mean(axis=0).argmax()]
