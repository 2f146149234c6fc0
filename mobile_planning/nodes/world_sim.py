"""The node ``world_sim``: starts a mission, gathers its solutions, judges, draws and reports them."""
from __future__ import annotations

from dataclasses import dataclass
from time import monotonic

from mobile_planning_msgs.msg import Mission as MissionMessage
from mobile_planning_msgs.msg import MissionReport
from mobile_planning_msgs.msg import RobotMsg as RobotMessage
from mobile_planning_msgs.msg import Solution as SolutionMessage
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.duration import Duration
from rclpy.node import Node
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from mobile_planning.drawing.missions import COLOURS
from mobile_planning.errors import InvalidInput
from mobile_planning.fleet.announcement import State
from mobile_planning.fleet.mission import Mission
from mobile_planning.fleet.scene import MAX_ROBOTS
from mobile_planning.fleet.scene_file import load_scene
from mobile_planning.fleet.world_sim import require_apart
from mobile_planning.nodes import convert_mission, convert_robot, convert_views, qos
from mobile_planning.nodes.diagnostics import Diagnostics, Level
from mobile_planning.nodes.guard import Guard, tell_sentence
from mobile_planning.nodes.parameters import Parameters, option
from mobile_planning.outcome import write_outcome

# The node's last words wait so long for those who listen.
_FAREWELL = Duration(seconds=1.0)


@dataclass(frozen=True)
class WorldSimOptions:
    """Parameters of the node."""

    scene: str = option('', 'YAML file of the scene', read_only=True)
    scene_robots: int = option(0, 'robots the scene is to have, 0 for as many as it says', low=0, high=MAX_ROBOTS,
                               read_only=True)
    out: str = option('', 'folder for report.json and mission.png, empty for none', read_only=True)
    autostart: bool = option(True, 'start as soon as every robot hears every other; else on ~/start', read_only=True)
    discovery_timeout: float = option(60.0, 'robots that are not ready so long after the start was wanted fail the '
                                      'mission [s]', low=0.1, high=3600.0, read_only=True)
    frame_id: str = option('map', 'frame of all poses', read_only=True)

    def __post_init__(self):
        if not self.scene:
            raise InvalidInput('world_sim needs the parameter scene: the YAML file of a scene')


class WorldSimNode(Node):
    """Wires a `Mission` to the topics; ends by itself with 0 for a valid mission, else with 1."""

    def __init__(self, **kwargs):
        super().__init__('world_sim', **kwargs)
        self._options, self._guard = Parameters(self, WorldSimOptions).values, Guard(self)
        self._scene = load_scene(self._options.scene, self._options.scene_robots or None)
        require_apart(self._scene.bodies())
        ids = [spec.id for spec in self._scene.robots]
        self._mission = Mission(self._scene.name, ids, self._scene.timeout, self._options.discovery_timeout,
                                autostart=self._options.autostart, now=monotonic())
        self._announced = None
        self._missions = self.create_publisher(MissionMessage, '/mission', qos.MISSION)
        self._reports = self.create_publisher(MissionReport, '~/report', qos.latched())
        self._markers = self.create_publisher(MarkerArray, '~/markers', qos.live(1))
        guarded = self._guard.callback
        self.create_subscription(RobotMessage, '/robot_msgs', guarded(self._on_robot_message),
                                 qos.robot_messages(4 * len(ids)))
        self.create_subscription(SolutionMessage, '/solutions', guarded(self._on_solution), qos.SOLUTION_READER)
        self.create_service(Trigger, '~/start', self._guard.service(self._on_start, tell_sentence))
        self.create_service(Trigger, '~/stop', self._guard.service(self._on_stop, tell_sentence))
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(0.1, guarded(self._on_tick), clock=steady)
        self.create_timer(0.5, guarded(self._on_markers), clock=steady)
        Diagnostics(self, self._guard, self._diagnosis)
        self._announce()

    def _now(self) -> float:
        return self.get_clock().now().nanoseconds * 1e-9

    def _announce(self):
        """Tell the robots what is new."""
        news = self._mission.announcement
        if news != self._announced:
            self._announced = news
            self._missions.publish(convert_mission.mission_message(news, self._now()))
            self.get_logger().info(f'mission {news.name} with robots {list(news.robot_ids)}: {news.state.name.lower()}')

    def _on_robot_message(self, message):
        self._mission.hear(convert_robot.robot_msg(message, self._options.frame_id), monotonic())

    def _on_solution(self, message):
        self._mission.collect(convert_mission.solution(message, self._options.frame_id), message.boot_epoch)

    def _on_start(self, _request, response):
        self._mission.start(monotonic())
        response.success, response.message = True, 'the mission starts when every robot hears every other'
        return response

    def _on_stop(self, _request, response):
        self._mission.stop('it was stopped by ~/stop', monotonic())
        self._announce()
        response.success, response.message = True, 'the robots finish their plans and stay'
        return response

    def _on_tick(self):
        self._mission.step(monotonic(), self._now())
        self._announce()
        if self._mission.is_over(monotonic()):
            self._judge()

    def _judge(self):
        """Report, publish, print and write; then end the node, whatever happens."""
        code, bodies, environment = 1, self._scene.bodies(), self._scene.environment()
        try:
            self.get_logger().info(f'mission {self._mission.name} ended: {self._mission.why}')
            report = self._mission.report(bodies, environment)
            self._reports.publish(convert_mission.report_message(report, self._now()))
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
        level = Level.WARN if silent or lack else Level.OK
        return level, f'mission {mission.name}: {mission.state.name.lower()}', {
            'robots': len(mission.robot_ids), 'silent': silent, 'lack': lack, 'solutions': len(mission.solutions)}
