"""What paths are planned on: a map, its frame, the masks over it, and the options."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Protocol

from mobile_planning.errors import NoMap
from mobile_planning.nodes.convert import check_frame
from mobile_planning.path_server import PathServer
from mobile_planning.world.occupancy_grid import OccupancyGrid


class PlanningOptions(Protocol):
    """Options of a node that plans."""

    def path_server(self) -> PathServer:
        """Return a path server with these options, without a map."""


@dataclass(frozen=True, eq=False)
class PlanningBasis:
    """All that belongs together when a path is planned; a change makes another one.

    Attributes
    ----------
    options : PlanningOptions
    grid : OccupancyGrid or None
        The map, if one has come.
    frame : str
        Of the map.
    masks : mapping of str to (OccupancyGrid, str) or None
        Those without which nothing is planned, by name, with their frames as far as they have come.
    """

    options: PlanningOptions
    grid: OccupancyGrid | None = None
    frame: str = ''
    masks: Mapping[str, tuple[OccupancyGrid, str] | None] = ()

    @classmethod
    def without_map(cls, options: PlanningOptions, masks: Iterable[str] = ()) -> PlanningBasis:
        """Return the basis before anything has come.

        Parameters
        ----------
        options : PlanningOptions
        masks : iterable of str
            Names of those that must come: keepout, speed.
        """
        return cls(options, masks=dict.fromkeys(masks))

    def with_options(self, options: PlanningOptions) -> PlanningBasis:
        """Return the basis with other options."""
        return replace(self, options=options)

    def with_map(self, grid: OccupancyGrid, frame: str) -> PlanningBasis:
        """Return the basis with another map."""
        return replace(self, grid=grid, frame=frame)

    def with_mask(self, name: str, grid: OccupancyGrid, frame: str) -> PlanningBasis:
        """Return the basis with another mask, see `PathServer.set_map`."""
        return replace(self, masks={**self.masks, name: (grid, frame)})

    def require_map(self) -> OccupancyGrid:
        """Return the map, or raise NoMap."""
        if self.grid is None:
            raise NoMap('no map has come yet')
        return self.grid

    def mask_grids(self) -> dict[str, OccupancyGrid]:
        """Return the masks by name, or raise if one has not come or lies in another frame than the map."""
        for name, mask in self.masks.items():
            if mask is None:
                raise NoMap(f'no {name} mask has come yet')
            check_frame(mask[1], self.frame, f'the {name} mask')
        return {name: grid for name, (grid, _) in self.masks.items()}
