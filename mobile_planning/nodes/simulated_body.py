"""SimulatedBody: a body without a base, in a thread that nothing of the planner can stop."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np
from nav_msgs.msg import Odometry
from rclpy.node import Node

from mobile_planning.fleet.base import SimulatedBase
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.logbook import Entry
from mobile_planning.fleet.pilot import Pilot, PilotStatus
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.nodes import convert_views, qos
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.robot_options import RobotOptions

#: A process that was stopped for so long [s] has missed commands.
_STOPPED = 0.5


class SimulatedBody:
    """One robot's simulated body: its pilot and its base; it outlives its process by its logbook. See `make_body`."""

    def __init__(self, node: Node, guard: Guard, options: RobotOptions, robot_id: int, tracker: Tracker,
                 on_pose: Callable[[np.ndarray], None]):
        self._clock, self._options, self._id = node.get_clock(), options, robot_id
        self._tracker, self._on_pose = tracker, on_pose
        self._frame, self._child = options.frame_id, f'{node.get_name()}/base_link'
        self._pilot: Pilot | None = None
        self._base: SimulatedBase | None = None
        self._latest, self._odometry_due, self._command = -np.inf, -np.inf, np.zeros(2)
        self._left: Plan | None = None
        self._odometry = node.create_publisher(Odometry, '~/odom', qos.live(1))

    @property
    def status(self) -> PilotStatus:
        """How the body keeps to its plan."""
        return PilotStatus() if self._pilot is None else self._pilot.status

    def leave_on(self, plan: Plan) -> None:
        """Let the body be where ``plan`` ends."""
        self._left = plan

    def drive(self, entry: Entry) -> None:
        """Drive a plan from its first knot on."""
        if self._pilot is not None:
            self._pilot.follow(entry.plan)
        else:
            self._base = SimulatedBase(entry.plan.state(self._now())[:3], self._options.base(), self._id)
            self._pilot = Pilot(self._tracker, entry.plan, most_drift=self._options.most_drift)

    def tick(self, period: float) -> None:
        """Drive on for ``period`` [s], in the thread of the `ControlLoop`."""
        pilot, now = self._pilot, self._now()
        if pilot is None:
            self._look_behind(now)
        if pilot is None or now == self._latest:
            return
        if now < self._latest - 1.0:
            pilot.reset()
        elapsed, self._latest = max(0.0, now - self._latest), now
        if elapsed <= _STOPPED:
            self._base.drive(self._command, elapsed)
        else:
            # As by the logbook: whatever stops the process, a simulated body ends its plan.
            state = pilot.reference(now)
            self._base.pose, self._base.speeds = state[:3], state[3:]
        pilot.localise(self._base.measured(), now, 3 * self._options.base_noise)
        self._command = pilot.command(now, period)
        is_due = now >= self._odometry_due or now < self._odometry_due - 10.0
        if is_due and self._odometry.get_subscription_count():
            self._odometry_due = now + 1.0 / self._options.odom_rate
            self._odometry.publish(convert_views.odometry(np.concatenate([self._base.pose, self._base.speeds]), now,
                                                          self._frame, self._child))

    def trouble(self) -> str:
        """Return nothing: it is as it was asked for."""
        return ''

    def close(self) -> None:
        """Do nothing: the logbook says how the plan ends."""

    def _now(self):
        return self._clock.now().nanoseconds * 1e-9

    def _look_behind(self, now):
        """Find the body where the process before has left it, once it rests there."""
        if self._left is not None and now >= self._left.end_knot * self._left.step:
            pose, self._left = self._left.state(now)[:3], None
            self._on_pose(pose)
