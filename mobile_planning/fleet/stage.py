"""Stage: how far a robot is with its goals, for the next process that is to drive its body."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass

#: x, y, theta [m, m, rad].
Pose = tuple[float, float, float]


@dataclass(frozen=True)
class Stage:
    """The goals of a robot at one time, and what has led to this stage.

    Attributes
    ----------
    mission_start : float [s]
        Of the mission that it belongs to, on the common clock.
    goal : Pose
        At hand.
    is_reached : bool
        Whether the robot has arrived at it.
    ahead : tuple of Pose
        Goals after it.
    repeats, is_of_scene, draws : bool
        The goals come again and again; they are those of the scene; more are drawn, as the scene says.
    arrivals : tuple of (Pose, float [s])
        Goals at which the robot has arrived since the stage before, and when on its clock.

    Examples
    --------
    >>> stage = Stage(5.0, (1.0, 1.0, 0.0), False, ((2.0, 1.0, 0.0),), arrivals=(((3.0, 1.0, 0.0), 7.5),))
    >>> Stage.of(stage.as_fields()) == stage
    True
    """

    mission_start: float
    goal: Pose
    is_reached: bool
    ahead: tuple[Pose, ...] = ()
    repeats: bool = False
    is_of_scene: bool = True
    draws: bool = False
    arrivals: tuple[tuple[Pose, float], ...] = ()

    def as_fields(self) -> dict[str, object]:
        """Return it as JSON can hold it."""
        return asdict(self)

    @classmethod
    def of(cls, fields: Mapping[str, object]) -> Stage:
        """Return the stage that `as_fields` has taken apart.

        Raises
        ------
        KeyError, TypeError, ValueError
            It is none.
        """
        return cls(float(fields['mission_start']), pose(fields['goal']), bool(fields['is_reached']),
                   tuple(map(pose, fields['ahead'])), bool(fields['repeats']), bool(fields['is_of_scene']),
                   bool(fields['draws']), tuple((pose(goal), float(when)) for goal, when in fields['arrivals']))


def pose(values) -> Pose:
    """Return three numbers as a pose."""
    x, y, theta = map(float, values)
    return x, y, theta
