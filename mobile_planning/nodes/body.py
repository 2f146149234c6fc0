"""Body: what moves, as the node ``robot`` drives it, in a thread that nothing of the planner can stop."""
from __future__ import annotations

import threading
from collections.abc import Callable
from time import monotonic

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node

from mobile_planning.fleet.base import SimulatedBase
from mobile_planning.fleet.logbook import Entry, Logbook
from mobile_planning.fleet.pilot import Pilot, PilotStatus
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.nodes import convert_views, qos
from mobile_planning.nodes.convert import seconds
from mobile_planning.nodes.convert_pose import command_message, localisation_error, localised
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.odometry import MapOdometry
from mobile_planning.nodes.robot_options import RobotOptions

#: A process that was stopped for so long [s] has missed commands.
_STOPPED = 0.5


class Body:
    """One robot's body: its pilot, and its base, simulated or real.

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

    def __init__(self, node: Node, guard: Guard, options: RobotOptions, robot_id: int, tracker: Tracker,
                 on_pose: Callable[[np.ndarray], None]):
        self._clock, self._guard, self._options, self._id = node.get_clock(), guard, options, robot_id
        self._tracker, self._on_pose = tracker, on_pose
        self._frame, self._child = options.frame_id, f'{node.get_name()}/base_link'
        self._pilot: Pilot | None = None
        self._base: SimulatedBase | None = None
        self._latest, self._odometry_due, self._command = -np.inf, -np.inf, np.zeros(2)
        self._left: tuple[Entry, ...] = ()
        self._book = Logbook(options.logbook.replace('{id}', str(robot_id))) if options.logbook else None
        if options.simulate:
            self._odometry = node.create_publisher(Odometry, '~/odom', qos.live(1))
        elif options.localisation == 'tf':
            self._commands = node.create_publisher(TwistStamped, '~/cmd_vel', qos.live(1))
            MapOdometry(node, guard, options.frame_id, self.localise)
        else:
            self._commands = node.create_publisher(TwistStamped, '~/cmd_vel', qos.live(1))
            node.create_subscription(PoseWithCovarianceStamped, '~/pose', guard.callback(self._on_pose_message),
                                     qos.live(1))

    @property
    def status(self) -> PilotStatus:
        """How the body keeps to its plan."""
        return PilotStatus() if self._pilot is None else self._pilot.status

    def left_behind(self) -> tuple[Entry, ...]:
        """Return what the processes before this one have driven, on whose last plan they have left a simulated body."""
        if self._book is not None and self._options.simulate:
            self._left = self._book.read()
        return self._left

    def drive(self, entry: Entry) -> None:
        """Drive a plan from its first knot on, whether it can be written down or not."""
        if self._pilot is not None:
            self._pilot.follow(entry.plan)
        else:
            self._begin(entry.plan)
        if self._book is not None:
            try:
                self._book.write(entry)
            except OSError as error:
                self._book = None
                self._guard.note(error, 'drive')

    def _begin(self, plan):
        if self._options.simulate:
            self._base = SimulatedBase(plan.state(self._now())[:3], self._options.base(), self._id)
        self._pilot = Pilot(self._tracker, plan, most_drift=max(self._options.tracking_margin, 1e-3))

    def localise(self, pose: np.ndarray, time: float, error: float) -> None:
        """Take in where a real body was at ``time`` [s], by up to ``error`` [m]."""
        if self._pilot is None:
            self._on_pose(pose)
        else:
            self._pilot.localise(pose, time, error)

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
        if self._base is None:
            self._commands.publish(command_message(pilot.command(now, period), now, self._child))
            return
        if elapsed <= _STOPPED:
            self._base.drive(self._command, elapsed)
        else:
            # As by the logbook: whatever stops the process, a simulated body ends its plan.
            state = pilot.reference(now)
            self._base.pose, self._base.speeds = state[:3], state[3:]
        pilot.localise(self._base.measured(), now, 3 * self._options.base_noise)
        self._command = pilot.command(now, period)
        if now >= self._odometry_due or now < self._odometry_due - 10.0:
            self._odometry_due = now + 1.0 / self._options.odom_rate
            self._odometry.publish(convert_views.odometry(np.concatenate([self._base.pose, self._base.speeds]), now,
                                                          self._frame, self._child))

    def _now(self):
        return self._clock.now().nanoseconds * 1e-9

    def _look_behind(self, now):
        """Find the body where the process before has left it, once it rests there."""
        if self._left and now >= self._left[-1].plan.end_knot * self._left[-1].plan.step:
            pose, self._left = self._left[-1].plan.state(now)[:3], ()
            self._on_pose(pose)

    def _on_pose_message(self, message):
        self.localise(localised(message, self._frame), seconds(message.header.stamp),
                      localisation_error(message.pose.covariance))


class ControlLoop:
    """Drives the bodies of a process at one rate, in a thread of its own.

    Parameters
    ----------
    rate : float [Hz]
    guard : Guard
    """

    def __init__(self, rate: float, guard: Guard):
        self._period, self._guard, self._bodies = 1.0 / rate, guard, ()
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._drive, name='control loop', daemon=True)
        self._thread.start()

    def add(self, body: Body) -> None:
        """Drive one more body."""
        self._bodies = (*self._bodies, body)

    def close(self) -> None:
        """Let the thread end."""
        self._is_over.set()
        self._thread.join(1.0)

    def _drive(self):
        due = monotonic()
        while not self._is_over.wait(max(0.0, due - monotonic())):
            # What was missed is not made up for.
            due = max(due + self._period, monotonic())
            for body in self._bodies:
                try:
                    body.tick(self._period)
                except Exception as error:
                    self._guard.note(error, 'tick')
