"""Body: what moves, as the node ``robot`` sees it."""
from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from rclpy.node import Node

from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.logbook import Entry
from mobile_planning.fleet.pilot import PilotStatus
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.real_body import RealBody
from mobile_planning.nodes.robot_options import RobotOptions
from mobile_planning.nodes.simulated_body import SimulatedBody


class Body(Protocol):
    """One robot's body: its pilot, and its base, simulated or real."""

    @property
    def status(self) -> PilotStatus:
        """How the body keeps to its plan."""

    def leave_on(self, plan: Plan) -> None:
        """Take in that the processes before this one have left the body on ``plan``."""

    def drive(self, entry: Entry) -> None:
        """Drive a plan from its first knot on, whatever becomes of this process or of its planner."""

    def tick(self, period: float) -> None:
        """See `ControlLoop`."""

    def trouble(self) -> str:
        """Return what is wrong with it, in a sentence; empty for nothing."""

    def close(self) -> None:
        """Let it end its plan by itself."""


def make_body(node: Node, guard: Guard, options: RobotOptions, robot_id: int, tracker: Tracker,
              on_pose: Callable[[np.ndarray], None]) -> Body:
    """Return the body that the parameters ask for.

    Parameters
    ----------
    node : rclpy.node.Node
        That has its topics.
    guard : Guard
    options : RobotOptions
    robot_id : int
    tracker : Tracker
    on_pose : callable
        Called with the pose (3,) at which a body is found that is not where the scene says, as long as there is no
        plan to drive.
    """
    kind = SimulatedBody if options.simulate else RealBody
    return kind(node, guard, options, robot_id, tracker, on_pose)
