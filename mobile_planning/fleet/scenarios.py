"""Scenarios: families of missions, each drawn by a seed.

============ ==========================================================================================
family       what it is, and what can be asked for beside the number of ``robots``
============ ==========================================================================================
heritage     two robots and three circles, the script of the first receding-horizon planner; nothing
swap         on a circle, everybody to the opposite place; ``jitter`` of the starts, ``radius`` [m]
line_swap    two rows change places; the number is even
forest       trips between 20 round obstacles
doorway      a room divided by a wall with one door, which everybody must pass; ``gap`` [m]
corridor     two rooms joined by a corridor, which everybody must pass; ``width`` [m]
intersection two streets that cross, everybody leaves by another arm than the one he came by
maze         3 x 3 rooms whose doors make a random tree: one way only from each room to each other
rooms        3 x 3 rooms whose doors make always the same tree
pockets      two rooms joined by a lane with three dead ends, behind a trap at each mouth
warehouse    trips between two columns of four shelves; ``aisle`` between them [m]
depot        trips on the depot's map
hall         on a circle anywhere on the depot's map, everybody to the opposite place
============ ==========================================================================================

Robots have a radius of 0.2 m, drive at most 1 m/s with 2 m/s^2, turn at most 5 rad/s, and look along the line to
their goals (heritage: along y). Starts are free with room to spare, apart from each other and joined by free ways
to the goals; so are the goals.
"""
from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from mobile_planning.errors import InvalidInput
from mobile_planning.fleet import families as worlds
from mobile_planning.fleet.scene import MAX_ROBOTS, Scene, is_number

if TYPE_CHECKING:
    from mobile_planning.fleet.world_sim import WorldSim


def make(name: str, seed: int = 0, **parameters: float) -> WorldSim:
    """Return a mission of the family ``name``, ready to run.

    Parameters
    ----------
    name : str
        One of ``families()``.
    seed : int
    **parameters
        Of the family, by the names of ``parameters(name)``.

    Raises
    ------
    InvalidInput
        There is no such family or parameter, a number is out of its range, or the robots have no room.

    Examples
    --------
    >>> sorted(make('swap', seed=1, robots=4).robots)
    [1, 2, 3, 4]
    """
    return scene(name, seed, **parameters).world_sim()


def scene(name: str, seed: int = 0, **parameters: float) -> Scene:
    """Return the scene that ``make`` makes its mission of; arguments and errors are the same."""
    family = _family(name)
    values = {key: parameter.default for key, parameter in family.parameters.items()}
    for key, value in parameters.items():
        if key not in values:
            raise InvalidInput(f'{name} has the parameters {", ".join(values) or "(none)"}, not {key}')
        values[key] = family.parameters[key].checked(key, value)
    return family.draw(name, _generator(seed), **values)


def random_scene(name: str, seed: int = 0, robots: int = 6, **world) -> Scene:
    """Return a scene of random missions in the world that the fields ``world`` of ``Scene`` describe.

    Starts keep 1 m from starts, and goals from goals; trips are 6 m or more where the world allows.

    Raises
    ------
    InvalidInput
        A number is out of its range, the world has no extent, or the robots have no room.
    """
    robots = _FAMILIES['depot'].parameters['robots'].checked('robots', robots)
    return worlds.random_missions(name, _generator(seed), robots, **world)


def families() -> tuple[str, ...]:
    """Return the names of all families."""
    return tuple(_FAMILIES)


def parameters(name: str) -> dict[str, tuple[float, float]]:
    """Return the least and the greatest value of each parameter of the family ``name``.

    Raises
    ------
    InvalidInput
        There is no such family.
    """
    return {key: (parameter.least, parameter.most) for key, parameter in _family(name).parameters.items()}


class _Parameter(NamedTuple):
    """What a number of a family may be: a whole one where its bounds are whole."""

    default: float | None
    least: float
    most: float

    def checked(self, key, value):
        is_whole = isinstance(self.least, int)
        if (not is_number(value) or (is_whole and not isinstance(value, Integral))
                or not self.least <= value <= self.most):
            raise InvalidInput(f'{key} is {value!r}, not a {"whole " if is_whole else ""}number '
                               f'in {self.least}..{self.most}')
        return type(self.least)(value)


@dataclass(frozen=True, eq=False)
class _Family:
    draw: Callable[..., Scene]
    parameters: Mapping[str, _Parameter]


_FAMILIES = {
    'heritage': _Family(worlds.heritage, {}),
    # Without a radius the circle grows with the robots on it.
    'swap': _Family(worlds.swap, {'robots': _Parameter(8, 1, MAX_ROBOTS), 'jitter': _Parameter(0.15, 0.0, 1.0),
                                  'radius': _Parameter(None, 0.3, 100.0)}),
    'line_swap': _Family(worlds.line_swap, {'robots': _Parameter(8, 2, 32)}),
    'forest': _Family(worlds.forest, {'robots': _Parameter(8, 1, 24)}),
    'doorway': _Family(worlds.doorway, {'robots': _Parameter(4, 1, 12), 'gap': _Parameter(0.9, 0.6, 5.0)}),
    'corridor': _Family(worlds.corridor, {'robots': _Parameter(2, 1, 8), 'width': _Parameter(0.9, 0.6, 3.0)}),
    'intersection': _Family(worlds.intersection, {'robots': _Parameter(4, 1, 16)}),
    'maze': _Family(worlds.maze, {'robots': _Parameter(6, 1, 12)}),
    'rooms': _Family(worlds.rooms, {'robots': _Parameter(6, 1, 12)}),
    'pockets': _Family(worlds.pockets, {'robots': _Parameter(4, 1, 8)}),
    'warehouse': _Family(worlds.warehouse, {'robots': _Parameter(6, 1, 32), 'aisle': _Parameter(1.3, 0.8, 3.0)}),
    'depot': _Family(worlds.depot, {'robots': _Parameter(6, 1, MAX_ROBOTS)}),
    'hall': _Family(worlds.hall, {'robots': _Parameter(10, 1, 16)}),
}


def _family(name):
    if not isinstance(name, str) or name not in _FAMILIES:
        raise InvalidInput(f'scenario is {name!r}, none of {", ".join(_FAMILIES)}')
    return _FAMILIES[name]


def _generator(seed):
    if not isinstance(seed, Integral) or isinstance(seed, bool) or seed < 0:
        raise InvalidInput(f'seed is {seed!r}, not a whole number from 0 on')
    return np.random.default_rng(int(seed))
