"""Roadmaps as files: numpy's npz, checked when they are read."""
from __future__ import annotations

import os
import zipfile
from pathlib import Path

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.sampling.roadmap import Roadmap
from mobile_planning.sampling.spaces import Space

FORMAT = 1
_FIELDS = {'format': 0, 'kind': 0, 'seed': 0, 'radius': 0, 'points': 2, 'edges': 2}


def save_roadmap(path: str | Path, roadmap: Roadmap, space: Space, seed: int) -> None:
    """Write nodes, edges and radius to a file; what is known of them is not written, for obstacles may move.

    Raises
    ------
    OSError
        If it cannot be written; a file that was there stays.
    """
    path = Path(path)
    unfinished = path.with_name(f'.{path.name}.{os.getpid()}')
    try:
        with open(unfinished, 'wb') as file:
            np.savez(file, format=FORMAT, kind=space.kind, seed=seed, radius=roadmap.radius, points=roadmap.points,
                     edges=roadmap.edges.astype(np.int32))
        os.replace(unfinished, path)
    finally:
        unfinished.unlink(missing_ok=True)


def load_roadmap(path: str | Path, space: Space) -> tuple[Roadmap, int]:
    """Return the roadmap of a file, of which nothing is known yet, and the seed it was built with.

    Raises
    ------
    OSError
        If it cannot be read.
    InvalidInput
        If it is no roadmap, or one for another space.
    """
    try:
        # Stored as they are, the arrays are no larger than the file says.
        with zipfile.ZipFile(path) as archive:
            if any(member.compress_type != zipfile.ZIP_STORED for member in archive.infolist()):
                raise InvalidInput(f'{path} is compressed: a roadmap is stored as it is')
        with np.load(path, allow_pickle=False) as file:
            values = {name: file[name] for name in _FIELDS}
    except (InvalidInput, OSError):
        raise
    except Exception as error:  # a damaged archive fails in a dozen ways, from struct's to tokenize's
        raise InvalidInput(f'{path} is no roadmap: {type(error).__name__}: {error}') from None
    for name, axes in _FIELDS.items():
        if values[name].ndim != axes:
            raise InvalidInput(f'{path}: {name} has {values[name].ndim} axes, not {axes}')
    if values['format'].dtype.kind not in 'iu' or values['format'] != FORMAT:
        raise InvalidInput(f'{path}: format {values["format"]} is not {FORMAT}')
    if str(values['kind']) != space.kind:
        raise InvalidInput(f'{path} is for {str(values["kind"])[:100]!r}, not for {space.kind!r}')
    return _roadmap(path, space, values), int(values['seed'])


def _roadmap(path, space, values):
    """Return the roadmap, if its numbers make one."""
    points, edges, radius, seed = (values[name] for name in ('points', 'edges', 'radius', 'seed'))
    if points.dtype != float or points.shape[1] != len(space.low) or not np.isfinite(points).all():
        raise InvalidInput(f'{path}: points {points.shape} of {points.dtype} are not (n, {len(space.low)}) '
                           'finite numbers')
    outside = ((points < space.low) | (points > space.high)).any(axis=1)
    if outside.any():
        raise InvalidInput(f'{path}: {outside.sum()} of {len(points)} points are outside the bounds, '
                           f'the first at {points[outside][0].tolist()}')
    if edges.dtype.kind != 'i' or edges.shape[1] != 2 or seed.dtype.kind != 'i':
        raise InvalidInput(f'{path}: edges {edges.shape} of {edges.dtype} are not pairs of whole numbers')
    edges = edges.astype(np.int64)
    if len(edges) and not (0 <= edges.min() and edges.max() < len(points)):
        raise InvalidInput(f'{path}: an edge joins nodes {edges.min()} to {edges.max()} of {len(points)}')
    if (edges[:, 0] >= edges[:, 1]).any() and not space.is_directed or (edges[:, 0] == edges[:, 1]).any():
        raise InvalidInput(f'{path}: an edge does not lead from a node to a later one')
    if len(np.unique(edges[:, 0] << 32 | edges[:, 1])) < len(edges):
        raise InvalidInput(f'{path}: an edge is there twice')
    if radius.dtype != float or not 0 < radius < np.inf:
        raise InvalidInput(f'{path}: the radius of {radius} m is not a finite number above 0')
    lengths = space.lengths(*points[edges.T])
    if (lengths > radius * (1 + 1e-9)).any():
        raise InvalidInput(f'{path}: an edge is {lengths.max():g} m long, the radius {float(radius):g} m')
    empty = Roadmap.empty(len(space.low), float(radius), space.is_directed)
    return empty.extended(points, edges, lengths, 0, 0, empty.points)
