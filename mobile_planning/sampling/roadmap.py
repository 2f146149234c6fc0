"""A roadmap: nodes, the edges between them, and what is known of both."""
from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

# Middles of blocked edges that are remembered, the places where a roadmap is difficult.
_MOST_DIFFICULT = 10_000


@dataclass(frozen=True, eq=False)
class Roadmap:
    """Nodes and edges, which never change; what is known of them grows with the queries.

    Attributes
    ----------
    points : (n, d) ndarray
        The nodes.
    edges : (m, 2) ndarray of int64
        Each from a node to a node; if the way back is as free as the way there, each pair once, the lower node first.
    lengths : (m,) ndarray [m]
        Of the edges.
    radius : float [m]
        The longest edge there may be.
    is_directed : bool
    node_states, edge_states : ndarray of uint8
        What is known of each: `UNKNOWN`, `FREE` or `BLOCKED` of `roadmap_kernels`.
    difficult : (k, d) ndarray
        Middles of edges that were found blocked when the roadmap was built.
    """

    points: NDArray[np.float64]
    edges: NDArray[np.int64]
    lengths: NDArray[np.float64]
    radius: float
    is_directed: bool
    node_states: NDArray[np.uint8]
    edge_states: NDArray[np.uint8]
    difficult: NDArray[np.float64]

    @classmethod
    def empty(cls, dimensions: int, radius: float, is_directed: bool) -> Roadmap:
        """Return a roadmap without nodes."""
        return cls(np.empty((0, dimensions)), np.empty((0, 2), np.int64), np.empty(0), radius, is_directed,
                   np.empty(0, np.uint8), np.empty(0, np.uint8), np.empty((0, dimensions)))

    def extended(self, points: NDArray[np.float64], edges: NDArray[np.int64], lengths: NDArray[np.float64],
                 node_state: int, edge_state: int, difficult: NDArray[np.float64]) -> Roadmap:
        """Return the roadmap with more nodes and edges, of which all is known that is told.

        What is learnt of the new one is not known to the old one.
        """
        return replace(
            self, points=_fixed(np.concatenate([self.points, points])),
            edges=_fixed(np.concatenate([self.edges, edges])),
            lengths=_fixed(np.concatenate([self.lengths, lengths])),
            node_states=np.concatenate([self.node_states, np.full(len(points), node_state, np.uint8)]),
            edge_states=np.concatenate([self.edge_states, np.full(len(edges), edge_state, np.uint8)]),
            difficult=np.concatenate([self.difficult, difficult])[-_MOST_DIFFICULT:])

    @cached_property
    def arcs(self) -> tuple[NDArray, NDArray, NDArray, NDArray]:
        """Where the arcs out of each node begin, and the tail, head and edge of each arc."""
        from mobile_planning.sampling.roadmap_kernels import adjacency

        return adjacency(self.edges, len(self.points), self.is_directed)


def _fixed(array):
    array.flags.writeable = False
    return array
