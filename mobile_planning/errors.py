"""The failures a caller may handle, each with the code that goes on the wire.

A path query fails with Nav2's ``ComputePathToPose`` numbers (201 to 208) or with
ours from 250; a map fails with Nav2's ``LoadMap`` numbers (1 to 3). Each kind is
also a child of the builtin that a caller would expect.
"""


class PlanningError(Exception):
    """A query that has no answer; ``code`` says why, the message with which value."""

    code = 200


class InvalidPlanner(PlanningError, ValueError):
    """The planner id is not one of ours."""

    code = 201


class UnknownFrame(PlanningError, ValueError):
    """The pose is in a frame that is not the map's."""

    code = 202


class StartOutside(PlanningError, ValueError):
    """The start lies outside the map."""

    code = 203


class GoalOutside(PlanningError, ValueError):
    """The goal lies outside the map."""

    code = 204


class StartOccupied(PlanningError, ValueError):
    """The start lies in an occupied cell."""

    code = 205


class GoalOccupied(PlanningError, ValueError):
    """The goal lies in an occupied cell."""

    code = 206


class PlanningTimeout(PlanningError, TimeoutError):
    """The deadline passed before a path was found."""

    code = 207


class NoPath(PlanningError, RuntimeError):
    """Start and goal are free, and no path joins them."""

    code = 208


class NoMap(PlanningError, RuntimeError):
    """No map has arrived yet."""

    code = 250


class InvalidInput(PlanningError, ValueError):
    """A pose or a number is not finite, not normalised or out of its range."""

    code = 251


class ApproximateOnly(PlanningError, RuntimeError):
    """A path ends near the goal, not at it."""

    code = 252


class Cancelled(PlanningError, RuntimeError):
    """The caller withdrew the query."""

    code = 253


class LimitExceeded(PlanningError, ValueError):
    """The query is larger than a stated limit."""

    code = 254


class NotBuilt(PlanningError, RuntimeError):
    """There is no roadmap yet."""

    code = 256


class StrategyLocked(PlanningError, RuntimeError):
    """The option cannot change while a roadmap stands that was built with it."""

    code = 257


class MapError(PlanningError):
    """A map that cannot be read or written; ``code`` is Nav2's LoadMap result."""

    code = 255


class MapNotFound(MapError, FileNotFoundError):
    """No map was named."""

    code = 1


class InvalidMapData(MapError, ValueError):
    """The image is missing, unreadable or too large."""

    code = 2


class InvalidMapMetadata(MapError, ValueError):
    """The YAML file is missing, unreadable or says something impossible."""

    code = 3
