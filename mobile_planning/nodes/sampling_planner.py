"""The node ``sampling_planner``: paths of cars by trees and roadmaps, on the map and among obstacles that move."""
from __future__ import annotations

import time

from builtin_interfaces.msg import Duration
from mobile_planning_msgs.action import ComputePath
from mobile_planning_msgs.msg import ObstacleArray
from mobile_planning_msgs.srv import PlanPath
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import Trigger
from visualization_msgs.msg import MarkerArray

from mobile_planning.errors import InvalidInput
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import duration_message, key_values, seconds
from mobile_planning.nodes.convert_map import occupancy_grid
from mobile_planning.nodes.convert_obstacles import graph_markers
from mobile_planning.nodes.guard import tell_code, tell_sentence
from mobile_planning.nodes.managed import ManagedNode
from mobile_planning.nodes.path_action import PathAction, UnderWay
from mobile_planning.nodes.path_publisher import PathPublisher
from mobile_planning.nodes.roadmap_services import RoadmapServices
from mobile_planning.nodes.sampling_planner_options import SamplingPlannerOptions
from mobile_planning.nodes.sampling_planner_site import SamplingBasis, SamplingSite
from mobile_planning.nodes.worker import Worker
from mobile_planning.warm_up import warm_up


class SamplingPlanner(ManagedNode):
    """Plans on the newest map among the newest obstacles, one request after the other."""

    # rclpy destroys a node whose parameters were refused, too.
    _worker = _action = None

    def __init__(self, **kwargs):
        super().__init__('sampling_planner', SamplingPlannerOptions, **kwargs)
        self.get_logger().info('loading the compiled planners')
        # Whoever finds the services is answered within his deadline, so they come after what takes seconds to load.
        warm_up('world', 'sampling')
        self._site, self._worker = SamplingSite(SamplingBasis(self.options.sampling())), Worker(self)
        self._heard, self._paths, self._trees = [], None, None
        # The coroutines in it wait for the worker; in the default group everything else would wait with them.
        self._waiting = ReentrantCallbackGroup()
        for kind, name, answer, fail in (
                (PlanPath, 'plan_path', self._on_plan_path, tell_code),
                *RoadmapServices(self, self._site, self._worker).offered,
                (Trigger, 'publish_tree', self._on_publish_tree, tell_sentence)):
            self.create_service(kind, f'~/{name}', self.guard.service(answer, fail), qos_profile=qos.REQUESTS,
                                callback_group=self._waiting)
        self._action = PathAction(self, self.guard, self._on_compute_path, self._waiting)
        self.start()

    def configure(self) -> None:
        """Listen to map and obstacles, offer path and tree."""
        self._paths = PathPublisher(self, self.guard)
        self._trees = self.create_lifecycle_publisher(MarkerArray, '~/tree', qos.PATH)
        for kind, topic, hear in ((OccupancyGridMessage, self.options.map_topic, self._on_map),
                                  (ObstacleArray, self.options.obstacles_topic, self._on_obstacles)):
            self._heard.append(self.create_subscription(kind, topic, self.guard.callback(hear), qos.MAP))

    def cleanup(self) -> None:
        """Forget the map, the obstacles and the path."""
        while self._heard:
            self.destroy_subscription(self._heard.pop())
        if self._paths:
            self._paths.destroy()
        if self._trees:
            self.destroy_lifecycle_publisher(self._trees)
        self._paths = self._trees = None
        self._site.wanted = SamplingBasis(self.options.sampling())

    def change(self, options: SamplingPlannerOptions) -> None:
        """Plan with other options from the next request on."""
        self._site.change(options=options.sampling())

    def facts(self) -> dict[str, object]:
        """Return the map and how many requests wait."""
        basis = self._site.wanted
        return {'map': basis.grid or 'none', 'frame': basis.frame, 'waiting': self._worker.waiting}

    def destroy_node(self) -> None:
        """Stop the planning under way, then end."""
        if self._action is not None:
            self._action.close()
        if self._worker is not None:
            self._worker.close()
        super().destroy_node()

    def _on_map(self, message):
        """Plan on another map from the next request on; a bad one changes nothing."""
        grid = occupancy_grid(message)
        self._site.change(grid=grid, frame=message.header.frame_id)
        self.get_logger().info(f'received a map in frame {message.header.frame_id!r}: {grid}')

    def _on_obstacles(self, message):
        """Plan among other obstacles from the next request on; bad ones change nothing."""
        self._site.change_obstacles(message, self.seconds_now())
        self.get_logger().debug('received obstacles')

    async def _on_plan_path(self, request, response):
        """Answer one PlanPath request."""
        under_way = UnderWay()
        under_way.stop = self._worker.stop
        return await self._answer(request, under_way, response)

    async def _on_compute_path(self, request, under_way):
        """Return the result of one goal."""
        return await self._answer(request, under_way, ComputePath.Result())

    async def _answer(self, request, under_way, response):
        """Plan for a request and write the path, which is published too, into the response."""
        self.require_room()
        # Another publisher may have come before the answer.
        until, paths = self.until(request.deadline), self._paths
        under_way.future = self._worker.submit(
            self._site.plan, request.planner, request.start, request.goal, until, request.seed, self.seconds_now(),
            under_way.stop, under_way.progress)
        plan, frame = await self._worker.wait(under_way.future, until)
        response.path = paths.message(plan.poses, frame)
        response.cost, response.planning_time = float(plan.cost), duration_message(plan.planning_time)
        response.statistics = key_values(plan.statistics)
        self.get_logger().info(f'path of {len(plan.poses)} poses and cost {plan.cost:.3f} m '
                               f'in {plan.planning_time * 1e3:.1f} ms')
        return response

    async def _on_publish_tree(self, request, response):
        """Publish the newest tree or roadmap."""
        self.require_room()
        edges, frame = await self._worker.run(self._site.newest_graph)
        self.require_active()
        self._trees.publish(graph_markers(edges, frame, self.get_clock().now().to_msg()))
        response.success, response.message = True, f'{len(edges)} edges'
        return response

    def require_room(self) -> None:
        """Refuse a request while the node is not active or too many wait; raises PlanningError."""
        self.require_active()
        self._worker.require_room()

    def until(self, deadline: Duration) -> float:
        """Return when the time of a request is over [s], on the monotonic clock; InvalidInput if it is negative."""
        if seconds(deadline) < 0:
            raise InvalidInput(f'the deadline of {seconds(deadline):g} s is negative')
        return time.monotonic() + (seconds(deadline) or self.options.default_deadline)

    def seconds_now(self) -> float:
        """Return the time [s] on the node's clock."""
        return self.get_clock().now().nanoseconds * 1e-9
