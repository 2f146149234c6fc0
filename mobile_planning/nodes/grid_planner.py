"""The node ``grid_planner``: answers path queries on the map that is published."""
from __future__ import annotations

import time

from mobile_planning_msgs.msg import CostUpdates
from mobile_planning_msgs.srv import PlanPath, UpdateCosts
from nav_msgs.msg import OccupancyGrid as OccupancyGridMessage
from nav_msgs.srv import GetPlan
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import Trigger

from mobile_planning.errors import InvalidInput
from mobile_planning.nodes import qos
from mobile_planning.nodes.convert import duration_message, key_values, seconds
from mobile_planning.nodes.convert_map import occupancy_grid
from mobile_planning.nodes.field_publisher import FieldPublisher
from mobile_planning.nodes.grid_planner_options import GridPlannerOptions
from mobile_planning.nodes.guard import tell_code, tell_nothing, tell_sentence
from mobile_planning.nodes.managed import ManagedNode
from mobile_planning.nodes.path_publisher import PathPublisher
from mobile_planning.nodes.planning_basis import PlanningBasis
from mobile_planning.nodes.planning_site import PlanningSite
from mobile_planning.nodes.progress import ProgressPublisher
from mobile_planning.nodes.worker import Worker
from mobile_planning.warm_up import warm_up


class GridPlanner(ManagedNode):
    """Plans on the newest map, one request after the other, while its executor goes on answering."""

    # rclpy destroys a node whose parameters were refused, too.
    _worker = None

    def __init__(self, **kwargs):
        super().__init__('grid_planner', GridPlannerOptions, **kwargs)
        self.get_logger().info('loading the compiled planners')
        # Whoever finds the services is answered within his deadline, so they come after what takes seconds to load.
        warm_up('world', 'grid')
        self._site, self._worker = PlanningSite(self._nothing_heard()), Worker(self)
        self._heard, self._paths, self._progress, self._fields = [], None, None, None
        # The coroutines in it wait for the worker; in the default group everything else would wait with them.
        self._waiting = ReentrantCallbackGroup()
        for kind, name, answer, fail in (
                (PlanPath, 'plan_path', self._on_plan_path, tell_code),
                (GetPlan, 'get_plan', self._on_get_plan, tell_nothing),
                (UpdateCosts, 'update_costs', self._on_update_costs, tell_code),
                (Trigger, 'publish_cost_to_go', self._on_publish_cost_to_go, tell_sentence)):
            self.create_service(kind, f'~/{name}', self.guard.service(answer, fail), qos_profile=qos.REQUESTS,
                                callback_group=self._waiting)
        self.start()

    def configure(self) -> None:
        """Listen to the map and offer the path."""
        self._paths = PathPublisher(self, self.guard)
        self._progress = ProgressPublisher(self, self.guard, lambda: self._site.under_way)
        self._fields = FieldPublisher(self)
        self._hear(OccupancyGridMessage, self.options.map_topic, self._on_map, qos.MAP)
        self._hear(CostUpdates, '~/cost_updates', self._on_cost_updates, qos.REQUESTS)
        for name, topic in self.options.mask_topics.items():
            self._hear(OccupancyGridMessage, topic, self._on_mask(name), qos.MAP)

    def cleanup(self) -> None:
        """Forget the map and the path."""
        while self._heard:
            self.destroy_subscription(self._heard.pop())
        for publisher in (self._paths, self._progress, self._fields):
            if publisher:
                publisher.destroy()
        self._paths = self._progress = self._fields = None
        self._site.wanted = self._nothing_heard()

    def change(self, options: GridPlannerOptions) -> None:
        """Plan with other options from the next request on."""
        self._site.wanted = self._site.wanted.with_options(options)

    def facts(self) -> dict[str, object]:
        """Return the map and how many requests wait."""
        basis = self._site.wanted
        return {'map': basis.grid or 'none', 'frame': basis.frame, 'waiting': self._worker.waiting}

    def destroy_node(self) -> None:
        """Stop the planning under way, then end."""
        if self._worker is not None:
            self._worker.close()
        super().destroy_node()

    def _nothing_heard(self):
        """Return what is planned on before a map has come."""
        return PlanningBasis.without_map(self.options, self.options.mask_topics)

    def _hear(self, kind, topic, hear, profile):
        """Subscribe until `cleanup`."""
        self._heard.append(self.create_subscription(kind, topic, self.guard.callback(hear), profile,
                                                    callback_group=self._waiting))

    async def _on_map(self, message):
        """Plan on another map from the next request on; a bad one changes nothing."""
        grid = occupancy_grid(message)
        self._site.wanted = self._site.wanted.with_map(grid, message.header.frame_id)
        self.get_logger().info(f'received a map in frame {message.header.frame_id!r}: {grid}')
        await self._worker.run(self._site.adopt)

    def _on_mask(self, name):
        """Return the callback that plans under another mask from the next request on; a bad one changes nothing."""
        def on_mask(message):
            self._site.wanted = self._site.wanted.with_mask(name, occupancy_grid(message), message.header.frame_id)
            self.get_logger().info(f'received the {name} mask')
        return on_mask

    async def _on_cost_updates(self, updates):
        """Change costs once the requests that came before are answered; a bad update changes nothing."""
        await self._worker.run(self._site.update_costs, self._site.wanted, updates.header.frame_id, updates.cells,
                               updates.costs)
        self.get_logger().debug(f'changed the costs of {len(updates.cells)} cells')

    async def _on_update_costs(self, request, response):
        """Answer one request to change costs."""
        self._require_room()
        await self._on_cost_updates(request.updates)
        return response

    async def _on_publish_cost_to_go(self, request, response):
        """Publish the costs to the goal of the newest path."""
        self._require_room()
        until = time.monotonic() + self.options.default_deadline
        with self._progress.watched():
            grid, frame, goal, planner, field = await self._worker.run(
                self._site.cost_to_go, until, self._worker.stop, until=until)
        self.require_active()
        self._fields.publish(grid, frame, goal, planner, field)
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
        self._require_room()
        if deadline < 0:
            raise InvalidInput(f'the deadline of {deadline:g} s is negative')
        # Another publisher may have come before the answer.
        until, paths = time.monotonic() + (deadline or self.options.default_deadline), self._paths
        with self._progress.watched():
            plan, frame = await self._worker.run(self._site.plan, planner, request.start, request.goal, until, seed,
                                                 request.tolerance, self._worker.stop, until=until)
        message = paths.message(plan.poses, frame)
        self.get_logger().info(f'path of {len(plan.poses)} poses and cost {plan.cost:.3f} m '
                               f'in {plan.planning_time * 1e3:.1f} ms')
        return plan, message

    def _require_room(self):
        """Refuse a request while the node is not active or too many wait."""
        self.require_active()
        self._worker.require_room()
