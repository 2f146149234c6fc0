"""The node ``grid_planner``: answers path queries on the map that is published."""
from __future__ import annotations

import time
from dataclasses import dataclass

from mobile_planning_msgs.msg import CostToGo, CostUpdates
from mobile_planning_msgs.srv import PlanPath, UpdateCosts
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import Trigger

from mobile_planning.errors import InvalidInput, LimitExceeded
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import (
    cost_to_go_message, duration_message, key_values, occupancy_grid, path_message, seconds)
from mobile_planning.nodes.managed import ManagedNode
from mobile_planning.nodes.parameters import option
from mobile_planning.nodes.planning_site import PlanningSite
from mobile_planning.nodes.worker import Worker
from mobile_planning.path_server import PathServer
from mobile_planning.warm_up import warm_up

MAX_WAITING, MOST_POSES_KEPT = 64, 10_000


@dataclass(frozen=True)
class GridPlannerOptions:
    """The parameters of the node."""

    autostart: bool = option(True, 'whether the node configures and activates itself', read_only=True)
    map_topic: str = option('map', 'latched topic of the map', read_only=True)
    keepout_topic: str = option('', 'latched topic of a mask of forbidden cells, empty for none', read_only=True)
    speed_topic: str = option('', 'latched topic of a mask of speeds in percent, empty for none', read_only=True)
    inflation_radius: float = option(0.0, 'by which obstacles and forbidden cells grow, the radius of the robot [m]',
                                     low=0.0, high=100.0)
    corner_cutting: bool = option(False, 'whether a diagonal step may pass between or beside occupied cells')
    unknown_is_free: bool = option(False, 'whether unknown cells may be entered')
    turning_radius: float = option(0.5, "least radius of the lattice's curves [m]", low=0.001, high=100.0)
    default_planner: str = option('distance_transform', 'planner of a request that names none')
    default_deadline: float = option(5.0, 'time for a request that gives none [s]', low=1e-3, high=3600.0)

    def __post_init__(self):
        self.path_server()

    def path_server(self) -> PathServer:
        """Return a path server with these options, without a map."""
        return PathServer(self.default_planner, inflation_radius=self.inflation_radius,
                          corner_cutting=self.corner_cutting, unknown_is_free=self.unknown_is_free,
                          turning_radius=self.turning_radius)


