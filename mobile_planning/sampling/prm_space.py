"""Which space a roadmap planner plans in."""
from __future__ import annotations

from mobile_planning.errors import InvalidInput
from mobile_planning.sampling.prm_options import PRMOptions
from mobile_planning.sampling.spaces import ConstrainedSpace, Space
from mobile_planning.sampling.spaces_environment import CarSpace, PlaneSpace
from mobile_planning.world.environment import Environment


def space_of(environment: Environment | Space, options: PRMOptions) -> Space:
    """Return the space that a planner with these options plans in.

    Raises
    ------
    InvalidInput
        If the environment has no bounds, or an option does not suit the space.
    """
    if isinstance(environment, Environment):
        space = (PlaneSpace(environment) if options.turning_radius is None
                 else CarSpace(environment, options.turning_radius, options.steering))
    elif options.turning_radius is not None:
        raise InvalidInput('a turning radius goes with an Environment, not with a space')
    else:
        space = environment
    check_dimensions(options, space)
    if options.constraint is None:
        return space
    return ConstrainedSpace(space, options.constraint, options.resolution)


def check_dimensions(options: PRMOptions, space: Space) -> None:
    """Refuse more axes of the index table than the space has."""
    if (options.partial_index_dimensions or 1) > len(space.low):
        raise InvalidInput(f'partial_index_dimensions {options.partial_index_dimensions} is above the '
                           f'{len(space.low)} of the space')
