"""The node ``robot``: one agent of a fleet, its plans and its body."""
from __future__ import annotations

from time import monotonic, time

import numpy as np
from mobile_planning_msgs.msg import RobotStatus
from nav_msgs.msg import Path
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.node import Node

from mobile_planning.fleet.agent import Agent
from mobile_planning.fleet.logbook import Logbook
from mobile_planning.fleet.message import RobotMsg
from mobile_planning.nodes import convert, qos, wire
from mobile_planning.nodes.body import make_body
from mobile_planning.nodes.diagnostics import Diagnostics
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.parameters import Parameters
from mobile_planning.nodes.robot_health import RobotHealth
from mobile_planning.nodes.robot_host import RobotHost
from mobile_planning.nodes.robot_options import RobotOptions
from mobile_planning.nodes.robot_services import RobotServices

# What the executor has heard in one turn is answered in one message: so long [s] after the first of it. What then waits
# for an answer is looked at again after this [s], as long as it may have to be said once more.
_ANSWER_AFTER, _REPEAT_AFTER = 0.001, 0.025


class RobotNode(Node):
    """Wires an `Agent` and its `Body` to the fleet's topics and to the clock.

    Parameters
    ----------
    robot_id : int, optional
        By default the parameter says.
    host : RobotHost, optional
        That several robots of one process share; by default the robot has its own.
    name : str
    **kwargs
        For ``rclpy.node.Node``.

    Attributes
    ----------
    robot_id : int
    host : RobotHost
    needs_map : bool
    """

    def __init__(self, robot_id: int | None = None, host: RobotHost | None = None, name: str = 'robot', **kwargs):
        self._own_host = self._body = self._robot_services = None
        super().__init__(name, enable_rosout=False, **kwargs)
        options = Parameters(self, RobotOptions).values
        self._frame, self._guard = options.frame_id, Guard(self)
        self.robot_id, scene = options.robot_id if robot_id is None else robot_id, options.load_scene()
        self.needs_map = scene.on_map
        try:
            spec = scene.spec(self.robot_id)
            tracker = options.tracker(spec.u_max)
            self._own_host = RobotHost(self, self._guard, options) if host is None else None
            self.host = host or self._own_host
            self._body = make_body(self, self._guard, options, self.robot_id, tracker, self._on_pose)
            self._agent = self._make_agent(scene, options)
        except BaseException:
            self.destroy_node()
            raise
        self._health = RobotHealth(self._agent, self._body, self.host.bus.peers, options)
        self._shown, self._asked_at, self._has_reported = None, np.inf, False
        self._plans = self.create_publisher(Path, '~/plan', qos.PATH)
        self._statuses = self.create_publisher(RobotStatus, '~/status', qos.live(1))
        guarded, steady, aside = self._guard.callback, Clock(clock_type=ClockType.STEADY_TIME), ReentrantCallbackGroup()
        self._robot_services = RobotServices(self, self._guard, options, self._agent, self._now,
                                             self.host.worker.submit)
        self._cycle = self.create_timer(options.Tc, guarded(self._on_cycle), callback_group=aside, clock=steady)
        self._answering = self.create_timer(_ANSWER_AFTER, guarded(self._on_answers), clock=steady)
        self._answering.cancel()
        Diagnostics(self, self._guard, self._diagnosis)
        if self._agent.method == 'contracts':
            self.host.joint_worker.submit(lambda: self._health.expect(self.host.worst_lag(tracker, spec)))
        self.host.bus.add(self)
        self.host.loop.add(self._body)

    def _make_agent(self, scene, options):
        book = Logbook(options.logbook_of(self.robot_id), lambda error: self._guard.note(error, 'logbook'))
        left = book.read()
        if left:
            self._body.leave_on(left[-1].plan)
        # The epoch is the system's time: simulated time begins anew with every simulation.
        epoch = max([int(time()), *(entry.epoch + 1 for entry in left)])
        return Agent(scene, self.robot_id, epoch, self._now(), drive=self._body.drive, book=book,
                     is_placed=options.simulate and not left, plans_kept=options.plans_kept,
                     **options.planning(scene))

    @property
    def epoch(self) -> int:
        """Boot epoch of the robot."""
        return self._agent.epoch

    def destroy_node(self) -> None:
        """End the threads, then the node."""
        if self._own_host is not None:
            self._own_host.close()
        if self._body is not None:
            self._body.close()
        if self._robot_services is not None:
            self._robot_services.close()
        super().destroy_node()

    # What the bus hears

    def on_map(self, grid):
        """Take in a map."""
        self.get_logger().info(f'map of {grid.width} x {grid.height} cells received')
        self._later(self._agent.take_map, grid, self._now())

    def on_obstacles(self, obstacles):
        """Take in what stands in the way beside the map."""
        self.get_logger().info(f'{len(obstacles)} obstacles beside the map')
        self._later(self._agent.take_obstacles, obstacles, self._now())

    def on_mission(self, announcement):
        """Take in what is announced of a mission."""
        self.get_logger().info(f'mission {announcement.name[:80]}: {announcement.state.name.lower()}')
        self._later(self._agent.follow, announcement, self._now())

    def on_deaths(self, deaths):
        """Take in certificates of death."""
        for death in deaths:
            self._agent.receive(death, self._now())

    def hear(self, message, now):
        """Take in what a robot says."""
        self._agent.receive(message, now)
        self._answer_soon()

    def _answer_soon(self, after=_ANSWER_AFTER):
        if self._answering.is_canceled() and self._agent.has_answers:
            self._answering.timer_period_ns = int(1e9 * after)
            self._answering.reset()

    def _on_pose(self, pose):
        """Take in where the body is found, before there is a plan."""
        self._later(self._place, pose)

    def _place(self, pose):
        if self._agent.robot is None:
            self._agent.place(pose, self._now())

    # What is due

    def _now(self):
        return self.host.bus.now()

    def _later(self, work, *args):
        """Let the agent do what may take a while, in turn."""
        self.host.worker.submit(self._guard.callback(work), *args)

    async def _on_cycle(self):
        # The period is set anew each time: the steady clock knows nothing of the phase of the common one.
        self._cycle.timer_period_ns = int(1e9 * self._agent.until_cycle(self._now()))
        self._cycle.reset()
        asked_for = monotonic() - self._asked_at
        if self._health.look(asked_for, self.get_logger()):
            self._statuses.publish(self._health.status(self._now(), self._frame))
        if asked_for > 0.0:
            return
        self._asked_at = monotonic()
        try:
            request = await self.host.worker.submit(self._step, self.host.bus.losses.are_any(monotonic()))
        finally:
            self._agent.note_pace(monotonic() - self._asked_at)
            self._asked_at = np.inf
        self._answer_soon()
        if request is not None:
            # A joint plan takes longer than a cycle may, and so does the way to another goal.
            plan = await self.host.joint_worker.submit(request.plan)
            self._say(await self.host.worker.submit(lambda: self._agent.propose(plan, self._now())))

    def _step(self, are_losses):
        """Plan and tell it, in the thread of the worker; return the request for a joint plan, if one is due.

        The executor may be busy: what is in force is told at once, for a process that is killed tells nothing.
        """
        messages, request = self._health.timed(self._plan)(are_losses)
        self._say(messages)
        self._show(messages)
        return request

    def _plan(self, are_losses):
        self._health.heed(self._now())
        self._agent.expect_losses(are_losses)
        return self._agent.step(self._now), self._agent.take_request()

    def _on_answers(self):
        self._answering.cancel()
        self._say(self._agent.answers(self._now()))
        self._answer_soon(_REPEAT_AFTER)

    def _say(self, messages):
        self.host.bus.say(messages, self._agent.postscript, self._agent.roster)

    def _show(self, messages):
        """Publish the plan in force to who looks, if it is new, and once it is the last what was driven."""
        agent = self._agent
        for message in messages if self._plans.get_subscription_count() else ():
            if isinstance(message, RobotMsg) and (message.boot_epoch, message.plan_seq) != self._shown:
                self._shown = message.boot_epoch, message.plan_seq
                poses = np.column_stack([message.ip_z1, message.ip_z2, np.zeros(len(message.ip_z1))])
                self._plans.publish(convert.path_message(poses, self._frame, wire.stamp(self._now())))
        if agent.is_finished and not self._has_reported:
            self.host.bus.hand_in(agent.solution, agent.epoch)
            self.get_logger().info('at the goal' if agent.robot.is_done else 'stopped on the way')
        self._has_reported = agent.is_finished

    def _diagnosis(self):
        self._statuses.publish(self._health.status(self._now(), self._frame))
        return self._health.diagnosis(self._now())
