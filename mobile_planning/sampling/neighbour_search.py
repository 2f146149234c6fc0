"""Pairs of neighbouring points, found in one of three ways that all find the same ones."""
from __future__ import annotations

from enum import Enum
from itertools import product

import numpy as np
from numpy.typing import NDArray

# Cells of the index table for each point of it, at most.
_CELLS_PER_POINT = 8


class NeighborSearchStrategy(Enum):
    """How the neighbours of a node are found."""

    BRUTE_FORCE = 0
    PARTIAL_INDEX_TABLE = 1
    KDTREE = 2


def neighbour_pairs(points: NDArray[np.float64], radius: float, strategy: NeighborSearchStrategy,
                    dimensions: int = 4, first: int = 0) -> NDArray[np.int64]:
    """Return every pair of points at most a radius apart.

    Parameters
    ----------
    points : (n, d) ndarray [m]
    radius : float [m]
    strategy : NeighborSearchStrategy
        The partial index table is a grid over those ``dimensions`` axes that have most cells (Bohlin and Kavraki 2000
        leave the search open; RobWork's planner looks it up so), the k-d tree is scipy's.
    dimensions : int
        Of the index table.
    first : int
        Pairs of two points before this one are left out.

    Returns
    -------
    (m, 2) ndarray
        Of i < j, ordered by j and then by i.

    Examples
    --------
    >>> points = np.array([[0.0, 0.0], [1.0, 0.0], [3.0, 0.0]])
    >>> neighbour_pairs(points, 2.0, NeighborSearchStrategy.KDTREE).tolist()
    [[0, 1], [1, 2]]
    """
    points = np.ascontiguousarray(points, dtype=float)
    keys = {NeighborSearchStrategy.BRUTE_FORCE: _by_comparing, NeighborSearchStrategy.KDTREE: _by_tree,
            NeighborSearchStrategy.PARTIAL_INDEX_TABLE: lambda *given: _by_table(*given, dimensions)}[strategy](
                points, radius, first)
    keys.sort()
    return np.column_stack([keys & 0xffffffff, keys >> 32])


def _by_comparing(points, radius, first):
    """Return the keys of the pairs, see `neighbour_kernels`."""
    from mobile_planning.sampling.neighbour_kernels import compared_pairs

    return compared_pairs(points, radius, first)


def _by_tree(points, radius, first):
    """Return the keys of the pairs."""
    from scipy.spatial import cKDTree

    if not first < len(points):
        return np.empty(0, np.int64)
    tree = cKDTree(points)
    if first == 0:
        pairs = tree.query_pairs(radius, output_type='ndarray').astype(np.int64)
        return pairs[:, 1] << 32 | pairs[:, 0]
    found = cKDTree(points[first:]).sparse_distance_matrix(tree, radius, output_type='ndarray')
    later, earlier = found['i'].astype(np.int64) + first, found['j'].astype(np.int64)
    return (later << 32 | earlier)[earlier < later]


def _by_table(points, radius, first, dimensions):
    """Return the keys of the pairs."""
    from mobile_planning.sampling.neighbour_kernels import indexed_pairs

    if not len(points):
        return np.empty(0, np.int64)
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    # No cell is narrower than the radius, so that neighbours are in cells that touch.
    fitting = np.floor(np.divide(extent, radius, out=np.ones_like(extent), where=extent > radius))
    axes = np.sort(np.argsort(-fitting, kind='stable')[:dimensions])
    most = max(1, int((_CELLS_PER_POINT * len(points)) ** (1 / len(axes))))
    sizes = np.clip(fitting[axes], 1, most).astype(np.int64)
    width = np.where(extent[axes] > 0, extent[axes], 1.0) / sizes
    # The greatest coordinate lies on the far border of the last cell and belongs to it.
    cells = np.minimum(((points[:, axes] - low[axes]) / width).astype(np.int64), sizes - 1)
    flat = np.ravel_multi_index(tuple(cells.T), tuple(sizes))
    begins = np.concatenate([[0], np.cumsum(np.bincount(flat, minlength=int(np.prod(sizes))))])
    # An axis of one cell has no other to look into.
    offsets = np.array(list(product(*((-1, 0, 1) if size > 1 else (0,) for size in sizes))), np.int64)
    return indexed_pairs(points, radius, first, np.ascontiguousarray(cells), offsets, sizes, begins.astype(np.int64),
                         np.argsort(flat, kind='stable').astype(np.int64))
