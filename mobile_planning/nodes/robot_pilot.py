"""The pilot of a real base: a process of its own, so that a committed plan is driven whatever becomes of the planner.

Started by the node ``robot``, which hands it its plans over a `PilotLink`. Others count on a plan to its end: a body
that stops half-way lies where they may be about to pass. So when the robot is gone, or this process is told to end,
the newest plan is still driven to its end.
"""
from __future__ import annotations

import gc
import socket
import sys
import threading
from time import monotonic

import numpy as np
import rclpy
from geometry_msgs.msg import TwistStamped
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions

from mobile_planning.errors import PlanningError
from mobile_planning.fleet.bspline import Plan
from mobile_planning.fleet.pilot import Pilot, PilotStatus
from mobile_planning.fleet.pilot_link import PilotLink, PilotNews, PilotTask
from mobile_planning.fleet.seat import Seat
from mobile_planning.nodes import qos
from mobile_planning.nodes.control_loop import ControlLoop
from mobile_planning.nodes.convert_pose import command_message
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.odometry import MapOdometry, MapPose
from mobile_planning.nodes.reach import require_reach
from mobile_planning.nodes.spin import spin_until
from mobile_planning.nodes.stop_signals import StopSignals

#: After the end of the last plan the body is brought to rest for so long [s].
_SETTLING = 0.5
#: A body that does not come to the end of its plan, and a clock that stands still, are not waited for longer [s].
_PATIENCE = 10.0


class RobotPilot(Node):
    """Drives one base.

    Parameters
    ----------
    task : PilotTask
    link : PilotLink
        To the robot.
    """

    def __init__(self, task: PilotTask, link: PilotLink):
        remaps = [part for topic in task.topics.items() for part in ('-r', ':='.join(topic))]
        super().__init__(f'{task.name}_pilot', namespace=task.namespace, enable_rosout=False,
                         start_parameter_services=False, use_global_arguments=False,
                         cli_args=['--ros-args', *remaps],
                         parameter_overrides=[Parameter('use_sim_time', value=task.uses_sim_time)])
        self._task, self._link, self._guard = task, link, Guard(self)
        self._seat, self._found = Seat(f'{task.domain} {task.namespace} {task.name}'), None
        self._pilot: Pilot | None = None
        self._plan: Plan | None = None
        self._place: np.ndarray | None = None
        self._latest, self._left_at = -np.inf, np.inf
        self._commands = self.create_publisher(TwistStamped, '~/cmd_vel', qos.live(1))
        source = MapOdometry if task.localisation == 'tf' else MapPose
        source(self, self._guard, task.frame, self._localise)
        # Loaded before somebody waits for a command.
        Plan.at_rest(0, 1.0, (0.0, 0.0, 0.0)).state(0.0)
        threading.Thread(target=self._listen, name='plans', daemon=True).start()
        self._loop = ControlLoop(task.rate, self._guard)
        self._loop.add(self)

    def leave(self) -> None:
        """Take no plans any more, and end with the one at hand."""
        self._left_at = min(self._left_at, monotonic())

    @property
    def is_leaving(self) -> bool:
        """Whether no plans are taken any more."""
        return self._left_at < np.inf

    @property
    def is_over(self) -> bool:
        """Whether the last plan is driven to its end; to be asked once the pilot is leaving."""
        plan, waited = self._plan, monotonic() - self._left_at
        if plan is None:
            return True
        end, length = plan.end_knot * plan.step, (len(plan.points) - 3) * plan.step
        is_there = self._place is not None and np.linalg.norm(self._place[:2] - plan.end) <= self._task.most_drift
        return is_there and self._now() >= end + _SETTLING or waited > length + _PATIENCE

    def close(self) -> None:
        """Let the base stand."""
        self._loop.close()
        if self._pilot is not None:
            self._commands.publish(command_message((0.0, 0.0), self._now(), self._task.child_frame))
            self._commands.wait_for_all_acked(Duration(seconds=0.5))
        self.destroy_node()

    def tick(self, period: float) -> None:
        """Drive on for ``period`` [s], in the thread of the `ControlLoop`."""
        pilot, now, has_seat = self._pilot, self._now(), self._seat.take()
        if pilot is not None and has_seat and now != self._latest:
            if now < self._latest - 1.0:
                pilot.reset()
            self._latest = now
            self._commands.publish(command_message(pilot.command(now, period), now, self._task.child_frame))
        status = PilotStatus() if pilot is None else pilot.status
        try:
            self._link.send(PilotNews(status, self._found, dict(self._guard.rejected), self._guard.faults,
                                      self._guard.newest))
        except OSError:
            pass  # the robot is dead or frozen: the plan is driven all the same

    def _now(self):
        return self.get_clock().now().nanoseconds * 1e-9

    def _listen(self):
        for entry in iter(self._link.receive, None):
            if self._pilot is None:
                self._pilot = Pilot(self._task.tracker, entry.plan, most_drift=self._task.most_drift)
            else:
                self._pilot.follow(entry.plan)
            self._plan = entry.plan
        self.leave()

    def _localise(self, pose, time, error):
        self._place = pose
        if self._pilot is not None:
            self._pilot.localise(pose, time, error)
        elif self._seat.take():
            # As long as another process drives the base it does not rest where it is.
            self._found = tuple(map(float, pose))


def main(link: PilotLink) -> int:
    """Drive a base until nobody says where to any more, and return the exit code."""
    task = link.receive()
    if task is None:
        return 0
    with StopSignals() as stop:
        args = ['--ros-args', '--enclave', task.enclave] if task.enclave else []
        rclpy.init(args=args, domain_id=task.domain, signal_handler_options=SignalHandlerOptions.NO)
        executor, pilot = SingleThreadedExecutor(), RobotPilot(task, link)
        try:
            require_reach()
            executor.add_node(pilot)
            gc.collect()
            gc.freeze()
            spin_until(executor, lambda: stop.received is not None or pilot.is_leaving)
            pilot.leave()
            spin_until(executor, lambda: pilot.is_over)
            return 0
        except PlanningError as error:
            print(f'{pilot.get_name()}: {error}', file=sys.stderr)
            return 2
        finally:
            pilot.close()
            executor.shutdown()
            rclpy.try_shutdown()


if __name__ == '__main__':
    sys.exit(main(PilotLink(socket.socket(fileno=int(sys.argv[-1])))))