class GridPlanner(ManagedNode):
    """Plans on the newest map, one request after the other, while its executor goes on answering."""

    # rclpy destroys a node whose parameters were refused, too.
    _worker = None

    def __init__(self, **kwargs):
        super().__init__('grid_planner', GridPlannerOptions, **kwargs)
        self._masks = {name: topic for name, topic in (
            ('keepout', self.options.keepout_topic), ('speed', self.options.speed_topic)) if topic}
        self._site, self._worker = PlanningSite(self.options, self._masks), Worker(self)
        self._heard, self._publisher, self._field_publisher = [], None, None
        # The newest path until it is published, and the messages that all paths are written into.
        self._path, self._poses = None, []
        # The coroutines in it wait for the worker; in the default group everything else would wait with them.
        self._waiting = ReentrantCallbackGroup()
        for kind, name, answer, fail in (
                (PlanPath, 'plan_path', self._on_plan_path, _say), (GetPlan, 'get_plan', self._on_get_plan, _be_empty),
                (UpdateCosts, 'update_costs', self._on_update_costs, _say),
                (Trigger, 'publish_cost_to_go', self._on_publish_cost_to_go, _decline)):
            self.create_service(kind, f'~/{name}', self.guard.service(answer, fail), qos_profile=qos.REQUESTS,
                                callback_group=self._waiting)
        self.start()

    def configure(self) -> None:
        """Listen to the map, offer the path, and load the compiled planners before somebody waits for them."""
        self._worker.submit(warm_up)
        self._publisher = self.create_lifecycle_publisher(Path, '~/path', qos.PATH)
        self._field_publisher = self.create_lifecycle_publisher(CostToGo, '~/cost_to_go', qos.PATH)
        for kind, topic, hear, profile in (
                (OccupancyGridMessage, self.options.map_topic, self._on_map, qos.MAP),
                (CostUpdates, '~/cost_updates', self._on_cost_updates, qos.REQUESTS),
                *((OccupancyGridMessage, topic, self._hear_mask(name), qos.MAP)
                  for name, topic in self._masks.items())):
            self._heard.append(self.create_subscription(kind, topic, self.guard.callback(hear), profile,
                                                        callback_group=self._waiting))

    def cleanup(self) -> None:
        """Forget the map and the path."""
        while self._heard:
            self.destroy_subscription(self._heard.pop())
        for publisher in (self._publisher, self._field_publisher):
            if publisher:
                self.destroy_lifecycle_publisher(publisher)
        self._publisher = self._field_publisher = None
        self._site.want(self.options, None, '')

    def change(self, options: GridPlannerOptions) -> None:
        """Plan with other options from the next request on."""
        self._site.want(options, self._site.grid, self._site.frame)

    def facts(self) -> dict[str, object]:
        """Return the map and how many requests wait."""
        return {'map': self._site.grid or 'none', 'frame': self._site.frame, 'waiting': self._worker.waiting}

    def destroy_node(self) -> None:
        """Stop the planning under way, then end."""
        if self._worker is not None:
            self._worker.close()
        super().destroy_node()

    async def _on_map(self, message):
        """Plan on another map from the next request on; a bad one changes nothing."""
        grid = occupancy_grid(message)
        self._site.want(self.options, grid, message.header.frame_id)
        self.get_logger().info(f'received a map in frame {message.header.frame_id!r}: {grid}')
        await self._worker.run(self._site.adopt)

    def _hear_mask(self, name):
        """Return the callback of a mask: it counts from the next request on, a bad one changes nothing."""
        def hear_mask(message):
            self._site.want_mask(name, occupancy_grid(message), message.header.frame_id)
            self.get_logger().info(f'received the {name} mask')
        return hear_mask

    async def _on_cost_updates(self, message):
        """Change costs of the map; a bad update changes nothing."""
        await self._update(message)

    async def _on_update_costs(self, request, response):
        """Answer one request to change costs."""
        self.require_active()
        self._refuse_crowd()
        await self._update(request.updates)
        return response

    async def _on_publish_cost_to_go(self, request, response):
        """Publish the costs to the goal of the newest path."""
        self.require_active()
        self._refuse_crowd()
        until = time.monotonic() + self.options.default_deadline
        grid, frame, goal, planner, field = await self._worker.run(self._site.cost_to_go, until, self._worker.stop)
        self._field_publisher.publish(
            cost_to_go_message(grid, field, goal, planner, frame, self.get_clock().now().to_msg()))
        response.success, response.message = True, f'field of {planner} to ({goal[0]:g}, {goal[1]:g})'
        return response

    async def _on_plan_path(self, request, response):
        """Answer one PlanPath request."""
        plan, response.path = await self._answer(request, seconds(request.deadline), request.planner, request.seed)
        response.cost, response.planning_time = float(plan.cost), duration_message(plan.planning_time)
        response.statistics = key_values(plan.statistics)
        return response

    async def _on_get_plan(self, request, response):
        """Answer one request of the kind that Nav2 had before it had error codes."""
        _, response.plan = await self._answer(request)
        return response

    async def _answer(self, request, deadline=0.0, planner='', seed=0):
        """Return the plan for a request and its message, which is published too."""
        self.require_active()
        if deadline < 0:
            raise InvalidInput(f'the deadline of {deadline:g} s is negative')
        self._refuse_crowd()
        until = time.monotonic() + (deadline or self.options.default_deadline)
        plan, frame = await self._worker.run(
            self._site.plan, planner, request.start, request.goal, until, seed, request.tolerance, self._worker.stop)
        self._publish()
        self._path = path_message(plan.poses, frame, self.get_clock().now().to_msg(), self._poses)
        del self._poses[MOST_POSES_KEPT:]
        # Once the answer is out, for which somebody waits.
        self.executor.create_task(self.guard.callback(self._publish))
        self.get_logger().info(f'path of {len(plan.poses)} poses and cost {plan.cost:.3f} m '
                               f'in {plan.planning_time * 1e3:.1f} ms')
        return plan, self._path

    async def _update(self, updates):
        """Change costs once the requests that came before are answered."""
        await self._worker.run(self._site.update_costs, self._site.wanted, updates.header.frame_id, updates.cells,
                               updates.costs)
        self.get_logger().debug(f'changed the costs of {len(updates.cells)} cells')

    def _refuse_crowd(self):
        """Refuse a request while too many wait."""
        if self._worker.waiting >= MAX_WAITING:
            raise LimitExceeded(f'{self._worker.waiting} requests are waiting: the limit is {MAX_WAITING}')

    def _publish(self):
        """Publish the newest path, if that is still to be done."""
        if self._path is not None and self._publisher is not None:
            self._publisher.publish(self._path)
        self._path = None


def _say(response, error):
    """Answer with the code and the sentence."""
    response.error_code, response.error_msg = int(getattr(error, 'code', PlanPath.Response.UNKNOWN)), str(error)


def _decline(response, error):
    """Answer with the sentence."""
    response.success, response.message = False, str(error)


def _be_empty(response, error):
    """Answer with the empty plan that the response is already: there is no field for more."""
