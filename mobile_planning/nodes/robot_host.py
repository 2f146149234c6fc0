"""RobotHost: what the robots of one process share."""
from __future__ import annotations

from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from mobile_planning.fleet.scene import RobotSpec
from mobile_planning.fleet.tracking import Tracker
from mobile_planning.fleet.tracking_budget import worst_lag
from mobile_planning.nodes.control_loop import ControlLoop
from mobile_planning.nodes.fleet_bus import FleetBus
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.memory import give_back
from mobile_planning.nodes.robot_options import RobotOptions
from mobile_planning.nodes.worker import Worker
from mobile_planning.warm_up import warm_up

#: Memory that is not needed any more is given back so often [s].
_TIDY_EVERY = 30.0


class RobotHost:
    """The fleet's topics, a thread that plans, one that plans for groups, and one that drives the bodies.

    The thread of the executor is left to listen and to answer.

    Parameters
    ----------
    node : rclpy.node.Node
        That has the topics.
    guard : Guard
    options : RobotOptions

    Attributes
    ----------
    bus : FleetBus
    worker, joint_worker : Worker
    loop : ControlLoop
    """

    def __init__(self, node: Node, guard: Guard, options: RobotOptions):
        self.bus = FleetBus(node, guard, options.frame_id)
        self.worker, self.joint_worker = Worker(node), Worker(node)
        self.loop = ControlLoop(options.control_rate, guard)
        # Loaded before somebody waits for a section: it takes as long as several cycles.
        self.worker.submit(warm_up, 'world', 'fleet')
        node.create_timer(_TIDY_EVERY, lambda: self.joint_worker.submit(give_back),
                          clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._options, self._lags = options, {}

    def worst_lag(self, tracker: Tracker, spec: RobotSpec) -> float:
        """Return how far [m] a body comes off its plans at worst, tried once for all robots that are alike."""
        key = tracker, tuple(spec.u_max), tuple(spec.a_max)
        if key not in self._lags:
            self._lags[key] = worst_lag(*key, self._options.Tc, 1.0 / self._options.control_rate)
        return self._lags[key]

    def close(self) -> None:
        """End all threads; the bodies' is the last."""
        self.worker.close()
        self.joint_worker.close()
        self.loop.close()
