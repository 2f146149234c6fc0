"""The node ``world_sim``: starts a mission, watches over it, gathers its solutions, judges, draws and reports them."""
from __future__ import annotations

from time import monotonic

from mobile_planning_msgs.msg import Contracts as ContractsMessage
from mobile_planning_msgs.msg import Deaths, MissionReport
from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from visualization_msgs.msg import MarkerArray

from mobile_planning.drawing.missions import COLOURS
from mobile_planning.fleet.announcement import State
from mobile_planning.fleet.mission import Mission
from mobile_planning.fleet.peers import PeerTable
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.fleet.watch import Watch
from mobile_planning.fleet.world_sim import require_apart
from mobile_planning.nodes import convert_contracts, convert_mission, convert_robot, convert_views, qos
from mobile_planning.nodes.convert import seconds
from mobile_planning.nodes.diagnostics import Diagnostics, Level
from mobile_planning.nodes.fleet_bus import process_of
from mobile_planning.nodes.guard import Guard
from mobile_planning.nodes.mission_services import MissionServices
from mobile_planning.nodes.parameters import Parameters
from mobile_planning.nodes.world_sim_options import WorldSimOptions
from mobile_planning.outcome import write_outcome

# The node's last words wait so long for those who listen.
_FAREWELL = Duration(seconds=1.0)
# Before it announces anything it listens for so long [s].
_LISTEN = 0.3


class WorldSimNode(Node):
    """Wires a `Mission` and a `Watch` to the topics; ends by itself with 0 for a valid mission, else with 1."""

    def __init__(self, **kwargs):
        super().__init__('world_sim', **kwargs)
        self._options, self._guard = Parameters(self, WorldSimOptions).values, Guard(self)
        self._scene = load_scene(self._options.scene, self._options.scene_robots or None)
        require_apart(self._scene.bodies())
        self._frame, ids = self._options.frame_id, [spec.id for spec in self._scene.robots]
        self._mission = Mission(self._scene.name, ids, self._scene.timeout, self._options.discovery_timeout,
                                autostart=self._options.autostart, now=monotonic())
        self._watch = Watch({spec.id: spec.radius for spec in self._scene.robots})
        self._peers, self._announced, self._alarms, self._born = PeerTable(), None, 0, monotonic()
        self._missions = self.create_publisher(MissionMessage, '/mission', qos.MISSION)
        self._deaths = self.create_publisher(Deaths, '/deaths', qos.latched())
        self._reports = self.create_publisher(MissionReport, '~/report', qos.latched())
        self._markers = self.create_publisher(MarkerArray, '~/markers', qos.live(1))
        guarded, to_miss_nobody = self._guard.callback, qos.robot_messages(4 * len(ids))
        self.create_subscription(RobotMessage, '/robot_msgs', guarded(self._on_robot_message), to_miss_nobody)
        self.create_subscription(ContractsMessage, '/contracts', guarded(self._on_contracts), to_miss_nobody)
        self.create_subscription(SolutionMessage, '/solutions', guarded(self._on_solution), qos.SOLUTION_READER)
        MissionServices(self, self._guard, self._mission, self._now, self._announce, self._certify)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._tick = self.create_timer(0.1, guarded(self._on_tick), clock=steady)
        self.create_timer(0.5, guarded(self._on_markers), clock=steady)
        self.create_timer(1.0, guarded(self._certify), clock=steady)
        Diagnostics(self, self._guard, self._diagnosis)

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _announce(self):
        """Tell the robots what is new."""
        news = self._mission.announcement
        if news != self._announced:
            self._announced = news
            self._missions.publish(convert_mission.mission_message(news, self._now()))
            self.get_logger().info(f'mission {news.name} with robots {list(news.robot_ids)}: {news.state.name.lower()}')

    def _admit(self, message, info):
        """Let in what is to be listened to; return when it was said [s]."""
        stamp = seconds(message.header.stamp)
        self._peers.admit(message.robot_id, message.boot_epoch, process_of(info), stamp=stamp, time=self._now(),
                          now=monotonic())
        return stamp

    def _on_robot_message(self, message, info):
        stamp, said = self._admit(message, info), convert_robot.robot_msg(message, self._frame)
        self._mission.hear(said, monotonic(), convert_robot.postscript(message))
        self._watch.hear(said, stamp)

    def _on_contracts(self, message, info):
        self._watch.hear(convert_contracts.contracts(message, self._frame), self._admit(message, info))

    def _on_solution(self, message):
        self._mission.collect(convert_mission.solution(message, self._frame), message.boot_epoch)

    def _certify(self):
        """Say again who is dead; a certificate that is not repeated counts on."""
        self._deaths.publish(convert_mission.deaths_message(self._mission.deaths.values(), self._now(), self._frame))

    def _on_tick(self):
        self._mission.step(monotonic(), self._now())
        self._watch.look(self._now())
        for sentence in self._watch.violations[self._alarms:]:
            self.get_logger().error(sentence)
        self._alarms = len(self._watch.violations)
        # Who has just been started listens first: the robots may be on their way.
        if self._mission.state is not State.WAITING or monotonic() > self._born + _LISTEN:
            self._announce()
        if self._mission.is_over(monotonic()):
            self._tick.cancel()
            self._judge()

    def _judge(self):
        """Report, publish, print and write; then end the node, whatever happens."""
        code, bodies, environment = 1, self._scene.bodies(), self._scene.environment()
        try:
            self.get_logger().info(f'mission {self._mission.name} ended: {self._mission.why}')
            report = self._watch.summed_up(self._mission.report(bodies, environment), self._mission.start_time)
            self._reports.publish(convert_mission.report_message(
                report, self._now(), self._watch.proofs, self._watch.unchecked))
            for publisher in self._missions, self._reports:
                publisher.wait_for_all_acked(_FAREWELL)
            print(report.table(), flush=True)
            if self._options.out:
                for path in write_outcome(self._options.out, report, self._mission.solutions, bodies, environment):
                    print(f'{"written":<24}{path}', flush=True)
            code = 0 if report.valid else 1
        except OSError as error:
            self.get_logger().error(f'the outcome cannot be written to {self._options.out}: {error}')
        except Exception as error:
            self._guard.note(error, 'judge')
        raise SystemExit(code)

    def _on_markers(self):
        self._markers.publish(convert_views.fleet_markers(
            self._scene.bodies(), self._mission.heard, COLOURS, self._now(), self._options.frame_id))

    def _diagnosis(self):
        mission = self._mission
        lack = mission.lack(monotonic()) if mission.state is State.WAITING else ''
        silent = mission.silent(monotonic())
        facts = {'robots': len(mission.robot_ids), 'silent': silent, 'lack': lack, 'solutions': len(mission.solutions),
                 'dead': sorted(mission.deaths), 'proofs': self._watch.proofs, 'unchecked': self._watch.unchecked,
                 'violations': len(self._watch.violations),
                 **{f'{why} messages': count for why, count in self._peers.refused.items()}}
        if self._watch.violations:
            return Level.ERROR, self._watch.violations[-1], facts
        level = Level.WARN if silent or lack else Level.OK
        return level, f'mission {mission.name}: {mission.state.name.lower()}', facts
