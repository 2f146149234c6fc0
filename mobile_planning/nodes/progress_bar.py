"""A bar on stderr that shows how far the plan for one request is."""
from __future__ import annotations

import sys

from mobile_planning_msgs.msg import PlanProgress
from mobile_planning_msgs.srv import PlanPath

from mobile_planning.grid.observer import bar
from mobile_planning.nodes.convert import seconds


class ProgressBar:
    """Draws what a planner node tells while a plan takes long; its ``with`` block leaves the line.

    Parameters
    ----------
    request : PlanPath.Request
        Plans to other goals are not shown.
    is_wanted : bool
        If not, nothing is drawn.
    """

    def __init__(self, request: PlanPath.Request, is_wanted: bool):
        self._goal, self._is_wanted, self._is_begun = request.goal.pose.position, is_wanted, False

    def __enter__(self) -> ProgressBar:
        return self

    def __exit__(self, *_) -> None:
        if self._is_begun:
            print(file=sys.stderr)

    def show(self, message: PlanProgress) -> None:
        """Draw how far the plan is."""
        if not self._is_wanted or (message.goal.position.x, message.goal.position.y) != (self._goal.x, self._goal.y):
            return
        self._is_begun = True
        print(f'\r{message.planner} {bar(message.share)} {seconds(message.elapsed):.1f} s', end='', file=sys.stderr,
              flush=True)
