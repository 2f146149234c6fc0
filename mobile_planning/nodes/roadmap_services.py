"""The services by which a node's roadmaps are built, saved, loaded and forgotten."""
from __future__ import annotations

import time
from typing import TYPE_CHECKING

from mobile_planning_msgs.srv import BuildRoadmap, RoadmapFile
from std_srvs.srv import Trigger

from mobile_planning.nodes.convert import duration_message
from mobile_planning.nodes.guard import tell_code, tell_sentence
from mobile_planning.nodes.sampling_planner_site import SamplingSite
from mobile_planning.nodes.worker import Worker

if TYPE_CHECKING:
    from mobile_planning.nodes.sampling_planner import SamplingPlanner


class RoadmapServices:
    """Answers in the worker's thread.

    Parameters
    ----------
    node : SamplingPlanner
    site : SamplingSite
    worker : Worker

    Attributes
    ----------
    offered : tuple of (type, str, coroutine function, function)
        Kind and name of each service, what answers it, and what tells its failure.
    """

    def __init__(self, node: SamplingPlanner, site: SamplingSite, worker: Worker):
        self._node, self._site, self._worker = node, site, worker
        self.offered = ((BuildRoadmap, 'build_roadmap', self._on_build, tell_code),
                        (RoadmapFile, 'save_roadmap', self._on_save, tell_code),
                        (RoadmapFile, 'load_roadmap', self._on_load, tell_code),
                        (Trigger, 'clear', self._on_clear, tell_sentence))

    async def _on_build(self, request, response):
        """Build a roadmap anew."""
        self._node.require_room()
        until, began = self._node.until(request.deadline), time.perf_counter()
        facts = await self._worker.run(self._site.build_roadmap, request.planner, request.nodes, request.seed, until,
                                       self._node.seconds_now(), self._worker.stop, until=until)
        response.radius, response.planning_time = float(facts.radius), duration_message(time.perf_counter() - began)
        return self._told(response, facts, 'built')

    async def _on_save(self, request, response):
        """Write a roadmap to a file."""
        self._node.require_room()
        return self._told(response, await self._worker.run(self._site.save_roadmap, request.planner, request.path),
                          'saved')

    async def _on_load(self, request, response):
        """Take a roadmap from a file."""
        self._node.require_room()
        facts = await self._worker.run(self._site.load_roadmap, request.planner, request.path,
                                       self._node.seconds_now())
        return self._told(response, facts, 'loaded')

    async def _on_clear(self, request, response):
        """Forget all roadmaps."""
        self._node.require_room()
        await self._worker.run(self._site.clear)
        response.success, response.message = True, 'no roadmap is kept'
        return response

    def _told(self, response, facts, done):
        """Write the size of a roadmap into the response."""
        response.nodes, response.edges = int(facts.nodes), int(facts.edges)
        self._node.get_logger().info(f'{done} a roadmap of {facts.nodes} nodes and {facts.edges} edges')
        return response
