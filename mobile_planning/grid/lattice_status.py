"""How a path through a lattice is made: its motions, their costs and the vertices that they join."""
from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple


@dataclass(frozen=True)
class LatticeEdge:
    """A motion between two vertices of the graph.

    Attributes
    ----------
    v1, v2 : str
        Names of the vertices: the motions by which each was first reached from the root '0'.
    cost : float
    move : str
        'S', 'L' or 'R'; the small letter for backwards.
    length : float [cells]
    """

    v1: str
    v2: str
    cost: float
    move: str
    length: float

    def __repr__(self) -> str:
        return f'Edge{{[{self.v1}] -- [{self.v2}], cost={self.cost:.4g}}}'


class LatticeStatus(NamedTuple):
    """How a path through the lattice is made.

    Attributes
    ----------
    cost : float
    segments : list of str
        'S', 'L' or 'R' for each motion; the small letter for backwards.
    edges : list of LatticeEdge
    """

    cost: float
    segments: list[str]
    edges: list[LatticeEdge]
